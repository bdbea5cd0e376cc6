"""N. Kowalewski's motions of 1908: r on axis 1, one condition on the moments, Ω2² of degree 3 and Ω3² of 2 in Ω1.

With I = (A, B, C), in units with A = 1, D = 2B − 1 and K = 3B − 2,

    C = 9B (2B − 1)/(2 (9B − 5)),   Ω2² = b0 + b1 Ω1 + b2 Ω1² + b3 Ω1³,   Ω3² = c0 + c1 Ω1 + c2 Ω1²,   for b3 = 1
    b2 = K (168B² − 164B + 37)/(B² D)               b1 = 6K² (3B − 1)(384B³ − 624B² + 333B − 58)/(B⁴ D²)
    b0 = −4K³ (3B − 1)(384B⁴ − 1112B³ + 1101B² − 453B + 66)/(B⁶ D³)
    c2 = −4 (9B − 5)²/(9B²)     c1 = −32K² (3B − 1)(9B − 5)²/(9B⁴ D)     c0 = −16K³ (3B − 1)(9B − 5)²/(9B⁶ D²)

and b_n b3^(n − 2), c_n b3^(n − 2) for any b3, a unit of time.  M·γ is not 0.  Ω1'² is of degree 5: one hyperelliptic
integral.  Motions of rigid bodies are real from about B = 10/17 to 0.645.
Source: N. Kowalewski, Math. Ann. 65 (1908) 528; coefficients derived here from the equations, which
:class:`heavytop.exact.one_gap.Curve` tests exactly.
"""

from __future__ import annotations

from fractions import Fraction

from heavytop.exact.algebraic import AlgebraicMotion, algebraic_motion
from heavytop.exact.one_gap import Curve
from heavytop.exact.reduced import polynomial


def kowalewski_curve(second: Fraction, cubic: Fraction) -> Curve:
    """The curve for B and b3; raises ZeroDivisionError where a denominator vanishes."""
    b, d, k, three, nine = second, 2 * second - 1, 3 * second - 2, 3 * second - 1, (9 * second - 5) ** 2
    b2 = k * (168 * b**2 - 164 * b + 37) / (b**2 * d)
    b1 = 6 * k**2 * three * (384 * b**3 - 624 * b**2 + 333 * b - 58) / (b**4 * d**2)
    b0 = -4 * k**3 * three * (384 * b**4 - 1112 * b**3 + 1101 * b**2 - 453 * b + 66) / (b**6 * d**3)
    c2 = -4 * nine / (9 * b**2)
    c1 = -32 * k**2 * three * nine / (9 * b**4 * d)
    c0 = -16 * k**3 * three * nine / (9 * b**6 * d**2)
    return Curve.of(
        (Fraction(1), b, 9 * b * d / (2 * (9 * b - 5))),
        polynomial(b0 / cubic**2, b1 / cubic, b2, cubic),
        polynomial(c0 / cubic**2, c1 / cubic, c2),
    )


def kowalewski_motion(
    second: Fraction, cubic: Fraction, place: Fraction | None = None, signs: tuple[int, int] = (1, 1)
) -> AlgebraicMotion:
    """N. Kowalewski's motion for B, 10/17 < B < 0.645, and b3 ≠ 0, with Ω1 = ``place`` and these signs of Ω2, Ω3.

    Raises InputError where there is no such top, or no real motion at the place.
    """
    return algebraic_motion("N. Kowalewski's", lambda: kowalewski_curve(second, cubic), place, signs)
