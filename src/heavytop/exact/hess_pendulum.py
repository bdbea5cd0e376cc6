"""Hess' tops, M·γ = 0: elementary in the angle of a pendulum.

In the notation of :mod:`heavytop.exact.hess`, with α = 1/I2 and a unit vector e = cos φ e_x + sin φ e_y,
J e = cos φ e_y − sin φ e_x,

    M = ρ e,   γ = |γ| (cos ϑ e_z + sin ϑ J e),   ϑ' = αρ,   ½ ϑ'²/α + N|γ| cos ϑ = E,   φ' = −βρ cos φ

ϑ = x + π, x the angle of the pendulum of moment I2 (:mod:`heavytop.exact.pendulum`), continuous; ρ changes its sign
with x'.  φ is a loxodrome:

    sin φ = tanh w,   cos φ = ε sech w,   w = w(0) − (β/α)(ϑ − ϑ(0)),   ε = sign cos φ(0)

So a pendulum that turns over tends to one about axis 2, both ways in time.  The torque γ × n = N|γ| sin ϑ e is along M:
e is fixed in space, and with γ it carries every vector that is.
Source: N. E. Zhukovsky, Trudy otd. fiz. nauk 5 (1893) 37 (the loxodromic pendulum); derived here from the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb, arb_series

from heavytop.exact.balls import ball
from heavytop.exact.closed_form import Carry, WithAttitude, constant, sign, tanh_sech
from heavytop.exact.conditions import ACROSS_CENTRE, GAMMA, HESS_TOP, LEVEL_MOMENTUM, Condition
from heavytop.exact.motion import kept
from heavytop.exact.pendulum import Swing, swing
from heavytop.top.heavy_top import HeavyTop, State, cross, dot


def _direction(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """(N cos φ, sin φ) at t = 0 but for a positive factor: of M, or at rest of the side where sin ϑ > 0."""
    a, _, c = top.moment
    if any(start.omega):
        m1, m2, m3 = top.angular_momentum(start.omega)
        return c * m1 - a * m3, m2
    g1, g2, g3 = start.gamma
    return g2 * (a * a + c * c), a * g3 - c * g1


def _in_plane(top: HeavyTop, start: State) -> tuple[Fraction]:
    return (_direction(top, start)[0],)


@dataclass(frozen=True, slots=True)
class HessPendulum(WithAttitude):
    """A motion of Hess' top with M·γ = 0 and the centre of mass in the plane of axes 1 and 3.

    Raises NotInClass unless P b = 0, P r ≠ 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², M·P r = 0 and M·γ = 0, all exactly,
    and for equilibria and rotations about axis 2.
    """

    method = "closed form: Hess with zero area integral, Jacobi functions"
    body = HESS_TOP
    starts = (
        ACROSS_CENTRE,
        GAMMA,
        LEVEL_MOMENTUM,
        Condition("M, or the torque, off axis 2", "its part in the plane of axes 1 and 3", _in_plane, any),
    )

    def motion(self, time: Any) -> tuple[list[Any], Carry]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        path, began = _path(self)
        frame, speed = path.at(time)
        size = path.inertia[1] * speed

        def carry(vector: Sequence[Any]) -> list[Any]:
            parts = [dot(vector, direction) for direction in began]
            return [sum(part * e[k] for part, e in zip(parts, frame, strict=True)) for k in range(3)]

        return [size * e / i for e, i in zip(frame[0], path.inertia, strict=True)], carry


@kept
def _path(case: HessPendulum) -> tuple[_Path, list[list[arb]]]:
    path = _Path.of(case.top, case.start)
    return path, path.at(arb(0))[0]


@dataclass(frozen=True, slots=True)
class _Path:
    """All that does not depend on the time.

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

    def at(self, time: Any) -> tuple[list[list[Any]], Any]:
        """(e, γ/|γ| and e × γ/|γ| in body components; x') at a number or series."""
        sine, cosine, speed = self.swing.at(time)
        half: Any = self.swing.half(constant(time))
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
