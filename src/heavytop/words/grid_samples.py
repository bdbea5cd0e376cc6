"""The polynomial of a step on a grid of K words, at times inside the step: the function ``samples``.

Horner's scheme Σ y_n x^n with x = (t − t_0)/h from 0 to 1, for the coefficients y_n h^n that the step has left.  Its
products are those of :func:`heavytop.words.kernels.bounded_product`: x is the smaller factor, and a partial sum may be
:func:`most_of` at most, which is watched.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir

from heavytop.words.grid_series import most_orders, rows_of
from heavytop.words.kernels import Grid, bounded_product, carried
from heavytop.words.vector import INT, POINTER, function

_SUM_BITS = 50


def most_of(grid: Grid) -> float:
    """What a partial sum may be: with words of more than 46 bits its products with x leave their range earlier."""
    return float(2.0 ** min(4, _SUM_BITS - grid.bits))


def sample_row(grid: Grid, vectors: int) -> int:
    """Doubles of a sample: K words of L of each vector, then the largest partial sum of each lane."""
    return 8 * (grid.words * vectors + 1)


def write_samples(module: ir.Module, grid: Grid, vectors: int) -> None:
    """Write ``samples(rows, order, at, first, last, result)``: from the first sample to before the last.

    rows: those of ``series``, and order what it gave.  at: K words of x for each sample, |x| at most 1, word 1 and on
    rounded.  result: a row of :func:`sample_row` for each.
    """
    made, code = function(module, "samples", ir.VoidType(), [POINTER, INT, POINTER, INT, INT, POINTER])
    coefficients, order, at, first, last, result = made.args
    b, words = code.builder, grid.words
    kept = rows_of(grid)(code, grid, vectors, most_orders(grid) + 2, coefficients, None, None, None, [])

    def one(place: Any, _: list[Any]) -> None:
        start = b.mul(place, code.integer(words))
        x = [code.spread(b.load(code.address(at, b.add(start, code.integer(k))))) for k in range(words)]

        def term(k: Any, values: list[Any]) -> list[Any]:
            found, largest = [], values[-1]
            for v in range(vectors):
                product = bounded_product(code, grid, x, values[words * v : words * (v + 1)])
                row = kept.stored(b.sub(order, k), v)
                total = carried(code, grid, [code.add(one, other) for one, other in zip(product, row, strict=True)])
                largest = code.larger(code.absolute(total[0]), largest)
                found += total
            return [*found, largest]

        values = code.loop(0, b.add(order, code.integer(1)), term, [code.zero] * (words * vectors + 1))
        begin = b.mul(place, code.integer(sample_row(grid, vectors)))
        for index, value in enumerate(values):
            code.store(value, result, b.add(begin, code.integer(8 * index)))

    code.loop(first, last, one, [])
    b.ret_void()
