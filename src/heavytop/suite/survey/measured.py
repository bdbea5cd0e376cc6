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
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.integrate.words_ensemble import propagate_words_ensemble
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.measure.truth import Known, known_motion
from heavytop.precision import DOUBLE_DOUBLE, Precision, exact, number
from heavytop.suite.survey.drawn import Drawn
from heavytop.suite.survey.pairs import Pairs
from heavytop.top.equations import HEAVY_GYROSTAT, Parameters

DRIFTS = ("gamma_squared", "area", "energy", "further")
"""Integrals whose drift is a column; further: the largest drift of all others that the motion has."""
_OTHER_TOLERANCE = Fraction(1, 2**96)
"""Of the second run: of a lower order, with other steps."""
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
    runs = _runs(integrator, drawn.problems, times, options)
    states = _pairs([run[1] for run in runs], len(times))
    truth, apart = _truth(drawn.problems, times)
    outcomes = [run[0] for run in runs]
    with numpy.errstate(all="ignore"):
        wrong = [o == Outcome.SUCCESS.value for o in outcomes] & ~numpy.isfinite(states.high).all(axis=(1, 2))
        for place in numpy.flatnonzero(wrong).tolist():
            outcomes[place] = Outcome.NON_FINITE.value
        found = _errors(states, truth, times, precision)
        found |= _drifts(drawn, states)
    _require_agreement(drawn.problems[0], times, truth, float(apart[0]))
    return {"outcome": outcomes, "steps": [run[2] for run in runs]} | found | {"reference_radius": apart}


def _runs(
    integrator: ChosenIntegrator, problems: Sequence[Problem], times: Sequence[Fraction], options: dict[str, Any]
) -> list[tuple[str, Sequence[Any], int]]:
    """Outcome, states and steps of each; one after the other where the integrator has no lanes."""
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


def _truth(problems: Sequence[Problem], times: Sequence[Fraction]) -> tuple[Pairs, Any]:
    """The reference, and the largest distance of the second run from it, absolute, a rounding of the format added, for
    short motions often agree in every bit.
    """
    fine = [replace(each, precision=DOUBLE_DOUBLE) for each in problems]
    targets = [number(time, DOUBLE_DOUBLE) for time in times]
    found = [
        _pairs([run.states for run in runs], len(times))
        for runs in (
            propagate_words_ensemble(fine, targets, threads=1, step_limit=_STEP_LIMIT, tolerance=tolerance)
            for tolerance in (None, _OTHER_TOLERANCE)
        )
    ]
    with numpy.errstate(all="ignore"):
        apart = numpy.abs((found[0] - found[1]).high).max(axis=(1, 2))
        size = numpy.abs(found[0].high).max(axis=(1, 2))
        return found[0], apart + float(DOUBLE_DOUBLE.eps) * numpy.maximum(1.0, size)


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
    for places in groups.values():
        problems = [drawn.problems[place] for place in places]
        parameters = _parameters(problems)
        now = [Pairs(states.high[places, :, k], states.low[places, :, k]) for k in range(6)]
        before = [_column([problem.start.flat[k] for problem in problems]) for k in range(6)]
        for integral in drawn.integrals[places[0]]:
            change = integral.value(parameters, now) - integral.value(parameters, before)
            size = numpy.abs(change.high).max(axis=1)
            name = f"drift_{integral.name}"
            if name in found:
                found[name][places] = size
            else:
                found["drift_further"][places] = numpy.fmax(found["drift_further"][places], size)
    return found


def _axes(integral: Any) -> Any:
    return getattr(integral.value, "keywords", {}).get("axes")


def _parameters(problems: Sequence[Problem]) -> Parameters:
    """Those of the problems, each a column."""
    system = problems[0].system
    each = [problem.parameters for problem in problems]
    inertia, moment = (tuple(_column([getattr(p, name)[k] for p in each]) for k in range(3)) for name in _VECTORS)
    if system is HEAVY_GYROSTAT:
        return Parameters(inertia, moment, tuple(_column([p.rotor[k] for p in each]) for k in range(3)))
    return Parameters(inertia, moment, _column([p.rotor for p in each]))


_VECTORS = ("inertia", "moment")


def _column(values: Sequence[Fraction]) -> Pairs:
    high = numpy.array([float(value) for value in values])
    low = numpy.array([float(value - Fraction(first)) for value, first in zip(values, high.tolist(), strict=True)])
    return Pairs(high[:, None], low[:, None])


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
