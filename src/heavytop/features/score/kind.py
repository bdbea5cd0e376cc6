"""Kind of the rows that `heavytop score` makes of trajectories computed elsewhere; no plan contains it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import structs

from heavytop.features.score.text import one_motion
from heavytop.kind import Kind
from heavytop.records import Beside, Row
from heavytop.report.document.document import Block, Chart
from heavytop.report.render.page import digits_columns, digits_headline, motions
from heavytop.report.render.plots import digits, growth
from heavytop.report.render.text import DIGITS, largest_over


class ScoreKind(Kind):
    """Rows of :mod:`heavytop.features.score.measurement`."""

    name = "score"
    place = 30

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The answer to the one motion that `score` wrote, and how its digits are lost; several as long runs."""
        if beside is not None and len(rows) == 1:
            yield from one_motion(rows[0], beside)
        else:
            if (headline := digits_headline(rows)) is not None:
                yield headline
            yield from (Chart(digits), Chart(growth))
        yield from digits_columns(rows)
        yield motions(
            "Motions computed elsewhere: distance from the true motion, and drift of the first integrals",
            [structs.replace(row, case=f"{row.case} {row.integrator}") for row in rows],
            [f"Both absolute, {largest_over(rows)}.", DIGITS],
        )
