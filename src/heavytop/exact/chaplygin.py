"""Chaplygin's motions of 1904, from rest: r on axis 1, one condition on the moments, powers 2/3 of Ω1.

With I = (A, B, C), in units with A = 1, 9 − 18 (B + C) + 32 BC = 0, that is C = 9 (2B − 1)/(2 (16B − 9)), and

    Ω2² = b1 Ω1^(2/3) + b3 Ω1²,   Ω3² = c1 Ω1^(2/3) + c3 Ω1²
    b3 = (1 − C)/((1 − 2B)(B − C)),   c3 = −(1 − B)/((1 − 2C)(B − C))
    c1/b1 = (2B − 3)(2B − 1)(16B − 9)²/(12B (5B − 3))

b1 is a unit of time, M·γ = 0.  With x³ = Ω1, Ω2 = x √(b1 + b3 x⁴) and Ω3 = x √(c1 + c3 x⁴) nothing is raised to a
broken power; at x = 0 the top is at rest with γ level.  Motions of rigid bodies are real for 3/2 < B < 1.5966, b1 > 0.
Source: S. A. Chaplygin, Trudy otd. fiz. nauk 12 (1904) 1, by the form of the solution; derived here from the
equations, which :class:`heavytop.exact.one_gap.Curve` tests exactly.
"""

from __future__ import annotations

from fractions import Fraction

from heavytop.exact.algebraic import AlgebraicMotion, algebraic_motion
from heavytop.exact.one_gap import Curve
from heavytop.exact.reduced import polynomial


def chaplygin_curve(second: Fraction, first: Fraction) -> Curve:
    """The curve for B and b1; raises ZeroDivisionError where a denominator vanishes."""
    b, zero = second, Fraction(0)
    c = 9 * (2 * b - 1) / (2 * (16 * b - 9))
    b3, c3 = (1 - c) / ((1 - 2 * b) * (b - c)), -(1 - b) / ((1 - 2 * c) * (b - c))
    c1 = first * (2 * b - 3) * (2 * b - 1) * (16 * b - 9) ** 2 / (12 * b * (5 * b - 3))
    return Curve.of(
        (Fraction(1), b, c), polynomial(first, zero, zero, zero, b3), polynomial(c1, zero, zero, zero, c3), power=3
    )


def chaplygin_motion(
    second: Fraction, first: Fraction, place: Fraction = Fraction(0), signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """Chaplygin's motion for B, 3/2 < B < 1.5966, and b1 > 0, with Ω1 = ``place``³ at t = 0, by default at rest.

    signs: of √(b1 + b3 x⁴) and √(c1 + c3 x⁴).  Raises InputError where there is no such top, or no real motion there.
    """
    return algebraic_motion("Chaplygin's", lambda: chaplygin_curve(second, first), place, signs)
