"""Trajectories that another program wrote, as JSON or CSV, read exactly and with suspicion."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import re
import sys
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import (
    DOUBLE,
    EXTENDED,
    QUAD,
    Precision,
    decimal_text,
    exact,
    number,
    parse,
    real,
    round_to,
    shown,
)
from heavytop.suite.files import read_whole, without_repeats
from heavytop.top.equations import VARIABLES, System, system
from heavytop.top.heavy_top import HeavyTop, State, dot, require_physical
from heavytop.top.times import check_times

_REMEDY = "docs/score.md shows both forms of the file."
_HEX = re.compile(r"([+-]?)0[xX](?=\.?[0-9a-fA-F])([0-9a-fA-F]*)\.?([0-9a-fA-F]*)(?:[pP]([+-]?[0-9]{1,6}))?")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_COLUMNS = ("t", *VARIABLES)
_VECTORS = ("inertia", "centre", "omega", "gamma")
_FLAGS = ("language", "tolerance", "step")
_KEYS = {*_VECTORS, *_FLAGS, "weight", "system", "times", "states", "precision", "bits", "name", "integrator"}
_KEYS |= {"outcome", "steps"}
_NOT_READ = {"time_reached", "order", "flags", "seconds", "metrics", "attitude", "angles"}
"""What else `heavytop propagate --json` writes."""
_LIKE = 0.75
"""A key is a misspelling of another if so large a part of them is alike."""
_ODD_GAMMA = Fraction(1, 10)
"""A state whose |γ|² is off 1 by more is no rounding, and seldom a method."""
_NAME = 200
_MOST = 100_000
_WIDEST = 20_000
"""Exponents of 2 in a file, up to that: quad has 16,384, and powers of what is larger take minutes."""
_FITS_ANYWHERE = 1 << 1023
"""Every format holds numbers below that."""
_SLACK = 8
"""γ may be off the unit sphere by so many bits of rounding."""


@dataclass(frozen=True, slots=True)
class Given:
    """A trajectory as it was given.

    times: exact, as written.  states: six exact numbers each, rounded to the format; None for a state that is not
    finite.  name, integrator: as the row will call them.  flags: what else the file says.  sha256: of the file.
    """

    name: str
    integrator: str
    top: HeavyTop
    start: State
    system: System
    precision: Precision
    times: list[Fraction]
    states: list[tuple[Fraction, ...] | None]
    outcome: Outcome
    steps: int
    flags: dict[str, str]
    sha256: str

    def warnings(self) -> list[str]:
        """What no rigid body can have, and a γ so far off the unit sphere that the columns may be in another order."""
        found = self.top.warnings()
        for time, state in zip(self.times, self.states, strict=True):
            if state is not None and abs(off := dot(state[3:], state[3:]) - 1) > _ODD_GAMMA:
                found.append(
                    f"|gamma|^2 is off 1 by {decimal_text(off, 3)} at t = {shown(time)}: "
                    f"are the states in the order {' '.join(VARIABLES)}?"
                )
                break
        return found


def read(path: Path) -> Given:
    """The trajectory in a ``.json`` or ``.csv`` file, or ``-`` for either on standard input.

    Raises InputError for a file that cannot be read or is neither, for a key or column that is missing or unknown, a
    number that is none, times out of order, states of another shape or count, and data that no heavy top has.
    """
    shown_path = str(path)[:_NAME]
    piped = str(path) == "-"
    if not piped and path.exists() and not path.is_dir() and path.suffix.lower() not in (".json", ".csv"):
        raise InputError(f"{shown_path} is neither .json nor .csv.", _REMEDY)
    try:
        content = sys.stdin.buffer.read() if piped else read_whole(path)
        text = content.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"The trajectory {shown_path} cannot be read: {error}.", _REMEDY) from None
    suffix = (".json" if text.lstrip().startswith("{") else ".csv") if piped else path.suffix.lower()
    try:
        document = _json(text) if suffix == ".json" else _csv(text)
        return _given(document, "given" if piped else path.stem, hashlib.sha256(content).hexdigest())
    except InputError as error:
        raise InputError(f"{shown_path}: {error.cause}", error.remedy or _REMEDY) from None


def _json(text: str) -> dict[str, Any]:
    """The document, every number as the text it is written as."""
    try:
        document = json.loads(
            text, parse_float=str, parse_int=str, parse_constant=str, object_pairs_hook=without_repeats
        )
    except (ValueError, RecursionError) as error:
        raise InputError(f"This is not JSON: {error}.", _REMEDY) from None
    if not isinstance(document, dict):
        raise InputError("The document is not an object.", _REMEDY)
    for key in document.keys() - _KEYS - _NOT_READ:
        raise _unknown(key)
    return document


def _nearest(key: str) -> str:
    """The known key that an unknown one is a misspelling of, or nothing."""
    return next(iter(get_close_matches(key.lower(), sorted(_KEYS), 1, _LIKE)), "")


def _unknown(key: str) -> InputError:
    near = _nearest(key)
    return InputError(f"Unknown key {key[:60]!r}.", f"Did you mean {near}?" if near else _REMEDY)


def _csv(text: str) -> dict[str, Any]:
    """The comment lines ``# key: value`` and the columns, as the JSON document would hold them."""
    lines = text.splitlines()
    document: dict[str, Any] = {}
    for line in lines:
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            key, value = key.strip(), value.strip()
            # other comments may say what they like
            if value and key not in _KEYS and _nearest(key):
                raise _unknown(key)
            if key in _KEYS and key in document:
                raise InputError(f"The key {key} stands twice.", "Give each key once.")
            document[key] = [part.strip() for part in value.split(",")] if key in _VECTORS else value
    body = [line for line in lines if line.strip() and not line.startswith("#")]
    try:
        rows = list(csv.reader(body))
    except csv.Error as error:
        raise InputError(f"This is not CSV: {error}.", _REMEDY) from None
    if not rows or tuple(name.strip() for name in rows[0]) != _COLUMNS:
        raise InputError(f"The first line is not {','.join(_COLUMNS)}.", _REMEDY)
    for index, row in enumerate(rows[1:], 1):
        if len(row) != len(_COLUMNS):
            raise InputError(f"Row {index} has {len(row)} columns, not {len(_COLUMNS)}.", _REMEDY)
    return document | {"times": [row[0] for row in rows[1:]], "states": [row[1:] for row in rows[1:]]}


def _given(document: dict[str, Any], stem: str, sha256: str) -> Given:
    vectors = {key: _list(document, key, 3) for key in _VECTORS}
    top = HeavyTop(vectors["inertia"], _text(document, "weight"), vectors["centre"])
    start = State(vectors["omega"], vectors["gamma"])
    require_physical(top, start)
    which = system(_text(document, "system", "heavy_top"))
    which.parameters(top, start)
    times = check_times([_finite(value, "a time") for value in _list(document, "times")])
    rows = _list(document, "states")
    _require_states(times, rows)
    texts = [_list({"state": row}, "state", 6) for row in rows]
    precision = _precision(document, texts)
    start.require_unit_gamma(2**_SLACK * precision.eps, "Give it in full.")
    states = [_state([_number(value, "a component of a state") for value in row], precision) for row in texts]
    word = _text(document, "outcome", "success")
    if word not in [outcome.value for outcome in Outcome]:
        raise InputError(f"Unknown outcome {word[:60]!r}.", f"Use {', '.join(outcome.value for outcome in Outcome)}.")
    steps = _integer(document.get("steps", "0"), "steps")
    return Given(
        _name(_text(document, "name", stem), "name"),
        _name(_text(document, "integrator", "given"), "integrator"),
        top,
        start,
        which,
        precision,
        times,
        states,
        Outcome.NON_FINITE if None in states else Outcome(word),
        steps,
        {key: _name(_text(document, key), key) for key in _FLAGS if key in document},
        sha256,
    )


def of_arrays(
    top: HeavyTop,
    start: State,
    which: System,
    times: list[Fraction],
    rows: list[list[Any]],
    precision: Precision | None,
    name: str,
    integrator: str,
) -> Given:
    """A trajectory from memory: exact times, and states of six numbers each in any format or as text.

    precision: None for the narrowest format that holds every number as it is given.
    Raises InputError for what is no number, and as :func:`read` for times, counts and names.
    """
    _require_states(times, rows)
    form = precision or _of_bits(max(_bits_of(value) for row in rows for value in row))
    states = [_state([_component(value) for value in row], form) for row in rows]
    outcome = Outcome.NON_FINITE if None in states else Outcome.SUCCESS
    named = _name(name, "name"), _name(integrator, "integrator")
    return Given(*named, top, start, which, form, times, states, outcome, 0, {}, "")


def _require_states(times: list[Fraction], rows: list[Any]) -> None:
    """Raises InputError unless there are as many states as times, and not too many."""
    if len(rows) != len(times):
        raise InputError(f"There are {len(times)} times and {len(rows)} states.", "Give one state for each time.")
    if len(times) > _MOST:
        raise InputError(f"{len(times)} states are too many to score.", f"Give at most {_MOST} of them.")


def _component(value: Any) -> Fraction | None:
    """An exact number out of a number of any format or text; None for NaN and infinities."""
    if isinstance(value, str):
        return _number(value, "a component of a state")
    try:
        return exact(value)
    except InputError:
        if isinstance(value, float | Decimal | numpy.floating) or type(value).__name__ in ("real", "real128", "mpf"):
            return None
        raise


def _bits_of(value: Any) -> int:
    """Bits of the format of a number in memory; of exact numbers, those that they are written with."""
    kind = type(value).__name__
    if kind in ("real128", "longdouble", "real"):
        return {"real128": QUAD.bits, "longdouble": EXTENDED.bits}.get(kind) or int(value.prec)
    exactly = isinstance(value, str | int | Fraction | Decimal) and not isinstance(value, bool)
    return _bits(str(value)) if exactly else DOUBLE.bits


def _list(document: dict[str, Any], key: str, count: int | None = None) -> list[Any]:
    value = document.get(key)
    if value is None:
        raise InputError(f"The key {key} is missing.", _REMEDY)
    if not isinstance(value, list) or (count is not None and len(value) != count):
        what = f"has {len(value)} numbers" if isinstance(value, list) else "is not a list"
        raise InputError(f"{key} {what}.", f"Give {count} numbers." if count else "Give a list.")
    return value


def _text(document: dict[str, Any], key: str, default: str | None = None) -> str:
    value = document.get(key, default)
    if value is None:
        raise InputError(f"The key {key} is missing.", _REMEDY)
    if not isinstance(value, str):
        raise InputError(f"{key} is a {type(value).__name__}.", "Give text or a number.")
    return value


def _name(text: str, what: str) -> str:
    if not 0 < len(text) <= _NAME or not text.isprintable():
        raise InputError(
            f"The {what} of {len(text)} characters begins {text[:40]!r}.", f"Use 1 to {_NAME} printable characters."
        )
    return text


def _number(value: Any, what: str) -> Fraction | None:
    """An exact number out of decimal or hexadecimal text; None for NaN and infinities; InputError for anything else."""
    if not isinstance(value, str):
        raise InputError(f"{what} is a {type(value).__name__}, not a number.", _REMEDY)
    text = value.strip()
    if _NOT_FINITE.fullmatch(text):
        return None
    hexadecimal = _HEX.fullmatch(text)
    if hexadecimal is None:
        number = exact(text)
    else:
        sign, whole, part, power = hexadecimal.groups()
        number = Fraction(int(f"{sign}{whole}{part}", 16)) * Fraction(2) ** (int(power or 0) - 4 * len(part))
    if number and abs(number.numerator.bit_length() - number.denominator.bit_length()) > _WIDEST:
        raise InputError(f"{what} is {text[:60]!r}.", f"Sizes go from 2^-{_WIDEST} to 2^{_WIDEST}.")
    return number


def _finite(value: Any, what: str) -> Fraction:
    number = _number(value, what)
    if number is None:
        raise InputError(f"{what} is {value.strip()}.", "Give a finite number.")
    return number


def _integer(value: Any, what: str) -> int:
    number = _finite(value, what)
    if number < 0 or number.denominator != 1 or number >= 1 << 63:
        raise InputError(f"{what} = {shown(number)} is not a count.", "Give an integer from 0 to 2^63 - 1.")
    return int(number)


def _state(values: list[Fraction | None], precision: Precision) -> tuple[Fraction, ...] | None:
    """The numbers rounded to the format; None where one is not finite there, as 1e400 in double."""
    found = tuple(round_to(value, precision.bits) for value in values if value is not None)
    finite = len(found) == len(values) and all(_fits(value, precision) for value in found)
    return found if finite else None


def _fits(value: Fraction, precision: Precision) -> bool:
    if abs(value) < _FITS_ANYWHERE:
        return True
    try:
        number(value, precision)
    except InputError:
        return False
    return True


def _precision(document: dict[str, Any], rows: list[list[Any]]) -> Precision:
    """The format that the file names, or the narrowest that holds every state as it is written."""
    if "precision" in document:
        precision = parse(_text(document, "precision"))
        bits = _integer(document["bits"], "bits") if "bits" in document else precision.bits
        if bits != precision.bits:
            raise InputError(
                f"bits = {bits}, but {precision.name} has {precision.bits}.", "Give either of precision and bits."
            )
        return precision
    if "bits" in document:
        bits = _integer(document["bits"], "bits")
        return next((form for form in (DOUBLE, EXTENDED, QUAD) if bits == form.bits), None) or real(bits)
    return _of_bits(max(_bits(str(value)) for row in rows for value in row))


def _of_bits(bits: int) -> Precision:
    """The narrowest format with as many bits."""
    return next((form for form in (DOUBLE, EXTENDED, QUAD) if bits <= form.bits), None) or real(bits)


def _bits(text: str) -> int:
    """Bits that a number was written from: its own if it is hexadecimal, else as many as its decimal digits name."""
    value = _number(text, "a component of a state")
    if _HEX.fullmatch(text.strip()) and value:
        return (value.numerator // (value.numerator & -value.numerator)).bit_length()
    digits = len(re.sub(r"[eE].*|[^0-9]", "", text).lstrip("0"))
    return next((form.bits for form in (DOUBLE, EXTENDED, QUAD) if digits <= form.digits), 0) or int(
        (digits - 1) / math.log10(2)
    )
