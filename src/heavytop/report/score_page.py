"""The page of one scored motion: digits right, digits lost over time along and across the flow, the same in numbers."""

from __future__ import annotations

import math
from typing import Any

from heavytop.records import SCHEMA, Beside, Report, Row
from heavytop.report.html import render
from heavytop.report.score_text import answer, sizes, told
from heavytop.report.section import TIME, Key, Section, draw, logarithm, scientific
from heavytop.report.svg import MARKERS, decades, finish, new_axes, quiet_style, spoken
from heavytop.report.text import short
from heavytop.suite.score import Assessment

_MOST = 50
"""Sentences beside the answer."""
_PARTS = {"along": "along the flow (phase)", "across": "across the flow"}


def score_report(found: Assessment, environment: dict[str, Any], sha256: str = "") -> Report:
    """A report with this row alone, which `compare` understands, and what its page says beside the row."""
    beside = Beside(found.peer, tuple(told(found)))
    return Report(SCHEMA, {"name": "score", "sha256": sha256}, environment, [found.row], beside)


def score_page(report: Report) -> str | None:
    """One self-contained page of a report with one scored motion; the same report gives the same bytes.

    None for a report of anything else.
    """
    if report.beside is None or len(report.rows) != 1:
        return None
    (row,) = report.rows
    with quiet_style():
        section = digits_lost(row)
    return render(
        "score.html.j2",
        row=row,
        answer=answer(row, report.beside.peer),
        told=report.beside.remarks[:_MOST],
        section=section,
        sizes=sizes(row),
        environment=report.environment,
    )


def digits_lost(row: Row) -> Section | None:
    """Digits that the format has and the state has not, over |t|; None without a reference or a sample away from 0."""
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
    series = row.series.get(f"solution_error_{part}")
    if series is None:
        return []
    pairs = [(logarithm(t), logarithm(v)) for t, v in zip(series.times, series.values, strict=True)]
    return [(x, max(y - epsilon, 0.0)) for x, y in pairs if x is not None and y is not None]


def _table(row: Row, epsilon: float) -> list[list[str]]:
    first = row.series["solution_error_along"]
    columns = [row.series[f"solution_error_{part}"].values for part in _PARTS]

    def lost(value: str) -> str:
        size = logarithm(value)
        return "0.0" if value == "0" else value if size is None else f"{max(size - epsilon, 0.0):.1f}"

    return [[short(time), *map(lost, values)] for time, *values in zip(first.times, *columns, strict=True)]
