"""Error of single steps before the horizon, and the order of the method as it shows in longer ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import msgspec

from heavytop.errors import OutOfReach
from heavytop.features.local_error import measurement as local_error
from heavytop.features.local_error.field_faults import field_fault
from heavytop.features.local_error.measurement import require_sum, single_calls
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive
from heavytop.harness.rows import Find, PlanTable, Task, computed, computed_row
from heavytop.integrate.trajectory import Outcome, TaylorStep
from heavytop.kind import Kind
from heavytop.measure.integrator import HEYOKA
from heavytop.measure.scorer import OBSERVED_ORDER
from heavytop.precision import parse, time_text
from heavytop.records import Against, Beside, Row, RowKey
from heavytop.report.document.document import Block, Cell, Headline, In, Note, Value, clip, computed_by, short
from heavytop.report.document.document import Table as Cells

NAME = "local_error"
_AGAINST = Against("proven", "known: validated enclosure of each step from where it starts")


_LARGEST = local_error.LOCAL_ERROR.over("max").text
_UNITS = "Error in eps of the format times the largest component of the state; the order as the steps show it."


class LocalErrorTable(PlanTable, tag=NAME):
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
                "",
                self.integrator,
                case,
                times,
            )
            for case in map(find, self.cases)
            for precision in self.precisions
        ]


class LocalErrorKind(Kind):
    """Errors of steps in units of eps times the largest component of the state."""

    name = NAME
    table = LocalErrorTable
    samples_are_steps = True
    place = 80

    def cost(self, task: Task) -> float:
        """Each step is enclosed."""
        return 1.0 + 0.2 * float(task.times[-1])

    def measure(self, task: Task, saved: Saved) -> Row:
        """Raises OutOfReach where a step is not enclosed, and at an equilibrium, where there are no steps."""
        case, precision = task.given, task.precision
        given = case.top, case.start, task.times[-1], precision, case.system
        steps: Iterable[tuple[Fraction, TaylorStep | local_error.Call]]
        if task.integrator.capabilities.steps:
            run, taken = task.integrator.first_steps(*given)
            steps = zip(run.times, taken, strict=True)
        else:
            run, steps = single_calls(task.integrator, *given)
        error = local_error.LocalError(run.problem)
        for time, step in steps:
            error(time, step)
        if run.outcome is Outcome.SUCCESS and error.running.count and not task.integrator.capabilities.own:
            require_sum(task.integrator, run, error.largest)
        if run.outcome is Outcome.SUCCESS and not error.running.count:
            raise OutOfReach(f"{case.name} rests, so its integrator takes no step.", "Measure the steps of a motion.")
        row = computed_row(task, run, error.metrics(), {}, _AGAINST)
        row = msgspec.structs.replace(row, samples=error.running.count)
        return row if task.integrator.capabilities.own else _with_fault(row, error)

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The largest error of a step and the order, a sentence a motion and format; of third-party integrators alone
        where there are any; then a line a row.
        """
        told = _told(rows)
        if told:
            yield Headline(_said(max(told, key=lambda row: row.metrics[_LARGEST])))
        yield from (Note(_said(row), shown=In.SHORT) for row in told)
        columns = "case", "format", "steps", "largest", "rms", "order seen", "declared", "outcome"
        title = "Single steps, each against the proven motion from where it starts"
        yield Cells(title, columns, [_cells(row) for row in rows], [_UNITS], shown=In.FULL | In.PAGE)


def _with_fault(row: Row, error: local_error.LocalError) -> Row:
    """The row with the fault of the field that explains its steps, where these show no order, or less than declared."""
    seen = row.metrics.get(OBSERVED_ORDER.text)
    if not error.calls or (seen is not None and row.order and float(seen) >= row.order):
        return row
    found = field_fault(error.problem, error.calls, row.order or 0)
    return msgspec.structs.replace(row, explained=found) if found else row


def _cells(row: Row) -> list[Cell]:
    quantities = (local_error.LOCAL_ERROR.over("max"), local_error.LOCAL_ERROR.over("rms"), OBSERVED_ORDER)
    return [
        clip(row.case + computed_by(row)),
        row.precision,
        str(row.samples if row.key.subject.name != HEYOKA else row.steps),
        *(Value(row.metrics.get(quantity.text)) for quantity in quantities),
        str(row.order) if row.order else "-",
        row.outcome,
    ]


def _told(rows: Sequence[Row]) -> list[Row]:
    """Those that have an error; of third-party integrators alone where there are any."""
    theirs = [row for row in rows if row.key.subject.name != HEYOKA]
    return [row for row in theirs or rows if _LARGEST in row.metrics and row.metrics[_LARGEST].value != "missing"]


def _said(row: Row) -> str:
    """The largest error of a step, and the order beside the one that the integrator declares."""
    what, largest = clip(row.case + computed_by(row)), short(row.metrics[_LARGEST].value)
    text = f"{what} in {row.precision}: a step is off by {largest} eps"
    order = row.metrics.get(OBSERVED_ORDER.text)
    if order is None:
        return f"{text} at most.{_explained(row)}"
    if not row.order:
        return f"{text} at most; its order is {order.value}.{_explained(row)}"
    declared = "as it says" if order.value == str(row.order) else f"not the {row.order} that it says"
    return f"{text} at most; its order is {order.value}, {declared}.{_explained(row)}"


def _explained(row: Row) -> str:
    return f" {row.explained.text}" if row.explained else ""
