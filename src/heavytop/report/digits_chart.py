"""The section of a page that says how many digits are lost by the horizon."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from heavytop.measure.digits import RELATIVE, digits_kept, digits_text
from heavytop.measure.integrator import HEYOKA
from heavytop.records import Row
from heavytop.report.names import variant, with_source
from heavytop.report.printable import short
from heavytop.report.section import DASHED, Key, Section, Sources, clip, left_out, logarithm
from heavytop.report.svg import COLOURS, MARKERS, End, decades, finish, new_axes, room, spoken

MOST_LANES, MOST_LISTED = 40, 160
_GREY = 5
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
    section.pictures.append(finish(axes, section.title, spoken(drawing.heard, 24), "digits", ends=ends))
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
    heard: list[str]

    def lane(self, lane: tuple[str, str], members: Sequence[tuple[str, Row]], colour: int) -> End | None:
        """Draw one motion in its formats; where its last point is."""
        ink, found = COLOURS[colour], []
        for source, row in _by_horizon(members):
            lost, until = digits_lost(row), logarithm(row.horizon)
            old, band = source == "baseline", row.metrics[RELATIVE.text].band or 0.0
            key = self.section.key(self._key(row, source))
            cells = _cells(_label(lane), source, row)
            self.heard.append(f"{cells[0]}, {key.label}: {cells[5] or cells[6]} of {cells[4]} lost at {cells[2]}.")
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
