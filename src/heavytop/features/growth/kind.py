"""Growth laws of drift and error over an ensemble of random starts, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from time import perf_counter
from typing import Any

import msgspec

from heavytop.cases import Case
from heavytop.errors import InputError
from heavytop.harness.case_text import ensemble_of, one_motion
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Find, PlanTable, Task, computed, input_rounding
from heavytop.integrate.registry import IntegratorSource, control_apart
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.kind import Kind
from heavytop.measure.attitude_error import AttitudeScorer
from heavytop.measure.integrator import Ended, complete, growing
from heavytop.measure.scalar import of_fraction
from heavytop.measure.scorer import DRIFT, Scorer
from heavytop.measure.truth import EnsembleReference, reference
from heavytop.precision import decimal_text, exact, parse, physical, rounded, time_text, usable_tolerance
from heavytop.records import HEYOKA, NOT_CARRIED, Beside, Law, Metric, Quantity, Row, by_name
from heavytop.report.document.document import Block, Cell, Chart, computed_by, integral_text, short
from heavytop.report.document.document import Table as Cells
from heavytop.report.render.page import laws_headlines
from heavytop.report.render.plots import digits
from heavytop.report.render.plots import growth as over_time
from heavytop.report.render.terminal import laws_in_short
from heavytop.top.attitude import perpendicular

NAME = "growth"
FAILED = Quantity("starts_failed")
_MOST_BITS = 900
"""Errors in wider formats underflow in the doubles of the fits."""
_BAND_OF_ONE = 0.75
"""Decades, times 1/√n for n starts: 1.96/(√2 ln 10) = 0.60 for normal errors, more for heavier tails.  From 24 starts
on it is below the 2 bits by which every error may grow."""
_LIMITS = {"starts": range(1, 100_001), "samples": range(4, 1001), "decades": range(1, 13)}


class GrowthRun(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A format with its horizon, and the settings of its ensemble.

    samples: per decade, over ``decades`` decades before the horizon.  starts: random ones, determined by the seed.
    tolerance, high_accuracy: of the integrator.  bias: a relative error of I1 in the integrated field, but not in the
    reference: a planted fault.  reference: a format with the fewest bits of reference runs, used if no closed form is
    known; they always have 30 bits more than ``precision``.
    attitude: whether ξ is integrated too, for laws of the errors of the attitude and of the centre of mass, if the
    integrator declares that it carries the attitude.
    """

    precision: str
    horizon: str
    starts: int = 64
    seed: int = 1
    samples: int = 16
    decades: int = 5
    tolerance: str | None = None
    high_accuracy: bool = False
    bias: str | None = None
    reference: str | None = None
    attitude: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """The options of the integrator."""
        tolerance = {} if self.tolerance is None else {"tolerance": exact(self.tolerance)}
        return tolerance | ({"high_accuracy": True} if self.high_accuracy else {})


class GrowthTable(PlanTable, tag=NAME):
    """integrator: any that `heavytop list` shows."""

    cases: list[str]
    runs: list[GrowthRun]
    integrator: str = HEYOKA

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        return [_task(case, run, self.integrator) for case in map(find, self.cases) for run in self.runs]

    def with_integrator(self, which: str | IntegratorSource) -> PlanTable | None:
        """Without the runs whose tolerance that integrator does not have."""
        has = control_apart(which) == "tolerance"
        runs = [run for run in self.runs if has or run.tolerance is None]
        return PlanTable.with_integrator(msgspec.structs.replace(self, runs=runs), which) if runs else None


def _task(case: Case, run: GrowthRun, integrator: str) -> Task:
    """The task of a row; raises InputError for an impossible value."""
    precision = parse(run.precision)
    if precision.bits > _MOST_BITS:
        raise InputError(f"Ensembles in {precision.name} are not supported.", f"Use formats up to real:{_MOST_BITS}.")
    for name, limits in _LIMITS.items():
        if (value := getattr(run, name)) not in limits:
            raise InputError(f"{name} must be from {limits[0]} to {limits[-1]}; got {value}.", "Change it.")
    horizon = physical(run.horizon, "horizon")
    if horizon <= 0:
        raise InputError(f"horizon of a growth run must be positive; got {run.horizon}.", "Give a positive number.")
    if run.tolerance is not None:
        usable_tolerance(run.tolerance, precision)
    if run.bias is not None and abs(exact(run.bias)) >= 1:
        raise InputError(f"bias must be between -1 and 1; got {run.bias}.", "Give a relative error, such as 1e-9.")
    if run.reference is not None and parse(run.reference).bits <= precision.bits:
        raise InputError(f"reference must have more bits; got {run.reference}.", f"Give more than {run.precision}.")
    steps = range(-run.samples * run.decades, 1)
    times = tuple(horizon * Fraction(f"{10 ** (step / run.samples):.4g}") for step in steps)
    controls = {"tolerance": run.tolerance or "", "high_accuracy": run.high_accuracy, "bias": run.bias or ""}
    subject = computed(integrator, seed=run.seed, **controls)
    reference = "" if run.reference is None else parse(run.reference).name
    request = {"attitude": str(run.attitude), "reference": reference}
    title = f"{integrator} {subject.variant}".rstrip()
    more = {"subject": title, "keep": times, "options": run, "request": request}
    return Task.of_run(NAME, case, subject, precision, times, **more)


class _Done(msgspec.Struct):
    """The finished motions of a row by the index of the start: the checkpoint of a row in progress."""

    motions: dict[int, Ended]


class Growth(Kind):
    """The law of each error, its interval, its detection power.  Each metric is a root mean square over the starts."""

    name = NAME
    table = GrowthTable
    noise_factor = 6.0
    place = 50

    def carries_band(self, metric: Metric) -> bool:
        """Whether the metric is an error; the number of failed starts is not."""
        return super().carries_band(metric) and metric.quantity != FAILED

    def least_band(self, starts: int) -> float:
        """The band of an RMS over few starts, which may miss the tail that those of a rerun contain."""
        return _BAND_OF_ONE / math.sqrt(starts)

    def cost(self, task: Task) -> float:
        """The cost of all starts, several of them in parallel."""
        return 5.0 + int(task.options.starts) * task.run_seconds / 2

    def measure(self, task: Task, saved: Saved) -> Row:
        """Measure a row; starts in ``saved`` are not computed again.

        Raises InputError for data outside the range of the format, OutOfReach if a first integral is not resolved.
        """
        case, precision, run = task.given, task.precision, task.options
        members = ensemble_of(case, run.starts, run.seed)
        true = [Problem.of(*member, precision, case.system) for member in members]
        turned = run.attitude and task.integrator.carries_attitude
        # with the default ξ of a start without attitude
        posed = [Problem.of(*m, precision, case.system, perpendicular(m[1].gamma)) for m in members] if turned else true
        biased = [_biased(problem, run.bias) for problem in posed]
        times = [rounded(time, precision) for time in task.times]
        stored = saved.load()
        done = _Done({}) if stored is None else msgspec.convert(stored, _Done, strict=False)

        def save() -> None:
            if saved.due():
                saved.save(msgspec.to_builtins(done, str_keys=True))

        began = perf_counter()
        compared = reference(tuple(true), tuple(times), parse(run.reference).bits if run.reference else 0)
        ready = perf_counter()
        scorers = [
            AttitudeScorer(problem, motion, *member, times, times) if turned else Scorer(problem, motion, times)
            for problem, motion, member in zip(posed, compared.motions, members, strict=True)
        ]
        complete(done.motions, biased, times, scorers, save, task.integrator, run.options)
        motions = [done.motions[index] for index in range(len(members))]
        seconds = {"reference": ready - began, "run": perf_counter() - ready, "compile": motions[0].compile}
        rounding = max(input_rounding(*member, p) for member, p in zip(members, true, strict=True))
        return _row(task, [start for _, start in members], motions, scorers, compared, seconds, rounding)

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The headlines, the laws in brief, and a table with a line for each law."""
        yield from laws_headlines(rows)
        yield from laws_in_short(rows)
        chaotic = any(law.growth == "exponential" for row in rows for law in row.laws.values())
        notes = ["Detects: the smallest relative fault per step that these starts distinguish from rounding noise."]
        if chaotic:
            notes.append("Rate: the median over the starts of their finite-time rates.")
        lacking = dict.fromkeys(row.key.subject.name for row in rows if NOT_CARRIED.items() <= row.flags.items())
        notes += [f"No attitude, which it does not carry: {', '.join(lacking)}."] if lacking else []
        columns = ["case", "format", "quantity", "starts", "law", "exponent or rate [95 %]", "detects"]
        columns.append("lost at |t|")
        title = "Growth laws: root mean square over the starts, of drifts of first integrals and errors"
        cells = [_cells(row, law) for row in rows for law in row.laws.values()]
        yield Cells(title, columns, cells, notes)
        yield from (Chart(digits), Chart(over_time))


def _cells(row: Row, law: Law) -> list[Cell]:
    return [
        f"{row.case}{computed_by(row)} {row.key.subject.variant}".rstrip(),
        row.precision,
        _label(law),
        f"{law.starts} of {row.starts}" if law.starts < row.starts else str(law.starts),
        law.growth,
        _exponent(law),
        short(law.detects or "-", 2),
        short(law.lost_at or "-", 2),
    ]


def _biased(problem: Problem, bias: str | None) -> Problem:
    """The problem with the planted fault: the first moment of inertia has the relative error ``bias``."""
    if bias is None:
        return problem
    first, *rest = problem.parameters.inertia
    biased = rounded(first * (1 + exact(bias)), problem.precision)
    return replace(problem, parameters=problem.parameters._replace(inertia=(biased, *rest)))


def _row(
    task: Task,
    starts: Sequence[Any],
    motions: Sequence[Ended],
    scorers: Sequence[Scorer],
    compared: EnsembleReference,
    seconds: dict[str, float],
    rounding: Fraction,
) -> Row:
    """The row of the finished motions."""
    precision, first = task.precision, motions[0]
    alone = task.options.attitude and not task.integrator.carries_attitude
    failed = [motion for motion in motions if motion.outcome != Outcome.SUCCESS.value]
    reached = min((abs(Fraction(motion.time_reached)) for motion in failed), default=abs(task.times[-1]))
    distance = math.sqrt(sum(float(part) ** 2 for part in task.given.top.centre))
    measured = growing(starts, task.times, motions, scorers, compared, time_text, distance)
    metrics = {FAILED: of_fraction(Fraction(len(failed)), words=str(len(failed)))} | measured.metrics
    of = "roundings of one motion" if one_motion(task.given, task.options.seed) else "random starts"
    who = f"computed: {first.integrator} in {precision.name}"
    return Row(
        case=task.title,
        integrator=f"{first.integrator} {task.key.subject.variant}".rstrip(),
        bits=precision.bits,
        outcome=failed[0].outcome if failed else first.outcome,
        time_reached=time_text(reached),
        steps=sum(motion.steps for motion in motions),
        finite=not failed and not any(m.value in ("nan", "missing") for m in metrics.values()),
        metrics=by_name(metrics),
        key=task.key,
        reference=compared.against,
        measured=f"{who}, {len(motions)} {of}, root mean square over them",
        order=first.order,
        flags=first.flags | {"bias": task.options.bias or "none"} | (NOT_CARRIED if alone else {}),
        input_rounding=decimal_text(rounding, 3),
        series=measured.series,
        samples=len(task.times),
        starts=len(motions),
        laws=measured.laws,
        seconds=seconds,
        request=task.request,
    )


def _label(law: Law) -> str:
    """The name of the quantity of a law."""
    quantity = law.quantity or Quantity("")
    if quantity.name == DRIFT:
        return integral_text(quantity.component)
    component = quantity.component or quantity.name.removesuffix("_error")
    return f"error {_SYMBOLS.get(component, component)}"


_SYMBOLS = {"omega": "Ω", "gamma": "γ"}


def _exponent(law: Law) -> str:
    if law.exponent is None:
        return "-"
    return f"{law.exponent:.3f}" + ("" if law.low is None or law.high is None else f" [{law.low:.3f}, {law.high:.3f}]")
