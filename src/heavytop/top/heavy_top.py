"""The heavy top and its start, as exact rationals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import isqrt
from operator import lt
from typing import Any, cast

from heavytop.errors import InputError, argument, prefixed, quoted, refusal
from heavytop.precision import (
    MOST_MEMBERS,
    Given,
    Vector,
    cache_last_call,
    decimal_text,
    distinct_digits,
    dot,
    exact,
    exact_text,
    ordered,
    physical,
    round_to,
    shown,
    vector,
)
from heavytop.top.attitude import Attitude, rotated, transposed

_SHOWN_BITS = 64
_ATTITUDE_BITS = 256
_NEAR_BITS = 10
"""Bits of the unit vector that an error suggests: enough to show which one was meant."""
_NO_DIRECTION = "gamma must not be zero."
_UPWARDS = "Give the direction that points vertically up."
_NORMALIZE = (
    "Give rational components such as 3/5,0,4/5, or move gamma onto the sphere: --normalize on the command line, "
    "State.normalized() in Python."
)


@dataclass(frozen=True, slots=True, init=False)
class HeavyTop:
    """A rigid body with a fixed point under gravity.

    inertia: principal moments (I1, I2, I3) at the fixed point, all positive.
    weight: P.
    centre: r = (a, b, c), the centre of mass on the principal axes.
    rotor: k = (k1, k2, k3), the constant angular momentum, relative to the body, of a rotor that it carries: the system
    is then `heavy_gyrostat`.  None for no rotor, which is another top than one with k = 0.
    mass: of the body; None where it is not known, since only its product with gravity, P, moves a top.

    Each is an exact number; raises InputError for a moment that is not positive.
    """

    inertia: Vector
    weight: Fraction
    centre: Vector
    rotor: Vector | None
    mass: Fraction | None

    def __init__(
        self,
        inertia: Iterable[Any],
        weight: Given,
        centre: Iterable[Any],
        rotor: Iterable[Any] | None = None,
        mass: Fraction | None = None,
    ) -> None:
        moments = vector(inertia, "inertia")
        for axis, value in enumerate(moments, 1):
            if value <= 0:
                raise refusal(f"The principal moment I{axis}", "positive", shown(value), "Give positive moments.")
        try:
            load = exact(weight)
        except InputError as error:
            raise InputError(f"{argument('weight')}: {error.cause}", error.remedy) from None
        object.__setattr__(self, "inertia", moments)
        object.__setattr__(self, "weight", load)
        object.__setattr__(self, "centre", vector(centre, "centre"))
        object.__setattr__(self, "rotor", None if rotor is None else vector(rotor, "rotor"))
        object.__setattr__(self, "mass", mass)

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
        momentum = self.inertia[0] * omega[0], self.inertia[1] * omega[1], self.inertia[2] * omega[2]
        if self.rotor is None:
            return momentum
        return momentum[0] + self.rotor[0], momentum[1] + self.rotor[1], momentum[2] + self.rotor[2]

    def warnings(self) -> list[str]:
        """Warnings of moments that no rigid body has, though the equations admit them."""
        sentences = []
        for axis, value in enumerate(self.inertia):
            others = sum(self.inertia) - value
            if value > others:
                moment, most = distinct_digits(value, others)
                sentences.append(
                    f"I{axis + 1} = {moment} exceeds the sum {most} of the other two: no rigid body has such moments."
                )
        return sentences


def require_physical(top: HeavyTop, start: State) -> None:
    """Raise InputError for data beyond 10^150, and moments below 10^-150, which overflow in intermediate doubles."""
    _require_physical_top(top)
    for what, values in (("omega", start.omega), ("gamma", start.gamma)):
        for value in values:
            physical(value, what)


@cache_last_call
def _require_physical_top(top: HeavyTop) -> None:
    named = {"inertia": top.inertia, "weight": (top.weight,), "centre": top.centre, "rotor": top.rotor or ()}
    for what, values in named.items():
        for value in values:
            physical(value, what)
    physical(1 / min(top.inertia), "1/inertia")


@dataclass(frozen=True, slots=True, init=False)
class State:
    """Angular velocity Ω and γ, the unit vector pointing vertically up, both in body axes, as exact rationals.

    Up: the equations are M' = M × Ω + P γ × r, γ' = γ × Ω and the energy is ½ Ω·M + P r·γ, higher with r along γ.

    omega: Ω in body axes, or omega_space: R Ω, which needs an attitude.  gamma: γ, or attitude: R, whose last row γ is.
    Numbers are exact.  Of an attitude with irrational entries, γ and Ω = Rᵀ Ω_space
    here are those of a rational rotation within 2^-250 of it; what computes with the state takes the attitude itself,
    to the bits that it needs.

    Raises InputError where two of them contradict each other, or one is missing.
    """

    omega: Vector
    gamma: Vector
    attitude: Attitude | None
    omega_space: Vector | None

    def __init__(
        self,
        omega: Iterable[Any] | None = None,
        gamma: Iterable[Any] | None = None,
        *,
        attitude: Attitude | None = None,
        omega_space: Iterable[Any] | None = None,
    ) -> None:
        if (omega is None) == (omega_space is None):
            which = "both" if omega is not None else "neither"
            raise refusal(
                "Exactly one of omega and omega_space",
                "given",
                which,
                "Give omega in body axes, or omega_space in space axes.",
            )
        if attitude is None:
            if gamma is None:
                raise InputError("Neither gamma nor an attitude was given.", "Give gamma, or an Attitude.")
            if omega_space is not None:
                raise InputError("omega_space needs an attitude.", "Give an Attitude, or omega in body axes.")
            up = vector(gamma, "gamma")
        else:
            if not isinstance(attitude, Attitude):
                raise refusal("attitude", "an Attitude", quoted(attitude), "Use Attitude.quaternion(w, x, y, z).")
            up = attitude.rational_rows(_ATTITUDE_BITS)[2]
            if gamma is not None:
                _require_same_gamma(vector(gamma, "gamma"), up, attitude)
        space = None if omega_space is None else vector(omega_space, "omega_space")
        if space is not None and attitude is not None:
            spin = rotated(transposed(attitude.rational_rows(_ATTITUDE_BITS)), space)
        else:
            spin = vector(() if omega is None else omega, "omega")
        for name, value in (("omega", spin), ("gamma", up), ("attitude", attitude), ("omega_space", space)):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        spin = f"omega={_text(self.omega)}" if self.omega_space is None else f"omega_space={_text(self.omega_space)}"
        return (
            f"State({spin}, {f'gamma={_text(self.gamma)}' if self.attitude is None else f'attitude={self.attitude!r}'})"
        )

    @property
    def flat(self) -> tuple[Fraction, ...]:
        """(Ω1, Ω2, Ω3, γ1, γ2, γ3)."""
        return (*self.omega, *self.gamma)

    def require_unit_gamma(self, slack: Fraction = Fraction(0), remedy: str = _NORMALIZE) -> State:
        """This state; raises InputError with that remedy unless | |γ|² − 1 | ≤ ``slack``."""
        excess = dot(self.gamma, self.gamma) - 1
        if not any(self.gamma):
            raise InputError(_NO_DIRECTION, _UPWARDS)
        if abs(excess) > slack:
            size = decimal_text(round_to(excess, _SHOWN_BITS), 6)  # of a million digits else
            allowance = f", where {decimal_text(round_to(slack, _SHOWN_BITS), 2)} is allowed" if slack else ""
            raise InputError(f"gamma is not a unit vector: |gamma|^2 - 1 = {size}{allowance}.", remedy)
        return self

    def unit_gamma_nearby(self) -> str:
        """A remedy for |γ| ≠ 1 in full: a unit vector near γ."""
        if not any(self.gamma):
            return "Give the components of a unit vector, such as 3/5, 0, 4/5."
        near = ", ".join(map(str, self.normalized(_NEAR_BITS).gamma))
        return f"Give rational components such as 3/5, 0, 4/5; a unit vector near this one is {near}."

    def normalized(self, bits: int = 128) -> State:
        """The state with γ at a rational point of the unit sphere within 2^(2-bits) of γ/|γ| (stereographic)."""
        square = dot(self.gamma, self.gamma)
        if square == 0:
            raise InputError(_NO_DIRECTION, _UPWARDS)
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
    """A number or three numbers as Python source; long ones to six digits."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_text, value))})"
    text = shown(value)
    return text if text.lstrip("-").isdigit() else repr(text)


def _require_same_gamma(gamma: Vector, up: Vector, attitude: Attitude) -> None:
    """Raises InputError where γ is not the last row of the attitude; of an irrational one, to 1e-15."""
    slack = Fraction(0) if attitude.exact_rows() is not None else Fraction(1, 10**15)
    if max(abs(a - b) for a, b in zip(gamma, up, strict=True)) > slack:
        raise InputError(
            f"gamma = {_text(gamma)} contradicts the attitude, whose gamma is {_text(up)}.",
            "Give one of them: the last row of R is gamma.",
        )


# The times of a motion.


_SMALL, _LARGE = 1e-300, 1e149
"""The range of times whose nearest doubles have a small relative error and cannot overflow."""
_LONGEST = 60
"""The most digits of a time in decimals; longer ones are written as fractions."""


class TimeText(str):
    """A time as its exact input text: ``12345.678``, ``1e3`` or ``1/3``.

    ``float`` of it is the nearest double, ``Fraction`` of it the number itself.
    """

    __slots__ = ()

    def __float__(self) -> float:
        return float(exact(str(self)))

    @classmethod
    def of(cls, value: Given) -> TimeText:
        """The text of a time.

        Text is unchanged; a float or another number becomes its exact decimal of up to 60 digits, else a fraction.
        Raises InputError for what is not a number.
        """
        number = exact(value)
        if isinstance(value, str):
            return cls(value.strip())
        if isinstance(value, Decimal):
            return cls(str(value))
        if isinstance(value, Fraction):
            return cls(exact_text(number))
        twos = (number.denominator & -number.denominator).bit_length() - 1
        decimals = twos  # of a binary number; of any other the division below leaves a rest
        if number.denominator != 1 << twos or decimals > _LONGEST:
            return cls(exact_text(number))
        digits = abs(number.numerator) * 5**decimals
        text = str(Decimal(digits)).rjust(decimals + 1, "0")
        text = f"{text[: len(text) - decimals]}.{text[len(text) - decimals :]}" if decimals else text
        return cls(f"-{text}" if number < 0 else text)


class CheckedTimes(list[Fraction]):
    """Exact times after their check.

    doubles: the nearest doubles; empty where these do not prove that the times are in order.
    """

    doubles: list[float]


class RoundedTimes(Sequence[Fraction]):
    """Times rounded to a format: its numbers, each converted to an exact one on access."""

    __slots__ = ("numbers",)

    def __init__(self, numbers: Sequence[Any]) -> None:
        self.numbers = numbers

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, index: Any) -> Any:
        value = self.numbers[index]
        return tuple(map(exact, value)) if isinstance(index, slice) else exact(value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, tuple | list | RoundedTimes) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))


class DoubleTimes(RoundedTimes):
    """Times from doubles after their check.

    doubles: an array.
    """

    __slots__ = ()
    are_doubles = True

    @property
    def doubles(self) -> Any:
        return self.numbers


def check_times(times: Iterable[Any]) -> CheckedTimes | DoubleTimes:
    """Exact times; raises InputError unless they are of one sign and strictly monotone away from 0."""
    if type(times) in (CheckedTimes, DoubleTimes):  # isinstance of a Sequence takes as long as a step of heyoka
        return cast(CheckedTimes | DoubleTimes, times)
    doubles = _as_doubles(times)
    if doubles is not None:
        return DoubleTimes(doubles)
    instants = ordered(times, "times", "Give a list such as [1, 2, 5].")
    with prefixed("times"):
        values = CheckedTimes(instants if set(map(type, instants)) == {Fraction} else map(exact, instants))
    values.doubles = _in_order(values)
    if not values.doubles:
        _check_each(values)
    return values


def _as_doubles(times: Any) -> Any:
    """An array of the times where they are ordered doubles; None where each needs a check."""
    import numpy

    floats = isinstance(times, list | tuple) and set(map(type, times)) == {float}
    if not floats and not (isinstance(times, numpy.ndarray) and times.dtype == numpy.float64 and times.ndim == 1):
        return None
    if numpy.ma.is_masked(times):
        return None
    doubles = numpy.array(times, dtype=numpy.float64)
    if not 0 < len(doubles) <= MOST_MEMBERS:
        return None
    sizes = doubles if doubles[-1] > 0 else -doubles
    first, last = float(sizes[0]), float(sizes[-1])
    far = (first > _SMALL or first == 0) and last < _LARGE
    return doubles if far and (len(doubles) == 1 or bool((sizes[1:] > sizes[:-1]).all())) else None


def _in_order(values: list[Fraction]) -> list[float]:
    """The nearest doubles, where they have one sign, grow strictly and are far from the limits of doubles.

    Numbers that round to different doubles are in the order of these, so the times need no comparison.
    """
    try:
        doubles = [above / below for above, below in map(Fraction.as_integer_ratio, values)]
    except OverflowError:
        return []
    sizes = doubles if doubles and doubles[-1] > 0 else [-value for value in doubles]
    # 0 itself may come first
    far = bool(sizes) and (sizes[0] > _SMALL or not values[0]) and sizes[-1] < _LARGE
    return doubles if far and all(map(lt, sizes, sizes[1:])) else []


def _check_each(values: list[Fraction]) -> None:
    for value in values:
        physical(value, "a time")
    if not values:
        raise InputError("No times were given.", "Give at least one, such as 1, 2, 5.")
    for earlier, later in zip([Fraction(0), *values], values, strict=False):
        if earlier * later < 0:
            raise InputError(f"The times {shown(earlier)} and {shown(later)} have different signs.", "Separate them.")
        if abs(later) <= abs(earlier) and (later or earlier):
            raise InputError(
                f"Times must move strictly away from 0; got {shown(later)} after {shown(earlier)}.",
                "Sort them, and give each once.",
            )
    if values.count(Fraction(0)) > 1:
        raise InputError("The time 0 was given more than once.", "Sort them, and give each once.")
