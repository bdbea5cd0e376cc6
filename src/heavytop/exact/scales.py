"""Numbers of any size: how long exact data may be, and the unit of time in which a motion is of ordinary size.

With Ω = s ω, τ = s t and P r = s² n the equations of ω, γ and n in τ are those of Ω, γ and P r in t.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from heavytop.errors import OutOfReach
from heavytop.top.equations import Parameters
from heavytop.top.heavy_top import HeavyTop, State

_LONGEST = 1 << 15
"""Bits of a numerator or denominator: exact invariants have up to twenty times as many, and are made in seconds."""
_ORDINARY = 16


def require_handy(top: HeavyTop, start: State, times: Iterable[Fraction] = ()) -> None:
    """Raises OutOfReach for numbers whose exact arithmetic would take longer than anyone waits."""
    for value in (*top.inertia, *top.moment, *(top.rotor or ()), *start.flat, *times):
        length = max(value.numerator.bit_length(), value.denominator.bit_length())
        if length > _LONGEST:
            raise OutOfReach(
                f"A number of the top, the start or a time is a fraction of {length} bits.",
                f"References are proven for fractions of up to {_LONGEST} bits, 1e-9000 to 1e9000: choose other units.",
            )


def unit_of_time(parameters: Parameters, start: tuple[Fraction, ...]) -> int:
    """k such that the motion changes at about the rate 2^k; 0 for ordinary rates, from 2^-16 to 2^16.

    The rates are |Ω|, |λ| or |k|/I, and the root of |P r||γ|/I, whichever is largest.
    """
    turning = max(*map(abs, start[:3]), parameters.rotor_rate)
    weight = max(map(abs, parameters.moment)) * max(map(abs, start[3:6])) / min(parameters.inertia)
    rates = [exponent(turning)] * (turning > 0) + [exponent(weight) // 2] * (weight > 0)
    largest = max(rates, default=None)
    return 0 if largest is None or -_ORDINARY <= largest <= _ORDINARY else largest


def exponent(value: Fraction) -> int:
    """e with 2^(e − 1) < value < 2^(e + 1), value > 0."""
    return value.numerator.bit_length() - value.denominator.bit_length()
