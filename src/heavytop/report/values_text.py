"""The audit of published numbers as a table, for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.claims.judge import VERDICTS, Row
from heavytop.claims.values import SIZES

_STYLES = {True: "green", False: "bold red", None: "yellow"}


def values_text(rows: Sequence[Row]) -> list[RenderableType]:
    """A line for each number: what is printed, how many of its digits are right, and by how much it is off.

    Below it the proven values, with the radius of each, and how the motion is known.
    """
    table = Table(box=None, pad_edge=False)
    for name in ("number", "at", "verdict", "printed", "digits right", "allowed", "off by"):
        table.add_column(name, overflow="fold", no_wrap=name in ("number", "at", "verdict", "digits right"))
    for row in rows:
        figures = row.figures or {}
        right = f"{figures['digits_right']} of {figures['digits_printed']}" if "digits_right" in figures else "?"
        cells = [label(row), row.domain, "", figures.get("printed", ""), right]
        cells += [figures.get("tolerance", "half a unit"), row.residual.removeprefix("off by ")]
        line: list[RenderableType] = [Text(cell) for cell in cells]
        line[2] = Text(VERDICTS[row.holds], style=_STYLES[row.holds])
        table.add_row(*line)
    proven = [row for row in rows if row.figures and "proven" in row.figures]
    lines = [Text("Proven: the true number is within the radius of the value.")] if proven else []
    for row in proven:
        known = (row.figures or {})["proven"]
        lines.append(Text(f"  {label(row)} {row.domain}: {known['value']} +/- {known['radius']}"))
    methods = dict.fromkeys(row.note for row in rows if row.note)
    return [table, Text(), *lines, *(Text(f"Known from {method}.") for method in methods)]


def label(row: Row) -> str:
    """The quantity, with its component where it has more than one."""
    return f"{row.equation} {row.component}" if row.equation in SIZES else row.equation
