"""The interface of a motion in multi-word arithmetic, whatever its arithmetic."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction
from math import isqrt

import numpy

from heavytop.extras import Stub
from heavytop.multiword.codegen.machine_code import (
    INT,
    LANES,
    POINTER,
    Code,
    Doubles,
    Machine,
    Operand,
    compiled,
    doubles,
    function,
    ir,
    once,
    pointer,
)
from heavytop.multiword.codegen.recurrence import ZERO, Coefficients, coefficients, permutations
from heavytop.precision import cross
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, Parameters, System


class Status(Enum):
    """The outcome of an advance."""

    OK = 0
    NON_FINITE = 1
    TOO_SMALL = 2
    CAPACITY = 3


class Steps(ABC):
    """An integration in progress, in scaled units; its time is |τ|.

    steps: taken so far.  forwards: whether time is positive.
    """

    steps: int
    forwards: bool

    @property
    @abstractmethod
    def order(self) -> int:
        """The highest order of a series; of the last step where it varies."""

    @property
    @abstractmethod
    def time(self) -> Fraction:
        """The exact time at the end of the last step."""

    @property
    @abstractmethod
    def state(self) -> tuple[Fraction, ...]:
        """The exact state at the end of the last step."""

    @abstractmethod
    def advance(self, target: Fraction, steps: int) -> Status:
        """Take at most ``steps`` steps, until the last covers ``target``."""

    @abstractmethod
    def sample(self, time: Fraction) -> tuple[Fraction, ...] | None:
        """The state at a time inside the last step, without side effects; None where numbers overflow their words."""

    @abstractmethod
    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        """y_n h^n of the last step, as the exact values of its words."""


class ResumableRun(Steps):
    """An integration that can be resumed."""

    @abstractmethod
    def resume_words(self) -> tuple[str, ...]:
        """The beginning of the last step as text, sufficient to resume with the same bits."""

    @abstractmethod
    def restore(self, numbers: tuple[str, ...], steps: int) -> None:
        """Resume from :meth:`resume_words`; steps: taken before it."""


# A problem in exact units in which its numbers are near 1.
#
# Ω = s ω, t = τ/s, γ = g γ', ξ = x ξ' with powers of two s, g, x: then ω' = A ω ω + (B/s²) g γ' + (C/s) ω, and the
# equations keep their form.  The scaling is exact, and the arithmetic has numbers of moderate size for data in any
# units.


_ROOT_BITS = 24
OTHER_AXES = ((1, 2), (2, 0), (0, 1))


@dataclass(frozen=True, slots=True)
class Scaled:
    """A problem in scaled units.

    state: (Ω, γ) or (Ω, γ, ξ), exact.  rate: s, in units of 1/t.  sizes: the unit of each component.  rest: whether the
    derivative is exactly 0.
    """

    system: System
    coefficients: Coefficients
    state: tuple[Fraction, ...]
    rate: Fraction
    sizes: tuple[Fraction, ...]
    rest: bool

    @classmethod
    def of(cls, system: System, p: Parameters, y: tuple[Fraction, ...], bounded: bool = False) -> Scaled:
        """The problem with parameters ``p`` that starts at ``y``, six or nine exact numbers.

        bounded: scale to |ω| <= 4 at all times, by the first integrals, instead of |ω| near 1 at the start.
        """
        constants = coefficients(system, p, len(y) == 9)
        gamma = _power_above(max(map(abs, y[3:6])))
        rate = _bound(system, p, y) / 4 if bounded else _rate(system, constants, p, y, gamma)
        sizes = [rate] * 3 + [gamma] * 3 + ([_power_above(max(map(abs, y[6:])))] * 3 if len(y) == 9 else [])
        scaled = constants.with_linear(gamma / rate**2, 1 / rate)
        state = tuple(value / size for value, size in zip(y, sizes, strict=True))
        omega = system.angular_velocity(p, y[:6])
        # cheap: γ turns on most motions
        turning = any(any(cross(vector, omega)) for vector in (y[3:6], y[6:]) if vector)
        rest = not turning and not any(system.field(p, y[:6]))
        return cls(system, scaled, state, rate, tuple(sizes), rest)

    @property
    def exponents(self) -> tuple[int, ...]:
        """log2 of the sizes."""
        return tuple(size.numerator.bit_length() - size.denominator.bit_length() for size in self.sizes)

    def products(self, component: int) -> dict[tuple[int, int], Fraction]:
        """Pair of components -> coefficient, of the quadratic part of one component's rate."""
        vector, axis = divmod(component, 3)
        j, k = OTHER_AXES[axis]
        if vector == 0:
            return {(j, k): self.coefficients.vectors[0][0][axis]}
        return {(3 * vector + j, k): Fraction(1), (3 * vector + k, j): Fraction(-1)}

    def linear(self, component: int) -> dict[int, Fraction]:
        """Component -> coefficient, of the linear part of one component's rate."""
        first = component < 6
        lane, offset = (component, 0) if first else (component - 3, 3)
        terms: dict[int, Fraction] = {}
        table = self.coefficients.vectors[0 if first else 1][1:]
        for row, permutation in zip(table, permutations(self.system), strict=True):
            source, c = permutation[lane], row[lane]
            if c and source != ZERO:
                terms[source + offset] = terms.get(source + offset, Fraction(0)) + c
        return terms

    def in_invariant_plane(self) -> Scaled:
        """The problem with rates that are exactly 0 in each component that is 0 at all times.

        Each term of such a rate has a factor that is 0 at all times.  The lanes compute γ × Ω from sums, whose rounding
        errors would grow about an unstable axis, as in a pendulum about the middle one.  The coefficients no longer
        serve the variational equation.
        """
        zeros = {k for k, value in enumerate(self.state) if not value}
        while moving := {k for k in zeros if not self._vanishes(k, zeros)}:
            zeros -= moving
        return replace(self, coefficients=self.coefficients.without(zeros)) if zeros else self

    def _vanishes(self, component: int, zeros: set[int]) -> bool:
        """Whether the rate of a component is 0 wherever ``zeros`` are."""
        products = all(zeros.intersection(pair) for pair, c in self.products(component).items() if c)
        return products and zeros.issuperset(self.linear(component))

    def back(self, state: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
        """A state in the units of the problem."""
        return tuple(value * size for value, size in zip(state, self.sizes, strict=True))


def _rate(
    system: System, coefficients: Coefficients, p: Parameters, y: tuple[Fraction, ...], gamma: Fraction
) -> Fraction:
    """A power of two near the rate of the motion: the largest of |Ω|, √(torque per moment), and |λ| or |k|/I."""
    speed = max(*map(abs, y[:3]), coefficients.turning, abs(p.rotor) if system is GYROSTAT else Fraction(0))
    return max((_power_above(speed) if speed else Fraction(0), _root_above(coefficients.torque * gamma))) or Fraction(1)


def _bound(system: System, p: Parameters, y: tuple[Fraction, ...]) -> Fraction:
    """A power of two not less than |Ω_i| at any time: from the energy, or from |M| and the rotor of the gyrostat."""
    omega, gamma = y[:3], y[3:6]
    smallest = min(p.inertia)
    if system is GYROSTAT:
        square = sum((i * w) ** 2 for i, w in zip(p.inertia, omega, strict=True)) / smallest**2
        return _root_above(max(square, Fraction(p.rotor) ** 2)) or Fraction(1)
    kinetic = sum(i * w * w for i, w in zip(p.inertia, omega, strict=True)) / 2
    torque = _root(sum(n * n for n in p.moment) * sum(g * g for g in gamma))
    turning = max(map(abs, p.rotor)) / smallest if system is HEAVY_GYROSTAT else Fraction(0)
    by_rotor = _power_above(turning) if turning else Fraction(0)
    return max(_root_above(2 * (kinetic + 2 * torque) / smallest), by_rotor) or Fraction(1)


def _root(value: Fraction) -> Fraction:
    """An upper bound of √value, at most a millionth too large; 0 for 0."""
    if value == 0:
        return value
    unit = Fraction(2) ** _ROOT_BITS / _root_above(value)
    return Fraction(isqrt(int(value * unit**2)) + 1) / unit


def _power_above(value: Fraction) -> Fraction:
    """The least power of two that is not less; 1 for 0."""
    if value == 0:
        return Fraction(1)
    top, bottom = value.as_integer_ratio()
    exponent = top.bit_length() - bottom.bit_length()
    larger = top << max(0, -exponent) > bottom << max(0, exponent)
    return Fraction(2) ** (exponent + larger)


def _root_above(value: Fraction) -> Fraction:
    """A power of two not less than √value, and at most 2 √value; 0 for 0."""
    if value == 0:
        return value
    above = _power_above(value)
    exponent = above.numerator.bit_length() - above.denominator.bit_length()
    return Fraction(2) ** -(-exponent // 2)


# The variational equation by powers of time, in machine code: V' = J(τ) V, V(0) = 1, in double.


def variation(slopes: Doubles) -> Doubles:
    """V_0, …, V_T with (n + 1) V_(n+1) = Σ_(m ≤ n) J_m V_(n−m), each a scalar product in double.

    slopes: J_0, …, J_(T−1), shape (T, size, size).  The result has shape (T + 1, size, size).
    """
    orders, size, _ = slopes.shape
    if isinstance(ir, Stub):
        return _variation_by_numpy(slopes)
    width = _width(size)
    entries, powers = doubles(slopes.size), doubles((orders + 1) * size * width)
    entries[:] = slopes.ravel()
    table = powers.reshape(orders + 1, size, width)
    table[0, :, :size] = numpy.eye(size)
    _machine(size).functions["variation"](pointer(entries), pointer(powers), orders)
    return table[:, :, :size]


def _variation_by_numpy(slopes: Doubles) -> Doubles:
    orders, size, _ = slopes.shape
    powers = numpy.zeros((orders + 1, size, size))
    powers[0] = numpy.eye(size)
    for n in range(orders):
        powers[n + 1] = numpy.einsum("mij,mjk->ik", slopes[: n + 1], powers[n::-1]) / (n + 1)
    return powers


def _width(size: int) -> int:
    """Doubles of a row of V."""
    return -(-size // LANES) * LANES


@once
def _machine(size: int) -> Machine:
    """variation(slopes, powers, orders) for matrices of ``size`` rows."""
    module = ir.Module("variation")
    _, code = function(module, "variation", ir.VoidType(), [POINTER, POINTER, INT])
    slopes, powers, orders = code.arguments
    width = _width(size)

    def order(n: Operand, _: list[Operand]) -> None:
        after = n + 1
        zeros = [code.zero] * (size * width // LANES)
        sums = code.loop(0, after, lambda m, values: _product(code, size, (slopes, powers), (m, n), values), zeros)
        divisor = code.spread(after.to_double())
        address = code.address(powers, after * (size * width))
        for k, total in enumerate(sums):
            code.store(total / divisor, address, LANES * k)

    code.loop(0, orders, order, [])
    code.builder.ret_void()
    return compiled(module)


def _product(
    code: Code, size: int, tables: tuple[Operand, Operand], at: tuple[Operand, Operand], sums: list[Operand]
) -> list[Operand]:
    """``sums`` + J_m V_(n−m)."""
    width, (m, n) = _width(size), at
    slope = code.address(tables[0], m * (size * size))
    power = code.address(tables[1], (n - m) * (size * width))
    parts = width // LANES
    rows = [code.load(power, LANES * k) for k in range(size * parts)]
    result = list(sums)
    for i in range(size):
        for j in range(size):
            factor = code.spread(code.load_one(slope, size * i + j))
            for part in range(parts):
                result[parts * i + part] = code.fma(factor, rows[parts * j + part], result[parts * i + part])
    return result
