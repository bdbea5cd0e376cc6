"""Texts of audits and of the library of claims for the terminal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from textwrap import fill, wrap

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.features.claims.api import ClaimLibrary
from heavytop.features.claims.audit.judge import ABOUT, VERDICTS, Audit, StatementVerdict
from heavytop.features.claims.audit.values import SIZES
from heavytop.report.document.document import clip

_WIDTH = 80
_HEADS = {"holds": "Proven", "refuted": "Refuted", "undecided": "Undecided"}
_STYLES = {"holds": "green", "refuted": "bold red", "undecided": "yellow"}


def _verdict(holds: bool | None) -> Text:
    return Text(VERDICTS[holds], style=_STYLES[VERDICTS[holds]])


def claims_text(listing: ClaimLibrary) -> RenderableType:
    """The entries by verdict: id, title and source of each."""
    parts: list[RenderableType] = []
    for verdict, head in _HEADS.items():
        of_verdict = [entry for entry in listing.entries if listing.verdicts[entry.id].verdict == verdict]
        if of_verdict:
            parts += [Text(f"{head}: {len(of_verdict)}", style=_STYLES[verdict])]
            for entry in of_verdict:
                source = f"{', '.join(entry.source.authors)} {entry.source.year}"
                parts += [Text(f"  {entry.id}"), *map(Text, _folded(f"{entry.title} ({source})", 4))]
            parts.append(Text())
    return Group(*parts, Text("heavytop audit NAME shows the proof or the witness."))


def _folded(text: str, indent: int) -> list[str]:
    space = " " * indent
    return wrap(text, _WIDTH, initial_indent=space, subsequent_indent=space, break_long_words=False)


def unexpected_text(listing: ClaimLibrary) -> RenderableType:
    """The number of expected verdicts, and each unexpected one."""
    unexpected = [entry for entry in listing.entries if entry.id in (*listing.changed, *listing.undecided)]
    expected = len(listing.entries) - len(unexpected)
    lines = [Text(f"{expected} of {len(listing.entries)} verdicts are as expected.")]
    for entry in unexpected:
        judged = listing.verdicts[entry.id]
        difference = f"{entry.id}: {judged.verdict}, expected: {entry.expects}"
        difference += f"; {judged.reason}" if judged.reason else ""
        lines.append(Text(fill(difference, _WIDTH, subsequent_indent="  "), style=_STYLES[judged.verdict]))
    seconds = sum(judged.seconds for judged in listing.verdicts.values())
    return Group(*lines, Text(f"The audits took {seconds:.0f} s."))


# The audit of published numbers as a table.


_WIDEST_TIME = 16
"""Characters of a time; the lines below the table have the full text."""


def values_text(rows: Sequence[StatementVerdict]) -> list[RenderableType]:
    """A line for each number: the printed text, the number of correct digits, and the error.

    Below the table the proven values, with their radii, and how the motion is known.
    """
    table, reasons = Table(box=None, pad_edge=False), []
    for name in ("number", "at", "verdict", "printed", "digits right", "allowed", "error"):
        table.add_column(name, overflow="fold", no_wrap=name in ("number", "at", "verdict", "digits right"))
    for row in rows:
        figures = row.figures or {}
        right = f"{figures['digits_right']} of {figures['digits_printed']}" if "digits_right" in figures else "?"
        cells = [figures.get("printed", ""), right, figures.get("tolerance", "half a unit")]
        cells.append(row.error or "?")
        reasons += [Text(f"{label(row)} {row.domain}: {row.reason}")] if row.reason else []
        table.add_row(Text(label(row)), Text(clip(row.domain, _WIDEST_TIME)), _verdict(row.holds), *map(Text, cells))
    proven = [row for row in rows if row.figures and "proven" in row.figures]
    lines = [Text("Proven: the true number is within the radius of the value.")] if proven else []
    for row in proven:
        known = (row.figures or {})["proven"]
        lines.append(Text(f"  {label(row)} {row.domain}: {known['value']} +/- {known['radius']}"))
    methods = dict.fromkeys(row.note for row in rows if row.note)
    return [table, Text(), *reasons, *lines, *(Text(f"Reference: {method}.") for method in methods)]


def label(row: StatementVerdict) -> str:
    """The quantity, with its component where it has several."""
    return f"{row.equation} {row.component}" if row.equation in SIZES else row.equation


# The other audits as text and tables.


_PROVEN = {
    "motion": "Its equations of motion are proven for",
    "component": "It is proven for",
    "integral": "It is proven to be constant along the motions of",
    "relation": "It is proven to be invariant under the motions of",
    "stability": "The constant solution is proven for",
}
_SYMBOLS = """\
M = I*Omega (+ k of a rotor), r = (a, b, c): centre of mass; residual: left side
minus right, of (1.1) solved for Omega', with the claimed omega and gamma.
Equations, and alpha and k of the paper: `heavytop docs claim`."""
_RESIDUAL = 20
"""Characters of a line of a residual, for a terminal of 80 columns."""


def audit_text(report: Audit) -> RenderableType:
    """The verdict, a table of the equations, witnesses, conditions and the explanation."""
    head = Text(f"{clip(report.claim, 80)} as {ABOUT[report.kind]} of {report.system}: ")
    head.append(report.verdict, style=_STYLES[report.verdict])
    parts: list[RenderableType] = [head]
    if report.source:
        parts.append(Text(clip(report.source, 2_000)))
    parts += [Text(f"{name} = {value}") for name, value in report.constants if name != value]
    if report.kind == "motion":
        parts.append(Text(_SYMBOLS))
    if report.kind == "value":
        return Group(*parts, Text(), *values_text(report.rows), *_entry(report))
    parts += [Text(), _table(report), *_witnesses(report), *_conditions(report)]
    parts += [Text(f'With assume = [..., "{bound}"] the verdict is: {verdict}.') for bound, verdict in report.deciding]
    if report.unused:
        parts.append(Text(f"No formula uses {', '.join(report.unused)} of [parameters]."))
    if report.why:
        parts += [Text(), Text("Explanation, each step checked by the same algebra:")]
        parts += [Text(f"  [{VERDICTS[step.holds]}] {step.statement}") for step in report.why]
    parts += _entry(report)
    solved = ", ".join(report.solves) or "none of the systems"
    where = f", where {' and '.join(f'{text} = 0' for text in report.where)}" if report.where and report.solves else ""
    parts += [Text(), *map(Text, _folded(f"{_PROVEN[report.kind]}: {solved}{where}", 0))]
    return Group(*parts)


def _entry(report: Audit) -> list[RenderableType]:
    """The lines of an entry of the library: how its source was read, the expected verdict, its note."""
    entry = report.entry
    if entry is None:
        return []
    expected = "as expected" if report.verdict == entry.expects else f"{entry.expects} was expected"
    return [
        Text(),
        Text(f"Read: {clip(entry.read, 600)}. Status: {entry.status}. Verdict: {expected}."),
        Text(clip(entry.note, 4_000)),
    ]


def _table(report: Audit) -> Table:
    """A line for each statement."""
    columns = _columns(report)
    table = Table(box=None, pad_edge=False)
    for name in ("equation", *columns, "verdict", "residual", "statement"):
        table.add_column(name, overflow="fold", no_wrap=name not in ("residual", "statement"))
    for row in report.rows:
        cells = (Text(value) for value in (_label(row), *(getattr(row, name) for name in columns)))
        table.add_row(*cells, _verdict(row.holds), Text(_in_lines(row.residual)), Text(row.statement))
    return table


def _columns(report: Audit) -> list[str]:
    """The columns branch and domain, where the claim has others than the smooth branch and all times."""
    defaults = {"branch": {"smooth"}, "domain": {"all"}}
    return [name for name in defaults if {getattr(row, name) for row in report.rows} != defaults[name]]


def _indented(title: str, lines: Sequence[tuple[str | Text, str]]) -> list[RenderableType]:
    """Labelled texts below a title; nothing without texts."""
    table = Table.grid(padding=(0, 1))
    table.add_column(no_wrap=True)
    for label, text in lines:
        table.add_row(Text("  ").append(label).append(":"), Text(text, overflow="fold"))
    return [Text(f"\n{title}:"), table] if lines else []


def _in_lines(expression: str) -> str:
    """The expression in lines of at most 20 characters, broken after an operator or a space, never inside a name."""
    lines = [""]
    for part in re.findall(r"[\w.]+'*\)*|\W", expression):
        if lines[-1] and len((lines[-1] + part).rstrip()) > _RESIDUAL:
            lines.append("")
        lines[-1] += part if lines[-1] else part.lstrip()
    return "\n".join(line.rstrip() for line in lines)


def _label(row: StatementVerdict) -> str:
    number = row.equation if not row.equation[0].isdigit() else f"({row.equation})"
    return f"{number} {row.component}"


def _witnesses(report: Audit) -> list[RenderableType]:
    """The witnesses of refuted equations: exact parameters, an exact time, and a ball that excludes 0."""
    points = []
    for row in report.rows:
        if row.witness is None:
            continue
        witness = dict(row.witness)
        parameters = witness.pop("parameters")
        ball = f"{witness.pop('value')} +/- {witness.pop('radius')}" if "value" in witness else row.residual
        point = ", ".join(f"{name}={number}" for name, number in {**parameters, **witness}.items())
        label = " ".join([_label(row), *(getattr(row, name) for name in _columns(report))])
        points.append((label, f"{ball} at {point}"))
    notes = sorted({(f"{row.branch} {row.domain}", row.note) for row in report.rows if row.note})
    title = "Witnesses" + ("" if report.kind == "stability" else ", with the residual as a ball that excludes 0")
    return _indented(title, points) + _indented("The domains", notes)


def _conditions(report: Audit) -> list[RenderableType]:
    """The conditions of the proofs: first those that are not discharged, with the rows that they leave undecided."""
    rows: dict[tuple[bool, str, str], list[str]] = {}
    for row in report.rows:
        if row.holds is not False:
            for c in row.conditions:
                rows.setdefault((c.discharged, c.text, c.reason), []).append(_label(row))
    lines = []
    for (discharged, text, reason), labels in sorted(rows.items()):
        word, verdict = ("discharged", "holds") if discharged else ("not discharged", "undecided")
        state = Text(word, style=_STYLES[verdict])
        where = "" if discharged else f" [{', '.join(dict.fromkeys(labels))}]"
        lines.append((state, f"{text} ({reason}){where}"))
    return _indented("Conditions of the proofs (domain: moments of inertia > 0, and `assume`)", lines)
