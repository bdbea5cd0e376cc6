"""Arrays of quaternions, matrices, Euler angles, positions and Ω in any axes, checked for :func:`heavytop.score`."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from heavytop.api import arguments
from heavytop.api.arguments import Numbers
from heavytop.errors import InputError, quoted
from heavytop.measure.conventions import WIDTHS, Convention
from heavytop.precision import Precision
from heavytop.suite.given import Given
from heavytop.suite.observed_given import of_observed_arrays, require_system
from heavytop.suite.observed_start import raw_start
from heavytop.top.attitude import Attitude
from heavytop.top.bodies import Body
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State, ordered, vector

_BODY = "Give heavytop.HeavyTop(inertia, weight, centre) or heavytop.Body(...), and heavytop.State(...)."
_SHAPES = {"quaternion": "(n, 4)", "matrix": "(n, 3, 3)"}


def columns(arrays: Mapping[str, Any], states: list[list[Any]] | None) -> dict[str, list[list[Any]]]:
    """The rows of every array that is given, in the order in which they are scored; ``states`` are Ω and γ.

    Raises InputError for another shape, and for what is given twice.
    """
    found = {name: _rows(values, name) for name, values in arrays.items() if values is not None}
    if states is not None:
        for name, part in (("omega", slice(0, 3)), ("gamma", slice(3, 6))):
            if name in found:
                raise InputError(f"states and {name} both give it.", "Give either of them.")
            found[name] = [row[part] for row in states]
    if not found:
        raise InputError("There is nothing to score.", "Give states, quaternions, positions or another array.")
    return {name: found[name] for name in WIDTHS if name in found}


def _rows(values: Any, name: str) -> list[list[Any]]:
    remedy = f"Give an array of shape {_SHAPES.get(name, '(n, 3)')}."
    found = []
    for i, row in enumerate(ordered(values, name, remedy)):
        numbers = ordered(row, f"{name}[{i}]", remedy)
        if name == "matrix" and len(numbers) == 3:
            numbers = [value for part in numbers for value in ordered(part, f"{name}[{i}]", remedy)]
        if len(numbers) != WIDTHS[name]:
            raise InputError(f"{name}[{i}] has {len(numbers)} numbers, not {WIDTHS[name]}.", remedy)
        found.append(numbers)
    return found


def is_plain(top: object, start: object, arrays: Mapping[str, Any], states: bool) -> bool:
    """Whether these are Ω and γ of a top in principal axes alone."""
    return states and set(arrays) == {"omega", "gamma"} and isinstance(top, HeavyTop) and _attitude(start) is None


def _attitude(start: object) -> Attitude | None:
    return start.attitude if isinstance(start, State) else None


def convention(
    order: str,
    quaternion: str,
    matrix: str,
    sequence: str,
    angles: str,
    up: str,
    pivot: Numbers,
    point: Numbers | None,
) -> Convention:
    """The conventions of the arrays; raises InputError for a word that is not known."""
    words = {"quaternion_order": order, "quaternion": quaternion, "matrix": matrix, "angles": angles, "up": up}
    for name, word in {**words, "sequence": sequence}.items():
        if not isinstance(word, str):
            raise InputError(f"{name} = {quoted(word)} is not text.", "Give a str.")
    where = None if point is None else vector(point, "point")
    return Convention(**words, sequence=sequence.upper(), pivot=vector(pivot, "pivot"), point=where)


def observed_arrays(
    top: object,
    start: object,
    system: System,
    said: Convention,
    times: list[Fraction],
    arrays: Mapping[str, list[list[Any]]],
    form: Precision | None,
    names: tuple[str, str],
    normalize: bool,
) -> Given:
    """The trajectory of these arrays.  Raises InputError for what is no body and no start, and as the reading does."""
    if not isinstance(top, HeavyTop | Body):
        raise InputError(f"top = {quoted(top)} is no body.", _BODY)
    if not isinstance(start, State):
        raise InputError(f"start = {quoted(start)} is not a State.", _BODY)
    if "euler" in arrays and not said.sequence:
        raise InputError("Euler angles need their sequence.", 'Give sequence, such as "ZXZ" or "ZYX".')
    require_system(system)
    flag = bool(arguments.flag(normalize, "normalize"))
    return of_observed_arrays(top, raw_start(start), said, times, arrays, form, names, flag)
