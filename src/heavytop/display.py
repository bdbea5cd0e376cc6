"""A small table as text for a terminal and as HTML for a notebook."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

_MOST = 12
_ENDS = 5


class Tabular:
    """What shows itself as a table: ``repr`` as text, in a notebook as HTML."""

    __slots__ = ()

    def _table(self) -> Table:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._table().text()

    def _repr_html_(self) -> str:
        return self._table().html()


class Lines(Sequence[Sequence[str]]):
    """The lines of a long table, each made when it is shown.

    count: how many.  line: the texts of one of them.
    """

    def __init__(self, count: int, line: Callable[[int], Sequence[str]]) -> None:
        self.places, self.line = range(count), line

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, place: Any) -> Any:
        found = self.places[place]
        return self.line(found) if isinstance(found, int) else [self.line(each) for each in found]

    def __iter__(self) -> Iterator[Sequence[str]]:
        return map(self.line, self.places)


@dataclass(frozen=True, slots=True)
class Table:
    """A title, a table below it and notes below that; long tables show their first and last rows.

    header: one text a column.  rows: as many texts each.  whole: every row is shown.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    whole: bool = False

    def _abridged(self) -> list[Sequence[str]]:
        if self.whole or len(self.rows) <= _MOST:
            return list(self.rows)
        gap = [f"... {len(self.rows) - 2 * _ENDS} more", *[""] * (len(self.header) - 1)]
        return [*self.rows[:_ENDS], gap, *self.rows[-_ENDS:]]

    def text(self) -> str:
        """Columns of equal width, the first aligned to the left."""
        lines = [list(self.header), *map(list, self._abridged())] if self.rows else []
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        body = [
            "  ".join(
                cell.rjust(width) if place else cell.ljust(width)
                for place, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in lines
        ]
        return "\n".join([self.title, *(f"  {line}" for line in body), *self.notes])

    def html(self) -> str:
        """The same as an HTML table, everything escaped."""

        def line(cells: Sequence[str], tag: str) -> str:
            return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

        parts = [f"<p>{escape(self.title)}</p>"]
        if self.rows:
            head, body = line(self.header, "th"), "".join(line(row, "td") for row in self._abridged())
            parts.append(f"<table><thead>{head}</thead><tbody>{body}</tbody></table>")
        return "".join([*parts, *(f"<p>{escape(note)}</p>" for note in self.notes)])
