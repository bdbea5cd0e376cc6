"""Columns of attitudes, positions and Ω in any axes in files of other programs: names, units, conventions, numbers."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import inf
from typing import Any

from flint import arb

from heavytop import written_numbers
from heavytop.display import plural
from heavytop.errors import InputError, prefixed, quoted, require_as_many
from heavytop.exact.flint.balls import midpoint, working_precision
from heavytop.features.score.trajectories.logs import (
    NAMES,
    ORDERS,
    canonical,
    of_rodrigues,
    of_rotation_vector,
    with_quaternion,
)
from heavytop.features.score.trajectories.observed import RawStart
from heavytop.measure.attitude_error import FRAMES, WIDTHS, Convention
from heavytop.precision import Vector, dot, exact, log10, ordered, vector

REMEDY = "`heavytop docs score` lists the column names."
_UNIT = re.compile(r"(?:(deg(?:rees?)?|°)|rad(?:ians?)?)\s*[\])]?$", re.IGNORECASE)
_INDEXED = re.compile(r"(.*[^\W\d_])((?:[\[(]\s*[0-4wxyz]\s*(?:,\s*[0-4wxyz]\s*)?[\])])+)(?:\s.*)?", re.IGNORECASE)
_PATTERNS = tuple(
    (quantity, re.compile(pattern))
    for quantity, pattern in (
        ("quaternion", r"(?:q|quat|quatq|quaternion)([wxyz0-4])"),
        ("matrix", r"(?:r|m|a|c|dcm|rot|rotation|matrix)([0-3])([0-3])"),
        ("rodrigues", r"(?:sigma|σ)([0-3])|mrp([xyz0-3])"),
        ("rotation_vector", r"(?:rotvec|rotationvector|rv)([xyz123])"),
        ("framed", r"w([xyz])"),
        ("omega_space", r"(?:w|omega|om|ω)(?:(?:space|world|global|inertial|s)([xyz123])|([xyz])(?:space|world))"),
        ("omega", r"(?:omega|om|ω|angularvelocity|w)(?:(?:body|local|b)?([xyz0-3])|([xyz])body)"),
        ("gamma", r"(?:gamma|gam|g|γ)([xyz0-3])"),
        ("position", r"(?:p|pos|position|com|centre|center|centreofmass|r|point)?([xyz])"),
    )
)
"""Patterns of the names of each quantity, tried in this order; their groups are the component."""
_NAMES = {
    name: (quantity, component)
    for quantity, component, names in (
        ("omega", "1", "p"),
        ("omega", "2", "q"),
        ("omega", "3", "r"),
        ("euler", "1", "euler1 angle1 alpha α"),
        ("euler", "2", "euler2 angle2 beta β"),
        ("euler", "3", "euler3 angle3"),
        ("euler", "φ", "phi φ"),
        ("euler", "θ", "theta θ"),
        ("euler", "ψ", "psi ψ"),
        ("euler", "X", "roll"),
        ("euler", "Y", "pitch"),
        ("euler", "Z", "yaw heading"),
    )
    for name in names.split()
}
"""Names of single components, before :data:`_PATTERNS`."""
_AXES = {"x": "1", "y": "2", "z": "3"}
_GREEK = ("φ", "θ", "ψ")
_GYROSCOPE = ("gx", "gy", "gz")
"""Names of Ω where their unit is that of a rate, otherwise of γ."""
_CLASSIC = ("p", "q", "r")
_TIME = ("t", "time", "timestamp", "stamp")
_TOGETHER = (tuple("wxyz"), tuple("xyzw"), ("e0", "e1", "e2", "e3"))
"""Names of four adjacent columns that are a quaternion, though each alone is another quantity or none."""
_SAID = re.compile(r"[\[(]\s*([^\[\]()]*?)\s*[\])]$|^[^\[(/]*/\s*(.+)$")
"""Unit in the last brackets of a name, or behind its first slash."""
_A_SECOND = ("/s", "/sec", "/second", "s-1")
_SECOND = {
    **dict.fromkeys(("ms", "msec", "milliseconds"), Fraction(1, 10**3)),
    **dict.fromkeys(("us", "μs", "usec", "microseconds"), Fraction(1, 10**6)),
    **dict.fromkeys(("ns", "nsec", "nanoseconds"), Fraction(1, 10**9)),
    **dict.fromkeys(("min", "minutes"), Fraction(60)),
    **dict.fromkeys(("h", "hr", "hours"), Fraction(3600)),
    **dict.fromkeys(("d", "day", "days"), Fraction(86400)),
}
_ANGLE = dict.fromkeys(("deg", "degree", "degrees", "°"), Fraction(1, 180))
_TURN = dict.fromkeys(("rev", "r", "turn", "turns"), Fraction(2))
_PER = {
    **dict.fromkeys(_A_SECOND, Fraction(1)),
    **dict.fromkeys(("/min", "/minute"), Fraction(1, 60)),
    **dict.fromkeys(("/h", "/hr", "/hour"), Fraction(1, 3600)),
}
_RATE = {
    **{f"{unit}{time}": size * rate for unit, size in (_ANGLE | _TURN).items() for time, rate in _PER.items()},
    **{"dps": Fraction(1, 180), "rpm": Fraction(1, 30), "rps": Fraction(2), "hz": Fraction(2)},
    **{f"mrad{second}": Fraction(1, 1000) for second in _A_SECOND},
}
_METRE = {"mm": Fraction(1, 10**3), "cm": Fraction(1, 100), "km": Fraction(1000)}
_METRE |= {"in": Fraction(254, 10**4), "ft": Fraction(3048, 10**4)}
_LENGTHS = ("m", *_METRE)
_OMEGA = ("omega", "omega_space", "framed")
_UNITS = {"t": _SECOND, **dict.fromkeys(_OMEGA, _RATE), "position": _METRE, "rotation_vector": _ANGLE}
"""Units of a header in those of the data: s, rad/s and rad (as multiples of π; mrad/s aside), and m."""
_OF_DATA = {
    "t": ("s", "sec", "second", "seconds"),
    "position": ("m",),
    "rotation_vector": ("rad",),
    **dict.fromkeys(_OMEGA, ("rad", "1/s", *(f"rad{second}" for second in _A_SECOND))),
}


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of the header and its size in that of the data.  turning: whether π is a further factor."""

    name: str
    size: Fraction
    turning: bool = False

    def factor(self, digits: int) -> Fraction:
        """The factor of the unit for numbers of so many digits, with guard digits of π."""
        with working_precision(4 * digits + 64):
            return self.size * midpoint(arb.pi()) if self.turning else self.size


@dataclass(frozen=True, slots=True)
class Header:
    """The quantities in the columns of a table.

    time: the index of t; None where absent.  places: by quantity, the index of each component by its name, in the order
    of the file.  angles: degrees or radians, where the header says so.  others: columns that are not read.
    units: of t and of quantities, where they differ from those of the data.  unknown: units that are not converted.
    """

    time: int | None
    places: Mapping[str, Mapping[str, int]]
    angles: str
    others: tuple[str, ...]
    units: Mapping[str, Unit] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()

    @property
    def missing(self) -> list[str]:
        """The quantities that a table of states lacks: t, Ω, γ."""
        given = {"t": self.time is not None, "Ω": {"omega", "framed"} & self.places.keys(), "γ": "gamma" in self.places}
        return [name for name, there in given.items() if not there]


def header(names: Sequence[str], joint: str = "") -> Header:
    """The header of these names; raises InputError for a column that is given twice.

    joint: of columns qpos and qvel, "free" or "ball".
    """
    written, names = names, with_quaternion([canonical(name, joint) for name in names])
    indices: dict[str, dict[str, int]] = {}
    time, angles, others = None, set(), []
    units: dict[str, set[Unit]] = {}
    plainly = [_plain(_with_index(name.strip())) for name in names]
    together = _quaternion(names, plainly)
    for index, (name, plain) in enumerate(zip(names, plainly, strict=True)):
        if index in together.values():
            continue
        if plain in _TIME:
            if time is not None:
                raise _twice("t", written[time], written[index])
            time = index
            units["t"] = {_unit("t", name)}
            continue
        meaning = _meaning(plain)
        is_angle = _UNIT.search(name.strip()) or (plain.startswith("r") and "px" in plainly)  # rx [deg]; rx beside tx
        if meaning is None or (meaning[0] == "position" and is_angle):
            others.append(name)
            continue
        quantity, component = meaning
        if plain in _GYROSCOPE and _unit("omega", name).name in (*_RATE, *(f"rad{second}" for second in _A_SECOND)):
            quantity = "omega"
        if component in indices.setdefault(quantity, {}):
            of_state = quantity in ("omega", "gamma")
            label = f"{quantity}{_AXES.get(component, component)}" if of_state else quoted(name)
            raise _twice(label, written[indices[quantity][component]], written[index])
        indices[quantity][component] = index
        units.setdefault(quantity, set()).add(_unit(quantity, name))
        if quantity == "euler" and (unit := _UNIT.search(name.strip())):
            angles.add("degrees" if unit[1] else "radians")
    if len(angles) > 1:
        raise InputError("The header has angles in degrees and in radians.", "Use one unit for all angles.")
    if together:
        indices["quaternion"] = together
    for name in others:
        _require_no_quantity(name, indices)
    unknown = tuple(text for quantity in units.keys() & _UNITS.keys() for text in _unknown(quantity, units[quantity]))
    return Header(time, indices, "".join(angles), tuple(others), _in_one_unit(units), unknown)


def _twice(column: str, one: str, other: str) -> InputError:
    if len({re.sub(r"[\[(]\d+[\])]", "", name) for name in (one, other)}) == 1 and one != other:  # y[0] and y[1]
        return InputError(f"The columns {quoted(one)} and {quoted(other)} name no quantity.", NAMES)
    both = "" if one == other else f", as {quoted(one.strip())} and {quoted(other.strip())}"
    return InputError(f"The column {column} occurs twice{both}.", "Keep one of them.")


def _quaternion(names: Sequence[str], plain: Sequence[str]) -> dict[str, int]:
    """The indices of adjacent w, x, y, z or e0 to e3, where no column is named as one of a quaternion.

    Columns with a unit of length are excluded.  Raises InputError where x, y, z may belong to either of two.
    """
    if any(meaning is not None and meaning[0] == "quaternion" for meaning in map(_meaning, plain)):
        return {}
    runs = [(begin, tuple(plain[begin : begin + 4])) for begin in range(len(plain) - 3)]
    lengths = [_unit("position", name).name in _LENGTHS for name in names]
    matches = [(begin, run) for begin, run in runs if run in _TOGETHER and not any(lengths[begin : begin + 4])]
    if len(matches) > 1:
        raise InputError(
            f"Of the columns {quoted(','.join(names))[:80]} more than four may belong to a quaternion.",
            "Call them qw,qx,qy,qz, and positions px,py,pz.",
        )
    return {name[-1]: begin + number for begin, run in matches for number, name in enumerate(run)}


def _require_no_quantity(name: str, indices: Mapping[str, object]) -> None:
    """Raises InputError for an unread column whose name begins as that of a quantity that no other column gives.

    Such is a unit without brackets: the quantity would be ignored.  A suffix after ``_`` makes another quantity, as in
    theta_dot, except of Ω and γ.
    """
    parts = re.split(r"([\s_{}<>]+)", name.strip())
    for end in range(1, len(parts), 2):
        begins = _plain(begun := "".join(parts[:end]))
        quantity = (None if begins in _CLASSIC else _meaning(begins)) or ("", "")
        is_angle = quantity[0] == "position" and _UNIT.search(name.strip())
        named = quantity[0] in (*_OMEGA, "gamma") or (quantity[0] and "_" not in parts[end] and not is_angle)
        if named and not {quantity[0], *(_OMEGA if quantity[0] in _OMEGA else ())} & indices.keys():
            raise InputError(
                f"The column {quoted(name)} looks like a component of {_words(quantity[0])}, but the name is unknown.",
                f"Write a unit in brackets, {quoted(begun + ' [unit]')}, or give the column another name.",
            )


def _unit(quantity: str, name: str) -> Unit:
    """The unit in the name of a column; that of the data where there is no known one."""
    match = _SAID.search(name.strip())
    text = unicodedata.normalize("NFKC", (match[1] or match[2] or "") if match else "").lower()
    text = re.sub(r"[\s*·^().]", "", text.replace("−", "-"))
    known = _UNITS.get(quantity, {})
    return Unit(
        text, known.get(text, Fraction(1)), text in known and known in (_RATE, _ANGLE) and not text.startswith("mrad")
    )


def _in_one_unit(units: Mapping[str, set[Unit]]) -> dict[str, Unit]:
    """The unit of each quantity that has another than the data; raises InputError for one that has several."""
    for quantity, of_quantity in units.items():
        if len({(unit.size, unit.turning) for unit in of_quantity}) > 1:
            names = " and ".join(sorted(f"in {unit.name}" if unit.name else "without a unit" for unit in of_quantity))
            raise InputError(f"The units of {_words(quantity)} differ: {names}.", "Use one unit.")
    unit_of_quantity = {
        quantity: min(of_quantity, key=lambda unit: unit.name) for quantity, of_quantity in units.items()
    }
    return {quantity: unit for quantity, unit in unit_of_quantity.items() if unit.size != 1}


def _unknown(quantity: str, units: set[Unit]) -> list[str]:
    """The units of a quantity that are neither those of the data nor converted to them."""
    names = sorted({unit.name for unit in units if unit.size == 1} - {"", "1", "-", *_OF_DATA[quantity]})
    return [f"{_words(quantity)} in {name}" for name in names if name not in _AXES and not name.isdigit()]


def _with_index(name: str) -> str:
    """omega1 of ``omega[1]`` and R11 of ``R[1][1]`` or ``R(1, 1)``, where the brackets hold a component, not a unit."""
    match = _INDEXED.fullmatch(name)
    base = _plain(match[1]) if match else ""
    if match is None or base in _TIME or (base not in _CLASSIC and _meaning(base) is not None):
        return name
    return match[1] + re.sub(r"[^\w]", "", match[2])


def _plain(name: str) -> str:
    text = unicodedata.normalize("NFKC", re.sub(r"\s*[\[(/].*$", "", name)).lower()
    text = re.sub(r"_(deg(rees)?|rad(ians)?)$", "", text.strip())
    return re.sub(r"[\s_{}\\.:^-]", "", text)


def _meaning(plain: str) -> tuple[str, str] | None:
    """The quantity and the component of a name; None where it is not understood."""
    if plain in _NAMES:
        return _NAMES[plain]
    for quantity, pattern in _PATTERNS:
        if match := pattern.fullmatch(plain):
            return quantity, "".join(filter(None, match.groups()))
    return None


def is_more_than_states(header: Header) -> bool:
    """Whether there are columns other than Ω and γ, or only one of these vectors."""
    names = set(header.places)
    quantities = {"omega" if name == "framed" else name for name in names}
    complete = all(len(components) == 3 for components in header.places.values())
    return bool(quantities - {"omega", "gamma"}) or (len(quantities) == 1 and complete)


def ordered_places(
    quantity: str, components: Mapping[str, int], scalar_last: bool, sequence: str
) -> list[tuple[str, int]]:
    """Name and index of each component in the order of the quantity; raises InputError for a missing one."""
    names = _components(quantity, [*components], scalar_last, sequence)
    missing = [name for name in names if name not in components]
    extra = [name for name in components if name not in names]
    if missing or extra:
        fault = f"component {missing[0]} is missing" if missing else f"component {extra[0]} has no counterpart"
        remedy = "Give every component, or another name to a column of something else."
        raise InputError(f"The columns of {_words(quantity)} are incomplete: {fault}.", remedy)
    return [(name, components[name]) for name in names]


def _components(quantity: str, names: Sequence[str], scalar_last: bool, sequence: str) -> list[str]:
    there = set(names)
    if quantity == "quaternion":
        if there & set("wxyz"):
            return list("xyzw" if scalar_last else "wxyz")
        return list("1234" if "4" in there else "0123")
    if quantity == "matrix":
        first = 0 if any("0" in name for name in there) else 1
        return [f"{i}{j}" for i in range(first, first + 3) for j in range(first, first + 3)]
    if quantity == "euler" and there & set("XYZ"):
        if sorted(sequence) != ["X", "Y", "Z"]:
            raise InputError(
                f"roll, pitch and yaw need a sequence about three axes; got {sequence or 'none'}.",
                'Give sequence, such as "ZYX", or call the columns euler1, euler2, euler3.',
            )
        return list(sequence)
    if there & {*_GREEK}:
        of_axes = len({*sequence}) == 3 and sequence != "XYZ"
        if there == {*_GREEK} and (of_axes or [*names] != [*_GREEK]):
            raise InputError(
                f"The columns {', '.join(names)} do not say which angle of {sequence or 'a sequence'} is the first.",
                "Call them euler1, euler2, euler3 in the order of the sequence, or roll, pitch, yaw about X, Y, Z.",
            )
        return list(_GREEK)
    if there & set("xyz"):
        return list("xyz")
    return list("012" if "0" in there else "123")


def _words(quantity: str) -> str:
    return {
        "omega_space": "angular velocity in space axes",
        "framed": "angular velocity",
        "euler": "Euler angles",
        "rodrigues": "modified Rodrigues parameters",
        "rotation_vector": "rotation vector",
    }.get(quantity, quantity)


# Quantities of files with attitudes, positions or Ω in any axes, or with the data of a body.


CONVENTIONS = ("quaternion_order", "quaternion", "matrix", "sequence", "angles", "frame", "up", "pivot", "point")
STARTS = ("start_quaternion", "start_matrix", "start_euler", "omega_space")
BODIES = ("file", "link", "mass", "gravity", "about", "rotor")
_ARRAYS = {
    "quaternions": "quaternion",
    "quaternion": "quaternion",
    "matrices": "matrix",
    "matrix": "matrix",
    "euler": "euler",
    "eulers": "euler",
    "positions": "position",
    "position": "position",
    "omegas": "omega",
    "omega_space": "omega_space",
    "gammas": "gamma",
}
"""Keys of JSON documents whose values are a list for each time."""
KEYS = {*CONVENTIONS, *STARTS, *BODIES, *_ARRAYS}


@dataclass(frozen=True, slots=True)
class ColumnTable:
    """Numbers of the columns of a file.

    values: by the name of the quantity, the exact numbers of each row, None for a row that is not finite.
    texts: every number as written.  places: the name of each row in messages.
    """

    values: Mapping[str, list[tuple[Fraction, ...] | None]]
    texts: list[str]
    places: list[str]


def is_observed(document: Mapping[str, Any]) -> bool:
    """Whether a document has other keys or columns than those of states in principal axes."""
    return not document.get("plain", True) or any(document.get(key) is not None for key in KEYS)


def convention(document: Mapping[str, Any], header: Header | None = None) -> Convention:
    """Conventions that the file states; raises InputError for what is not known."""
    stated: dict[str, Any] = {}
    if (order := _word(document, "quaternion_order")) is not None:
        if order.lower() not in ORDERS:
            raise InputError(f"quaternion_order must be wxyz or xyzw; got {quoted(order)}.", "Give one of these.")
        stated["quaternion_order"] = ORDERS[order.lower()]
    for key in ("quaternion", "matrix"):
        if _is_direction(document.get(key)):
            stated[key] = document[key].strip()
    has_angles = header is None or "euler" in header.places or document.get("start_euler") is not None
    for key in ("sequence", "angles", "up"):
        if (word := _word(document, key)) is not None:
            stated[key] = word.lower().lstrip("+") if key != "sequence" else word if has_angles else word.upper()
    if header is not None and header.angles and stated.setdefault("angles", header.angles) != header.angles:
        raise InputError(f"The header declares {header.angles}, but angles = {stated['angles']}.", "Give it once.")
    for key in ("pivot", "point"):
        if document.get(key) is not None:
            stated[key] = vector(_numbers(document[key], key, 3), key)
    return Convention(**stated)


USED_BY = {
    **dict.fromkeys(("quaternion_order", "quaternion"), "quaternion"),
    "matrix": "matrix",
    **dict.fromkeys(("sequence", "angles"), "euler"),
    **dict.fromkeys(("pivot", "point"), "position"),
}
"""The quantity that each convention is about; ``up`` is about all but Ω and γ."""


def unused(convention: Convention, quantities: Iterable[str]) -> list[str]:
    """The conventions, other than by default, that are about none of the quantities of a motion and its start."""
    usual, there = Convention(), set(quantities)
    words = [word for word, name in USED_BY.items() if name not in there]
    words += ["up"] if there <= {"omega", "gamma"} else []
    return [word for word in words if getattr(convention, word) != getattr(usual, word)]


def _is_direction(value: object) -> bool:
    """Whether the value of ``quaternion`` or ``matrix`` is a word, and not an attitude."""
    return isinstance(value, str) and any(letter in value for letter in "bdstuy_")


def _word(document: Mapping[str, Any], key: str) -> str | None:
    value = document.get(key)
    if value is not None and not isinstance(value, str):
        raise InputError(
            f"{key} must be a word; got {quoted(value)}.", "`heavytop docs score` describes the file formats."
        )
    return None if value is None else value.strip()


def in_space(document: Mapping[str, Any]) -> bool:
    """Whether columns wx, wy, wz, or Ω without other columns of it, are in the axes of space."""
    frame = (_word(document, "frame") or "body").lower()
    if frame not in FRAMES:
        raise InputError(f"frame must be space or body; got {quoted(frame)}.", "Give one of these.")
    return frame == "space"


def listed(value: Any, what: str, count: int | None = None) -> list[Any]:
    """A list of so many members; raises InputError for anything else."""
    if not isinstance(value, list) or (count is not None and len(value) != count):
        has = (
            f"has {plural(len(value), 'number')}: {quoted(', '.join(map(str, value)))}"
            if isinstance(value, list)
            else "is not a list"
        )
        commas = " Write 2.5, not 2,5." if isinstance(value, list) and len(value) == 2 * (count or -1) else ""
        raise InputError(f"{what} {has}.", f"Give {count} numbers.{commas}" if count else "Give a list.")
    return value


def _numbers(values: Any, what: str, count: int) -> list[Fraction]:
    return [written_numbers.finite(value, f"a number of {what}") for value in listed(values, what, count)]


def columns(document: Mapping[str, Any], convention: Convention) -> ColumnTable:
    """The columns of a document, of a text table or of JSON.

    Raises InputError for incomplete columns, Euler angles without a sequence, and an unreadable cell, by its line and
    column.
    """
    table = _of_table(document, convention) if "header" in document else _of_lists(document, convention)
    if not table.values:
        what = "column" if "header" in document else "key, such as states,"
        raise InputError(f"No {what} describes the motion.", REMEDY)
    if "euler" in table.values and not convention.sequence:
        raise InputError("The Euler angles have no sequence.", 'Give sequence, such as "ZXZ" or "ZYX".')
    return table


def attitude(document: Mapping[str, Any]) -> str:
    """The name of the columns that are read as a quaternion."""
    places = document["header"].places if "header" in document else {}
    return _words(next((name for name in _TO_QUATERNION if name in places), "quaternion"))


_TO_QUATERNION = {"rodrigues": of_rodrigues, "rotation_vector": of_rotation_vector}


def _of_table(document: Mapping[str, Any], convention: Convention) -> ColumnTable:
    header, cells, lines = document["header"], document["cells"], document["lines"]
    space, last = in_space(document), convention.quaternion_order == "xyzw"
    both = {"omega", "gamma"} <= header.places.keys()
    places: dict[str, list[tuple[str, int]]] = {}
    units: dict[str, Unit] = {}
    for quantity, components in header.places.items():
        try:
            ordered = ordered_places(quantity, components, last, convention.sequence)
        except InputError:
            if both and quantity not in ("omega", "gamma") and len(components) != WIDTHS.get(quantity, 3):
                continue  # columns of some other thing, beside a whole state
            raise
        name = quantity
        if quantity == "framed" or (quantity == "omega" and "framed" not in header.places):
            name = "omega_space" if space else "omega"
        if name in places:
            raise InputError(f"The columns of {name} occur twice.", "Give each quantity once, with its frame.")
        places[name] = ordered
        if quantity in header.units and quantity != "position":  # of which the body decides
            units[name] = header.units[quantity]
    values: dict[str, list[tuple[Fraction, ...] | None]] = {n: [] for n in (*WIDTHS, *_TO_QUATERNION) if n in places}
    prefixes = {"quaternion": "q", "matrix": "R", "position": "", "euler": "euler"}
    named = {name: [(f"{prefixes.get(name, name)}{part}", place) for part, place in places[name]] for name in values}
    for number, row in zip(lines, cells, strict=True):
        for name in values:
            cells_of = ((row[place], f"Line {number}, column {part}") for part, place in named[name])
            values[name].append(_complete(written_numbers.number(*text) for text in cells_of))
    texts = [row[distance] for row in cells for name in values for _, distance in places[name]]
    for name, unit in units.items():
        values[name] = _times(unit.factor(max(map(len, texts), default=0)), values[name])
    for name in _TO_QUATERNION.keys() & values.keys():
        if "quaternion" in values:
            raise InputError(f"A quaternion and the {_words(name)} both give the attitude.", "Give one of them.")
        quaternions = [row and _TO_QUATERNION[name](row) for row in values.pop(name)]
        values["quaternion"] = [q and ((*q[1:], q[0]) if last else q) for q in quaternions]
    return ColumnTable(values, texts, [f"line {number}" for number in lines])


def _times(factor: Fraction, rows: Sequence[tuple[Fraction, ...] | None]) -> list[tuple[Fraction, ...] | None]:
    return [None if row is None else tuple(factor * value for value in row) for row in rows]


def in_unit_of_body(table: ColumnTable, header: Header | None, convention: Convention, centre: Vector) -> ColumnTable:
    """The table with positions in the unit of the body: that of the header, such as mm, or m.

    It is the one in which the first position is nearer to the distance of the point from the fixed point.
    """
    unit = None if header is None else header.units.get("position")
    rows = table.values.get("position", [])
    first = next((row for row in rows if row is not None), None)
    point = centre if convention.point is None else convention.point
    distance = log10(dot(point, point))
    if unit is None or first is None or distance is None:
        return table

    def off(size: Fraction) -> float:
        apart = [size * value - coordinate for value, coordinate in zip(first, convention.pivot, strict=True)]
        logarithm = log10(dot(apart, apart))
        return inf if logarithm is None else abs(logarithm - distance)

    if off(unit.size) >= off(Fraction(1)):
        return table
    return replace(table, values={**table.values, "position": _times(unit.size, rows)})


def _complete(values: Any) -> tuple[Fraction, ...] | None:
    """The numbers of one sample; None where one is not finite."""
    numbers = tuple(values)
    return None if None in numbers else numbers


def _of_lists(document: Mapping[str, Any], convention: Convention) -> ColumnTable:
    columns: dict[str, tuple[str, list[Any]]] = {}
    space = in_space(document)
    states = document.get("states")
    if states is not None:
        rows = [numbers_of_row(row, 6, f"states[{i}]") for i, row in enumerate(listed(states, "states"))]
        columns["omega_space" if space else "omega"] = "states", [row[:3] for row in rows]
        columns["gamma"] = "states", [row[3:] for row in rows]
    for key, name in _ARRAYS.items():
        if not _is_table(document.get(key), name):
            continue
        if name == "omega" and space:
            name = "omega_space"
        if name in columns:
            raise InputError(f"{key} and {columns[name][0]} both give {name}.", "Give each quantity once.")
        columns[name] = key, [numbers_of_row(row, WIDTHS[name], f"{key}[{i}]") for i, row in enumerate(document[key])]
    counts = {key: len(rows) for key, rows in columns.values()}
    times = document.get("times")
    if isinstance(times, list):
        for key, count in counts.items():
            require_as_many(key, count, len(times))
    values = {}
    for name in WIDTHS:
        if name in columns:
            key, rows = columns[name]
            values[name] = [
                _complete(written_numbers.number(value, f"{key}[{i}][{j}]") for j, value in enumerate(row))
                for i, row in enumerate(rows)
            ]
    texts = [str(value) for _, rows in columns.values() for row in rows for value in row]
    return ColumnTable(values, texts, [f"row {i + 1}" for i in range(max(counts.values(), default=0))])


def _is_table(value: object, name: str) -> bool:
    """Whether a value is a list of rows, one for each time, and not the value at the start."""
    if not isinstance(value, list) or not value or not isinstance(value[0], list):
        return False
    return name != "matrix" or len(value[0]) == WIDTHS["matrix"] or (bool(value[0]) and isinstance(value[0][0], list))


def numbers_of_row(row: Any, width: int, what: str) -> list[Any]:
    """The numbers of one row of any kind of list, as they are: of a matrix, row by row."""
    remedy = f"Give {width} numbers."
    numbers = ordered(row, what, remedy)
    if width == 9 and len(numbers) == 3:
        numbers = [value for part in numbers for value in ordered(part, what, remedy)]
    if len(numbers) != width:
        raise InputError(f"{what} has {plural(len(numbers), 'number')}, not {width}.", remedy)
    return numbers


def start(
    document: Mapping[str, Any], table: ColumnTable, at_start: bool, convention: Convention, free: bool = False
) -> RawStart:
    """The start, from its keys or else from the row t = 0.  free: a body without weight may have no attitude.

    Raises InputError where neither gives Ω and γ or an attitude, and where two keys contradict each other.
    """
    forms: dict[str, tuple[str, list[Fraction], bool]] = {}
    for name in ("quaternion", "matrix", "euler"):
        for key in (f"start_{name}", name):
            value = document.get(key)
            if key == name and _is_direction(value):
                continue
            if value is None or (key == name and _is_table(value, name)):
                continue
            forms[name] = key, *_attitude(value, name, key, convention)
    gamma = document.get("gamma")
    from_row, degrees = False, convention.angles == "degrees"
    first = {name: rows[0] for name, rows in table.values.items()} if at_start else {}
    if len(forms) > 1:
        one, other = (key for key, *_ in list(forms.values())[:2])
        raise InputError(f"{one} and {other} both give the attitude at t = 0.", "Give one of them.")
    if not forms and gamma is None:
        known = next((attitude for attitude in ("quaternion", "matrix", "euler", "gamma") if first.get(attitude)), None)
        if known is None and free and set(table.values) == {"omega"}:
            omega, space = _omega(document, first)
            if not space:
                return RawStart("quaternion", (Fraction(1), Fraction(0), Fraction(0), Fraction(0)), omega, space)
        if known is None:
            raise InputError(
                "The attitude at t = 0 is missing.",
                "Give gamma, start_quaternion, start_matrix or start_euler, or the row t = 0, or --case NAME.",
            )
        from_row, form, values = True, known, list(first[known] or ())
    elif forms:
        form, (_, values, degrees) = next(iter(forms.items()))
    else:
        form, values = "gamma", _numbers(gamma, "gamma", 3)
    if form == "euler" and not convention.sequence:
        raise InputError("start_euler needs a sequence.", 'Give sequence, such as "ZXZ".')
    beside = _numbers(gamma, "gamma", 3) if forms and gamma is not None else None
    omega, space = _omega(document, first)
    return RawStart(
        form, tuple(values), omega, space, None if beside is None else vector(beside, "gamma"), from_row, degrees
    )


def _omega(document: Mapping[str, Any], first: Mapping[str, tuple[Fraction, ...] | None]) -> tuple[Vector, bool]:
    """Ω at t = 0, and whether it is in the axes of space."""
    given = (key for key in ("omega", "omega_space") if document.get(key) is not None)
    rates = [key for key in given if key not in _ARRAYS or not _is_table(document[key], key)]
    if len(rates) > 1:
        raise InputError("omega and omega_space both give Ω at t = 0.", "Give one of them.")
    if rates:
        return vector(_numbers(document[rates[0]], rates[0], 3), rates[0]), rates[0] == "omega_space"
    for name in ("omega", "omega_space"):
        if first.get(name):
            return vector(list(first[name] or ()), name), name == "omega_space"
    plural = " (omegas are the columns of JSON)" if "omegas" in document else ""
    raise InputError(
        "The key omega is missing, and there is no row t = 0.",
        f"Give omega (in body axes) or omega_space at t = 0{plural}, or the row t = 0, or --case NAME.",
    )


def _attitude(value: object, name: str, key: str, convention: Convention) -> tuple[list[Fraction], bool]:
    """The numbers of one attitude, and whether they are angles in degrees, declared or written as 30deg."""
    if isinstance(value, str):
        value = value.replace(",", " ").split()
    values = numbers_of_row(value, WIDTHS[name], key)
    marked = [isinstance(value, str) and value.strip().endswith("deg") for value in values]
    if any(marked) and (name != "euler" or not all(marked)):
        raise InputError(f"{key} = {quoted(value)} mixes units.", "Give deg with every angle, or with none.")
    with prefixed(key):
        part = [exact(value.strip().removesuffix("deg") if isinstance(value, str) else value) for value in values]
    return part, name == "euler" and (any(marked) or convention.angles == "degrees")


def times(document: Mapping[str, Any]) -> list[Fraction]:
    """The column t of a text table; raises InputError that names the line of what is not a finite number."""
    header, rows = document["header"], zip(document["lines"], document["cells"], strict=True)
    size = header.units["t"].size if "t" in header.units else 1
    return [size * written_numbers.finite(row[header.time], f"Line {number}, column t") for number, row in rows]
