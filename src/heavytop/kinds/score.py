"""Motions computed elsewhere, scored like our own: no plan asks for them, `heavytop score` makes their rows."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import structs
from rich.console import RenderableType
from rich.text import Text

from heavytop.kinds.base import Kind
from heavytop.records import Report, Row
from heavytop.report.answers import digits_headline
from heavytop.report.brief import digits_lines
from heavytop.report.digits_chart import digits
from heavytop.report.plots import growth
from heavytop.report.score_page import score_page
from heavytop.report.text import DIGITS, largest_over, motions, title


class Score(Kind):
    """Rows of :mod:`heavytop.suite.score`."""

    name = "score"
    sections = (digits, growth)
    place = 30

    def page(self, report: Report) -> str | None:
        """That of one motion, as `score --html` writes it."""
        return score_page(report)

    def headline(self, rows: Sequence[Row]) -> tuple[str, str] | None:
        """Digits right."""
        return digits_headline(rows)

    def brief(self, rows: Sequence[Row]) -> list[str]:
        """Digits right, a line a motion."""
        return digits_lines(rows, "Digits right, to |t|")

    def summary(self, rows: Sequence[Row]) -> list[RenderableType]:
        """A line a row."""
        return [
            title("Motions computed elsewhere: distance from the true motion, and drift of the first integrals"),
            Text(f"  Both absolute, {largest_over(rows)}."),
            Text(f"  {DIGITS}"),
            motions([structs.replace(row, case=f"{row.case} {row.integrator}") for row in rows]),
        ]
