"""The section of a page about computed motions over time: drift, distance from the truth, and their laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from heavytop.measure.drift import DRIFT
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.records import Law, Metric, Quantity, Row, Series
from heavytop.report.names import variant
from heavytop.report.printable import short
from heavytop.report.section import (
    DASHED,
    MOST_PLOTS,
    TIME,
    Key,
    Keys,
    Section,
    Sources,
    clip,
    draw,
    left_out,
    logarithm,
    points,
    scientific,
)
from heavytop.report.svg import COLOURS, End, decades, finish, new_axes, room, spoken

_GREY = 5
_FITTED = Key("fitted law", _GREY, "", "6 3")


class _Column(NamedTuple):
    """One plot of a case: a drift, or one component of the error."""

    quantity: Quantity
    label: str
    unit: str

    def of(self, row: Row) -> dict[Quantity, Series]:
        """The series of a row that it may draw."""
        found = {series.quantity: series for series in row.series.values() if series.quantity}
        wanted = self.quantity
        return {q: s for q, s in found.items() if q.name == wanted.name and wanted.component in ("", q.component)}


_COLUMNS = (
    _Column(Quantity(DRIFT), "drift of a first integral", "|I(t) − I(0)| (units of ε)"),
    _Column(Quantity(SOLUTION_ERROR, "along"), "error along the flow", "error along (units of ε)"),
    _Column(Quantity(SOLUTION_ERROR, "across"), "error across the flow", "error across (units of ε)"),
)


class _Chart(NamedTuple):
    """Axes of one case and quantity, with what they show in words, and where each law stands."""

    axes: Any
    title: str
    heard: list[str]
    ends: list[End]


def growth(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Drift and state error over time, on logarithmic axes that the plots of a case share; cases ``first``."""
    cases: dict[str, list[tuple[Key, Row]]] = {}
    keys = Keys()
    for source, report in sources:
        for row in report.rows:
            if row.bits and any(column.of(row) for column in _COLUMNS):
                label = ", ".join(part for part in (clip(row.precision, 20), variant(row, sources)) if part)
                key = keys.key(label, source)
                cases.setdefault(row.case, []).append((key, row))
    if not cases:
        return None
    section = Section(
        "growth",
        "Drift and state error over time",
        [
            "Each error in units of ε = 2^(1 − bits) of its own format, so that all formats share one scale: 10⁶ means "
            "that six digits are lost. Of the first integrals the one that drifts farthest is drawn. A first integral "
            "that holds is no proof that the motion is right: the distance from the true motion stands beside it.",
            "Dashed, and in words at its end: the fitted law of growth with its exponent, or the rate of an "
            "exponential, over the span that was fitted, and the 95 % interval as a fan. A shade around a curve is the "
            "interval in which rounding noise alone moves it.",
        ],
        columns=["case", "run", "quantity", "last |t|", "last value", "law", "exponent", "digits gone at |t|"],
        place=30,
    )
    wanted = set(first)
    names = sorted(cases, key=lambda case: case not in wanted)
    left_out(section, len(names) - MOST_PLOTS, "case")
    for name in names[:MOST_PLOTS]:
        drawn = [_chart(section, name, column, cases[name]) for column in _COLUMNS]
        charts = [chart for chart in drawn if chart]
        x, y = ([getattr(chart.axes, f"get_{axis}lim")() for chart in charts] for axis in "xy")
        for axes, title, heard, ends in charts:
            axes.set_xlim(min(low for low, _ in x), max(high for _, high in x))
            axes.set_ylim(min(low for low, _ in y), max(high for _, high in y))
            name = f"growth-{len(section.pictures)}"
            section.pictures.append(finish(axes, title, spoken(heard, 24), name, ends=ends))
    if _FITTED.label in section.legend:
        section.legend[_FITTED.label] = section.legend.pop(_FITTED.label)
    return section


def _chart(section: Section, case: str, column: _Column, members: Sequence[tuple[Key, Row]]) -> _Chart | None:
    laws = [_law_short(law) for _, row in members for law in row.laws.values()]
    axes = new_axes(TIME, column.unit, right=room(laws) if laws else 0.12)
    decades(axes.xaxis)
    decades(axes.yaxis)
    chart = _Chart(axes, f"{clip(case, 40)}: {column.label}", [], [])
    lacking = []
    for key, row in members:
        largest = _largest(column.of(row))
        if largest is None:
            lacking.append(key.label)
        else:
            _curve(section, chart, clip(case, 40), key, row, *largest)
    if not axes.lines:
        return None
    if lacking and column is _COLUMNS[-1]:
        section.notes.append(f"{clip(case, 40)}: no known motion reaches as far as {', '.join(lacking)} ran.")
    return chart


def _curve(section: Section, chart: _Chart, case: str, key: Key, row: Row, quantity: Quantity, held: Series) -> None:
    """Draw one run with its noise and its law, and list it."""
    x, y = points(held, (1 - row.bits) * math.log10(2))
    if not x:
        chart.heard.append(f"{key.label}: nothing that the reference resolves, or exactly 0.")
        return
    draw(chart.axes, section.key(key), x, y)
    colour = COLOURS[key.colour]
    law, band = row.laws.get(quantity.text), _band(row.metrics, quantity)
    if band:
        above, below = [v + band for v in y], [v - band for v in y]
        chart.axes.fill_between(x, below, above, color=colour, alpha=0.18, lw=0)
    if law:
        if _law(chart.axes, colour, law, x, y):
            section.key(_FITTED)
        chart.heard.append(_law_said(key.label, law))
        chart.ends.append(End(_law_short(law), colour, x[-1], y[-1]))
    what = quantity.component.replace("_", " ")
    chart.heard.append(f"{key.label}: {scientific(y[-1])} ε ({what}) at |t| = {scientific(x[-1])}.")
    named = f"{'drift of' if quantity.name == DRIFT else 'error'} {what}"
    section.rows.append([case, key.label, named, short(held.times[-1]), short(held.values[-1]), *_law_words(law)])


def _largest(found: dict[Quantity, Series]) -> tuple[Quantity, Series] | None:
    """Of several series the one whose last number is the largest."""

    def end(pair: tuple[Quantity, Series]) -> float:
        size = logarithm(pair[1].values[-1])
        return -math.inf if size is None else size

    return max(((q, series) for q, series in found.items() if series.values), key=end, default=None)


def _band(metrics: dict[str, Metric], quantity: Quantity) -> float | None:
    found = (metrics.get(quantity.over(part).text) for part in ("max", "rms", "final"))
    return next((metric.band for metric in found if metric and metric.band), None)


def _law(axes: Any, colour: str, law: Law, x: Sequence[float], y: Sequence[float]) -> bool:
    """Draw the law through the mean of its samples, and the fan of its interval; False where there is none."""
    if law.exponent is None or law.growth == "unresolved":
        return False
    ends = [logarithm(end) for end in (law.first, law.last)]
    low, high = (given if given is not None else other for given, other in zip(ends, (x[0], x[-1]), strict=True))
    fitted = [(a, b) for a, b in zip(x, y, strict=True) if low - 1e-9 <= a <= high + 1e-9]
    if len(fitted) < 2:
        return False
    grid = [low + (high - low) * step / 24 for step in range(25)]
    lines = [through(law, slope, fitted, grid) for slope in (law.exponent, law.low, law.high) if slope is not None]
    axes.plot(grid, lines[0], color=colour, lw=1.2, ls=DASHED, label=_FITTED.label)
    if len(lines) == 3:
        axes.fill_between(grid, *lines[1:], color=colour, alpha=0.18, lw=0)
    return True


def through(law: Law, slope: float, fitted: Sequence[tuple[float, float]], grid: Sequence[float]) -> list[float]:
    """The heights over ``grid`` of a law with that slope through the middle of the points ``fitted``; all log10.

    slope: exponent of a power, rate of an exponential, whose logarithm is no line over log10 |t|.
    """
    shape: Callable[[float], float] = (lambda x: math.log10(math.e) * 10**x) if law.growth == "exponential" else float
    height = sum(b - slope * shape(a) for a, b in fitted) / len(fitted)
    return [height + slope * shape(x) for x in grid]


def _law_short(law: Law) -> str:
    """Few enough letters to stand beside a curve."""
    if law.exponent is None or law.growth == "unresolved":
        return "no law"
    if law.growth == "bounded":
        return law.growth
    return f"e^({law.exponent:.2g} t)" if law.growth == "exponential" else f"{law.growth} ({law.exponent:z.2f})"


def _law_said(label: str, law: Law) -> str:
    growth, exponent, _ = _law_words(law)
    if not exponent:
        return f"{label}: law {growth}."
    return f"{label}: {growth}, {'median rate of the starts' if growth == 'exponential' else 'exponent'} {exponent}."


def _law_words(law: Law | None) -> list[str]:
    if law is None:
        return ["", "", ""]
    interval = "" if law.low is None or law.high is None else f" [{law.low:z.2f}, {law.high:z.2f}]"
    exponent = "" if law.exponent is None else f"{law.exponent:z.2f}{interval}"
    return [law.growth, exponent, short(law.lost_at) if law.lost_at else ""]
