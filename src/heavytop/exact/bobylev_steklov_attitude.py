"""Attitude of the Bobylev-Steklov motions: axis 3 in space is a function of the second kind.

p, h, x, B, C as in :mod:`heavytop.exact.bobylev_steklov`, s = |γ|.  For Z = ξ + iη, ξ ⟂ γ fixed in space, η = γ × ξ/s,

    Z3' = −p Z2,    s Z1 = i (γ2 Z3 − γ3 Z2)    (from γ × Z = −i s Z),    |Z3|² = |ξ|² (1 − γ3²/s²)

Where x has its simple poles, x ~ ±2i/τ, Z1 and Z2 have poles of order two and Z3 of order one: Z3 obeys the second
theorem of :mod:`heavytop.exact.quartic` for x'² = C + B x² − x⁴/4.  Its azimuth Λ has Λ' = s p γ1/(s² − γ3²), so that

    Z3'/Z3 = −x x'/(y² − x²) + iΛ',    y = n1 s/(I3 p)

has residue 1 at (x, x') = (y, X) and (−y, −X), X = ½ i (y² − 2h/I3), and −1 at both poles of x.  As a half-period
(where ℘ is −B/6) leads from the first zero to the second and from pole to pole, V = 2W, W from a pole to a zero, and

    ℘(W) = −h/(6 I3) − p²/12,    ℘'(W) = i p s n1/(4 I3),    ℘''(W) = q = s² n1²/(8 I3²) + h p²/(4 I3)
    ℘(V) = −2 ℘(W) + m²/4,  ℘'(V) = −℘'(W) − m (℘(V) − ℘(W)),  m = q/℘'(W),    κ = n1 s/(4 I3 p) + h p/(2 n1 s)

All rational but s.  Nothing is divided by what depends on the time: the poles γ = ±s e3 of Λ, turning points, M ∥ γ and
the separatrix are states like any other.  For p = 0 axis 3 rests in space.
Source: derived here; Hermite's theorem as in :mod:`heavytop.exact.quartic`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from flint import acb, arb

from heavytop.exact.flint_context import coefficient
from heavytop.exact.motion import taylor, turned
from heavytop.exact.quartic import Companions, PreparedMotion, QuarticMotion
from heavytop.exact.second_kind import Winding
from heavytop.top.equations import HEAVY_TOP, Parameters, heavy_top
from heavytop.top.heavy_top import HeavyTop, State, Vector, cross, dot


def quartic_motion(top: HeavyTop, start: State) -> QuarticMotion:
    """x = Ω3 on its quartic; ``top`` and ``start`` of the class."""
    i3, n1, (p, _, x), gamma = top.inertia[2], top.moment[0], start.omega, start.gamma
    h = n1 * gamma[0] + i3 * x * x / 2
    constant = (dot(gamma, gamma) * n1 * n1 - h * h) / i3**2
    zero = Fraction(0)
    coefficients = (constant, zero, h / i3 - p * p, zero, Fraction(-1, 4))
    return QuarticMotion(coefficients, x, -n1 * gamma[1] / i3)


def axis_winding(top: HeavyTop, start: State) -> Winding:
    """V and κ of Z3; p and γ not 0."""
    i3, n1, (p, _, x), gamma = top.inertia[2], top.moment[0], start.omega, start.gamma
    h, square = n1 * gamma[0] + i3 * x * x / 2, dot(gamma, gamma)
    half = -h / (6 * i3) - p * p / 12
    half_slope = p * n1 / (4 * i3)  # ℘'(W)/(i s)
    tangent = -(square * n1 * n1 / (8 * i3**2) + h * p * p / (4 * i3)) / (half_slope * square)  # m/(i s)
    value = -2 * half - square * tangent**2 / 4
    slope = -half_slope - tangent * (value - half)
    return Winding(value, slope, n1 / (4 * i3 * p) + h * p / (2 * n1 * square), square)


def prepared_axis(top: HeavyTop, start: State, vector: Vector) -> tuple[PreparedMotion, Companions]:
    """x, and Z3 of the exact ``vector`` ⟂ γ at the start, at the working precision; p and γ not 0."""
    winding = axis_winding(top, start)
    normal = tuple(c / winding.square for c in cross(start.gamma, vector))
    parameters = HEAVY_TOP.parameters(top, start)
    rows = [_third(parameters, start, fixed) for fixed in (vector, normal)]
    motion = quartic_motion(top, start).prepared()
    return motion, motion.companions(winding, turned(rows[0], rows[1], winding))


def _third(parameters: Parameters, start: State, fixed: Sequence[Fraction]) -> list[Fraction]:
    """The first four derivatives at 0 of the third component of a vector fixed in space."""

    def field(p: Parameters, y: Any) -> tuple[Any, ...]:
        return (*heavy_top(p, y[:6]), *HEAVY_TOP.attitude(p, y[:6], y[6:]))

    return taylor(field, parameters, (*start.flat, *fixed), 4)[8]


def carried(
    motion: PreparedMotion, axis: Companions, time: Fraction, rate: arb, gamma: Sequence[arb]
) -> tuple[list[arb], list[arb]]:
    """Re Z and Im Z in body components at ``time``; rate: p, not 0.  gamma: γ at the time."""
    point = motion.lattice.point(time, 2)
    (third,) = axis.at(point, 1 / motion.denominator(point))
    z3, z2 = third[0], coefficient(third, 1) / -rate
    z1 = acb(0, 1) * (z3 * gamma[1] - z2 * gamma[2]) / dot(gamma, gamma).sqrt()
    found = [acb(z) for z in (z1, z2, z3)]
    return [z.real for z in found], [z.imag for z in found]
