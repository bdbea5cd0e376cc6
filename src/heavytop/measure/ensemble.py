"""An ensemble of motions: each scored as it goes by, then how their errors grow, and by what law."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import msgspec
import numpy
from flint import arb

from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.attitude_error import ATTITUDE, POSITION
from heavytop.measure.digits import RELATIVE
from heavytop.measure.ensemble_reference import Reference
from heavytop.measure.growth import Array, Ensemble, band, law, root_mean_square
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.measure.scalar import UNRESOLVED, of_fraction
from heavytop.measure.scorer import Scorer, TimeText
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.precision import decimal_text
from heavytop.records import Law, Metric, Quantity, Series
from heavytop.top.heavy_top import State

_DIGITS = 6
_ACCUMULATES = {"along": 2, "across": 1, "omega": 2, "gamma": 2}
"""For each error: 1 where a fault a step adds up like n, 2 where it adds up like n²."""


class Ended(msgspec.Struct, frozen=True):
    """What stays of one start when its motion has ended.

    values: by the key of each quantity, at the samples that it reached, as far as there is a truth; None where that is
    not finite.  The rest as in :class:`heavytop.integrate.trajectory.Trajectory`.
    """

    integrator: str
    outcome: str
    time_reached: str
    steps: int
    order: int
    compile: float
    flags: dict[str, str]
    values: dict[str, list[float | None]]

    @classmethod
    def of(cls, run: Trajectory, scorer: Scorer) -> Ended:
        """What stays of a run that went to ``scorer``."""
        running = scorer.running()
        values = {q.text: [_finite(kept) for kept in each.kept.values()] for q, each in running.items()}
        lost = run.outcome is Outcome.SUCCESS and any(None in kept for kept in values.values())
        return cls(
            run.integrator,
            (Outcome.NON_FINITE if lost else run.outcome).value,
            str(run.time_reached),
            run.steps,
            run.order,
            run.seconds["compile"],
            run.flags,
            values,
        )


def _finite(value: arb) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def complete(
    motions: dict[int, Ended],
    given: Sequence[Problem],
    times: Sequence[Fraction],
    scorers: Sequence[Scorer],
    save: Callable[[], None],
    integrator: ChosenIntegrator,
    options: Mapping[str, Any],
) -> None:
    """Compute those of the motions that are missing, all side by side; save after each.  options: the integrator's."""
    missing = [index for index in range(len(given)) if index not in motions]

    def observe(place: int, time: Fraction, state: Any) -> None:
        scorers[missing[place]](time, state)

    def finished(place: int, run: Trajectory) -> None:
        motions[missing[place]] = Ended.of(run, scorers[missing[place]])
        save()

    if missing:
        todo = [given[index] for index in missing]
        integrator.propagate_many(todo, times, observe, finished, **options)


@dataclass(frozen=True, slots=True)
class _Measured:
    """An error over the ensemble: an :class:`Ensemble`, but for the step.

    values: shape (starts, samples).  sizes: of the quantity itself, shape (starts,).
    """

    values: Array
    sizes: Array
    accumulates: int
    resolution: Array | float = 0.0


@dataclass(slots=True)
class Growing:
    """What an ensemble comes to: metrics, each a root mean square over the starts, series and their laws."""

    metrics: dict[Quantity, Metric]
    series: dict[str, Series]
    laws: dict[str, Law]


def growing(
    starts: Sequence[State],
    times: Sequence[Fraction],
    motions: Sequence[Ended],
    scorers: Sequence[Scorer],
    reference: Reference,
    time_text: TimeText,
    distance: float = 0.0,
) -> Growing:
    """How every drift grows, and every error where there is a reference.

    times: exact, shape (samples,), as they are asked for.  distance: of the centre of mass from the fixed point.
    """
    steps = sum(motion.steps for motion in motions) / len(motions)
    step = float(times[-1]) / steps if steps else 0.0
    found = Growing({}, {}, {})
    quantities = _drifts(scorers, len(times), motions)
    known = any(scorer.error for scorer in scorers) and reference.samples
    if known:
        quantities |= _errors(starts, motions, reference, distance)
    for quantity, measured in quantities.items():
        _add(found, quantity, measured, times[: measured.values.shape[1]], step, time_text)
    if known:
        values = _values(RELATIVE.over(""), reference.samples, motions)
        # over the starts that reached the end, of the largest of their values
        found.metrics[RELATIVE] = _metric(values[numpy.isfinite(values).all(axis=1)].max(axis=1), True)
    return found


def _drifts(scorers: Sequence[Scorer], samples: int, motions: Sequence[Ended]) -> dict[Quantity, _Measured]:
    found = {}
    for quantity in scorers[0].drift.quantities():
        sizes = numpy.array([float(scorer.drift.initial[quantity.component]) for scorer in scorers])
        found[quantity] = _Measured(_values(quantity, samples, motions), sizes, 1)
    return found


def _errors(
    starts: Sequence[State], motions: Sequence[Ended], reference: Reference, distance: float
) -> dict[Quantity, _Measured]:
    """The error of Ω and γ, of its parts, and of attitude and position where every motion has them."""
    omega = numpy.linalg.norm([[float(w) for w in start.omega] for start in starts], axis=1)
    one = numpy.ones(len(starts))
    whole = numpy.hypot(omega, one)
    sizes = {"along": whole, "across": whole, "omega": omega, "gamma": one}
    blur, found = numpy.array(reference.blur), {}
    for part, accumulates in _ACCUMULATES.items():
        quantity = Quantity(SOLUTION_ERROR, part)
        found[quantity] = _Measured(_values(quantity, reference.samples, motions), sizes[part], accumulates, blur)
    for quantity, size in ((ATTITUDE, one), (POSITION, distance * one)):
        if all(quantity.text in motion.values for motion in motions):
            found[quantity] = _Measured(_values(quantity, reference.samples, motions), size, 2, blur)
    return found


def _values(quantity: Quantity, samples: int, motions: Sequence[Ended]) -> Array:
    """Errors at the samples, shape (starts, samples); NaN where a motion did not come that far."""
    found = numpy.full((len(motions), samples), numpy.nan)
    for row, motion in zip(found, motions, strict=True):
        values = motion.values.get(quantity.text, [])
        row[: len(values)] = values
    return found


def _add(
    found: Growing,
    quantity: Quantity,
    measured: _Measured,
    times: Sequence[Fraction],
    step: float,
    time_text: TimeText,
) -> None:
    """RMS over starts of the largest and of the final value, the RMS over time, and its law."""
    ensemble = Ensemble(
        numpy.array([float(abs(time)) for time in times]),
        measured.values,
        step,
        resolution=measured.resolution,
        accumulates=measured.accumulates,
    )
    kept = measured.values[ensemble.healthy]
    if len(kept):
        size = float(root_mean_square(measured.sizes[ensemble.healthy]))
        ensemble = replace(ensemble, size=size or 1.0)
    rms, name = ensemble.rms(), quantity.text
    texts = [_text(value, len(kept) > 0) for value in rms]
    found.series[name] = Series([time_text(time) for time in times], texts, quantity)
    for part, values in (("max", kept.max(axis=1)), ("final", kept[:, -1])):
        resolved = len(kept) > 0 and not (part == "final" and numpy.isnan(rms[-1]))
        found.metrics[quantity.over(part)] = _metric(values, resolved)
    found.laws[name] = msgspec.structs.replace(law(ensemble), quantity=quantity)


def _text(value: float, measured: bool) -> str:
    if not numpy.isfinite(value):
        return UNRESOLVED if measured else "missing"
    return decimal_text(Fraction(float(value)), _DIGITS)


def _metric(values: Array, resolved: bool) -> Metric:
    if not len(values):
        return Metric("missing", None)
    value = float(root_mean_square(values))
    if not resolved:
        return Metric(UNRESOLVED, None, bound=decimal_text(Fraction(value), 3))
    metric = of_fraction(Fraction(value), words=decimal_text(Fraction(value), _DIGITS))
    return msgspec.structs.replace(metric, band=band(values))
