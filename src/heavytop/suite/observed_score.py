"""Attitudes, positions and Ω in any axes, scored like a state: how many digits of the columns are right, and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy

from heavytop.errors import HeavyTopError
from heavytop.exact.balls import midpoint, working_precision
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.diagnosis import Diagnosis, diagnose
from heavytop.measure.digits import RELATIVE, relative_error
from heavytop.measure.drift import Running
from heavytop.measure.known_attitude import truth_with_attitude
from heavytop.measure.mistaken_conventions import mistake, sampled
from heavytop.measure.observations import ObservedScorer, state_of
from heavytop.measure.scalar import GUARD_BITS, to_ball
from heavytop.measure.supposed_readings import disagreement
from heavytop.measure.truth import Truth
from heavytop.measure.written import explains, rounding
from heavytop.precision import Precision, decimal_text, round_to, shown
from heavytop.records import Metric, Quantity, by_name
from heavytop.suite.given import Given
from heavytop.suite.observed_given import Observed
from heavytop.top.heavy_top import dot

_WORTH_ASKING = 1e-10
_OVERLAP = 1e-6
"""Columns that say the same must agree to that."""
_PART = 0.1
"""A length explains an error that is at most so many times as large, turned over."""
_WORDS = {
    "omega": "Ω in body axes",
    "omega_space": "Ω in axes of space",
    "gamma": "γ",
    "quaternion": "quaternion",
    "matrix": "matrix",
    "euler": "Euler angles",
    "position": "position",
}


def exact_problem(given: Given) -> Problem:
    """The problem in the format of the trajectory, whose principal data are exact: the body was rounded before."""
    found = observed_of(given)
    top, start = found.posed.top, found.posed.start
    attitude = set(found.columns) - {"omega", "gamma"}
    parameters = given.system.parameters(top, start)
    xi = found.posed.xi if attitude else None
    return Problem(given.system, given.precision, parameters, start, xi, (top, start))


def observed_of(given: Given) -> Observed:
    """What the trajectory gives."""
    assert given.observed is not None
    return given.observed


@dataclass(frozen=True, slots=True)
class Scored:
    """A scored trajectory: what measured it, and the relative error of each sample where the reference goes."""

    problem: Problem
    scorer: ObservedScorer
    errors: list[float]


def scored(
    given: Given, times: Sequence[Fraction], keep: Sequence[Fraction], effort: float, progress: Callable[[], None]
) -> Scored:
    """Every sample up to the first that is not finite, compared with the true motion.  times: rounded to the format."""
    found, problem = observed_of(given), exact_problem(given)
    true = truth_with_attitude(problem, times, effort)
    known = true if isinstance(true, str) else true.remembered()
    scorer = ObservedScorer(problem, known, found.posed, found.said, found.names, keep)
    errors: list[float] = []
    for row, time in enumerate(times[: _count(found)]):
        scorer(time, found.sample(row))
        if scorer.error is not None and scorer.error.truth.covers(time):
            errors.append(scorer.error.last)
        progress()
    return Scored(problem, scorer, errors)


def _count(found: Observed) -> int:
    return min(map(len, found.columns.values()), default=0)


def peer_metrics(
    problem: Problem, truth: Truth, times: Sequence[Fraction], limit: int, progress: Callable[[], None]
) -> tuple[dict[str, Metric], int] | None:
    """heyoka's own run of the same problem rounded to the format: the metric of its digits, and its steps.

    None where heyoka does not get there.
    """
    running, bits = Running(), problem.precision.bits + GUARD_BITS

    def observe(time: Fraction, state: Sequence[object]) -> None:
        if truth.covers(time):
            true = truth.state(time, bits)[: len(state)]
            with working_precision(bits):
                off = [to_ball(value) - known for value, known in zip(state, true, strict=True)]
                running.take(time, running.following(relative_error(off, true)), False)
        progress()

    try:
        run = propagate(
            problem.top,
            problem.start,
            times,
            problem.precision,
            system=problem.system,
            xi=problem.xi,
            step_limit=limit,
            observer=observe,
        )
    except HeavyTopError:  # a format that this platform lacks, or numbers outside its range
        return None
    if run.outcome is not Outcome.SUCCESS:
        return None
    with working_precision(bits):
        found = running.metrics(Quantity(RELATIVE.name, RELATIVE.component))
    return by_name({RELATIVE: found[RELATIVE]}), run.steps


def diagnoses(given: Given, error: float | None, errors: Sequence[float]) -> list[Diagnosis]:
    """What explains the error of the columns: their digits, lengths off 1, a convention, or another mistake."""
    found = observed_of(given)
    times = given.times[: _count(found)]
    rows = [row for row in given.states[: len(times)] if row is not None]
    said = _disagreements(found, times)
    written = rounding(rows, given.precision)
    if error is not None and error <= _WORTH_ASKING:
        rounded = written is not None and explains(written, error)
        return said + ([Diagnosis("rounded", {"to": written.kind, "digits": str(written.digits)})] if rounded else [])  # type: ignore[union-attr]
    lengths = _lengths(found, times, given.precision)
    if lengths is not None and (error is None or float(lengths.error or 0) >= _PART * error):
        return [*said, lengths]
    if written is not None and error is not None and explains(written, error):
        return [*said, Diagnosis("rounded", {"to": written.kind, "digits": str(written.digits)})]
    seen = found.seen(times)
    told = None if seen is None else mistake(sampled(seen))
    if told is not None and seen is not None:
        numbers = {"of": "data", **told.numbers} | ({"or": ", ".join(told.others)} if told.others else {})
        looked = sampled(seen)
        at = None if len(looked.times) == len(times) else (len(looked.times), len(times), shown(looked.times[-1]))
        return [*said, Diagnosis(told.kind, numbers, told.error, told.left, at)]
    return said + _of_states(given, times, error, errors)


def _of_states(
    given: Given, times: Sequence[Fraction], error: float | None, errors: Sequence[float]
) -> list[Diagnosis]:
    """What the columns have wrong that a file of Ω and γ may have as well, where they give the whole state."""
    found, bits = observed_of(given), given.precision.bits + GUARD_BITS
    states: list[tuple[Fraction, ...]] = []
    for row in range(len(times)):
        state = state_of(found.sample(row), found.said, found.posed, bits)
        if state is None:
            return []
        states.append(tuple(round_to(midpoint(value), given.precision.bits) for value in state))
    top, start = found.posed.top, found.posed.start
    return diagnose(top, start, given.system, times, states, given.precision, error, errors)


def _lengths(found: Observed, times: Sequence[Fraction], precision: Precision) -> Diagnosis | None:
    """Quaternions whose length is not 1, by more than roundings make of it."""
    rows = found.columns.get("quaternion", [])
    off = [abs(dot(row, row) + row[3] ** 2 - 1) / 2 for row in rows]
    if not off or max(off) <= 2**10 * precision.eps:
        return None
    worst = max(range(len(off)), key=lambda row: off[row])
    size = decimal_text(off[worst], 3)
    return Diagnosis("quaternion_length", {"off": size, "t": shown(times[worst])}, float(off[worst]))


def _disagreements(found: Observed, times: Sequence[Fraction]) -> list[Diagnosis]:
    """Columns that say the same and differ."""
    seen = found.seen(times)
    if seen is None:
        return []
    with numpy.errstate(all="ignore"):
        apart = disagreement(seen)
    said = []
    for (one, other), off in apart.items():
        if float(off.max()) > _OVERLAP:
            row = int(numpy.argmax(off > _OVERLAP))
            numbers = {"columns": f"{_WORDS[one]} and {_WORDS[other]}", "by": f"{float(off.max()):.2e}"}
            said.append(Diagnosis("columns_disagree", {**numbers, "t": shown(times[row])}))
    return said


def used(given: Given) -> str:
    """Which columns were scored, and how they were read."""
    found = observed_of(given)
    said, parts = found.said, []
    for name in found.names:
        text = _WORDS[name]
        if name == "quaternion":
            text += f" ({said.quaternion_order}, {said.quaternion.replace('_', ' ')})"
        elif name == "matrix":
            text += f" ({said.matrix.replace('_', ' ')})"
        elif name == "euler":
            text += f" ({said.sequence}, {said.angles})"
        elif name == "position":
            text += " of the centre of mass" if said.point is None else " of the point"
        parts.append(text)
    up = "" if not set(found.names) - {"omega", "gamma"} else f"; {said.up} points up"
    return f"Scored: {', '.join(parts)}{up}."
