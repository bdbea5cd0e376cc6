"""A comparison in words and a table, for people on a terminal."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.report.compare import Comparison, Finding
from heavytop.report.names import row_name
from heavytop.report.printable import printable
from heavytop.report.text import short, table
from heavytop.report.verdicts import Verdict

_MOST = 200
"""Findings of the table: more scroll away."""
_STYLE = {Verdict.WORSE: "red", Verdict.BETTER: "green", Verdict.MISSING: "yellow", Verdict.INCOMPARABLE: "yellow"}


def comparison(result: Comparison) -> RenderableType:
    """Verdict first, then what changed, then the differences of the plans and environments."""
    parts: list[RenderableType] = [Text(headline(result), style="bold")]
    if result.tally.keys() <= {Verdict.MISSING, Verdict.NEW}:
        parts.append(Text("The two have no row in common. Were they made with the same plan?"))
    if result.changed:
        columns = ("verdict", "row", "metric", "baseline", "candidate", "why")
        parts.append(table(columns, map(_cells, result.changed[:_MOST]), words=6))
        if len(result.changed) > _MOST:
            parts.append(Text(f" and {len(result.changed) - _MOST} more: --json lists all, --html FILE draws them"))
    if result.environment:
        parts.append(Text("Environments differ:", style="bold"))
        parts += [Text(printable(f"  {name}: {old} -> {new}")) for name, old, new in result.environment]
    return Group(*parts)


def _cells(finding: Finding) -> list[str | Text]:
    verdict = Text(finding.verdict.value, style=_STYLE.get(finding.verdict, ""))
    return [verdict, row_name(finding.row), metric_name(finding), *values(finding), finding.reason]


def headline(result: Comparison) -> str:
    """The verdict and how many findings of each."""
    tally = ", ".join(f"{count} {verdict.value}" for verdict, count in result.tally.items())
    return f"Verdict: {result.verdict} ({tally})"


def metric_name(finding: Finding) -> str:
    """The metric of a finding, or that it is about the row as a whole."""
    return finding.metric or "whole row"


def values(finding: Finding) -> tuple[str, str]:
    """The two values with few digits; a dash where there is none."""
    return short(finding.baseline or "-"), short(finding.candidate or "-")
