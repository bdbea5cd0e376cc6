"""Arrays of doubles with proven bounds of their errors, for many samples at once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy
from flint import arb
from numpy.typing import NDArray

ROUNDING = 2.0**-52
_ROOM, _UNDERFLOW = 1 + 2.0**-48, 1e-300


@dataclass(frozen=True, slots=True)
class BoundedDoubles:
    """Values, and bounds of their absolute errors: a ring, so that vector fields are evaluated for many states.

    Each bound has room for the rounding of its own evaluation, and for underflow.
    """

    value: NDArray[numpy.float64]
    error: NDArray[numpy.float64]

    @classmethod
    def of(cls, rows: Sequence[Sequence[arb]]) -> BoundedDoubles:
        """The transpose of rows of balls; exact where a ball is 0."""
        value = numpy.array([[float(ball) for ball in row] for row in rows])
        radii = numpy.array([[float(ball.rad()) for ball in row] for row in rows])
        exact = (value == 0) & (radii == 0)
        for row, column in zip(*numpy.nonzero(exact), strict=True):
            exact[row, column] = rows[row][column].is_zero()
        return _rounded(value.T, radii.T, numpy.where(exact.T, 0.0, _UNDERFLOW))

    def __getitem__(self, index: Any) -> BoundedDoubles:
        return BoundedDoubles(self.value[index], self.error[index])

    def __add__(self, other: BoundedDoubles) -> BoundedDoubles:
        return _rounded(self.value + other.value, self.error + other.error)

    def __sub__(self, other: BoundedDoubles) -> BoundedDoubles:
        return _rounded(self.value - other.value, self.error + other.error)

    def __mul__(self, other: BoundedDoubles) -> BoundedDoubles:
        largest = abs(self.value) + self.error
        return _rounded(self.value * other.value, largest * other.error + abs(other.value) * self.error)

    def __truediv__(self, other: BoundedDoubles) -> BoundedDoubles:
        ratio, smallest = self.value / other.value, abs(other.value) - other.error * _ROOM
        error = (self.error + abs(ratio) * other.error) / numpy.where(smallest > 0, smallest, 0.0)
        return _rounded(ratio, error)

    def squared(self) -> BoundedDoubles:
        """The squares: exactly 0 of exactly 0."""
        square = self * self
        return BoundedDoubles(square.value, numpy.where((self.value == 0) & (self.error == 0), 0.0, square.error))

    def certainly_below(self, bound: float) -> NDArray[numpy.bool_]:
        """Mask of exact values below ``bound``, up to the rounding of that."""
        return numpy.asarray(self.value + self.error < bound / _ROOM)

    @numpy.errstate(all="ignore")
    def candidates_for_maximum(self) -> list[int]:
        """Indices of the values that may be the largest."""
        return numpy.flatnonzero(self.value + self.error >= (self.value - self.error).max()).tolist()

    @numpy.errstate(all="ignore")
    def total(self) -> arb:
        """A ball around the sum of values that are not negative."""
        try:
            total, error = math.fsum(self.value), math.fsum(self.error)
        except OverflowError:  # the sum of finite values is beyond a double
            return arb("nan")
        return arb(total, (error + ROUNDING * total) * _ROOM)


def _rounded(value: Any, error: Any, underflow: Any = _UNDERFLOW) -> BoundedDoubles:
    return BoundedDoubles(value, (error + (ROUNDING * abs(value) + underflow)) * _ROOM)


def pointwise_maximum(parts: Sequence[BoundedDoubles]) -> BoundedDoubles:
    """The largest of several arrays, index by index."""
    values, errors = [part.value for part in parts], [part.error for part in parts]
    return BoundedDoubles(reduce(numpy.maximum, values), reduce(numpy.maximum, errors))


def pointwise_sum(parts: Iterable[BoundedDoubles]) -> BoundedDoubles:
    """The sum of several arrays, index by index."""
    return reduce(BoundedDoubles.__add__, parts)
