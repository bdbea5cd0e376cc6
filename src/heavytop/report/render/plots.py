"""Sections of a page: errors over time with their growth laws, and digits right; pictures as files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

from heavytop.display import plural
from heavytop.errors import InputError
from heavytop.measure.scalar import RELATIVE, digits_kept, digits_text
from heavytop.measure.scorer import DRIFT, SOLUTION_ERROR
from heavytop.records import Law, Metric, Quantity, Report, Row, Series
from heavytop.report.document.document import (
    DASHED,
    MOST_PLOTS,
    TIME,
    Cell,
    Key,
    Keys,
    Section,
    Sources,
    clip,
    draw,
    integral_text,
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
from heavytop.report.render.page import digits_until, sections
from heavytop.report.render.text import COMPUTED

_GREY = 5
_FITTED = Key("fitted law", _GREY, "", "6 3")


class _Column(NamedTuple):
    """One plot of a case: a drift, or one component of the error."""

    quantity: Quantity
    label: str
    unit: str

    def of(self, row: Row) -> dict[Quantity, Series]:
        """The series of a row that belong to this plot."""
        series_by_quantity = {series.quantity: series for series in row.series.values() if series.quantity}
        wanted = self.quantity
        return {
            q: s
            for q, s in series_by_quantity.items()
            if q.name == wanted.name and wanted.component in ("", q.component)
        }


_COLUMNS = (
    _Column(Quantity(DRIFT), "drift of", "|I(t) − I(0)| (units of ε)"),
    _Column(Quantity(SOLUTION_ERROR, "along"), "error along the flow", "error along (units of ε)"),
    _Column(Quantity(SOLUTION_ERROR, "across"), "error across the flow", "error across (units of ε)"),
)


class _Chart(NamedTuple):
    """Axes of one case and quantity, their alternative text, and the labels of the laws.

    integrals: the first integrals whose drift is drawn.
    """

    axes: Any
    label: str
    alternative: list[str]
    ends: list[End]
    integrals: dict[str, None]

    @property
    def title(self) -> str:
        """The case and the quantity, for drifts with the names of the first integrals."""
        return f"{self.label} {' or '.join(map(integral_text, self.integrals))}".rstrip()


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
        "Errors over time",
        [
            "Errors are in units of ε = 2^(1 − bits) of the format, so that all formats share one scale: 10⁶ means "
            "that six digits are lost. The first integral with the largest drift is drawn. A conserved integral does "
            "not prove the trajectory correct, so the distance from the true motion is shown next to it.",
            "A shaded band is the range over which rounding noise alone moves a curve. A curve without the name of an "
            "integrator is heyoka's.",
        ],
        columns=["case", "run", "quantity", "largest", "last |t|", "last", "law", "exponent", "digits lost at |t|"],
        place=30,
    )
    preferred = set(first)
    names = sorted(cases, key=lambda case: case not in preferred)
    left_out(section, len(names) - MOST_PLOTS, "case")
    for name in names[:MOST_PLOTS]:
        drawn = [_chart(section, name, column, cases[name]) for column in _COLUMNS]
        charts = [chart for chart in drawn if chart]
        x, y = ([getattr(chart.axes, f"get_{axis}lim")() for chart in charts] for axis in "xy")
        for chart in charts:
            chart.axes.set_xlim(min(low for low, _ in x), max(high for _, high in x))
            chart.axes.set_ylim(min(low for low, _ in y), max(high for _, high in y))
            words, number = spoken(chart.alternative, 24), f"growth-{len(section.pictures)}"
            section.pictures.append(finish(chart.axes, chart.title, words, number, ends=chart.ends))
    section.notes += _note_on_samples(row for case in names[:MOST_PLOTS] for _, row in cases[case])
    if _FITTED.label in section.legend:
        section.legend[_FITTED.label] = section.legend.pop(_FITTED.label)
        section.notes.append(
            "Dashed lines are fitted growth laws, drawn over the times of the fit and labelled with their exponents; "
            "the band around one is its 95 % interval. The rate of an exponential is the median over the starts; the "
            "root mean square follows the fastest of them. All digits are lost where the root mean square reaches a "
            "tenth of the motion's size, or does so by the law."
        )
    return section


def _chart(section: Section, case: str, column: _Column, members: Sequence[tuple[Key, Row]]) -> _Chart | None:
    laws = [_law_short(law) for _, row in members for law in row.laws.values()]
    axes = new_axes(TIME, column.unit, right=room(laws) if laws else 0.12)
    decades(axes.xaxis)
    decades(axes.yaxis)
    chart = _Chart(axes, f"{clip(case, 40)}: {column.label}", [], [], {})
    lacking = []
    for key, row in members:
        largest = _largest(column, [other for _, other in members if other.key == row.key])
        if largest is None or largest not in (series := column.of(row)):
            lacking.append(key.label)
        else:
            _curve(section, chart, clip(case, 40), key, row, largest, series[largest])
    if not axes.lines:
        return None
    if lacking and column is _COLUMNS[-1]:
        section.notes.append(f"{clip(case, 40)}: no reference extends as far as {', '.join(lacking)} ran.")
    return chart


def _curve(section: Section, chart: _Chart, case: str, key: Key, row: Row, quantity: Quantity, series: Series) -> None:
    """Draws one run with its noise and its law, and adds it to the table."""
    x, y = points(series, (1 - row.bits) * math.log10(2))
    if not x:
        chart.alternative.append(f"{key.label}: below the resolution of the reference, or exactly 0.")
        return
    draw(chart.axes, section.key(key), x, y)
    if quantity.name == DRIFT:
        chart.integrals[quantity.component] = None
    colour = COLOURS[key.colour]
    law, band = row.laws.get(quantity.text), _band(row.metrics, quantity)
    if band:
        above, below = [v + band for v in y], [v - band for v in y]
        chart.axes.fill_between(x, below, above, color=colour, alpha=0.18, lw=0)
    if law:
        if _law(chart.axes, colour, law, x, y):
            section.key(_FITTED)
        chart.alternative.append(_law_sentence(key.label, law))
        chart.ends.append(End(_law_short(law), colour, x[-1], y[-1]))
    component = quantity.component.replace("_", " ")
    chart.alternative.append(f"{key.label}: {scientific(y[-1])} ε ({component}) at |t| = {scientific(x[-1])}.")
    named = f"{'drift of' if quantity.name == DRIFT else 'error'} {component}"
    largest = row.metrics.get(quantity.over("max").text)
    last = [short(series.times[-1]), short(series.values[-1])]
    section.rows.append([case, key.label, named, short(largest.value) if largest else "", *last, *_law_words(law)])


def _note_on_samples(rows: Iterable[Row]) -> list[str]:
    """A sentence where curves have fewer samples than their runs; none where they have all of them."""
    counts = {(max(len(series.times) for series in row.series.values()), row.samples) for row in rows if row.series}
    fewer = [pair for pair in counts if pair[0] < pair[1]]
    if not fewer:
        return []
    drawn, total = (_span(sorted(part)) for part in zip(*fewer, strict=True))
    between = "a larger error may lie between; digits and tables count all"
    return [f"Curves show {drawn} of {total} samples, evenly in log |t|: {between}."]


def _span(counts: Sequence[int]) -> str:
    """``13``, or ``13 to 20`` for different counts."""
    return str(counts[0]) if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"


def _largest(column: _Column, rows: Sequence[Row]) -> Quantity | None:
    """The quantity with the largest value over all samples, among those with a series in one of the rows."""

    def largest(pair: tuple[Row, Quantity]) -> float:
        metric = pair[0].metrics.get(pair[1].over("max").text)
        return -math.inf if metric is None or metric.log10 is None else metric.log10

    drawn = ((row, quantity) for row in rows for quantity, series in column.of(row).items() if series.values)
    return max(drawn, key=largest, default=(None, None))[1]


def _band(metrics: dict[str, Metric], quantity: Quantity) -> float | None:
    statistics = (metrics.get(quantity.over(part).text) for part in ("max", "rms", "final"))
    return next((metric.band for metric in statistics if metric and metric.band), None)


def _law(axes: Any, colour: str, law: Law, x: Sequence[float], y: Sequence[float]) -> bool:
    """Draws the law through the mean of its samples, and the range of its interval; False without a law."""
    if law.exponent is None or law.growth == "unresolved":
        return False
    ends = [logarithm(end) for end in (law.first, law.last)]
    low, high = (bound if bound is not None else other for bound, other in zip(ends, (x[0], x[-1]), strict=True))
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
    """The heights over ``grid`` of a law with that slope through the mean of the points ``fitted``; all log10.

    slope: exponent of a power, rate of an exponential, whose logarithm is not a line over log10 |t|.
    """
    shape: Callable[[float], float] = (lambda x: math.log10(math.e) * 10**x) if law.growth == "exponential" else float
    height = sum(b - slope * shape(a) for a, b in fitted) / len(fitted)
    return [height + slope * shape(x) for x in grid]


def _law_short(law: Law) -> str:
    """The law in few enough characters for a label beside a curve."""
    if law.exponent is None or law.growth == "unresolved":
        return law.growth if law.exponent is None else "unresolved"
    if law.growth == "bounded":
        return law.growth
    return f"e^({law.exponent:.2g} t)" if law.growth == "exponential" else f"{law.growth} ({law.exponent:z.2f})"


def _law_sentence(label: str, law: Law) -> str:
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


# The section of a page about digits right: one chart per format.


MOST_LANES, MOST_LISTED = 40, 160
_Run = tuple[str, Row]
"""A row, with the source of its report."""


def digits(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Digits right over all samples: a chart per format, a line per motion and integrator; those of ``first`` on top.

    Runs with other than default options, such as planted faults, are only in the table.
    """
    runs = [(source, row) for source, report in sources for row in report.rows if RELATIVE.text in row.metrics]
    if not runs:
        return None
    section = Section(
        "digits",
        "Digits right",
        [
            "Digits right up to a time: −log10 of the largest |error|/max(1, |true value|) over the samples and the "
            "components of Ω and γ, compared with the reference; for many starts, of the root mean square. A bar is "
            "the range over which rounding noise alone moves the value; the dashed line marks all digits of the "
            "format. × marks a run that failed or whose error is not available. Thin lines only connect dots with "
            "labels.",
        ],
        columns=["case", "format", "T", "samples", "digits right", "of digits", "± digits"],
        across=2,
        place=10,
    )
    if any(row.reference.how == "computed" for _, row in runs):
        section.notes.append(COMPUTED)
    preferred = set(first)
    lanes: dict[str, list[_Run]] = {}
    for source, row in sorted(runs, key=lambda run: (bool(run[1].key.subject.variant), run[1].case not in preferred)):
        options = variant(row, sources)
        lanes.setdefault(clip(row.case, 30) + (f" ({clip(options, 30)})" if options else ""), []).append((source, row))
    usual = [name for name, members in lanes.items() if not members[0][1].key.subject.variant] or list(lanes)
    for name in usual[:MOST_LANES]:
        lanes[name].sort(key=lambda run: logarithm(run[1].horizon) or 0.0)
    formats = sorted({(row.bits, row.precision) for name in usual[:MOST_LANES] for _, row in lanes[name]})
    for number, (_, precision) in enumerate(formats[:MOST_PLOTS]):
        drawn = {name: [run for run in lanes[name] if run[1].precision == precision] for name in usual[:MOST_LANES]}
        drawn = {name: members for name, members in drawn.items() if members}
        section.pictures.append(_digits_right(section, clip(precision, 20), drawn, f"digits-{number}"))
    listed: list[Sequence[Cell]] = [_cells(name, *run) for name, members in lanes.items() for run in members]
    section.rows = listed[:MOST_LISTED]
    if (hidden := len(lanes) - len(usual[:MOST_LANES])) > 0:
        section.notes.append(f"{plural(hidden, 'more run')} in the numbers alone.")
    left_out(section, len(listed) - MOST_LISTED, "run")
    return section


def _digits_right(section: Section, precision: str, lanes: dict[str, list[_Run]], name: str) -> Picture:
    """The chart of one format; the run with the longest horizon is labelled, of two reports the candidate's."""
    full = max(row.bits for members in lanes.values() for _, row in members) * math.log10(2)
    texts = {lane: f"{lane}: {_right(members[-1][1], digits_until)}" for lane, members in lanes.items()}
    axes = new_axes(f"digits right, of {full:.0f}", "", 0.75 + 0.19 * max(3, len(lanes)), room(texts.values()))
    ends = []
    for index, (lane, members) in enumerate(lanes.items()):
        for source, row in members:
            right, band = _kept(row), row.metrics[RELATIVE.text].band or 0.0
            key = Key(source, 0, "x" if right is None else "o", old=source == "baseline", line=False)
            if source and right is not None:
                section.key(key)
            draw(axes, key, [right or 0.0], [-index], 5)
            if band:
                ends_of_bar = [(right or 0.0) - band, (right or 0.0) + band]
                axes.plot(ends_of_bar, [-index] * 2, color=COLOURS[0], lw=3, alpha=0.3)
        ends.append(End(texts[lane], COLOURS[0], right or 0.0, -index))
    axes.set(xlim=(-0.02 * full, 1.02 * full), ylim=(0.7 - len(lanes), 0.7), yticks=[])
    axes.axvline(full, color=COLOURS[_GREY], lw=0.9, ls=DASHED)
    description = spoken([f"{text}." for text in texts.values()], 24)
    return finish(axes, f"Digits right in {precision}", description, name, ends=ends)


def _kept(row: Row) -> float | None:
    """Digits right; None for a failed run, and where they are unknown."""
    return digits_kept(row) if row.outcome == "success" else None


def _right(row: Row, text: Callable[[Row], str]) -> str:
    """The text of the digits right, or the reason why there are none."""
    if _kept(row) is not None:
        return text(row)
    return row.outcome if row.outcome != "success" else row.metrics[RELATIVE.text].value


def _cells(lane: str, source: str, row: Row) -> list[str]:
    """The line of one run in the table."""
    band, right = row.metrics[RELATIVE.text].band, _right(row, lambda row: digits_text(digits_kept(row) or 0.0))
    name, full = with_source(clip(row.precision, 20), source), f"{row.bits * math.log10(2):.1f}"
    return [lane, name, short(row.horizon), str(row.samples or ""), right, full, f"{band:.2f}" if band else ""]


# Every picture of a report as a file, in SVG and in PDF, with the title above and the legend below.


def draw_report(report: Report, directory: Path, kinds: Kinds) -> list[Path]:
    """Writes two files per picture of the page into ``directory``; raises InputError without pictures."""
    pictures = [(section, picture) for section in sections([("", report)], kinds) for picture in section.pictures]
    if not pictures:
        raise InputError("The report has no rows to draw.", "`heavytop run --plan smoke` measures some.")
    directory.mkdir(parents=True, exist_ok=True)
    return [file for section, picture in pictures for file in _save(section, picture, directory / picture.name)]


def _save(section: Section, picture: Picture, stem: Path) -> list[Path]:
    axes = picture.axes
    with quiet_style():
        axes.set_title(fill(picture.title, 60), loc="left", pad=10, size=10)
        labels = axes.get_legend_handles_labels()[1]
        _legend(picture, [key for key in section.legend.values() if key.label in labels])
        svg, pdf = stem.with_suffix(".svg"), stem.with_suffix(".pdf")
        svg.write_text(document(axes.figure, bbox_inches="tight"), "utf-8")
        axes.figure.savefig(pdf, metadata={"CreationDate": None, "Creator": "heavytop"}, bbox_inches="tight")
    return [svg, pdf]


def _legend(picture: Picture, keys: Sequence[Key]) -> None:
    from matplotlib.lines import Line2D

    if not keys:
        return
    handles = []
    for key in keys:
        line = "--" if key.dash else "-" if key.line else ""
        handles += [Line2D([], [], color=COLOURS[key.colour], marker=key.marker, ms=5, ls=line, label=key.label)]
    legend = {"loc": "upper left", "bbox_to_anchor": (0, 0), "borderaxespad": 0}
    picture.axes.figure.legend(handles=handles, ncols=2, fontsize=8.5, frameon=False, **legend)
