"""Hess' tops, M·γ ≠ 0: the height of the centre of mass is elliptic, the rest a linear system with its period.

n = P r = (a, 0, c), N = |n|, with I1 (I2 − I3) a² = I3 (I1 − I2) c²: r stands across a circular section of the
ellipsoid of inertia of the moments 1/I.  M·n = 0 at the start then holds for ever.  In units with I2 = 1, with
e_z = n/N, e_x = (c, 0, −a)/N, e_y, β = ac (1/I1 − 1/I3)/N², C0 = M·γ and the energy E,

    M = ρ (cos φ e_x + sin φ e_y),   s = n·γ = Nγ_z,   ρ² = 2 (E − s),   γ_x + iγ_y = ρe^(iφ) (C0 − iγ_z')/ρ²
    s'² = 2 (E − s)(N²|γ|² − s²) − C0²N²,      φ' = −βρ cos φ − NC0/ρ²

The cubic is rational; s = m + d cos θ swings between its two lower roots (:mod:`heavytop.exact.gaps`), a spherical
pendulum.  tan(φ/2) = v/u, where with ω = NC0/ρ²

    u' = ½ (ω − βρ) v,   v' = −½ (ω + βρ) u

*What "closed form" means here.*  s is an elliptic function.  The linear system has no solution in known functions for
general moments (Nekrasov; it is a Floquet problem), but its period is that of s: the matrix over one period is made
once, and (u, v) at any time is a power of it applied to the start, so that the cost does not grow with the time.  The
matrix comes from Taylor polynomials with a proven tail (:mod:`heavytop.exact.hess_transfer`).

M·γ = 0 is elementary in the angle of a pendulum: :mod:`heavytop.exact.hess_pendulum`.
Where the two lower roots coincide, s rests: refused.
Source: W. Hess, Math. Ann. 37 (1890) 153; P. A. Nekrasov, Mat. sbornik 16 (1892) 508; derived here from the equations.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb, arb_mat, arb_series

from heavytop.errors import LevelNotDone
from heavytop.exact.abel import Inversion
from heavytop.exact.azimuth import Azimuth, Bearing, WithBearing
from heavytop.exact.balls import Undecided, ball
from heavytop.exact.closed_form import ClosedForm
from heavytop.exact.conditions import ACROSS_CENTRE, GAMMA, HESS_TOP, INCLINED_MOMENTUM
from heavytop.exact.flint_context import current_length, whole_evaluation
from heavytop.exact.gaps import Gap, Roots
from heavytop.exact.hess_level import Level
from heavytop.exact.hess_transfer import System2, Transfer, plan
from heavytop.exact.motion import kept
from heavytop.exact.one_gap import in_units
from heavytop.exact.separated import REMEDY, decide
from heavytop.top.heavy_top import cross, dot

_LEAST = 256
_MOST_TERMS = 1 << 14


@dataclass(frozen=True, slots=True)
class Hess(WithBearing, ClosedForm):
    """A motion of Hess' top with M·γ ≠ 0 and the centre of mass in the plane of axes 1 and 3.

    Raises NotInClass unless P b = 0, P r ≠ 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², M·P r = 0 and M·γ ≠ 0, all exactly,
    and where n·γ rests.
    """

    method = "closed form: Hess, elliptic height and the matrix of a linear system over its period"
    body = HESS_TOP
    starts = ACROSS_CENTRE, GAMMA, INCLINED_MOMENTUM

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        level = Level.of(self.top, self.start)
        cubic = level.cubic()
        if cubic.gcd(cubic.derivative()).degree() > 0:
            raise LevelNotDone("The level is degenerate: P r·gamma rests at a double root.", REMEDY)
        _require_reach(level)

    def own_time(self, time: Fraction) -> Fraction:
        """In the level's unit: the matrix over its period costs much at many bits."""
        return Level.of(self.top, self.start).rate * time

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        motion = _motion(self)
        return in_units(motion.at(ball(motion.level.rate * time)), motion.level.rate, motion.level.size)

    def bearing(self, time: Fraction) -> Bearing:
        """See :class:`heavytop.exact.azimuth.WithBearing`."""
        motion = _motion(self)
        return motion.bearing(_azimuth(self), ball(motion.level.rate * time))


@kept
def _azimuth(case: Hess) -> Azimuth:
    return _motion(case).azimuth()


@kept
def _motion(case: Hess) -> HessMotion:
    return HessMotion.of(Level.of(case.top, case.start))


@whole_evaluation
def _require_reach(level: Level) -> None:
    """Raises LevelNotDone where the Fourier series of the elliptic integral is too long, or the linear system."""
    decide(lambda: plan(_linear(level, level.gap(_MOST_TERMS))), "The level is all but degenerate", _LEAST)


def _linear(level: Level, gap: Gap) -> System2:
    """The linear system over the phase of the gap."""
    (_, high, top), energy = level.roots(), ball(level.energy)
    torque = ball(level.moment_square).sqrt() * ball(level.area)
    return System2(gap.reach, energy - high, top - high, torque, ball(level.skew))


@dataclass(frozen=True, slots=True)
class HessMotion:
    """A level at one working precision.

    energy, area, size: E, C0, N.  origin: Abel's integral at t = 0.  spinor: (u, v) at θ = 0.
    """

    level: Level
    gap: Gap
    energy: arb
    area: arb
    size: arb
    origin: arb
    linear: System2
    matrix: Transfer
    spinor: arb_mat

    @classmethod
    def of(cls, level: Level) -> HessMotion:
        """At the working precision.

        Raises Undecided where it does not suffice, OutOfReach where the series need too many terms.
        """
        gap = level.gap()
        energy, area, size = ball(level.energy), ball(level.area), ball(level.moment_square).sqrt()
        linear = _linear(level, gap)
        matrix = Transfer.of(linear)
        height = ball(level.height)
        speed = ball(dot(level.moment, cross(level.gamma, level.omega)))
        phase = gap.phase(height, speed * gap.density(height))
        x, y = level.in_plane(level.angular_momentum)
        length = (2 * (energy - height)).sqrt()
        start = arb_mat([[length + x], [y]]) if x > 0 else arb_mat([[y], [length - x]])
        spinor = matrix.inverse(phase) * start
        return cls(level, gap, energy, area, size, gap.integrals(phase)[0], linear, matrix, spinor)

    def at(self, time: arb) -> list[Any]:
        """Ω and γ at ``time`` in units of the level, numbers or series of the length set by :func:`series_length`.

        Raises Undecided where the working precision does not prove the phase.
        """
        phase, turns = self._phase(time)
        u, v = (self.matrix.at(phase, turns) * self.spinor).entries()
        scale = arb(2) ** -_exponent(abs(u) + abs(v))
        return self._state(*self._moving(phase, u * scale, v * scale))

    def _phase(self, time: arb) -> tuple[arb, int]:
        (phase,), (turns,) = Inversion((self.gap,), (1,)).phases([self.origin + time])
        if not phase.is_finite():
            raise Undecided
        return phase, turns

    def azimuth(self) -> Azimuth:
        """That of n about γ: Λ' = C0 |γ| N²/(N²|γ|² − s²)."""
        low, high, top = self.level.roots()
        gamma = ball(dot(self.level.gamma, self.level.gamma)).sqrt()
        pole = self.size * gamma
        gap = Gap(low, high, Roots.of(arb(2), [(acb(top), 1), (acb(pole), 2), (acb(-pole), 2)]), count=1)
        return Azimuth(gap, (self.area * gamma * self.size**2,))

    def bearing(self, azimuth: Azimuth, time: arb) -> Bearing:
        """n, level, and its azimuth at ``time``."""
        phase, turns = self._phase(time)
        return Bearing.of(self.at(time)[3:], [ball(n) for n in self.level.moment], azimuth.at(phase, turns))

    def _moving(self, phase: arb, u: arb, v: arb) -> tuple[Any, Any, Any]:
        """(θ, u, v) as power series in t, from their differential equations."""
        if current_length() == 1:
            return phase, u, v
        now: tuple[Any, ...] = tuple(arb_series([x], prec=current_length()) for x in (phase, u, v))
        for _ in range(current_length() - 1):
            rate = 1 / self.gap.density(self.gap.position(now[0]))
            b, c = self.linear.entries(now[0])
            slopes = rate, b * rate * now[2], c * rate * now[1]
            now = tuple(x + slope.integral() for x, slope in zip((phase, u, v), slopes, strict=True))
        moving, first, second = now
        return moving, first, second

    def _state(self, phase: Any, u: Any, v: Any) -> list[Any]:
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


def _exponent(value: arb) -> int:
    """About log2 of a positive ball; 0 where it is not finite."""
    if not value.is_finite() or value.is_zero():
        return 0
    mantissa, power = value.mid().man_exp()
    return int(power) + int(mantissa).bit_length()
