"""Combinations with factors that are not negative: the exact linear program behind inequalities."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeVar

_MOST_STEPS = 150
Row = list[Fraction]
Monomial = TypeVar("Monomial", bound=Hashable)


def nonnegative_combination(target: Mapping[Monomial, Any], columns: Sequence[Mapping[Monomial, Any]]) -> Row | None:
    """Weights c ≥ 0 with Σ c column = target, exactly; None where there are none, or none was found in time.

    target, columns: coefficients by monomial, those that are left out are 0.
    """
    wanted = {monomial: _fraction(value) for monomial, value in target.items()}
    parts = [{monomial: _fraction(value) for monomial, value in column.items()} for column in columns]
    kept = _useful(wanted, parts)
    monomials = list(dict.fromkeys([*wanted, *(monomial for j in kept for monomial in parts[j])]))
    rows = [[parts[j].get(m, Fraction(0)) for j in kept] + [wanted.get(m, Fraction(0))] for m in monomials]
    rows = [row if row[-1] >= 0 else [-value for value in row] for row in rows]
    combination = _feasible(rows, len(kept))
    if combination is None:
        return None
    weights = [Fraction(0)] * len(columns)
    for j, weight in zip(kept, combination, strict=True):
        weights[j] = weight
    return weights


def _fraction(value: Any) -> Fraction:
    return Fraction(int(value.p), int(value.q)) if hasattr(value, "p") else Fraction(value)


def _useful(wanted: Mapping[Monomial, Fraction], parts: Sequence[Mapping[Monomial, Fraction]]) -> list[int]:
    """Columns that can have a weight: no monomial of theirs is left over with one sign."""
    kept = list(range(len(parts)))
    while True:
        signs: dict[Monomial, set[bool]] = {}
        for j in kept:
            for monomial, value in parts[j].items():
                signs.setdefault(monomial, set()).add(value > 0)
        for monomial, value in wanted.items():
            signs.setdefault(monomial, set()).add(value < 0)
        left = [j for j in kept if all(len(signs[monomial]) == 2 for monomial in parts[j])]
        if left == kept:
            return kept
        kept = left


def _feasible(rows: list[Row], count: int) -> Row | None:
    """A solution ≥ 0 of rows = (coefficients, right side ≥ 0) by the simplex method with Bland's rule."""
    basis = [-1] * len(rows)
    for _ in range(_MOST_STEPS):
        # what the rows still without a basic column add up to has to become 0
        short = [row for row, basic in zip(rows, basis, strict=True) if basic < 0]
        if not any(row[-1] for row in short):
            solution = [Fraction(0)] * count
            for row, basic in zip(rows, basis, strict=True):
                if basic >= 0:
                    solution[basic] = row[-1]
            return solution
        entering = next((j for j in range(count) if j not in basis and sum(row[j] for row in short) > 0), None)
        if entering is None:
            return None
        ratios = [(row[-1] / row[entering], basis[i], i) for i, row in enumerate(rows) if row[entering] > 0]
        _, _, pivot = min(ratios)
        scale = rows[pivot][entering]
        rows[pivot] = [value / scale for value in rows[pivot]]
        for i, row in enumerate(rows):
            if i != pivot and row[entering]:
                factor = row[entering]
                rows[i] = [value - factor * other for value, other in zip(row, rows[pivot], strict=True)]
        basis[pivot] = entering
    return None
