"""Error of the single steps that begin before the horizon, and the order of the method as it shows beyond them."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.text import Text

from heavytop.errors import OutOfReach
from heavytop.integrate.trajectory import Outcome
from heavytop.kinds.base import Kind
from heavytop.measure import local_error
from heavytop.measure.integrator import HEYOKA, require
from heavytop.precision import parse
from heavytop.records import Against, Row, RowKey
from heavytop.report.text import short, table, title
from heavytop.suite.checkpoint import Saved
from heavytop.suite.kind import Find, Table
from heavytop.suite.rows import computed_row, time_text
from heavytop.suite.sampling import positive
from heavytop.suite.task import Task, computed

NAME = "local_error"
_AGAINST = Against("proven", "known: validated enclosure of each step from where it starts")


class LocalErrorTable(Table, tag=NAME):
    """integrator: one that hands over its single steps, as heyoka does."""

    cases: list[str]
    precisions: list[str]
    horizon: str
    integrator: str = HEYOKA

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        require(self.integrator, with_steps=True)
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

    def beside(self, integrator: str) -> Table | None:
        """Nothing: other integrators do not hand over their single steps."""
        return None


class LocalError(Kind):
    """Errors of steps in units of eps times the largest component of the state."""

    name = NAME
    table = LocalErrorTable
    samples_are_steps = True

    def cost(self, task: Task) -> float:
        """Each step is enclosed."""
        return 1.0 + 0.2 * float(task.times[-1])

    def measure(self, task: Task, saved: Saved) -> Row:
        """Raises OutOfReach where a step is not enclosed, and at an equilibrium, where there are no steps."""
        case, precision = task.given, task.precision
        run, steps = task.integrator.first_steps(case.top, case.start, task.times[-1], precision, case.system)
        if run.outcome is Outcome.SUCCESS and not steps:
            raise OutOfReach(f"{case.name} rests, so its integrator takes no step.", "Measure the steps of a motion.")
        error = local_error.LocalError(run.problem)
        for time, step in zip(run.times, steps, strict=True):
            error(time, step)
        return computed_row(task, run, error.metrics(), {}, _AGAINST)

    def brief(self, rows: Sequence[Row]) -> list[str]:
        """The largest error of a step, a line a motion and format."""
        largest = local_error.LOCAL_ERROR.over("max").text
        return [
            f"{row.case} in {row.precision}: a step is off by {short(row.metrics[largest].value)} eps at most"
            for row in rows
            if largest in row.metrics
        ]

    def summary(self, rows: Sequence[Row]) -> list[RenderableType]:
        """A line a row."""
        quantities = (local_error.LOCAL_ERROR.over("max"), local_error.LOCAL_ERROR.over("rms"), local_error.ORDER)
        lines = [
            [
                row.case,
                row.precision,
                str(row.steps),
                *(short(row.metrics[q.text].value) if q.text in row.metrics else "-" for q in quantities),
                "-" if row.order is None else str(row.order),
                row.outcome,
            ]
            for row in rows
        ]
        return [
            title("Single steps, each against the proven motion from where it starts"),
            Text(
                "  Error in eps of the format times the largest component of the state; the order as the steps show it."
            ),
            table(["case", "format", "steps", "largest", "rms", "order seen", "order asked", "outcome"], lines),
        ]
