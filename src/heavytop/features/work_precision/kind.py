"""Seconds against error: one integrator at one tolerance or step, over a horizon, compared with the known motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

import msgspec

from heavytop.errors import InputError, PeerFailed
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.features.work_precision.charts import method_growth, work_precision
from heavytop.features.work_precision.curves import (
    CONSTANTS,
    LANES,
    OURS,
    WorkPrecisionLine,
    beside_ours,
    fastest,
    leads,
    panels,
)
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive, uniform
from heavytop.harness.rows import Find, PlanTable, Task, computed, computed_row, run_with_attitude
from heavytop.integrate import registry
from heavytop.integrate.registry import IntegratorSource, name_of
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.kind import Kind, with_explanation
from heavytop.measure.attitude_error import ATTITUDE_ERROR, JOINT_VIOLATION, POSITION_ERROR
from heavytop.measure.integrator import TOO_LONG, Repeats, doubtful_counts, require_counts, timed, tried
from heavytop.measure.scalar import RELATIVE, metric, of_fraction
from heavytop.measure.scorer import DRIFT, ERRORS, SOLUTION_ERROR, Scorer
from heavytop.measure.truth import Truth, truth
from heavytop.precision import DOUBLE, exact, parse, physical, rounded, time_text, usable_tolerance
from heavytop.records import FINEST, Beside, Explained, Metric, Quantity, Row, Subject, by_name
from heavytop.report.document.document import Block, Chart, In, Note, clip
from heavytop.report.document.document import Table as Cells
from heavytop.report.store.checks import CLOSE, bound, ended, peak, size_of
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import State

NAME = "work_precision"
_USUAL = Repeats(3, 100, 0.3)
_FOR_COMPARISON = Repeats(11, 201, 1.0, 3, band=True)
ERROR_MAX, ERROR_FINAL = ERRORS
RETURN = Quantity("return_error")
_RUNGS = {"tolerance": ["1e-6", "1e-9", "1e-12", FINEST], "step": ["1/10", "1/30", "1/100", "1/300"], "": [FINEST]}
"""Points in double of an integrator that is compared with heyoka, by its control parameter."""
_MISSING = Metric("missing", None)
_OF_OTHERS = 0.6
"""Decades of rounding noise of third-party integrators, whose step control turns a rounding into another step: rerun
with other roundings, CVODE and splitting methods move by up to a decade."""


class Curve(msgspec.Struct, forbid_unknown_fields=True):
    """One integrator in one format; ``tolerances``, of which "eps" is the finest it offers, or ``steps`` if fixed."""

    integrator: str
    precision: str = "double"
    tolerances: list[str] = []
    steps: list[str] = []

    def subjects(self) -> Iterator[Subject]:
        """The subject of each point; raises InputError for an impossible value."""
        if not self.tolerances and not self.steps:
            raise InputError(
                f"The list of points of {self.integrator} is empty.",
                'Give it steps or tolerances; ["eps"] where nothing sets it.',
            )
        for text in self.steps:
            if text != FINEST and physical(text, "step") <= 0:
                raise InputError(f"steps must be positive; got {text[:60]!r}.", "Give positive numbers.")
        for text in self.tolerances:
            if text != FINEST and not 0 < physical(text, "tolerance") <= 1:
                raise InputError(f"tolerances must be above 0, up to 1; got {text[:60]!r}.", "Give such numbers.")
            if self.integrator in (OURS, CONSTANTS, LANES) and text != FINEST:
                usable_tolerance(text, parse(self.precision))
        yield from (computed(self.integrator, tolerance=text) for text in self.tolerances)
        yield from (computed(self.integrator, step=text) for text in self.steps)


class WorkPrecisionTable(PlanTable, tag=NAME):
    """Each point of each curve over the same horizon; ``samples`` uniform samples.

    timings: whether runs are repeated so often that two reports of one machine can be compared by their seconds.
    attitude: whether a run with the attitude is measured too, of an integrator that carries it.
    """

    cases: list[str]
    horizon: str
    ladders: list[Curve]
    samples: int = 100
    timings: bool = False
    attitude: bool = False

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        (horizon,) = positive([self.horizon], "horizon")
        times, keep = uniform(horizon, self.samples)
        points = [(parse(curve.precision), subject) for curve in self.ladders for subject in curve.subjects()]
        request = {"attitude": str(self.attitude)}
        more = {"suffix": f"/T={self.horizon}", "keep": keep, "options": self, "request": request}
        return [
            Task.of_run(NAME, case, by, precision, times, subject=f"{by.name} {by.setting}", **more)
            for case in map(find, self.cases)
            for precision, by in points
        ]

    def with_integrator(self, which: str | IntegratorSource) -> PlanTable | None:
        """Four points of a curve in double, and the finest in other formats, where heyoka has a curve."""
        integrator = name_of(which)
        formats = dict.fromkeys(parse(curve.precision).name for curve in self.ladders if curve.integrator == OURS)
        control = registry.control_apart(which) if DOUBLE.name in formats else ""
        ladders = [
            Curve(integrator, name, **{"steps" if control == "step" else "tolerances": _RUNGS[control]})
            if name == DOUBLE.name
            else Curve(integrator, name, [FINEST])
            for name in formats
        ]
        return msgspec.structs.replace(self, ladders=ladders) if ladders else None


class WorkPrecision(Kind):
    """error_final and error_max (largest component, at the end and over the samples), return_error, and drift.

    seconds: ``run`` is the median and ``least`` the fastest of ``repeats`` runs to the end alone; ``compile`` is apart.
    ``band``: with ``timings``, half-width in decades of the interval that holds the middle 95 % of the runs.
    """

    name = NAME
    table = WorkPrecisionTable
    may_end_early = "work against precision"
    place = 40

    def assumed_band(self, subject: Subject) -> float:
        """The noise of third-party integrators."""
        return 0.0 if subject.name in (OURS, CONSTANTS, LANES) else _OF_OTHERS

    def roundings(self, quantity: Quantity | None, steps: int) -> float:
        """√n eps for a first integral, whose roundings walk at random, and n for the distance from the true motion, in
        which drift adds up along the flow.
        """
        if steps < 1:
            return 0.0
        return math.log10(steps) * (0.5 if quantity is not None and quantity.name == DRIFT else 1.0)

    def measure(self, task: Task, saved: Saved) -> Row:
        """Raises PeerFailed where the third-party integrator fails."""
        case, precision = task.given, task.precision
        problem = Problem.of(case.top, case.start, precision, case.system)
        # found before the runs: looking through the installed packages empties the caches of the processor
        peer = registry.ready(task.integrator, _setting(task.key.subject))

        def integrate(times: Any, start: State = case.start) -> Trajectory:
            top = problem.top if case.system is GYROSTAT and start is not case.start else case.top
            return peer(top, start, times, precision, system=case.system)

        sampled = integrate(task.times)
        scorer = _scored(task, problem, sampled)
        metrics, error, turned = _metrics(scorer, bool(sampled.times)), _error(scorer), None
        if sampled.joint_violation is not None:
            metrics[Quantity(JOINT_VIOLATION, statistic="max")] = of_fraction(exact(sampled.joint_violation))
        if task.options.attitude and task.integrator.carries_attitude:
            turned, more = _of_attitude(task)
            metrics |= more
        seconds, alone = self._timed(task, integrate, sampled, error)
        done = alone.outcome is Outcome.SUCCESS and sampled.outcome is Outcome.SUCCESS
        if case.system is not GYROSTAT:
            metrics[RETURN] = _returned(problem, alone, integrate) if done else _MISSING
        if not done:
            metrics[ERROR_FINAL] = _MISSING
        run = replace(alone, times=sampled.times, states=sampled.states, seconds=seconds)
        if not done and alone.outcome is Outcome.SUCCESS:
            run = replace(run, outcome=sampled.outcome, time_reached=sampled.time_reached)
        row = computed_row(task, run, by_name(metrics), scorer.series(time_text), scorer.against)
        row = msgspec.structs.replace(row, integrator=task.subject, evaluations=run.evaluations)
        if done and not task.integrator.own and (text := doubtful_counts(run, error, partial(_coarse, task, problem))):
            return msgspec.structs.replace(row, explained=Explained("steps", text))
        return with_explanation(row, task, turned or run, scorer)

    def _timed(
        self, task: Task, integrate: Any, sampled: Trajectory, error: Fraction | None
    ) -> tuple[dict[str, float], Trajectory]:
        """Seconds, and a run to the end alone; of another package's integrator tried and checked."""
        # more of them where seconds are to be compared
        end, how = task.times[-1:], _FOR_COMPARISON if task.options.timings else _USUAL
        name = task.integrator.name
        if not task.integrator.own and sampled.outcome is Outcome.SUCCESS:
            seconds, alone = tried(name, sampled.problem, integrate, sampled, error, how)
            counted = replace(alone, times=sampled.times, states=sampled.states)
            require_counts(name, counted, _setting(task.key.subject))
            return seconds, alone
        alone = integrate(end)
        warm = alone.seconds["run"] < TOO_LONG and alone.outcome is Outcome.SUCCESS
        figures, runs = timed(lambda number: integrate(end) if warm or number > 1 else alone, how)
        alone = runs[-1]
        compiling = max(run.seconds["compile"] for run in (sampled, alone))
        return {"compile": compiling} | figures, alone

    def contradictions(self, row: Row) -> Iterator[str]:
        """The errors are the largest of Ω and γ; the median of the seconds is no less than the least of them."""
        if row.seconds.get("least", 0.0) > row.seconds.get("run", math.inf):
            yield "seconds: the fastest run is slower than the median"
        names = (Quantity(SOLUTION_ERROR, part).text for part in ("omega", "gamma"))
        both = [row.series[name] for name in names if name in row.series]
        largest, last = (row.metrics.get(quantity.text) for quantity in (ERROR_MAX, ERROR_FINAL))
        if len(both) < 2 or largest is None:
            return
        if (
            max((size for series in both if (size := peak(series)) is not None), default=-math.inf)
            > bound(largest) + CLOSE
        ):
            yield "error_max: smaller than its series"
        if last is None or last.log10 is None:
            return
        if largest.log10 is not None and last.log10 > largest.log10 + CLOSE:
            yield "error_final: larger than the largest"
        if not all(ended(series, row) for series in both):
            return
        ends = [size for series in both if (size := size_of(series.values[-1])) is not None]
        if len(ends) == len(both) and abs(max(ends) - last.log10) > CLOSE:
            yield "error_final: not the last value of its series"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The fastest integrator at 1e-10; a table and a sentence on heyoka for each case.  In short, the integrator
        compared with heyoka point by point, where there is one.
        """
        if (headline := fastest(rows)) is not None:
            yield headline
        for index, (case, lines) in enumerate(panels(rows).items()):
            yield _table("" if index else _TITLE, case, lines)
        yield from (Note(lead.text) for lead in leads(rows))
        shorter = [Note(f"{lead.case}: {lead.short}.", shown=In.SHORT) for lead in leads(rows) if lead.short]
        yield from beside_ours(rows) or shorter
        doubts = ((row, row.explained) for row in rows if row.explained and row.explained.kind == "steps")
        yield from (Note(f"{clip(row.case)} {row.integrator}: {doubt.text}") for row, doubt in doubts)
        yield from (Chart(work_precision), Chart(method_growth))


_TITLE = "Work against precision: seconds that an error takes, whole horizon"


def _table(title: str, case: str, lines: Sequence[WorkPrecisionLine]) -> Cells:
    """Seconds that an error takes, a line an integrator."""
    cells = []
    for line in lines:
        best = line.best
        texts = ["-", "-"] if best is None else [f"{10**best.log10:.1e}", line.takes(best.seconds)]
        at = (line.seconds_at(log10) for log10 in (-6.0, -10.0, -14.0))
        texts += ["-" if seconds is None else line.takes(seconds) for seconds in at]
        texts.append(line.order_text)
        cells.append([line.label, *texts, str(len(line.failures) or "")])
    columns = [case, "least error", "takes", "1e-6 takes", "1e-10 takes", "1e-14 takes", "order", "aborted"]
    return Cells(title, columns, cells)


def _setting(subject: Subject) -> tuple[str, Fraction] | None:
    """The setting of the integrator; None for the finest that it offers."""
    if FINEST in (subject.tolerance, subject.step):
        return None
    return ("tolerance", exact(subject.tolerance)) if subject.tolerance else ("step", exact(subject.step))


def _coarse(task: Task, problem: Problem) -> Fraction | None:
    """The largest error in steps twice as long; None where no step is set, or the run fails."""
    case, setting = task.given, _setting(task.key.subject)
    if setting is None or setting[0] != "step":
        return None
    with suppress(PeerFailed):
        peer = registry.ready(task.integrator, ("step", 2 * setting[1]))
        run = peer(case.top, case.start, task.times, task.precision, system=case.system)
        return _error(_scored(task, problem, run)) if run.outcome is Outcome.SUCCESS else None
    return None


def _error(scorer: Scorer) -> Fraction | None:
    """The largest error over the samples, or what it is below; None without a reference."""
    if scorer.error is None:
        return None
    parts = [scorer.error.running[part].sums.maximum for part in ("omega", "gamma")]
    return max(midpoint(part) + radius(part) for part in parts) if all(part.is_finite() for part in parts) else None


def _scored(task: Task, problem: Problem, run: Trajectory) -> Scorer:
    keep = [rounded(time, problem.precision) for time in task.keep]
    times = tuple(rounded(time, problem.precision) for time in task.times)
    scorer = Scorer(problem, _truth(problem, times), keep)
    scorer.add_states(run.times, run.states)
    return scorer


def _metrics(scorer: Scorer, sampled: bool) -> dict[Quantity, Metric]:
    """The largest drifts, and the errors."""
    measures = ((metric.quantity, metric) for metric in scorer.drift.metrics().values())
    metrics = {quantity: metric for quantity, metric in measures if quantity and quantity.statistic == "max"}
    if scorer.error is not None and sampled:
        omega, gamma = (scorer.error.running[part] for part in ("omega", "gamma"))
        metrics[ERROR_FINAL] = metric(omega.sums.final.max(gamma.sums.final))
        metrics[ERROR_MAX] = metric(omega.sums.maximum.max(gamma.sums.maximum))
        metrics[RELATIVE] = metric(scorer.error.running["relative"].sums.maximum)
    elif scorer.error is not None:
        metrics[ERROR_MAX] = _MISSING
    return metrics


def _of_attitude(task: Task) -> tuple[Trajectory, dict[Quantity, Metric]]:
    """The run with ξ, and the largest errors of attitude and position."""
    run, scorer = run_with_attitude(task)
    measured = ((metric.quantity, metric) for metric in scorer.metrics().values())
    names = (ATTITUDE_ERROR, POSITION_ERROR)
    return run, {q: metric for q, metric in measured if q is not None and q.name in names and q.statistic == "max"}


def _returned(problem: Problem, run: Trajectory, integrate: Any) -> Metric:
    """How far from the start the way back ends, largest component.

    The way back is the way on from (−Ω, γ): the heavy top is reversible, (Ω, γ, t) -> (−Ω, γ, −t).
    """
    end = [exact(value) for value in run.states[-1]]
    back = integrate([run.times[-1]], State([-value for value in end[:3]], end[3:]))
    if back.outcome is not Outcome.SUCCESS:
        return _MISSING
    signs = (-1, -1, -1, 1, 1, 1)
    pairs = zip(signs, back.states[-1], problem.start.flat, strict=True)
    return of_fraction(max(abs(sign * exact(value) - start) for sign, value, start in pairs))


@lru_cache(maxsize=8)
def _truth(problem: Problem, times: tuple[Fraction, ...]) -> Truth | str:
    """The reference shared by all integrators, with the states computed so far."""
    known = truth(problem, times)
    return known if isinstance(known, str) else known.remembered()
