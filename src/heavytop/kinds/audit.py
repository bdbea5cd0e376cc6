"""Every equation of a claim of the paper, proven or refuted, as a motion of each system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from rich.console import RenderableType
from rich.text import Text

from heavytop.claims.audit import find_claim
from heavytop.claims.judge import judge
from heavytop.kinds.base import Kind
from heavytop.measure.scalar import UNRESOLVED
from heavytop.records import Against, Metric, Quantity, Row, RowKey, Subject, by_name
from heavytop.report.brief import wrapped
from heavytop.report.printable import printable
from heavytop.report.section import Card, Line, clip
from heavytop.report.text import title
from heavytop.suite.checkpoint import Saved
from heavytop.suite.kind import Find, Table
from heavytop.suite.rows import exact_row
from heavytop.suite.task import Task
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, system

NAME = "audit"
_SMOOTH = "smooth"
_SYSTEMS = {HEAVY_TOP.name: "the heavy top", GYROSTAT.name: "the gyrostat"}
_SECONDS = 1.5


class AuditTable(Table, tag=NAME):
    """The claims, and the systems whose motions they are said to be."""

    claims: list[Literal["ershkov-general", "ershkov-partial"]]
    systems: list[Literal["heavy_top", "gyrostat"]]

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        keys = [RowKey(NAME, c, system, Subject("claimed", c)) for c in self.claims for system in self.systems]
        return [Task(key, key.case, NAME) for key in keys]


class Audit(Kind):
    """1 for an equation that holds, 0 for one that is refuted, unresolved for one that is neither."""

    name = NAME
    table = AuditTable

    def cost(self, task: Task) -> float:
        """The same for all."""
        return _SECONDS

    def measure(self, task: Task, saved: Saved) -> Row:
        """Of the branches of a claim about the gyrostat the smooth one alone, which the formulas solve."""
        claim, about = find_claim(task.key.case), system(task.key.system)
        asked = [each for each in claim.statements(about) if about is HEAVY_TOP or each.branch == _SMOOTH]
        metrics = {
            Quantity(f"({row.equation})", str(row.component), "", row.branch, row.domain): _value(row.holds)
            for row in judge(asked, claim.setting)
        }
        against = Against("equations", f"the equations of {task.key.system}")
        return exact_row(task, f"claimed: {claim.source}", against, by_name(metrics))

    def summary(self, rows: Sequence[Row]) -> list[RenderableType]:
        """A line for each claim and system."""
        parts: list[RenderableType] = [title("Verdict on the paper's solution, equation by equation (heavytop audit)")]
        for row in rows:
            verdict, refuted, held = _verdict(row)
            smooth = " on the smooth branch" if row.system == GYROSTAT.name else ""
            line = Text(printable(f"  {row.case} as a motion of {row.system}: "))
            line.append(verdict, style={"refuted": "bold red", "holds": "bold green"}.get(verdict, "bold yellow"))
            line.append(f"{smooth} ({held} of {len(row.metrics)} equations proven, {len(refuted)} refuted")
            smooth_ones = sorted({f"{q.name}.{q.component}" for q in refuted if q.branch == _SMOOTH})
            line.append(f"; refuted on the smooth branch: {', '.join(smooth_ones)})" if smooth_ones else ")")
            parts.append(line)
        return parts

    def brief(self, rows: Sequence[Row]) -> list[str]:
        """The verdict on each claim for each system."""
        found: dict[tuple[str, str], list[str]] = {}
        for row in rows:
            found.setdefault((_verdict(row)[0], row.system), []).append(row.case)
        said = (
            f"{', '.join(claims)}: {verdict} for {_SYSTEMS.get(system, system)}."
            for (verdict, system), claims in found.items()
        )
        return [line for sentence in said for line in wrapped(f"Ershkov's claims {sentence}")]

    def headline(self, rows: Sequence[Row]) -> tuple[str, str] | None:
        """Whether the claims are motions of the heavy top."""
        verdicts = {_verdict(row)[0] for row in rows if row.system == HEAVY_TOP.name}
        if not verdicts:
            return None
        others = [row.system for row in rows if row.system != HEAVY_TOP.name and _verdict(row)[0] == "holds"]
        solved = " and ".join(_SYSTEMS.get(name, name) for name in dict.fromkeys(others))
        instead = f" It solves {solved} instead." if others else ""
        if verdicts == {"refuted"}:
            return "refuted", f"The claimed solution is not a motion of the heavy top.{instead}"
        if "refuted" in verdicts:
            return "refuted", f"Some of the claimed solutions are not motions of the heavy top.{instead}"
        if verdicts == {"holds"}:
            return "holds", "Every equation of the claim is proven for the heavy top."
        return "undecided", "No equation of the claim is refuted, but not all are proven."

    def cards(self, rows: Sequence[Row]) -> list[Card]:
        """The equations that are proven and refuted, of each claim and system."""
        lines = []
        for claim in sorted({row.case for row in rows}):
            lines.append(Line(clip(claim), "soft"))
            for row in rows:
                if row.case == claim:
                    verdict, refuted, held = _verdict(row)
                    smooth = [q for q in refuted if q.branch == _SMOOTH] or refuted
                    text = f"for {clip(_SYSTEMS.get(row.system, row.system), 40)}: "
                    text += f"{held} of {len(row.metrics)} equations proven"
                    if smooth:
                        text += ", refuted " + clip(", ".join(dict.fromkeys(q.name for q in smooth)), 120)
                    lines.append(Line(text, "", verdict))
        return [Card("Equation by equation", lines)] if lines else []


def _value(holds: bool | None) -> Metric:
    return (
        Metric(UNRESOLVED, None, "value") if holds is None else Metric(str(int(holds)), 0.0 if holds else None, "value")
    )


def _verdict(row: Row) -> tuple[str, list[Quantity], int]:
    """The verdict, the equations that are refuted, and how many are proven."""
    refuted = [metric.quantity or Quantity("?") for metric in row.metrics.values() if metric.value == "0"]
    held = sum(metric.value == "1" for metric in row.metrics.values())
    undecided = len(row.metrics) - held - len(refuted)
    return ("refuted" if refuted else "undecided" if undecided or not held else "holds"), refuted, held
