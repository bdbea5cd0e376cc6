"""Goryachev's motions of 1899: r on axis 1, one condition on the moments, M·γ = 0, Ω2² of degree 4 in Ω1.

With I = (A, B, C), in units with A = 1,

    C = 8B (2B − 1)/(16B − 9),   Ω2² = b0 + b2 Ω1² + b4 Ω1⁴,   Ω3² = c0 + c2 Ω1²
    b2 = (3 − 4B)(9 − 44B + 48B²)/(2B² (1 − 2B)),   c2 = −(9 − 16B)²/(16B²)
    b0 b4 = (1 − 4B)(3 − 8B)(3 − 4B)² (5 − 8B)(9 − 16B)/(32B⁴ (1 − 2B)²)
    c0 b4 = −(1 − 4B)(3 − 4B)² (9 − 16B)²/(32B⁴ (1 − 2B))

b4 is a unit of time.  Motions are real for 3/5 < B < 5/8 and b4 < 0.
Source: D. N. Goryachev, Trudy otd. fiz. nauk 10 (1899) 23; coefficients derived here from the equations, which
:class:`heavytop.exact.one_gap.Curve` tests exactly.
"""

from __future__ import annotations

from fractions import Fraction

from heavytop.exact.algebraic import AlgebraicMotion, algebraic_motion
from heavytop.exact.one_gap import Curve
from heavytop.exact.reduced import polynomial


def goryachev_curve(second: Fraction, quartic: Fraction) -> Curve:
    """The curve for B and b4; raises ZeroDivisionError where a denominator vanishes."""
    b, zero = second, Fraction(0)
    c = 8 * b * (2 * b - 1) / (16 * b - 9)
    b2 = (3 - 4 * b) * (9 - 44 * b + 48 * b**2) / (2 * b**2 * (1 - 2 * b))
    c2 = -((9 - 16 * b) ** 2) / (16 * b**2)
    shared = (1 - 4 * b) * (3 - 4 * b) ** 2 * (9 - 16 * b) / (32 * b**4 * (1 - 2 * b) * quartic)
    b0, c0 = shared * (3 - 8 * b) * (5 - 8 * b) / (1 - 2 * b), -shared * (9 - 16 * b)
    return Curve.of((Fraction(1), b, c), polynomial(b0, zero, b2, zero, quartic), polynomial(c0, zero, c2))


def goryachev_motion(
    second: Fraction, quartic: Fraction, place: Fraction | None = None, signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """Goryachev's motion for B, 3/5 < B < 5/8, and b4 < 0, with Ω1 = ``place`` and these signs of Ω2, Ω3 at t = 0.

    Raises InputError where there is no such top, or no real motion at the place.
    """
    return algebraic_motion("Goryachev's", lambda: goryachev_curve(second, quartic), place, signs)
