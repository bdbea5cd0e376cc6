"""Euler-Poinsot: no moment of the weight, P r = 0, from every start.

Write L² = |M|², 2E = Ω·M, both constant, and e_i = (L² I_i + 2E I_j I_k)/(I1 I2 I3).  Sort the axes so that
e_a ≥ e_b ≥ e_c; then c is the axis of the middle moment, a the axis that M circles, and with p² = e_a − e_c,
m = (e_b − e_c)/p², u = p t + u0

    Ω_a = A_a dn(u|m),   Ω_b = A_b cn(u|m),   Ω_c = A_c sn(u|m)
    A_a² = (L² − 2E I_b)/(I_a (I_a − I_b)),
    A_b² = (L² − 2E I_a)/(I_b (I_b − I_a)),   A_c² = (L² − 2E I_a)/(I_c (I_c − I_a))

with A_a A_b A_c of the sign that the equation for Ω_c requires.  m = 0 is the symmetric top, m = 1 the separatrix.

Attitude (Jacobi): the projection of e_b across M, which never vanishes, turns about M in space through ψ,

    ψ' = L (2E − I_b Ω_b²)/(L² − I_b² Ω_b²),   e^{iψ} = e^{iμt} θ1(u + iy)/|θ1(u + iy)| up to a constant,
    cn(iy) = L/(I_b |A_b|), that is |y| = F(φ|1 − m) with cos²φ = I_b² A_b²/L²; y has the sign of I_a − I_c

and μ from ψ' at u = 0.  Every vector fixed in space, γ among them, keeps its components on M, on that projection
turned back by ψ, and across both.  Where Ω × M = 0 the rotation is steady and space turns about Ω at the rate |Ω|.

Sources: Whittaker, Analytical Dynamics, chapter VI; Landau and Lifshitz, Mechanics, §37; DLMF 22.19.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import acb, arb

from heavytop.exact.closed_form import (
    CYCLIC,
    Carry,
    WithAttitude,
    balls,
    cached_per_precision,
    orientation,
    permuted,
    rotate,
    sign,
    unit,
)
from heavytop.exact.elliptic.jacobi import Jacobi, Wave, jacobi, legendre_f, wave
from heavytop.exact.elliptic.weierstrass import imag, real
from heavytop.exact.flint.balls import BallLike, Balls, ball
from heavytop.exact.solution import NO_TORQUE
from heavytop.precision import cross, dot


@dataclass(frozen=True, slots=True)
class Euler(WithAttitude):
    """Every motion of a top without moment of the weight.  Raises NotInClass unless P r = 0 exactly."""

    method = "closed form: Euler-Poinsot, Jacobi functions"
    source = "E. T. Whittaker, Analytical Dynamics, chapter VI"
    body = (NO_TORQUE,)

    def motion(self, time: BallLike) -> tuple[list[Any], Carry]:
        lattice = _lattice(self)
        if lattice is not None:
            return lattice.motion(time)
        return balls(self.start.omega), lambda vector: rotate(vector, self.start.omega, time)


@dataclass(frozen=True, slots=True)
class _Lattice:
    """The constants of a motion at one working precision.

    axes: (a, b, c).  shares: I/L.  amplitudes: A by axis.  rate: p.  origin: u0.  wave: the theta quotient of e^{iψ}.
    drift: μ, per unit of time.  frame: M/L, the projection of e_b across it and their cross product at t = 0.
    turn: the length of that projection over the wave at t = 0.
    """

    axes: tuple[int, int, int]
    shares: list[arb]
    amplitudes: dict[int, arb]
    functions: Jacobi
    rate: arb
    origin: arb
    wave: Wave
    drift: arb
    frame: tuple[Sequence[BallLike], ...]
    turn: acb

    def motion(self, time: Balls) -> tuple[list[Balls], Carry]:
        """Ω, and the map of vectors fixed in space."""
        a, b, c = self.axes
        u = self.rate * time + self.origin
        sn, cn, dn = self.functions.functions(u)
        by_axis = {a: self.amplitudes[a] * dn, b: self.amplitudes[b] * cn, c: self.amplitudes[c] * sn}
        omega = [by_axis[axis] for axis in range(3)]
        value, angle = self.wave.at(u)
        turning = value * unit(self.drift * time + angle)
        i, j = (b + 1) % 3, (b + 2) % 3
        along = [share * w for share, w in zip(self.shares, omega, strict=True)]
        square = along[i] * along[i] + along[j] * along[j]

        def carry(vector: Sequence[Any]) -> list[BallLike]:
            # conserved: the part along M, and the part across it as a factor of the wave
            part, projection, across = (dot(vector, axis) for axis in self.frame)
            rotated = acb(projection, -across) * self.turn * turning
            x, y = real(rotated), imag(rotated) / square
            share = part - x * along[b] / square
            result = [x + part * along[b]] * 3
            result[i], result[j] = along[i] * share - along[j] * y, along[j] * share + along[i] * y
            return result

        return omega, carry


@cached_per_precision
def _lattice(case: Euler) -> _Lattice | None:
    """The constants of the motion; None for a steady rotation, Ω × M = 0."""
    inertia, omega = case.top.inertia, case.start.omega
    momentum = case.top.angular_momentum(omega)
    if not any(cross(omega, momentum)):
        return None
    square, energy = dot(momentum, momentum), dot(omega, momentum)
    roots = [(square * i + energy * j * k) / (i * j * k) for i, j, k in (permuted(inertia, axes) for axes in CYCLIC)]
    a, b, c = axes = tuple(sorted(range(3), key=lambda axis: -roots[axis]))
    ia, ib, ic = (inertia[axis] for axis in axes)
    rate2 = roots[a] - roots[c]
    functions = jacobi(ball((roots[b] - roots[c]) / rate2), ball((roots[a] - roots[b]) / rate2))
    aa = (square - energy * ib) / (ia * (ia - ib))
    ab = (square - energy * ia) / (ib * (ib - ia))
    ac = (square - energy * ia) / (ic * (ic - ia))
    sign_a, sign_b = sign(omega[a]), sign(omega[b])
    sign_c = sign_a * sign_b * sign(ia - ib) * orientation((c, a, b))
    ratios = (omega[c] ** 2 / ac, omega[b] ** 2 / ab, omega[a] ** 2 / aa)
    origin = sign(omega[c]) * sign_c * legendre_f(*balls(ratios))
    sine2 = ia * ia * aa / square
    complement = (roots[a] - roots[b]) / rate2
    # y is measured in u: the pole of ψ' nearest to the real line
    pole = sign(ia - ic) * legendre_f(*balls((sine2, ib * ib * ab / square, 1 - complement * sine2)))
    waved = wave(functions, pole)
    length, rate = ball(square).sqrt(), ball(rate2).sqrt()
    drift = length * ball((energy - ib * ab) / (square - ib * ib * ab)) - rate * waved.rate()
    frame = _frame(balls(momentum), length, b)
    value, angle = waved.at(origin)
    return _Lattice(
        axes=(a, b, c),
        shares=[i / length for i in balls(inertia)],
        amplitudes={a: sign_a * ball(aa).sqrt(), b: sign_b * ball(ab).sqrt(), c: sign_c * ball(ac).sqrt()},
        functions=functions,
        rate=rate,
        origin=origin,
        wave=waved,
        drift=drift,
        frame=frame,
        turn=frame[1][b] / (value * unit(angle)),
    )


def _frame(momentum: Sequence[Balls], length: arb, axis: int) -> tuple[Sequence[Balls], ...]:
    """M/L, the unit vector along the projection of the axis across M, and their cross product."""
    along = [component / length for component in momentum]
    first, second = along[(axis + 1) % 3], along[(axis + 2) % 3]
    across = (first * first + second * second).sqrt()
    projection = [-along[axis] * component / across for component in along]
    projection[axis] = across
    return along, projection, cross(along, projection)
