"""Arrays of double-doubles as a ring, so that first integrals written once are evaluated for many motions at once.

Relative errors of a few 2^-104 an operation (Dekker 1971; Joldes, Muller, Popescu 2017), while no product of two
words leaves the normal range: |values| from 1e-140 to 1e140.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy
from numpy.typing import NDArray

Doubles = NDArray[numpy.float64]

_SPLIT = 134217729.0
"""2^27 + 1, of Dekker's splitting."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """high + low, arrays of one shape with |low| <= ulp(high)/2."""

    high: NDArray[numpy.float64]
    low: NDArray[numpy.float64]

    @classmethod
    def of(cls, value: Pairs | Doubles | float) -> Pairs:
        """An array or a number that doubles hold."""
        if isinstance(value, Pairs):
            return value
        high = numpy.asarray(value, float)
        return cls(high, numpy.zeros_like(high))

    @classmethod
    def nearest(cls, values: Any) -> Pairs:
        """The nearest pairs to nested lists of exact numbers."""
        numbers = numpy.array(values, object)
        high = numbers.astype(float)
        return cls(high, (numbers - numpy.vectorize(Fraction, [object])(high)).astype(float))

    def __add__(self, other: Pairs | Doubles | float) -> Pairs:
        addend = Pairs.of(other)
        total, error = _two_sum(self.high, addend.high)
        low, low_error = _two_sum(self.low, addend.low)
        total, error = _quick(total, error + low)
        return type(self)(*_quick(total, error + low_error))

    __radd__ = __add__

    def __neg__(self) -> Pairs:
        return type(self)(-self.high, -self.low)

    def __sub__(self, other: Pairs | Doubles | float) -> Pairs:
        return self.__add__(-Pairs.of(other))

    def __rsub__(self, other: Pairs | Doubles | float) -> Pairs:
        opposite = -self
        return opposite.__add__(other)

    def __mul__(self, other: Pairs | Doubles | float) -> Pairs:
        factor = Pairs.of(other)
        product, error = _two_product(self.high, factor.high)
        return type(self)(*_quick(product, error + (self.high * factor.low + self.low * factor.high)))

    __rmul__ = __mul__

    def __truediv__(self, other: Pairs | Doubles | float) -> Pairs:
        divisor = Pairs.of(other)
        first = self.high / divisor.high
        remainder = self - divisor * first
        second = remainder.high / divisor.high
        third = (remainder - divisor * second).high / divisor.high
        leading = Pairs(*_quick(*_two_sum(first, second)))
        return leading.__add__(third)

    def __getitem__(self, where: Any) -> Pairs:
        return type(self)(self.high[where], self.low[where])

    def __abs__(self) -> Pairs:
        sign = numpy.where(self.high < 0, -1.0, 1.0)
        return Pairs(sign * self.high, sign * self.low)


class Numerators(Pairs):
    """Pairs whose quotients have three words each, as constants of the machine code have: (3, ...).

    The words are right to some 2^-150 where divisor and dividend are sums of few doubles.
    """

    __slots__ = ()

    def __truediv__(self, other: Any) -> Any:
        words, remainder = [], self
        for _ in range(3):
            words.append(remainder.high / other.high)
            remainder = remainder.__sub__(other * words[-1])  # type: ignore[assignment]
        return numpy.array(words)


def _two_sum(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _quick(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    total = a + b
    return total, b - (total - a)


def _halves(a: Doubles) -> tuple[Doubles, Doubles]:
    product = _SPLIT * a
    high = product - (product - a)
    return high, a - high


def _two_product(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    product = a * b
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2
