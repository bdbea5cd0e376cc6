"""A comparison for a pull request: GitHub-flavoured Markdown, short."""

from __future__ import annotations

import re
from pathlib import Path

from heavytop.report.compare import Comparison
from heavytop.report.comparison_text import headline, metric_name, values
from heavytop.report.names import row_name
from heavytop.report.printable import printable

_MOST = 50
"""Rows of the table; a comment of a forge takes no more than 65,536 characters."""
_LONGEST = 120


def comparison_markdown(result: Comparison, page: Path | None = None) -> str:
    """Verdict, what changed with the worst first, differences of the environments, and a link to the page."""
    lines = ["### heavytop: " + headline(result), ""]
    changed = result.changed
    if changed:
        lines += ["| verdict | row | metric | baseline | candidate | why |", "|---|---|---|---:|---:|---|"]
        lines += [
            "| "
            + " | ".join(map(_cell, (f.verdict.value, row_name(f.row), metric_name(f), *values(f), f.reason)))
            + " |"
            for f in changed[:_MOST]
        ]
        if len(changed) > _MOST:
            lines += ["", f"and {len(changed) - _MOST} more."]
        lines.append("")
    if result.environment:
        lines += ["<details><summary>Environments differ</summary>", "", "| | baseline | candidate |", "|---|---|---|"]
        lines += ["| " + " | ".join(map(_cell, difference)) + " |" for difference in result.environment]
        lines += ["", "</details>", ""]
    if page is not None:
        lines += [f"[Both on the same axes]({page.name.replace(' ', '%20')})", ""]
    return "\n".join(lines)


def _cell(text: str) -> str:
    """Text that Markdown takes as it is, without line breaks."""
    text = " ".join(printable(text).split())
    text = text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
    return re.sub(r"([\\`*_{}\[\]<>|#~@&])", r"\\\1", text)
