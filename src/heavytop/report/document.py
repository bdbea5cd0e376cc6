"""What a report says of its rows: blocks with typed cells.  A kind of measurement gives one list of them, and the
terminal, the page, JSON and Markdown show it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto

from heavytop.records import Metric, Quantity
from heavytop.report.printable import short
from heavytop.report.section import Section, Sources


class In(Flag):
    """Where a block is shown: in the short summary at the end of a run, in the full one (JSON and Markdown have the
    blocks of that), on the page.
    """

    SHORT = auto()
    FULL = auto()
    PAGE = auto()


@dataclass(frozen=True, slots=True)
class Value:
    """A measured number in few digits, with its rounding noise in decades where that is asked for."""

    metric: Metric | None
    digits: int = 3
    noise: bool = False

    def __str__(self) -> str:
        """``2.3e-13 ± 0.12``; "-" where there is no number."""
        if self.metric is None:
            return "-"
        band = self.metric.band if self.noise else None
        return short(self.metric.value, self.digits) + (f" ± {band:.2f}" if band else "")


@dataclass(frozen=True, slots=True)
class Word:
    """A verdict: refuted, holds or undecided."""

    text: str

    def __str__(self) -> str:
        """The verdict."""
        return self.text


Cell = str | Value | Word | Quantity


def cell_text(cell: Cell) -> str:
    """A cell in words."""
    return cell.text if isinstance(cell, Quantity) else str(cell)


@dataclass(frozen=True, slots=True)
class Headline:
    """The answer of a kind in a sentence, behind a verdict where it has one.  That of the first place opens a page."""

    text: str
    word: Word | None = None
    shown: In = In.FULL | In.PAGE


@dataclass(frozen=True, slots=True)
class Note:
    """A sentence, behind a verdict where it has one.  style: of a line of a card, "", "soft" or "big"."""

    text: str
    word: Word | None = None
    style: str = ""
    shown: In = In.FULL


@dataclass(frozen=True, slots=True)
class Table:
    """Cells under their columns; the first of each row names it.

    notes: sentences above it.  words: how many first columns are words, the others are numbers.  left: the last one is
    words too.
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
    """Lines that belong together, a small table, a note below."""

    title: str
    lines: Sequence[Note]
    table: Table | None = None
    note: str = ""
    shown: In = In.PAGE


Make = Callable[[Sources, Iterable[str]], Section | None]
"""A section from the rows of all kinds that ask for it, and the cases to draw first; None for no picture."""


@dataclass(frozen=True, slots=True)
class Chart:
    """A section of the page with pictures."""

    make: Make
    shown: In = In.PAGE


Block = Headline | Note | Table | Card | Chart
Document = Mapping[str, Sequence[Block]]
"""The blocks of each kind that has rows, in the order of the summary."""
