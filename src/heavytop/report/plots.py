"""The sections of a page about computed motions: digits kept, and drift and state error over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

from heavytop.measure.digits import RELATIVE, digits_kept, digits_text
from heavytop.measure.drift import DRIFT
from heavytop.measure.integrator import HEYOKA
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.records import Law, Metric, Quantity, Row, Series, Subject
from heavytop.report.section import (
    DASHED,
    MOST_PLOTS,
    TIME,
    Key,
    Section,
    Sources,
    clip,
    draw,
    left_out,
    logarithm,
    points,
    scientific,
)
from heavytop.report.svg import COLOURS, MARKERS, decades, finish, new_axes, spoken
from heavytop.report.text import short

MOST_LANES = 40


def _formats(sources: Sources) -> dict[str, int]:
    """Formats by their bits, each with its place: its colour and its marker."""
    bits = {row.precision: row.bits for _, report in sources for row in report.rows if row.series and row.bits}
    return {name: place for place, name in enumerate(sorted(bits, key=lambda name: (bits[name], name)))}


def _format_key(name: str, place: int, source: str, line: bool = True) -> Key:
    marker, colour = MARKERS[place % len(MARKERS)], place % len(COLOURS)
    old = source == "baseline"
    label = f"{clip(name, 20)}, {source}" if source else clip(name, 20)
    return Key(label, colour, marker, "", old, line)


class _Lane(NamedTuple):
    """What is drawn together: one case of one subject, in its formats."""

    case: str
    subject: Subject
    many: bool
    kind: str
    system: str

    @classmethod
    def of(cls, row: Row) -> _Lane:
        return cls(row.case, row.key.subject, row.starts > 1, row.key.kind, row.system)

    def name(self, most: int = 40) -> str:
        subject = "" if self.subject.name == HEYOKA else self.subject.name
        extra = " ".join(part for part in (subject, self.subject.variant) if part)
        extra = extra or ("many starts" if self.many else "")
        return clip(self.case, most) + (f" ({clip(extra, most)})" if extra else "")


def digits(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Digits that each format keeps over its run, beside the digits it started with."""
    lanes: dict[_Lane, list[tuple[str, Row]]] = {}
    for source, report in sources:
        for row in report.rows:
            if RELATIVE.text in row.metrics:
                lanes.setdefault(_Lane.of(row), []).append((source, row))
    if not lanes:
        return None
    section = Section(
        "digits",
        "Digits kept per format",
        [
            "Digits kept: −log10 of the largest |error|/max(1, |true value|) of a component of Ω or γ over the "
            "samples, against the known motion, or for many starts without one against runs in a wider format, which "
            "prove nothing; of many starts the root mean square over them. A thin line leads from the digits of the "
            "format to those it kept."
        ],
        columns=["case", "format", "T", "samples", "digits", "kept", "lost", "± digits"],
        place=10,
    )
    formats = _formats(sources)
    wanted = set(first)
    names = sorted(lanes, key=lambda lane: lane.case not in wanted)[:MOST_LANES]
    left_out(section, len(lanes) - len(names), "case")
    count = max(len(members) for members in lanes.values())
    lines = (count + 1) * len(names)
    axes = new_axes("kept (correct decimal digits)", "case", max(2.4, 0.8 + 0.12 * lines), 0.4)
    height = 0.8 / count
    heard = []
    for index, lane in enumerate(names):
        for place, (source, row) in enumerate(sorted(lanes[lane], key=lambda each: each[1].bits)):
            key = section.key(_format_key(row.precision, formats.get(row.precision, 0), source, line=False))
            y = index + (place - (len(lanes[lane]) - 1) / 2) * height
            full = row.bits * math.log10(2)
            kept = digits_kept(row) if row.outcome == "success" else None
            band = row.metrics[RELATIVE.text].band
            if kept is None:
                axes.plot([0], [y], "x", color=COLOURS[key.colour], mew=1.6, ms=6)
                said = row.outcome if row.outcome != "success" else row.metrics[RELATIVE.text].value
            else:
                axes.plot([kept, full], [y, y], "-", color=COLOURS[key.colour], lw=0.9)
                axes.plot([full], [y], "|", color=COLOURS[key.colour], ms=6)
                if band:
                    axes.plot([kept - band, kept + band], [y, y], "-", color=COLOURS[key.colour], lw=4, alpha=0.3)
                draw(axes, key, [kept], [y], 5)
                said = digits_text(kept)
            heard.append(f"{lane.name()}, {key.label}: {said} of {full:.1f}.")
            lost = "" if kept is None else f"{full - max(kept, 0.0):.1f}"
            spread = "" if band is None else f"{band:.2f}"
            samples = str(row.samples or "")
            section.rows.append(
                [lane.name(), key.label, short(row.horizon), samples, f"{full:.1f}", said, lost, spread]
            )
    axes.set_yticks(range(len(names)), [lane.name(15).replace(" (", "\n(", 1) for lane in names])
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(left=0)
    axes.grid(False, axis="y")
    section.pictures.append(finish(axes, "Digits kept per format", spoken(heard, 24), "digits"))
    section.notes.append("A cross at 0 is a run that failed or whose digits are not available.")
    return section


class _Column(NamedTuple):
    """One plot of a lane: a drift, or one component of the error."""

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
    _Column(Quantity(SOLUTION_ERROR, "along"), "state error along the flow", "error along (units of ε)"),
    _Column(Quantity(SOLUTION_ERROR, "across"), "state error across the flow", "error across (units of ε)"),
)


def growth(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Drift and state error over time, on logarithmic axes that all plots share.  ``first``: cases to draw first."""
    lanes: dict[_Lane, list[tuple[str, Row]]] = {}
    for source, report in sources:
        for row in report.rows:
            if row.bits and any(column.of(row) for column in _COLUMNS):
                lanes.setdefault(_Lane.of(row), []).append((source, row))
    if not lanes:
        return None
    section = Section(
        "growth",
        "Drift and state error over time",
        [
            "Each error in units of ε = 2^(1 − bits) of its own format, so that all formats share one scale: 10⁶ means "
            "that six digits are lost. Of the first integrals the one that drifts farthest is drawn. A first integral "
            "that holds is no proof that the motion is right: the distance from the true motion stands beside it.",
            "Dashed: the fitted law of growth over the span that was fitted, with the 95 % interval of its exponent; a "
            "shade around a curve is the interval in which rounding noise alone moves it.",
        ],
        columns=["case", "format", "quantity", "last |t|", "last value", "law", "exponent", "digits gone at |t|"],
        place=30,
    )
    wanted = set(first)
    names = sorted(lanes, key=lambda lane: (lane.case not in wanted, not any(row.laws for _, row in lanes[lane])))
    names = names[:MOST_PLOTS]
    left_out(section, len(lanes) - len(names), "case")
    formats = _formats(sources)
    drawn = [_growth_axes(section, lanes[lane], lane, column, formats) for lane in names for column in _COLUMNS]
    plots = [plot for plot in drawn if plot]
    x = [plot[0].get_xlim() for plot in plots]
    y = [plot[0].get_ylim() for plot in plots]
    if any(row.laws for lane in names for _, row in lanes[lane]):
        section.key(Key("fitted law", 5, "", "6 3"))
    for number, (axes, title, heard, laws) in enumerate(plots):
        axes.set_xlim(min(low for low, _ in x), max(high for _, high in x))
        axes.set_ylim(min(low for low, _ in y), max(high for _, high in y))
        section.pictures.append(finish(axes, title, spoken([*heard, *laws]), f"growth-{number}", " ".join(laws)))
    return section


def _growth_axes(
    section: Section,
    members: Sequence[tuple[str, Row]],
    lane: _Lane,
    column: _Column,
    formats: dict[str, int],
) -> tuple[Any, str, list[str], list[str]] | None:
    axes, heard, laws, lacking = None, [], [], []
    for source, row in members:
        largest = _largest(column.of(row))
        if largest is None:
            lacking.append(row.precision)
            continue
        quantity, last = largest
        epsilon = (1 - row.bits) * math.log10(2)
        x, y = points(last, epsilon)
        if not x:
            heard.append(f"{row.precision}: nothing that the reference resolves, or exactly 0.")
            continue
        if axes is None:
            axes = new_axes(TIME, column.unit)
            decades(axes.xaxis)
            decades(axes.yaxis)
        key = section.key(_format_key(row.precision, formats.get(row.precision, 0), source))
        draw(axes, key, x, y)
        law, band = row.laws.get(quantity.text), _band(row.metrics, quantity)
        if band:
            axes.fill_between(
                x, [v - band for v in y], [v + band for v in y], color=COLOURS[key.colour], alpha=0.18, lw=0
            )
        if law:
            _law(axes, key, law, x, y)
            laws.append(_law_said(key.label, law))
        what = quantity.component.replace("_", " ")
        heard.append(f"{key.label}: {scientific(y[-1])} ε ({what}) at |t| = {scientific(x[-1])}.")
        section.rows.append(
            [
                lane.name(),
                key.label,
                f"{'drift of' if quantity.name == DRIFT else 'error'} {what}",
                short(last.times[-1]),
                short(last.values[-1]),
                *_law_words(law),
            ]
        )
    if axes is None:
        return None
    if lacking and column is _COLUMNS[-1]:
        these = ", ".join(dict.fromkeys(map(clip, lacking)))
        section.notes.append(f"{lane.name()}: no known motion reaches as far as {these} ran, so no state error.")
    return axes, f"{lane.name()}: {column.label}", heard, laws


def _largest(found: dict[Quantity, Series]) -> tuple[Quantity, Series] | None:
    """Of several series the one whose last number is the largest."""

    def end(pair: tuple[Quantity, Series]) -> float:
        size = logarithm(pair[1].values[-1])
        return -math.inf if size is None else size

    return max(((q, series) for q, series in found.items() if series.values), key=end, default=None)


def _band(metrics: dict[str, Metric], quantity: Quantity) -> float | None:
    found = (metrics.get(quantity.over(part).text) for part in ("max", "rms", "final"))
    return next((metric.band for metric in found if metric and metric.band), None)


def _law(axes: Any, key: Key, law: Law, x: Sequence[float], y: Sequence[float]) -> None:
    """The law through the mean of the samples it was fitted to, with the fan of its interval."""
    if law.exponent is None or law.growth == "unresolved":
        return
    ends = [logarithm(end) for end in (law.first, law.last)]
    low, high = (given if given is not None else other for given, other in zip(ends, (x[0], x[-1]), strict=True))
    fitted = [(a, b) for a, b in zip(x, y, strict=True) if low - 1e-9 <= a <= high + 1e-9]
    if len(fitted) < 2:
        return
    grid = [low + (high - low) * step / 24 for step in range(25)]
    lines = [through(law, slope, fitted, grid) for slope in (law.exponent, law.low, law.high) if slope is not None]
    colour = COLOURS[key.colour]
    axes.plot(grid, lines[0], color=colour, lw=1.2, ls=DASHED)
    if len(lines) == 3:
        axes.fill_between(grid, *lines[1:], color=colour, alpha=0.18, lw=0)


def through(law: Law, slope: float, fitted: Sequence[tuple[float, float]], grid: Sequence[float]) -> list[float]:
    """The heights over ``grid`` of a law with that slope through the middle of the points ``fitted``; all log10.

    slope: exponent of a power, rate of an exponential, whose logarithm is no line over log10 |t|.
    """
    shape: Callable[[float], float] = (lambda x: math.log10(math.e) * 10**x) if law.growth == "exponential" else float
    height = sum(b - slope * shape(a) for a, b in fitted) / len(fitted)
    return [height + slope * shape(x) for x in grid]


def _law_said(label: str, law: Law) -> str:
    growth, exponent, _ = _law_words(law)
    if not exponent:
        return f"{label}: law {growth}."
    return f"{label}: {growth}, {'median rate of the starts' if growth == 'exponential' else 'exponent'} {exponent}."


def _law_words(law: Law | None) -> list[str]:
    if law is None:
        return ["", "", ""]
    interval = "" if law.low is None or law.high is None else f" [{law.low:.2f}, {law.high:.2f}]"
    exponent = "" if law.exponent is None else f"{law.exponent:.2f}{interval}"
    return [law.growth, exponent, short(law.lost_at) if law.lost_at else ""]
