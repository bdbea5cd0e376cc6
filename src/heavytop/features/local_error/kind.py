"""Error of single steps before the horizon, and the order of the method as it shows in longer ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import inf

import msgspec

from heavytop.errors import OutOfReach, Unsupported
from heavytop.features.local_error import measurement as local_error
from heavytop.features.local_error.field_faults import field_fault
from heavytop.features.local_error.measurement import (
    error_at_end,
    order_of_runs,
    single_calls,
    stepped,
    unexplained,
)
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive
from heavytop.harness.rows import Find, PlanTable, Task, computed, computed_row
from heavytop.integrate.registry import Integrator, is_third_party, load
from heavytop.integrate.trajectory import Outcome, TaylorStep, Trajectory
from heavytop.kind import Kind
from heavytop.measure.scalar import of_fraction
from heavytop.measure.scorer import OBSERVED_ORDER, ORDER_OF_RUNS
from heavytop.precision import decimal_text, exact, parse
from heavytop.records import HEYOKA, Against, Beside, Explained, Metric, Quantity, Row, by_name
from heavytop.report.document.document import Block, Cell, Headline, In, Note, Value, clip, computed_by, short
from heavytop.report.document.document import Table as Cells

NAME = "local_error"
_AGAINST = Against("proven", "known: validated enclosure of each step from where it starts")


ERROR = Quantity("error", statistic="final")
"""Error at the end of a run of a method with a memory, largest component."""
_LARGEST = local_error.LOCAL_ERROR.over("max").text
_NOTES = (
    "Each compared with the proven motion from where it starts.",
    "Error in eps of the format times the largest component of the state; the order as the steps show it.",
)


class LocalErrorTable(PlanTable, tag=NAME):
    """integrator: any that `heavytop list` shows; its steps, or calls over its mean step where it keeps them."""

    cases: list[str]
    precisions: list[str]
    horizon: str
    integrator: str = HEYOKA

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        times = tuple(positive([self.horizon], "horizon"))
        return [
            Task.of_run(NAME, case, computed(self.integrator), parse(precision), times)
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
        parameters = case.top, case.start, task.times[-1], precision
        if not task.integrator.one_step:
            return _of_runs(task, stepped(task.integrator))
        steps: Iterable[tuple[Fraction, TaylorStep | local_error.Call]]
        if task.integrator.steps:
            run, taken = load(task.integrator.steps)(*parameters, system=case.system)
            steps = zip(run.times, taken, strict=True)
        else:
            run, steps = single_calls(task.integrator, *parameters, case.system)
        error = local_error.LocalError(run.problem)
        for time, step in steps:
            error(time, step)
        if run.outcome is Outcome.SUCCESS and not error.running.count:
            raise OutOfReach(f"{case.name} is an equilibrium, which takes no steps.", "Measure a motion.")
        row = computed_row(task, run, error.metrics(), {}, _AGAINST)
        row = msgspec.structs.replace(row, samples=error.running.count)
        if task.integrator.own:
            return row
        if run.outcome is Outcome.SUCCESS:
            row = msgspec.structs.replace(row, metrics=row.metrics | _order_of_runs(task, run))
        row = _with_fault(row, error)
        if row.explained or run.outcome is not Outcome.SUCCESS:
            return row
        text = unexplained(run, exact(step.length), error.largest, row.amplification or 1.0)
        return msgspec.structs.replace(row, explained=Explained("steps", text)) if text else row

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The largest error of a step and the order, a sentence a motion and format; of third-party integrators alone
        where there are any; then a line a row.
        """
        shown = _told(rows)
        if shown:
            yield Headline(_said(max(shown, key=lambda row: (_is_below_order(row), _size(row)))))
        yield from (Note(_said(row), shown=In.SHORT) for row in shown)
        columns = "case", "format", "steps", "largest", "rms", "order observed", "of runs", "declared", "outcome"
        yield Cells("Single steps", columns, [_cells(row) for row in rows], _NOTES, shown=In.FULL | In.PAGE)


def _of_runs(task: Task, integrator: Integrator) -> Row:
    """The row of a method with a memory: the error at the end, and the order that whole runs show."""
    if integrator.set_to is None:
        raise Unsupported(
            f"{integrator.name} is a multistep method with a tolerance: it has neither an order nor single steps.",
            "Measure whole runs: work_precision.",
        )
    case = task.given
    run = integrator.propagate(case.top, case.start, task.times, task.precision, case.system)
    metrics = {}
    if run.outcome is Outcome.SUCCESS:
        metrics = by_name({ERROR: of_fraction(error_at_end(run))}) | _order_of_runs(task, run)
    return computed_row(task, run, metrics, {}, _AGAINST)


def _order_of_runs(task: Task, run: Trajectory) -> dict[str, Metric]:
    """The order that whole runs show, of a method with fixed steps; none where they do not agree on one."""
    integrator = stepped(task.integrator)
    order = None if integrator.set_to is None else order_of_runs(integrator, run)
    return {} if order is None else by_name({ORDER_OF_RUNS: of_fraction(Fraction(max(round(order), 0)), "value")})


def _with_fault(row: Row, error: local_error.LocalError) -> Row:
    """The row with the fault of the field that explains its steps, where these show no order, or less than declared."""
    seen = row.metrics.get(ORDER_OF_RUNS.text) or row.metrics.get(OBSERVED_ORDER.text)
    if not error.calls or (seen is not None and row.order and float(seen) >= row.order):
        return row
    fault = field_fault(error.problem, error.calls, row.order or 0)
    return msgspec.structs.replace(row, explained=fault) if fault else row


def _cells(row: Row) -> list[Cell]:
    quantities = local_error.LOCAL_ERROR.over("max"), local_error.LOCAL_ERROR.over("rms"), OBSERVED_ORDER, ORDER_OF_RUNS
    return [
        clip(row.case + computed_by(row)),
        row.precision,
        str(row.samples if row.key.subject.name != HEYOKA else row.steps),
        *(Value(row.metrics.get(quantity.text)) for quantity in quantities),
        str(row.order) if row.order else "-",
        row.outcome,
    ]


def _told(rows: Sequence[Row]) -> list[Row]:
    """The rows with an error; those of third-party integrators alone where there are any."""
    theirs = [row for row in rows if row.key.subject.name != HEYOKA]
    return [row for row in theirs or rows if any(_number(row, metric) for metric in (_LARGEST, ERROR.text))]


def _is_below_order(row: Row) -> bool:
    """Whether whole runs show a lower order than the declared one."""
    order = row.metrics.get(ORDER_OF_RUNS.text)
    return bool(order and row.order and float(order) < row.order)


def _size(row: Row) -> float:
    """log10 of the largest error of a step."""
    metric = row.metrics.get(_LARGEST)
    return -inf if metric is None or metric.log10 is None else metric.log10


def _number(row: Row, name: str) -> str:
    """The metric in short; "" where absent."""
    metric = row.metrics.get(name)
    return "" if metric is None or metric.value == "missing" else short(metric.value)


def _said(row: Row) -> str:
    """The largest error of a step, or of a run of what keeps a memory, and the order beside the declared one."""
    text, largest = f"{clip(row.case + computed_by(row))} in {row.precision}", _number(row, _LARGEST)
    if largest:
        metric = row.metrics[_LARGEST]
        if metric.log10 is not None:
            largest = short(decimal_text(exact(metric.value) * Fraction(2) ** (1 - row.bits), 2), 2)
        text = f"{text}: one step errs by at most {largest}"
    else:
        text = f"{text}: the error of its run is {_number(row, ERROR.text)} at t = {row.key.horizon}"
    order = _order(row)
    return f"{text}{'; ' if order else ''}{order}.{' ' + row.explained.text if row.explained else ''}"


def _order(row: Row) -> str:
    """The order that the method shows beside the one that it declares; "" for none.

    Of a third-party integrator it is that of whole runs: one of single steps may be that of a starting method.
    """
    single, runs = (_number(row, name.text) for name in (OBSERVED_ORDER, ORDER_OF_RUNS))
    order, known = runs or single, bool(runs) or not is_third_party(row.key.subject.name)
    if not order:
        return ""
    steps = " in whole runs" if runs else "" if known else " in single steps"
    text = f"order {order}{steps}"
    if order == str(row.order):
        text = f"order {order} confirmed{steps}"
    elif row.order and known:
        text += f", {'not' if int(order) < row.order else 'more than'} the declared {row.order}"
    hint = f" ({single} in single steps: a multistep method should declare one_step = false)"
    return text + (hint if runs not in ("", "0") and single not in ("", "0", runs) else "")
