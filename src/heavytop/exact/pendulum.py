"""The physical pendulum: rotation about a principal axis k held level, centre of mass in the plane across it.

Ω = Ω_k e_k stays along axis k only if the torque does: (γ × n)_i = (γ × n)_j = 0, n = P r.  While Ω_k is not 0 the
part of γ across k turns, so that asks n_k = 0 and γ_k = 0, unless γ ∥ e_k ∥ n, which is a steady rotation.
With N = |n||γ| and x the angle of γ from −n in the plane (i, j, k cyclic), x' = −Ω_k:

    x'' = −(N/I_k) sin x,   h = ½ I_k Ω_k² + n·γ = ½ I_k x'² − N cos x

    h ≤ N:  sin(x/2) = σ √m sn u,  cos(x/2) = dn u,  x' = 2σ √m ω cn u,  m = (h + N)/(2N),  ω² = N/I_k
    h > N:  sin(x/2) = σ sn u,     cos(x/2) = cn u,  x' = 2σ ω dn u,     m = 2N/(h + N),    ω² = (h + N)/(2 I_k)

u = ω t + u0, and σ is the sign of x' at t = 0; h = N is the separatrix, m = 1.  Every vector fixed in space turns
about e_k through x(t) − x(0).  Source: Whittaker, Analytical Dynamics, chapter IV; DLMF 22.19.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import NotInClass
from heavytop.exact.balls import ball, whole
from heavytop.exact.closed_form import Carry, WithAttitude, balls, instant, sign
from heavytop.exact.jacobi import Jacobi, jacobi, legendre_f
from heavytop.exact.motion import kept
from heavytop.precision import shown
from heavytop.top.heavy_top import HeavyTop, State, dot


@dataclass(frozen=True, slots=True)
class Pendulum(WithAttitude):
    """Libration, rotation, separatrix and equilibria about any principal axis, |γ| as it is.

    Raises NotInClass unless, exactly, Ω lies along one principal axis with P r and γ in the plane across it, P r ≠ 0
    and γ ≠ 0.
    """

    method = "closed form: physical pendulum, Jacobi functions"

    def __post_init__(self) -> None:
        if not any(self.top.moment) or not any(self.start.gamma):
            raise NotInClass("A pendulum needs P r != 0 and gamma != 0.", "Without a torque the motion is Euler's.")
        if not _axes(self.top, self.start):
            omega, moment, gamma = self.start.omega, self.top.moment, self.start.gamma
            turning = [k for k in range(3) if omega[k] != 0]
            if len(turning) > 1:
                cause = f"Omega = ({', '.join(map(shown, omega))}) is not along a principal axis."
            elif turning:
                k = turning[0]
                cause = (
                    f"About axis {k + 1}, (P r)_{k + 1} = {shown(moment[k])} and gamma_{k + 1} = {shown(gamma[k])} "
                    "are not both 0."
                )
            else:
                cause = "At rest, P r and gamma do not lie in one plane across a principal axis."
            raise NotInClass(
                f"Not a pendulum: {cause}", "It turns about a principal axis, with P r and gamma across it."
            )

    @property
    def axis(self) -> int:
        """The principal axis k (0, 1 or 2) it turns about."""
        return _axes(self.top, self.start)[0]

    @property
    def steady(self) -> bool:
        """It stands still: at rest where no torque acts."""
        k, n, gamma = self.axis, self.top.moment, self.start.gamma
        return self.start.omega[k] == 0 and n[(k + 1) % 3] * gamma[(k + 2) % 3] == n[(k + 2) % 3] * gamma[(k + 1) % 3]

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        lattice = _lattice(self)
        if lattice is None:
            return WithAttitude.evaluate(self, time)
        omega, carry = lattice.motion(instant(time))
        return [*omega, *carry(lattice.gamma)]

    def motion(self, time: Any) -> tuple[list[Any], Carry]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        lattice = _lattice(self)
        return ([arb(0)] * 3, list) if lattice is None else lattice.motion(time)


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

    def at(self, time: Any) -> tuple[Any, Any, Any]:
        """(sin(x/2), cos(x/2), x') at a number or series."""
        sn, cn, dn = self.functions.functions(self.rate * time + self.origin)
        cosine, speed = (cn, dn) if self.rotating else (dn, cn)
        return self.amplitude * sn, cosine, self.speed * speed

    def half(self, time: arb) -> arb:
        """x/2, continuous for all times: it grows by π with every turn of a rotation."""
        sine, cosine, _ = self.at(time)
        quarter = self.functions.quarter
        if not self.rotating or quarter is None:
            return arb.atan2(sine, cosine)
        turns = whole((self.rate * time + self.origin) / (2 * quarter))
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
    """All that does not depend on the time.  axis: k.  half: (cos, sin) of x(0)/2."""

    axis: int
    swing: Swing
    half: tuple[arb, arb]
    gamma: list[arb]

    def motion(self, time: Any) -> tuple[list[Any], Carry]:
        sine, cosine, speed = self.swing.at(time)
        cosine0, sine0 = self.half
        c, s = cosine * cosine0 + sine * sine0, sine * cosine0 - cosine * sine0
        cosine, sine = c * c - s * s, 2 * c * s
        k = self.axis
        i, j = (k + 1) % 3, (k + 2) % 3
        omega: list[Any] = [arb(0)] * 3
        omega[k] = -speed

        def carry(vector: Sequence[Any]) -> list[Any]:
            result = list(vector)
            result[i] = cosine * vector[i] - sine * vector[j]
            result[j] = sine * vector[i] + cosine * vector[j]
            return result

        return omega, carry


@kept
def _lattice(case: Pendulum) -> _Lattice | None:
    """None where it stands still."""
    if case.steady:
        return None
    k = case.axis
    i, j = (k + 1) % 3, (k + 2) % 3
    n, gamma, inertia = case.top.moment, case.start.gamma, case.top.inertia[k]
    kinetic = inertia * case.start.omega[k] ** 2 / 2
    torque = n[i] * gamma[j] - n[j] * gamma[i]
    square = dot(n, n) * dot(gamma, gamma)
    moving, half = swing(inertia, kinetic, dot(n, gamma), square, sign(-case.start.omega[k]), sign(-torque))
    return _Lattice(k, moving, half, balls(gamma))


def _sum(square: Fraction, value: Fraction, product: Fraction) -> arb:
    """√square + value, without cancellation: product = square − value²; an exact 0 where it is 0."""
    root = ball(square).sqrt()
    return root + ball(value) if value >= 0 else ball(product) / (root - ball(value))


def _axes(top: HeavyTop, start: State) -> list[int]:
    """The axes about which this is a pendulum."""
    return [
        k
        for k in range(3)
        if top.moment[k] == start.gamma[k] == start.omega[(k + 1) % 3] == start.omega[(k + 2) % 3] == 0
    ]
