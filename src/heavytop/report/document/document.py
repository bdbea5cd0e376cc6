"""The document of a report: blocks with typed cells.  A kind of measurement makes one list of them, and the terminal,
the page, JSON and Markdown render it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import Flag, auto
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from heavytop.errors import InputError
from heavytop.precision import decimal_text, exact, log10
from heavytop.records import HEYOKA, Identity, Metric, Quantity, Report, Row, Series
from heavytop.report.document.svg import COLOURS, MARKERS, Picture
from heavytop.top.equations import HEAVY_TOP

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Names of rows for readers.


def computed_by(row: Row) -> str:
    """`` NAME`` of the integrator, which follows the case in tables; "" for heyoka and rows that are not computed."""
    subject = row.key.subject
    return f" {subject.name}" if subject.what == "computed" and subject.name != HEYOKA else ""


def row_name(row: Identity, with_kind: bool = True) -> str:
    """The name of a row: kind, case, system unless it is the heavy top, subject and format."""
    key = row.key
    system = "" if key.system == HEAVY_TOP.name else key.system
    parts = (key.kind if with_kind else "", row.case, system, row.integrator, key.precision)
    return " ".join(part for part in parts if part)


def variant(row: Row, sources: Iterable[tuple[str, Report]]) -> str:
    """The integrator and its options; "" for heyoka.  Ensembles are marked where there are single starts too."""
    subject = row.key.subject
    name = "" if subject.name == HEYOKA else subject.name
    mixed = row.starts > 1 and any(other.starts == 1 for _, report in sources for other in report.rows)
    return " ".join(part for part in (name, subject.variant, "many starts" if mixed else "") if part)


_INTEGRALS = {"gamma_squared": "|γ|²", "momentum_squared": "|M|²", "area": "M·γ", "hess": "Hess' relation"}
_INTEGRALS |= {f"spin{axis}": f"Ω{axis}" for axis in (1, 2, 3)}  # about an axis of symmetry


def integral_text(name: str) -> str:
    """The formula of a first integral, or its name in words."""
    return _INTEGRALS.get(name, name.replace("_", " "))


def with_source(name: str, source: str) -> str:
    """A label with its report, where there are several."""
    return f"{name}, {source}" if source else name


def short(value: str, digits: int = 3) -> str:
    """The text of a metric with few digits; words are unchanged."""
    try:
        number = exact(value)
    except InputError:
        return value
    if number == 0:
        return "0"
    if Fraction(1, 1000) <= abs(number) < 10**5:
        return f"{float(number):.{digits + 2}g}"
    text = f"{Decimal(decimal_text(number, digits)):.{digits - 1}E}"
    mantissa, _, exponent = text.partition("E")
    if exact(text) == number:  # such as a time 10^6
        mantissa = mantissa.rstrip("0").removesuffix(".")
    return f"{mantissa}e{int(exponent)}"


# Sections of the page, and what their pictures share: legends, printable names, logarithms of measured numbers.
#
# Sources are ("", report), or ("baseline", ...) and ("candidate", ...), drawn on the same axes.  The number of plots is
# bounded; a note counts those left out.


MOST_PLOTS = 12
TIME = "|t| (time units of the data)"
DASHED = (0, (6.0, 3.0))
_DASHES = ("", "6 3", "2 2", "8 2 2 2")
"""Dash patterns of SVG, in line widths; the first is a solid line."""

Sources = Sequence[tuple[str, Report]]


@dataclass(frozen=True, slots=True)
class Key:
    """An entry of a legend: the index of its colour, a marker of matplotlib, a dash pattern of SVG.

    old: of the baseline, drawn hollow and broad, so that it is visible beneath an unchanged candidate.
    """

    label: str
    colour: int
    marker: str = ""
    dash: str = ""
    old: bool = False
    line: bool = True


@dataclass(slots=True)
class Section:
    """A section of the page: text, pictures with one legend, their numbers, and notes on what is not drawn.

    answers: a table of conclusions above the pictures.  place: sort key of the section.
    """

    id: str
    title: str
    text: list[str]
    answers: Table | None = None
    pictures: list[Picture] = field(default_factory=list)
    legend: dict[str, Key] = field(default_factory=dict)
    columns: list[str] = field(default_factory=list)
    rows: list[Sequence[Cell]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    across: int = 3
    place: int = 100

    def key(self, key: Key) -> Key:
        """Adds ``key`` to the legend and returns it."""
        return self.legend.setdefault(key.label, key)

    def drop_empty_columns(self) -> None:
        """Removes the columns that are empty in every row."""
        used = [index for index in range(len(self.columns)) if any(cell_text(row[index]) for row in self.rows)]
        self.columns = [self.columns[index] for index in used]
        self.rows = [[row[index] for index in used] for row in self.rows]


_ROOM = 40


def clip(text: str, most: int = 60) -> str:
    """Text as one printable line, truncated where it is long."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text[: 4 * most]).split())
    if len(text) <= most:
        return line
    return f"{line[: most - 1]}…" + (f" ({len(text)} characters)" if most >= _ROOM else "")


def logarithm(value: str | None) -> float | None:
    """log10 |value| of a text; None for 0 and for text that is not a number."""
    try:
        return log10(exact(value)) if value is not None else None
    except InputError:
        return None


def points(series: Series, shift: float = 0.0, scale: float = 1.0) -> tuple[list[float], list[float]]:
    """log10 of |t|·scale, and log10 of the values minus ``shift``, at the points where both exist."""
    points = [(logarithm(t), logarithm(v)) for t, v in zip(series.times, series.values, strict=False)]
    pairs = [(x + math.log10(scale), y - shift) for x, y in points if x is not None and y is not None]
    return [x for x, _ in pairs], [y for _, y in pairs]


class Keys:
    """Legend entries of curves, numbered by label in order of appearance; baseline and candidate look alike."""

    def __init__(self) -> None:
        self._indices: dict[str, int] = {}

    def key(self, label: str, source: str = "") -> Key:
        """The entry of the curve with that label in the report ``source``."""
        index = self._indices.setdefault(label, len(self._indices))
        return numbered(f"{label}, {source}" if source else label, index, source == "baseline")


def numbered(label: str, index: int, old: bool = False) -> Key:
    """The entry of the ``index``-th curve: the first thirty-six all differ; later ones, from one cycle of colours to
    the next, differ in their dashes.
    """
    turn = index // len(COLOURS)
    marker = MARKERS[(index + turn) % len(MARKERS)]
    return Key(clip(label, 50), index % len(COLOURS), marker, _DASHES[turn % len(_DASHES)], old)


def draw(axes: Axes, key: Key, x: Any, y: Any, size: float = 3.6, every: float | None = 0.07) -> None:
    """Draws one curve, or points, in the style of its legend entry.

    every: distance of markers along a curve as a fraction of the diagonal; None for a marker at every sample.
    """
    colour = COLOURS[key.colour]
    style: dict[str, Any] = {"lw": 4.5, "alpha": 0.5, "mfc": "none", "ms": size + 2} if key.old else {"ms": size}
    spread = every if key.line and len(x) > 1 else None
    dashes: Any = (0, tuple(map(float, key.dash.split()))) if key.dash else "-"
    style |= {"ls": dashes if key.line else "none", "marker": key.marker, "mec": colour, "markevery": spread}
    axes.plot(x, y, color=colour, label=key.label, **style)


def left_out(section: Section, count: int, what: str) -> None:
    """Adds a note of how many are not drawn."""
    if count > 0:
        section.notes.append(f"{count} more {what}{'s' if count > 1 else ''} not drawn; report.json has them all.")


def scientific(logarithm: float) -> str:
    """10^logarithm to two digits: 2.3e-13, 50, 1e5."""
    exponent = math.floor(logarithm + 1e-9)
    mantissa = 10 ** (logarithm - exponent)
    return f"{10**logarithm:.3g}" if -4 < exponent < 5 else f"{mantissa:.1f}".removesuffix(".0") + f"e{exponent}"


class In(Flag):
    """Where a block is shown: in the short summary at the end of a run, in the full one (also JSON and Markdown), on
    the page.
    """

    SHORT = auto()
    FULL = auto()
    PAGE = auto()


@dataclass(frozen=True, slots=True)
class Value:
    """A measured number in few digits, with its rounding noise in decades where requested."""

    metric: Metric | None
    digits: int = 3
    noise: bool = False

    def __str__(self) -> str:
        """``2.3e-13 ± 0.12``; "-" where absent."""
        if self.metric is None:
            return "-"
        band = self.metric.band if self.noise else None
        return short(self.metric.value, self.digits) + (f" ± {band:.2f}" if band and band >= 0.005 else "")


@dataclass(frozen=True, slots=True)
class Word:
    """A verdict: refuted, holds or undecided."""

    text: str

    def __str__(self) -> str:
        """The verdict."""
        return self.text


Cell = str | Value | Word | Quantity


def cell_text(cell: Cell) -> str:
    """The text of a cell."""
    return cell.text if isinstance(cell, Quantity) else str(cell)


@dataclass(frozen=True, slots=True)
class Headline:
    """The conclusion of a kind in a sentence, after a verdict if any.  That of the first place opens a page."""

    text: str
    word: Word | None = None
    shown: In = In.FULL | In.PAGE


@dataclass(frozen=True, slots=True)
class Note:
    """A sentence, after a verdict where it has one.  style: of a line of a card, "", "soft" or "big"."""

    text: str
    word: Word | None = None
    style: str = ""
    shown: In = In.FULL


@dataclass(frozen=True, slots=True)
class Table:
    """Cells under their columns; the first of each row names it.

    notes: sentences above it.  words: the number of leading columns of text; the others are numbers.  left: the last
    one is text too.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()
    words: int = 1
    left: bool = False
    shown: In = In.FULL


@dataclass(frozen=True, slots=True)
class Card:
    """A group of lines, a small table, a note below."""

    title: str
    lines: Sequence[Note]
    table: Table | None = None
    note: str = ""
    shown: In = In.PAGE


Make = Callable[[Sources, Iterable[str]], Section | None]
"""Makes a section from the rows of all kinds that show it, and the cases to draw first; None for no picture."""


@dataclass(frozen=True, slots=True)
class Chart:
    """A section of the page with pictures, made from the rows of the kinds that show it, or of all kinds."""

    make: Make
    shown: In = In.PAGE
    of_all: bool = False


Block = Headline | Note | Table | Card | Chart
Document = Mapping[str, Sequence[Block]]
"""The blocks of each kind that has rows, in the order of the summary."""
