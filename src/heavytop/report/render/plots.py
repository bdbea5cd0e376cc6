"""The section of a page about computed motions over time: drift, distance from the truth, and their laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

from heavytop.errors import InputError
from heavytop.measure.integrator import HEYOKA
from heavytop.measure.scalar import RELATIVE, digits_kept, digits_text
from heavytop.measure.scorer import DRIFT, SOLUTION_ERROR
from heavytop.records import Law, Metric, Quantity, Report, Row, Series
from heavytop.report.document.document import (
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
    short,
    variant,
    with_source,
)
from heavytop.report.document.kind import Kinds
from heavytop.report.document.svg import (
    COLOURS,
    MARKERS,
    End,
    Picture,
    decades,
    document,
    finish,
    new_axes,
    quiet_style,
    room,
    spoken,
)
from heavytop.report.render.page import sections

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
    alternative: list[str]
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
        for axes, title, alternative, ends in charts:
            axes.set_xlim(min(low for low, _ in x), max(high for _, high in x))
            axes.set_ylim(min(low for low, _ in y), max(high for _, high in y))
            name = f"growth-{len(section.pictures)}"
            section.pictures.append(finish(axes, title, spoken(alternative, 24), name, ends=ends))
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
        chart.alternative.append(f"{key.label}: nothing that the reference resolves, or exactly 0.")
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
        chart.alternative.append(_law_said(key.label, law))
        chart.ends.append(End(_law_short(law), colour, x[-1], y[-1]))
    what = quantity.component.replace("_", " ")
    chart.alternative.append(f"{key.label}: {scientific(y[-1])} ε ({what}) at |t| = {scientific(x[-1])}.")
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


# The section of a page that says how many digits are lost by the horizon.


MOST_LANES, MOST_LISTED = 40, 160
_NONE = digits_text(0)


def digits_lost(row: Row) -> float | None:
    """Of the digits that the format has; None for a run that failed, and where nothing says."""
    kept = digits_kept(row) if row.outcome == "success" else None
    return None if kept is None else row.bits * math.log10(2) - max(kept, 0.0)


def digits(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Digits lost against the horizon: a line a motion and integrator, a marker a format.

    Runs with other options than the usual, planted faults among them, are in the numbers alone.
    """
    lanes: dict[tuple[str, str], list[tuple[str, Row]]] = {}
    for source, report in sources:
        for row in report.rows:
            if RELATIVE.text in row.metrics:
                lanes.setdefault((row.case, variant(row, sources)), []).append((source, row))
    if not lanes:
        return None
    section = Section(
        "digits",
        "Digits lost over a run",
        [
            "Digits lost: digits of the format less those right, −log10 of the largest |error|/max(1, |true value|) "
            "of a component of Ω or γ over the samples, against the known motion, or for many starts without one "
            "against runs in a wider format, which prove nothing; of many starts the root mean square over them. A bar "
            "is the interval in which rounding noise alone moves it.",
            "A line joins the formats of a motion, dashed where another integrator than heyoka computed it. Where all "
            "digits of a format are lost, its point is off the line.",
        ],
        columns=["case", "format", "T", "samples", "of digits", "lost", "kept", "± digits"],
        place=10,
    )
    usual = [lane for lane, rows in lanes.items() if not any(row.key.subject.variant for _, row in rows)]
    wanted, colours = set(first), list(dict.fromkeys(case for case, _ in usual or lanes))
    names = sorted(usual or lanes, key=lambda lane: lane[0] not in wanted)[:MOST_LANES]
    listed = [*names, *(lane for lane in lanes if lane not in names)][:MOST_LISTED]
    if len(listed) > len(names):
        section.notes.append(f"{len(listed) - len(names)} more runs are in the numbers alone.")
    left_out(section, len(lanes) - len(listed), "run")
    labels = [_label(lane) for lane in names]
    axes = new_axes(
        "T (time units of the data)", "digits lost (decimal digits)", 1 + 0.17 * max(14, len(names)), room(labels)
    )
    decades(axes.xaxis)
    drawing = _Digits(section, axes, _formats(sources), [])
    ends = [end for lane in names if (end := drawing.lane(lane, lanes[lane], colours.index(lane[0]) % _GREY))]
    section.rows = [_cells(_label(lane), *each) for lane in listed for each in _by_horizon(lanes[lane])]
    for key in sorted(section.legend.values(), key=lambda key: MARKERS.index(key.marker)):
        section.legend[key.label] = section.legend.pop(key.label)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    low, high = axes.dataLim.intervalx
    axes.set_xlim(math.floor(low - 0.1), math.ceil(high + 0.1))
    section.pictures.append(finish(axes, section.title, spoken(drawing.alternative, 24), "digits", ends=ends))
    if any(cell[5] == "" for cell in section.rows):
        section.notes.append("A cross at the top is a run that failed, or one whose error is not available.")
    return section


def _label(lane: tuple[str, str]) -> str:
    """A motion, and in brackets who computed it and how."""
    return clip(lane[0], 30) + (f" ({clip(lane[1], 30)})" if lane[1] else "")


def _by_horizon(members: Sequence[tuple[str, Row]]) -> list[tuple[str, Row]]:
    return sorted(members, key=lambda each: logarithm(each[1].horizon) or 0.0)


def _cells(label: str, source: str, row: Row) -> list[str]:
    """One run in the numbers."""
    lost, full, metric = digits_lost(row), row.bits * math.log10(2), row.metrics[RELATIVE.text]
    said = row.outcome if row.outcome != "success" else metric.value if lost is None else digits_text(full - lost)
    shown = "" if lost is None else f"{lost:z.1f}"
    band = f"{metric.band:.2f}" if metric.band else ""
    name = with_source(clip(row.precision, 20), source)
    return [label, name, short(row.horizon), str(row.samples or ""), f"{full:.1f}", shown, said, band]


def _formats(sources: Sources) -> dict[str, int]:
    """Formats by their bits, each with its place: its marker."""
    bits = {row.precision: row.bits for _, report in sources for row in report.rows if row.bits}
    return {name: place for place, name in enumerate(sorted(bits, key=lambda name: (bits[name], name)))}


class _Digits(NamedTuple):
    """The chart of digits lost.  formats: the place of each, its marker."""

    section: Section
    axes: Any
    formats: dict[str, int]
    alternative: list[str]

    def lane(self, lane: tuple[str, str], members: Sequence[tuple[str, Row]], colour: int) -> End | None:
        """Draw one motion in its formats; where its last point is."""
        ink, found = COLOURS[colour], []
        for source, row in _by_horizon(members):
            lost, until = digits_lost(row), logarithm(row.horizon)
            old, band = source == "baseline", row.metrics[RELATIVE.text].band or 0.0
            key = self.section.key(self._key(row, source))
            cells = _cells(_label(lane), source, row)
            lost_text = f"{cells[5] or cells[6]} of {cells[4]} lost at {cells[2]}."
            self.alternative.append(f"{cells[0]}, {key.label}: {lost_text}")
            if until is None:
                continue
            if lost is None:
                edge = {"transform": self.axes.get_xaxis_transform(), "clip_on": False, "color": ink}
                self.axes.plot([until], [1], "x", mew=1.6, ms=6, **edge)
                continue
            face = "none" if old else ink
            self.axes.plot([until], [lost], key.marker, ms=6, color=ink, mfc=face, mec=ink, label=key.label)
            self.axes.plot([until] * 2, [lost - band, lost + band], "-", color=ink, lw=3, alpha=0.3)
            found.append((source, row, until, lost))
        dash = "-" if all(row.key.subject.name == HEYOKA for _, row in members) else DASHED
        for source in dict.fromkeys(source for source, *_ in found):
            own = [
                (x, y) for other, row, x, y in found if other == source and digits_text(digits_kept(row) or 0) != _NONE
            ]
            x, y = [x for x, _ in own], [y for _, y in own]
            self.axes.plot(x, y, ls=dash, color=ink, lw=1.2, alpha=0.5 if source == "baseline" else 1)
        return End(_label(lane), ink, *found[-1][2:]) if found else None

    def _key(self, row: Row, source: str) -> Key:
        marker = MARKERS[self.formats[row.precision] % len(MARKERS)] if row.precision in self.formats else "o"
        return Key(with_source(clip(row.precision, 20), source), _GREY, marker, old=source == "baseline", line=False)


# Every picture of a report as a file of its own, as SVG and as PDF: the title above it, the legend below it.


def draw_report(report: Report, directory: Path, kinds: Kinds) -> list[Path]:
    """The files written into ``directory``, two a picture of the page; raises InputError where it has none."""
    found = [(section, picture) for section in sections([("", report)], kinds) for picture in section.pictures]
    if not found:
        raise InputError("The report has no row that is drawn.", "`heavytop run --plan smoke` makes some.")
    directory.mkdir(parents=True, exist_ok=True)
    return [file for section, picture in found for file in _save(section, picture, directory / picture.name)]


def _save(section: Section, picture: Picture, stem: Path) -> list[Path]:
    axes = picture.axes
    with quiet_style():
        axes.set_title(fill(picture.title, 60), loc="left", pad=10, size=10)
        drawn = axes.get_legend_handles_labels()[1]
        _legend(picture, [key for key in section.legend.values() if key.label in drawn])
        svg, pdf = stem.with_suffix(".svg"), stem.with_suffix(".pdf")
        svg.write_text(document(axes.figure, bbox_inches="tight"), "utf-8")
        axes.figure.savefig(pdf, metadata={"CreationDate": None, "Creator": "heavytop"}, bbox_inches="tight")
    return [svg, pdf]


def _legend(picture: Picture, keys: Sequence[Key]) -> None:
    from matplotlib.lines import Line2D

    if not keys:
        return
    handles = [
        Line2D([], [], color=COLOURS[key.colour], marker=key.marker, ms=5, ls=_dash(key), label=key.label)
        for key in keys
    ]
    place = {"loc": "upper left", "bbox_to_anchor": (0, 0), "borderaxespad": 0}
    picture.axes.figure.legend(handles=handles, ncols=2, fontsize=8.5, frameon=False, **place)


def _dash(key: Key) -> str:
    return "--" if key.dash else "-" if key.line else ""
