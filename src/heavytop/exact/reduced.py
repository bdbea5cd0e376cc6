"""A top with I1 = I2 and P c = 0, in sizes of about 1 and turned so that its moment of weight is (c, 0, 0).

Divided by I3 the equations hold for n/I3, and for λ = k3/I3 of a rotor along axis 3.  With exact powers of two
Ω = rate Ω', γ = size γ', t = t'/rate they hold for n' = n size/(I3 rate²) and λ' = λ/rate; and a turn about axis 3, the
axis of symmetry, takes n' to (c, 0, 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

from flint import arb, arb_series, fmpq_poly

from heavytop.exact.balls import ball, rational
from heavytop.exact.scales import exponent
from heavytop.top.heavy_top import HeavyTop, State


@dataclass(frozen=True, slots=True)
class Reduced:
    """The exact data of a start in the units of ``rate`` and ``size``; moment: n' on axes 1 and 2; rotor: λ'."""

    rate: Fraction
    size: Fraction
    moment: tuple[Fraction, Fraction]
    omega: tuple[Fraction, Fraction, Fraction]
    gamma: tuple[Fraction, Fraction, Fraction]
    rotor: Fraction

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> Self:
        """From a top with I1 = I2 and P c = 0; a rotor lies along axis 3."""
        i3 = top.inertia[2]
        n1, n2 = (n / i3 for n in top.moment[:2])
        size = _power_of_two(max(map(abs, start.gamma)))
        rotor = top.rotor[2] / i3 if top.rotor else Fraction(0)
        rate = _power_of_two(max(*map(abs, start.omega), abs(rotor), _root_of_two(max(abs(n1), abs(n2)) * size)))
        (o1, o2, o3), (g1, g2, g3) = start.omega, start.gamma
        lift = size / rate**2
        return cls(
            rate,
            size,
            (n1 * lift, n2 * lift),
            (o1 / rate, o2 / rate, o3 / rate),
            (g1 / size, g2 / size, g3 / size),
            rotor / rate,
        )

    @property
    def moment_square(self) -> Fraction:
        """c²."""
        n1, n2 = self.moment
        return n1 * n1 + n2 * n2

    @property
    def gamma_square(self) -> Fraction:
        """|γ|²."""
        g1, g2, g3 = self.gamma
        return g1 * g1 + g2 * g2 + g3 * g3

    def along(self, vector: Sequence[Fraction]) -> Fraction:
        """c times the first component in the turned frame."""
        return self.moment[0] * vector[0] + self.moment[1] * vector[1]

    def across(self, vector: Sequence[Fraction]) -> Fraction:
        """c times the second component in the turned frame."""
        return self.moment[0] * vector[1] - self.moment[1] * vector[0]

    def turned(self) -> list[arb]:
        """The six components of the start in the turned frame, as balls."""
        c, found = ball(self.moment_square).sqrt(), []
        for vector in (self.omega, self.gamma):
            found += [ball(self.along(vector)) / c, ball(self.across(vector)) / c, ball(vector[2])]
        return found

    def in_body(self, vector: Sequence[Any]) -> list[Any]:
        """A vector of the turned frame in the top's own axes."""
        c = ball(self.moment_square).sqrt()
        cosine, sine = (ball(n) / c for n in self.moment)
        x, y, z = vector
        return [cosine * x - sine * y, sine * x + cosine * y, z]

    def restored(self, motion: Sequence[Any], length: int) -> list[Any]:
        """Six series in t', in the turned frame, as numbers or series in t of that length, in the top's own units."""
        rate, size = ball(self.rate), ball(self.size)
        omega, gamma = self.in_body(motion[:3]), self.in_body(motion[3:])
        rows = [[rate ** (n + 1) * x[n] for x in omega] + [rate**n * size * x[n] for x in gamma] for n in range(length)]
        return rows[0] if length == 1 else [arb_series(list(row), prec=length) for row in zip(*rows, strict=True)]


def polynomial(*coefficients: Fraction) -> fmpq_poly:
    """The polynomial with these coefficients of 1, w, w², ..."""
    return fmpq_poly([rational(c) for c in coefficients])


def _power_of_two(value: Fraction) -> Fraction:
    """A power of two of about the size of ``value`` ≥ 0; 1 for 0."""
    return Fraction(2) ** exponent(value) if value else Fraction(1)


def _root_of_two(value: Fraction) -> Fraction:
    """A power of two of about the size of √value; 0 for 0."""
    return Fraction(2) ** (exponent(value) // 2) if value else Fraction(0)
