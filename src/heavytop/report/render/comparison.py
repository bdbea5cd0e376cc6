"""A comparison as sentences and a table on a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.display import printable
from heavytop.report.compare.compare import Differences
from heavytop.report.compare.findings import line
from heavytop.report.compare.rows import Finding
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.document import clip, row_name, short
from heavytop.report.document.motions import WorseMotions
from heavytop.report.render.text import Lines, wrapped

_MOST = 200
"""Most rows, and most metrics, listed."""
_STYLE = {Verdict.WORSE: "red", Verdict.BETTER: "green", Verdict.MISSING: "yellow", Verdict.INCOMPARABLE: "yellow"}


def comparison(result: Differences, full: bool = False, for_full: str = "--full") -> RenderableType:
    """Verdict and findings, a line for each changed row, the worst first, and differences of inputs and environments.

    full: every changed metric in place of a line per row.  for_full: the option or command that shows these.
    """
    parts: list[RenderableType] = [Text(headline(result), style="bold")]
    parts += [Text(printable(line)) for sentence in result.sentences for line in wrapped(f"- {sentence}")]
    if result.rows:
        parts += [Text(), *(_metrics(result) if full else _rows(result, for_full))]
    for motions in result.motions:
        parts += _motions(motions)
    if result.environment:
        parts += [Text(), Text("Inputs or environments differ:", style="bold")]
        changes = (printable(f"{name}: {clip(old, 24)} -> {clip(new, 24)}") for name, old, new in result.environment)
        parts += [Text(line) for change in changes for line in wrapped(change, "    ", "  ")]
    return Group(*parts)


def _rows(result: Differences, for_full: str) -> Iterator[RenderableType]:
    """A line for each row, the worst first; wrapped between words only."""
    for change in result.rows[:_MOST]:
        verdict = change.verdict.value
        lines = wrapped(printable(f"{verdict:12}  {row_name(change.identity)}: {line(change)}"), " " * 14)
        for number, entry in enumerate(lines):
            shown = Text(entry)
            shown.stylize(_STYLE.get(change.verdict, ""), 0, 0 if number else len(verdict))
            yield shown
    if len(result.rows) > _MOST:
        yield Text(f"and {len(result.rows) - _MOST} more: --json lists all, --html FILE draws them")
    lines = wrapped(printable(f"Every metric that changed: {for_full}"), "    ", "", 78)
    yield Text(" \\\n".join(lines), style="dim")


def _motions(motions: WorseMotions) -> Iterator[RenderableType]:
    """The motions of a row with the largest losses, each with a command to paste into a shell."""
    if not motions.first:
        return
    yield Text()
    yield Text(
        printable(f"Motions of {row_name(motions.row)} that got worse: {motions.worse} of {motions.joined}"),
        style="bold",
    )
    for motion in motions.first:
        yield Text(f"  {motion.text}")
        yield Text(" \\\n".join(wrapped(printable(motion.command), "      ", "    ", 78)), style="dim")
    if motions.worse > len(motions.first):
        yield Text(f"  and {motions.worse - len(motions.first)} more")


def _metrics(result: Differences) -> Iterator[RenderableType]:
    columns = ("verdict", "row", "metric", "baseline", "candidate", "why")
    yield Lines(columns, list(map(_cells, result.changed[:_MOST])), words=6)
    if len(result.changed) > _MOST:
        yield Text(f" and {len(result.changed) - _MOST} more: --json lists all, --html FILE draws them")


def _cells(finding: Finding) -> list[str | Text]:
    verdict = Text(finding.verdict.value, style=_STYLE.get(finding.verdict, ""))
    return [verdict, row_name(finding.row), metric_name(finding), *values(finding), finding.reason]


def headline(result: Differences) -> str:
    """The verdict, and the number of findings of each kind."""
    tally = ", ".join(f"{count} {verdict.value}" for verdict, count in result.tally.items())
    return f"Verdict: {result.verdict} ({tally})"


def metric_name(finding: Finding) -> str:
    """The metric of a finding, or "whole row"."""
    return finding.metric or "whole row"


def values(finding: Finding) -> tuple[str, str]:
    """The two values with few digits; a dash where absent."""
    return short(finding.baseline or "-"), short(finding.candidate or "-")
