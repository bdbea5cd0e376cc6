"""A problem in units in which its numbers are near 1, exactly.

Ω = s ω, t = τ/s, γ = g γ', ξ = x ξ' with powers of two s, g, x: then ω' = A ω ω + (B/s²) g γ' + (C/s) ω, and the
equations keep their form.  All of it is exact, and whatever the units of the data, the arithmetic sees numbers of
moderate size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt

from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, Parameters, System
from heavytop.words.lanes import Coefficients, coefficients

_ROOT_BITS = 24


@dataclass(frozen=True, slots=True)
class Scaled:
    """state: (Ω, γ) or (Ω, γ, ξ), exact, in these units.  rate: s, in units of 1/t.  sizes: what each component is in
    units of.  rest: whether the derivative is exactly 0.
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

        bounded: with |ω| <= 4 at all times, by the first integrals, in place of |ω| near 1 at the start.
        """
        given = coefficients(system, p, len(y) == 9)
        gamma = _power_above(max(map(abs, y[3:6])))
        rate = _bound(system, p, y) / 4 if bounded else _rate(system, given, p, y, gamma)
        sizes = [rate] * 3 + [gamma] * 3 + ([_power_above(max(map(abs, y[6:])))] * 3 if len(y) == 9 else [])
        scaled = given.with_linear(gamma / rate**2, 1 / rate)
        state = tuple(value / size for value, size in zip(y, sizes, strict=True))
        return cls(system, scaled, state, rate, tuple(sizes), _rests(system, p, y))

    @property
    def exponents(self) -> tuple[int, ...]:
        """log2 of the sizes."""
        return tuple(size.numerator.bit_length() - size.denominator.bit_length() for size in self.sizes)

    def back(self, state: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
        """A state in the units of the problem."""
        return tuple(value * size for value, size in zip(state, self.sizes, strict=True))


def _rests(system: System, p: Parameters, y: tuple[Fraction, ...]) -> bool:
    """Whether the derivative is exactly 0; most motions turn γ, which two products show."""
    omega = system.angular_velocity(p, y[:6])
    return all(_parallel(vector, omega) for vector in (y[3:6], y[6:]) if vector) and not any(system.field(p, y[:6]))


def _parallel(a: Sequence[Fraction], b: Sequence[Fraction]) -> bool:
    return all(a[i] * b[j] == a[j] * b[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def _rate(system: System, given: Coefficients, p: Parameters, y: tuple[Fraction, ...], gamma: Fraction) -> Fraction:
    """A power of two near the rate of the motion: the largest of |Ω|, √(torque per moment), and |λ| or |k|/I."""
    speed = max(*map(abs, y[:3]), given.turning, abs(p.rotor) if system is GYROSTAT else Fraction(0))
    return max((_power_above(speed) if speed else Fraction(0), _root_above(given.torque * gamma))) or Fraction(1)


def _bound(system: System, p: Parameters, y: tuple[Fraction, ...]) -> Fraction:
    """A power of two not less than |Ω_i| at any time: from the energy, or from |M| and the rotor of the gyrostat."""
    omega, gamma = y[:3], y[3:6]
    least = min(p.inertia)
    if system is GYROSTAT:
        square = sum((i * w) ** 2 for i, w in zip(p.inertia, omega, strict=True)) / least**2
        return _root_above(max(square, Fraction(p.rotor) ** 2)) or Fraction(1)
    kinetic = sum(i * w * w for i, w in zip(p.inertia, omega, strict=True)) / 2
    torque = _root(sum(n * n for n in p.moment) * sum(g * g for g in gamma))
    turning = max(map(abs, p.rotor)) / least if system is HEAVY_GYROSTAT else Fraction(0)
    by_rotor = _power_above(turning) if turning else Fraction(0)
    return max(_root_above(2 * (kinetic + 2 * torque) / least), by_rotor) or Fraction(1)


def _root(value: Fraction) -> Fraction:
    """Not less than √value, and at most a millionth larger; 0 for 0."""
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
