"""Taylor coefficients of a step on a grid of K words, with a proven bound of their error.

g_k = 2^(−b(k + 1)) is the unit of word k, g = g_(K−1) the last.  The code of
:mod:`heavytop.multiword.fixed_point.steps` gives b_0, …, b_N, whole multiples of g that stand for y_n h^n.  Let f_n be
the coefficient of τ^n in f(Σ b_n τ^n), exactly.

*Theorem.*  Where no exponent bit was set, no word was too wide and (1) holds,

    |b_(n+1) − h f_n/(n + 1)| ≤ (H (2 ε_n + ε' + κ) + ½ g)/(n + 1) + ¾ g,   H = h 2^e,                            (2)

where the coefficients of the field are stored over 2^e.  ε_n, ε', κ are given below; with T = n + 1 terms ε_n is of the
order T K ulp.  The sum of (2) over n < N bounds the integral of the defect over the step: :attr:`Series.rounding`.

*Sums of products.*  Let l_i and r_j bound the words L_i and R_j of all orders in a lane, and m_ij = l_i r_j.  A sum for
level k begins at C_k and adds, product by product, x → s = fl(x + a b), d = fl(s − x), l = fl(a b − d); then lows.
Suppose, for all k < K − 1,

    Σ_(i+j=k) m_ij + 3 max_(i+j=k) m_ij ≤ 2^52 (1 − 2^-20) g_k.                                                  (1)

Between two checks of a sum the products of one level of one term are added to it, and one more at most, where its level
is the first of the next kernel.  It was in [2^52, 2^53) g_k when it was checked, so x ≥ 2 |a b| by (1); hence
x/2 ≤ s ≤ 2 x and d is exact (Sterbenz).  a b is a multiple of g_i g_j = g_(k+1), and so is l, the rounding of x + a b,
with |l| ≤ g_k = 2^b g_(k+1).  So l is exact, and so is the sum of K of them.  Lows are added between two checks: the
sum is a multiple of g_(k+1) before and at most 2^53 g_(k+1) after, so it is exact.  Only the last level is inexact and
not checked; the terms of a product are summed before they are added to it.  With T terms its sum stays below

    B = 1.5 2^52 g + T (Σ_(i+j=K−1) m_ij + K 2^b g);

each of its T (K + 1) roundings is at most 2^-53 B, and so is that of taking C away, and T products with i + j ≥ K are
left out.  So the error is at most ε(T) = T ((K + 1) 2^-53 B + Σ_(i+j≥K) m_ij) + 2^-53 B, and ε_n = ε(n + 1).

*The coefficients of the field.*  Each sum is checked after each product.  Two numbers of [2^52, 2^53) g_k differ by a
multiple of g_k below 2^52 g_k, so d is exact without (1).  ε' is ε(T) for T sources.  The coefficients are at most 1,
rounded to nearest: l_0 = 2^b g_0, l_k = 2^(b−1) g_k.  The sources are y, with words that are checked afterwards, and
the gathered sums, whose first word is below 2^51 g_0 (it is watched) and whose others are, after their carries, at most
4 (2^(b−1) + 1 + 2^-b B/g) g_k, where B ≤ 2^(b+c) g, c = 16, or 18 on a relative grid.  Up to four sums are gathered in
a lane, and there A = ½: hence 2 ε_n.  The coefficients are wrong by g/2 at most, the sources below
2^51 g_0 (1 + 2^(1−b)): κ = 1.01 T 2^(50−b) g.

*Other operations.*  Carries, gathering and multiplication by 16 are exact for words below 2^51 units, which is watched
for the first.  Multiplication by the remaining power of two adds the part below a unit to the next word, exactly
where that power is 2^-b at least, and drops g/2 at most in the last.  The division passes on the exact remainder: a
quotient is right to ½ unit and 2^-53 of itself, that is ¾ of a unit, and the last remainder is dropped.  Dividends
behind the first word are below 2^53 units (watched), so that from n = 3 on their quotients are below 2^51; before that
they are at most (1.01 + (n + 1)/2 + ¼) 2^b units.  Words that count as 0 are added to the next, exactly for sums below
2^51 units. The sum of all b_n is exact where Σ |word k of b_n| ≤ 2^52 g_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ldexp, log
from threading import local
from typing import Any, cast

import numpy
from numpy.typing import NDArray

from heavytop.multiword.codegen.machine_code import Doubles, Integers, Processor, doubles, pointer
from heavytop.multiword.codegen.recurrence import permutations
from heavytop.multiword.fixed_point import arithmetic, fixed_point_run
from heavytop.multiword.fixed_point.arithmetic import Grid, words_of
from heavytop.multiword.fixed_point.steps import UNSETTLED, most_orders, raises_of, size_of
from heavytop.multiword.problem import Scaled

_UP = 1 + 2.0**-40
_ROOM = 1 - 2.0**-20
_BEHIND_ALONE = 2.0**-880
"""The bound of numbers without words before those."""
_UNDERFLOW = 2.0**-1000
"""An upper bound of the underflow of sizes."""


class Total(Sequence[int]):
    """Σ b_n of each component, whole ulps, stored as words, from which the next step starts."""

    def __init__(self, words: Doubles, certified: CertifiedSeries) -> None:
        self.words, self.certified = words, certified

    @cached_property
    def _values(self) -> list[int]:
        grid, indices = self.certified.grid, self.certified.offsets
        return list(in_ulps(self.words[indices], grid))

    def __len__(self) -> int:
        return len(self.certified.offsets)

    def __getitem__(self, index: Any) -> Any:
        return self._values[index]


@dataclass(frozen=True)
class WordSeries:
    """b_0, …, b_N of six or nine components, in words: those of ``certified`` from ``centre`` with h = 2^-halvings.

    total: Σ b_n.  rounding: Σ_(n < N) of (2) in ulps, which bounds the integral of the defect of all orders below N.
    sizes: upper bounds of |b_n|, shape (N + 1,).  behind: of a relative grid, of what lies behind its first words
    (:data:`heavytop.multiword.fixed_point.arithmetic.FIRST_BEHIND`), over the unit of the first of these.
    nearest: b_n within 2^-50 of ``sizes``, shape (N + 1, components).
    """

    certified: CertifiedSeries
    centre: Sequence[int]
    halvings: int
    total: Total
    rounding: float
    sizes: Doubles
    behind: Doubles | None
    nearest: Doubles

    @property
    def thrifty(self) -> tuple[float, float]:
        """Orders per bit between which a unit of time costs least: a step costs more than its products."""
        return 0.4, 0.58

    @property
    def order(self) -> int:
        """N."""
        return len(self.sizes) - 1

    @cached_property
    def values(self) -> list[list[int]]:
        """The coefficients of each component, whole ulps; recomputed, as few steps need them."""
        return self.certified.coefficients(self.centre, self.halvings)

    def scaled(self, rate: int) -> Doubles:
        """Upper bounds of 2^(rate n) |b_n|, shape (N + 1,)."""
        exponents = rate * numpy.arange(len(self.sizes))
        sizes: Doubles = numpy.ldexp(self.sizes, exponents)
        if self.behind is not None:
            grid = self.certified.grid
            far = numpy.ldexp(self.behind, exponents - grid.bits * (arithmetic.FIRST_BEHIND + 1))
            sizes = numpy.where(self.sizes < _BEHIND_ALONE, far, sizes)
        return sizes

    def rounded(self, orders: int) -> Doubles:
        """b_0 to b_orders of ``nearest``, or to its last."""
        return self.nearest[: orders + 1]


class CertifiedSeries:
    """Taylor coefficients of one motion on one grid; safe in threads.

    problem: so that |ω| ≤ 4 (:meth:`heavytop.multiword.problem.Scaled.of` with ``bounded``).
    """

    def __init__(self, problem: Scaled, grid: Grid, forwards: bool, processor: Processor | None = None) -> None:
        self.vectors = 1 if len(problem.state) == 6 else 2
        self.machine = fixed_point_run.machine(grid, problem.system, self.vectors == 2, processor, False)
        self.extents = arithmetic.machine(grid, self.vectors).functions["extents"]
        self.problem, self.grid, self.sign = problem, grid, 1.0 if forwards else -1.0
        self.excess = fixed_point_run.excess(problem)
        self.constants, self.inverses = (
            fixed_point_run.constants(problem, grid, self.excess),
            fixed_point_run.inverses(grid),
        )
        self._own = (problem, grid, forwards, processor)
        self._sources = 1 + len(permutations(problem.system))
        self._of_constants = [self._error_of_constants(count * self._sources) for count in (1, 2)]
        self._units = numpy.array([grid.unit(k) for k in range(grid.words)])[:, None]
        self._threads = local()
        self._columns = [*range(6), *range(11, 14)][: 3 + 3 * self.vectors]
        first = numpy.array([lane % 8 + 8 * grid.words * (lane // 8) for lane in self._columns])
        self.offsets = first[:, None] + 8 * numpy.arange(grid.words)

    def __reduce__(self) -> tuple[Any, ...]:
        return (CertifiedSeries, self._own)

    def series(self, centre: Sequence[int], halvings: int) -> WordSeries | None:
        """The series from ``centre``, ulps 2^-(K b), h = 2^-halvings; None where that is too long or words overflow."""
        orders = self.computed(centre, halvings)
        if orders < 0:
            return None
        scratch, length = self.scratch(), orders + 1
        self.extents(scratch.pointers[3], orders, *scratch.measures)
        rounding = self.bound(scratch.widest, scratch.added, orders, ldexp(1.0, self.excess - halvings))
        if rounding is None:
            return None
        size = 8 * self.vectors
        sizes = _largest(scratch.sizes, length, size)
        behind = None
        if self.grid.relative:
            sizes, behind = sizes + _UNDERFLOW, _largest(scratch.behind, length, size)
        nearest = scratch.values[: length * size].reshape(length, size)[:, self._columns]
        return WordSeries(self, centre, halvings, Total(scratch.result.copy(), self), rounding, sizes, behind, nearest)

    def coefficients(self, centre: Sequence[int], halvings: int) -> list[list[int]]:
        """b_0 to b_N of each component, whole ulps, where :meth:`series` exists."""
        length, grid = self.computed(centre, halvings) + 1, self.grid
        table = (
            self.scratch()
            .rows[: size_of(grid, self.vectors).row * length]
            .reshape(length, 1 + self.vectors, grid.words, 8)
        )
        lanes = [*numpy.moveaxis(table[:, 1:], (1, 3), (0, 1))]
        return [in_ulps(component, grid).tolist() for component in fixed_point_run.state_of_left(lanes)]

    def computed(self, centre: Sequence[int], halvings: int) -> int:
        """N, with the coefficients in the rows of this thread's scratch; negative where the series does not exist."""
        exponent = self.excess - halvings
        if not -self.grid.bits <= exponent < 64:
            return UNSETTLED
        factor, raises = raises_of(exponent)
        scratch = self.scratch()
        if isinstance(centre, Total):
            scratch.state[:] = centre.words
        else:
            scratch.state[self.offsets] = [words_of(value, self.grid) for value in centre]
        status = self.machine.functions["series"](*scratch.pointers, self.sign * factor, raises, scratch.found)
        return int(status)

    def scratch(self) -> _Scratch:
        """The scratch of this thread."""
        if not hasattr(self._threads, "scratch"):
            self._threads.scratch = _Scratch(self)
        return cast("_Scratch", self._threads.scratch)

    def bound(
        self, widest: Doubles, added: Doubles, orders: int, scale: float, products: int = 1, fields: int = 1
    ) -> float | None:
        """The sum of (2) over n < N in ulps, with H = ``scale``; None where an assumption does not hold.

        widest: max_n |word k|, shape (1 + vectors, K, 8), of R and each L.  added: Σ_n |word k of y|, shape
        (vectors, K, 8).  products: of an order, times n + 1.  fields: how often the sources are those of the field.
        """
        grid = self.grid
        wide = widest / self._units
        left, right = numpy.maximum.reduce(wide[1:]), wide[0]
        largest_products, levels = _levels(grid, right, left)
        sums = levels[: grid.words - 1] + 3 * largest_products[: grid.words - 1]
        # γ1 and γ3 are differences of L's
        state = (1.5 * numpy.maximum.reduce(left, 1)).tolist()
        term, once = _error(grid, levels, products * orders)
        limits = (
            (float(sums.max()), 2.0**52 * _ROOM),
            (float((added / self._units).max()), 2.0**52),
            (state[0], 2.0**51),
            (max(state[1:]), 2.0 ** (grid.bits + 2)),
            (once, 2.0 ** (grid.bits + _carried_bits(grid) - 53)),
        )
        if not all(size <= limit for size, limit in limits):
            return None
        harmonic = 1 + log(max(1, orders))
        alone = (2 * once + self._of_constants[fields - 1]) * harmonic
        return (scale * (2 * term * products * orders + alone) + harmonic / 2 + 0.75 * orders) * _UP

    def _error_of_constants(self, count: int) -> float:
        """ε' + κ in ulps, of ``count`` sources."""
        grid = self.grid
        constants = numpy.full((grid.words, 1), 2.0 ** (grid.bits - 1))
        constants[0] = 2.0**grid.bits
        sources = numpy.full((grid.words, 1), 4 * (2.0 ** (grid.bits - 1) + 1 + 2.0 ** _carried_bits(grid)))
        sources[0] = 2.0**51
        error, once = _error(grid, _levels(grid, constants, sources)[1], count)
        return count * (error + 2.0 ** (50 - grid.bits) * 1.01) + once


def _largest(sizes: Doubles, length: int, size: int) -> Doubles:
    """An upper bound of the sizes of each order."""
    return numpy.asarray(numpy.maximum.reduce(sizes[: length * size].reshape(length, size), 1) * _UP)


class _Scratch:
    """The arrays of one thread."""

    def __init__(self, certified: CertifiedSeries) -> None:
        words, vectors = certified.grid.words, certified.vectors
        size, orders = 8 * words * vectors, most_orders(certified.grid) + 2
        room = size_of(certified.grid, vectors)
        self.state, self.result, self.rows = doubles(size), doubles(size), doubles(room.rows)
        inputs = [self.state, certified.constants, certified.inverses, self.rows]
        starts = numpy.zeros(room.starts, numpy.int64)
        self._kept: list[Doubles | Integers] = [*inputs, doubles(room.sums), starts, doubles(8)]
        self.pointers, self.found = [pointer(array) for array in self._kept], pointer(self.result)
        self.values, self.sizes = doubles(8 * vectors * orders), doubles(8 * vectors * orders)
        widest, added = doubles(8 * words * (1 + vectors)), doubles(size)
        self.behind = doubles(8 * vectors * orders if certified.grid.relative else 0)
        self.measures = [pointer(array) for array in (self.values, self.sizes, self.behind, widest, added)]
        self.widest, self.added = widest.reshape(-1, words, 8), added.reshape(-1, words, 8)


def _carried_bits(grid: Grid) -> int:
    """c: log2 of the largest carry of the last word."""
    return 18 if grid.relative else 16


def _levels(grid: Grid, left: Doubles, right: Doubles) -> tuple[Doubles, Doubles]:
    """The largest product of level k and the sum of all, over g_k, for k = 0 to 2K − 2; from words over their units."""
    products = numpy.maximum.reduce(left[:, None, :] * right, 2).ravel() * 2.0**-grid.bits
    table = _antidiagonals(grid.words)
    return numpy.maximum.reduce(table * products, 1), table @ products * _UP


@lru_cache(maxsize=32)
def _antidiagonals(words: int) -> NDArray[numpy.float64]:
    i, j = numpy.divmod(numpy.arange(words * words), words)
    return numpy.asarray((i + j == numpy.arange(2 * words - 1)[:, None]).astype(float))


@lru_cache(maxsize=32)
def _ulps(grid: Grid) -> Doubles:
    """g_K, …, g_(2K−2), which are below the last word, over g."""
    return numpy.asarray(2.0 ** (-grid.bits * numpy.arange(1.0, grid.words)))


def _error(grid: Grid, products: Doubles, terms: int) -> tuple[float, float]:
    """ε(T) as (a, c) with a T + c for T ≤ ``terms``, in ulps."""
    words = grid.words
    largest = 1.5 * 2.0**52 + terms * (float(products[words - 1]) + words * 2.0**grid.bits)
    dropped = float(products[words:] @ _ulps(grid)) * _UP
    rounding = 2.0**-53 * largest * _UP
    return (words + 1) * rounding + dropped, rounding


def in_ulps(words: Doubles, grid: Grid) -> Any:
    """The sums of words along the last axis, in ulps: an array of integers."""
    units = [grid.unit(k) for k in range(grid.words)]
    digits = (words / units).astype(numpy.int64).astype(object)
    total = digits[..., 0]
    for k in range(1, grid.words):
        total = (total << grid.bits) + digits[..., k]
    return total
