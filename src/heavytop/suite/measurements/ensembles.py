"""Ensembles of random starts: how drift and solution error grow, and by what law."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy
from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, working_precision
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.drift import Drift, Running
from heavytop.measure.growth import RESOLVED, Ensemble, band, law, root_mean_square
from heavytop.measure.known import Known, certified, closed_form
from heavytop.measure.scalar import GUARD_BITS, UNRESOLVED, of_fraction
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import QUAD, Precision, decimal_text, exact, number, parse, real, shown
from heavytop.records import Metric, Row, Series
from heavytop.suite.measurements.shared import case_of, input_rounding, time_text
from heavytop.suite.starts import GrowthRun, random_starts
from heavytop.suite.task import Task
from heavytop.top.integrals import holding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[Any]

_CERTIFIED_AT = Fraction(2)
"""|t| at which the closed form of every start is certified; that of the first start is at the horizon too."""
_CHECKED_UNTIL = 100
_CHECKED_STARTS = 8
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class _Reference:
    """What a run is held against.

    motions: one a start, None where there is none fit to score with.  radius: its error, absolute.  part: its error as
    a part of the error that it measures.
    """

    text: str
    motions: list[Any]
    radius: float = 0.0
    part: float = 0.0


@dataclass(frozen=True, slots=True)
class _Quantity:
    """An error over the ensemble: an :class:`Ensemble`, but for the step.

    values: shape (starts, samples).  sizes: of the quantity itself, shape (starts,).
    """

    values: Array
    sizes: Array
    accumulates: int
    resolution: Array | float = 0.0


class _Sampled:
    """Computed states at the times they were computed for, as the motion that a run is held against."""

    def __init__(self, run: Trajectory) -> None:
        self.states = dict(zip(run.times, run.states, strict=True))

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """Six balls of radius 0."""
        with working_precision(bits):
            return [ball(exact(value)) for value in self.states[time]]


def growth(task: Task) -> Row:
    case, precision, run = case_of(task), parse(task.precision), task.ensemble
    assert run is not None
    starts = random_starts(case, run.starts, run.seed + task.seed)
    true = [Problem.of(case.top, start, precision, case.system) for start in starts]
    given = [_biased(problem, run.bias) for problem in true]
    times = [exact(number(time, precision)) for time in task.times]
    began = perf_counter()
    reference = _reference(true, given, times, run)
    ready = perf_counter()
    drifts = [Drift(p, holding(case.top, start, case.system), times) for p, start in zip(true, starts, strict=True)]
    errors = [m and SolutionError(p, m, times) for p, m in zip(true, reference.motions, strict=True)]

    def observe(index: int, time: Fraction, state: Any) -> None:
        drifts[index](time, state)
        if (error := errors[index]) is not None:
            error(time, state)

    motions = propagate_ensemble(given, times, observer=observe, **_options(run))
    seconds = {"reference": ready - began, "run": perf_counter() - ready, "compile": motions[0].seconds["compile"]}
    quantities = {
        f"drift_{name}": _Quantity(
            _values(times, (d.running[name] for d in drifts)), numpy.array([float(d.initial[name]) for d in drifts]), 1
        )
        for name in drifts[0].running
    }
    if any(errors):
        omega = numpy.linalg.norm([[float(w) for w in start.omega] for start in starts], axis=1)
        one = numpy.ones(len(starts))
        whole = numpy.hypot(omega, one)
        for name, sizes, accumulates in (
            ("along", whole, 2),
            ("across", whole, 1),
            ("omega", omega, 2),
            ("gamma", one, 2),
        ):
            values = _values(times, (e.running[name] if e else Running() for e in errors))
            resolution = reference.radius + reference.part * values
            quantities[f"solution_error_{name}"] = _Quantity(values, sizes, accumulates, resolution)
    rounding = max(input_rounding(case.top, start, problem) for start, problem in zip(starts, true, strict=True))
    row = _row(task, motions, reference.text, seconds, rounding)
    steps = sum(motion.steps for motion in motions) / len(motions)
    for name, quantity in quantities.items():
        _add(row, name, quantity, task.times, float(times[-1]) / steps if steps else 0.0)
    row.finite = row.finite and not any(m.value in ("nan", "missing") for m in row.metrics.values())
    return row


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


def _reference(true: list[Problem], given: list[Problem], times: list[Fraction], run: GrowthRun) -> _Reference:
    """The closed forms where there are any, else runs in the wider format that the plan names."""
    forms = [closed_form(problem) for problem in true]
    if all(forms):
        return _certified(forms, times[-1], true[0].precision.bits + GUARD_BITS)
    nothing: list[Any] = [None] * len(true)
    if run.reference is None:
        return _Reference("its own first integrals; no closed form, and no wider format was asked for", nothing)
    wider = parse(run.reference)
    motions = _wider(tuple(true), tuple(times), wider)
    part, checked = _own_error(true[:_CHECKED_STARTS], given[:_CHECKED_STARTS], times, wider, _options(run))
    text = f"computed, not proven: heyoka in {wider.name} from the same rounded data; {checked}"
    if not part <= 1 / RESOLVED:
        return _Reference(f"its own first integrals; no closed form, and not fit to score with: {text}", nothing)
    fit = [_Sampled(motion) if motion.outcome is Outcome.SUCCESS else None for motion in motions]
    return _Reference(text, list(fit), part=part)


def _certified(forms: Sequence[Any], horizon: Fraction, bits: int) -> _Reference:
    """Every closed form certified early, and the first at the horizon too."""
    sign = 1 if horizon > 0 else -1
    early = sign * min(_CERTIFIED_AT, abs(horizon))
    proofs = [_proof(form, early, bits) for form in forms]
    last = _proof(forms[0], horizon, bits)
    motions = [form if proof and last else None for form, proof in zip(forms, proofs, strict=True)]
    done = [proof.certificate for proof in proofs if proof]
    if not done or last is None:
        return _Reference("its own first integrals; the closed form is certified to too few digits", motions)
    text = (
        f"{last.text}, for the first start; {len(done)} of {len(forms)} starts certified at t = {shown(early)} to "
        f"{min(proof.agreed_digits for proof in done)} digits or more by {done[0].second_source} ({done[0].kind})"
    )
    return _Reference(text, motions, radius=2.0**-bits)


def _proof(form: Any, time: Fraction, bits: int) -> Known | None:
    try:
        return certified(form, time, bits)
    except OutOfReach:
        return None


@lru_cache(maxsize=1)
def _wider(problems: tuple[Problem, ...], times: tuple[Fraction, ...], precision: Precision) -> list[Trajectory]:
    """The motions of the same rounded data in a wider format; the runs of a plan that differ in flags share them."""
    return propagate_ensemble([replace(problem, precision=precision) for problem in problems], times)


def _own_error(
    true: list[Problem], given: list[Problem], times: list[Fraction], wider: Precision, options: dict[str, Any]
) -> tuple[float, str]:
    """The error of a reference in ``wider`` as a part of the error of the run, both against a wider format still, over
    a few starts and an early time; and that in words.
    """
    widest = QUAD if wider.bits < QUAD.bits else real(2 * wider.bits)
    early = [time for time in times if abs(time) <= _CHECKED_UNTIL]
    if not early:
        return float("inf"), f"not checked: no sample up to |t| = {_CHECKED_UNTIL}"
    truth, reference = (
        propagate_ensemble([replace(problem, precision=p) for problem in true], early) for p in (widest, wider)
    )
    off = _distance(propagate_ensemble(given, early, **options), truth)
    part = _distance(reference, truth) / off if off else float("inf")
    return part, (
        f"against {widest.name} on {len(true)} starts up to |t| = {float(early[-1]):.3g}, "
        f"its error is {part:.1e} of the error measured"
    )


def _distance(runs: Sequence[Trajectory], truth: Sequence[Trajectory]) -> float:
    """The root mean square over starts of the largest distance of any component; NaN if none came to the end."""
    gaps = [
        max(_gap(a, b) for a, b in zip(run.states, other.states, strict=True))
        for run, other in zip(runs, truth, strict=True)
        if run.outcome is other.outcome is Outcome.SUCCESS
    ]
    return float(root_mean_square(numpy.array(gaps))) if gaps else float("nan")


def _gap(one: Any, other: Any) -> float:
    return float(max(abs(exact(a) - exact(b)) for a, b in zip(one, other, strict=True)))


def _values(times: Sequence[Fraction], runnings: Iterable[Running]) -> Array:
    """Errors at the samples, shape (starts, samples); NaN where a motion did not come that far."""
    return numpy.array([[float(r.kept[t]) if t in r.kept else numpy.nan for t in times] for r in runnings])


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


def _row(task: Task, motions: list[Trajectory], against: str, seconds: dict[str, float], rounding: Fraction) -> Row:
    assert task.ensemble is not None
    run, first = task.ensemble, motions[0]
    failed = [motion for motion in motions if motion.outcome is not Outcome.SUCCESS]
    outcome = failed[0].outcome if failed else Outcome.SUCCESS
    reached = min((abs(motion.time_reached) for motion in failed), default=abs(task.times[-1]))
    return Row(
        case=task.name,
        system=first.problem.system.name,
        integrator=f"{first.integrator} {task.form}".rstrip(),
        precision=first.problem.precision.name,
        bits=first.problem.precision.bits,
        outcome=outcome.value,
        horizon=time_text(task.times[-1]),
        time_reached=time_text(reached),
        steps=sum(motion.steps for motion in motions),
        finite=not failed,
        metrics={"starts_failed": of_fraction(Fraction(len(failed)), words=str(len(failed)))},
        measure=task.kind,
        measured=f"computed: {first.integrator} in {first.problem.precision.name}, {len(motions)} random starts, "
        "root mean square over them",
        against=against,
        order=first.order,
        flags=first.flags | {"bias": run.bias or "none"},
        input_rounding=decimal_text(rounding, 3),
        starts=len(motions),
        seconds=seconds,
    )
