"""Ensembles of random starts: how drift and solution error grow, and by what law."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from time import perf_counter
from typing import TYPE_CHECKING, Any

import msgspec
import numpy
from flint import arb

from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.digits import RELATIVE
from heavytop.measure.drift import Drift
from heavytop.measure.growth import Ensemble, band, law, root_mean_square
from heavytop.measure.scalar import UNRESOLVED, of_fraction
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import decimal_text, exact, number, parse
from heavytop.records import Metric, Row, Series
from heavytop.suite.checkpoint import Saved
from heavytop.suite.measurements.ensemble_reference import Reference, Texts, Wider, reference
from heavytop.suite.measurements.shared import case_of, input_rounding, time_text
from heavytop.suite.starts import GrowthRun, random_starts
from heavytop.suite.task import Task
from heavytop.top.heavy_top import State
from heavytop.top.integrals import holding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[Any]

_DIGITS = 6


@dataclass(frozen=True, slots=True)
class _Quantity:
    """An error over the ensemble: an :class:`Ensemble`, but for the step.

    values: shape (starts, samples).  sizes: of the quantity itself, shape (starts,).
    """

    values: Array
    sizes: Array
    accumulates: int
    resolution: Array | float = 0.0


class _Motion(msgspec.Struct, frozen=True):
    """What stays of one start when its motion has ended.

    values: of each quantity at the samples that it reached, None where that is no number.  The rest as in
    :class:`heavytop.integrate.trajectory.Trajectory`.
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
    def of(cls, run: Trajectory, drift: Drift, error: SolutionError | None) -> _Motion:
        running = {f"drift_{name}": values for name, values in drift.running.items()}
        if error is not None:
            running |= {f"solution_error_{name}": values for name, values in error.running.items()}
        values = {name: [_finite(r.kept[time]) for time in run.times] for name, r in running.items()}
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


class _Done(msgspec.Struct):
    """What of a row is done, by the index of the start: its text is the place of a row in progress."""

    reference: dict[int, Texts]
    motions: dict[int, _Motion]


def growth(task: Task, saved: Saved) -> Row:
    """How errors grow over an ensemble of random starts: the law of each, its interval, its detection power.

    Each metric is a root mean square over the starts.  A start that ``saved`` holds is not computed again.
    Raises InputError for data outside the range of the format, OutOfReach where a first integral is not resolved.
    """
    case, precision, run = case_of(task), parse(task.precision), task.ensemble
    assert run is not None
    starts = random_starts(case, run.starts, run.seed + task.seed)
    true = [Problem.of(case.top, start, precision, case.system) for start in starts]
    given = [_biased(problem, run.bias) for problem in true]
    times = [exact(number(time, precision)) for time in task.times]
    before = saved.load()
    done = _Done({}, {}) if before is None else msgspec.convert(before, _Done, strict=False)
    wider = Wider(done.reference, lambda: save())

    def save() -> None:
        if saved.due():
            saved.save(msgspec.to_builtins(_Done(wider.done, done.motions), str_keys=True))

    began = perf_counter()
    held_against = reference(true, given, times, run.reference, _options(run), wider)
    ready = perf_counter()
    drifts = [Drift(p, holding(case.top, start, case.system), times) for p, start in zip(true, starts, strict=True)]
    errors = [m and SolutionError(p, m, times) for p, m in zip(true, held_against.motions, strict=True)]
    _complete(done.motions, given, times, drifts, errors, save, _options(run))
    motions = [done.motions[index] for index in range(len(starts))]
    seconds = {"reference": ready - began, "run": perf_counter() - ready, "compile": motions[0].compile}
    rounding = max(input_rounding(case.top, start, problem) for start, problem in zip(starts, true, strict=True))
    row = _row(task, true[0], motions, held_against.text, seconds, rounding)
    steps = sum(motion.steps for motion in motions) / len(motions)
    quantities = _drifts(drifts, times, motions)
    if any(errors):
        quantities |= _errors(starts, times, motions, held_against)
    for name, quantity in quantities.items():
        _add(row, name, quantity, task.times, float(times[-1]) / steps if steps else 0.0)
    if any(errors):
        row.metrics[RELATIVE] = _largest(_values(RELATIVE.removesuffix("_max"), times, motions))
    row.finite = row.finite and not any(m.value in ("nan", "missing") for m in row.metrics.values())
    return row


def _complete(
    motions: dict[int, _Motion],
    given: list[Problem],
    times: list[Fraction],
    drifts: list[Drift],
    errors: list[SolutionError | None],
    save: Callable[[], None],
    options: dict[str, Any],
) -> None:
    """Compute those of the motions that are missing, all side by side; save after each."""
    missing = [index for index in range(len(given)) if index not in motions]

    def observe(place: int, time: Fraction, state: Any) -> None:
        index = missing[place]
        drifts[index](time, state)
        if (error := errors[index]) is not None:
            error(time, state)

    def finished(place: int, run: Trajectory) -> None:
        index = missing[place]
        motions[index] = _Motion.of(run, drifts[index], errors[index])
        save()

    if missing:
        todo = [given[index] for index in missing]
        propagate_ensemble(todo, times, observer=observe, finished=finished, **options)


def _drifts(drifts: list[Drift], times: list[Fraction], motions: list[_Motion]) -> dict[str, _Quantity]:
    found = {}
    for integral in drifts[0].running:
        name = f"drift_{integral}"
        sizes = numpy.array([float(drift.initial[integral]) for drift in drifts])
        found[name] = _Quantity(_values(name, times, motions), sizes, 1)
    return found


def _errors(
    starts: list[State], times: list[Fraction], motions: list[_Motion], held_against: Reference
) -> dict[str, _Quantity]:
    omega = numpy.linalg.norm([[float(w) for w in start.omega] for start in starts], axis=1)
    one = numpy.ones(len(starts))
    whole = numpy.hypot(omega, one)
    found = {}
    for part, sizes, accumulates in (
        ("along", whole, 2),
        ("across", whole, 1),
        ("omega", omega, 2),
        ("gamma", one, 2),
    ):
        name = f"solution_error_{part}"
        values = _values(name, times, motions)
        found[name] = _Quantity(values, sizes, accumulates, held_against.radius + held_against.part * values)
    return found


def _biased(problem: Problem, bias: str | None) -> Problem:
    """The problem with its first moment of inertia off by the relative ``bias``: the planted fault."""
    if bias is None:
        return problem
    first, *rest = problem.parameters.inertia
    off = exact(number(first * (1 + exact(bias)), problem.precision))
    return replace(problem, parameters=problem.parameters._replace(inertia=(off, *rest)))


def _options(run: GrowthRun) -> dict[str, Any]:
    tolerance = None if run.tolerance is None else exact(run.tolerance)
    return {"tolerance": tolerance, "high_accuracy": run.high_accuracy}


def _values(name: str, times: Sequence[Fraction], motions: Sequence[_Motion]) -> Array:
    """Errors at the samples, shape (starts, samples); NaN where a motion did not come that far."""
    found = numpy.full((len(motions), len(times)), numpy.nan)
    for row, motion in zip(found, motions, strict=True):
        values = motion.values.get(name, [])
        row[: len(values)] = values
    return found


def _add(row: Row, name: str, quantity: _Quantity, times: Sequence[Fraction], step: float) -> None:
    """RMS over starts of the largest and of the final value, the RMS over time, and its law."""
    ensemble = Ensemble(
        numpy.array([float(abs(time)) for time in times]),
        quantity.values,
        step,
        resolution=quantity.resolution,
        accumulates=quantity.accumulates,
    )
    kept = quantity.values[ensemble.healthy]
    if len(kept):
        size = float(root_mean_square(quantity.sizes[ensemble.healthy]))
        ensemble = replace(ensemble, size=size or 1.0)
    rms = ensemble.rms()
    row.series[name] = Series([time_text(time) for time in times], [_text(value, len(kept) > 0) for value in rms])
    for part, values in (("max", kept.max(axis=1)), ("final", kept[:, -1])):
        resolved = len(kept) > 0 and not (part == "final" and numpy.isnan(rms[-1]))
        row.metrics[f"{name}_{part}"] = _metric(values, resolved)
    row.laws[name] = law(ensemble)


def _largest(values: Array) -> Metric:
    """The root mean square over the starts that reached the end of the largest of their ``values``."""
    return _metric(values[numpy.isfinite(values).all(axis=1)].max(axis=1), True)


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
    metric.band = band(values)
    return metric


def _row(
    task: Task, problem: Problem, motions: list[_Motion], against: str, seconds: dict[str, float], rounding: Fraction
) -> Row:
    assert task.ensemble is not None
    run, first = task.ensemble, motions[0]
    failed = [motion for motion in motions if motion.outcome != Outcome.SUCCESS.value]
    reached = min((abs(Fraction(motion.time_reached)) for motion in failed), default=abs(task.times[-1]))
    return Row(
        case=task.name,
        system=problem.system.name,
        integrator=f"{first.integrator} {task.form}".rstrip(),
        precision=problem.precision.name,
        bits=problem.precision.bits,
        outcome=failed[0].outcome if failed else first.outcome,
        horizon=time_text(task.times[-1]),
        time_reached=time_text(reached),
        steps=sum(motion.steps for motion in motions),
        finite=not failed,
        metrics={"starts_failed": of_fraction(Fraction(len(failed)), words=str(len(failed)))},
        measure=task.kind,
        measured=f"computed: {first.integrator} in {problem.precision.name}, {len(motions)} random starts, "
        "root mean square over them",
        against=against,
        order=first.order,
        flags=first.flags | {"bias": run.bias or "none"},
        input_rounding=decimal_text(rounding, 3),
        samples=len(task.times),
        starts=len(motions),
        seconds=seconds,
    )
