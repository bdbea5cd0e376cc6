"""Bobylev-Steklov: r on axis 1, I1 = 2 I3, any I2, Ω2 = 0 and Ω1 = p constant.

With n1 = P a and x = Ω3 the equations for Ω1, Ω2 and γ hold with

    γ3 = I3 p x/n1,   γ1 = (h − ½ I3 x²)/n1,   γ2 = −I3 x'/n1
    x'² = ¼ (α − x²)(x² − β),   α, β = 2B ± 2√(B² + C),   B = h/I3 − p²,   C = (|γ|² n1² − h²)/I3²

(h is I3 p² less than the constant of the same name in the energy.)  With σ the sign of x at t = 0, u = ω t + u0:

    β ≤ 0:  x = σ √α cn(u|m),  ω² = (α − β)/4,  m = α/(α − β);     β > 0:  x = σ √α dn(u|m),  ω² = α/4,  m = 1 − β/α

β = 0 (C = 0) is the separatrix.  p = 0 is a pendulum.
Source: Leimanis, The General Problem of the Motion of Coupled Rigid Bodies about a Fixed Point; DLMF 22.13.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

from flint import acb, arb

from heavytop.exact.closed_form import (
    ClosedForm,
    across,
    balls,
    cached_per_precision,
    carried_xi,
    instant,
    rotate,
    sign,
    taylor_of_fixed,
    unwound,
)
from heavytop.exact.elliptic.jacobi import Jacobi, jacobi, legendre_f
from heavytop.exact.elliptic.quartic import Companions, PreparedMotion, QuarticMotion
from heavytop.exact.elliptic.weierstrass import Winding
from heavytop.exact.flint.balls import Balls, ball, coefficient, series_length
from heavytop.exact.solution import ON_AXIS_1, ExactRelation
from heavytop.precision import Vector, cross, dot
from heavytop.top.equations import HEAVY_TOP, heavy_top
from heavytop.top.heavy_top import HeavyTop, State

# Attitude of the Bobylev-Steklov motions: axis 3 in space is a function of the second kind.
#
# p, h, x, B, C as above, s = |γ|.  For Z = ξ + iη, ξ ⟂ γ fixed in space, η = γ
# × ξ/s,
#
#     Z3' = −p Z2,    s Z1 = i (γ2 Z3 − γ3 Z2)    (from γ × Z = −i s Z),    |Z3|² = |ξ|² (1 − γ3²/s²)
#
# Where x has its simple poles, x ~ ±2i/τ, Z1 and Z2 have poles of order two and Z3 of order one: Z3 obeys the second
# theorem of :mod:`heavytop.exact.elliptic.quartic` for x'² = C + B x² − x⁴/4.  Its azimuth Λ has Λ' = s p γ1/(s² −
# γ3²), so that
#
#     Z3'/Z3 = −x x'/(y² − x²) + iΛ',    y = n1 s/(I3 p)
#
# has residue 1 at (x, x') = (y, X) and (−y, −X), X = ½ i (y² − 2h/I3), and −1 at both poles of x.  As a half-period
# (where ℘ is −B/6) leads from the first zero to the second and from pole to pole, V = 2W, W from a pole to a zero, and
#
#     ℘(W) = −h/(6 I3) − p²/12,    ℘'(W) = i p s n1/(4 I3),    ℘''(W) = q = s² n1²/(8 I3²) + h p²/(4 I3)
#     ℘(V) = −2 ℘(W) + m²/4,  ℘'(V) = −℘'(W) − m (℘(V) − ℘(W)),  m = q/℘'(W),    κ = n1 s/(4 I3 p) + h p/(2 n1 s)
#
# All of these but s are rational.  No divisor depends on the time: the poles γ = ±s e3 of Λ, turning points, M ∥ γ and
# the separatrix need no special case.  For p = 0 axis 3 rests in space.  Source: derived here; Hermite's
# theorem as in :mod:`heavytop.exact.elliptic.quartic`.


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


def _off(top: HeavyTop, start: State) -> tuple[Fraction]:
    return (top.moment[0] * start.gamma[2] - top.inertia[2] * start.omega[0] * start.omega[2],)


@dataclass(frozen=True, slots=True)
class BobylevSteklov(ClosedForm):
    """Every Bobylev-Steklov motion with r on axis 1 and I1 = 2 I3.  Raises NotInClass where an equality fails."""

    method = "closed form: Bobylev-Steklov, Jacobi functions"
    source = "E. Leimanis, The General Problem of the Motion of Coupled Rigid Bodies about a Fixed Point (1965)"
    body = *ON_AXIS_1, ExactRelation("I1 = 2 I3", "I1 - 2 I3", lambda top, _: (top.inertia[0] - 2 * top.inertia[2],))
    starts = (
        ExactRelation("Omega2 = 0", "Omega2", lambda _, start: start.omega[1:2]),
        ExactRelation("P a gamma3 = I3 Omega1 Omega3", "P a gamma3 - I3 Omega1 Omega3", _off),
    )

    def evaluate(self, time: Fraction) -> list[Any]:
        lattice = _lattice(self)
        if lattice is None:
            return balls(self.start.flat)
        x, slope = lattice.motion(instant(time))
        p, top, bend, side, up = lattice.shares
        return [p, arb(0), x, top + bend * (x * x), side * slope, up * x]

    def xi_at(self, time: Fraction) -> list[arb]:
        """ξ from ``initial_xi`` of γ; raises InputError for γ = 0."""
        with series_length(2):
            return carried_xi(self.start.gamma, partial(self._carried, time))

    def _carried(self, time: Fraction, basis: Vector) -> tuple[list[arb], list[arb]]:
        """The vector b = :func:`across` γ, fixed in space, and γ × b/|γ| at ``time``."""
        with series_length(1):
            gamma = self.evaluate(time)[3:]
        rate = self.start.omega[0]
        if _lattice(self) is None or rate == 0:
            first = rotate(balls(basis), self.start.omega, ball(time)) if rate else balls(basis)
            size = dot(gamma, gamma).sqrt()
            return first, list(cross([g / size for g in gamma], first))
        motion, axis = _axis(self)
        point = motion.lattice.point(time, 2)
        (third,) = axis.at(point, 1 / motion.denominator(point))
        z3, z2 = third[0], coefficient(third, 1) / -ball(rate)
        z1 = acb(0, 1) * (z3 * gamma[1] - z2 * gamma[2]) / dot(gamma, gamma).sqrt()
        numbers = [acb(z) for z in (z1, z2, z3)]
        return [z.real for z in numbers], [z.imag for z in numbers]


@dataclass(frozen=True, slots=True)
class _Lattice:
    """The constants of a motion at one working precision.

    amplitude: σ√α.  steep: the factor of x'.  crossing: where x goes through 0 (cn, not dn).
    shares: p, and the constant and the factors of x², x' and x in γ.
    """

    functions: Jacobi
    rate: arb
    origin: arb
    amplitude: arb
    steep: arb
    crossing: bool
    shares: tuple[arb, arb, arb, arb, arb]

    def motion(self, time: Balls) -> tuple[Balls, Balls]:
        """(x, x')."""
        sn, cn, dn = self.functions.functions(self.rate * time + self.origin)
        if self.crossing:
            return self.amplitude * cn, self.steep * (sn * dn)
        return self.amplitude * dn, self.steep * (sn * cn)


@cached_per_precision
def _lattice(case: BobylevSteklov) -> _Lattice | None:
    """The constants of the motion; None in equilibrium."""
    if not any(heavy_top(case.system.parameters(case.top, case.start), case.start.flat)):
        return None
    i3, n1, (p, _, x), gamma = case.top.inertia[2], case.top.moment[0], case.start.omega, case.start.gamma
    h, speed, square = n1 * gamma[0] + i3 * x * x / 2, -n1 * gamma[1] / i3, x * x
    b, c = h / i3 - p * p, (dot(gamma, gamma) * n1 * n1 - h * h) / i3**2
    spread = 2 * ball(b * b + c).sqrt()
    larger = spread + ball(2 * abs(b))
    # of two quantities with a known product, the one that cancels comes from the other
    alpha, beta = (larger, ball(-4 * c) / larger) if b >= 0 else (ball(4 * c) / larger, -larger)
    near = spread + ball(abs(square - 2 * b))
    far = ball(4 * speed * speed) / near
    below, above = (near, far) if square >= 2 * b else (far, near)
    crossing = c >= 0
    if crossing:
        functions = jacobi(alpha / (2 * spread) if c else arb(1), -beta / (2 * spread))
        rate = (spread / 2).sqrt()
        origin = legendre_f(above / alpha, ball(square) / alpha, below / (2 * spread))
    else:
        functions = jacobi(2 * spread / alpha, beta / alpha)
        rate = alpha.sqrt() / 2
        origin = legendre_f(above / (2 * spread), below / (2 * spread), ball(square) / alpha)
    side = sign(x)
    amplitude = side * alpha.sqrt()
    steep = -amplitude * rate * (1 if crossing else functions.parameter)
    shares = ball(p), ball(h / n1), ball(-i3 / (2 * n1)), ball(-i3 / n1), ball(i3 * p / n1)
    return _Lattice(functions, rate, sign(-speed) * side * origin, amplitude, steep, crossing, shares)


@cached_per_precision
def _axis(case: BobylevSteklov) -> tuple[PreparedMotion, Companions]:
    """x, and Z3 of the vector :func:`across` γ at the start; p and γ not 0."""
    top, start = case.top, case.start
    winding, vector, parameters = axis_winding(top, start), across(start.gamma), HEAVY_TOP.parameters(top, start)
    normal = tuple(c / winding.square for c in cross(start.gamma, vector))
    first, second = (taylor_of_fixed(parameters, start, fixed)[2] for fixed in (vector, normal))
    motion = quartic_motion(top, start).prepared()
    return motion, motion.companions(winding, unwound(first, second, winding))
