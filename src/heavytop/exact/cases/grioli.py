"""Grioli's regular precession of an asymmetric top, about an axis that is not vertical.

The top: b = 0, (I2 − I3) a² = (I1 − I2) c², I1 ≠ I3: r is normal to a circular section of the gyration ellipsoid.
With n = P r, r̂ = n/|n|, D = I1 − I2 + I3, κ = n1 n3 (I1 − I3)/|n|², the body spins about r̂ and precesses about a
unit vector u ⟂ r̂ fixed in space, both at the rate ν:

    Ω = ν (r̂ + u),   u' = ν w,   w = u × r̂,   u(t) = u cos νt + w sin νt
    γ = (ν²/|n|) ( D u − κ (u·e2) w + κ (u·(r̂ × e2)) r̂ )

γ is at rest in space, since u, w cos νt + r̂ sin νt and r̂ cos νt − w sin νt are; (1.1) then fixes ν² and the phase.
All of it is rational in the start, so that membership is an exact test.
Source: G. Grioli, Ann. Mat. Pura Appl. 26 (1947) 271; Borisov and Mamaev, Rigid Body Dynamics.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from heavytop.exact.closed_form import Carry, WithAttitude, balls, between
from heavytop.exact.flint.balls import Balls, ball
from heavytop.exact.solution import IN_PLANE_13, MOMENTS_1_3, TORQUE, ExactRelation
from heavytop.precision import Vector, cross, dot
from heavytop.top.heavy_top import HeavyTop, State


def _section(top: HeavyTop, _start: State) -> tuple[Fraction]:
    (i1, i2, i3), n = top.inertia, top.moment
    return ((i2 - i3) * n[0] ** 2 - (i1 - i2) * n[2] ** 2,)


def _rates(top: HeavyTop, start: State) -> tuple[Fraction]:
    omega, n = start.omega, top.moment
    return (Fraction(dot(omega, omega) * dot(n, n) - 2 * dot(omega, n) ** 2),)


def _gamma_off(top: HeavyTop, start: State) -> list[Fraction]:
    return [g - component for g, component in zip(start.gamma, gamma_of(top, start.omega), strict=True)]


@dataclass(frozen=True, slots=True)
class Grioli(WithAttitude):
    """Every Grioli precession of a top with b = 0.  Raises NotInClass where the top, Ω or γ is not one's exactly."""

    method = "closed form: Grioli regular precession"
    source = "G. Grioli, Ann. Mat. Pura Appl. 26 (1947) 271"
    body = (
        IN_PLANE_13,
        TORQUE,
        MOMENTS_1_3,
        ExactRelation("(I2 - I3) a^2 = (I1 - I2) c^2", "P^2 times the difference", _section),
    )
    starts = (
        ExactRelation("Omega != 0", "Omega", lambda _, start: start.omega, any),
        ExactRelation("|Omega|^2 |P r|^2 = 2 (Omega·P r)^2", "the difference of spin and precession", _rates),
        ExactRelation("gamma as it follows from Omega", "the difference", _gamma_off),
    )

    def motion(self, time: Balls) -> tuple[list[Balls], Carry]:
        n = self.top.moment
        length = ball(dot(n, n)).sqrt()
        axis = [component / length for component in balls(n)]
        rate = ball(dot(self.start.omega, n)) / length
        u0 = [w / rate - r for w, r in zip(balls(self.start.omega), axis, strict=True)]
        w0 = cross(u0, axis)
        sine, cosine = (rate * time).sin_cos()
        u = [cosine * a + sine * b for a, b in zip(u0, w0, strict=True)]
        w = [cosine * b - sine * a for a, b in zip(u0, w0, strict=True)]
        space = (
            u,
            [cosine * b + sine * r for b, r in zip(w, axis, strict=True)],
            [cosine * r - sine * b for b, r in zip(w, axis, strict=True)],
        )
        return [rate * (a + r) for a, r in zip(u, axis, strict=True)], between((u0, w0, axis), space)


def gamma_of(top: HeavyTop, omega: Vector) -> list[Fraction]:
    """The γ that belongs to Ω, a rational function: all roots cancel."""
    (i1, i2, i3), n = top.inertia, top.moment
    square, spin = dot(n, n), dot(omega, n)
    kappa = n[0] * n[2] * (i1 - i3) / square
    phase = dot(omega, cross(n, (Fraction(0), Fraction(1), Fraction(0))))
    across = cross(omega, n)
    return [
        ((i1 - i2 + i3) * spin * (w - spin * e / square) - kappa * omega[1] * x + kappa * spin * phase * e / square)
        / square
        for w, e, x in zip(omega, n, across, strict=True)
    ]
