"""Motions whose tops or starts are algebraic numbers: as balls to any precision, with rational data near them.

No start of Goryachev's, N. Kowalewski's and Chaplygin's motions is known whose data beside the moments of inertia are
rational.  So such a motion is a curve with rational coefficients (:mod:`heavytop.exact.cases.one_interval`) and a
rational place on it; N, Ω and γ follow as square roots of rational numbers, |γ| = 1.

A program integrates rational data near them, :meth:`AlgebraicMotion.rounded`.  These are outside the class: their
reference is the validated enclosure (:mod:`heavytop.exact.enclosure.run`), as of any top.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import InputError
from heavytop.exact.cases.lagrange import polynomial
from heavytop.exact.cases.one_interval import IntervalCurve, OneGapMotion, gaps, value
from heavytop.exact.closed_form import cached_per_precision
from heavytop.exact.flint.balls import BallLike, ball, exponent, midpoint, to_bits
from heavytop.exact.separable.oscillation import Bearing, WithBearing
from heavytop.precision import Vector, decimal_text, round_to, shown
from heavytop.top.heavy_top import HeavyTop, State

_ROUNDED_BITS = 256


class Algebraic(ABC):
    """A motion whose top or start consists of balls."""

    __slots__ = ()
    inertia: Vector

    @abstractmethod
    def moment(self, bits: int) -> list[arb]:
        """P r to at least ``bits`` bits."""

    @abstractmethod
    def start(self, bits: int) -> list[arb]:
        """The state at t = 0."""

    def rounded(self, bits: int = _ROUNDED_BITS) -> tuple[HeavyTop, State]:
        """A top of weight 1 and a start, exact, within 2^(3 − bits) of this one's, relative to sizes above 1; |γ| = 1.

        The inertia is unchanged.  Their motion is outside the class: see the head of this file.
        """
        values = [round_to(midpoint(x), bits) for x in self.start(bits + 8)]
        centre = [round_to(midpoint(x), bits) for x in self.moment(bits + 8)]
        return HeavyTop(self.inertia, 1, centre), State(values[:3], values[3:]).normalized(bits)


@dataclass(frozen=True, slots=True)
class AlgebraicMotion(WithBearing, Algebraic):
    """A motion on a curve with P r = (N, 0, 0), N > 0 and |γ| = 1.

    place: x at t = 0.  signs: of Ω2 and Ω3 there (of √Q and √R, where x is not Ω1); +1 or −1.
    Raises InputError where the curve has no real motion through the place.
    """

    curve: IntervalCurve
    place: Fraction
    signs: tuple[int, int]
    method: str
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        squares = self.curve.squares(self.place)
        if min(squares) < 0 or max(squares) == 0:
            allowed = " and ".join(f"[{low:.6g}, {high:.6g}]" for low, high in gaps(self.curve))
            second, third = (decimal_text(square, 4) for square in squares)
            raise InputError(
                f"No motion at {shown(self.place)}: Omega2^2 and Omega3^2 would be {second} and {third}.",
                f"Real motions have it in {allowed}." if allowed else "No such motion of this top is real.",
            )

    @property
    def inertia(self) -> Vector:  # type: ignore[override]
        """(A, B, C), exact."""
        return self.curve.inertia

    def moment(self, bits: int) -> list[arb]:
        """P r to at least ``bits`` bits."""
        square = self.curve.gamma_square()
        return to_bits(lambda _working: [ball(square).sqrt(), arb(0), arb(0)], bits)

    def start(self, bits: int) -> list[arb]:
        """The state at t = 0, from square roots alone."""

        def evaluate(_working: int) -> list[arb]:
            q, r = (
                sign * ball(square).sqrt()
                for sign, square in zip(self.signs, self.curve.squares(self.place), strict=True)
            )
            size = ball(self.curve.gamma_square()).sqrt()
            first = ball(self.place**self.curve.power)
            factor = ball(self.place ** (self.curve.power // 2))
            s, t, u = (ball(value(height, self.place)) / size for height in self.curve.heights)
            return [first, factor * q, factor * r, s, q * t, r * u]

        return to_bits(evaluate, bits)

    def evaluate(self, time: Fraction) -> list[BallLike]:
        motion, size = _motion(self).at(ball(time)), ball(self.curve.gamma_square()).sqrt()
        return [*motion[:3], *(component / size for component in motion[3:])]

    def bearing(self, time: Fraction) -> Bearing:
        """The bearing of M; of Chaplygin's motion at rest that of the limit of M/x."""
        return _motion(self).bearing(ball(time))


@cached_per_precision
def _motion(motion: AlgebraicMotion) -> OneGapMotion:
    q, r = motion.curve.squares(motion.place)
    return OneGapMotion.of(motion.curve, motion.place, (motion.signs[0] * (q > 0), motion.signs[1] * (r > 0)))


def algebraic_motion(
    name: str, make: Callable[[], IntervalCurve], place: Fraction | None, signs: tuple[int, int]
) -> AlgebraicMotion:
    """The motion on the curve that ``make`` gives, through ``place``, or through the middle of its first gap.

    Raises InputError where the moments would not be positive, and where no motion is real.
    """
    try:
        curve = make()
    except ZeroDivisionError:
        curve = None
    if curve is None or min(curve.inertia) <= 0 or curve.gamma_square() <= 0:
        raise InputError(f"No top has {name} motion with these parameters.", "Its constructor lists the possible ones.")
    if place is None:
        intervals = gaps(curve)
        if not intervals:
            raise InputError(f"{name} motion of this top is not real.", "Its constructor lists the real ones.")
        (low, high), *_ = intervals
        unit = Fraction(2) ** (exponent(Fraction(high) - Fraction(low)) - 4)
        place = round(Fraction(low + high) / (2 * unit)) * unit
    return AlgebraicMotion(curve, place, signs, f"algebraic: {name} motion, inversion of an Abel integral")


# Goryachev's motions of 1899: r on axis 1, one condition on the moments, M·γ = 0, Ω2² of degree 4 in Ω1.
#
# With I = (A, B, C), in units with A = 1,
#
#     C = 8B (2B − 1)/(16B − 9),   Ω2² = b0 + b2 Ω1² + b4 Ω1⁴,   Ω3² = c0 + c2 Ω1²
#     b2 = (3 − 4B)(9 − 44B + 48B²)/(2B² (1 − 2B)),   c2 = −(9 − 16B)²/(16B²)
#     b0 b4 = (1 − 4B)(3 − 8B)(3 − 4B)² (5 − 8B)(9 − 16B)/(32B⁴ (1 − 2B)²)
#     c0 b4 = −(1 − 4B)(3 − 4B)² (9 − 16B)²/(32B⁴ (1 − 2B))
#
# b4 is a unit of time.  Motions are real for 3/5 < B < 5/8 and b4 < 0.
# Source: D. N. Goryachev, Trudy otd. fiz. nauk 10 (1899) 23; coefficients derived here from the equations, which
# :class:`heavytop.exact.cases.one_interval.IntervalCurve` tests exactly.


def goryachev_curve(second: Fraction, quartic: Fraction) -> IntervalCurve:
    """The curve for B and b4; raises ZeroDivisionError where a denominator vanishes."""
    b, zero = second, Fraction(0)
    c = 8 * b * (2 * b - 1) / (16 * b - 9)
    b2 = (3 - 4 * b) * (9 - 44 * b + 48 * b**2) / (2 * b**2 * (1 - 2 * b))
    c2 = -((9 - 16 * b) ** 2) / (16 * b**2)
    shared = (1 - 4 * b) * (3 - 4 * b) ** 2 * (9 - 16 * b) / (32 * b**4 * (1 - 2 * b) * quartic)
    b0, c0 = shared * (3 - 8 * b) * (5 - 8 * b) / (1 - 2 * b), -shared * (9 - 16 * b)
    return IntervalCurve.of((Fraction(1), b, c), polynomial(b0, zero, b2, zero, quartic), polynomial(c0, zero, c2))


def goryachev_motion(
    second: Fraction, quartic: Fraction, place: Fraction | None = None, signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """Goryachev's motion for B, 3/5 < B < 5/8, and b4 < 0, with Ω1 = ``place`` and these signs of Ω2, Ω3 at t = 0.

    Raises InputError without such a top, or a real motion at the place.
    """
    return algebraic_motion("Goryachev's", lambda: goryachev_curve(second, quartic), place, signs)


# Chaplygin's motions of 1904, from rest: r on axis 1, one condition on the moments, powers 2/3 of Ω1.
#
# With I = (A, B, C), in units with A = 1, 9 − 18 (B + C) + 32 BC = 0, that is C = 9 (2B − 1)/(2 (16B − 9)), and
#
#     Ω2² = b1 Ω1^(2/3) + b3 Ω1²,   Ω3² = c1 Ω1^(2/3) + c3 Ω1²
#     b3 = (1 − C)/((1 − 2B)(B − C)),   c3 = −(1 − B)/((1 − 2C)(B − C))
#     c1/b1 = (2B − 3)(2B − 1)(16B − 9)²/(12B (5B − 3))
#
# b1 is a unit of time, M·γ = 0.  With x³ = Ω1, Ω2 = x √(b1 + b3 x⁴) and Ω3 = x √(c1 + c3 x⁴) all powers are
# integers; at x = 0 the top is at rest with γ level.  Motions of rigid bodies are real for 3/2 < B < 1.5966, b1 >
# 0. Source: S. A. Chaplygin, Trudy otd. fiz. nauk 12 (1904) 1, by the form of the solution; derived here from the
# equations, which :class:`heavytop.exact.cases.one_interval.IntervalCurve` tests exactly.


def chaplygin_curve(second: Fraction, first: Fraction) -> IntervalCurve:
    """The curve for B and b1; raises ZeroDivisionError where a denominator vanishes."""
    b, zero = second, Fraction(0)
    c = 9 * (2 * b - 1) / (2 * (16 * b - 9))
    b3, c3 = (1 - c) / ((1 - 2 * b) * (b - c)), -(1 - b) / ((1 - 2 * c) * (b - c))
    c1 = first * (2 * b - 3) * (2 * b - 1) * (16 * b - 9) ** 2 / (12 * b * (5 * b - 3))
    return IntervalCurve.of(
        (Fraction(1), b, c), polynomial(first, zero, zero, zero, b3), polynomial(c1, zero, zero, zero, c3), power=3
    )


def chaplygin_motion(
    second: Fraction, first: Fraction, place: Fraction = Fraction(0), signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """Chaplygin's motion for B, 3/2 < B < 1.5966, and b1 > 0, with Ω1 = ``place``³ at t = 0, by default at rest.

    signs: of √(b1 + b3 x⁴) and √(c1 + c3 x⁴).  Raises InputError without such a top, or a real motion there.
    """
    return algebraic_motion("Chaplygin's", lambda: chaplygin_curve(second, first), place, signs)


# N. Kowalewski's motions of 1908: r on axis 1, one condition on the moments, Ω2² of degree 3 and Ω3² of 2 in Ω1.
#
# With I = (A, B, C), in units with A = 1, D = 2B − 1 and K = 3B − 2,
#
#     C = 9B (2B − 1)/(2 (9B − 5)),   Ω2² = b0 + b1 Ω1 + b2 Ω1² + b3 Ω1³,   Ω3² = c0 + c1 Ω1 + c2 Ω1²,   for b3 = 1
#     b2 = K (168B² − 164B + 37)/(B² D)               b1 = 6K² (3B − 1)(384B³ − 624B² + 333B − 58)/(B⁴ D²)
#     b0 = −4K³ (3B − 1)(384B⁴ − 1112B³ + 1101B² − 453B + 66)/(B⁶ D³)
#     c2 = −4 (9B − 5)²/(9B²)     c1 = −32K² (3B − 1)(9B − 5)²/(9B⁴ D)     c0 = −16K³ (3B − 1)(9B − 5)²/(9B⁶ D²)
#
# and b_n b3^(n − 2), c_n b3^(n − 2) for any b3, a unit of time.  M·γ is not 0.  Ω1'² is of degree 5: one hyperelliptic
# integral.  Motions of rigid bodies are real from about B = 10/17 to 0.645.
# Source: N. Kowalewski, Math. Ann. 65 (1908) 528; coefficients derived here from the equations, which
# :class:`heavytop.exact.cases.one_interval.IntervalCurve` tests exactly.


def kowalewski_curve(second: Fraction, cubic: Fraction) -> IntervalCurve:
    """The curve for B and b3; raises ZeroDivisionError where a denominator vanishes."""
    b, d, k, three, nine = second, 2 * second - 1, 3 * second - 2, 3 * second - 1, (9 * second - 5) ** 2
    b2 = k * (168 * b**2 - 164 * b + 37) / (b**2 * d)
    b1 = 6 * k**2 * three * (384 * b**3 - 624 * b**2 + 333 * b - 58) / (b**4 * d**2)
    b0 = -4 * k**3 * three * (384 * b**4 - 1112 * b**3 + 1101 * b**2 - 453 * b + 66) / (b**6 * d**3)
    c2 = -4 * nine / (9 * b**2)
    c1 = -32 * k**2 * three * nine / (9 * b**4 * d)
    c0 = -16 * k**3 * three * nine / (9 * b**6 * d**2)
    return IntervalCurve.of(
        (Fraction(1), b, 9 * b * d / (2 * (9 * b - 5))),
        polynomial(b0 / cubic**2, b1 / cubic, b2, cubic),
        polynomial(c0 / cubic**2, c1 / cubic, c2),
    )


def kowalewski_motion(
    second: Fraction, cubic: Fraction, place: Fraction | None = None, signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """N. Kowalewski's motion for B, 10/17 < B < 0.645, and b3 ≠ 0, with Ω1 = ``place`` and these signs of Ω2, Ω3.

    Raises InputError without such a top, or a real motion at the place.
    """
    return algebraic_motion("N. Kowalewski's", lambda: kowalewski_curve(second, cubic), place, signs)
