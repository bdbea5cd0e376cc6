"""Score of a trajectory computed elsewhere: its row, heyoka's digits over the same times, its diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from typing import Any

import msgspec
import numpy
from flint import arb

from heavytop.cases import Case
from heavytop.errors import HeavyTopError
from heavytop.exact.flint.balls import whole_evaluation, working_precision
from heavytop.features.score.diagnose.readings import Observations, disagreement
from heavytop.features.score.diagnose.samples import FileAxes, turning_rate
from heavytop.features.score.diagnose.search import WORTH_ASKING, Diagnosis, rounded
from heavytop.features.score.trajectories.observed import GivenTrajectory, Observed
from heavytop.harness.plan import log_spaced
from heavytop.harness.rows import Task, computed_row, data_of, seconds_a_step
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.attitude_error import FORMS, ObservedScorer
from heavytop.measure.scalar import (
    GUARD_BITS,
    RELATIVE,
    Rounding,
    digits_kept,
    digits_of,
    digits_right,
    larger,
    metric,
    relative_error,
    roundings,
    to_ball,
)
from heavytop.measure.scorer import SOLUTION_ERROR, DriftAndError, Scorer
from heavytop.measure.truth import truth
from heavytop.precision import DOUBLE_DOUBLE, Precision, decimal_text, dot, exact, plain_decimal, round_to, time_text
from heavytop.records import Metric, Peer, Row, RowKey, Subject, by_name

Progress = Callable[[], None]

# Diagnosis of a scored trajectory of states, or of attitudes, positions and Ω in any axes.


_OVERLAP = 1e-6
"""Columns of one quantity must agree to that."""
_PART = 0.1
"""A length off 1 explains the error if it is at least this part of it."""
_WORDS = {
    "omega": "Ω in body axes",
    "omega_space": "Ω in space axes",
    "gamma": "γ",
    "quaternion": "quaternion",
    "matrix": "matrix",
    "euler": "Euler angles",
    "position": "position",
}


def exact_problem(trajectory: GivenTrajectory) -> Problem:
    """The problem in the format of the trajectory; of attitudes its data are exact: the body was rounded before."""
    if trajectory.observed is None:
        return Problem.of(trajectory.top, trajectory.start, trajectory.precision, trajectory.system)
    posed, attitude = trajectory.observed.posed, set(trajectory.observed.columns) - {"omega", "gamma"}
    parameters, xi = trajectory.system.parameters(posed.top, posed.start), posed.xi if attitude else None
    return Problem(trajectory.system, trajectory.precision, parameters, posed.start, xi, (posed.top, posed.start))


@dataclass(frozen=True, slots=True)
class Scored:
    """A scored trajectory: its row, what measured it, and the relative error of each sample with a reference."""

    row: Row
    problem: Problem
    scorer: DriftAndError
    errors: list[float]


def diagnoses(trajectory: GivenTrajectory, error: float | None, errors: Sequence[float]) -> list[Diagnosis]:
    """Explanations of the error: the digits written, lengths off 1, a convention, or another mistake."""
    about: dict[str, Any] = {"step": trajectory.step}
    count = len(_finite(trajectory))
    times, states = trajectory.times[:count], _finite(trajectory)
    explanations: list[Diagnosis] = []
    if (observed := trajectory.observed) is not None:
        samples = observed.observations(times)
        explanations = [] if samples is None else _disagreements(samples, times)
        digits_written = rounded(_amplified(observed, roundings(states, trajectory.precision)), error)
        if error is not None and ((error <= WORTH_ASKING and len(errors) == count) or digits_written):
            return explanations + digits_written
        lengths = _lengths(observed, times, trajectory.precision)
        if lengths is not None and (error is None or float(lengths.error or 0) >= _PART * error):
            return [*explanations, lengths]
        if samples is None:
            return explanations
        states, about["seen"], about["frame"] = _in_axes_of_file(samples), samples, _frame(observed)
    elif len(errors) == count and max(error or 0.0, *errors) <= WORTH_ASKING:
        return rounded(roundings(states, trajectory.precision), error)
    from heavytop.features.score.diagnose.diagnosis import diagnose  # a right file needs none of it

    top, start = trajectory.top, trajectory.start
    return explanations + diagnose(
        top, start, trajectory.system, times, states, trajectory.precision, error, errors, **about
    )


def _amplified(observed: Observed, written: Sequence[Rounding]) -> list[Rounding]:
    """Roundings of the columns, with the errors that they cause in the scored quantities."""
    arm = math.sqrt(float(dot(observed.posed.centre, observed.posed.centre)))
    sizes = {"quaternion": 4.0, "euler": 3.0, "position": max(2.0, 2.0 / arm) if arm else 2.0}
    factor = max(sizes.get(name, 1.0) for name in observed.names)
    return [replace(rounding, error=rounding.error * factor) for rounding in written]


def _frame(observed: Observed) -> FileAxes:
    """The axes of the file, and which of Ω and γ are columns of it."""
    axes = numpy.array([[float(value) for value in row] for row in observed.posed.axes])
    columns = [*(range(3) if "omega" in observed.names else ()), *(range(3, 6) if "gamma" in observed.names else ())]
    return FileAxes(axes, observed.posed.xi if set(FORMS) & set(observed.names) else None, tuple(columns))


def _in_axes_of_file(samples: Observations) -> list[tuple[Any, ...]]:
    """Ω, γ and, of an attitude, ξ of each sample in the axes of the file; None for what it does not give."""
    unknown, reading, columns = numpy.full((len(samples.times), 3), numpy.nan), samples.declared, samples.columns
    form = next((form for form in FORMS if form in columns), None)
    omega, gamma = (columns.get(name, unknown) for name in ("omega", "gamma"))
    parts = [omega, gamma]
    if form is not None:
        rotation = reading.rotations(form, columns[form])
        parts = [omega, rotation[:, 2], rotation[:, 0]]
        if "omega" not in columns and "omega_space" in columns:
            parts[0] = numpy.einsum("nji,nj->ni", rotation, reading.vectors(columns["omega_space"], True))
    rows = numpy.hstack(parts).tolist()
    return [tuple(None if value != value else Fraction(value) for value in row) for row in rows]


def _lengths(observed: Observed, times: Sequence[Fraction], precision: Precision) -> Diagnosis | None:
    """The diagnosis of quaternions whose length differs from 1 by more than rounding, also to the digits written."""
    rows = observed.columns.get("quaternion", [])
    squares = [dot(row, row) + row[3] ** 2 for row in rows]
    off = [abs(square - 1) / (1 + Fraction(math.sqrt(square))) for square in squares]
    written = [2 * Fraction(rounding.error) for rounding in roundings(rows, precision)]  # by all four numbers
    if not off or max(off) <= max([2**10 * precision.eps, *written]):
        return None
    worst = max(range(len(off)), key=lambda row: off[row])
    size = decimal_text(off[worst], 3)
    return Diagnosis("quaternion_length", {"off": size, "t": plain_decimal(times[worst], 6)}, float(off[worst]))


def _disagreements(samples: Observations, times: Sequence[Fraction]) -> list[Diagnosis]:
    """Diagnoses of columns that give one quantity and differ."""
    with numpy.errstate(all="ignore"):
        apart = disagreement(samples)
    explanations = []
    for (one, other), off in apart.items():
        if float(off.max()) > _OVERLAP:
            row = int(numpy.argmax(off > _OVERLAP))
            numbers = {"columns": f"{_WORDS[one]} and {_WORDS[other]}", "by": f"{float(off.max()):.2e}"}
            explanations.append(Diagnosis("columns_disagree", {**numbers, "t": plain_decimal(times[row], 6)}))
    return explanations


def used(observed: Observed) -> str:
    """The sentence that names the scored columns and their conventions."""
    convention, is_plain = observed.convention, observed.attitude == "quaternion"
    order = f"{convention.quaternion_order}, " if is_plain else ""
    how = {
        "quaternion": f" ({order}{convention.quaternion.replace('_', ' ')})",
        "matrix": f" ({convention.matrix.replace('_', ' ')})",
        "euler": f" ({convention.sequence}, {convention.angles})",
        "position": " of the centre of mass" if convention.point is None else " of the point",
    }
    up = f"; {convention.up} points up" if set(observed.names) - {"omega", "gamma"} else ""
    words = {**_WORDS, "quaternion": observed.attitude}
    return f"Scored: {', '.join(words[name] + how.get(name, '') for name in observed.names)}{up}."


PEER = "heyoka"
_CLOCK = Fraction(1, 1000)
"""Part of a step by which the times of a clock may differ from its multiples."""
_ROUNDED = 4
"""Roundings of a product."""
_NOTICED = 0.05
"""Digits."""
_REFERENCE_EFFORT = 10.0
"""Seconds of the model of its cost that a computed reference may take."""
_EFFORT = 20.0
"""Seconds that the run of heyoka beside the scored one may take, roughly."""
_PROBE, _SLOWER = 50, 2
"""heyoka is not run where the first 50th of its steps reaches less than a 100th of the time."""


@dataclass(frozen=True, slots=True)
class Assessment:
    """The score of a trajectory.

    row: what was measured.  peer: heyoka's run; None without a reference, and where heyoka does not get there.
    diagnoses: what explains the error; empty where nothing does.  format_guessed: whether the format is not named in
    the file, but read off the digits written.  single: whether every number of the states is one of single precision.
    used: which columns were scored, where these are not Ω and γ in principal axes.  cut: as in the trajectory.
    """

    row: Row
    peer: Peer | None
    diagnoses: list[Diagnosis]
    format_guessed: bool = False
    single: bool = False
    used: str = ""
    cut: str = ""

    @property
    def digits_right(self) -> float | None:
        """Digits that are right at every sample; None without a reference."""
        return digits_kept(self.row)

    @property
    def of_digits(self) -> int:
        """Decimal digits of the format."""
        return digits_of(self.row.bits)


def direction(row: Row) -> str | None:
    """Where most of the error lies: "along" the flow, "across" it, "both"; None where neither is a number."""
    along, across = (row.metric(SOLUTION_ERROR, part, "max") for part in ("along", "across"))
    if along is None or across is None or not (_is_number(along) and _is_number(across)):
        return None
    sizes = [along.number, across.number]
    if not any(sizes):
        return None
    if sizes[0] > _MOSTLY * sizes[1]:
        return "along"
    return "across" if sizes[1] > _MOSTLY * sizes[0] else "both"


_MOSTLY = 2
"""One part of an error is most of it if it is so many times as large as the other."""


def _is_number(metric: Metric) -> bool:
    return metric.log10 is not None or metric.value == "0"


def _on_multiples(trajectory: GivenTrajectory) -> GivenTrajectory | None:
    """The trajectory at multiples of its step, where its times are all but these; None where they are, or are not."""
    step = trajectory.step
    if step is None:
        return None
    times = [round(time / step) * step for time in trajectory.times]
    off = [abs(one - other) for one, other in zip(times, trajectory.times, strict=True)]
    same = all(
        one <= _ROUNDED * trajectory.precision.eps * abs(time) for one, time in zip(off, trajectory.times, strict=True)
    )
    increasing = all(abs(one) < abs(other) for one, other in pairwise(times))
    return None if same or not increasing or max(off) > _CLOCK * step else replace(trajectory, times=times)


def assess(trajectory: GivenTrajectory, progress: Progress = lambda: None) -> Assessment:
    """The row of :func:`measured`, heyoka beside it, and what explains the error.

    progress: called after each state that was compared, of the motion and of heyoka's: twice as often as there are any.
    """
    scored = measured(trajectory, progress)
    count = len(_finite(trajectory))
    clock, explained, moved = _of_clock(trajectory, scored.row) or (None, scored, trajectory)
    explanations = diagnoses(moved, _size(explained.row), explained.errors) if count else []
    written = [] if trajectory.observed is not None else roundings(_finite(trajectory), trajectory.precision)
    single = [rounding.kind for rounding in written[:1]] == ["single"]
    peer = _peer(trajectory, scored, count, progress)
    columns = "" if trajectory.observed is None else used(trajectory.observed)
    diagnosed = explanations if clock is None else [clock, *explanations]
    return Assessment(scored.row, peer, diagnosed, trajectory.format_guessed, single, columns, trajectory.cut)


def _of_clock(trajectory: GivenTrajectory, row: Row) -> tuple[Diagnosis, Scored, GivenTrajectory] | None:
    """The diagnosis that times are off multiples of the step, if more digits are right at these multiples."""
    exactly = _on_multiples(trajectory)
    if exactly is None:
        return None
    scored = measured(exactly)
    kept, with_exact = digits_kept(row), digits_kept(scored.row)
    if kept is None or with_exact is None or with_exact < kept + _NOTICED:
        return None
    off = max(abs(one - other) for one, other in zip(trajectory.times, exactly.times, strict=True))
    numbers = {"step": trajectory.flags["step"], "off": decimal_text(off, 3), "digits": f"{with_exact:.1f}"}
    return Diagnosis("clock", numbers, _size(row), _size(scored.row)), scored, exactly


def measured(trajectory: GivenTrajectory, progress: Progress = lambda: None) -> Scored:
    """The row, what made it, and the error of each sample relative to the size of Ω and γ where the reference goes.

    The data are rounded to the trajectory's format first, as a run of that format would be given them.  States from
    the first that is not finite on are not scored; the outcome says so.
    """
    observed, rate = trajectory.observed, turning_rate(trajectory.top, trajectory.start)
    problem = exact_problem(trajectory)
    times = [round_to(time, trajectory.precision.bits) for time in trajectory.times]
    keep = [times[i - 1] for i in log_spaced(len(times))]
    known = truth(problem, times, _REFERENCE_EFFORT)
    known = known if isinstance(known, str) else known.remembered()
    samples: Iterable[Any] = _finite(trajectory)
    scorer: Scorer | ObservedScorer = (
        Scorer(problem, known, keep)
        if observed is None
        else ObservedScorer(problem, known, observed.posed, observed.convention, observed.names, keep)
    )
    if observed is not None:
        samples = map(observed.sample, range(min(map(len, observed.columns.values()), default=0)))
    errors: list[float] = []
    for time, sample in zip(times, samples, strict=False):
        scorer(time, sample)
        if scorer.error is not None and scorer.error.truth.covers(time):
            errors.append(scorer.error.last(rate))
        progress()
    return Scored(_row(trajectory, problem, times, keep, scorer), problem, scorer, errors)


def _row(
    trajectory: GivenTrajectory,
    problem: Problem,
    times: list[Fraction],
    keep: list[Fraction],
    scorer: DriftAndError,
) -> Row:
    """The row of the states that the scorer compared.  times: all of them, rounded to the format."""
    precision, states = trajectory.precision, _finite(trajectory)
    count = len(states)
    run = Trajectory(
        problem,
        trajectory.integrator,
        tuple(times[:count]),
        tuple(states),
        trajectory.outcome,
        times[count - 1] if count else Fraction(0),
        trajectory.steps,
        0,
        flags=trajectory.flags,
    )
    case = Case(trajectory.name, "given", trajectory.system, trajectory.top, trajectory.start)
    subject = Subject("given", trajectory.integrator)
    key = RowKey(
        "score", trajectory.name, trajectory.system.name, subject, precision.name, horizon=time_text(times[-1])
    )
    task = Task(key, "", trajectory.integrator, case, tuple(times), tuple(keep))
    row = computed_row(task, run, scorer.metrics(), scorer.series(time_text), scorer.against)
    changes = {
        "measured": f"given: {trajectory.integrator}",
        "order": None,
        "time_reached": time_text(run.time_reached),
    }
    return msgspec.structs.replace(row, **changes, data=data_of(case))


def _finite(trajectory: GivenTrajectory) -> list[tuple[Fraction, ...]]:
    """The states before the first that is not finite."""
    count = next((i for i, state in enumerate(trajectory.states) if state is None), len(trajectory.states))
    return [state for state in trajectory.states[:count] if state is not None]


def _size(row: Row) -> float | None:
    """The largest |error|/max(1, |value|), or its bound; None without a reference."""
    metric = row.metrics.get(RELATIVE.text)
    if metric is None or not (_is_number(metric) or metric.bound is not None):
        return None
    return float(metric)


def _peer(trajectory: GivenTrajectory, measured: Scored, count: int, progress: Progress) -> Peer | None:
    """heyoka's own run of the same problem over the same times, compared with the same known motion.

    None without one, and where heyoka does not get there.
    """
    precision, problem, known = trajectory.precision, measured.problem, measured.scorer.truth
    if isinstance(known, str) or not count or precision == DOUBLE_DOUBLE:
        return None
    errors, bits = list[arb](), precision.bits + GUARD_BITS
    limit = max(1, int(_EFFORT / seconds_a_step(precision.bits)))

    @whole_evaluation
    def error(time: Fraction, state: Sequence[object]) -> arb:
        true = known.state(time, bits)[: len(state)]
        with working_precision(bits):
            return relative_error([to_ball(value) - ball for value, ball in zip(state, true, strict=True)], true)

    def observe(time: Fraction, state: Sequence[object]) -> None:
        if known.covers(time):
            errors.append(error(time, state))
        progress()

    top, start = problem.given or (problem.top, problem.start)
    options: dict[str, Any] = {"system": problem.system, "xi": problem.xi, "step_limit": limit, "observer": observe}
    times = trajectory.times[:count]
    try:
        if abs(times[-1]) * turning_rate(top, start) > limit:
            few = options | {"observer": None, "step_limit": limit // _PROBE}
            first = propagate(top, start, times[-1:], precision, **few)
            if _PROBE * _SLOWER * abs(first.time_reached) < abs(times[-1]):
                return None
        run = propagate(top, start, times, precision, **options)
    except HeavyTopError:  # a format that this platform lacks, or numbers outside its range
        return None
    if run.outcome is not Outcome.SUCCESS or not errors:
        return None
    with working_precision(bits):
        metrics = by_name({RELATIVE: metric(reduce(larger, errors, arb(0)))})
    digits = digits_kept(msgspec.structs.replace(measured.row, metrics=metrics))
    return None if digits is None else Peer(PEER, precision.name, digits, run.steps)


def passed(row: Row, needed: Fraction | None, cut: str = "") -> bool | None:
    """Whether so many digits are right; False where fewer are, also of a run that ended early.

    None, not a pass, where it ended early, and where it is not known how many are right, or only that so many are
    which the reference resolves.  needed: None for no demand.  cut: of the trajectory, whose later rows meet no demand.
    """
    good = True if complete(row) else None
    if needed is None:
        return good
    good = None if cut else good
    kept = digits_right(row)
    if kept is None:
        return None
    if exact(kept) < needed:
        return False if row.metrics[RELATIVE.text].bound is None else None
    return good


def complete(row: Row) -> bool:
    """Whether every state was finite and the run reached its end."""
    return row.outcome == Outcome.SUCCESS.value
