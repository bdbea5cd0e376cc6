"""Combinations with factors that are not negative: the exact linear program behind inequalities."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeVar

from heavytop.features.claims.algebra.ring import as_fraction

_MOST_STEPS = 150
Row = list[Fraction]
Monomial = TypeVar("Monomial", bound=Hashable)


def nonnegative_combination(target: Mapping[Monomial, Any], columns: Sequence[Mapping[Monomial, Any]]) -> Row | None:
    """Weights c ≥ 0 with Σ c column = target, exactly; None where none exist, or none was found in time.

    target, columns: coefficients by monomial; others are 0.
    """
    useful = _useful(target, columns)
    monomials = list(dict.fromkeys([*target, *(monomial for j in useful for monomial in columns[j])]))
    rows = [[_fraction(column.get(m, 0)) for column in (*(columns[j] for j in useful), target)] for m in monomials]
    rows = [row if row[-1] >= 0 else [-value for value in row] for row in rows]
    combination = _feasible(rows, len(useful))
    if combination is None:
        return None
    weights = dict(zip(useful, combination, strict=True))
    return [weights.get(j, Fraction(0)) for j in range(len(columns))]


def _fraction(value: Any) -> Fraction:
    return as_fraction(value) if hasattr(value, "p") else Fraction(value)


def _useful(target: Mapping[Monomial, Any], columns: Sequence[Mapping[Monomial, Any]]) -> list[int]:
    """The columns that may have a weight: each of their monomials can be cancelled by the others or the target."""
    useful = list(range(len(columns)))
    while True:
        signs: dict[Monomial, set[bool]] = {}
        for j in useful:
            for monomial, value in columns[j].items():
                signs.setdefault(monomial, set()).add(value > 0)
        for monomial, value in target.items():
            signs.setdefault(monomial, set()).add(value < 0)
        remaining = [j for j in useful if all(len(signs[monomial]) == 2 for monomial in columns[j])]
        if remaining == useful:
            return useful
        useful = remaining


def _feasible(rows: list[Row], count: int) -> Row | None:
    """A solution ≥ 0 of rows = (coefficients, right side ≥ 0) by the simplex method with Bland's rule."""
    basis = [-1] * len(rows)
    for _ in range(_MOST_STEPS):
        # the sum of the rows without a basic column has to become 0
        infeasible = [row for row, basic in zip(rows, basis, strict=True) if basic < 0]
        if not any(row[-1] for row in infeasible):
            solution = [Fraction(0)] * count
            for row, basic in zip(rows, basis, strict=True):
                if basic >= 0:
                    solution[basic] = row[-1]
            return solution
        entering = next((j for j in range(count) if j not in basis and sum(row[j] for row in infeasible) > 0), None)
        if entering is None:
            return None
        ratios = [(row[-1] / row[entering], basis[i], i) for i, row in enumerate(rows) if row[entering] > 0]
        _, _, pivot = min(ratios)
        scale = rows[pivot][entering]
        rows[pivot] = [value / scale for value in rows[pivot]]
        for i, row in enumerate(rows):
            if i != pivot and row[entering]:
                factor = row[entering]
                rows[i] = [value - factor * pivoted for value, pivoted in zip(row, rows[pivot], strict=True)]
        basis[pivot] = entering
    return None
