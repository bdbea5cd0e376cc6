"""Staude's permanent rotations: Ω ∥ γ, both constant in the body; and every other start that stays what it is.

γ' = 0 asks Ω = ω γ, and M' = 0 then asks γ × (P r − ω² I γ) = 0.  So γ lies on Staude's cone, r·(I γ × γ) = 0, and

    ω² = P (I γ × γ)·(r × γ) / |I γ × γ|²     where γ is not a principal axis; it must not be negative.

On a principal axis that r lies on, every ω serves; on another one, none.  Turned about: P r = ω² I γ + κ γ gives
every top that turns about γ at the rate ω; with a rotor of momentum k, P r = ω² I γ + ω k + κ γ.  Space turns about Ω
in the body at the rate |Ω|.  Whether one is stable to first order :func:`staude_stability` says.
Source: O. Staude, J. reine angew. Math. 113 (1894) 318.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import gcd
from typing import Any

from flint import arb, fmpq_mat, fmpq_poly

from heavytop.errors import InputError, NotInClass
from heavytop.exact.closed_form import Carry, WithAttitude, balls, rotate
from heavytop.exact.flint.balls import BallLike, ball, rational, to_bits
from heavytop.exact.solution import equilibrium, require
from heavytop.precision import Vector, cross, dot, rational_root, shown, vector
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State


@dataclass(frozen=True, slots=True)
class Staude(WithAttitude):
    """A start that is an equilibrium of all six equations.  Raises NotInClass where the field is not exactly 0."""

    system: System = HEAVY_TOP
    method = "closed form: permanent rotation"

    def __post_init__(self) -> None:
        require("A permanent rotation", (equilibrium(self.system),), self.top, self.start)

    def motion(self, time: BallLike) -> tuple[list[Any], Carry]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        parameters = self.system.parameters(self.top, self.start)
        omega = self.system.angular_velocity(parameters, self.start.flat)
        return balls(self.start.omega), lambda fixed: rotate(fixed, omega, time)

    def evaluate(self, _time: Fraction) -> list[Any]:
        """The start, at every time."""
        return balls(self.start.flat)


def staude_rate_squared(top: HeavyTop, gamma: Vector) -> Fraction | None:
    """ω² of the permanent rotation Ω = ω γ about a rational direction, of any length; None where every ω serves.

    Raises NotInClass for a direction off Staude's cone, for a principal axis that r is not on, where ω² < 0, and for a
    top with a rotor, whose ω is a root of a quadratic equation with a linear term.
    """
    _require_no_rotor(top)
    turning = cross(top.angular_momentum(gamma), gamma)
    torque = cross(top.moment, gamma)
    if not any(gamma):
        raise InputError(
            "gamma is the zero vector, which has no direction.", "Give the direction that points vertically up."
        )
    if not any(turning) and not any(torque):
        return None
    off = cross(turning, torque)
    if not any(turning) or any(off):
        cone = dot(turning, top.moment)
        raise NotInClass(
            f"No permanent rotation about ({', '.join(map(shown, gamma))}): P r·(I gamma x gamma) = {shown(cone)}"
            + ("." if any(turning) else ", and P r is not along this principal axis."),
            "`staude_directions` gives rational directions on Staude's cone.",
        )
    square: Fraction = dot(turning, torque) / dot(turning, turning)
    if square < 0:
        raise NotInClass(f"The permanent rotation needs omega^2 = {shown(square)} >= 0.", "Turn gamma to -gamma.")
    return square


def staude_rate(top: HeavyTop, gamma: Vector, bits: int) -> arb:
    """ω ≥ 0 of the permanent rotation about γ as a ball; raises as :func:`staude_rate_squared`, and where ω is free."""
    square = staude_rate_squared(top, gamma)
    if square is None:
        raise NotInClass("gamma is a principal axis through r: every rate serves.", "Choose the rate.")
    return to_bits(lambda _working: [ball(square).sqrt()], bits)[0]


def staude_directions(top: HeavyTop, height: int) -> Iterator[Vector]:
    """Rational directions on Staude's cone (integer components without common factor), both senses of each.

    The cone r·(I γ × γ) = 0 holds e1, e2, e3 and r.  Lines through e1 meet it in one more point each; with n = P r,
    D1 = n1 (I2 − I3) and so on the cone is D1 γ2 γ3 + D2 γ3 γ1 + D3 γ1 γ2 = 0, so that (γ2, γ3) = (p, q) gives
    γ1 = −D1 p q/(D2 q + D3 p).  ``height`` bounds |p| and q.  Where the cone is a pair of planes, or all of space,
    directions in the principal planes that belong to it come as well.
    """
    _require_no_rotor(top)
    (i1, i2, i3), n = top.inertia, top.moment
    d1, d2, d3 = n[0] * (i2 - i3), n[1] * (i3 - i1), n[2] * (i1 - i2)
    seen = set()
    for q in range(height + 1):
        for p in range(-height, height + 1):
            if gcd(p, q) != 1:
                continue
            through = d2 * q + d3 * p
            found: list[tuple[Any, ...]] = [(-d1 * p * q / through, p, q)] if through else []
            found += [
                c
                for c in ((0, p, q), (p, 0, q), (p, q, 0))
                if d1 * c[1] * c[2] + d2 * c[2] * c[0] + d3 * c[0] * c[1] == 0
            ]
            for direction in found:
                primitive = _primitive(vector(direction, "direction"))
                for gamma in (primitive, tuple(-g for g in primitive)):
                    if gamma not in seen:
                        seen.add(gamma)
                        yield vector(gamma, "direction")


def staude_rotations(top: HeavyTop, height: int = 12) -> list[State]:
    """Permanent rotations with |γ| = 1 and rational ω ≠ 0, exact, among :func:`staude_directions` of this height.

    Both senses of ω are given.  Directions whose |γ| or ω is irrational, or whose ω is free, are left out:
    :func:`staude_rate` serves them.
    """
    found = []
    for direction in staude_directions(top, height):
        length = rational_root(dot(direction, direction))
        if length is None:
            continue
        gamma = vector((g / length for g in direction), "gamma")
        try:
            square = staude_rate_squared(top, gamma)
        except NotInClass:
            continue
        rate = rational_root(square) if square else None
        if rate is not None:
            found += [State([turn * g for g in gamma], gamma) for turn in (rate, -rate)]
    return found


def staude_motion(
    inertia: Vector, gamma: Vector, rate: Fraction, along: Fraction = Fraction(0), rotor: Vector | None = None
) -> Staude:
    """The permanent rotation Ω = ω γ of the top of weight 1 with r = ω² I γ + κ γ, κ = ``along``: all there are.

    rotor: k of a heavy gyrostat, for which r = ω² I γ + ω k + κ γ.
    """
    start = State([rate * g for g in gamma], gamma)
    centre = [(rate**2 * i + along) * g for i, g in zip(inertia, gamma, strict=True)]
    if rotor is None:
        return Staude(HeavyTop(inertia, 1, centre), start)
    carried = [n + rate * k for n, k in zip(centre, rotor, strict=True)]
    return Staude(HeavyTop(inertia, 1, carried, rotor), start, HEAVY_GYROSTAT)


def _require_no_rotor(top: HeavyTop) -> None:
    if top.rotor is not None and any(top.rotor):
        raise NotInClass(
            f"The rotor k = ({', '.join(map(shown, top.rotor))}) is not in Staude's condition.",
            "`staude_motion` takes a rotor.",
        )


def _primitive(direction: Vector) -> tuple[Fraction, ...]:
    """The direction with integer components without a common factor."""
    scale = 1
    for component in direction:
        scale = scale * component.denominator // gcd(scale, component.denominator)
    whole = [int(component * scale) for component in direction]
    return tuple(Fraction(component, gcd(*whole)) for component in whole)


def staude_stability(motion: Staude) -> str:
    """``unstable``, ``spectrally stable`` or ``degenerate``, decided exactly from the linearized motion.

    The characteristic polynomial of the Jacobian is x² (x⁴ + A x² + B): |γ|² and M·γ give the zeros, the Hamiltonian
    form on their levels the even powers.  All exponents are imaginary and simple where A, B and A² − 4B are positive;
    one has a positive real part where any of them is negative; where one is 0 and none negative, first order does not
    decide.
    """
    p = motion.system.parameters(motion.top, motion.start)
    exact = p.mapped(lambda value: rational(Fraction(value)))
    columns = []
    for moved in range(6):
        y = [fmpq_poly([rational(v), int(axis == moved)]) for axis, v in enumerate(motion.start.flat)]
        columns.append([rate[1] for rate in motion.system.field(exact, y)])
    polynomial = fmpq_mat(6, 6, [columns[j][i] for i in range(6) for j in range(6)]).charpoly()
    a, b = polynomial[4], polynomial[2]
    signs = (a, b, a * a - 4 * b)
    if any(value < 0 for value in signs):
        return "unstable"
    return "spectrally stable" if all(value > 0 for value in signs) else "degenerate"
