"""The Taylor polynomial of a step: whole coefficients, with what its proof needs to know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Protocol

import numpy as np
from flint import fmpz_poly
from gmpy2 import mpz

from heavytop.exact.quadratic import Matrix, Quadratic

# relative room for the rounding of a bound
_UP = 1 + 2.0**-32
_TINY = 2.0**-190


class StepSeries(Protocol):
    """b_0, …, b_N of every component, in whole ulps.

    Made of exact integers (:class:`Whole`) or on a grid of words (:class:`heavytop.words.proven.Series`).
    """

    @property
    def thrifty(self) -> tuple[float, float]:
        """Orders a bit between which a unit of time costs least."""

    @property
    def order(self) -> int:
        """N."""

    @property
    def rounding(self) -> float:
        """A bound, in ulps, of Σ_(n < N) |b_(n+1) − h f_n/(n + 1)|, in the maximum norm."""

    @property
    def values(self) -> list[list[int]]:
        """The coefficients of each component."""

    @property
    def total(self) -> Sequence[int]:
        """Σ b_n, exactly: what the next step begins at, as it stands."""

    @property
    def sizes(self) -> Matrix:
        """Upper bounds of β_n = |b_n|, as numbers; shape (N + 1,)."""

    def scaled(self, rate: int) -> Matrix:
        """Upper bounds of 2^(rate n) β_n, as numbers."""

    def rounded(self, orders: int) -> Matrix:
        """b_0 to b_orders in binary64, as many as there are, within 2^-50 of ``sizes`` plus 2^-199."""


@dataclass(frozen=True)
class Whole:
    """Coefficients of :func:`heavytop.words.whole_series.coefficients`, each rounded to nearest."""

    values: list[list[int]]
    precision: int

    @property
    def thrifty(self) -> tuple[float, float]:
        """2.1 to 3.8 bits a power of τ, about e^-2: N² multiplications of a step 1/h."""
        return 0.27, 0.45

    @property
    def order(self) -> int:
        """N."""
        return len(self.values[0]) - 1

    @property
    def rounding(self) -> float:
        """Half an ulp an order."""
        return self.order / 2

    @property
    def total(self) -> tuple[int, ...]:
        """Σ b_n."""
        return tuple(sum(component, mpz(0)) for component in self.values)

    @cached_property
    def _lengths(self) -> Matrix:
        """Bits of β_n, in ulps."""
        return np.array([max(map(abs, column)).bit_length() for column in zip(*self.values, strict=True)])

    @property
    def sizes(self) -> Matrix:
        """The first in binary64, the others by their lengths."""
        bounds = np.ldexp(1.0, np.maximum(self._lengths - self.precision, -200))
        first = np.abs(self.rounded(32)).max(axis=1)
        bounds[: first.size] = first * _UP + _TINY
        return np.asarray(bounds)

    def scaled(self, rate: int) -> Matrix:
        """Powers of two, so that binary64 holds them at any precision."""
        return np.ldexp(1.0, np.maximum(self._lengths - self.precision + rate * np.arange(self.order + 1), -900))

    def rounded(self, orders: int) -> Matrix:
        """Their leading 200 bits, rounded."""
        shift = max(0, self.precision - 200)
        short = [[float(value >> shift) for value in component[: orders + 1]] for component in self.values]
        return np.asarray(np.ldexp(np.array(short).T, shift - self.precision))


def lacking(motion: Quadratic, series: StepSeries, precision: int, halvings: int) -> list[Fraction]:
    """|b_(n+1) − h f_n/(n + 1)| in the maximum norm, in ulps, for 0 ≤ n < N: exactly, from whole numbers."""
    polynomials = [fmpz_poly([int(value) for value in component]) for component in series.values]
    products = [polynomials[j] * polynomials[k] for j, k in motion.pairs]
    found = [Fraction(0)] * series.order
    for component, row in zip(series.values, motion.rows, strict=True):
        quadratic = sum((c * products[pair] for c, pair in row.products), fmpz_poly([]))
        linear = sum((c * polynomials[j] for c, j in row.linear), fmpz_poly([]))
        for n in range(series.order):
            rate = int(quadratic[n]) + (int(linear[n]) << precision)
            step = Fraction(rate, row.denominator * (n + 1) << precision) / Fraction(2) ** halvings
            found[n] = max(found[n], abs(int(component[n + 1]) - step))
    return found
