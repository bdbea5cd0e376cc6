"""Drift of the first integrals over a horizon, and errors against the true motion if that is known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import msgspec

from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive, uniform
from heavytop.harness.rows import Find, PlanTable, Task, computed, computed_row, run_with_attitude
from heavytop.integrate.trajectory import Problem, ResumePoint, Trajectory
from heavytop.kind import Kind, with_explanation
from heavytop.measure.rounding_noise import Reruns
from heavytop.measure.scorer import Scorer
from heavytop.measure.truth import truth
from heavytop.precision import DOUBLE, parse, rounded, time_text
from heavytop.records import HEYOKA, NOISE, NOT_CARRIED, NOT_MEASURED, Beside, Metric, Row
from heavytop.report.document.document import Block, Chart
from heavytop.report.render.page import attitude_columns, digits_columns, digits_headline, motions
from heavytop.report.render.plots import digits, growth
from heavytop.report.render.text import COMPUTED, DIGITS, NOISE_BAND, largest_over

NAME = "drift"


class DriftRun(msgspec.Struct, forbid_unknown_fields=True):
    """One format with its horizon; ``samples`` uniform samples."""

    precision: str
    horizon: str
    samples: int = 1000


class DriftTable(PlanTable, tag=NAME):
    """integrator: any that `heavytop list` shows.

    attitude: whether ξ is integrated too, and its errors and those of the centre of mass are measured; an integrator
    that does not declare the attitude integrates Ω and γ alone, and the row has a flag.
    noise: whether each motion is computed again with other roundings, which takes most of the time of a row.
    step: of an integrator with fixed steps; empty for its default.
    """

    cases: list[str]
    runs: list[DriftRun]
    integrator: str = HEYOKA
    attitude: bool = False
    noise: bool = True
    step: str = ""

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        runs = []
        for run in self.runs:
            (horizon,) = positive([run.horizon], "horizon")
            runs.append((parse(run.precision), *uniform(horizon, run.samples)))
        if self.step:
            positive([self.step], "step")
        subject, suffix = computed(self.integrator, step=self.step), f"/step={self.step}" if self.step else ""
        more = {"suffix": suffix, "options": self, "request": {"attitude": str(self.attitude)}}
        return [
            Task.of_run(NAME, case, subject, precision, times, keep=keep, **more)
            for case in map(find, self.cases)
            for precision, times, keep in runs
        ]


class DriftKind(Kind):
    """Drift in units of each integral, errors of Ω in 1/time unit, those of γ without unit."""

    name = NAME
    table = DriftTable
    noise_factor = 5.0
    place = 30

    def noise_is_reruns(self, metric: Metric) -> bool:
        """True: all bands are from reruns."""
        return True

    def cost(self, task: Task) -> float:
        """The cost of the run, and about a second for reruns and reference."""
        return (0.8 if task.options.noise else 0.1) + task.run_seconds

    def measure(self, task: Task, saved: Saved) -> Row:
        """Measure one run.  Raises Contradiction if two proofs of the motion exclude each other, InputError for a
        resume point with other flags.
        """
        if task.options.attitude and task.integrator.carries_attitude:
            return _row(task, *run_with_attitude(task))
        case, precision = task.given, task.precision
        problem = Problem.of(case.top, case.start, precision, case.system)
        # samples are at the rounded times, which select those of the series
        keep = [rounded(time, precision) for time in task.keep]
        scorer = Scorer(problem, truth(problem, [rounded(time, precision) for time in task.times]), keep)
        stored = saved.load()
        if stored is not None:
            scorer.restore(stored["measures"])
            _require_same_samples(scorer, [rounded(t, precision) for t in task.times], stored["run"]["samples"])

        def mark(resume_point: ResumePoint) -> None:
            if saved.due():
                saved.save({"run": resume_point.content(precision), "measures": scorer.content()})

        resume: dict[str, Any] = {}
        if task.integrator.ensemble:
            resume = {"place": None if stored is None else ResumePoint.of(stored["run"], precision), "mark": mark}
        run = task.integrator.propagate(case.top, case.start, task.times, precision, case.system, scorer, **resume)
        return _row(task, run, scorer)

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """Significant digits at the longest horizon, digits right per motion, and all results per row."""
        if (headline := digits_headline(rows)) is not None:
            yield headline
        yield from digits_columns(rows)
        yield from attitude_columns(rows)
        yield motions(
            "Long runs: distance from the true motion (along the flow, across it) and drift of the first integrals",
            rows,
            [
                f"Both absolute, {largest_over(rows)}: a conserved integral does not prove the trajectory correct.",
                DIGITS,
                COMPUTED + " Errors are those to the end of the reference, b or later.",
                NOISE_BAND,
            ],
        )
        yield from (Chart(digits), Chart(growth))


def _row(task: Task, run: Trajectory, scorer: Scorer) -> Row:
    noise, alone = task.options.noise, task.options.attitude and run.problem.xi is None
    left_out = ({} if noise else {NOISE: NOT_MEASURED}) | (NOT_CARRIED if alone else {})
    metrics = scorer.metrics()
    if noise:
        plain = Problem.of(task.given.top, task.given.start, DOUBLE, task.given.system)
        metrics = Reruns(plain, task.integrator, task.seed).drift_bands(run, task.times, metrics, scorer.truth)
    marked = replace(run, flags=run.flags | left_out)
    row = computed_row(task, marked, metrics, scorer.series(time_text), scorer.against)
    return with_explanation(row, task, run, scorer)


def _require_same_samples(scorer: Scorer, times: Sequence[Fraction], samples: int) -> None:
    """Raise ValueError unless the scorer has measured the first ``samples`` samples."""
    known = scorer.truth
    for running in scorer.running().values():
        error = scorer.error is not None and running in scorer.error.running.values()
        scored = [t for t in times[:samples] if not error or isinstance(known, str) or known.covers(t)]
        if running.count != len(scored) or list(running.kept) != [t for t in scored if t in scorer.drift.keep]:
            raise ValueError("the place of the run is not that of what was measured of it")
