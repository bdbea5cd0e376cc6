"""The tensor of inertia of a claim: three principal moments, or six or nine entries in other axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy

from heavytop.claims.conditions import Kind, Need
from heavytop.errors import InputError

_ORDER = (0, 3, 4, 3, 1, 5, 4, 5, 2)
"""Place of each entry, row by row, among I11, I22, I33, I12, I13, I23."""
_REMEDY = "Give 3 principal moments, 6 entries I11, I22, I33, I12, I13, I23 of the tensor, or 9, row by row."


@dataclass(frozen=True, slots=True)
class TensorTexts:
    """The entries as they are written: three, or nine row by row."""

    texts: tuple[str, ...]

    @property
    def diagonal(self) -> tuple[str, ...]:
        """The moments about the axes."""
        return self.texts if len(self.texts) == 3 else self.texts[::4]

    def of(self, entries: Sequence[Any]) -> tuple[Any, ...]:
        """Three moments, or three rows; raises InputError for a tensor that is not symmetric."""
        if len(entries) == 3:
            return tuple(entries)
        rows = tuple(tuple(entries[3 * i : 3 * i + 3]) for i in range(3))
        for i, j in combinations(range(3), 2):
            if sympy.expand(rows[i][j] - rows[j][i]) != 0:
                pair = f"I{i + 1}{j + 1} = {self.texts[3 * i + j]}, I{j + 1}{i + 1} = {self.texts[3 * j + i]}"
                raise InputError(f"The tensor of inertia is not symmetric: {pair}.", _REMEDY)
        # off the diagonal 0: the axes are principal
        if all(rows[i][j] == 0 for i, j in combinations(range(3), 2)):
            return rows[0][0], rows[1][1], rows[2][2]
        return rows


def read_tensor(inertia: Sequence[str | list[str]]) -> TensorTexts:
    """The entries of ``inertia``; raises InputError unless they are 3, 6 or 9, or 3 rows of 3."""
    if all(isinstance(part, list) for part in inertia):
        if len(inertia) != 3 or any(len(row) != 3 for row in inertia):
            raise InputError("top.inertia: the rows are not 3 of 3.", _REMEDY)
        return TensorTexts(tuple(text for row in inertia for text in row))
    if not all(isinstance(part, str) for part in inertia) or len(inertia) not in (3, 6, 9):
        raise InputError(f"top.inertia: {len(inertia)} entries.", _REMEDY)
    texts = tuple(str(part) for part in inertia)
    return TensorTexts(tuple(texts[place] for place in _ORDER) if len(texts) == 6 else texts)


def minors(inertia: Sequence[Any]) -> tuple[sympy.Expr, ...]:
    """What is > 0 of every body: the moments; of a full tensor its principal minors, the determinant last."""
    if not isinstance(inertia[0], tuple):
        return tuple(inertia)
    return _principal_minors(sympy.Matrix(inertia))


def _principal_minors(matrix: sympy.Matrix) -> tuple[sympy.Expr, ...]:
    places = (chosen for size in (1, 2, 3) for chosen in combinations(range(3), size))
    return tuple(sympy.expand(matrix.extract(chosen, chosen).det()) for chosen in places)


def of_bodies(inertia: Sequence[Any]) -> tuple[Need, ...]:
    """∫ x xᵀ dm = ½ tr I − I is positive semidefinite: its principal minors are >= 0; () for numbers."""
    matrix = sympy.Matrix(inertia)
    if not matrix.free_symbols:
        return ()
    spread = sympy.eye(3) * matrix.trace() / 2 - matrix
    return tuple(Need(Kind.NONNEGATIVE, minor) for minor in _principal_minors(spread) if minor.free_symbols)
