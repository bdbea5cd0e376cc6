"""The derivatives of a vector field with respect to the data that enter it, from the field itself.

A field of :mod:`heavytop.top.equations` is evaluated over numbers a + b ε with ε² = 0: the coefficient of ε is its
derivative, exactly.  No derivative is written down a second time.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.exact.quadratic import Quadratic, quadratic
from heavytop.top.equations import Parameters, System

DATA = ("I1", "I2", "I3", "n1", "n2", "n3")
"""The data that motions are differentiated with respect to: principal moments, and n = P r."""


@dataclass(frozen=True, slots=True)
class Dual:
    """value + slope ε with ε² = 0, over exact numbers."""

    value: Any
    slope: Any = 0

    @classmethod
    def of(cls, number: Any) -> Dual:
        """A number, as one without slope."""
        return number if isinstance(number, Dual) else cls(number)

    def __add__(self, other: Any) -> Dual:
        b = Dual.of(other)
        return Dual(self.value + b.value, self.slope + b.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> Dual:
        return self + -Dual.of(other)

    def __rsub__(self, other: Any) -> Dual:
        return Dual.of(other) + -self

    def __mul__(self, other: Any) -> Dual:
        b = Dual.of(other)
        return Dual(self.value * b.value, self.slope * b.value + self.value * b.slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        b = Dual.of(other)
        return Dual(self.value / b.value, (self.slope * b.value - self.value * b.slope) / (b.value * b.value))

    def __rtruediv__(self, other: Any) -> Dual:
        return Dual.of(other) / self


def moved(p: Parameters, datum: int, by: Any) -> Parameters:
    """The parameters with ``by`` added to one of :data:`DATA`."""
    numbers = [*p.inertia, *p.moment]
    numbers[datum] = numbers[datum] + by
    return p._replace(inertia=tuple(numbers[:3]), moment=tuple(numbers[3:]))


def quotient(system: System, p: Parameters, datum: int, by: Fraction, over: Fraction) -> Quadratic:
    """(f(θ + by) − f(θ))/over for one of :data:`DATA`."""
    varied = moved(p, datum, by)

    def field(y: tuple[Any, ...]) -> list[Any]:
        pairs = zip(system.field(varied, y), system.field(p, y), strict=True)
        return [(a - b) / over for a, b in pairs]

    return quadratic(field, 6)


def difference(system: System, p: Parameters, datum: int, by: Fraction, over: Fraction, factor: Fraction) -> Quadratic:
    """``factor`` ∂f/∂θ − (f(θ + by) − f(θ))/over: what a quotient lacks."""
    varied, slope = moved(p, datum, by), moved(p, datum, Dual(Fraction(0), factor))

    def field(y: tuple[Any, ...]) -> list[Any]:
        rates = zip(system.field(varied, y), system.field(p, y), system.field(slope, y), strict=True)
        return [Dual.of(exact).slope - (a - b) / over for a, b, exact in rates]

    return quadratic(field, 6)
