"""Tables of states that other programs write as text: separators, spellings of the header, comments."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from difflib import get_close_matches

from heavytop.errors import InputError, quoted
from heavytop.suite import observed_columns
from heavytop.top.equations import VARIABLES

REMEDY = "docs/score.md shows both forms of the file, `heavytop list --case lagrange` one to paste."
COLUMNS = ("t", *VARIABLES)
VECTORS = ("inertia", "centre", "omega", "gamma", "rotor")
LISTS = (*VECTORS, "omega_space", "pivot", "point", "start_quaternion", "start_matrix", "start_euler")
"""Keys whose values are lists of numbers."""
_COMMENT = ("#", "%", "!", "//")
_OMEGA = ("omega", "om", "w", "ω", "angularvelocity")
_GAMMA = ("gamma", "gam", "g", "γ")
_CLASSIC = {"p": "omega1", "q": "omega2", "r": "omega3"}
_TIME = ("t", "time")
_AXES = {"x": 1, "y": 2, "z": 3}
_WORD = re.compile(r"([^\W\d]+?)(\d|[xyz])?")
_UNIT = re.compile(r"\s*[\[(/].*$")
_LIKE = 0.75
"""A key is a misspelling of another if so large a part of them is alike."""


def nearest(key: str, known: Sequence[str]) -> str:
    """The known key that an unknown one is a misspelling of, or nothing."""
    return next(iter(get_close_matches(key.lower(), sorted(known), 1, _LIKE)), "")


def unknown(key: str, known: Sequence[str]) -> InputError:
    """What is said of a key that is none."""
    near = nearest(key, known)
    return InputError(f"Unknown key {quoted(key)}.", f"Did you mean {near}?" if near else REMEDY)


class Table:
    """A text table: the keys of its comments, its rows in the order t Ω1 Ω2 Ω3 γ1 γ2 γ3, and what was noticed.

    known: the keys that a comment may have.  Raises InputError for a header or a row that cannot be understood, for a
    misspelt key and a key that stands twice.
    """

    def __init__(self, text: str, known: Sequence[str]) -> None:
        self.keys: dict[str, str | list[str]] = {}
        self.rows: list[list[str]] = []
        self.notes: list[str] = []
        self.header: observed_columns.Header | None = None
        header: list[str] | None = None
        body: list[str] = []
        self.lines: list[int] = []
        for number, line in enumerate(text.splitlines(), 1):
            stripped = line.strip()
            if stripped.startswith(_COMMENT):
                comment = stripped.lstrip("#%!/ ")
                if not body and not self._key(comment, known) and _is_header(_cells(comment, None)):
                    header = _cells(comment, None)
            elif stripped:
                body.append(stripped)
                self.lines.append(number)
        if not body:
            raise _no_header([])
        separator = _separator(body[0])
        first = _cells(body[0], separator)
        if not _is_number(first[0]):
            header, body, self.lines = first, body[1:], self.lines[1:]
        if header is not None:
            found = observed_columns.header(header)
            if found.time is not None and observed_columns.is_more_than_states(found):
                self.header, self.width = found, len(header)
                self.notes += unread(found.others, header)
                self.cells = _split(body, self.lines, separator, len(header))
                return
        places = self._places(header, len(first))
        self.rows = _in_order(body, separator, places, len(header or COLUMNS))

    def _key(self, comment: str, known: Sequence[str]) -> bool:
        """Take in ``key: value`` or ``key = value``; whether it was one."""
        match = re.match(r"([A-Za-z_][A-Za-z_ ]*?)\s*[:=]\s*(.*)", comment)
        if match is None or not match[2]:
            return False
        key, value = match[1], match[2].strip()
        if key not in known:
            # other comments may say what they like
            if nearest(key, known):
                raise unknown(key, known)
            return False
        if key in self.keys:
            raise InputError(f"The key {key} stands twice.", "Give each key once.")
        self.keys[key] = re.split(r"\s*[,;]\s*|\s+", value.strip("[]() ")) if key in LISTS else value
        return True

    def _places(self, header: list[str] | None, width: int) -> list[int]:
        """Where the columns t Ω1 Ω2 Ω3 γ1 γ2 γ3 stand in a row."""
        if header is None:
            if width != len(COLUMNS):
                raise InputError(
                    f"The first line is not {','.join(COLUMNS)}: there is no header, and Row 1 has {width} columns, "
                    f"not {len(COLUMNS)}.",
                    "Give a header that names the columns.",
                )
            self.notes.append(f"there is no header; the columns are taken as {' '.join(COLUMNS)}")
            return list(range(width))
        found = _columns(header)
        missing = [name for name in COLUMNS if name not in found]
        if missing:
            raise _no_header(missing)
        self.notes += unread([name for place, name in enumerate(header) if place not in found.values()], header)
        return [found[name] for name in COLUMNS]


def unread(names: Sequence[str], header: Sequence[str]) -> list[str]:
    """What is said of columns that are not read; nothing of ξ and radii, which heavytop writes itself."""
    columns = {name.strip() for name in header}
    own = {"xi1", "xi2", "xi3"} | {f"{name}_radius" for name in columns}
    more = [name for name in names if name.strip() not in own]
    return [f"columns that are not read: {', '.join(name[:20] for name in more[:6])}"] if more else []


def _no_header(missing: list[str]) -> InputError:
    said = f": {', '.join(missing)} not found" if missing else ""
    return InputError(f"The first line is not {','.join(COLUMNS)}{said}.", REMEDY)


def _separator(line: str) -> str | None:
    """Semicolon, comma, tab, or None for white space."""
    return next((mark for mark in (";", ",", "\t") if mark in line), None)


def _cells(line: str, separator: str | None) -> list[str]:
    if separator is None and any(mark in line for mark in ";,\t"):
        separator = _separator(line)
    line = line.partition("#")[0].rstrip()
    cells = line.split(separator)
    # a separator behind the last column is no column
    if separator and len(cells) > 1 and not cells[-1].strip():
        cells = cells[:-1]
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _is_number(text: str) -> bool:
    return bool(re.fullmatch(r"[+-]?(\.?\d.*|nan(\(.*\))?|inf(inity)?)", text, re.IGNORECASE))


def _in_order(body: list[str], separator: str | None, places: list[int], width: int) -> list[list[str]]:
    rows = []
    for index, line in enumerate(body, 1):
        cells = _cells(line, separator)
        if len(cells) != width:
            decimal_commas = separator == "," and len(cells) == 2 * width
            remedy = "Are these decimal commas? Separate the columns by semicolons." if decimal_commas else REMEDY
            raise InputError(f"Row {index} has {len(cells)} columns, not {width}.", remedy)
        # where a semicolon separates, a comma is the point of a decimal
        rows.append([cells[place].replace(",", ".") if separator == ";" else cells[place] for place in places])
    return rows


def _is_header(names: list[str]) -> bool:
    """Whether the words of a comment name the columns."""
    if len(_columns(names)) == len(COLUMNS):
        return True
    found = observed_columns.header(names) if len(set(names)) == len(names) else None
    return found is not None and found.time is not None and not found.others and bool(found.places)


def _split(body: list[str], lines: list[int], separator: str | None, width: int) -> list[list[str]]:
    """The cells of every row; raises InputError that names the line of one that has not as many as the header."""
    rows = []
    for number, line in zip(lines, body, strict=True):
        cells = _cells(line, separator)
        if len(cells) != width:
            raise InputError(
                f"Line {number} has {len(cells)} columns, not {width}.", "Give every row all of its columns."
            )
        rows.append([each.replace(",", ".") for each in cells] if separator == ";" else cells)
    return rows


def _columns(names: list[str]) -> dict[str, int]:
    """The place of each column whose name is understood; raises InputError for one that stands twice."""
    meant = [_meaning(name) for name in names]
    # counted from 0: omega0, omega1, omega2
    for vector in ("omega", "gamma"):
        if f"{vector}0" in meant:
            meant = [f"{vector}{int(m[-1]) + 1}" if m.startswith(vector) else m for m in meant]
    found: dict[str, int] = {}
    for place, name in enumerate(meant):
        if name in found:
            raise InputError(f"The column {name} stands twice.", "Give each column once.")
        if name in COLUMNS:
            found[name] = place
    return found


def _meaning(name: str) -> str:
    """t, omega1, ..., gamma3, or what is not understood as it is; Ω₁, w_x, \\Omega_{1} and time [s] are."""
    plain = unicodedata.normalize("NFKC", _UNIT.sub("", name)).lower()
    plain = re.sub(r"[\s_{}\\.^-]", "", plain)
    if plain in _TIME:
        return "t"
    if plain in _CLASSIC:
        return _CLASSIC[plain]
    match = _WORD.fullmatch(plain)
    if match is None or match[2] is None:
        return name
    axis = _AXES.get(match[2], match[2])
    return f"omega{axis}" if match[1] in _OMEGA else f"gamma{axis}" if match[1] in _GAMMA else name
