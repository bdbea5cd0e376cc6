"""From what was measured to a row of the report."""

from __future__ import annotations

import math
from fractions import Fraction

from heavytop.errors import Contradiction, HeavyTopError, OutOfTime, PeerFailed, Unsupported
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.scalar import of_fraction
from heavytop.precision import decimal_text, exact_text, time_text
from heavytop.records import (
    CONTRADICTION,
    FAILED,
    OUT_OF_REACH,
    OUT_OF_TIME,
    UNSUPPORTED,
    Against,
    Data,
    Metric,
    MetricKind,
    Row,
    Series,
)
from heavytop.suite.cases import Case
from heavytop.suite.task import Task
from heavytop.top.amplification import amplification
from heavytop.top.heavy_top import HeavyTop, State


def time_metric(time: Fraction | None, kind: MetricKind) -> Metric:
    """A time as a metric; None is never."""
    return Metric("never", None, kind) if time is None else of_fraction(abs(time), kind, time_text(abs(time)))


def data_of(case: Case | None) -> Data | None:
    """The exact data of the motion that is measured; of an ensemble the start by which the others are drawn."""
    if case is None:
        return None
    top, start = case.top, case.start
    inertia, centre, omega, gamma, rotor = (
        tuple(map(exact_text, part)) for part in (top.inertia, top.centre, start.omega, start.gamma, top.rotor or ())
    )
    return Data(inertia, exact_text(top.weight), centre, omega, gamma, rotor)


def exact_row(
    task: Task,
    measured: str,
    reference: Against,
    metrics: dict[str, Metric],
    bits: int = 0,
    series: dict[str, Series] | None = None,
) -> Row:
    """The row of what is evaluated, not integrated.  Its samples are the times of the task."""
    horizon = time_text(task.times[-1]) if task.times else "0"
    return Row(
        case=task.title,
        system=task.key.system,
        integrator=task.subject,
        precision=task.key.precision,
        bits=bits,
        outcome=Outcome.SUCCESS.value,
        horizon=horizon,
        time_reached=horizon,
        steps=0,
        finite=all(metric.value != "nan" for metric in metrics.values()),
        metrics=metrics,
        key=task.key,
        reference=reference,
        measure=task.key.kind,
        measured=measured,
        against=reference.text,
        series=series or {},
        samples=len(task.times),
    )


def computed_row(
    task: Task, run: Trajectory, metrics: dict[str, Metric], series: dict[str, Series], reference: Against
) -> Row:
    """The row of a run: where it ended, what made its bits, and what was measured of it.

    A run that gives fewer samples than its task has times is incomplete, whatever it says of itself; finite only where
    it reached the last time and every metric is a number.
    """
    case, precision = task.given, run.problem.precision
    outcome = run.outcome
    if outcome is Outcome.SUCCESS and task.times and len(run.times) < len(task.times):
        outcome = Outcome.INCOMPLETE
    done = outcome is Outcome.SUCCESS
    horizon = task.times[-1] if task.times else run.time_reached
    return Row(
        case=task.title,
        system=run.problem.system.name,
        integrator=run.integrator,
        precision=precision.name,
        bits=precision.bits,
        outcome=outcome.value,
        horizon=time_text(horizon),
        time_reached=time_text(horizon if done else run.time_reached),
        steps=run.steps,
        finite=done and not any(m.value in ("nan", "missing") for m in metrics.values()),
        metrics=metrics,
        key=task.key,
        reference=reference,
        measure=task.key.kind,
        measured=f"computed: {run.integrator} in {precision.name}",
        against=reference.text,
        order=run.order,
        flags=run.flags,
        input_rounding=decimal_text(input_rounding(case.top, case.start, run.problem), 3),
        series=series,
        samples=len(run.times),
        seconds=run.seconds,
        amplification=_amplification(run.problem, horizon),
    )


_OUTCOMES: dict[type[HeavyTopError], str] = {
    Contradiction: CONTRADICTION,
    PeerFailed: FAILED,
    Unsupported: UNSUPPORTED,
    OutOfTime: OUT_OF_TIME,
}


def _amplification(problem: Problem, horizon: Fraction) -> float | None:
    """That of the motion of a problem, to three digits; None for data beyond double."""
    found = amplification(problem.system, problem.parameters, tuple(problem.start.flat), horizon)
    return float(f"{found:.3g}") if math.isfinite(found) else None


def unmeasured(task: Task, reason: HeavyTopError) -> Row:
    """The row of a task that came to nothing: an outcome of its own, no metric, and why in the place of a reference."""
    return Row(
        case=task.title,
        system=task.key.system,
        integrator=task.subject,
        precision=task.key.precision,
        bits=task.precision.bits if task.has_precision else 0,
        outcome=_OUTCOMES.get(type(reason), OUT_OF_REACH),
        horizon=task.key.horizon,
        time_reached="0",
        steps=0,
        finite=False,
        metrics={},
        key=task.key,
        reference=Against("none", reason=reason.cause),
        measure=task.key.kind,
        measured="nothing",
        against=f"nothing: {reason.cause}",
    )


def failed(task: Task, cause: str, kind: type[HeavyTopError] = PeerFailed) -> Row:
    """The row of a task whose integrator failed: ``cause``, and in which case at which setting."""
    setting = task.key.subject.setting
    return unmeasured(task, kind(" ".join(part for part in (cause, "in", task.title, setting) if part)))


def input_rounding(top: HeavyTop, start: State, problem: Problem) -> Fraction:
    """The largest relative rounding of the data that the run was given: not charged to it, but said."""
    given = problem.system.parameters(top, start)
    rounded = problem.parameters.numbers, problem.start.flat
    pairs = zip((*given.mapped(Fraction).numbers, *start.flat), sum(rounded, ()), strict=True)
    return max(abs(b - a) / abs(a) if a else Fraction(0) for a, b in pairs)
