"""The gyrostat: M' = M × ω, γ' = γ × ω, ω = Ω + λ e2, for any inertia, rotor and start.

The system that the paper's (2.1)-(2.4) solve exactly, with λ = P b/(M·γ) and γ = M/C0 (Zhukovsky 1885, Volterra 1899;
Wittenburg, Dynamics of Multibody Systems).  Integrals m² = |M|² and h = ½ M·Ω + λ M2.  With k = 1/I1 − 1/I3 and x = M2,
(2.4) and (2.2) read k M1² = q1(x), k M3² = q3(x), and (2.3) is x'² = q1 q3, inverted by Biermann-Weierstrass:

    q1 = 2h − m²/I3 − 2λ x − (1/I2 − 1/I3) x²,    q3 = −[2h − m²/I1 − 2λ x − (1/I2 − 1/I1) x²],    x' = k M1 M3

No root is taken: M1 and M3 are functions of the second kind, V = the half-period ω_e of the root that belongs to the
factors, e = (½ a1 b1 − a0 b2 − a2 b0)/6 for q1 = a0 + a1 x + a2 x², q3 = b0 + b1 x + b2 x²: signs follow the motion.

γ, or any vector fixed in space, has a constant part along M; the part Γ across it makes Z = M × Γ − i m Γ, with
M × Z = −i m Z.
Z1, Z3 are of the second kind too.  M2's azimuth about M moves at m (2h − m²/I2 − 2λx)/(m² − x²) + m/I2, which
is what Z2 turns by; adding ω_e to its V gives that of Z1, Z3:

    ℘(V) = e − k² m²/4,    ℘'(V) = ½ i k² m³ ν,    κ = ½ m (1/I1 + 1/I3),    ν = 1/(2I2) − ½ (1/I1 + 1/I3) + h/m²

Z2 = i (M3 Z1 − M1 Z3)/m.  Valid for every start; λ = 0 is Euler's free top.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.closed_form import ClosedForm, balls, cached_per_precision, initial_xi, rotate, taylor, unwound
from heavytop.exact.elliptic.quartic import Companions, PreparedMotion, QuarticMotion
from heavytop.exact.elliptic.weierstrass import Point, Winding, imag, real
from heavytop.exact.flint.balls import BallLike, Balls, ball, current_length
from heavytop.precision import Vector, cross, dot
from heavytop.top.bodies import IDENTITY
from heavytop.top.equations import GYROSTAT, Parameters, gyrostat, rotor
from heavytop.top.heavy_top import HeavyTop, State


@dataclass(frozen=True, slots=True)
class Gyrostat(ClosedForm):
    """The motion of the gyrostat with rotor λ = ``rotor`` from any start, γ of any length and direction."""

    rotor: Fraction
    method = "closed form: gyrostat, Weierstrass functions of M2"
    source = "V. Volterra, Acta Math. 22 (1899) 201; formulas derived in the program"
    system = GYROSTAT

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> Gyrostat:
        """The paper's gyrostat, λ = P b/(M·γ); raises InputError outside a = c = 0, M ∥ γ, M·γ != 0."""
        return cls(top, start, Fraction(rotor(top, start)))

    @property
    def parameters(self) -> Parameters:
        """The parameters of the field, with this motion's own rotor."""
        return Parameters(self.top.inertia, self.top.moment, self.rotor)

    @property
    def momentum(self) -> Vector:
        """M at t = 0."""
        return self.top.angular_momentum(self.start.omega)

    @property
    def angular_velocity(self) -> Vector:
        """ω = Ω + λ e2 at t = 0."""
        first, second, third = self.start.omega
        return first, second + self.rotor, third

    @property
    def permanent(self) -> bool:
        """Whether M is constant in the body: M × ω = 0."""
        return not any(cross(self.momentum, self.angular_velocity))

    def evaluate(self, time: Fraction) -> list[BallLike]:
        prepared = _prepared(self)
        momentum, point, inverse = self._momentum(time)
        omega = [m * inverse for m, inverse in zip(momentum, prepared.inverses, strict=True)]
        if prepared.gamma is None:
            return [*omega, *rotate(balls(self.start.gamma), self.angular_velocity, point.time)]
        return [*omega, *prepared.gamma.at(momentum, point, inverse)]

    def xi_at(self, time: Fraction) -> list[arb]:
        xi = initial_xi(self.start.gamma)
        momentum, point, inverse = self._momentum(time)
        if self.permanent:
            return rotate(xi, self.angular_velocity, point.time)
        images = [unit.at(momentum, point, inverse) for unit in _units(self)]
        return [dot(xi, components) for components in zip(*images, strict=True)]

    def _momentum(self, time: Fraction) -> tuple[list[Any], Point, Any]:
        prepared, length = _prepared(self), current_length()
        point = prepared.motion.lattice.point(time, length if length > 1 else 0)
        if prepared.gamma is None:
            return balls(self.momentum), point, None
        inverse = 1 / prepared.motion.denominator(point)
        first, third = map(real, prepared.momentum.at(point, inverse))
        return [first, prepared.motion.position(point, inverse), third], point, inverse

    def factors(self) -> tuple[tuple[Fraction, Fraction, Fraction], tuple[Fraction, Fraction, Fraction]]:
        """q1 and q3, each as the coefficients of 1, x, x²."""
        energy, square, (i1, i2, i3) = self.energy, dot(self.momentum, self.momentum), self.top.inertia
        first = (2 * energy - square / i3, -2 * self.rotor, 1 / i3 - 1 / i2)
        third = (square / i1 - 2 * energy, 2 * self.rotor, 1 / i2 - 1 / i1)
        return first, third

    @property
    def energy(self) -> Fraction:
        """h = ½ M·Ω + λ M2."""
        return Fraction(dot(self.momentum, self.start.omega) / 2 + self.rotor * self.momentum[1])

    def quartic(self) -> QuarticMotion:
        """x = M2, x'² = q1 q3, x' = k M1 M3."""
        (a0, a1, a2), (b0, b1, b2) = self.factors()
        m1, m2, m3 = self.momentum
        i1, _, i3 = self.top.inertia
        product = (a0 * b0, a0 * b1 + a1 * b0, a0 * b2 + a1 * b1 + a2 * b0, a1 * b2 + a2 * b1, a2 * b2)
        return QuarticMotion(product, m2, (1 / i1 - 1 / i3) * m1 * m3)

    def root(self) -> Fraction:
        """e, the root of the lattice that belongs to the factors q1, q3."""
        (a0, a1, a2), (b0, b1, b2) = self.factors()
        return (a1 * b1 / 2 - a0 * b2 - a2 * b0) / 6

    def winding(self) -> Winding:
        """V and κ of Z1, Z3."""
        i1, i2, i3 = self.top.inertia
        square, difference, mean = dot(self.momentum, self.momentum), 1 / i1 - 1 / i3, (1 / i1 + 1 / i3) / 2
        nu = 1 / (2 * i2) - mean + self.energy / square
        slope = difference**2 * square * nu / 2
        return Winding(self.root() - difference**2 * square / 4, slope, mean, square)


@dataclass(frozen=True, slots=True)
class _Fixed:
    """A vector fixed in space: share M plus a part across M, with Z1 and Z3 in ``waves``; None where that part is 0.

    turn, square: −1/m and −1/m².
    """

    share: arb
    waves: Companions | None
    turn: arb
    square: arb

    def at(self, momentum: list[Balls], point: Point, inverse: Balls) -> list[Balls]:
        """Its body components at the point."""
        along = [m * self.share for m in momentum]
        if self.waves is None:
            return along
        first, third = self.waves.at(point, inverse)
        second = (real(first) * momentum[2] - real(third) * momentum[0]) * self.square
        return [along[0] + imag(first) * self.turn, along[1] + second, along[2] + imag(third) * self.turn]


@dataclass(frozen=True, slots=True)
class _Prepared:
    """The constants of a motion.  inverses: 1/I.  gamma: None where M is at rest in the body."""

    motion: PreparedMotion
    momentum: Companions
    inverses: list[arb]
    gamma: _Fixed | None


@cached_per_precision
def _prepared(motion: Gyrostat) -> _Prepared:
    prepared = motion.quartic().prepared()
    winding = Winding(motion.root(), Fraction(0), Fraction(0), Fraction(1))
    rows = taylor(gyrostat, motion.parameters, motion.start.flat, 4)
    taylors = ([(motion.top.inertia[axis] * c, Fraction(0)) for c in rows[axis]] for axis in (0, 2))
    gamma = None if motion.permanent else _fixed(motion, prepared, motion.start.gamma)
    inverses = [ball(1 / i) for i in motion.top.inertia]
    return _Prepared(prepared, prepared.companions(winding, *taylors), inverses, gamma)


@cached_per_precision
def _units(motion: Gyrostat) -> list[_Fixed]:
    """The axes of the body at t = 0."""
    return [_fixed(motion, _prepared(motion).motion, unit) for unit in IDENTITY]


def _fixed(motion: Gyrostat, prepared: PreparedMotion, vector: Vector) -> _Fixed:
    m, square = motion.momentum, dot(motion.momentum, motion.momentum)
    share = dot(vector, m) / square
    across = tuple(v - share * c for v, c in zip(vector, m, strict=True))
    waves = None
    if any(across):
        winding = motion.winding()
        products = [
            taylor(gyrostat, motion.parameters, (*motion.start.omega, *fixed), 4)[3:]
            for fixed in (cross(m, across), across)
        ]
        taylors = (unwound(products[0][axis], [-c for c in products[1][axis]], winding) for axis in (0, 2))
        waves = prepared.companions(winding, *taylors)
    return _Fixed(ball(share), waves, -1 / ball(square).sqrt(), ball(-1 / square))
