"""Computed motions, held against their first integrals and against known motions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from heavytop.errors import OutOfReach
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome, Place, Problem, Trajectory
from heavytop.measure.drift import Drift
from heavytop.measure.known import certified
from heavytop.measure.local_error import LocalError
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.scorer import Scorer
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import Precision, decimal_text, exact, number, parse
from heavytop.records import Metric, Row, Series
from heavytop.suite.cases import Case
from heavytop.suite.checkpoint import Saved
from heavytop.suite.measurements.luck import Remembered, drift_bands, homoclinic_bands
from heavytop.suite.measurements.shared import case_of, input_rounding, integrator_of, time_metric, time_text
from heavytop.suite.task import Task
from heavytop.top.equations import Parameters
from heavytop.top.integrals import holding

BREAK_AWAY = Fraction(1, 1000)
"""A computed homoclinic motion has broken away when Ω is wrong by this, in units of α."""
WINDOW = 10
"""The error of a homoclinic run is a number only while rate·|t| is below this; later the saddle amplifies rounding."""
_CERTIFIED_AT = 4
"""The closed form of a homoclinic case is certified at this |t|."""


def homoclinic(task: Task) -> Row:
    """When a run leaves a homoclinic motion, and its error and drift before.

    The task: a case with a homoclinic closed form, whose data the format takes exactly; uniform times of one sign.
    Errors of Ω in 1/time unit, of γ none.  Raises OutOfReach where the closed form is not certified for the format.
    """
    case, precision = case_of(task), parse(task.precision)
    closed = case.homoclinic
    assert closed is not None
    problem = Problem.of(case.top, case.start, precision, case.system)
    if (problem.parameters, problem.start) != (_as_tuples(case), case.start):
        raise ValueError(f"{case.name} is not exact in {precision.name}: its data must be dyadic")
    sign = 1 if task.times[-1] > 0 else -1
    known = certified(closed, Fraction(sign * _CERTIFIED_AT), precision.bits + GUARD_BITS)
    if known is None:
        raise OutOfReach(f"{closed.method} is not certified for {precision.name}.", "Use a format with fewer bits.")
    watch = _Homoclinic(case, problem, closed, task.keep)
    run = propagate(case.top, case.start, task.times, precision, system=case.system, observer=watch)
    remembered = Remembered(closed.state)
    metrics = homoclinic_bands(task, run, watch.metrics(), lambda given: _Homoclinic(case, given, remembered))
    return computed_row(task, run, metrics, watch.series(), known.text)


class _Homoclinic:
    """Drift, and the error while it is a number, and when it has become too large."""

    def __init__(self, case: Case, problem: Problem, closed: Any, keep: Sequence[Fraction] = ()) -> None:
        self.name = "integration_error" if case.claim else "solution_error"
        self.rate = case.rate
        self.drift = Drift(problem, holding(case.top, case.start, case.system), keep)
        self.near = SolutionError(problem, closed, keep)
        self.far = SolutionError(problem, closed, keep, threshold=BREAK_AWAY * case.alpha)

    def __call__(self, time: Fraction, state: Any) -> None:
        self.drift(time, state)
        self.far(time, state)
        if float(abs(time)) * self.rate <= WINDOW:
            self.near(time, state)

    def metrics(self) -> dict[str, Metric]:
        metrics = {"break_away_time": time_metric(self.far.break_away, "duration")}
        return metrics | self.near.metrics(self.name) | self.drift.metrics()

    def series(self) -> dict[str, Series]:
        return self.far.series(time_text, self.name) | self.drift.series(time_text)


def _as_tuples(case: Any) -> Parameters:
    given = case.system.parameters(case.top, case.start)
    return Parameters(tuple(given.inertia), tuple(given.moment), Fraction(given.rotor))


def drift(task: Task, saved: Saved) -> Row:
    """Drift of every first integral that holds, and the solution error where the motion is known at the last time.

    The task: any case and format; uniform times of one sign, of which ``keep`` go into the series.
    saved: the place that an interrupted run left, and where this one keeps its own.
    Drift in units of each integral, errors of Ω in 1/time unit, of γ none.  Raises Contradiction where two proofs of
    the known motion exclude each other, InputError for a place reached with other flags.
    """
    case, precision = case_of(task), parse(task.precision)
    problem = Problem.of(case.top, case.start, precision, case.system)
    # samples are taken at the rounded times, so the series must be asked for by these
    keep = [exact(number(time, precision)) for time in task.keep]
    scorer = Scorer(problem, exact(number(task.times[-1], precision)), keep)
    run = streamed(task, precision, scorer, saved)
    metrics = drift_bands(task, run, scorer.metrics())
    return computed_row(task, run, metrics, scorer.series(time_text), scorer.against)


def local_error(task: Task) -> Row:
    """Errors of the single steps that begin before the last time, and the order that shows beyond them.

    The task: any case and format, its last time > 0.  Raises OutOfReach where a step is not enclosed, and at an
    equilibrium, where there are no steps.
    """
    case, precision = case_of(task), parse(task.precision)
    asked = integrator_of(task).first_steps
    run, steps = asked(case.top, case.start, task.times[-1], precision, system=case.system)
    if run.outcome is Outcome.SUCCESS and not steps:
        raise OutOfReach(f"{case.name} rests, so its integrator takes no step.", "Measure the steps of a motion.")
    error = LocalError(run.problem)
    for time, step in zip(run.times, steps, strict=True):
        error(time, step)
    return computed_row(task, run, error.metrics(), {}, "known: validated enclosure of each step from where it starts")


def streamed(task: Task, precision: Precision, scorer: Scorer, saved: Saved) -> Trajectory:
    """The run of a task through the scorer, from the place that was saved; it saves its own on the way."""
    case, before = case_of(task), saved.load()
    if before is not None:
        scorer.restore(before["measures"])

    def mark(place: Place) -> None:
        if saved.due():
            saved.save({"run": place.content(precision), "measures": scorer.content()})

    going_on: dict[str, Any] = {}
    if task.integrator == "heyoka":
        place = None if before is None else Place.of(before["run"], precision)
        going_on = {"place": place, "mark": mark}
    integrate = integrator_of(task).propagate
    run: Trajectory = integrate(
        case.top, case.start, task.times, precision, system=case.system, observer=scorer, **going_on
    )
    return run


def computed_row(
    task: Task, run: Trajectory, metrics: dict[str, Metric], series: dict[str, Series], against: str
) -> Row:
    """The row of a run: where it ended, what made its bits, and what was measured of it.

    A run that gives fewer samples than its task has times is incomplete, whatever it says of itself; finite only where
    it reached the last time and every metric is a number.
    """
    case, precision = case_of(task), run.problem.precision
    outcome = run.outcome
    if outcome is Outcome.SUCCESS and task.times and len(run.times) < len(task.times):
        outcome = Outcome.INCOMPLETE
    done = outcome is Outcome.SUCCESS
    horizon = task.times[-1] if task.times else run.time_reached
    return Row(
        case=task.name,
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
        measure=task.kind,
        measured=f"computed: {run.integrator} in {precision.name}",
        against=against,
        order=run.order,
        flags=run.flags,
        input_rounding=decimal_text(input_rounding(case.top, case.start, run.problem), 3),
        series=series,
        samples=len(run.times),
        seconds=run.seconds,
    )
