"""Kovalevskaya's separation of variables: the exact level of a start, its curve, and w1, w2 there.

The top is I = (2, 2, 1), n = (c, 0, 0) (:mod:`heavytop.exact.reduced`).  With p, q, r the angular velocity,
x1,2 = p ± iq and s = x1 x2 (Kovalevskaya, Acta Math. 12 (1889) 177; Golubev, Lectures on the Integration of the
Equations of Motion of a Heavy Rigid Body about a Fixed Point, chapter III):

    h = s + r²/2 + cγ1,   ℓ = 2(pγ1 + qγ2) + rγ3,   k² = |x1² − c(γ1 + iγ2)|²,   C = cℓ,   G = c²|γ|² − k²
    R(x) = −x⁴ + 2h x² − 2C x + G,   R12 = −s² + 2h s − 2C p + G,   R̂ = 2h s² − 4C s p + 4G p² + C² − 2G h
    w1 = −(R12 + |R(x1)|)/4q²,   w2 = R̂/(R12 + |R(x1)|),   w1 ≤ w2 the roots of −4q² w² − 2 R12 w + R̂

    φ(w) = ((w + h)(w² + G) − C²/2)(w² − k²),   y_k² = −2 φ(w_k),   w1' = y1/(w1 − w2),   w2' = y2/(w2 − w1)

h, ℓ², c², k² and the polynomials in w are rational.  φ has a multiple root where
(1) k = 0: Delone's class; (2, 3) e = ℓ²/(2|γ|²) − h is k or −k; (4) the cubic has one (Appelrot's classes).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, acb_mat, arb, arb_series, fmpq_poly

from heavytop.exact.balls import Undecided, ball
from heavytop.exact.closed_form import series_length
from heavytop.exact.flint_context import coefficient, current_length
from heavytop.exact.reduced import Reduced, polynomial
from heavytop.top.equations import Parameters, heavy_top
from heavytop.top.integrals import kovalevskaya

ORDERS = 5
"""Length of the power series in t at the start that fixes phases and signs: zeros there have an order of up to 4."""


class Level(Reduced):
    """The exact level of a start."""

    __slots__ = ()

    @property
    def energy(self) -> Fraction:
        """h."""
        (n1, n2), (w1, w2, w3), (g1, g2, _) = self.moment, self.omega, self.gamma
        return w1 * w1 + w2 * w2 + w3 * w3 / 2 + n1 * g1 + n2 * g2

    @property
    def area(self) -> Fraction:
        """ℓ."""
        (w1, w2, w3), (g1, g2, g3) = self.omega, self.gamma
        return 2 * (w1 * g1 + w2 * g2) + w3 * g3

    @property
    def fourth(self) -> Fraction:
        """k², Kovalevskaya's integral."""
        one = Parameters((2, 2, 1), (*self.moment, 0), 0)
        return Fraction(kovalevskaya(one, (*self.omega, *self.gamma), (0, 1, 2)))

    @property
    def weight(self) -> Fraction:
        """G."""
        return self.moment_square * self.gamma_square - self.fourth

    def cubic(self) -> fmpq_poly:
        """(w + h)(w² + G) − C²/2."""
        h, g = self.energy, self.weight
        return polynomial(h * g - self.moment_square * self.area**2 / 2, g, h, Fraction(1))

    def double(self) -> Fraction:
        """e = ℓ²/(2|γ|²) − h, the double root of φ on the levels (2, 3); needs γ ≠ 0."""
        return self.area**2 / (2 * self.gamma_square) - self.energy

    def separated(self, w: Fraction) -> Fraction:
        """c² (−4q² w² − 2 R12 w + R̂): 0 where w is w1 or w2, exactly, and > 0 between them."""
        s, square, constant = self.omega[0] ** 2 + self.omega[1] ** 2, self.moment_square, self.area
        h, g, p = self.energy, self.weight, self.along(self.omega)
        r12 = square * (-s * s + 2 * h * s - 2 * constant * p + g)
        rest = square * (2 * h * s * s - 4 * constant * s * p + square * constant**2 - 2 * g * h) + 4 * g * p * p
        return -4 * self.across(self.omega) ** 2 * w * w - 2 * r12 * w + rest


@dataclass(frozen=True, slots=True)
class Root:
    """A root of φ.  cubic: whether it is one of the cubic."""

    value: acb
    multiplicity: int
    cubic: bool


@dataclass(frozen=True, slots=True)
class Start:
    """The start at the working precision, in the frame of n = (c, 0, 0); series in t of length :data:`ORDERS`.

    lower: R̂, upper: R12 + |R|.  still: q = 0 exactly.
    """

    moment: arb
    energy: arb
    area: arb
    weight: arb
    motion: tuple[Any, ...]
    lower: Any
    upper: Any
    still: bool

    def state(self, velocity: Sequence[Any], length: int) -> tuple[Any, ...]:
        """The six components from series of p, q, r that are one longer than ``length``."""
        p, q, r = velocity
        with series_length(length + 1):
            upward = (2 * q.derivative() + p * r) / self.moment
            across = -r.derivative() / self.moment
        with series_length(length):
            along = (self.energy - p * p - q * q - r * r / 2) / self.moment
        return p, q, r, along, across, upward

    def above(self, variable: int, w: arb) -> arb:
        """w_k − w times something positive; k = 1 for variable 0."""
        if variable == 0:
            q = self.motion[1][0]
            return arb(-(self.upper[0] + 4 * q * q * w))
        return arb(self.lower[0] - w * self.upper[0])

    def inverses(self, mu: arb) -> tuple[Any, Any]:
        """Series of 1/(w1 − μ), 1/(w2 − μ), regular where q = 0."""
        q = self.motion[1]
        return -4 * q * q / (self.upper + 4 * mu * (q * q)), self.upper / (self.lower - mu * self.upper)


def roots(level: Level) -> list[Root]:
    """The roots of φ at the working precision, of multiplicity 1 or, on the levels (2, 3), once 2."""
    cubic, k, double = level.cubic(), ball(level.fourth).sqrt(), level.double()
    if double * double != level.fourth:
        return [*_simple(cubic), Root(acb(k), 1, False), Root(acb(-k), 1, False)]
    rest = cubic // polynomial(-double, Fraction(1))
    return [Root(acb(ball(double)), 2, True), *_simple(rest), Root(acb(ball(-double)), 1, False)]


def _simple(factor: fmpq_poly) -> list[Root]:
    """The roots of a factor of the cubic."""
    pairs: Any = factor.complex_roots()
    return [Root(acb(value), many, True) for value, many in pairs]


def start_of(level: Level) -> Start:
    """The start at the working precision."""
    c = ball(level.moment_square).sqrt()
    h, area, g = ball(level.energy), c * ball(level.area), ball(level.weight)
    with series_length(ORDERS):
        motion = _flow(c, level.turned())
        p, q = motion[:2]
        a, b, s = p * p - q * q, 2 * (p * q), p * p + q * q
        real, imaginary = b * b - a * a + 2 * h * a - 2 * area * p + g, 2 * (h * b - a * b - area * q)
        upper = -s * s + 2 * h * s - 2 * area * p + g + (real * real + imaginary * imaginary).sqrt()
        lower = 2 * h * s * s - 4 * area * (s * p) + 4 * g * (p * p) + (area * area - 2 * g * h)
    return Start(c, h, area, g, motion, lower, upper, level.across(level.omega) == 0)


def _flow(c: arb, start: list[arb]) -> tuple[Any, ...]:
    """The power series of the motion from the start, by Picard's iteration on the field itself."""
    parameters = Parameters((2, 2, 1), (c, arb(0), arb(0)), arb(0))
    motion = [arb_series([value], prec=current_length()) for value in start]
    for _ in range(current_length() - 1):
        rates = heavy_top(parameters, motion)
        motion = [value + arb_series(rate).integral() for value, rate in zip(start, rates, strict=True)]
    return tuple(motion)


def linear(start: Start, values: Sequence[acb]) -> tuple[list[acb], list[acb], acb_mat]:
    """α_j, β_j and 𝓜^−1, where P_j = α_j (X − e_j Z) + β_j Y and (X, Y, Z) = 𝓜^−1 P.

    values: the roots e_j of the cubic.  Raises Undecided where the working precision does not give the inverse.
    """
    alphas, betas = [], []
    for e in values:
        first, second = 2 * (start.energy + e), start.weight + e * e
        # the larger as a root, the other from α_j β_j = −C
        if abs(first).mid() > abs(second).mid():
            alphas.append(square_root(first))
            betas.append(-start.area / alphas[-1])
        else:
            betas.append(square_root(second))
            alphas.append(-start.area / betas[-1])
    try:
        return alphas, betas, acb_mat([[a, b, -a * e] for a, b, e in zip(alphas, betas, values, strict=True)]).inv()
    except ZeroDivisionError:
        raise Undecided from None


def square_root(value: acb) -> acb:
    """A root, whose ball is finite off 0, the negative axis included."""
    return acb(0, 1) * (-value).sqrt() if value.real < 0 else value.sqrt()


def real_part(series: Any) -> Any:
    """The real part of a complex series."""
    length = current_length()
    return arb_series([coefficient(series, n).real for n in range(length)], prec=length)
