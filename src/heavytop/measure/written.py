"""How many digits the states are written with, read off the numbers themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from sys import float_info

import numpy
from numpy.typing import NDArray

from heavytop.precision import Precision, decimal_text, round_to

_SPARE = 3
"""Digits that the format must have beyond those written, or nothing was rounded."""
_LEAST = 12
"""Numbers that must agree."""
_SINGLE = 24
EXPLAINS = 1.5
"""An error is that of rounding if it is at most so many times the largest rounding, ..."""
_PART = 0.01
"""... and at least that part of it: of a short number that is right nothing was rounded."""


@dataclass(frozen=True, slots=True)
class Rounding:
    """What all states are rounded to.

    kind: "significant" digits, "decimals" after the point, or "single" precision.  digits: how many, 24 bits for the
    last.  error: the largest rounding of a component, relative to max(1, |value|).
    """

    kind: str
    digits: int
    error: float

    def spacing(self, values: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
        """Between neighbours of each value among the numbers that are so rounded."""
        if self.kind == "decimals":
            return numpy.full_like(values, 10.0**-self.digits)
        base = 2.0 if self.kind == "single" else 10.0
        size = numpy.maximum(numpy.abs(values), float_info.min)
        return numpy.where(values == 0, 0.0, base ** (numpy.floor(numpy.log(size) / numpy.log(base)) + 1 - self.digits))


def rounding(states: Sequence[Sequence[Fraction]], precision: Precision, least: int = _LEAST) -> Rounding | None:
    """The coarsest rounding that all numbers have; None where they are written in full, or fewer than ``least``."""
    numbers = [value for state in states for value in state if value]
    if len(numbers) < least:
        return None
    return min(_all(numbers, precision), key=lambda each: -each.error, default=None)


def explains(found: Rounding, error: float) -> bool:
    """Whether an error, relative to max(1, |value|), is of the size that the rounding makes it."""
    return _PART * found.error <= error <= EXPLAINS * found.error


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
