"""A vector field of degree two, taken apart into exact numbers.

Both systems have fields f(y) = Q(y, y) + L y without a constant part.  The coefficients are not written down a second
time: they are read off the field itself by evaluating it at the basis vectors and their pairwise sums.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, lcm
from typing import Any

import numpy as np
from gmpy2 import mpq
from numpy.typing import NDArray

from heavytop.words.whole_series import Row

Matrix = NDArray[np.float64]
Field = Callable[[tuple[Any, ...]], Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Quadratic:
    """A field Q(y, y) + L y.

    pairs: the products y_j y_k that occur.  rows: the components.
    q, l: the largest row sums of absolute coefficients of the two parts, so |f(y)| ≤ q |y|² + l |y| and the Jacobian
    has |J(y)| ≤ 2 q |y| + l, in the maximum norm.
    jacobian: J(y)_ij = Σ_k jacobian[i, j, k] y_k + slope[i, j], rounded to binary64; infinite where it has no such.
    slack: (a, b): the true field differs from this one by at most a 2^b, in the maximum norm, wherever its motion goes.
    """

    pairs: tuple[tuple[int, int], ...]
    rows: tuple[Row, ...]
    q: Fraction
    l: Fraction  # noqa: E741 - the letter of the theorem
    jacobian: Matrix
    slope: Matrix
    slack: tuple[float, int] = (0.0, 0)

    @property
    def dimension(self) -> int:
        """The number of components."""
        return len(self.rows)


def quadratic(field: Field, dimension: int) -> Quadratic:
    """``field`` taken apart; it must be of degree two without a constant part."""
    unit = [tuple(mpq(int(i == j)) for i in range(dimension)) for j in range(dimension)]
    plus = [field(e) for e in unit]
    minus = [field(tuple(-x for x in e)) for e in unit]
    table: list[dict[tuple[int, int], Fraction]] = [{} for _ in range(dimension)]
    lines: list[dict[int, Fraction]] = [{} for _ in range(dimension)]
    for j in range(dimension):
        for i in range(dimension):
            _keep(table[i], (j, j), (plus[j][i] + minus[j][i]) / 2)
            _keep(lines[i], j, (plus[j][i] - minus[j][i]) / 2)
        for k in range(j + 1, dimension):
            both = field(tuple(x + y for x, y in zip(unit[j], unit[k], strict=True)))
            for i in range(dimension):
                _keep(table[i], (j, k), both[i] - plus[j][i] - plus[k][i])
    return _assemble(table, lines)


def _keep(row: dict[Any, Fraction], key: Any, value: Any) -> None:
    if value:
        row[key] = Fraction(int(value.numerator), int(value.denominator))


def _assemble(table: list[dict[tuple[int, int], Fraction]], lines: list[dict[int, Fraction]]) -> Quadratic:
    dimension = len(lines)
    pairs = tuple(sorted({pair for row in table for pair in row}))
    rows = []
    jacobian, slope = np.zeros((dimension,) * 3), np.zeros((dimension,) * 2)
    for i, (products, linear) in enumerate(zip(table, lines, strict=True)):
        common = lcm(*(c.denominator for c in (*products.values(), *linear.values())))
        rows.append(
            Row(
                common,
                tuple((int(c * common), pairs.index(pair)) for pair, c in products.items()),
                tuple((int(c * common), j) for j, c in linear.items()),
            )
        )
        for (j, k), c in products.items():
            jacobian[i, j, k] += _rounded(c)
            jacobian[i, k, j] += _rounded(c)
        for j, c in linear.items():
            slope[i, j] = _rounded(c)
    q = max(sum((abs(c) for c in row.values()), Fraction(0)) for row in table)
    l = max(sum((abs(c) for c in row.values()), Fraction(0)) for row in lines)  # noqa: E741
    return Quadratic(pairs, tuple(rows), q, l, jacobian, slope)


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return inf if value > 0 else -inf
