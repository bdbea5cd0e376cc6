"""Where in eight lanes the products of the three fields are.

A state vector holds Ω1 Ω2 Ω3 γ1 γ2 γ3 in lanes 0 to 5; an attitude vector ξ lies in lanes 3 to 5 of a second one, whose
other lanes are 0.  Lanes 6 and 7 are 0.  The products of Taylor series that the fields need are then, lane by lane,

    S_n = Σ_m L_m ∘ R_(n−m),   L, R: sums of two lanes of y,

three lanes for Ω × Ω and five for γ × Ω: the determinant is a sum of five products, so that no sum runs across lanes.
For ξ × Ω the left sides come from the second vector and the right sides are the same.  The derivative is

    y' = A ∘ (S permuted and added) + Σ_l B_l ∘ (y permuted),

with A = 1/2 in lanes 3 to 5.  A and B are not written down here: they are read off the field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from gmpy2 import mpq

from heavytop.top.equations import Parameters, System

ZERO = 6
"""A lane that is 0 in every state vector."""


@dataclass(frozen=True, slots=True)
class Sum:
    """Lane by lane y[first] + sign y[second]; where the second is ZERO, y[first] alone."""

    first: tuple[int, ...]
    second: tuple[int, ...]
    sign: tuple[int, ...]


LEFT = Sum((1, 2, 0, 4, 3, 4, 5, 3), (6, 6, 6, 5, 4, 4, 4, 4), (0, 0, 0, 1, 1, 1, -1, -1))
RIGHT = Sum((2, 0, 1, 0, 1, 2, 0, 1), (6, 6, 6, 1, 2, 0, 1, 2), (0, 0, 0, -1, -1, -1, 1, 1))

# lanes 3 to 7 of S are T1 to T5: γ × Ω = (T1 + T3 − T4, T1 + T2 + T4 − T5, T2 + T3 + T5) / 2
GATHERED: tuple[tuple[tuple[int, int], ...], ...] = (
    ((0, 1), (1, 1), (2, 1), (3, 1), (3, 1), (4, 1)),
    ((0, 0), (0, 0), (0, 0), (5, 1), (4, 1), (5, 1)),
    ((0, 0), (0, 0), (0, 0), (6, -1), (6, 1), (7, 1)),
    ((0, 0), (0, 0), (0, 0), (0, 0), (7, -1), (0, 0)),
)
"""Four lists of (lane of S, sign), one for each lane 0 to 5 of the derivative; they are added."""

_NONE = (ZERO,) * 5
_TORQUE, _TURNING = ((4, 5, 3, *_NONE), (5, 3, 4, *_NONE)), ((2, 0, 1, *_NONE), (1, 2, 0, *_NONE))
# γ × n for the heavy top; λ terms for the gyrostat; γ × n and k × Ω for the heavy gyrostat
_TURNED: dict[str, tuple[tuple[int, ...], ...]] = {
    "heavy_top": _TORQUE,
    "gyrostat": ((2, ZERO, 0, 5, ZERO, 3, ZERO, ZERO),),
    "heavy_gyrostat": (*_TORQUE, *_TURNING),
}
_TORQUES = {"heavy_top": 2, "gyrostat": 0, "heavy_gyrostat": 2}
"""How many of them, the first, are of γ in the rate of Ω."""


_BESIDE: dict[str, tuple[tuple[int, ...], ...]] = {
    "heavy_top": ((4, 5, 3, 5, 3, 4, ZERO, ZERO),),
    "gyrostat": _TURNED["gyrostat"],
    "heavy_gyrostat": ((4, 5, 3, 5, 3, 4, ZERO, ZERO), (2, 0, 1, 1, 2, 0, ZERO, ZERO)),
}


def beside(system: System) -> tuple[tuple[tuple[int, ...], ...], bool]:
    """The permutations of y in the linear part, two as one; whether lanes 3 to 5, the second, are added to 0 to 2."""
    return _BESIDE[system.name], len(_TURNED[system.name]) > 1


def turned(system: System) -> tuple[tuple[int, ...], ...]:
    """The permutations of y in the linear part, one, two or four."""
    return _TURNED[system.name]


@dataclass(frozen=True, slots=True)
class Coefficients:
    """A and B_l of each state vector, eight exact numbers each: shape (vectors, 1 + number of permutations, 8).

    torques: how many B_l, the first, are of γ in the rate of Ω.  torque, turning: the largest |coefficient| of the
    first vector in those and in the others.
    """

    vectors: tuple[tuple[tuple[Fraction, ...], ...], ...]
    torques: int
    torque: Fraction
    turning: Fraction

    @property
    def largest(self) -> Fraction:
        """The largest |coefficient|."""
        return max(abs(c) for vector in self.vectors for row in vector for c in row)

    @property
    def beside(self) -> tuple[tuple[tuple[Fraction, ...], ...], ...]:
        """A and one B of each vector for each permutation of :func:`beside`."""
        return tuple(
            (first, *linear)
            if len(linear) == 1
            else (first, *((*a[:3], *b[:3], *a[6:]) for a, b in zip(linear[::2], linear[1::2], strict=True)))
            for first, *linear in self.vectors
        )

    def with_linear(self, torque: Fraction, turning: Fraction) -> Coefficients:
        """The same with every B multiplied: those of γ in the rate of Ω by ``torque``, the others by ``turning``."""
        factors = [Fraction(1), *(torque if k < self.torques else turning for k in range(len(self.vectors[0]) - 1))]
        return Coefficients(
            tuple(
                tuple(tuple(c and c * factor for c in row) for row, factor in zip(rows, factors, strict=True))
                for rows in self.vectors
            ),
            self.torques,
            self.torque * torque,
            self.turning * turning,
        )


@lru_cache(maxsize=256)
def coefficients(system: System, p: Parameters, attitude: bool) -> Coefficients:
    """Those of the field, exactly, for exact parameters."""

    exactly = p.mapped(mpq)  # quicker than Fractions, and as exact

    def unit(*axes: int) -> list[Any]:
        return [mpq(int(axis in axes)) for axis in range(6)]

    def rates(y: Sequence[Any]) -> Sequence[Any]:
        return system.field(exactly, y)

    half = mpq(1, 2)
    others = ((1, 2), (2, 0), (0, 1))
    at, against = ([rates([sign * v for v in unit(j)]) for j in range(6)] for sign in (1, -1))
    products = [rates(unit(i, j))[k] - at[i][k] - at[j][k] for k, (i, j) in enumerate(others)]
    linear = [[(a - b) / 2 for a, b in zip(*pair, strict=True)] for pair in zip(at, against, strict=True)]
    permuted = [[mpq(0) if j == ZERO else linear[j][k] for k, j in enumerate(row[:6])] for row in turned(system)]
    rows = [_eight(row) for row in ([*products, half, half, half], *permuted)]
    torques = _TORQUES[system.name]
    sizes = [[abs(c) for row in part for c in row] for part in (rows[1 : 1 + torques], rows[1 + torques :])]
    largest = [max(part, default=Fraction(0)) for part in sizes]
    if not attitude:
        return Coefficients((tuple(rows),), torques, *largest)
    # ξ' = ξ × ω turns as γ does
    third = [[Fraction(0)] * 3 + list(row[3:6]) for row in rows]
    return Coefficients((tuple(rows), tuple(_eight(row) for row in third)), torques, *largest)


def _eight(row: Sequence[Any]) -> tuple[Fraction, ...]:
    return tuple(Fraction(int(c.numerator), int(c.denominator)) for c in row) + (Fraction(0),) * (8 - len(row))


def rates(system: System, given: Coefficients, y: Sequence[Any]) -> list[Any]:
    """The derivative of (Ω, γ) or (Ω, γ, ξ) as the lanes compute it, exactly for exact numbers of any kind."""
    return series_rates(system, given, [y])


def series_rates(system: System, given: Coefficients, series: Sequence[Sequence[Any]]) -> list[Any]:
    """Coefficient n of the derivative of a motion whose Taylor coefficients from 0 to n these are."""
    lanes = [[[*y[:6], 0, 0], [0, 0, 0, *y[6:], 0, 0]][: len(given.vectors)] for y in series]
    right = [_side(y[0], RIGHT) for y in reversed(lanes)]
    found: list[Any] = []
    for vector, (first, *linear) in enumerate(given.vectors):
        left, state = [_side(y[vector], LEFT) for y in lanes], lanes[-1][vector]
        products = [sum(a[k] * b[k] for a, b in zip(left, right, strict=True)) for k in range(8)]
        gathered = [sum(sign * products[lane] for lane, sign in column) for column in zip(*GATHERED, strict=True)]
        derivative = [a * s for a, s in zip(first, gathered, strict=False)]
        for row, permutation in zip(linear, turned(system), strict=True):
            derivative = [d + b * state[lane] for d, b, lane in zip(derivative, row, permutation, strict=False)]
        found += derivative[3 * vector :]
    return found


def _side(y: Sequence[Any], which: Sum) -> list[Any]:
    return [y[a] + sign * y[b] for a, b, sign in zip(which.first, which.second, which.sign, strict=True)]
