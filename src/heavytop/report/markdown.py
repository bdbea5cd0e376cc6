"""A comparison for a pull request: GitHub-flavoured Markdown, short."""

from __future__ import annotations

import re
from pathlib import Path

from heavytop.report.compare import Comparison
from heavytop.report.comparison_text import headline, values
from heavytop.report.findings import folded, line, statistics
from heavytop.report.names import row_name
from heavytop.report.printable import printable

_MOST, _MOST_METRICS = 50, 100
"""Rows and quantities of the tables."""
_COMMENT = 60_000
"""Characters: a comment of a forge takes no more than 65,536."""
_LONGEST = 120


def comparison_markdown(result: Comparison, page: Path | None = None) -> str:
    """Verdict and findings, a line for each row with the worst first, differences of the environments, the page.

    Where that is too long for a comment, quantities and then rows are left out; the findings never are.
    """
    head = ["### heavytop: " + headline(result), "", *(f"- {escaped(sentence)}" for sentence in result.sentences), ""]
    rows, metrics = (_rows(result), _metrics(result)) if result.rows else ([], [])
    end = []
    if result.environment:
        end += ["<details><summary>Environments differ</summary>", "", "| | baseline | candidate |", "|---|---|---|"]
        end += ["| " + " | ".join(map(escaped_cell, difference)) + " |" for difference in result.environment[:_MOST]]
        end += ["", "</details>", ""]
    if page is not None:
        # no link: a comment does not lie beside the file
        end += [f"Both on the same axes: {escaped_cell(page.name)}.", ""]
    texts = ("\n".join(lines) for lines in ([*head, *rows, *metrics, *end], [*head, *rows, *end], head))
    return next((text for text in texts if len(text) <= _COMMENT), "\n".join(head))


def _rows(result: Comparison) -> list[str]:
    cells = ((c.verdict.value, row_name(c.identity), line(c)) for c in result.rows[:_MOST])
    lines = [
        "| verdict | row | what changed |",
        "|---|---|---|",
        *("| " + " | ".join(map(escaped_cell, c)) + " |" for c in cells),
    ]
    return [*lines, *(["", f"and {len(result.rows) - _MOST} more."] if len(result.rows) > _MOST else []), ""]


def _metrics(result: Comparison) -> list[str]:
    """What changed in each row, largest, rms and last value of one quantity in one line; folded."""
    head = ["<details><summary>Every quantity that changed</summary>", ""]
    head += ["| verdict | row | quantity | baseline | candidate | why |", "|---|---|---|---:|---:|---|"]
    found = ((change, *quantity) for change in result.rows[:_MOST] for quantity in folded(change))
    cells = (
        (c.verdict.value, row_name(c.identity), statistics(c, name, group), *values(group[0]), group[0].reason)
        for c, name, group in found
    )
    lines = ["| " + " | ".join(map(escaped_cell, each)) + " |" for each in cells]
    more = ["", f"and {len(lines) - _MOST_METRICS} more."] if len(lines) > _MOST_METRICS else []
    return [*head, *lines[:_MOST_METRICS], *more, "", "</details>", ""]


def escaped_cell(text: str) -> str:
    """Text in a cell of a table, cut where it is long."""
    text = " ".join(printable(text).split())
    return escaped(text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…")


def escaped(text: str) -> str:
    """Text that Markdown takes as it is, without line breaks."""
    return re.sub(r"([\\`*_{}\[\]<>|#~@&])", r"\\\1", " ".join(printable(text).split()))
