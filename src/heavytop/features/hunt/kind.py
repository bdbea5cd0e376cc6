"""The search for the motion that breaks an integrator, as part of a plan; earlier findings are measured first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

from heavytop.display import plural
from heavytop.features.hunt.measured import Family
from heavytop.features.hunt.search import Hunted, HuntRequest, command_of, hunt, keep, kept
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive
from heavytop.harness.rows import Find, PlanTable, Task, computed, exact_row, failed
from heavytop.integrate.registry import described
from heavytop.kind import Kind
from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact, exact_text, parse, physical, time_text
from heavytop.records import HEYOKA, Against, Beside, Metric, Quantity, Row, RowKey, Subject, by_name
from heavytop.report.document.document import Block, Card, Headline, In, Note, short
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP

NAME = "hunt"
WORST = Quantity("hunt_error", "relative_to_law", "max")
MEDIAN = Quantity("hunt_error", "random_tops", "median")


class HuntTable(PlanTable, tag=NAME):
    """The options of `heavytop hunt`; budget: a number of motions, so that every machine measures the same.

    found: a file of [[top]] tables, in the working directory: its motions are measured first, and findings are added.
    """

    integrator: str = HEYOKA
    precision: str = "double"
    horizon: str = "100"
    budget: int = 1000
    family: Family = "any"
    against: str = ""
    limit: str = ""
    seed: int = 1
    found: str = ""

    def tasks(self, find: Find) -> list[Task]:
        """One task."""
        (horizon,) = positive([self.horizon], "horizon")
        name = f"{self.family}-{self.seed}"
        system = HEAVY_GYROSTAT.name if self.family == HEAVY_GYROSTAT.name else HEAVY_TOP.name
        key = RowKey(NAME, name, system, computed(self.integrator), parse(self.precision).name)
        request = {
            "horizon": time_text(horizon),
            "budget": str(self.budget),
            "against": self.against,
            "limit": exact_text(exact(self.limit)) if self.limit else "",
            "found": self.found,
        }
        task = Task(key, "", self.integrator, options=self, request=request)
        _request(task)  # raises for impossible settings
        return [task]


class HuntKind(Kind):
    """One search per row; a search with a finding is a failed row that names its motion."""

    name = NAME
    table = HuntTable
    place = 35
    needed = (WORST.text,)

    def cost(self, task: Task) -> float:
        """About 10 ms per motion."""
        return 5.0 + 0.01 * float(task.options.budget)

    def assumed_band(self, subject: Subject) -> float:
        """A decade: the largest error of many motions is random."""
        return 1.0

    def measure(self, task: Task, saved: Saved) -> Row:
        """The search.  Raises PeerFailed for an integrator that cannot be used at all."""
        request = _request(task)
        hunted = hunt(request)
        if hunted.found and task.options.found:
            keep(Path(task.options.found), [m.motion for m in hunted.found])
        if hunted.found:
            return failed(task, _cause(hunted))
        lost = f"{hunted.lost} of which no format of its size can follow"
        measured = f"the worst of {plural(hunted.motions, 'motion')}, {lost}"
        return exact_row(
            task, measured, Against("equations", hunted.law_text), _metrics(hunted), request.precision.bits
        )

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The search that came nearest to a finding; a line for each row."""
        if rows:
            yield Headline(f"{_line(max(rows, key=lambda row: exact(row.metrics[WORST.text].value)))}.")
        lines = [Note(_line(row)) for row in rows]
        yield Card("Searches for the motion that breaks an integrator", lines, shown=In.SHORT | In.FULL | In.PAGE)


def _request(task: Task) -> HuntRequest:
    table: HuntTable = task.options
    return HuntRequest(
        task.integrator,
        task.precision,
        physical(table.horizon, "horizon"),
        table.family,
        described(table.against) if table.against else None,
        float(physical(table.limit, "limit")) if table.limit else None,
        table.budget,
        seed=table.seed + task.seed,
        first=kept(Path(table.found)) if table.found else (),
    )


def _cause(hunted: Hunted) -> str:
    """The worst finding, and the command that shows it again."""
    m = hunted.found[0]
    error = f"an error of {m.error:.3g}" if math.isfinite(m.error) else f"the run ends as {m.outcome}"
    name = hunted.request.integrator.name
    command = command_of(hunted.request, m.motion, name, math.isinf(m.error))
    return f"{name}, of {plural(hunted.motions, 'motion')}: {error}, {command};"


def _metrics(hunted: Hunted) -> dict[str, Metric]:
    eps = float(hunted.request.precision.eps)
    worst = max((m.error / m.explained(eps) / hunted.law for m in hunted.worst), default=0.0)
    values = {WORST: worst, MEDIAN: hunted.median}
    return by_name({q: of_fraction(Fraction(v), "error") for q, v in values.items() if math.isfinite(v)})


def _line(row: Row) -> str:
    worst = short(row.metrics[WORST.text].value)
    ratio = f"the worst error is {worst} times what the integrator's law and the motion's amplification explain"
    return f"{row.case} {row.integrator} {row.precision}: nothing found; {ratio}"
