"""Error of single steps before the horizon, and the order of the method as it shows in longer ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import msgspec
from rich.console import RenderableType
from rich.text import Text

from heavytop.errors import OutOfReach
from heavytop.integrate.trajectory import Outcome, TaylorStep
from heavytop.kinds.base import Kind
from heavytop.measure import local_error
from heavytop.measure.integrator import HEYOKA
from heavytop.measure.single_calls import require_sum, single_calls
from heavytop.precision import parse, time_text
from heavytop.records import Against, Row, RowKey
from heavytop.report.brief import wrapped
from heavytop.report.names import computed_by, with_source
from heavytop.report.section import Section, Sources, clip
from heavytop.report.text import short, table, title
from heavytop.suite.checkpoint import Saved
from heavytop.suite.kind import Find, Table
from heavytop.suite.rows import computed_row
from heavytop.suite.sampling import positive
from heavytop.suite.task import Task, computed

NAME = "local_error"
_AGAINST = Against("proven", "known: validated enclosure of each step from where it starts")


_LARGEST = local_error.LOCAL_ERROR.over("max").text


class LocalErrorTable(Table, tag=NAME):
    """integrator: any that `heavytop list` shows; its steps, or calls over its mean step where it keeps them."""

    cases: list[str]
    precisions: list[str]
    horizon: str
    integrator: str = HEYOKA

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        times = tuple(positive([self.horizon], "horizon"))
        horizon, subject = time_text(times[-1]), computed(self.integrator)
        return [
            Task(
                RowKey(NAME, case.name, case.system.name, subject, parse(precision).name, horizon=horizon),
                case.name,
                self.integrator,
                case,
                times,
            )
            for case in map(find, self.cases)
            for precision in self.precisions
        ]


_TITLE = "Single steps, each against the proven motion from where it starts"
_UNITS = "Error in eps of the format times the largest component of the state; the order as the steps show it."
_COLUMNS = ["case", "format", "steps", "largest", "rms", "order seen", "declared", "outcome"]


def _lines(rows: Sequence[Row]) -> list[list[str]]:
    quantities = (local_error.LOCAL_ERROR.over("max"), local_error.LOCAL_ERROR.over("rms"), local_error.ORDER)
    return [
        [
            clip(row.case + computed_by(row)),
            row.precision,
            str(row.samples if row.key.subject.name != HEYOKA else row.steps),
            *(short(row.metrics[q.text].value) if q.text in row.metrics else "-" for q in quantities),
            str(row.order) if row.order else "-",
            row.outcome,
        ]
        for row in rows
    ]


def single_steps(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """The errors of the steps, a line a row."""
    lines = [
        [with_source(clip(case), source), *map(clip, cells)]
        for source, report in sources
        for case, *cells in _lines(report.rows)
    ]
    return Section("steps", "Single steps", [_UNITS], columns=_COLUMNS, rows=lines, place=60) if lines else None


class LocalError(Kind):
    """Errors of steps in units of eps times the largest component of the state."""

    name = NAME
    table = LocalErrorTable
    samples_are_steps = True
    sections = (single_steps,)
    place = 80

    def cost(self, task: Task) -> float:
        """Each step is enclosed."""
        return 1.0 + 0.2 * float(task.times[-1])

    def measure(self, task: Task, saved: Saved) -> Row:
        """Raises OutOfReach where a step is not enclosed, and at an equilibrium, where there are no steps."""
        case, precision = task.given, task.precision
        given = case.top, case.start, task.times[-1], precision, case.system
        steps: Iterable[tuple[Fraction, TaylorStep | local_error.Call]]
        if task.integrator.can.steps:
            run, taken = task.integrator.first_steps(*given)
            steps = zip(run.times, taken, strict=True)
        else:
            run, steps = single_calls(task.integrator, *given)
        error = local_error.LocalError(run.problem)
        for time, step in steps:
            error(time, step)
        if run.outcome is Outcome.SUCCESS and error.running.count and not task.integrator.can.own:
            require_sum(task.integrator, run, error.largest)
        if run.outcome is Outcome.SUCCESS and not error.running.count:
            raise OutOfReach(f"{case.name} rests, so its integrator takes no step.", "Measure the steps of a motion.")
        row = computed_row(task, run, error.metrics(), {}, _AGAINST)
        return msgspec.structs.replace(row, samples=error.running.count)

    def brief(self, rows: Sequence[Row]) -> list[str]:
        """The largest error of a step and the order, a sentence a motion and format; of integrators of others alone
        where there are any.
        """
        return [line for row in _told(rows) for line in wrapped(_said(row))]

    def headline(self, rows: Sequence[Row]) -> tuple[str, str] | None:
        """The largest error of a step; of integrators of others where there are any."""
        found = _told(rows)
        return ("", _said(max(found, key=lambda row: row.metrics[_LARGEST]))) if found else None

    def summary(self, rows: Sequence[Row]) -> list[RenderableType]:
        """A line a row."""
        return [title(_TITLE), Text(f"  {_UNITS}"), table(_COLUMNS, _lines(rows))]


def _told(rows: Sequence[Row]) -> list[Row]:
    """Those that have an error; of integrators of others alone where there are any."""
    theirs = [row for row in rows if row.key.subject.name != HEYOKA]
    return [row for row in theirs or rows if _LARGEST in row.metrics and row.metrics[_LARGEST].value != "missing"]


def _said(row: Row) -> str:
    """The largest error of a step, and the order beside the one that the integrator declares."""
    what, largest = clip(row.case + computed_by(row)), short(row.metrics[_LARGEST].value)
    text = f"{what} in {row.precision}: a step is off by {largest} eps"
    order = row.metrics.get(local_error.ORDER.text)
    if order is None:
        return f"{text} at most."
    if not row.order:
        return f"{text} at most; its order is {order.value}."
    declared = "as it says" if order.value == str(row.order) else f"not the {row.order} that it says"
    return f"{text} at most; its order is {order.value}, {declared}."
