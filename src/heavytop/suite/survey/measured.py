"""The records of a chunk: errors, digits, drifts, steps and outcomes of many motions, as columns.

The reference is a run in double-double arithmetic, eight motions in lanes; its radius is the distance from a second run
with another order and other steps.  The first motion of each chunk has a proven one too, and a computed one that is
further from it than ten of its radii and rounding is a contradiction.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy

from heavytop.errors import Contradiction, PeerFailed
from heavytop.exact.balls import midpoint, radius
from heavytop.integrate.lane_grid import states_on_a_grid
from heavytop.integrate.pair_arrays import Pairs
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.integrate.words_ensemble import propagate_words_ensemble
from heavytop.integrate.words_grid import double_double_states
from heavytop.measure.integrator import HEYOKA, ChosenIntegrator
from heavytop.measure.truth import Known, known_motion
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, Precision, exact, number
from heavytop.suite.survey.drawn import Drawn
from heavytop.top.equations import HEAVY_TOP

DRIFTS = ("gamma_squared", "area", "energy", "further")
"""Integrals whose drift is a column; further: the largest drift of all others that the motion has."""
_TOLERANCES = Fraction(1, 2**96), Fraction(1, 2**84)
"""Of both runs in double; other orders and steps.  In extended: of double-double itself, and the first."""
_MODERATE = 1e4
"""Larger data, and times, are looked at motion by motion."""
_STEP_LIMIT = 1_000_000
_FLOOR = 1e-28
_RADII = 10

Columns = dict[str, Any]


def measured(
    drawn: Drawn, integrator: ChosenIntegrator, times: Sequence[Fraction], precision: Precision, options: dict[str, Any]
) -> Columns:
    """Each quantity over the motions.  Errors of Ω are in 1/time unit, drifts in units of the integral; NaN where a run
    or its reference did not reach the horizon.

    Raises Contradiction where the computed reference is off the proven one, PeerFailed where every run failed.
    """
    outcomes, states, steps = _runs(integrator, drawn, times, precision, options)
    truth, apart = _truth(drawn, times, precision)
    with numpy.errstate(all="ignore"):
        wrong = (outcomes == Outcome.SUCCESS.value) & ~numpy.isfinite(states.high).all(axis=(1, 2))
        outcomes[wrong] = Outcome.NON_FINITE.value
        found = _errors(states, truth, times, precision)
        found |= _drifts(drawn, states)
    _require_agreement(drawn.problems[0], times, truth, float(apart[0]))
    return {"outcome": outcomes.tolist(), "steps": steps} | found | {"reference_radius": apart}


def _usual(drawn: Drawn, times: Sequence[Fraction], precision: Precision) -> bool:
    """Whether the motions can be computed as arrays: doubles, and times that are out of nobody's reach."""
    if precision != DOUBLE or times[0] <= 0 or max(abs(drawn.numbers.high).max(), float(times[-1])) > _MODERATE:
        return False
    return bool(drawn.numbers.high[:, :3].min() > 1 / _MODERATE)


def _runs(
    integrator: ChosenIntegrator, drawn: Drawn, times: Sequence[Fraction], precision: Precision, options: dict[str, Any]
) -> tuple[Any, Pairs, Any]:
    """Outcome, states and steps of each; one after the other where the integrator has no lanes."""
    count = len(drawn.problems)
    outcomes, steps = numpy.full(count, Outcome.SUCCESS.value, object), numpy.zeros(count, int)
    states, good = _pairs([()] * count, len(times)), numpy.zeros(count, bool)
    if integrator == ChosenIntegrator(HEYOKA) and _usual(drawn, times, precision):
        given = drawn.numbers.high[:, :-6], drawn.numbers.high[:, -6:]
        found, steps, good = states_on_a_grid(drawn.system, *given, times, **options)
        states = Pairs(found, numpy.zeros_like(found))
    rest = numpy.flatnonzero(~good)
    problems = [drawn.problems[place] for place in rest.tolist()]
    if problems:
        runs = _one_by_one(integrator, problems, times, options)
        outcomes[rest] = [run[0] for run in runs]
        again = _pairs([run[1] for run in runs], len(times))
        states.high[rest], states.low[rest] = again.high, again.low
        steps[rest] = [run[2] for run in runs]
    return outcomes, states, steps


def _one_by_one(
    integrator: ChosenIntegrator, problems: Sequence[Problem], times: Sequence[Fraction], options: dict[str, Any]
) -> list[tuple[str, Sequence[Any], int]]:
    """Outcome, states and steps of each, by the integrator's own ensembles where it has them."""
    if integrator.supports_ensemble:
        many = integrator.propagate_many(problems, times, threads=1, **options)
        return [(run.outcome.value, run.states, run.steps) for run in many]
    runs = [_alone(integrator, problem, times, options) for problem in problems]
    failures = [run for run in runs if isinstance(run, PeerFailed)]
    if len(failures) == len(runs):
        raise failures[0]
    return [(Outcome.FAILED.value, (), 0) if isinstance(run, PeerFailed) else run for run in runs]


def _alone(
    integrator: ChosenIntegrator, problem: Problem, times: Sequence[Fraction], options: dict[str, Any]
) -> tuple[str, Sequence[Any], int] | PeerFailed:
    """Outcome, states and steps; PeerFailed, not raised, where the integrator failed."""
    try:
        (run,) = integrator.propagate_many([problem], times, threads=1, **options)
    except PeerFailed as error:
        return error
    short = run.outcome is Outcome.SUCCESS and len(run.states) < len(times)
    return (Outcome.INCOMPLETE if short else run.outcome).value, run.states, run.steps


def _pairs(states: Sequence[Sequence[Any]], samples: int) -> Pairs:
    """(motions, samples, 6) of native states, exact in two doubles; NaN where there is none."""
    high, low = (numpy.full((len(states), samples, 6), math.nan) for _ in range(2))
    for place, run in enumerate(states):
        if not len(run):
            continue
        rows = numpy.asarray(run)[:samples, :6]
        if rows.dtype == numpy.float64:
            high[place, : len(rows)], low[place, : len(rows)] = rows, 0.0
            continue
        first = rows.astype(float)
        high[place, : len(rows)], low[place, : len(rows)] = first, (rows - first).astype(float)
    return Pairs(high, low)


def _truth(drawn: Drawn, times: Sequence[Fraction], precision: Precision) -> tuple[Pairs, Any]:
    """The reference, and the largest distance of the second run from it, absolute, a rounding of the format added, for
    short motions often agree in every bit.
    """
    tolerances = _TOLERANCES if precision == DOUBLE else (None, _TOLERANCES[0])
    found = [_reference(drawn, times, precision, tolerance) for tolerance in tolerances]
    with numpy.errstate(all="ignore"):
        apart = numpy.abs((found[0] - found[1]).high).max(axis=(1, 2))
        size = numpy.abs(found[0].high).max(axis=(1, 2))
        return found[0], apart + float(DOUBLE_DOUBLE.eps) * numpy.maximum(1.0, size)


def _reference(drawn: Drawn, times: Sequence[Fraction], precision: Precision, tolerance: Fraction | None) -> Pairs:
    """One run in double-double, of all motions."""
    count = len(drawn.problems)
    states, good = _pairs([()] * count, len(times)), numpy.zeros(count, bool)
    if drawn.system is HEAVY_TOP and tolerance is not None and _usual(drawn, times, precision):
        numbers = drawn.numbers.high
        states, good = double_double_states(numbers[:, :6], numbers[:, 6:], times, tolerance, _STEP_LIMIT)
    rest = numpy.flatnonzero(~good)
    problems = [replace(drawn.problems[place], precision=DOUBLE_DOUBLE) for place in rest.tolist()]
    if problems:
        targets = [number(time, DOUBLE_DOUBLE) for time in times]
        runs = propagate_words_ensemble(problems, targets, threads=1, step_limit=_STEP_LIMIT, tolerance=tolerance)
        again = _pairs([run.states for run in runs], len(times))
        states.high[rest], states.low[rest] = again.high, again.low
    return states


def _errors(states: Pairs, truth: Pairs, times: Sequence[Fraction], precision: Precision) -> Columns:
    """As :class:`heavytop.measure.solution_error.SolutionError` has them, the largest over the samples."""
    delta = numpy.abs((states - truth).high)
    relative = (delta / numpy.maximum(1.0, numpy.abs(truth.high))).max(axis=2)
    largest = relative.max(axis=1)
    finite = numpy.isfinite(largest)
    where = numpy.where(finite[:, None], relative, 0.0).argmax(axis=1)
    most = precision.bits * math.log10(2)
    digits = numpy.minimum(most, -numpy.log10(largest))
    scale = float(precision.eps) * float(abs(times[-1])) ** 1.5
    return {
        "error_max": largest,
        "error_time": numpy.where(finite, numpy.array([float(t) for t in times])[where], math.nan),
        "error_omega": delta[:, :, :3].max(axis=(1, 2)),
        "error_gamma": delta[:, :, 3:].max(axis=(1, 2)),
        "error_scaled": largest / scale,
        "digits_right": digits,
    }


def _drifts(drawn: Drawn, states: Pairs) -> Columns:
    """The largest |I(t) - I(0)| over the samples, of each integral from the rounded start."""
    groups: dict[Any, list[int]] = defaultdict(list)
    for place, integrals in enumerate(drawn.integrals):
        groups[tuple((i.name, _axes(i)) for i in integrals)].append(place)
    found = {f"drift_{name}": numpy.full(len(drawn.problems), math.nan) for name in DRIFTS}
    parameters, start = drawn.parameters, drawn.start
    for places in groups.values():
        own = parameters.mapped(lambda column, places=places: column[places])  # type: ignore[misc]
        now = [states[places, :, k] for k in range(6)]
        before = [column[places] for column in start]
        for integral in drawn.integrals[places[0]]:
            change = integral.value(own, now) - integral.value(own, before)
            size = numpy.abs(change.high).max(axis=1)
            name = f"drift_{integral.name}"
            if name in found:
                found[name][places] = size
            else:
                found["drift_further"][places] = numpy.fmax(found["drift_further"][places], size)
    return found


def _axes(integral: Any) -> Any:
    return getattr(integral.value, "keywords", {}).get("axes")


def _require_agreement(problem: Problem, times: Sequence[Fraction], truth: Pairs, apart: float) -> None:
    """Raises Contradiction where the first motion's reference is off its closed form or enclosure."""
    if not math.isfinite(apart):
        return
    known = known_motion(problem, times[-1])
    if not isinstance(known, Known):
        return
    for place, time in enumerate(times):
        if not known.truth.covers(time):
            continue
        balls = known.truth.state(time, DOUBLE_DOUBLE.bits)
        for k, ball in enumerate(balls):
            computed = Fraction(float(truth.high[0, place, k])) + Fraction(float(truth.low[0, place, k]))
            middle = exact(midpoint(ball))
            off = abs(computed - middle) - exact(radius(ball))
            if off > _RADII * Fraction(apart) + Fraction(_FLOOR) * (1 + abs(middle)):
                raise Contradiction(
                    f"The computed reference at t = {float(time):.6g} is {float(off):.3g} off the proven one, and its "
                    f"radius is {apart:.3g}."
                )
