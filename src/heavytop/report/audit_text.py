"""An audit in words and tables, for people."""

from __future__ import annotations

import re

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.claims.judge import ABOUT, VERDICTS, Audit, Row
from heavytop.report.values_text import values_text

_PROVEN = {
    "motion": "Its equations of motion are proven for",
    "integral": "It is proven to be constant along the motions of",
    "relation": "It is proven to be kept by the motions of",
}
_RESIDUAL = 20
"""Characters of a line of a residual: what a terminal of 80 columns leaves to it."""
_STYLES = {True: "green", False: "bold red", None: "yellow"}


def audit_text(report: Audit) -> RenderableType:
    """Verdict, a table of the equations, the witnesses of what is refuted, and why."""
    head = Text(f"{report.claim} as {ABOUT[report.kind]} of {report.system}: ")
    head.append(report.verdict, style=_STYLES[{"holds": True, "refuted": False}.get(report.verdict)])
    parts: list[RenderableType] = [head]
    if report.source:
        parts.append(Text(report.source))
    parts += [Text(f"{name} = {value}") for name, value in report.constants if name != value]
    if report.kind == "value":
        return Group(*parts, Text(), *values_text(report.rows), *_entry(report))
    parts += [Text(), _table(report), Text(), *_witnesses(report), *_conditions(report)]
    parts += [Text(f'With assume = [..., "{bound}"] the verdict is: {verdict}.') for bound, verdict in report.deciding]
    if report.why:
        parts += [Text(), Text("Why, each step checked by the same algebra:")]
        parts += [Text(f"  [{VERDICTS[finding.holds]}] {finding.statement}") for finding in report.why]
    parts += _entry(report)
    solved = ", ".join(report.solves) or "none of the systems known here"
    parts += [Text(), Text(f"{_PROVEN[report.kind]}: {solved}")]
    return Group(*parts)


def _entry(report: Audit) -> list[RenderableType]:
    """What an entry of the library says of itself: how its source was read, the verdict expected, its note."""
    entry = report.entry
    if entry is None:
        return []
    expected = "as expected" if report.verdict == entry.expects else f"expected: {entry.expects}"
    return [Text(), Text(f"Read: {entry.read}; {entry.status}; {expected}."), Text(" ".join(entry.note.split()))]


def _table(report: Audit) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("equation", "branch", "domain", "verdict", "residual", "statement"):
        table.add_column(name, overflow="fold", no_wrap=name in ("equation", "branch", "domain", "verdict"))
    for row in report.rows:
        verdict = Text(VERDICTS[row.holds], style=_STYLES[row.holds])
        cells = (Text(value) for value in (_label(row), row.branch, row.domain))
        table.add_row(*cells, verdict, Text(_in_lines(row.residual)), Text(row.statement))
    return table


def _in_lines(expression: str) -> str:
    """The expression in lines of at most 20 characters, broken behind an operator or a space, never inside a name."""
    lines = [""]
    for part in re.findall(r"[\w.]+'*\)*|\W", expression):
        if lines[-1] and len((lines[-1] + part).rstrip()) > _RESIDUAL:
            lines.append("")
        lines[-1] += part if lines[-1] else part.lstrip()
    return "\n".join(line.rstrip() for line in lines)


def _label(row: Row) -> str:
    number = row.equation if not row.equation[0].isdigit() else f"({row.equation})"
    return f"{number} {row.component}"


def _witnesses(report: Audit) -> list[Text]:
    """Where each refuted equation fails: exact parameters, an exact time, and a ball that excludes 0."""
    refuted = [row for row in report.rows if row.witness is not None]
    lines = [Text("Witnesses, with the residual as a ball that excludes 0:")] if refuted else []
    for row in refuted:
        witness = dict(row.witness or {})
        value, radius, parameters = witness.pop("value"), witness.pop("radius"), witness.pop("parameters")
        place = ", ".join(f"{name} = {number}" for name, number in {**parameters, **witness}.items())
        lines.append(Text(f"  {_label(row)} {row.branch} {row.domain}: {value} +/- {radius} at {place}"))
    notes = {f"  {row.branch} {row.domain}: {row.note}" for row in report.rows if row.note}
    if notes:
        lines += [Text("The domains:"), *(Text(note) for note in sorted(notes))]
    return lines


def _conditions(report: Audit) -> list[Text]:
    """What the proofs rest on, each condition once: first what is not discharged, with the rows that it leaves open."""
    rows: dict[tuple[bool, str, str], list[str]] = {}
    for row in report.rows:
        if row.holds is not False:
            for c in row.conditions:
                rows.setdefault((c.discharged, c.text, c.reason), []).append(_label(row))
    lines = [Text("Conditions of the proofs:")] if rows else []
    for (discharged, text, reason), labels in sorted(rows.items()):
        state = Text("discharged" if discharged else "not discharged", style=_STYLES[True if discharged else None])
        where = "" if discharged else f" [{', '.join(dict.fromkeys(labels))}]"
        lines.append(Text("  ").append(state).append(f": {text} ({reason}){where}"))
    return lines
