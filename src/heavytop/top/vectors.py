"""Vectors of three exact numbers, and their products over any ring."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from fractions import Fraction
from itertools import islice
from math import isqrt
from typing import Any

from heavytop.errors import HeavyTopError, InputError, quoted
from heavytop.precision import exact

Vector = tuple[Fraction, Fraction, Fraction]
MOST_MEMBERS = 10_000_000
"""Members of a list; a generator may have no end."""


def vector(values: Iterable[Any], what: str) -> Vector:
    """Three exact rationals out of anything :func:`heavytop.precision.exact` reads; raises InputError otherwise."""
    parts = ordered(values, what, "Give three numbers, one for each principal axis: x,y,z.")
    if len(parts) != 3:
        raise InputError(f"{what} has {len(parts)} numbers.", "Give three, one for each principal axis: x,y,z.")
    try:
        first, second, third = (exact(part) for part in parts)
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None
    return first, second, third


def ordered(values: Any, what: str, remedy: str) -> list[Any]:
    """The members of a list, a tuple, an array or another iterable with an order of its own.

    Raises InputError for text, whose characters are no list of numbers, for sets and mappings, and for what is none.
    """
    if not isinstance(values, str | bytes | bytearray | Set | Mapping):
        try:
            found = list(islice(values, MOST_MEMBERS + 1))
            if len(found) > MOST_MEMBERS:
                raise InputError(f"{what} has more than {MOST_MEMBERS} members.", remedy)
            return found
        except HeavyTopError:
            raise
        except Exception:  # what is no iterable, an array without dimensions, a generator that fails
            pass
    raise InputError(f"{what} = {quoted(values)} is not a list.", remedy)


def dot(a: Any, b: Any) -> Any:
    """a · b over any ring."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Any, b: Any) -> tuple[Any, Any, Any]:
    """a × b over any ring."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def rational_root(square: Fraction) -> Fraction | None:
    """The root of the square of a rational number; None for any other number."""
    if square < 0:
        return None
    root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
    return root if root * root == square else None
