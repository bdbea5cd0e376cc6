"""The physical pendulum: rotation about a principal axis held level, centre of mass in the plane across it.

The axis e, a unit vector, is principal where I e = K e: one of the three, any equatorial axis of a symmetric top, any
axis at all of a spherical one.  Ω = w e stays along it only if the torque does: γ × n ∥ e, n = P r.  While w is not 0
the part of γ across e turns, which requires n·e = 0 and γ·e = 0, unless γ ∥ e ∥ n, which is a steady rotation.
With N = |n||γ| and x the angle of γ from −n in the plane across e, x' = −w:

    x'' = −(N/K) sin x,   h = ½ K w² + n·γ = ½ K x'² − N cos x

    h ≤ N:  sin(x/2) = σ √m sn u,  cos(x/2) = dn u,  x' = 2σ √m ω cn u,  m = (h + N)/(2N),  ω² = N/K
    h > N:  sin(x/2) = σ sn u,     cos(x/2) = cn u,  x' = 2σ ω dn u,     m = 2N/(h + N),    ω² = (h + N)/(2K)

u = ω t + u0, and σ is the sign of x' at t = 0; h = N is the separatrix, m = 1.  Every vector fixed in space turns
about e through x(t) − x(0).  The direction of e is that of Ω, or of γ × n at rest: rational, though its length need
not be, so that the conditions are tested exactly.
Source: Whittaker, Analytical Dynamics, chapter IV; DLMF 22.19.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, ClassVar

from flint import arb

from heavytop.exact.closed_form import Carry, WithAttitude, about, cached_per_precision, sign
from heavytop.exact.elliptic.jacobi import Jacobi, jacobi, legendre_f
from heavytop.exact.flint.balls import BallLike, Balls, ball, nearest_integer
from heavytop.exact.solution import GAMMA, TORQUE, Conditions, ExactRelation
from heavytop.precision import Vector, cross, dot
from heavytop.top.equations import HEAVY_GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State


def _axis(top: HeavyTop, start: State) -> Vector:
    """Ω, or γ × n at rest, in units of its largest component; 0 in equilibrium."""
    direction = start.omega if any(start.omega) else cross(start.gamma, top.moment)
    largest = max(map(abs, direction)) or Fraction(1)
    first, second, third = (component / largest for component in direction)
    return first, second, third


def _off_principal(top: HeavyTop, start: State) -> Vector:
    axis = _axis(top, start)
    return cross(_inertia_times(top, axis), axis)


def _inertia_times(top: HeavyTop, vector: Vector) -> Vector:
    """I v, without the rotor."""
    first, second, third = (i * v for i, v in zip(top.inertia, vector, strict=True))
    return first, second, third


def _off_plane(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    axis = _axis(top, start)
    return dot(top.moment, axis), dot(start.gamma, axis)


def _off_axis(top: HeavyTop, start: State) -> Vector:
    return cross(top.rotor or (Fraction(0),) * 3, _axis(top, start))


@dataclass(frozen=True, slots=True)
class Pendulum(WithAttitude):
    """Libration, rotation, separatrix and equilibria about any principal axis, |γ| as it is.

    Raises NotInClass unless, exactly, Ω, or γ × P r at rest, lies along a principal axis with P r and γ in the plane
    across it, P r ≠ 0 and γ ≠ 0.
    """

    method = "closed form: physical pendulum, Jacobi functions"
    source = "E. T. Whittaker, Analytical Dynamics, chapter IV"
    body = (TORQUE,)
    starts: ClassVar[Conditions] = (
        GAMMA,
        ExactRelation("Omega, or the torque at rest, along a principal axis", "I e x e", _off_principal),
        ExactRelation("P r and gamma across this axis", "P r·e, gamma·e", _off_plane),
    )

    @property
    def axis(self) -> Vector:
        """A vector along the axis of rotation, its largest component ± 1; 0 in equilibrium."""
        return _axis(self.top, self.start)

    def motion(self, time: BallLike) -> tuple[list[BallLike], Carry]:
        lattice = _lattice(self)
        return ([arb(0)] * 3, list) if lattice is None else lattice.motion(time)


@dataclass(frozen=True, slots=True)
class PendulumGyrostat(Pendulum):
    """A pendulum with a rotor along its axis, which exerts no torque: k × Ω = 0.

    Raises NotInClass as :class:`Pendulum`, and unless k lies along the axis.
    """

    system = HEAVY_GYROSTAT
    starts = (*Pendulum.starts, ExactRelation("k along this axis", "k x e", _off_axis))


@dataclass(frozen=True, slots=True)
class Swing:
    """The angle x(t) at one working precision.

    amplitude: σ√m (libration) or σ.  speed: 2ω times it.
    """

    functions: Jacobi
    rate: arb
    origin: arb
    amplitude: arb
    speed: arb
    rotating: bool

    def at(self, time: BallLike) -> tuple[Any, Any, Any]:
        """(sin(x/2), cos(x/2), x') at a number or series."""
        sn, cn, dn = self.functions.functions(self.rate * time + self.origin)
        cosine, speed = (cn, dn) if self.rotating else (dn, cn)
        return self.amplitude * sn, cosine, self.speed * speed

    def half(self, time: arb) -> arb:
        """x/2, continuous for all times; it grows by π per turn of a rotation."""
        sine, cosine, _ = self.at(time)
        quarter = self.functions.quarter
        if not self.rotating or quarter is None:
            return arb.atan2(sine, cosine)
        turns = nearest_integer((self.rate * time + self.origin) / (2 * quarter))
        side = -1 if turns % 2 else 1
        return arb.atan2(side * sine, side * cosine) + self.amplitude * turns * arb.pi()


def swing(
    inertia: Fraction, kinetic: Fraction, height: Fraction, square: Fraction, direction: int, side: int
) -> tuple[Swing, tuple[arb, arb]]:
    """The motion of a pendulum, and (cos, sin) of x(0)/2.

    kinetic: ½ I x'².  height: n·γ = −N cos x.  square: N².  direction, side: the signs of x' and sin x at t = 0, +1
    for 0.  Raises ZeroDivisionError for a pendulum at rest in equilibrium.
    """
    energy, torque_square = kinetic + height, square - height**2
    largest = ball(square).sqrt()
    rotating = energy > 0 and energy**2 > square
    side *= direction
    # 1 - cos x and 1 + cos x, times N; N² - height² = torque²
    below, above = _sum(square, height, torque_square), _sum(square, -height, torque_square)
    over, under = _sum(square, energy, square - energy**2), _sum(square, -energy, square - energy**2)
    sine, cosine = (below / (2 * largest)).sqrt(), (above / (2 * largest)).sqrt()
    if rotating:
        functions = jacobi(2 * largest / over, -under / over)
        origin = legendre_f(below / (2 * largest), above / (2 * largest), ball(kinetic) / over)
        rate, amplitude = (over / (2 * ball(inertia))).sqrt(), arb(direction)
    else:
        parameter = arb(1) if under.is_zero() else over / (2 * largest)
        functions = jacobi(parameter, under / (2 * largest))
        origin = legendre_f(below / over, ball(kinetic) / over, above / (2 * largest))
        rate, amplitude = (largest / ball(inertia)).sqrt(), direction * parameter.sqrt()
    moving = Swing(functions, rate, side * origin, amplitude, 2 * rate * amplitude, rotating)
    return moving, (cosine, side * direction * sine)


@dataclass(frozen=True, slots=True)
class _Lattice:
    """The constants of a motion.  axis: e.  half: (cos, sin) of x(0)/2."""

    axis: list[arb]
    swing: Swing
    half: tuple[arb, arb]

    def motion(self, time: Balls) -> tuple[list[Balls], Carry]:
        sine, cosine, speed = self.swing.at(time)
        cosine0, sine0 = self.half
        c, s = cosine * cosine0 + sine * sine0, sine * cosine0 - cosine * sine0
        return [-speed * e for e in self.axis], partial(about, self.axis, c * c - s * s, -2 * c * s)


@cached_per_precision
def _lattice(case: Pendulum) -> _Lattice | None:
    """The constants of the motion; None in equilibrium."""
    n, gamma, axis = case.top.moment, case.start.gamma, case.axis
    if not any(axis):
        return None
    length = dot(axis, axis)
    inertia = dot(axis, _inertia_times(case.top, axis)) / length
    rate = dot(case.start.omega, axis)
    kinetic = inertia * rate**2 / length / 2
    torque = dot(cross(gamma, n), axis)
    square = dot(n, n) * dot(gamma, gamma)
    moving, half = swing(inertia, kinetic, dot(n, gamma), square, sign(-rate), sign(torque))
    size = ball(length).sqrt()
    return _Lattice([ball(component) / size for component in axis], moving, half)


def _sum(square: Fraction, value: Fraction, product: Fraction) -> arb:
    """√square + value, without cancellation: product = square − value²; an exact 0 where it is 0."""
    root = ball(square).sqrt()
    return root + ball(value) if value >= 0 else ball(product) / (root - ball(value))
