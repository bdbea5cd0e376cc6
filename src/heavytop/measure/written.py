"""How many digits the states are written with, read off the numbers themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from heavytop.precision import Precision, decimal_text, round_to

_SPARE = 3
"""Digits that the format must have beyond those written, or nothing was rounded."""
_LEAST = 12
"""Numbers that must agree."""
_SINGLE = 24
_EXPLAINS = 1.5
"""An error is that of rounding if it is at most so many times the largest rounding."""


@dataclass(frozen=True, slots=True)
class Rounding:
    """What all states are rounded to.

    kind: "significant" digits, "decimals" after the point, or "single" precision.  digits: how many, 24 bits for the
    last.  error: the largest rounding of a component, relative to max(1, |value|).
    """

    kind: str
    digits: int
    error: float


def rounding(states: Sequence[Sequence[Fraction]], precision: Precision) -> Rounding | None:
    """The coarsest rounding that all numbers have; None where they are written in full, or too few to tell."""
    numbers = [value for state in states for value in state if value]
    if len(numbers) < _LEAST:
        return None
    return min(_all(numbers, precision), key=lambda each: -each.error, default=None)


def explains(found: Rounding, error: float) -> bool:
    """Whether the rounding is all there is to an error, relative to max(1, |value|)."""
    return error <= _EXPLAINS * found.error


def _all(numbers: Sequence[Fraction], precision: Precision) -> Iterator[Rounding]:
    most = precision.digits - _SPARE
    for digits in range(1, most):
        unit = Fraction(1, 10**digits)
        if all(round_to(round(value / unit) * unit, precision.bits) == value for value in numbers):
            yield Rounding("decimals", digits, 0.5 * 10.0**-digits)
            break
    for digits in range(1, most):
        if all(round_to(Fraction(decimal_text(value, digits)), precision.bits) == value for value in numbers):
            worst = max(abs(value) / max(Fraction(1), abs(value)) for value in numbers)
            yield Rounding("significant", digits, float(worst) * 0.5 * 10.0 ** (1 - digits))
            break
    if precision.bits > _SINGLE and all(round_to(value, _SINGLE) == value for value in numbers):
        worst = max(abs(value) / max(Fraction(1), abs(value)) for value in numbers)
        yield Rounding("single", _SINGLE, float(worst) * 2.0**-_SINGLE)
