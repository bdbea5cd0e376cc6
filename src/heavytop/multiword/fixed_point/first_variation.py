"""Taylor coefficients of first variations along a step, on its grid of K words, with a proven bound of their error.

Along the polynomial p = Σ b_n τⁿ of a step, with y' = h f(y) and f = Q(y, y) + L y, a column

    v' = h Df(p) v + h G(p),     v(0) = 0 or a unit vector,     G = ∂f/∂θ of a datum θ, or 0,

has the coefficients v_(n+1) = h (Σ_m 2 Q(b_m, v_(n−m)) + L v_n + G_n)/(n + 1).  In the lanes of
:mod:`heavytop.multiword.codegen.recurrence` the products are Σ L(b_m) ∘ R(v_(n−m)) + L(v_m) ∘ R(b_(n−m)): twice those
of the motion, in as many words.  G is of the same form as f, and its products are those of the motion: they are summed
once for all data.  A column ends at the order N of the step, or later where it is not small there: the further b_n
are 0.

*The error of coefficients.*  The proof is that of :mod:`heavytop.multiword.fixed_point.certified_series`, with words of
L and R that bound those of b and of v alike and with T = 2 (n + 1) products in a sum.  Where there is a datum, the
field has twice the sources; the gathered sums of b err by ε(n + 1) more and are multiplied by at most 1, so that 3 (n +
1) products bound both.  Hence, with T = 2 or 3 times n + 1,

    |v_(n+1) − h (…)_n/(n + 1)| ≤ (H (2 ε(T) + ε' + κ) + ½ g)/(n + 1) + ¾ g.

A column need not become smaller from its first orders on, as a motion does: its leading words count as 0 where they
were 0 in several orders one after another.  The grid is one whose units are doubles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import ldexp
from threading import local
from typing import cast

import numpy

from heavytop.multiword.codegen.machine_code import (
    DOUBLE,
    DOUBLES,
    INT,
    INT_POINTER,
    POINTER,
    Doubles,
    Integers,
    Machine,
    Operand,
    compiled,
    doubles,
    function,
    ir,
    once,
    pointer,
)
from heavytop.multiword.codegen.recurrence import Coefficients, permutations
from heavytop.multiword.fixed_point.arithmetic import EXPONENT_BITS, Grid, carried, component
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries, in_ulps
from heavytop.multiword.fixed_point.fixed_point_run import state_of_left, words_of_rows
from heavytop.multiword.fixed_point.products import WordRows
from heavytop.multiword.fixed_point.steps import FIRED, SeriesCode, most_orders, raises_of
from heavytop.top.equations import System

_QUIET = 6
"""Successive orders in which words are 0 before they count as 0: as many as the state has components."""
_LARGEST_LAST = 2.0**10
"""Ulps of a last coefficient beyond which a column is longer than the motion, as near an equilibrium."""
_UP = 1 + 2.0**-40


class _ColumnRows(WordRows):
    """The sums of a column.  starts: also the number of orders in which the first u + 1 words were 0."""

    def begin(self, y: list[Operand], wide: Operand) -> Operand:
        for k in range(self.grid.words):
            self.code.store_one(0, self.starts, self._quiet(k))
        return WordRows.begin(self, y, wide)

    def _quiet(self, k: int) -> int:
        return self.grid.words + 2 + k

    def _leading_zeros(self, y: list[Operand], before: Operand) -> Operand:
        code = self.code
        count, only = code.integer(0), code.true
        for k in range(self.grid.words - 1):
            only &= code.largest(code.absolute(y[k])) == 0
            quiet = code.select(only, code.load_one(self.starts, self._quiet(k)) + 1, 0)
            code.store_one(quiet, self.starts, self._quiet(k))
            count = code.select(quiet >= _QUIET, k + 1, count)
        return code.larger(count, before)


@dataclass(slots=True)
class _ColumnCode(SeriesCode):
    """Writes ``column(state, constants, inverses, rows, sums, starts, seen, factor, raises, result, motion, known,
    order)`` and ``column_of_data(…, order, gathered, slopes)``.

    As ``series``, for a column that starts at ``state``.  motion, known: rows and starts of the motion.  order: N.
    gathered: the result of ``gather``.  slopes: the words of G, in the layout of the constants of f.
    """

    of_data: bool = False
    kernels: Sequence[ir.Function] = ()
    n: Operand = field(init=False)

    def write(self) -> ir.Function:
        """Write the function, which returns the order, or FIRED."""
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, DOUBLE, INT, POINTER, POINTER, INT_POINTER, INT]
        if self.of_data:
            arguments += [POINTER, POINTER]
        name = "column_of_data" if self.of_data else "column"
        made, self.code = function(self.module, name, INT, arguments)
        state, _, _, rows, sums, starts, seen, _, _, result, motion, known, order = self.code.arguments[:13]
        code, b, grid = self.code, self.code.builder, self.grid
        words, room = grid.words, most_orders(grid) + 2
        self.rows = _ColumnRows(code, grid, 1, room, rows, sums, starts, seen, list(self.kernels))
        along = WordRows(code, grid, 1, room, motion, sums, known, seen, list(self.kernels))
        first = [code.load(state, 8 * k) for k in range(words)]
        code.store(code.zero, seen, 0)
        wide = self.rows.begin(first, code.zero)
        values = code.loop(0, order, lambda n, v: self._next(n, v, along), [code.integer(0), wide, *first, *first])
        bits = code.any_bit(code.load(seen, 0).bits()) & EXPONENT_BITS
        small = code.largest(values[1]) < 1
        total = carried(code, grid, carried(code, grid, values[2 + words :]))
        for k, word in enumerate(total):
            code.store(word, result, 8 * k)
        quiet = (bits == 0) & small
        b.ret(code.select(quiet, order, FIRED))
        return made

    def _next(self, n: Operand, values: list[Operand], along: WordRows) -> list[Operand]:
        """Zeros, the largest word, v_(n+1) and the sum up to it."""
        code, words, rows = self.code, self.grid.words, self.rows
        assert isinstance(rows, WordRows)
        zeros, wide, y, total = values[0], values[1], values[2 : 2 + words], values[2 + words :]
        self.n, all_words = n, code.integer(words - 1)
        rows.begin_sums()
        rows.add_products(n, (along, all_words), (rows, zeros), 0)
        rows.add_products(n, (rows, zeros), (along, all_words), 0)
        rates, wide = self._rates(0, rows.end_sums(), y, wide)
        raised, wide = self._raised(rates, wide)
        quotient, wide = self._divided(n, self._times(raised), wide)
        v_next, zeros, wide = rows.keep(n + 1, quotient, zeros, wide)
        return [zeros, wide, *v_next, *(a + c for a, c in zip(total, v_next, strict=True))]

    def sources(
        self, vector: int, gathered: list[Operand], y: list[Operand]
    ) -> list[tuple[list[Operand], list[Operand]]]:
        products = SeriesCode.sources(self, vector, gathered, y)
        if not self.of_data:
            return products
        code, words = self.code, self.grid.words
        at = code.address(code.arguments[13], self.n * (16 * words))
        sums, b_n = ([code.load(at, 8 * (words * half + k)) for k in range(words)] for half in range(2))
        slopes = code.arguments[14]
        for k, (_, source) in enumerate(SeriesCode.sources(self, vector, sums, b_n)):
            products.append(([code.load(slopes, 8 * (words * k + i)) for i in range(words)], source))
        return products

    def write_gather(self) -> None:
        """Write ``gather(rows, starts, sums, seen, order, result)``: the gathered sums of b and b_n, for n < order."""
        arguments = [POINTER, INT_POINTER, POINTER, POINTER, INT, POINTER]
        _, self.code = function(self.module, "gather", ir.VoidType(), arguments)
        code, words = self.code, self.grid.words
        rows, starts, sums, seen, order, result = code.arguments
        along = WordRows(code, self.grid, 1, most_orders(self.grid) + 2, rows, sums, starts, seen, list(self.kernels))
        code.store(code.zero, seen, 0)

        def one(n: Operand, _: list[Operand]) -> None:
            products = along.products(n, code.integer(words - 1), 0)
            b_n = [component(code, word) for word in along.stored(n, 0)]
            at = n * (16 * words)
            for k, word in enumerate([*self._gathered(carried(code, self.grid, products)), *b_n]):
                code.store(word, result, at + 8 * k)

        code.loop(0, order, one, [])
        code.builder.ret_void()


@once
def machine(grid: Grid, system: System, data: bool) -> Machine:
    """``column``, and for data ``gather`` and ``column_of_data``."""
    module = ir.Module("first_variation")
    kernels = WordRows.write_kernels(module, grid, WordRows.size(grid, 1, 1).row, False)
    _ColumnCode(module, grid, system, 1, False, of_data=False, kernels=kernels).write()
    if data:
        code = _ColumnCode(module, grid, system, 1, False, of_data=True, kernels=kernels)
        code.write()
        code.write_gather()
    return compiled(module)


@dataclass(frozen=True, slots=True)
class WordColumns:
    """Φ, and σ of each datum, as polynomials of one order N; whole ulps, a list of components each.

    total: Σ v_n.  values: every v_n, if requested.  sizes: upper bounds of |v_n|, shape (columns, N + 1).
    rounding: bounds of Σ_(n < N) |v_(n+1) − h (…)_n/(n + 1)| in ulps, of any column of Φ and of any of σ.
    """

    total: list[list[int]]
    values: list[list[list[int]]] | None
    sizes: Doubles
    rounding: tuple[float, float]

    def scaled(self, rate: int) -> Doubles:
        """Upper bounds of 2^(rate n) |v_n|."""
        return numpy.ldexp(self.sizes, rate * numpy.arange(self.sizes.shape[1]))

    def ends_small(self, grid: Grid) -> bool:
        """Whether no last coefficient exceeds :data:`_LARGEST_LAST` ulps, which may be subnormal."""
        return bool(self.sizes[:, -1].max() < ldexp(_LARGEST_LAST, -grid.total))


class CertifiedColumns:
    """The columns along one motion on one grid; safe in threads.

    slopes: G of each datum over the lanes of the motion, in its units.
    """

    def __init__(self, certified: CertifiedSeries, slopes: Sequence[Coefficients] = ()) -> None:
        self.certified, self.data = certified, bool(slopes)
        problem, grid = certified.problem, certified.grid
        self.machine = machine(grid, problem.system, self.data)
        rows = [row for slope in slopes for row in slope.vectors[0]]
        words = words_of_rows(rows, grid, Fraction(1, 2**certified.excess)) if rows else doubles(0)
        size = 8 * grid.words * (1 + len(permutations(problem.system)))
        self._words = words
        self._slopes = [pointer(words[size * k : size * (k + 1)]) for k in range(len(slopes))]
        self._threads = local()

    def columns(self, centre: Sequence[int], halvings: int, values: bool = False) -> WordColumns | None:
        """The columns along the step from ``centre`` with h = 2^-halvings; None where they do not exist."""
        certified = self.certified
        order = certified.computed(centre, halvings)
        if order < 0:
            return None
        scratch, rows = self._scratch(), certified.scratch().rows
        widest = scratch.of_motion(certified, order)
        row, most, reached = len(rows) // (most_orders(certified.grid) + 2), most_orders(certified.grid), order
        while True:
            rows[row * (order + 1) : row * (reached + 1)] = 0  # beyond the coefficients of the motion
            columns = self._of_order(scratch, widest, reached, halvings, values)
            if columns is None or reached == most or columns.ends_small(certified.grid):
                return columns
            reached = min(most, reached + reached // 2 + 8)

    def _of_order(self, work: _Scratch, widest: Doubles, order: int, halvings: int, values: bool) -> WordColumns | None:
        """All columns up to one order; widest: the largest words of the motion."""
        certified, words = self.certified, self.certified.grid.words
        factor, raises = raises_of(certified.excess - halvings)
        along, count = certified.scratch().pointers, 6 + len(self._slopes)
        if self.data:
            self.machine.functions["gather"](along[3], along[5], along[4], along[6], order, work.gathered)
        tables = []
        for column in range(count):
            if not self._column(work, column, order, (certified.sign * factor, raises)):
                return None
            certified.extents(work.pointers[3], order, *work.measures[column])
            if values:
                tables.append(work.values(certified, order))
        rounding, scale = [0.0, 0.0], ldexp(1.0, certified.excess - halvings)
        for group, part in enumerate((slice(0, 6), slice(6, count))[: 1 + self.data]):
            wide = numpy.maximum(widest, work.widest[part].max(axis=0))
            bound = certified.bound(wide, work.added[part].max(axis=0), order, scale, 2 + group, 1 + group)
            if bound is None:
                return None
            rounding[group] = bound
        sizes = work.sizes[:count, : order + 1].max(axis=2) * _UP
        ends = work.results[:count].reshape(count, words, 8).transpose(0, 2, 1)[:, :6]
        total = in_ulps(ends, certified.grid).tolist()
        return WordColumns(total, tables if values else None, sizes, (rounding[0], rounding[1]))

    def _scratch(self) -> _Scratch:
        """The scratch of this thread."""
        if not hasattr(self._threads, "scratch"):
            self._threads.scratch = _Scratch(self.certified, len(self._slopes))
        return cast("_Scratch", self._threads.scratch)

    def _column(self, scratch: _Scratch, column: int, order: int, length: tuple[float, int]) -> bool:
        """Compute one column into the rows; returns whether it is valid."""
        along = self.certified.scratch().pointers
        scratch.state[:] = 0
        arguments = [*scratch.pointers, *length, scratch.ends[column], along[3], along[5], order]
        if column < 6:
            scratch.state[column] = 1.0
            return int(self.machine.functions["column"](*arguments)) >= 0
        arguments += [scratch.gathered, self._slopes[column - 6]]
        return int(self.machine.functions["column_of_data"](*arguments)) >= 0


class _Scratch:
    """The arrays of one thread for columns.

    results: Σ v_n of each.  sizes: Σ_k |word k of v_n|, shape (columns, orders, 8).  widest: the largest words of R and
    L, and added Σ_n |word k|, of each column.  ends, measures: their addresses.
    """

    def __init__(self, certified: CertifiedSeries, data: int) -> None:
        grid, orders, count = certified.grid, most_orders(certified.grid) + 2, 6 + data
        room = WordRows.size(grid, 1, orders)
        self.state, self.rows = doubles(8 * grid.words), doubles(room.rows)
        gathered, starts = doubles(16 * grid.words * orders), numpy.zeros(room.starts + grid.words, numpy.int64)
        inputs, sums = [self.state, certified.constants, certified.inverses, self.rows], doubles(room.sums)
        arrays_used: list[Doubles | Integers] = [*inputs, sums, starts, doubles(8)]
        self.pointers, self.gathered = [pointer(array) for array in arrays_used], pointer(gathered)
        nearest = doubles(8 * orders)
        self._kept = [*arrays_used, gathered, nearest]
        self.results: Doubles = doubles(8 * grid.words * count).reshape(count, -1)
        self.sizes: Doubles = doubles(8 * orders * count).reshape(count, orders, 8)
        self.widest: Doubles = doubles(16 * grid.words * count).reshape(count, 2, grid.words, 8)
        self.added: Doubles = doubles(8 * grid.words * count).reshape(count, grid.words, 8)
        self.ends = [self.results[k].ctypes.data_as(DOUBLES) for k in range(count)]
        arrays, near, behind = (self.widest, self.added), pointer(nearest), pointer(doubles(0))
        self.measures = [
            [near, pointer(self.sizes[k]), behind, *(pointer(array[k]) for array in arrays)] for k in range(count)
        ]

    def of_motion(self, certified: CertifiedSeries, order: int) -> Doubles:
        """The largest words of R and L of the motion."""
        certified.extents(certified.scratch().pointers[3], order, *self.measures[0])
        sizes: Doubles = self.widest[0].copy()
        return sizes

    def values(self, certified: CertifiedSeries, order: int) -> list[list[int]]:
        """Every v_n of each component."""
        grid = certified.grid
        left = self.rows[: 16 * grid.words * (order + 1)].reshape(order + 1, 2, grid.words, 8)[:, 1]
        return [in_ulps(part, grid).tolist() for part in state_of_left([numpy.moveaxis(left, -1, 0)])]
