"""The two vector fields, written once over any ring.  The order of the state and every sign are decided here.

State y = (Ω1, Ω2, Ω3, γ1, γ2, γ3); γ is the unit vector pointing vertically up, in body axes.
The same functions serve heyoka expressions, Fractions, mpf, balls, power series
and sympy symbols: they use +, -, * and division by the principal moments, and no literals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from heavytop.errors import InputError
from heavytop.precision import shown
from heavytop.top.heavy_top import HeavyTop, State, cross, dot

VARIABLES = ("omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3")
NAMES = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3")


class Parameters(NamedTuple):
    """What enters the fields, in any ring: principal moments I, n = P r, and λ, by which the rotor makes the body turn
    faster about axis 2 (its angular momentum relative to the body is −I2 λ).
    """

    inertia: Any
    moment: Any
    rotor: Any


def heavy_top(p: Parameters, y: Any) -> tuple[Any, ...]:
    """(1.1) M' = M × Ω + P γ × r and (1.2) γ' = γ × Ω, as (Ω', γ') in the order of the state."""
    (i1, i2, i3), n = p.inertia, p.moment
    w1, w2, w3 = omega = y[:3]
    gamma = y[3:6]
    torque = cross(gamma, n)
    return (
        ((i2 - i3) * (w2 * w3) + torque[0]) / i1,
        ((i3 - i1) * (w3 * w1) + torque[1]) / i2,
        ((i1 - i2) * (w1 * w2) + torque[2]) / i3,
        *cross(gamma, omega),
    )


def gyrostat(p: Parameters, y: Any) -> tuple[Any, ...]:
    """M' = M × ω and γ' = γ × ω with ω = Ω + λ e2: the free gyrostat with a constant rotor along axis 2.

    M = IΩ = Iω − I2 λ e2 is the angular momentum of body and rotor, so −I2 λ is the rotor's own, relative to the body.
    This is the system that the paper's formulas solve exactly, with λ = P b / (M·γ) from :func:`rotor`.
    """
    (i1, i2, i3), rotor = p.inertia, p.rotor
    w1, w2, w3 = y[:3]
    return (
        ((i2 - i3) * (w2 * w3) - rotor * (i3 * w3)) / i1,
        ((i3 - i1) * (w3 * w1)) / i2,
        ((i1 - i2) * (w1 * w2) + rotor * (i1 * w1)) / i3,
        *cross(y[3:6], (w1, w2 + rotor, w3)),
    )


def _omega(p: Parameters, y: Any) -> tuple[Any, ...]:
    return tuple(y[:3])


def _omega_with_rotor(p: Parameters, y: Any) -> tuple[Any, ...]:
    return y[0], y[1] + p.rotor, y[2]


@dataclass(frozen=True, slots=True)
class System:
    """One of the two systems: its field, and the angular velocity with which the body turns in space."""

    name: str
    field: Callable[[Parameters, Any], tuple[Any, ...]]
    angular_velocity: Callable[[Parameters, Any], tuple[Any, ...]]

    def __reduce__(self) -> tuple[Any, ...]:
        """A system that comes back from another process is the same object."""
        return system, (self.name,)

    def parameters(self, top: HeavyTop, start: State) -> Parameters:
        """Exact parameters of the field for this top and start; raises InputError if the system does not admit them."""
        return Parameters(top.inertia, top.moment, rotor(top, start) if self is GYROSTAT else 0)

    def attitude(self, p: Parameters, y: Any, xi: Any) -> tuple[Any, Any, Any]:
        """ξ' = ξ × ω for a vector ξ fixed in space."""
        return cross(xi, self.angular_velocity(p, y))


def rotor(top: HeavyTop, start: State) -> Any:
    """λ = P b / (M·γ), from the exact start.

    Raises InputError unless a = c = 0, M·γ is not 0 and γ is parallel to M (2.1): without these the paper's
    formulas, and so the gyrostat that they solve, are not defined.
    """
    a, _, c = top.centre
    if top.weight != 0 and (a != 0 or c != 0):
        raise InputError(
            f"The gyrostat needs the centre of mass on axis 2, but a = {shown(a)}, c = {shown(c)}.",
            "Give a centre of mass (0, b, 0): the paper assumes a = c = 0.",
        )
    momentum = top.angular_momentum(start.omega)
    area = dot(momentum, start.gamma)
    if area == 0:
        raise InputError(
            "The gyrostat needs M·gamma != 0: its lambda is P b / (M·gamma).", "Choose a start that turns about gamma."
        )
    off = cross(momentum, start.gamma)
    if any(off):
        raise InputError(
            "The gyrostat needs gamma parallel to M, as (2.1) claims: "
            f"M x gamma = ({', '.join(f'{float(x):.6g}' for x in off)}).",
            "Take gamma = M/|M| with a rational |M|.",
        )
    return top.moment[1] / area


HEAVY_TOP = System("heavy_top", heavy_top, _omega)
GYROSTAT = System("gyrostat", gyrostat, _omega_with_rotor)


def system(name: str) -> System:
    """The system of that name; raises InputError for any other."""
    for known in (HEAVY_TOP, GYROSTAT):
        if name == known.name:
            return known
    raise InputError(f"Unknown system {name[:60]!r}.", "Use heavy_top or gyrostat.")
