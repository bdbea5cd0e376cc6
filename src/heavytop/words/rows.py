"""How the coefficients of a step are kept, an order a row, and how their products are summed: what both ways share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from llvmlite import ir

from heavytop.words.kernels import WIDEST, Grid
from heavytop.words.lanes import LEFT, RIGHT, Sum
from heavytop.words.machine import Doubles
from heavytop.words.vector import Code, Index


@dataclass(frozen=True, slots=True)
class Size:
    """Doubles of a row, of all rows and of the sums; integers of the places."""

    row: int
    rows: int
    sums: int
    places: int


@dataclass(slots=True)
class Rows(ABC):
    """Writes what keeps the coefficients y_n of ``vectors`` state vectors, K words each, and sums their products.

    orders: as many as there is room for.  rows, sums, places, seen: scratch as :meth:`size` says, zeros at first.
    """

    code: Code
    grid: Grid
    vectors: int
    orders: int
    rows: Any
    sums: Any
    places: Any
    seen: Any
    kernels: list[Any]

    @staticmethod
    @abstractmethod
    def size(grid: Grid, vectors: int, orders: int) -> Size:
        """What ``orders`` orders need."""

    @staticmethod
    @abstractmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[Any]:
        """The functions that sum products; which is best depends on how many registers there are, no result does."""

    @staticmethod
    @abstractmethod
    def left(rows: Doubles, grid: Grid, vectors: int, n: int, vector: int) -> list[Fraction]:
        """The eight lanes of L of an order, out of the rows."""

    @abstractmethod
    def stored(self, n: Any, vector: int) -> list[Any]:
        """L of an order as K words, not carried."""

    @abstractmethod
    def begin(self, y: list[Any], wide: Any) -> Any:
        """Store y_0; gives the largest word over its limit."""

    @abstractmethod
    def keep(self, n: Index, y: list[Any], zeros: Any, wide: Any) -> tuple[list[Any], Any, Any]:
        """Store y_n; gives y_n as it was stored, the zeros from now on, and the largest word over its limit.

        zeros: an integer about leading zeros, which begins at 0.
        """

    @abstractmethod
    def products(self, n: Any, zeros: Any, vector: int) -> list[Any]:
        """S_n = Σ L_m ∘ R_(n−m) of a vector: K words, not carried."""

    def sides(self, y: list[Any]) -> list[list[Any]]:
        """R, and L of each vector, word by word."""
        words = self.grid.words
        parts = [y[words * v : words * (v + 1)] for v in range(self.vectors)]
        return [_side(self.code, parts[0], RIGHT), *(_side(self.code, part, LEFT) for part in parts)]

    def largest_sum(self, y: list[Any]) -> Any:
        """The largest sum of |words| of a component, a double."""
        code, words = self.code, self.grid.words
        largest = code.zero
        for v in range(self.vectors):
            one = code.absolute(y[words * v])
            for word in y[words * v + 1 : words * (v + 1)]:
                one = code.add(one, code.absolute(word))
            largest = code.larger(one, largest)
        return code.largest(largest)

    def watch(self, wide: Any, value: Any, k: int, bits: int = WIDEST) -> Any:
        """The largest word so far, over 2^bits of its unit."""
        share = self.code.multiply(self.code.absolute(value), self.code.constant(2.0**-bits / self.grid.unit(k)))
        return self.code.larger(share, wide)


def _side(code: Code, y: list[Any], which: Sum) -> list[Any]:
    signs = code.constant(which.sign)
    return [
        code.fma(code.shuffle(word, code.zero, which.second), signs, code.shuffle(word, code.zero, which.first))
        for word in y
    ]
