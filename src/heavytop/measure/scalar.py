"""From balls to the numbers of a report, and from native numbers to balls."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import reduce
from math import isfinite
from typing import Any

from flint import arb

from heavytop.errors import InputError
from heavytop.exact.balls import ball, midpoint, radius, radius_text
from heavytop.precision import decimal_text, exact, log10
from heavytop.records import Metric, MetricKind

DIGITS = 8
UNRESOLVED = "unresolved"
GUARD_BITS = 64
RESOLVED_RADII = 10
_SURELY_RESOLVED = 8
_ZERO = arb(0)
_WIDE = ("longdouble", "real128", "real")


def to_ball(value: Any) -> arb:
    """A native number as a ball of radius 0 (working precision permitting); NaN and infinities, and balls, stay what
    they are.
    """
    if isinstance(value, arb):
        return value
    if isinstance(value, float):
        return arb(float(value))
    if (found := _by_doubles(value)) is not None:
        return found
    try:
        return ball(exact(value))
    except InputError:
        return arb("nan")


def _by_doubles(value: Any) -> arb | None:
    """A wide native float as the sum of doubles, exactly; None for other numbers, and beyond the range of doubles."""
    if type(value).__name__ not in _WIDE:
        return None
    total, left = arb(0), value
    while part := float(left):
        if not isfinite(part):
            return None
        total, left = total + arb(part), left - part
    return total if left == 0 else None


def resolved(value: arb) -> bool:
    """Whether |value| is at least ten times its radius, or exactly 0."""
    # with so many bits right |value| is above 64 radii, whatever the rest of its bits
    if value.rel_accuracy_bits() >= _SURELY_RESOLVED:
        return bool(value.is_finite())
    return bool(value.is_finite()) and abs(midpoint(value)) >= RESOLVED_RADII * radius(value)


def text(value: arb, digits: int = DIGITS) -> str:
    """A ball as report text: decimal, ``nan`` or ``unresolved``."""
    if not value.is_finite():
        return "nan"
    return decimal_text(midpoint(value), digits) if resolved(value) else UNRESOLVED


def metric(value: arb, kind: MetricKind = "error", digits: int = DIGITS) -> Metric:
    """A ball as a metric."""
    words = text(value, digits)
    if words == "nan":
        return Metric(words, None, kind)
    if words == UNRESOLVED:
        return Metric(words, None, kind, radius_text(abs(midpoint(value)) + radius(value)))
    return of_fraction(Fraction(words), kind, words)


def of_fraction(value: Fraction, kind: MetricKind = "error", words: str | None = None) -> Metric:
    """An exact number as a metric; log10 to six decimals."""
    return Metric(words or decimal_text(value, DIGITS), log10(value), kind)


def larger(one: arb, other: arb) -> arb:
    """The ball around the larger value: one of the two where they are apart, which spares FLINT's slower maximum."""
    if one > other:
        return one
    return other if other > one else one.max(other)


def root(value: arb) -> arb:
    """√value of a ball around a number that is not negative, though the ball may reach below 0."""
    return value.sqrt() if value >= 0 else value.abs_upper().sqrt().union(arb(0))


def largest(values: Iterable[arb]) -> arb:
    """The ball around max |value|."""
    return reduce(larger, map(abs, values), _ZERO)
