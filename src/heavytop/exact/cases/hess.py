"""Hess' tops, M·γ ≠ 0: the height of the centre of mass is elliptic, the rest a linear system with its period.

n = P r = (a, 0, c), N = |n|, with I1 (I2 − I3) a² = I3 (I1 − I2) c²: r is normal to a circular section of the
ellipsoid of inertia of the moments 1/I.  M·n = 0 at the start then holds at all times.  In units with I2 = 1, with
e_z = n/N, e_x = (c, 0, −a)/N, e_y, β = ac (1/I1 − 1/I3)/N², C0 = M·γ and the energy E,

    M = ρ (cos φ e_x + sin φ e_y),   s = n·γ = Nγ_z,   ρ² = 2 (E − s),   γ_x + iγ_y = ρe^(iφ) (C0 − iγ_z')/ρ²
    s'² = 2 (E − s)(N²|γ|² − s²) − C0²N²,      φ' = −βρ cos φ − NC0/ρ²

The cubic is rational; s = m + d cos θ swings between its two lower roots (:mod:`heavytop.exact.separable.oscillation`),
a spherical pendulum.  tan(φ/2) = v/u, where with ω = NC0/ρ²

    u' = ½ (ω − βρ) v,   v' = −½ (ω + βρ) u

*What "closed form" means here.*  s is an elliptic function.  The linear system has no solution in known functions for
general moments (Nekrasov; it is a Floquet problem), but its period is that of s: the matrix over one period is computed
once, and (u, v) at any time is a power of it applied to the start, so that the cost does not grow with the time.  The
matrix follows from Taylor polynomials with a proven tail (:mod:`heavytop.exact.cases.hess_transfer`).

M·γ = 0 is elementary in the angle of a pendulum, below.
Where the two lower roots coincide, s rests: refused.
Source: W. Hess, Math. Ann. 37 (1890) 153; P. A. Nekrasov, Mat. sbornik 16 (1892) 508; derived here from the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import acb, arb, arb_mat, arb_series, fmpq_poly

from heavytop.errors import LevelNotDone
from heavytop.exact.cases.hess_transfer import System2, Transfer, plan
from heavytop.exact.cases.lagrange import polynomial
from heavytop.exact.cases.pendulum import Swing, swing
from heavytop.exact.closed_form import (
    Carry,
    ClosedForm,
    WithAttitude,
    between,
    cached_per_precision,
    constant,
    in_units,
    sign,
    solved,
    tanh_sech,
)
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    Undecided,
    ball,
    exponent,
    midpoint,
    unit_of_time,
)
from heavytop.exact.separable.abel import REMEDY, decide, phase_at
from heavytop.exact.separable.oscillation import MOST_TERMS, Azimuth, Bearing, Gap, Roots, WithBearing
from heavytop.exact.solution import ACROSS_CENTRE, GAMMA, HESS_TOP, INCLINED_MOMENTUM, LEVEL_MOMENTUM, ExactRelation
from heavytop.precision import cross, dot
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

# The exact data of a motion of Hess' top: the conditions of the class, and the cubic of the height.
#
# Notation and formulas are those above.


@dataclass(frozen=True, slots=True)
class HessLevel:
    """The exact data with I2 = 1, Ω and γ in units of ``rate`` and ``size``; moment: n in these units."""

    rate: Fraction
    size: Fraction
    inertia: tuple[Fraction, Fraction, Fraction]
    moment: tuple[Fraction, Fraction, Fraction]
    omega: tuple[Fraction, Fraction, Fraction]
    gamma: tuple[Fraction, Fraction, Fraction]

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> HessLevel:
        """The data in units near 1."""
        rate = Fraction(2) ** unit_of_time(HEAVY_TOP.parameters(top, start), start.flat)
        size = Fraction(2) ** exponent(max(map(abs, start.gamma)))
        i1, i2, i3 = top.inertia
        n1, n2, n3 = (n * size / (i2 * rate**2) for n in top.moment)
        w1, w2, w3 = (w / rate for w in start.omega)
        g1, g2, g3 = (g / size for g in start.gamma)
        return cls(rate, size, (i1 / i2, Fraction(1), i3 / i2), (n1, n2, n3), (w1, w2, w3), (g1, g2, g3))

    @property
    def angular_momentum(self) -> tuple[Fraction, ...]:
        """M."""
        return tuple(i * w for i, w in zip(self.inertia, self.omega, strict=True))

    @property
    def area(self) -> Fraction:
        """C0."""
        return Fraction(dot(self.angular_momentum, self.gamma))

    @property
    def height(self) -> Fraction:
        """s."""
        return Fraction(dot(self.moment, self.gamma))

    @property
    def energy(self) -> Fraction:
        """E."""
        return Fraction(dot(self.omega, self.angular_momentum) / 2 + self.height)

    @property
    def moment_square(self) -> Fraction:
        """N²."""
        return Fraction(dot(self.moment, self.moment))

    @property
    def skew(self) -> Fraction:
        """β."""
        return self.moment[0] * self.moment[2] * (1 / self.inertia[0] - 1 / self.inertia[2]) / self.moment_square

    def cubic(self) -> fmpq_poly:
        """s'² as a polynomial of s."""
        zero, one, square = Fraction(0), Fraction(1), self.moment_square
        limit = polynomial(square * dot(self.gamma, self.gamma), zero, -one)
        return 2 * polynomial(self.energy, -one) * limit - polynomial(self.area**2 * square)

    def gap(self, most: int = MOST_TERMS) -> Gap:
        """The range of s at the working precision; raises OutOfReach, and Undecided where roots coincide."""
        low, high, top = self.roots()
        if not low < high < top:
            raise Undecided
        return Gap(low, high, Roots.of(arb(2), [(acb(top), 1)]), count=1, most=most)

    def roots(self) -> list[arb]:
        """The three roots of the cubic, in order."""
        roots: Any = self.cubic().complex_roots()
        return sorted((root.real for root, _ in roots), key=midpoint)


_LEAST = 256
_MOST_TERMS = 1 << 14


@dataclass(frozen=True, slots=True)
class Hess(WithBearing, ClosedForm):
    """A motion of Hess' top with M·γ ≠ 0 and the centre of mass in the plane of axes 1 and 3.

    Raises NotInClass unless P b = 0, P r ≠ 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², M·P r = 0 and M·γ ≠ 0, all exactly,
    and where n·γ rests.
    """

    method = "closed form: Hess, elliptic height and the matrix of a linear system over its period"
    source = "W. Hess, Math. Ann. 37 (1890) 153; P. A. Nekrasov, Mat. sbornik 16 (1892) 508"
    body = HESS_TOP
    starts = ACROSS_CENTRE, GAMMA, INCLINED_MOMENTUM

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        level = HessLevel.of(self.top, self.start)
        cubic = level.cubic()
        if cubic.gcd(cubic.derivative()).degree() > 0:
            raise LevelNotDone("The level is degenerate: P r·gamma rests at a double root.", REMEDY)
        # the Fourier series of the elliptic integral may be too long, or the linear system
        decide(lambda: plan(_linear(level, level.gap(_MOST_TERMS))), "The level is nearly degenerate", _LEAST)

    def own_time(self, time: Fraction) -> Fraction:
        """``time`` in the unit of the level: the matrix over its period is costly at many bits."""
        return HessLevel.of(self.top, self.start).rate * time

    def evaluate(self, time: Fraction) -> list[Any]:
        motion = _motion(self)
        return in_units(motion.at(ball(motion.level.rate * time)), motion.level.rate, motion.level.size)

    def bearing(self, time: Fraction) -> Bearing:
        motion = _motion(self)
        return motion.bearing(ball(motion.level.rate * time))


@cached_per_precision
def _motion(case: Hess) -> HessMotion:
    return HessMotion.of(HessLevel.of(case.top, case.start))


def _linear(level: HessLevel, gap: Gap) -> System2:
    """The linear system over the phase of the gap."""
    (_, high, top), energy = level.roots(), ball(level.energy)
    torque = ball(level.moment_square).sqrt() * ball(level.area)
    return System2(gap.reach, energy - high, top - high, torque, ball(level.skew))


@dataclass(frozen=True, slots=True)
class HessMotion:
    """A level at one working precision.

    energy, area, size: E, C0, N.  origin: Abel's integral at t = 0.  spinor: (u, v) at θ = 0.
    """

    level: HessLevel
    gap: Gap
    energy: arb
    area: arb
    size: arb
    origin: arb
    linear: System2
    matrix: Transfer
    spinor: arb_mat
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, level: HessLevel) -> HessMotion:
        """The motion at the working precision.

        Raises Undecided where that does not suffice, OutOfReach where the series need too many terms.
        """
        gap = level.gap()
        energy, area, size = ball(level.energy), ball(level.area), ball(level.moment_square).sqrt()
        linear = _linear(level, gap)
        matrix = Transfer.of(linear)
        height = ball(level.height)
        speed = ball(dot(level.moment, cross(level.gamma, level.omega)))
        phase = gap.phase(height, speed * gap.density(height))
        (a, _, c), momentum = level.moment, level.angular_momentum
        x, y = ball(c * momentum[0] - a * momentum[2]) / size, ball(momentum[1])
        length = (2 * (energy - height)).sqrt()
        start = arb_mat([[length + x], [y]]) if x > 0 else arb_mat([[y], [length - x]])
        spinor = matrix.inverse(phase) * start
        return cls(level, gap, energy, area, size, gap.integrals(phase)[0], linear, matrix, spinor)

    def at(self, time: arb) -> list[Any]:
        """Ω and γ at ``time`` in units of the level, numbers or series of the length set by :func:`series_length`.

        Raises Undecided where the working precision does not prove the phase.
        """
        phase, turns = phase_at(self.gap, self.origin + time)
        u, v = (self.matrix.at(phase, turns) * self.spinor).entries()
        scale = 1 / (abs(u) + abs(v)).mid()
        return self._state(*solved((phase, u * scale, v * scale), self._rates))

    @cached_per_precision
    def azimuth(self) -> Azimuth:
        """The azimuth of n about γ: Λ' = C0 |γ| N²/(N²|γ|² − s²)."""
        low, high, top = self.level.roots()
        gamma = ball(dot(self.level.gamma, self.level.gamma)).sqrt()
        pole = self.size * gamma
        gap = Gap(low, high, Roots.of(arb(2), [(acb(top), 1), (acb(pole), 2), (acb(-pole), 2)]), count=1)
        return Azimuth(gap, (self.area * gamma * self.size**2,))

    def bearing(self, time: arb) -> Bearing:
        """n, level, and its azimuth at ``time``."""
        phase, turns = phase_at(self.gap, self.origin + time)
        return Bearing.of(self.at(time)[3:], [ball(n) for n in self.level.moment], self.azimuth().at(phase, turns))

    def _rates(self, now: Sequence[Any]) -> list[Any]:
        """θ', u' and v'."""
        rate = 1 / self.gap.density(self.gap.position(now[0]))
        b, c = self.linear.entries(now[0])
        return [rate, b * rate * now[2], c * rate * now[1]]

    def _state(self, phase: Balls, u: Balls, v: Balls) -> list[Balls]:
        s = self.gap.position(phase)
        square = 2 * (self.energy - s)
        share = square.sqrt() / (u * u + v * v)
        x, y = (u * u - v * v) * share, 2 * u * v * share
        climb = -self.gap.reach * phase.sin() / (self.gap.density(s) * self.size)
        across = (x * self.area + y * climb) / square, (y * self.area - x * climb) / square
        a, _, c = (ball(n) / self.size for n in self.level.moment)
        i1, _, i3 = map(ball, self.level.inertia)
        z = s / self.size
        return [c * x / i1, y, -a * x / i3, c * across[0] + a * z, across[1], c * z - a * across[0]]


# Hess' tops, M·γ = 0: elementary in the angle of a pendulum.
#
# In the notation above, with α = 1/I2 and a unit vector e = cos φ e_x + sin φ e_y,
# J e = cos φ e_y − sin φ e_x,
#
#     M = ρ e,   γ = |γ| (cos ϑ e_z + sin ϑ J e),   ϑ' = αρ,   ½ ϑ'²/α + N|γ| cos ϑ = E,   φ' = −βρ cos φ
#
# ϑ = x + π, x the angle of the pendulum of moment I2 (:mod:`heavytop.exact.cases.pendulum`), continuous; ρ changes its
# sign with x'.  φ is a loxodrome:
#
#     sin φ = tanh w,   cos φ = ε sech w,   w = w(0) − (β/α)(ϑ − ϑ(0)),   ε = sign cos φ(0)
#
# So a rotating pendulum tends to one about axis 2, forwards and backwards in time.  The torque γ × n = N|γ| sin ϑ e is
# along M: e is fixed in space, and e and γ determine every vector fixed in space.  Source: N. E. Zhukovsky, Trudy otd.
# fiz. nauk 5 (1893) 37 (the loxodromic pendulum); derived here from the equations.


def _direction(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """(N cos φ, sin φ) at t = 0 up to a positive factor: of M, or at rest of the side where sin ϑ > 0."""
    a, _, c = top.moment
    if any(start.omega):
        m1, m2, m3 = top.angular_momentum(start.omega)
        return c * m1 - a * m3, m2
    g1, g2, g3 = start.gamma
    return g2 * (a * a + c * c), a * g3 - c * g1


@dataclass(frozen=True, slots=True)
class HessPendulum(WithAttitude):
    """A motion of Hess' top with M·γ = 0 and the centre of mass in the plane of axes 1 and 3.

    Raises NotInClass unless P b = 0, P r ≠ 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², M·P r = 0 and M·γ = 0, all exactly,
    and for equilibria and rotations about axis 2.
    """

    method = "closed form: Hess with zero area integral, Jacobi functions"
    source = "W. Hess, Math. Ann. 37 (1890) 153; N. E. Zhukovsky, Trudy otd. fiz. nauk 5 (1892)"
    body = HESS_TOP
    starts = (
        ACROSS_CENTRE,
        GAMMA,
        LEVEL_MOMENTUM,
        ExactRelation(
            "M, or the torque, off axis 2",
            "its part in the plane of axes 1 and 3",
            lambda top, start: _direction(top, start)[:1],
            any,
        ),
    )

    def motion(self, time: Balls) -> tuple[list[Balls], Carry]:
        path, began = _path(self)
        frame, speed = path.at(time)
        size = path.inertia[1] * speed
        return [size * e / i for e, i in zip(frame[0], path.inertia, strict=True)], between(began, frame)


@cached_per_precision
def _path(case: HessPendulum) -> tuple[_Path, list[list[arb]]]:
    path = _Path.of(case.top, case.start)
    return path, path.at(arb(0))[0]


@dataclass(frozen=True, slots=True)
class _Path:
    """The constants of a motion.

    inertia: I as balls.  axis, level: e_z and e_x.  length: |γ|.  skew: 2β/α.  side: ε.  begin: w + 2 (β/α) (x/2) at
    t = 0.
    """

    inertia: list[arb]
    axis: list[arb]
    level: list[arb]
    swing: Swing
    skew: arb
    side: int
    begin: arb

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> _Path:
        (i1, i2, i3), (a, _, c), gamma = top.inertia, top.moment, start.gamma
        square = a * a + c * c
        size = ball(square).sqrt()
        cosine, sine = _direction(top, start)
        # sin ϑ has the sign of (e × γ)·e_z, and sin x the other
        tilt = cosine * gamma[1] - sine * (c * gamma[0] - a * gamma[2])
        kinetic = dot(start.omega, top.angular_momentum(start.omega)) / 2
        turning, (cosine0, sine0) = swing(
            i2, kinetic, dot(top.moment, gamma), square * dot(gamma, gamma), 1, sign(-tilt)
        )
        skew = 2 * ball(i2 * a * c * (1 / i1 - 1 / i3) / square)
        half = arb.atan2(sine0, cosine0)
        begin = (ball(sine) * size / abs(ball(cosine))).asinh() + skew * half
        axis, level = [[ball(x) / size for x in v] for v in ((a, Fraction(0), c), (c, Fraction(0), -a))]
        inertia = [ball(i) for i in (i1, i2, i3)]
        return cls(inertia, axis, level, turning, skew, sign(cosine), begin)

    def at(self, time: Balls) -> tuple[list[list[Balls]], Balls]:
        """(e, γ/|γ| and e × γ/|γ| in body components; x') at a number or series."""
        sine, cosine, speed = self.swing.at(time)
        half: BallLike = self.swing.half(constant(time))
        if isinstance(time, arb_series):
            half = half + (speed / 2).integral()
        tangent, secant = tanh_sech(self.begin - self.skew * half)
        secant = self.side * secant
        y = [arb(0), arb(1), arb(0)]
        along = [secant * x + tangent * e for x, e in zip(self.level, y, strict=True)]
        across = [secant * e - tangent * x for x, e in zip(self.level, y, strict=True)]
        # cos ϑ = −cos x, sin ϑ = −sin x
        upright, tilted = sine * sine - cosine * cosine, -2 * sine * cosine
        up = [upright * z + tilted * e for z, e in zip(self.axis, across, strict=True)]
        return [along, up, list(cross(along, up))], speed
