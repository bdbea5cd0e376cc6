"""The three vector fields, written once over any ring.  The order of the state and every sign are decided here.

State y = (Ω1, Ω2, Ω3, γ1, γ2, γ3); γ is the unit vector pointing vertically up, in body axes.
The same functions serve heyoka expressions, Fractions, mpf, balls, power series
and sympy symbols: they use +, -, * and division by the principal moments, and no literals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, Protocol

from heavytop.errors import InputError
from heavytop.precision import shown
from heavytop.top.heavy_top import HeavyTop, State, Vector, cross, dot

VARIABLES = ("omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3")
NAMES = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3")


class Parameters(NamedTuple):
    """What enters the fields, in any ring: principal moments I, n = P r, and the rotor.

    rotor: of `gyrostat` λ, by which the rotor makes the body turn faster about axis 2 (its angular momentum relative to
    the body is −I2 λ); of `heavy_gyrostat` that angular momentum k itself, a tuple of three; 0 of `heavy_top`.
    """

    inertia: Any
    moment: Any
    rotor: Any

    @property
    def rotors(self) -> tuple[Any, ...]:
        """The numbers of the rotor: k1, k2, k3, or λ alone."""
        return self.rotor if isinstance(self.rotor, tuple) else (self.rotor,)

    @property
    def rotor_rate(self) -> Any:
        """The rate at which the rotor makes exact motions change, in 1/time unit: |λ|, or the largest |k_i| over the
        smallest moment.
        """
        largest = max(map(abs, self.rotors))
        return largest / Fraction(min(self.inertia)) if isinstance(self.rotor, tuple) else Fraction(largest)

    @property
    def numbers(self) -> tuple[Any, ...]:
        """I, n and the rotor, one number after the other."""
        return (*self.inertia, *self.moment, *self.rotors)

    def mapped(self, number: Callable[[Any], Any]) -> Parameters:
        """The same in another ring: ``number`` of each of them."""
        rotors = tuple(map(number, self.rotors))
        kept = rotors if isinstance(self.rotor, tuple) else rotors[0]
        return Parameters(tuple(map(number, self.inertia)), tuple(map(number, self.moment)), kept)


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


def heavy_gyrostat(p: Parameters, y: Any) -> tuple[Any, ...]:
    """M' = M × Ω + γ × n and γ' = γ × Ω with M = IΩ + k: a heavy top that carries a rotor of constant momentum k.

    k = 0 is the heavy top.  n = 0 is the gyrostat of Zhukovsky and Volterra; :func:`gyrostat` is its case
    k = (0, −I2 λ, 0), where Ω here is Ω + λ e2 there, and M and γ are the same.
    """
    (i1, i2, i3), n = p.inertia, p.moment
    w1, w2, w3 = omega = y[:3]
    gamma = y[3:6]
    torque, turning = cross(gamma, n), cross(p.rotor, omega)
    return (
        ((i2 - i3) * (w2 * w3) + turning[0] + torque[0]) / i1,
        ((i3 - i1) * (w3 * w1) + turning[1] + torque[1]) / i2,
        ((i1 - i2) * (w1 * w2) + turning[2] + torque[2]) / i3,
        *cross(gamma, omega),
    )


def _of_full_tensor(p: Parameters, y: Any, rotor: Any) -> tuple[Any, ...]:
    """(1.1), (1.2) with products of inertia, ``p.inertia`` the three rows of the tensor, and k = ``rotor`` or None.

    Ω' = I⁻¹ (M × Ω + γ × n), with I⁻¹ by the cofactors of the symmetric tensor.
    """
    (a, f, e), (_, b, d), (_, _, c) = rows = p.inertia
    omega, gamma = y[:3], y[3:6]
    m = tuple(dot(row, omega) for row in rows)
    if rotor is not None:
        m = tuple(own + part for own, part in zip(m, rotor, strict=True))
    torque = tuple(own + part for own, part in zip(cross(m, omega), cross(gamma, p.moment), strict=True))
    adjugate = (
        (b * c - d * d, d * e - c * f, d * f - b * e),
        (d * e - c * f, a * c - e * e, e * f - a * d),
        (d * f - b * e, e * f - a * d, a * b - f * f),
    )
    determinant = dot(rows[0], adjugate[0])
    return (*(dot(row, torque) / determinant for row in adjugate), *cross(gamma, omega))


def _omega(p: Parameters, y: Any) -> tuple[Any, ...]:
    return tuple(y[:3])


def _omega_with_rotor(p: Parameters, y: Any) -> tuple[Any, ...]:
    return y[0], y[1] + p.rotor, y[2]


@dataclass(frozen=True, slots=True)
class System:
    """One of the three systems: its field, and the angular velocity with which the body turns in space.

    enters: which of the :class:`heavytop.top.equations.Parameters` enter the field, by name.
    """

    name: str
    field: Callable[[Parameters, Any], tuple[Any, ...]]
    angular_velocity: Callable[[Parameters, Any], tuple[Any, ...]]
    enters: tuple[str, ...] = ("inertia", "moment")

    def __reduce__(self) -> tuple[Any, ...]:
        """A system that comes back from another process is the same object."""
        return system, (self.name,)

    def parameters(self, top: HeavyTop, start: State) -> Parameters:
        """Exact parameters of the field for this top and start; raises InputError if the system does not admit them."""
        require_no_other_rotor(self, top)
        if self is HEAVY_GYROSTAT:
            return Parameters(top.inertia, top.moment, top.rotor or (Fraction(0),) * 3)
        return Parameters(top.inertia, top.moment, rotor(top, start) if self is GYROSTAT else 0)

    def entering(self, p: Parameters) -> tuple[Any, ...]:
        """The numbers that enter the field, one after the other: what compiled code is given."""
        return tuple(value for name in self.enters for value in (p.rotors if name == "rotor" else getattr(p, name)))

    def taken_in(self, numbers: Sequence[Any]) -> Parameters:
        """The parameters of these :meth:`entering` numbers; None for what does not enter."""
        found: dict[str, Any] = dict.fromkeys(Parameters._fields)
        rest = list(numbers)
        for name in self.enters:
            size = 1 if name == "rotor" and self is GYROSTAT else 3
            part, rest = tuple(rest[:size]), rest[size:]
            found[name] = part if size == 3 else part[0]
        return Parameters(**found)

    def rates(self, p: Parameters, y: Any) -> tuple[Any, ...]:
        """The field where ``p.inertia`` may be the three rows of a full tensor, with y in its axes.

        ``field`` itself is for principal axes and has no branch: it is compiled.
        """
        if not isinstance(p.inertia[0], tuple):
            return self.field(p, y)
        return _of_full_tensor(p, y, p.rotor if "rotor" in self.enters else None)

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
GYROSTAT = System("gyrostat", gyrostat, _omega_with_rotor, ("inertia", "rotor"))
HEAVY_GYROSTAT = System("heavy_gyrostat", heavy_gyrostat, _omega, ("inertia", "moment", "rotor"))
SYSTEMS = (HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT)
WHICH_SYSTEM = "heavy_top, gyrostat or heavy_gyrostat"


def system(name: str) -> System:
    """The system of that name; raises InputError for any other."""
    for known in SYSTEMS:
        if name == known.name:
            return known
    raise InputError(f"Unknown system {name[:60]!r}.", f"Use {WHICH_SYSTEM}.")


class WithRotor(Protocol):
    """A top or a body, as far as the choice of the system goes."""

    @property
    def rotor(self) -> Vector | None: ...


def system_of(given: System | str | None, *tops: WithRotor) -> System:
    """The system asked for; where none is, `heavy_gyrostat` if a top has a rotor, else `heavy_top`.

    Raises InputError for an unknown name, and for a system that does not know the rotor of a top.
    """
    if given is None:
        return HEAVY_TOP if all(top.rotor is None for top in tops) else HEAVY_GYROSTAT
    found = system(given) if isinstance(given, str) else given
    for top in tops:
        require_no_other_rotor(found, top)
    return found


def require_no_other_rotor(asked: System, top: WithRotor) -> None:
    """Raises InputError where the top has a rotor and the system another one, or none."""
    if top.rotor is not None and asked is not HEAVY_GYROSTAT:
        why = "takes its rotor from the start" if asked is GYROSTAT else "has no rotor"
        raise InputError(
            f"The top has a rotor ({', '.join(map(shown, top.rotor))}), but the system {asked.name} {why}.",
            "Use the system heavy_gyrostat, or give no rotor.",
        )
