"""Tasks, and the rows of a report made from what they measure."""

from __future__ import annotations

import gc
import math
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import msgspec

from heavytop import extras
from heavytop.cases import Case
from heavytop.errors import (
    Contradiction,
    HeavyTopError,
    InputError,
    NotAsked,
    OutOfReach,
    OutOfTime,
    PeerFailed,
    Unsupported,
)
from heavytop.exact.resolved import resolve
from heavytop.harness.checkpoint import Saved
from heavytop.harness.sweeps import Sweep
from heavytop.integrate.peers.command import begin_row
from heavytop.integrate.registry import Integrator, IntegratorSource, described, is_third_party, name_of, require_reach
from heavytop.integrate.trajectory import OtherFlags, Outcome, Problem, Trajectory
from heavytop.measure.attitude_error import AttitudeScorer
from heavytop.measure.rounding_noise import factor, scaled
from heavytop.measure.scalar import of_fraction
from heavytop.measure.truth import seconds_a_step as words_seconds
from heavytop.measure.truth import truth
from heavytop.precision import Precision, decimal_text, exact, exact_text, parse, rounded, time_text
from heavytop.records import (
    CONTRADICTION,
    EXACT,
    FAILED,
    FINEST,
    HEYOKA,
    MULTIWORD,
    NOT_ASKED,
    OUT_OF_REACH,
    OUT_OF_TIME,
    UNSUPPORTED,
    Against,
    Data,
    Metric,
    MetricKind,
    Row,
    RowKey,
    Series,
    Subject,
)
from heavytop.top.amplification import amplification
from heavytop.top.heavy_top import HeavyTop, State

# A single measurement of a plan.


@dataclass(frozen=True, slots=True)
class Task:
    """One measurement, and the row it will fill.

    key: of the row.  suffix: follows the case in its name: a direction, a horizon.  subject: what is measured.
    case: None where no motion is measured.
    times: exact, of the sign of the direction; keep: those stored in the series.
    options: further parameters of this kind of measurement.
    request: further parameters, stored in the row, that determine the outcome.
    seed: of the perturbed roundings; 0 for the data unperturbed.
    source: of an integrator that is neither built in nor from a package.
    """

    key: RowKey
    suffix: str
    subject: str
    case: Case | None = None
    times: tuple[Fraction, ...] = ()
    keep: tuple[Fraction, ...] = ()
    options: Any = None
    seed: int = 0
    source: IntegratorSource | None = None
    request: dict[str, str] | msgspec.UnsetType = msgspec.UNSET

    @classmethod
    def of_run(
        cls, kind: str, case: Case, by: Subject, precision: Precision, times: tuple[Fraction, ...], **more: Any
    ) -> Task:
        """The task of a run of that case to the last of ``times``.  more: its other fields."""
        key = RowKey(kind, case.name, case.system.name, by, precision.name, horizon=time_text(times[-1]))
        return cls(**{"key": key, "suffix": "", "subject": by.name, "case": case, "times": times, **more})

    def of(self, case: Case) -> Task:
        """This measurement of another case of the same system."""
        key = msgspec.structs.replace(self.key, case=case.name, system=case.system.name)
        return replace(self, key=key, case=case)

    @property
    def title(self) -> str:
        """The name of the case in the row."""
        return self.key.case + self.suffix

    @property
    def precision(self) -> Precision:
        """The format; raises InputError where none is involved."""
        return parse(self.key.precision)

    @property
    def has_precision(self) -> bool:
        """Whether a format is involved."""
        return self.key.precision != EXACT

    @property
    def integrator(self) -> Integrator:
        """The integrator that computes the motion."""
        step = self.key.subject.step
        control = ("step", exact(step)) if step not in ("", FINEST) else None
        return described(self.source or self.key.subject.name, control)

    @property
    def is_third_party(self) -> bool:
        """Whether third-party code or a third-party program computes the motion."""
        return self.key.subject.what == "computed" and is_third_party(self.key.subject.name)

    @property
    def given(self) -> Case:
        """The case, with the roundings of the seed."""
        assert self.case is not None
        return replace(self.case, top=scaled(self.case.top, factor(self.seed))) if self.seed else self.case

    def require_reach(self) -> None:
        """Raises OutOfReach where the run would take too many steps."""
        subject, case = self.key.subject, self.case
        if subject.what == "computed" and case is not None and self.times:
            problem = Problem.of(case.top, case.start, self.precision, case.system)
            step = exact(subject.step) if subject.step not in ("", FINEST) else None
            require_reach(problem, self.times[-1], step=step)

    @property
    def label(self) -> str:
        """The name of the task in progress displays and messages."""
        plain = self.subject in (HEYOKA, self.key.kind)
        system = self.key.system if self.case is None else ""
        precision = self.key.precision if self.has_precision else ""
        parts = (self.key.kind, self.title, "" if plain else self.subject, system, precision)
        return " ".join(part for part in parts if part)

    @property
    def run_seconds(self) -> float:
        """Estimated seconds of the run by multiword; of any other integrator those of heyoka."""
        step = (words_seconds if self.key.subject.name == MULTIWORD else seconds_a_step)(self.precision.bits)
        return float(abs(self.times[-1])) * 4 * step + len(self.times) * 1e-4


def run_with_attitude(task: Task) -> tuple[Trajectory, AttitudeScorer]:
    """The run of a task with ξ beside Ω and γ, and its scorer; restarted where it was interrupted."""
    case, precision = task.given, task.precision
    times, keep = ([rounded(time, precision) for time in part] for part in (task.times, task.keep))
    xi = resolve(case.body or case.top, case.given_start or case.start).xi
    problem = Problem.of(case.top, case.start, precision, case.system, xi)
    reference = truth(replace(problem, xi=None), times)
    scorer = AttitudeScorer(problem, reference, case.top, case.start, times, keep)
    run = task.integrator.propagate(case.top, case.start, task.times, precision, case.system, scorer, xi=xi)
    return run, scorer


def computed(name: str, **setting: Any) -> Subject:
    """The subject of an integrator with its control parameter."""
    return Subject("computed", name, **setting)


def seconds_a_step(bits: int) -> float:
    """Estimated seconds of one step of heyoka in a format of ``bits`` bits."""
    return 1e-6 if bits <= 53 else 5e-6 if bits <= 64 else 5e-4 * (bits / 113) ** 2.5


def time_metric(time: Fraction | None, kind: MetricKind) -> Metric:
    """A time as a metric; None is never."""
    return Metric("never", None, kind) if time is None else of_fraction(abs(time), kind, time_text(abs(time)))


def data_of(case: Case | None) -> Data | None:
    """The exact data of the measured motion; of an ensemble those of the start from which the others are drawn."""
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
    """The row of an evaluation without integration.  Its samples are the times of the task."""
    return Row(
        case=task.title,
        integrator=task.subject,
        bits=bits,
        outcome=Outcome.SUCCESS.value,
        time_reached=task.key.horizon,
        steps=0,
        finite=all(metric.value != "nan" for metric in metrics.values()),
        metrics=metrics,
        key=task.key,
        reference=reference,
        measured=measured,
        series=series or {},
        samples=len(task.times),
        request=task.request,
    )


def computed_row(
    task: Task, run: Trajectory, metrics: dict[str, Metric], series: dict[str, Series], reference: Against
) -> Row:
    """The row of a run: its outcome, the data and flags that determine its bits, and its metrics.

    A run with fewer samples than its task has times is incomplete, whatever outcome it reports; it is finite only where
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
        integrator=run.integrator,
        bits=precision.bits,
        outcome=outcome.value,
        time_reached=time_text(horizon if done else run.time_reached),
        steps=run.steps,
        finite=done and not any(m.value in ("nan", "missing") for m in metrics.values()),
        metrics=metrics,
        key=task.key,
        reference=reference,
        measured=f"computed: {run.integrator} in {precision.name}",
        order=run.order,
        flags=run.flags,
        input_rounding=decimal_text(input_rounding(case.top, case.start, run.problem), 3),
        series=series,
        samples=len(run.times),
        seconds=run.seconds,
        amplification=_amplification(run.problem, horizon),
        request=task.request,
    )


_OUTCOMES: dict[type[HeavyTopError], str] = {
    Contradiction: CONTRADICTION,
    PeerFailed: FAILED,
    Unsupported: UNSUPPORTED,
    OutOfTime: OUT_OF_TIME,
    NotAsked: NOT_ASKED,
}


def _amplification(problem: Problem, horizon: Fraction) -> float | None:
    """The amplification of a motion, to three digits; None for data beyond double.

    Computed from the data rounded to double: all formats of a case share one value.
    """
    try:
        parameters = problem.parameters.mapped(_in_double)
        start = tuple(map(_in_double, problem.start.flat))
    except OverflowError:
        return None
    factor_of_motion = amplification(problem.system, parameters, start, horizon)
    return float(f"{factor_of_motion:.3g}") if math.isfinite(factor_of_motion) else None


def _in_double(value: Fraction) -> Fraction:
    """The nearest double; the value itself where that is 0.  Raises OverflowError beyond the largest double."""
    return Fraction(float(value)) or Fraction(value)


def unmeasured(task: Task, reason: HeavyTopError) -> Row:
    """The row of an aborted task: its outcome, no metric, and the reason in place of a reference."""
    return Row(
        case=task.title,
        integrator=task.subject,
        bits=task.precision.bits if task.has_precision else 0,
        outcome=_OUTCOMES.get(type(reason), OUT_OF_REACH),
        time_reached="0",
        steps=0,
        finite=False,
        metrics={},
        key=task.key,
        reference=Against("none", reason=reason.cause),
        measured="nothing",
        request=task.request,
    )


def failed(task: Task, cause: str, kind: type[HeavyTopError] = PeerFailed) -> Row:
    """The row of a task whose integrator failed: ``cause``, the case and the control parameter."""
    setting = task.key.subject.setting
    return unmeasured(task, kind(" ".join(part for part in (f"{cause}, in", task.title, setting) if part)))


def input_rounding(top: HeavyTop, start: State, problem: Problem) -> Fraction:
    """The largest relative rounding of the input data: reported, not counted as an error of the run."""
    exact_parameters = problem.system.parameters(top, start)
    rounded = problem.parameters.numbers, problem.start.flat
    pairs = zip((*exact_parameters.mapped(Fraction).numbers, *start.flat), sum(rounded, ()), strict=True)
    return max(abs(b - a) / abs(a) if a else Fraction(0) for a, b in pairs)


# The protocol of a kind of measurement for a run.  The kinds are in :mod:`heavytop.features.kinds`.


Find = Callable[[str], Case]
"""The case of a name; raises InputError for an unknown one."""


class PlanTable(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """A table `[[measure]]` of a plan; unknown keys are errors."""

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row; raises InputError for an impossible value."""
        raise NotImplementedError

    def swept(self, sweep: Sweep, cases: Sequence[Case]) -> Sequence[Case]:
        """The cases of its tasks on a sweep: these, or others that combine many of them."""
        return cases

    def with_integrator(self, which: str | IntegratorSource) -> PlanTable | None:
        """These measurements with that integrator in place of heyoka; None where heyoka is not measured."""
        if getattr(self, "integrator", None) != HEYOKA:
            return None
        return msgspec.structs.replace(self, integrator=name_of(which))


class MeasuredKind(Protocol):
    """One kind of measurement, for running it; the methods below are defaults.

    name: in a plan and in the rows.  table: its table in a plan, tagged with the name; None where no plan requests it.
    concludes: whether further rows follow from all rows of the kind.
    gathers: the files that :meth:`gather` writes, where its rows are combined into those of the report.
    """

    name: str
    table: type[PlanTable] | None = None
    concludes: bool = False
    gathers: tuple[str, ...] = ()

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of ``task``; a run that fails is a row with its outcome.

        saved: the resume point of an earlier, interrupted measurement of this row, and of this one.
        Raises OutOfReach, Contradiction and PeerFailed, which are rows too.
        """
        ...

    def cost(self, task: Task) -> float:
        """Estimated seconds: for the progress bar and for running long tasks first.

        By default those of one run of heyoka, and a second.
        """
        return 1.0 + task.run_seconds

    def conclude(self, rows: Sequence[Row]) -> list[Row]:
        """Further rows from all rows of the kind; called where it :attr:`concludes`."""
        return []

    def gather(self, rows: Callable[[], Iterator[tuple[Task, Row]]], folder: Path) -> list[Row]:
        """The rows of the report from all measured ones; called where it :attr:`gathers`, which go into the folder."""
        return []


Kinds = Mapping[str, MeasuredKind]


# The measurement of one task, in any process, and the start of a worker process.


RESUME = "Finished rows are kept: run again with --resume"


def measure(kind: MeasuredKind, task: Task, saved: Saved) -> Row:
    """The row of ``task``, also where it fails or is aborted; raises InputError with its name for impossible data."""
    begin_row()
    try:
        task.require_reach()
        return msgspec.structs.replace(_resumed(kind, task, saved), data=data_of(task.case))
    except PeerFailed as error:
        return failed(task, error.cause)
    except (Unsupported, OutOfReach, Contradiction) as error:
        return unmeasured(task, error)
    except InputError as error:
        raise InputError(f"{task.label}: {error.cause}", error.remedy) from None


def _resumed(kind: MeasuredKind, task: Task, saved: Saved) -> Row:
    """The row, resumed where that succeeds: else it is measured from the beginning."""
    try:
        return kind.measure(task, saved)
    except (OtherFlags, OutOfReach, Contradiction, PeerFailed, Unsupported):
        raise
    except Exception:
        if not saved.taken:
            raise
    saved.forget()
    return kind.measure(task, saved)


def ended_its_process(task: Task, times: int, how: str = "") -> Row:
    """The failed row of a task whose third-party integrator ended its process, ``how`` the last time."""
    return failed(task, f"{task.key.subject.name} ended its process {times} times{how and ', ' + how}")


def begin_worker(*_kinds: MeasuredKind) -> None:
    """Prepares a new worker process, which leaves interrupts to its parent.

    Unpickling the kinds has imported every module that measures, heyoka without its converters; garbage collection
    skips these objects from now on.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    extras.alone = True
    gc.freeze()


def died(task: Task, times: int) -> HeavyTopError:
    """The error of a task of this program that ended its process each time."""
    return HeavyTopError(
        f"A worker process died {times} times during {task.label}.", f"{RESUME}, perhaps with fewer --workers."
    )
