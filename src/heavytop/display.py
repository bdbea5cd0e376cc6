"""Small tables as text for terminals and as HTML for notebooks, small pictures of paths, and printable names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from typing import Any, TypeVar, overload

_T = TypeVar("_T")
_MOST = 12
_ENDS = 5


def plural(number: int, one: str, many: str = "") -> str:
    """``1 row``, ``2 rows``."""
    return f"{number} {one if number == 1 else many or one + 's'}"


class Tabular:
    """An object displayed as a table: as text by ``repr``, as HTML in a notebook."""

    __slots__ = ()

    def _table(self) -> TitledTable:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._table().text()

    def _repr_html_(self) -> str:
        return self._table().html()


class Lazy(Sequence[_T]):
    """A sequence of ``size`` items, each made by ``make`` from its index on access; none is stored."""

    def __init__(self, size: int, make: Callable[[int], _T]) -> None:
        self._indices = range(size)
        self._make = make

    def __len__(self) -> int:
        return len(self._indices)

    @overload
    def __getitem__(self, index: int) -> _T: ...
    @overload
    def __getitem__(self, index: slice) -> list[_T]: ...
    def __getitem__(self, index: int | slice) -> _T | list[_T]:
        picked = self._indices[index]
        return self._make(picked) if isinstance(picked, int) else [self._make(index) for index in picked]


@dataclass(frozen=True, slots=True)
class TitledTable:
    """A title, a table and notes; long tables show their first and last rows.

    header: one text per column.  rows: as many texts each.  whole: whether every row is shown.
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
                cell.rjust(width) if index else cell.ljust(width)
                for index, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in lines
        ]
        return "\n".join([self.title, *(f"  {line}" for line in body), *self.notes])

    def html(self) -> str:
        """The table as HTML, everything escaped."""

        def line(cells: Sequence[str], tag: str) -> str:
            return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

        parts = [f"<p>{escape(self.title)}</p>"]
        if self.rows:
            head, body = line(self.header, "th"), "".join(line(row, "td") for row in self._abridged())
            parts.append(f"<table><thead>{head}</thead><tbody>{body}</tbody></table>")
        return "".join([*parts, *(f"<p>{escape(note)}</p>" for note in self.notes)])


_MOST_POINTS = 300
_RADIUS, _EDGE = 70, 5
_ELEVATION, _AZIMUTH = math.radians(24), math.radians(-50)


def path_picture(count: int, point: Callable[[int], Sequence[Any]], caption: str) -> str:
    """A path on the unit sphere as a small SVG of bounded size, with at most 300 of its points.

    count: of the points.  point: returns that of an index, three numbers.  caption: the subject of the path.
    "" for fewer than two points, and if one of those drawn is not finite.
    """
    if count < 2:
        return ""
    steps = min(count, _MOST_POINTS) - 1
    try:
        points = [[float(v) for v in point(round(n * (count - 1) / steps))] for n in range(steps + 1)]
    except (OverflowError, TypeError, ValueError):
        return ""
    if not all(math.isfinite(v) and abs(v) < _EDGE for point in points for v in point):
        return ""
    projected = [_projected(point) for point in points]
    size = 2 * (_RADIUS + _EDGE)
    middle = _RADIUS + _EDGE
    begin = f'<circle cx="{projected[0][0]:.1f}" cy="{projected[0][1]:.1f}" r="2.5" fill="#0072b2"/>'
    return (
        f'<svg width="{size}" height="{size}" viewBox="0 0 {size} {size}" role="img"><title>{escape(caption)}</title>'
        f'<circle cx="{middle}" cy="{middle}" r="{_RADIUS}" fill="currentColor" fill-opacity="0.06" '
        'stroke="currentColor" stroke-opacity="0.4"/>'
        f"{_lines(projected)}{begin}</svg><p>{escape(caption)}</p>"
    )


def _projected(point: Sequence[float]) -> tuple[float, float, bool]:
    """The projection of a point of the unit sphere, and whether it is on the front; the third axis points up."""
    x, y, z = point
    right = -x * math.sin(_AZIMUTH) + y * math.cos(_AZIMUTH)
    ahead = x * math.cos(_AZIMUTH) + y * math.sin(_AZIMUTH)
    up = z * math.cos(_ELEVATION) - ahead * math.sin(_ELEVATION)
    front = ahead * math.cos(_ELEVATION) + z * math.sin(_ELEVATION) >= 0
    middle = _RADIUS + _EDGE
    return middle + _RADIUS * right, middle - _RADIUS * up, front


def _lines(points: Sequence[tuple[float, float, bool]]) -> str:
    """The parts of the path on the front and, faint, on the back."""
    parts = {True: "", False: ""}
    begin = 0
    for front, run in groupby(points, lambda point: point[2]):
        end = begin + len([*run])
        # from the point before, on the other side
        parts[front] += "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y, _ in points[max(begin - 1, 0) : end])
        begin = end
    style = 'fill="none" stroke="#0072b2" stroke-width="1.3"'
    return "".join(
        f'<path d="{parts[front]}" {style}{"" if front else faint}/>'
        for front, faint in ((False, ' stroke-opacity="0.35"'), (True, ""))
        if parts[front]
    )


# Third-party names as text that terminals, XML and pictures can show.


_NO_SHAPE = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str) -> str:
    """Text with U+FFFD for control characters other than tabs and line breaks, and for characters not in XML 1.0."""
    return _NO_SHAPE.sub("\ufffd", text)
