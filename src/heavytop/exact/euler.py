"""Euler-Poinsot: no moment of the weight, P r = 0, from every start.

Write L² = |M|², 2E = Ω·M, both constant, and e_i = (L² I_i + 2E I_j I_k)/(I1 I2 I3).  Sort the axes so that
e_a ≥ e_b ≥ e_c; then c is the axis of the middle moment, a the axis that M circles, and with p² = e_a − e_c,
m = (e_b − e_c)/p², u = p t + u0

    Ω_a = A_a dn(u|m),   Ω_b = A_b cn(u|m),   Ω_c = A_c sn(u|m)
    A_a² = (L² − 2E I_b)/(I_a (I_a − I_b)),
    A_b² = (L² − 2E I_a)/(I_b (I_b − I_a)),   A_c² = (L² − 2E I_a)/(I_c (I_c − I_a))

with A_a A_b A_c of the sign that the equation for Ω_c asks for.  m = 0 is the symmetric top, m = 1 the separatrix.

Attitude (Jacobi): the projection of e_b across M, which never vanishes, turns about M in space through ψ,

    ψ' = L (2E − I_b Ω_b²)/(L² − I_b² Ω_b²),   e^{iψ} = e^{iμt} θ1(u + iy)/|θ1(u + iy)| up to a constant,
    cn(iy) = L/(I_b |A_b|), that is |y| = F(φ|1 − m) with cos²φ = I_b² A_b²/L²; y has the sign of I_a − I_c

and μ from ψ' at u = 0.  Every vector fixed in space, γ among them, keeps its components on M, on that projection
turned back by ψ, and across both.  Where Ω × M = 0 the rotation is steady and space turns about Ω at the rate |Ω|.

Sources: Whittaker, Analytical Dynamics, §69; Landau and Lifshitz, Mechanics, §37; DLMF 22.19(iv).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from flint import acb, acb_series, arb, arb_series, ctx

from heavytop.errors import NotInClass
from heavytop.exact.balls import ball
from heavytop.exact.closed_form import Carry, WithAttitude, balls, imaginary_part, real_part, sign, turned
from heavytop.exact.jacobi import Jacobi, jacobi, legendre_f
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State, cross, dot

_EVEN = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True, slots=True)
class Euler(WithAttitude):
    """Every motion of a top without moment of the weight.  Raises NotInClass unless P r = 0 exactly."""

    top: HeavyTop
    start: State
    method: str = "closed form: Euler-Poinsot, Jacobi functions"
    system: System = HEAVY_TOP

    def __post_init__(self) -> None:
        if any(self.top.moment):
            moment = ", ".join(str(n) for n in self.top.moment)
            raise NotInClass(
                f"Euler-Poinsot needs P r = 0, but P r = ({moment}).", "Set the weight or the centre of mass to 0."
            )

    @property
    def steady(self) -> bool:
        """Ω × M = 0: Ω stays what it is."""
        omega = self.start.omega
        return not any(cross(omega, self.top.angular_momentum(omega)))

    def motion(self, time: arb_series) -> tuple[list[Any], Carry]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        lattice = _lattice(self, ctx.prec)
        if lattice is not None:
            return lattice.motion(time)
        omega = balls(self.start.omega)
        if not any(self.start.omega):
            return omega, list
        rate = ball(dot(self.start.omega, self.start.omega)).sqrt()
        return omega, lambda vector: turned(vector, omega, rate, time)


@dataclass(frozen=True, slots=True)
class _Lattice:
    """All that does not depend on the time, at one working precision.

    axes: (a, b, c).  amplitudes: A by axis.  rate: p.  origin: u0.  pole: y.  drift: μ, per unit of time.
    momentum: L.  frame: M/L, the projection of e_b and their cross product at t = 0.  phase: e^{iψ} at t = 0 but for
    its constant.  period: its factor over 2K.
    """

    axes: tuple[int, int, int]
    inertia: list[arb]
    amplitudes: dict[int, arb]
    functions: Jacobi
    rate: arb
    origin: arb
    pole: arb
    drift: arb
    momentum: arb
    frame: tuple[Sequence[Any], ...]
    phase: acb
    period: acb

    def motion(self, time: arb_series) -> tuple[list[arb_series], Carry]:
        a, b, c = self.axes
        u = self.rate * time + self.origin
        sn, cn, dn = self.functions.functions(u)
        by_axis = {a: self.amplitudes[a] * dn, b: self.amplitudes[b] * cn, c: self.amplitudes[c] * sn}
        omega = [by_axis[axis] for axis in range(3)]
        along, projection, across = _frame([i * w for i, w in zip(self.inertia, omega, strict=True)], self.momentum, b)
        sine, cosine = arb_series.sin_cos(self.drift * time)
        turn = (acb_series(cosine, prec=ctx.cap) + acb(0, 1) * acb_series(sine, prec=ctx.cap)) * (
            self.functions.phase(u, self.pole, self.period) / self.phase
        )
        cosine, sine = real_part(turn), imaginary_part(turn)
        space = (
            along,
            [cosine * q - sine * r for q, r in zip(projection, across, strict=True)],
            [sine * q + cosine * r for q, r in zip(projection, across, strict=True)],
        )

        def carry(vector: Sequence[Any]) -> list[Any]:
            parts = [dot(vector, axis) for axis in self.frame]
            return [sum(part * axis[k] for part, axis in zip(parts, space, strict=True)) for k in range(3)]

        return omega, carry


@lru_cache(maxsize=64)
def _lattice(case: Euler, _bits: int) -> _Lattice | None:
    """None for a steady rotation."""
    if case.steady:
        return None
    inertia, omega = case.top.inertia, case.start.omega
    momentum = case.top.angular_momentum(omega)
    square, energy = dot(momentum, momentum), dot(omega, momentum)
    roots = [(square * i + energy * j * k) / (i * j * k) for i, j, k in (_rotate(inertia, axis) for axis in range(3))]
    a, b, c = axes = tuple(sorted(range(3), key=lambda axis: -roots[axis]))
    ia, ib, ic = (inertia[axis] for axis in axes)
    rate2 = roots[a] - roots[c]
    functions = jacobi(ball((roots[b] - roots[c]) / rate2), ball((roots[a] - roots[b]) / rate2))
    aa = (square - energy * ib) / (ia * (ia - ib))
    ab = (square - energy * ia) / (ib * (ib - ia))
    ac = (square - energy * ia) / (ic * (ic - ia))
    sign_a, sign_b = sign(omega[a]), sign(omega[b])
    sign_c = sign_a * sign_b * sign(ia - ib) * (1 if (c, a, b) in _EVEN else -1)
    ratios = (omega[c] ** 2 / ac, omega[b] ** 2 / ab, omega[a] ** 2 / aa)
    origin = sign(omega[c]) * sign_c * legendre_f(*balls(ratios))
    sine2 = ia * ia * aa / square
    complement = (roots[a] - roots[b]) / rate2
    # y is measured in u: the pole of ψ' nearest to the real line
    pole = sign(ia - ic) * legendre_f(*balls((sine2, ib * ib * ab / square, 1 - complement * sine2)))
    period = functions.phase_period(pole)
    length, rate = ball(square).sqrt(), ball(rate2).sqrt()
    drift = length * ball((energy - ib * ab) / (square - ib * ib * ab)) - rate * functions.phase_rate(pole)
    return _Lattice(
        axes=(a, b, c),
        inertia=balls(inertia),
        amplitudes={a: sign_a * ball(aa).sqrt(), b: sign_b * ball(ab).sqrt(), c: sign_c * ball(ac).sqrt()},
        functions=functions,
        rate=rate,
        origin=origin,
        pole=pole,
        drift=drift,
        momentum=length,
        frame=_frame(balls(momentum), length, b),
        phase=functions.phase(origin, pole, period)[0],
        period=period,
    )


def _rotate(values: Sequence[Fraction], axis: int) -> tuple[Fraction, Fraction, Fraction]:
    return values[axis], values[(axis + 1) % 3], values[(axis + 2) % 3]


def _frame(momentum: Sequence[Any], length: arb, axis: int) -> tuple[Sequence[Any], ...]:
    """M/L, the unit vector along the projection of the axis across M, and their cross product."""
    along = [component / length for component in momentum]
    first, second = along[(axis + 1) % 3], along[(axis + 2) % 3]
    across = (first * first + second * second).sqrt()
    projection = [-along[axis] * component / across for component in along]
    projection[axis] = across
    return along, projection, cross(along, projection)
