"""Inverse functions that are one another: asin u + acos u = π/2, atan u + atan 1/u = ± π/2, acos(cos w) = w."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

from heavytop.claims.rational import Quotient

if TYPE_CHECKING:
    from heavytop.claims.algebra import Field

# below π/2 and π
_QUARTER, _HALF = Fraction(3, 2), Fraction(3)
Known = Callable[[str, Quotient], Quotient | None]


def same_as(name: str, u: Quotient, field: Field, known: Known) -> Quotient | None:
    """asin, acos or atan of ``u`` through a function that the field has already, or through the angle in it.

    known: the generator of a function of an argument, None where there is none yet.
    """
    if name not in ("asin", "acos", "atan"):
        return None
    t = field.tower
    angle = _angle_in(name, u, field)
    if angle is not None:
        return angle
    minus = t.product((t.number(-1), u))
    opposite = known(name, minus)
    if opposite is not None:
        return _difference(field, field.enter(sympy.pi) if name == "acos" else t.number(0), opposite)
    quarter = Fraction(1, 2)
    if name == "atan":
        sign = t.sign(u)
        partner = known("atan", t.power(u, -1)) if sign.strict and sign.value else None
        quarter *= sign.value
    else:
        partner = known("acos" if name == "asin" else "asin", u)
    if partner is None:
        return None
    return _difference(field, t.product((t.number(quarter), field.enter(sympy.pi))), partner)


def _difference(field: Field, a: Quotient, b: Quotient) -> Quotient:
    t = field.tower
    return t.sum((a, t.product((t.number(-1), b))))


def _angle_in(name: str, u: Quotient, field: Field) -> Quotient | None:
    """w of acos(cos w), asin(sin w), atan(tan w), where w lies in the range of the inverse function."""
    t = field.tower
    for sine, cosine, angle in _circles(field):
        above, below = {
            "acos": (t.gens[cosine], t.one),
            "asin": (t.gens[sine], t.one),
            "atan": (t.gens[sine], t.gens[cosine]),
        }[name]
        if t.reduce(t.times(u.numerator, below)) == t.reduce(t.times(above, u.denominator)):
            inside = is_between(field, angle, Fraction(0), _HALF) if name == "acos" else is_below_quarter(field, angle)
            return angle if inside else None
    return None


def _circles(field: Field) -> Iterator[tuple[int, int, Quotient]]:
    """(sine, cosine, angle) of the field."""
    for sine, cosine in field.tower.signs.circles.items():
        arguments = field.tower.generators[sine].arguments
        if arguments:
            yield sine, cosine, arguments[0]


def is_below_quarter(field: Field, angle: Quotient) -> bool:
    """|angle| ≤ 3/2, so that its cosine is > 0."""
    return is_between(field, angle, -_QUARTER, _QUARTER)


def is_between(field: Field, angle: Quotient, low: Fraction, high: Fraction) -> bool:
    """low ≤ angle ≤ high all over the domain, shown."""
    t = field.tower
    up = _difference(field, angle, t.number(low))
    down = _difference(field, t.number(high), angle)
    return t.sign(up).value > 0 and t.sign(down).value > 0
