"""The search for the motion that breaks an integrator, as part of a plan; what was found before is measured first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

from heavytop.errors import InputError, quoted
from heavytop.features.hunt.measured import Family
from heavytop.features.hunt.search import Asked, Hunted, command_of, hunt, keep, kept
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
_MOST = 1_000_000


class HuntTable(PlanTable, tag=NAME):
    """As the options of `heavytop hunt`; budget: motions, as a plan measures the same on every machine.

    found: a file of [[top]] tables, in the working directory: its motions are measured first, and what is found is
    added to it.
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
        """One."""
        (horizon,) = positive([self.horizon], "horizon")
        if not 1 <= self.budget <= _MOST:
            raise InputError(f"budget = {self.budget} is not a number of motions.", f"Give 1 to {_MOST}.")
        if self.limit and exact(self.limit) <= 0:
            raise InputError(f"limit = {quoted(self.limit)} is not above 0.", "Give a positive number.")
        if self.found:
            kept(Path(self.found))
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
        return [Task(key, "", self.integrator, options=self, request=request)]


class HuntKind(Kind):
    """A row is what a search came to; one that found anything failed, and says on which motion."""

    name = NAME
    table = HuntTable
    place = 35

    def cost(self, task: Task) -> float:
        """Some 10 ms a motion."""
        return 5.0 + 0.01 * float(task.options.budget)

    def assumed_band(self, subject: Subject) -> float:
        """The largest of many motions is chance."""
        return 1.0

    def measure(self, task: Task, saved: Saved) -> Row:
        """The search.  Raises PeerFailed for an integrator that cannot be used at all."""
        asked = _asked(task)
        hunted = hunt(asked)
        if hunted.found and task.options.found:
            keep(Path(task.options.found), [m.motion for m in hunted.found])
        if hunted.found:
            return failed(task, _said(hunted))
        lost = f"{hunted.lost} of which no format of its size can follow"
        measured = f"the worst of {hunted.motions} motions, {lost}"
        law = f"{hunted.law:.2g} eps times the motion's amplification times the root of its radians"
        return exact_row(task, measured, Against("equations", law), _metrics(hunted), asked.precision.bits)

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The search that came nearest to a finding; a line a row."""
        if rows:
            yield Headline(f"{_line(max(rows, key=lambda row: exact(row.metrics[WORST.text].value)))}.")
        lines = [Note(_line(row)) for row in rows]
        yield Card("Searches for the motion that breaks an integrator", lines, shown=In.SHORT | In.FULL | In.PAGE)


def _asked(task: Task) -> Asked:
    table: HuntTable = task.options
    return Asked(
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


def _said(hunted: Hunted) -> str:
    """The worst that was found, and the command that shows it."""
    m = hunted.found[0]
    what = f"an error of {m.error:.3g}" if math.isfinite(m.error) else f"the run ends as {m.outcome}"
    name = hunted.asked.integrator.name
    command = command_of(hunted.asked, m.motion, name, math.isinf(m.error))
    return f"{name}, of {hunted.motions} motions: {what}, {command};"


def _metrics(hunted: Hunted) -> dict[str, Metric]:
    eps = float(hunted.asked.precision.eps)
    worst = max((m.error / m.explained(eps) / hunted.law for m in hunted.worst), default=0.0)
    values = {WORST: worst, MEDIAN: hunted.median}
    return by_name({q: of_fraction(Fraction(v), "error") for q, v in values.items() if math.isfinite(v)})


def _line(row: Row) -> str:
    worst = short(row.metrics[WORST.text].value)
    about = f"the worst error is {worst} times what the integrator's law and the motion's amplification explain"
    return f"{row.case} {row.integrator} {row.precision}: nothing found; {about}"
