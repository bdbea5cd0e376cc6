"""Lagrange's top: I1 = I2, a = b = 0, for every start.

Data: n = P c, L = I3 Ω3, C0 = M·γ, E = ½ I1 (Ω1² + Ω2²) + n γ3, s = |γ|.  x = γ3 moves on a cubic
(Whittaker, Analytical Dynamics, chapter VI; Klein and Sommerfeld, The Theory of the Top, volume II; Hermite, Sur
quelques applications des fonctions elliptiques):

    x'² = (2/I1)(E − n x)(s² − x²) − ((C0 − L x)/I1)²,    x' = Ω2 γ1 − Ω1 γ2

The horizontal parts g = γ1 + iγ2 and w = Ω1 + iΩ2 satisfy g' = −iΩ3 g + i x w, I1 w' = i (L − I1 Ω3) w − i n g, and
share one function of the second kind:

    ℘(V) = (4 I1 E − L²)/(12 I1²),    ℘'(V) = i (C0 n − E L)/(2 I1²),    κ = L/(2 I1) − Ω3

All of it rational, whatever s is.  The axis of symmetry in space, e3·(ξ + iη), η = γ × ξ/s, ξ ⟂ γ, moves with

    ℘(V) = (4 I1 E s² + 2 L² s² − 3 C0²)/(12 I1² s²),    κ = C0/(2 I1 s)
    ℘'(V) = −i (C0³ − 2 C0 E I1 s² − C0 L² s² + 2 I1 L n s⁴)/(4 I1³ s³)

and gives the attitude.  Sleeping tops, steady and regular precession, cusps, loops, passages through the poles, the
spherical pendulum (L = 0) and the motions asymptotic to a sleeping top need no special case.

*The axis of symmetry* need not be axis 3, nor its direction rational.  Let a be
an exact vector along it, u and v = a × u exact vectors across it, A = |a|, and n = νa.  With x = a·γ in place of γ3 and
g = γ·u + i γ·v/A, w likewise, L = a·M/A and Ω3 = a·Ω/A, all of the above but √(A²) stays rational:

    x'² = (2/I1)(E − νx)(A²s² − x²) − (A²C0 − (a·M) x)²/(A I1)²,    κ and ℘'(V) of g and w are rational multiples of iA
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, ClassVar, Self

from flint import acb, arb, fmpq_poly

from heavytop.exact.closed_form import (
    ClosedForm,
    about,
    across,
    balls,
    cached_per_precision,
    carried_xi,
    in_units,
    initial_xi,
    instant,
    once,
    rotate,
    taylor,
    taylor_of_fixed,
    unwound,
)
from heavytop.exact.elliptic.quartic import Companions, PreparedMotion, QuarticMotion
from heavytop.exact.elliptic.weierstrass import Winding, imag, real
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    ball,
    coefficient,
    current_length,
    current_precision,
    exponent,
    rational,
    series_length,
)
from heavytop.exact.solution import AXIAL_ROTOR, SPHERICAL, SYMMETRIC, TORQUE, Conditions, ExactRelation
from heavytop.precision import Vector, cross, dot
from heavytop.top.equations import HEAVY_GYROSTAT, Parameters, heavy_top
from heavytop.top.heavy_top import HeavyTop, State

_ZERO, _ONE = Fraction(0), Fraction(1)


@dataclass(frozen=True, slots=True)
class Lagrange(ClosedForm):
    """The motion of Lagrange's top about axis 3 from any start, γ of any length.

    Raises NotInClass unless I1 = I2 and P a = P b = 0.
    """

    method = "closed form: Lagrange, Weierstrass functions of gamma3"
    source = "J.-L. Lagrange, Mécanique analytique (1788); F. Klein, A. Sommerfeld, Theorie des Kreisels (1897)"
    body = SYMMETRIC

    @property
    def frame(self) -> tuple[Vector, Vector]:
        """(u, a): a vector along the axis of symmetry and one across it."""
        return (_ONE, _ZERO, _ZERO), (_ZERO, _ZERO, _ONE)

    @property
    def parameters(self) -> Parameters:
        """The parameters of the field."""
        return Parameters(self.top.inertia, self.top.moment, _ZERO)

    def evaluate(self, time: Fraction) -> list[Any]:
        prepared, length = _prepared(self), current_length()
        point = prepared.motion.lattice.point(time, length if length > 1 else 0)
        inverse = 1 / prepared.motion.denominator(point)
        g, w = prepared.horizontal.at(point, inverse)
        height = prepared.motion.position(point, inverse)
        return [*prepared.composed(real(w), imag(w), prepared.spin), *prepared.composed(real(g), imag(g), height)]

    @property
    def constants(self) -> tuple[Fraction, ...]:
        """(I1, A², ν, a·M, C0, E, s²)."""
        omega, gamma, moment, axis = self.start.omega, self.start.gamma, self.top.moment, self.frame[1]
        i1, length, momentum = self.top.inertia[0], dot(axis, axis), self.top.angular_momentum(omega)
        energy = i1 * (dot(omega, omega) - dot(omega, axis) ** 2 / length) / 2 + dot(moment, gamma)
        spin, area, square = dot(axis, momentum), dot(momentum, gamma), dot(gamma, gamma)
        return i1, length, dot(moment, axis) / length, spin, area, energy, square

    def quartic(self) -> QuarticMotion:
        """x = a·γ on its cubic."""
        (i1, length, n, spin, area, energy, square), axis = self.constants, self.frame[1]
        cubic = (
            length * (2 * energy * square / i1 - area**2 / i1**2),
            2 * area * spin / i1**2 - 2 * n * length * square / i1,
            -2 * energy / i1 - spin**2 / (length * i1**2),
            2 * n / i1,
        )
        speed = dot(axis, cross(self.start.gamma, self.start.omega))
        return QuarticMotion(cubic, dot(axis, self.start.gamma), speed)

    def winding(self) -> Winding:
        """V and κ of g and w."""
        i1, length, n, spin, area, energy, _ = self.constants
        slope = (area * n - energy * spin / length) / (2 * i1**2)
        rate = (spin / (2 * i1) - dot(self.frame[1], self.start.omega)) / length
        return Winding((4 * i1 * energy - spin**2 / length) / (12 * i1**2), slope, rate, length)

    def axis_winding(self) -> Winding:
        """V and κ of the axis of symmetry in space; needs γ != 0."""
        i1, length, n, spin, area, energy, square = self.constants
        spin_square = spin**2 / length
        value = (4 * i1 * energy * square + 2 * spin_square * square - 3 * area**2) / (12 * i1**2 * square)
        cubic = area**3 - 2 * area * energy * i1 * square - area * spin_square * square + 2 * i1 * spin * n * square**2
        return Winding(value, -cubic / (4 * i1**3 * square**2), area / (2 * i1 * square), square)

    def xi_at(self, time: Fraction) -> list[arb]:
        """ξ from ``initial_xi`` of γ; raises OutOfReach where the axis is so near to that of a sleeping top (on a
        motion asymptotic to it, at large times) that the angle about it is lost.
        """
        gamma = self.start.gamma
        with series_length(2):
            return carried_xi(gamma, partial(self._both, time)) if time else initial_xi(gamma)

    def _both(self, time: Fraction, basis: Vector) -> tuple[list[arb], Vector]:
        """The vector ``basis`` and γ × basis/|γ|, fixed in space, at ``time``."""
        size = ball(dot(self.start.gamma, self.start.gamma)).sqrt()
        with series_length(1):
            gamma = [g / size for g in self.evaluate(time)[3:]]
        first = self._carried(basis, time)
        return first, cross(gamma, first)

    def _carried(self, basis: Vector, time: Fraction) -> list[arb]:
        """The vector :func:`across` γ, fixed in space, at ``time``.

        Z = ξ + iη, h = Z3 and Z± = Z1 ± iZ2 obey Z₊ ḡ = −h (x − s), Z₋ g = −h (x + s) and, as h' = (Z × Ω)3,
        Z₋ w − Z₊ w̄ = 2i h'.
        """
        axis = self.frame[1]
        if not any((*cross(self.start.omega, axis), *cross(self.start.gamma, axis))):
            return rotate(balls(basis), self.start.omega, ball(time))
        prepared = _prepared(self)
        point = prepared.motion.lattice.point(time, 2)
        inverse = 1 / prepared.motion.denominator(point)
        (h,), (g, w) = (c.at(point, inverse) for c in (_axis(self), prepared.horizontal))
        x, size = prepared.motion.position(point, inverse)[0], ball(self.constants[6]).sqrt()
        length, across = prepared.axis, prepared.across
        plus, minus = _sides(h[0] / length, coefficient(h, 1) / length, g[0] / across, w[0] / across, x / length, size)
        vector = ((plus + minus) / 2).real, ((plus - minus) / acb(0, 2)).real
        return prepared.composed(vector[0] * across, vector[1] * across, h[0].real)


def _sides(h: acb, slope: acb, g: acb, w: acb, x: arb, size: arb) -> tuple[acb, acb]:
    """(Z₊, Z₋) from the three equations, with divisors that do not vanish at a pole."""
    weight = abs(g) ** 2 + abs(w) ** 2
    if x > 0:
        plus = h * g / (x + size)
        twist = acb(0, 2) * slope + plus * w.conjugate()
        return plus, (twist * w.conjugate() - h * (x + size) * g.conjugate()) / weight
    minus = h * g.conjugate() / (x - size)
    twist = minus * w - acb(0, 2) * slope
    return (twist * w - h * (x - size) * g) / weight, minus


@dataclass(frozen=True, slots=True)
class _Prepared:
    """The constants of a motion.

    spin: a·Ω.  axis, across: |a| and |u|.  directions: u, v and a over |u|², |u|²|a| and |a|²; None for axes 1, 2, 3.
    """

    motion: PreparedMotion
    horizontal: Companions
    spin: arb
    axis: arb
    across: arb
    directions: tuple[list[arb], ...] | None

    def composed(self, first: Balls, second: Balls, third: Balls) -> list[Balls]:
        """The vector whose products with u, v/|a| and a are these numbers or series."""
        if self.directions is None:
            return [first, second, third]
        parts = zip(*self.directions, strict=True)
        return [first * u + second * v + third * a for u, v, a in parts]


@cached_per_precision
def _prepared(motion: Lagrange) -> _Prepared:
    prepared, winding, (across, axis) = motion.quartic().prepared(), motion.winding(), motion.frame
    rows = taylor(heavy_top, motion.parameters, motion.start.flat, 4)
    normal = cross(axis, across)
    taylors = (
        unwound(_along(across, rows[k : k + 3]), [y / winding.square for y in _along(normal, rows[k : k + 3])], winding)
        for k in (3, 0)
    )
    width, size, length = ball(dot(across, across)), ball(winding.square).sqrt(), ball(winding.square)
    directions = (
        [ball(u) / width for u in across],
        [ball(v) / (width * size) for v in normal],
        [ball(a) / length for a in axis],
    )
    companions = prepared.companions(winding, *taylors)
    plain = motion.frame == ((_ONE, _ZERO, _ZERO), (_ZERO, _ZERO, _ONE))
    spin = ball(dot(axis, motion.start.omega))
    return _Prepared(prepared, companions, spin, size, width.sqrt(), None if plain else directions)


def _along(direction: Vector, rows: Sequence[Sequence[Fraction]]) -> list[Fraction]:
    """The Taylor coefficients of a vector's product with a fixed one, from those of its components."""
    return [dot(direction, values) for values in zip(*rows, strict=True)]


@cached_per_precision
def _axis(motion: Lagrange) -> Companions:
    """h = a·Z of Z = ξ + iη, η = γ × ξ/s, for the vector ξ that is :func:`across` γ at t = 0, fixed in space."""
    vector = across(motion.start.gamma)
    winding, square = motion.axis_winding(), dot(motion.start.gamma, motion.start.gamma)
    # s Z = s ξ + i γ × ξ, so Z = ξ + i s (γ × ξ/s²)
    normal = tuple(c / square for c in cross(motion.start.gamma, vector))
    first, second = (
        _along(motion.frame[1], taylor_of_fixed(motion.parameters, motion.start, fixed)) for fixed in (vector, normal)
    )
    return _prepared(motion).motion.companions(winding, unwound(first, second, winding))


# The spherical top, I1 = I2 = I3 with its centre of mass anywhere: Lagrange's top about r.
#
# Each of its axes is one of symmetry.  The direction of r is irrational in general, but the equalities that define the
# class, the cubic of n·γ and both functions of the second kind are rational in the exact data:
# the class is tested exactly, and any motion is known at any time.


@dataclass(frozen=True, slots=True)
class SphericalTop(Lagrange):
    """The motion of a spherical top from any start, its centre of mass anywhere but at the fixed point.

    Raises NotInClass unless I1 = I2 = I3 and P r ≠ 0.
    """

    method = "closed form: spherical top, Weierstrass functions of n·gamma"
    source = "derived in the program; Lagrange's top with equal moments"
    body = SPHERICAL, TORQUE

    @property
    def frame(self) -> tuple[Vector, Vector]:
        """(u, a): a = n in a unit in which it is of ordinary size, and a vector across it."""
        unit = Fraction(2) ** exponent(max(map(abs, self.top.moment)))
        first, second, third = (n / unit for n in self.top.moment)
        axis = first, second, third
        return across(axis), axis


# Gyrostats with n and k along one axis of symmetry: a top without a rotor seen from axes that turn about it.
#
# The top with the same moments and weight and Ω* = Ω + c, c_i = k_i/I_i, has the same M, so that its axis and γ move in
# space as those of the gyrostat do, and its body turns ahead by the angle |c| t: with R the rotation about k,
#
#     Ω = R(|c| t) Ω* − c,   γ = R(|c| t) γ*,   ξ = R(|c| t) ξ*


_ATTITUDE_BITS = 8


@dataclass(frozen=True, slots=True)
class LagrangeGyrostat(ClosedForm):
    """The motion of Lagrange's gyrostat from any start, γ of any length.

    Raises NotInClass unless I1 = I2, P a = P b = 0 and k1 = k2 = 0.
    """

    method = "closed form: Lagrange's gyrostat, Weierstrass functions of gamma3"
    source = "derived in the program; Lagrange's top with a rotor on its axis"
    system = HEAVY_GYROSTAT
    body: ClassVar[Conditions] = (*SYMMETRIC, AXIAL_ROTOR)

    @property
    def ahead(self) -> Vector:
        """k_i/I_i."""
        first, second, third = (k / i for k, i in zip(self.top.rotor or (_ZERO,) * 3, self.top.inertia, strict=True))
        return first, second, third

    def evaluate(self, time: Fraction) -> list[BallLike]:
        rotated = self._turned(_top_of(self).evaluate(time), instant(time))
        return [*(w - c for w, c in zip(rotated, _ahead(self)[0], strict=False)), *rotated[3:]]

    def xi_at(self, time: Fraction) -> list[arb]:
        xi = _top_of(self).attitude(time, current_precision() + _ATTITUDE_BITS)
        return self._turned(xi, ball(time))

    def _turned(self, vectors: Sequence[Balls], time: Balls) -> list[Balls]:
        """R(|c| t) of each three components."""
        _, speed, axis = _ahead(self)
        sine, cosine = (time * speed).sin_cos()
        rotated: list[Any] = []
        for begin in range(0, len(vectors), 3):
            rotated += about(axis, cosine, -sine, vectors[begin : begin + 3])
        return rotated


@dataclass(frozen=True, slots=True)
class SphericalGyrostat(LagrangeGyrostat):
    """The motion of a spherical gyrostat with its rotor along the centre of mass, or any rotor if it has no weight.

    Raises NotInClass unless I1 = I2 = I3 and k ∥ P r.
    """

    method = "closed form: spherical gyrostat, Weierstrass functions of n·gamma"
    source = "derived in the program; the spherical top with a rotor along the centre of mass"
    body = SPHERICAL, ExactRelation("k along P r", "k x P r", lambda top, _: cross(top.rotor or top.moment, top.moment))


@cached_per_precision
def _ahead(case: LagrangeGyrostat) -> tuple[list[arb], arb, list[arb]]:
    """c, |c| and the unit vector along it; without a rotor any one."""
    ahead, speed = balls(case.ahead), ball(dot(case.ahead, case.ahead)).sqrt()
    return ahead, speed, [c / speed for c in ahead] if any(case.ahead) else balls((_ONE, _ZERO, _ZERO))


@once
def _top_of(case: LagrangeGyrostat) -> Lagrange:
    """The motion of the top with the same M."""
    plain = HeavyTop(case.top.inertia, case.top.weight, case.top.centre)
    omega = [w + c for w, c in zip(case.start.omega, case.ahead, strict=True)]
    spherical = isinstance(case, SphericalGyrostat) and any(plain.moment)
    return (SphericalTop if spherical else Lagrange)(plain, State(omega, case.start.gamma))


# A top with I1 = I2 and P c = 0, in units near 1 and rotated so that its moment of weight is (c, 0, 0).
#
# Divided by I3 the equations hold for n/I3, and for λ = k3/I3 of a rotor along axis 3.  With exact powers of two
# Ω = rate Ω', γ = size γ', t = t'/rate they hold for n' = n size/(I3 rate²) and λ' = λ/rate; and a turn about axis 3,
# the axis of symmetry, takes n' to (c, 0, 0).


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
        """The data of a top with I1 = I2, P c = 0 and P r ≠ 0, and a rotor along axis 3 or none."""
        i3 = top.inertia[2]
        n1, n2 = (n / i3 for n in top.moment[:2])
        size = Fraction(2) ** exponent(max(map(abs, start.gamma)))
        rotor = top.rotor[2] / i3 if top.rotor else Fraction(0)
        pull = Fraction(2) ** (exponent(max(abs(n1), abs(n2)) * size) // 2)
        rate = Fraction(2) ** exponent(max(*map(abs, start.omega), abs(rotor), pull))
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
        c, vectors = ball(self.moment_square).sqrt(), []
        for vector in (self.omega, self.gamma):
            vectors += [ball(self.along(vector)) / c, ball(self.across(vector)) / c, ball(vector[2])]
        return vectors

    def in_body(self, vector: Sequence[Balls]) -> list[Balls]:
        """A vector of the turned frame in the axes of the top."""
        c = ball(self.moment_square).sqrt()
        cosine, sine = (ball(n) / c for n in self.moment)
        x, y, z = vector
        return [cosine * x - sine * y, sine * x + cosine * y, z]

    def restored(self, motion: Sequence[Any]) -> list[Any]:
        """Six series in t', or numbers, of the turned frame, in the axes and units of the top, as :func:`in_units`."""
        return in_units([*self.in_body(motion[:3]), *self.in_body(motion[3:])], self.rate, self.size)


def polynomial(*coefficients: Fraction) -> fmpq_poly:
    """The polynomial with these coefficients of 1, w, w², ..."""
    return fmpq_poly([rational(c) for c in coefficients])
