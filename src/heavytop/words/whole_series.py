"""Taylor coefficients of a motion of a quadratic field in whole numbers, each rounded once.

In units of 2^-precision, for steps h = 2^-halvings: b_{n+1} = round(h f_n/(n + 1)), where f_n needs every product
b_j b_{n−j}.  Inside short blocks these are summed one by one; between blocks they are taken as products of polynomials
with whole coefficients, as soon as both factors are known (relaxed multiplication; J. van der Hoeven, "Relax, but
don't be too lazy", 2002).  All sums are exact, so the coefficients do not depend on the way they were summed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import mul
from typing import Protocol

from flint import fmpz_poly
from gmpy2 import mpz

_BLOCK = 64


@dataclass(frozen=True, slots=True)
class Row:
    """One component of a field of degree two, (Σ c y_j y_k + Σ c y_j) / denominator with whole numbers c.

    products: (c, index of the pair (j, k)).  linear: (c, j).
    """

    denominator: int
    products: tuple[tuple[int, int], ...]
    linear: tuple[tuple[int, int], ...]


class Field(Protocol):
    """A field of degree two without a constant part."""

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The products y_j y_k that occur."""

    @property
    def rows(self) -> tuple[Row, ...]:
        """The components."""


def coefficients(motion: Field, centre: Sequence[int], precision: int, halvings: int) -> list[list[mpz]] | None:
    """b_0, b_1, ... of each component, up to two in a row that are within 2 units; None where they do not come to that.

    They should within 0.45 orders a bit; a step twice too long is given up at half an order a bit.
    """
    longest = max(abs(value) for value in centre).bit_length() // 2 + 32
    series = _Series(motion, precision, precision + halvings, longest, [[mpz(value)] for value in centre])
    size = _BLOCK
    while size < longest:
        size *= 2
    series.fill(0, size)
    return series.values if series.settled else None


@dataclass(slots=True)
class _Series:
    """values: what is known of each component.  between: of each row, the products that are already summed."""

    motion: Field
    precision: int
    shift: int
    longest: int
    values: list[list[mpz]]
    between: list[list[mpz]] = field(default_factory=list)
    settled: bool = False

    def __post_init__(self) -> None:
        self.between = [[mpz(0)] * self.longest for _ in self.motion.rows]

    def fill(self, low: int, high: int) -> None:
        """b_{n+1} for low ≤ n < high."""
        if self.settled or low >= self.longest:
            return
        if high - low <= _BLOCK:
            self._fill_block(low, min(high, self.longest))
            return
        middle = (low + high) // 2
        self.fill(low, middle)
        if not self.settled and middle < self.longest:
            self._multiply(low, middle, min(high, self.longest))
            self.fill(middle, high)

    def _fill_block(self, low: int, high: int) -> None:
        y = self.values
        for n in range(low, high):
            sums = [self._within(y[j], y[k], low, n) for j, k in self.motion.pairs]
            last = [component[n] for component in y]
            for component, row, known in zip(y, self.motion.rows, self.between, strict=True):
                linear = sum((c * last[j] for c, j in row.linear), mpz(0))
                whole = sum((c * sums[pair] for c, pair in row.products), known[n] + (linear << self.precision))
                divisor = mpz(row.denominator * (n + 1)) << self.shift
                component.append((2 * whole + divisor) // (2 * divisor))
            if n > 2 and all(-2 <= component[i] <= 2 for component in y for i in (-1, -2)):
                self.settled = True
                return

    @staticmethod
    def _within(a: list[mpz], b: list[mpz], low: int, n: int) -> mpz:
        """The products a_j b_{n−j} that no earlier block could know: j or n − j from ``low`` on."""
        total = sum(map(mul, a[low:], reversed(b[: n - low + 1])), mpz(0))
        return total if low == 0 else total + sum(map(mul, b[low:], reversed(a[: n - low + 1])))

    def _multiply(self, low: int, middle: int, high: int) -> None:
        """Add the products of b_low..b_{middle−1} with all known ones, as far as they reach middle ≤ n < high."""
        length = high - low
        used = {index for pair in self.motion.pairs for index in pair}
        new = {i: fmpz_poly([int(v) for v in self.values[i][low:middle]]) for i in used}
        first = new if low == 0 else {i: fmpz_poly([int(v) for v in self.values[i][:length]]) for i in used}
        products = [new[j].mul_low(first[k], length) for j, k in self.motion.pairs]
        if low > 0:
            products = [
                known + first[j].mul_low(new[k], length)
                for known, (j, k) in zip(products, self.motion.pairs, strict=True)
            ]
        for row, between in zip(self.motion.rows, self.between, strict=True):
            total = sum((c * products[pair] for c, pair in row.products), fmpz_poly([]))
            for n, value in enumerate(total.coeffs()[middle - low :], middle):
                between[n] += int(value)
