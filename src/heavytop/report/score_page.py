"""What a report says of one scored motion: digits right, digits lost over time along and across the flow."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.records import SCHEMA, Beside, Quantity, Report, Row
from heavytop.report.document import Block, Card, Chart, Headline, In, Note, Table
from heavytop.report.printable import short
from heavytop.report.score_text import answer, sizes, told
from heavytop.report.section import TIME, Key, Section, Sources, draw, logarithm, scientific
from heavytop.report.svg import MARKERS, decades, finish, new_axes, spoken
from heavytop.suite.score import Assessment

_SIZES = "", "largest", "rms", "final"
_MOST = 50
"""Sentences beside the answer."""
_PARTS = {"along": "along the flow (phase)", "across": "across the flow"}


def score_report(found: Assessment, environment: dict[str, Any], sha256: str = "") -> Report:
    """A report with this row alone, which `compare` understands, and what its page says beside the row."""
    beside = Beside(found.peer, tuple(told(found)))
    return Report(SCHEMA, {"name": "score", "sha256": sha256}, environment, [found.row], beside)


def one_motion(row: Row, beside: Beside) -> Iterator[Block]:
    """How good a scored motion is, what explains its error, how its digits are lost, and the same in numbers."""
    first, *others = answer(row, beside.peer)
    yield Headline(first)
    compared = f"Compared with {row.against}."
    yield from (Note(said, shown=In.FULL | In.PAGE) for said in (*others, *([] if beside.remarks else [compared])))
    if beside.remarks:
        remarks = [Note(said) for said in beside.remarks[:_MOST]]
        yield Card("What explains it", remarks, note=compared, shown=In.FULL | In.PAGE)
    yield Chart(digits_lost)
    units = (
        "Errors of Ω and along and across the flow in 1/time unit, of γ in units of |γ| = 1; drift of each first "
        "integral in its own units."
    )
    yield Table("Errors and drift", _SIZES, sizes(row), [units], shown=In.FULL | In.PAGE)


def digits_lost(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Digits that the format has and the state has not, over |t|; None for several motions, without a reference, and
    without a sample away from 0.
    """
    rows = [row for _, report in sources for row in report.rows]
    if len(rows) != 1:
        return None
    (row,) = rows
    section = Section(
        "lost",
        "Digits lost over time",
        [
            f"Digits lost: log10 of the error in units of ε = 2^(1 − bits) of {row.precision}, of its part along the "
            "flow (phase) and of its part across it. The axis ends where the format has no digit left."
        ],
        columns=["t", *_PARTS],
    )
    axes = new_axes(TIME, "digits lost", 3.2)
    epsilon = (1 - row.bits) * math.log10(2)
    heard = []
    for place, (part, label) in enumerate(_PARTS.items()):
        curve = _lost(row, part, epsilon)
        if curve:
            x, y = [point[0] for point in curve], [point[1] for point in curve]
            draw(axes, section.key(Key(label, place, MARKERS[place])), x, y)
            heard.append(f"{label}: {y[-1]:.1f} digits lost at |t| = {scientific(x[-1])}.")
    if not heard:
        return None
    most = row.bits * math.log10(2)
    axes.set_ylim(0, max(most, *(line.get_ydata().max() for line in axes.lines)) * 1.02)
    axes.axhline(most, color="#555555", lw=0.9, ls=(0, (4, 3)))
    decades(axes.xaxis)
    section.rows = _table(row, epsilon)
    section.notes.append(f"Dashed: all {most:.0f} digits of {row.precision} are lost.")
    section.pictures.append(finish(axes, "Digits lost over time", spoken(heard), "lost"))
    return section


def _lost(row: Row, part: str, epsilon: float) -> list[tuple[float, float]]:
    """log10 |t| and digits lost at each sample of the series that has both."""
    series = row.series.get(Quantity(SOLUTION_ERROR, part).text)
    if series is None:
        return []
    pairs = [(logarithm(t), logarithm(v)) for t, v in zip(series.times, series.values, strict=True)]
    return [(x, max(y - epsilon, 0.0)) for x, y in pairs if x is not None and y is not None]


def _table(row: Row, epsilon: float) -> list[list[str]]:
    """The digits lost at each time."""
    series = [row.series[Quantity(SOLUTION_ERROR, part).text] for part in _PARTS]

    def lost(value: str) -> str:
        size = logarithm(value)
        return "0.0" if value == "0" else value if size is None else f"{max(size - epsilon, 0.0):.1f}"

    return [
        [short(time), *map(lost, values)]
        for time, *values in zip(series[0].times, *(each.values for each in series), strict=True)
    ]
