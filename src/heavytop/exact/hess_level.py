"""The exact data of a motion of Hess' top: the conditions of the class, and the cubic of the height.

Notation and formulas: :mod:`heavytop.exact.hess`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb, fmpq_poly

from heavytop.exact.balls import Undecided, ball, midpoint
from heavytop.exact.gaps import MOST_TERMS, Gap, Roots
from heavytop.exact.reduced import polynomial
from heavytop.exact.scales import exponent, unit_of_time
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State, dot


@dataclass(frozen=True, slots=True)
class Level:
    """The exact data with I2 = 1, Ω and γ in units of ``rate`` and ``size``; moment: n in these units."""

    rate: Fraction
    size: Fraction
    inertia: tuple[Fraction, Fraction, Fraction]
    moment: tuple[Fraction, Fraction, Fraction]
    omega: tuple[Fraction, Fraction, Fraction]
    gamma: tuple[Fraction, Fraction, Fraction]

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> Level:
        """In units of ordinary size."""
        rate = Fraction(2) ** unit_of_time(HEAVY_TOP.parameters(top, start), start.flat)
        size = Fraction(2) ** exponent(max(map(abs, start.gamma)))
        i1, i2, i3 = top.inertia
        n1, n2, n3 = (n * size / (i2 * rate**2) for n in top.moment)
        w1, w2, w3 = (w / rate for w in start.omega)
        g1, g2, g3 = (g / size for g in start.gamma)
        return cls(rate, size, (i1 / i2, Fraction(1), i3 / i2), (n1, n2, n3), (w1, w2, w3), (g1, g2, g3))

    @property
    def angular_momentum(self) -> tuple[Fraction, ...]:
        """M."""
        return tuple(i * w for i, w in zip(self.inertia, self.omega, strict=True))

    @property
    def area(self) -> Fraction:
        """C0."""
        return Fraction(dot(self.angular_momentum, self.gamma))

    @property
    def height(self) -> Fraction:
        """s."""
        return Fraction(dot(self.moment, self.gamma))

    @property
    def energy(self) -> Fraction:
        """E."""
        return Fraction(dot(self.omega, self.angular_momentum) / 2 + self.height)

    @property
    def moment_square(self) -> Fraction:
        """N²."""
        return Fraction(dot(self.moment, self.moment))

    @property
    def skew(self) -> Fraction:
        """β."""
        return self.moment[0] * self.moment[2] * (1 / self.inertia[0] - 1 / self.inertia[2]) / self.moment_square

    def cubic(self) -> fmpq_poly:
        """s'² as a polynomial of s."""
        zero, one, square = Fraction(0), Fraction(1), self.moment_square
        limit = polynomial(square * dot(self.gamma, self.gamma), zero, -one)
        return 2 * polynomial(self.energy, -one) * limit - polynomial(self.area**2 * square)

    def gap(self, most: int = MOST_TERMS) -> Gap:
        """Where s swings, at the working precision; raises OutOfReach, and Undecided where roots are not told apart."""
        low, high, top = self.roots()
        if not low < high < top:
            raise Undecided
        return Gap(low, high, Roots.of(arb(2), [(acb(top), 1)]), count=1, most=most)

    def roots(self) -> list[arb]:
        """The three roots of the cubic, in order."""
        found: Any = self.cubic().complex_roots()
        return sorted((root.real for root, _ in found), key=midpoint)

    def in_plane(self, vector: tuple[Fraction, ...]) -> tuple[arb, arb]:
        """The components along e_x and e_y."""
        a, _, c = self.moment
        return ball(c * vector[0] - a * vector[2]) / ball(self.moment_square).sqrt(), ball(vector[1])
