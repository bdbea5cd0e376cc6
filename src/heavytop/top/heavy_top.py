"""The heavy top and its start, as exact rationals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from math import isqrt
from typing import Any

from heavytop.errors import HeavyTopError, InputError, quoted
from heavytop.precision import decimal_text, exact, exact_text, physical, round_to, shown

Vector = tuple[Fraction, Fraction, Fraction]
_SHOWN_BITS = 64
_NEAR_BITS = 10
"""Bits of the unit vector that an error suggests: enough to show which one was meant."""
_NORMALIZE = (
    "Give rational components such as 3/5,0,4/5, or move gamma onto the sphere: --normalize on the command line, "
    "State.normalized() in Python."
)
_MOST = 10_000_000
"""Members of a list; a generator may have no end."""


def vector(values: Iterable[Any], what: str) -> Vector:
    """Three exact rationals out of anything :func:`heavytop.precision.exact` reads; raises InputError otherwise."""
    parts = ordered(values, what, "Give three numbers, one for each principal axis: x,y,z.")
    if len(parts) != 3:
        raise InputError(f"{what} has {len(parts)} numbers.", "Give three, one for each principal axis: x,y,z.")
    try:
        first, second, third = (exact(part) for part in parts)
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None
    return first, second, third


def ordered(values: Any, what: str, remedy: str) -> list[Any]:
    """The members of a list, a tuple, an array or another iterable with an order of its own.

    Raises InputError for text, whose characters are no list of numbers, for sets and mappings, and for what is none.
    """
    if not isinstance(values, str | bytes | bytearray | Set | Mapping):
        try:
            found = list(islice(values, _MOST + 1))
            if len(found) > _MOST:
                raise InputError(f"{what} has more than {_MOST} members.", remedy)
            return found
        except HeavyTopError:
            raise
        except Exception:  # what is no iterable, an array without dimensions, a generator that fails
            pass
    raise InputError(f"{what} = {quoted(values)} is not a list.", remedy)


def dot(a: Any, b: Any) -> Any:
    """a · b over any ring."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Any, b: Any) -> tuple[Any, Any, Any]:
    """a × b over any ring."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@dataclass(frozen=True, slots=True, init=False)
class HeavyTop:
    """A rigid body with a fixed point under gravity.

    inertia: principal moments (I1, I2, I3) at the fixed point, all positive.
    weight: P.
    centre: r = (a, b, c), the centre of mass on the principal axes.
    rotor: k = (k1, k2, k3), the constant angular momentum, relative to the body, of a rotor that it carries: the system
    is then `heavy_gyrostat`.  None for no rotor, which is another top than one with k = 0.

    Each is read by :func:`heavytop.precision.exact`; raises InputError for a moment that is not positive.
    """

    inertia: Vector
    weight: Fraction
    centre: Vector
    rotor: Vector | None

    def __init__(
        self, inertia: Iterable[Any], weight: Any, centre: Iterable[Any], rotor: Iterable[Any] | None = None
    ) -> None:
        moments = vector(inertia, "inertia")
        for axis, value in enumerate(moments, 1):
            if value <= 0:
                raise InputError(
                    f"The principal moment I{axis} = {shown(value)} is not positive.",
                    "Moments of inertia are positive numbers.",
                )
        try:
            load = exact(weight)
        except InputError as error:
            raise InputError(f"weight: {error.cause}", error.remedy) from None
        object.__setattr__(self, "inertia", moments)
        object.__setattr__(self, "weight", load)
        object.__setattr__(self, "centre", vector(centre, "centre"))
        object.__setattr__(self, "rotor", None if rotor is None else vector(rotor, "rotor"))

    def __repr__(self) -> str:
        rotor = "" if self.rotor is None else f", rotor={_text(self.rotor)}"
        data = f"inertia={_text(self.inertia)}, weight={_text(self.weight)}, centre={_text(self.centre)}"
        return f"HeavyTop({data}{rotor})"

    @property
    def moment(self) -> Vector:
        """P r, the only way in which weight and centre of mass enter the equations."""
        a, b, c = self.centre
        return self.weight * a, self.weight * b, self.weight * c

    def angular_momentum(self, omega: Any) -> tuple[Any, Any, Any]:
        """M = IΩ, and k where there is a rotor, over any ring that rationals act on."""
        own = self.inertia[0] * omega[0], self.inertia[1] * omega[1], self.inertia[2] * omega[2]
        if self.rotor is None:
            return own
        return own[0] + self.rotor[0], own[1] + self.rotor[1], own[2] + self.rotor[2]

    def warnings(self) -> list[str]:
        """What no rigid body can have, though the equations do not mind: a moment larger than the sum of the others."""
        found = []
        for axis, value in enumerate(self.inertia):
            others = sum(self.inertia) - value
            if value > others:
                found.append(
                    f"I{axis + 1} = {shown(value)} exceeds the sum {shown(others)} of the other two: "
                    "no rigid body has such moments."
                )
        return found


def require_physical(top: HeavyTop, start: State) -> None:
    """Raises InputError for data beyond 10^150, and moments below 10^-150, which overflow in some float on the way."""
    named = {"inertia": top.inertia, "weight": (top.weight,), "centre": top.centre, "rotor": top.rotor or ()}
    for what, values in (named | {"omega": start.omega, "gamma": start.gamma}).items():
        for value in values:
            physical(value, what)
    physical(1 / min(top.inertia), "1/inertia")


@dataclass(frozen=True, slots=True, init=False)
class State:
    """Angular velocity Ω and γ, the unit vector pointing vertically up, both in body axes, as exact rationals.

    Up: the equations are M' = M × Ω + P γ × r, γ' = γ × Ω and the energy is ½ Ω·M + P r·γ, higher with r along γ.

    omega, gamma: three numbers each, read by :func:`heavytop.precision.exact`.
    """

    omega: Vector
    gamma: Vector

    def __init__(self, omega: Iterable[Any], gamma: Iterable[Any]) -> None:
        object.__setattr__(self, "omega", vector(omega, "omega"))
        object.__setattr__(self, "gamma", vector(gamma, "gamma"))

    def __repr__(self) -> str:
        return f"State(omega={_text(self.omega)}, gamma={_text(self.gamma)})"

    @property
    def flat(self) -> tuple[Fraction, ...]:
        """(Ω1, Ω2, Ω3, γ1, γ2, γ3)."""
        return (*self.omega, *self.gamma)

    def require_unit_gamma(self, slack: Fraction = Fraction(0), remedy: str = _NORMALIZE) -> State:
        """This state; raises InputError with that remedy unless | |γ|² − 1 | ≤ ``slack``."""
        off = dot(self.gamma, self.gamma) - 1
        if abs(off) > slack:
            size = decimal_text(round_to(off, _SHOWN_BITS), 6)  # of a million digits else
            raise InputError(f"gamma is not a unit vector: |gamma|^2 - 1 = {size}.", remedy)
        return self

    def unit_gamma_nearby(self) -> str:
        """How to repair a γ that is no unit vector, where nothing can do it for the user: one near it in full."""
        if not any(self.gamma):
            return "Give the components of a unit vector, such as 3/5, 0, 4/5."
        near = ", ".join(map(str, self.normalized(_NEAR_BITS).gamma))
        return f"Give rational components such as 3/5, 0, 4/5; a unit vector near this one is {near}."

    def normalized(self, bits: int = 128) -> State:
        """The state with γ at a rational point of the unit sphere within 2^(2-bits) of γ/|γ| (stereographic)."""
        square = dot(self.gamma, self.gamma)
        if square == 0:
            raise InputError(
                "gamma is the zero vector, which has no direction.", "Give the direction that points vertically up."
            )
        if square == 1:
            return self
        largest = max(abs(g) for g in self.gamma)
        g1, g2, g3 = (g / largest for g in self.gamma)
        scale = 1 << bits
        root = Fraction(isqrt(int((g1 * g1 + g2 * g2 + g3 * g3) * scale**4)), scale**2)
        u, v = (Fraction(round(g / (root + abs(g3)) * scale), scale) for g in (g1, g2))
        norm = 1 + u * u + v * v
        sign = 1 if g3 >= 0 else -1
        return State(self.omega, (2 * u / norm, 2 * v / norm, sign * (2 / norm - 1)))


def data_texts(top: HeavyTop, start: State) -> dict[str, str | list[str]]:
    """The data as exact text, by the keys of every file and document: inertia, weight, centre, omega, gamma; and rotor
    where the top has one.
    """
    inertia, centre, omega, gamma = (
        [exact_text(value) for value in part] for part in (top.inertia, top.centre, start.omega, start.gamma)
    )
    weight = exact_text(top.weight)
    rotor = {} if top.rotor is None else {"rotor": [exact_text(value) for value in top.rotor]}
    return {"inertia": inertia, "weight": weight, "centre": centre, **rotor, "omega": omega, "gamma": gamma}


def _text(value: Fraction | Vector) -> str:
    """A number or three as one would write them in Python; long ones to six digits."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_text, value))})"
    text = shown(value)
    return text if text.lstrip("-").isdigit() else repr(text)
