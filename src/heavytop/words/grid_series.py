"""One Taylor step on a grid of K words: the function ``series``.

Coefficients carry h^n, so that the step is a sum.  What has become 0 in all lanes is skipped, which is most of the
speed: :mod:`heavytop.words.word_rows` and :mod:`heavytop.words.digit_rows` keep coefficients and sum their products.
The series ends where two coefficients in a row are below :attr:`heavytop.words.kernels.Grid.smallest`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from llvmlite import ir

from heavytop.top.equations import System
from heavytop.words.digit_rows import DigitRows
from heavytop.words.kernels import EXPONENT_BITS, WIDEST, Accumulator, Grid, bounded_product, carried, centred
from heavytop.words.lanes import GATHERED, beside, turned
from heavytop.words.rows import Rows, Size
from heavytop.words.vector import DOUBLE, INT, INT_POINTER, INT_VECTOR, POINTER, VECTOR, Code, function
from heavytop.words.word_rows import WordRows

FIRED, UNSETTLED = -1, -2
"""What ``series`` gives in place of its number of orders: a sum left its range; no convergence."""
_WIDEST_DIVIDEND = 53
"""Bits of a word that is divided, behind the first."""
_NONE = 8
"""A lane of the second operand of a shuffle, which is 0."""
_HALVES = (0, 1, 2, *[_NONE] * 5), (3, 4, 5, *[_NONE] * 5)
_FEWEST_WORDS = 8
"""With so many words, products are summed in digits: with seven and fewer that is slower (measured)."""


def rows_of(grid: Grid) -> type[Rows]:
    """How products are summed on this grid."""
    return DigitRows if grid.bounded and grid.words >= _FEWEST_WORDS else WordRows


def size_of(grid: Grid, vectors: int) -> Size:
    """The scratch of a step."""
    return rows_of(grid).size(grid, vectors, most_orders(grid) + 2)


def most_orders(grid: Grid) -> int:
    """Orders after which a step is given up."""
    return int(0.64 * grid.total) + 14


@dataclass(slots=True)
class Series:
    """Writes ``series(state, constants, inverses, rows, sums, places, seen, factor, raises, result)``.

    state, result: K words of each vector.  constants: K words of A and each B (or of those of
    :attr:`heavytop.words.lanes.Coefficients.beside`, where the grid is bounded), for each vector.  inverses: 1/(n + 1).
    rows, sums, places, seen: scratch, see :class:`heavytop.words.rows.Rows`.  factor, raises: from one order to the
    next coefficients are multiplied by factor 16^raises; factor is ± a power of two, at most 1.
    wide: as :attr:`heavytop.words.machine.Processor.wide`; results are the same.
    """

    module: ir.Module
    grid: Grid
    system: System
    vectors: int
    wide: bool
    made: Any = field(init=False)
    code: Code = field(init=False)
    rows: Rows = field(init=False)

    def write(self) -> Any:
        """The function."""
        kind = rows_of(self.grid)
        room = most_orders(self.grid) + 2
        row = kind.size(self.grid, self.vectors, 1).row
        kernels = kind.write_kernels(self.module, self.grid, row, self.wide)
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, DOUBLE, INT, POINTER]
        self.made, self.code = function(self.module, "series", INT, arguments)
        state, _, _, rows, sums, places, seen, _, _, result = self.made.args
        code, b = self.code, self.code.builder
        words = self.grid.words
        y = [code.load(state, 8 * k) for k in range(words * self.vectors)]
        self.rows = kind(code, self.grid, self.vectors, room, rows, sums, places, seen, kernels)
        code.store(code.zero, seen, 0)
        orders, small, wide, total = self._orders(y)
        bits = b.and_(code.any_bit(b.bitcast(code.load(seen, 0), INT_VECTOR)), code.integer(EXPONENT_BITS))
        in_range = b.icmp_signed("==", bits, code.integer(0))
        quiet = b.and_(in_range, b.fcmp_ordered("<", code.largest(wide), ir.Constant(DOUBLE, 1.0)))
        settled = b.icmp_signed(">=", small, code.integer(2))
        for v in range(self.vectors):
            one = total[words * v : words * (v + 1)]
            one = carried(code, self.grid, carried(code, self.grid, one))
            for k, word in enumerate(one):
                code.store(word, result, 8 * (words * v + k))
        found = b.select(settled, orders, code.integer(UNSETTLED))
        b.ret(b.select(quiet, found, code.integer(FIRED)))
        return self.made

    def _orders(self, first: list[Any]) -> tuple[Any, Any, Any, list[Any]]:
        """The loop over orders: their number, how many were small at the end, the largest word, the sum."""
        code, b = self.code, self.code.builder
        wide_before = self.rows.begin(first, code.zero)
        entry = b.block
        head, body, out = (b.append_basic_block(name) for name in ("orders", "order", "summed"))
        b.branch(head)
        b.position_at_end(head)
        n, zeros, small = (b.phi(INT) for _ in range(3))
        wide = b.phi(VECTOR)
        y, total = ([b.phi(VECTOR) for _ in first] for _ in range(2))
        floating = range(self.grid.words - 1, len(first), self.grid.words) if not self.grid.whole else ()
        rest = {k: b.phi(VECTOR) for k in floating}
        carriers = [n, zeros, small, wide, *y, *total, *rest.values()]
        begin = [code.integer(0)] * 3 + [wide_before, *first, *first, *(code.zero for _ in rest)]
        for phi, value in zip(carriers, begin, strict=True):
            phi.add_incoming(value, entry)
        more = b.icmp_signed("<", n, code.integer(most_orders(self.grid)))
        b.cbranch(b.and_(more, b.icmp_signed("<", small, code.integer(2))), body, out)
        b.position_at_end(body)
        after = b.add(n, code.integer(1))
        found, wide_after = self._order(n, zeros, wide, y)
        following, zeros_after, wide_after = self.rows.keep(after, found, zeros, wide_after)
        size = self.rows.largest_sum(following)
        limit = ir.Constant(DOUBLE, self.grid.smallest)
        counted = b.add(small, code.integer(1))
        small_after = b.select(b.fcmp_ordered("<=", size, limit), counted, code.integer(0))
        sums = [code.add(a, c) for a, c in zip(total, following, strict=True)]
        lost = []
        for k, before in rest.items():
            sums[k], error = code.two_sum(total[k], following[k])
            lost.append(code.add(before, error))
        values = [after, zeros_after, small_after, wide_after, *following, *sums, *lost]
        for phi, value in zip(carriers, values, strict=True):
            phi.add_incoming(value, b.block)
        b.branch(head)
        b.position_at_end(out)
        return n, small, wide, [code.add(word, rest[k]) if k in rest else word for k, word in enumerate(total)]

    def _order(self, n: Any, zeros: Any, wide: Any, y: list[Any]) -> tuple[list[Any], Any]:
        """y_(n+1) and the largest word over its limit."""
        words = self.grid.words
        found: list[Any] = []
        for v in range(self.vectors):
            products = self.rows.products(n, zeros, v)
            rates, wide = self._rates(v, products, y[words * v : words * (v + 1)], wide)
            raised, wide = self._raised(rates, wide)
            quotient, wide = self._divided(n, self._times(raised), wide)
            found += quotient
        return found, wide

    def _rates(self, vector: int, sums: list[Any], y: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """A ∘ gathered S + Σ B ∘ permuted y, and the largest word."""
        grid, gathered = self.grid, self._gathered(carried(self.code, self.grid, sums))
        wide = self.rows.watch(wide, gathered[0], 0, grid.most_bits(0))
        total = self._bounded_rates(vector, gathered, y) if grid.bounded else self._watched_rates(vector, gathered, y)
        return carried(self.code, grid, total), wide

    def _constants(self, row: int) -> list[Any]:
        """The words of a row of the constants."""
        words = self.grid.words
        return [self.code.load(self.made.args[1], 8 * (words * row + i)) for i in range(words)]

    def _bounded_rates(self, vector: int, gathered: list[Any], y: list[Any]) -> list[Any]:
        code, grid, (permutations, second) = self.code, self.grid, beside(self.system)
        place = (1 + len(permutations)) * vector
        found = bounded_product(code, grid, self._constants(place), gathered)
        if vector and second:
            return found  # neither weight nor rotor turns an attitude
        for k, lanes in enumerate(permutations, 1):
            moved = [code.shuffle(word, code.zero, lanes) for word in y]
            linear = bounded_product(code, grid, self._constants(place + k), moved)
            if second:
                parts = [[code.shuffle(word, code.zero, half) for half in _HALVES] for word in linear]
                linear = [code.add(one, other) for one, other in parts]
            if k > 1:  # sums of more products than two beside the first would outgrow their words
                found = carried(code, grid, found)
            found = [code.add(a, b) for a, b in zip(found, linear, strict=True)]
        return found

    def _watched_rates(self, vector: int, gathered: list[Any], y: list[Any]) -> list[Any]:
        code, b, grid, seen, linear = self.code, self.code.builder, self.grid, self.made.args[6], turned(self.system)
        sources = [gathered, *([code.shuffle(word, code.zero, lanes) for word in y] for lanes in linear)]
        gathered_bits = b.bitcast(code.load(seen, 0), INT_VECTOR)
        result = Accumulator(code, grid, 0, centred(code, grid, grid.words), gathered_bits)
        for k, source in enumerate(sources):
            factors = self._constants((1 + len(linear)) * vector + k)
            result.add_product(factors, source, each=True, below=not grid.whole)
        result.look_at_all()
        code.store(b.bitcast(result.seen, VECTOR), seen, 0)
        return [code.subtract(s, c) for s, c in zip(result.sums, centred(code, grid, grid.words), strict=True)]

    def _gathered(self, total: list[Any]) -> list[Any]:
        code, zero = self.code, self.code.zero
        found = []
        for word in total:
            parts = [
                code.shuffle(word, zero, [*(lane if sign else _NONE for lane, sign in column), _NONE, _NONE])
                for column in GATHERED
            ]
            third, fourth = (code.constant([*(sign for _, sign in column), 0, 0]) for column in GATHERED[2:])
            others = code.fma(parts[3], fourth, code.multiply(parts[2], third))
            found.append(code.add(code.add(parts[0], parts[1]), others))
        return found

    def _raised(self, words: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """Multiplied by 16 as often as is asked; seldom at all."""
        code, sixteen = self.code, self.code.constant(16.0)

        def once(_: Any, values: list[Any]) -> list[Any]:
            products = [code.multiply(word, sixteen) for word in values[:-1]]
            widest = values[-1]
            for k, word in enumerate(products):
                widest = self.rows.watch(widest, word, k)
            return [*carried(code, self.grid, products), widest]

        values = code.loop(0, self.made.args[8], once, [*words, wide])
        return values[:-1], values[-1]

    def _times(self, words: list[Any]) -> list[Any]:
        """Each word times the factor, rounded to its grid; what is left goes to the next, exactly."""
        code, found, left = self.code, [], None
        factor = code.spread(self.made.args[7])
        for k, word in enumerate(words):
            big = code.constant(self.grid.centre(k))
            high = code.subtract(code.fma(word, factor, big), big)
            low = code.fma(word, factor, code.negative(high))
            found.append(high if left is None else code.add(high, left))
            left = low
        return found

    def _divided(self, n: Any, words: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """Divided by n + 1, digit by digit: each remainder is exact and goes to the next word."""
        code, b = self.code, self.code.builder
        after = b.sitofp(b.add(n, code.integer(1)), DOUBLE)
        divisor, inverse = code.spread(after), code.spread(b.load(code.address(self.made.args[2], n)))
        found, rest = [], None
        for k, word in enumerate(words):
            value = word if rest is None else code.add(word, rest)
            wide = self.rows.watch(wide, value, k, _WIDEST_DIVIDEND if k else WIDEST)
            big = code.constant(self.grid.centre(k))
            quotient = code.subtract(code.fma(value, inverse, big), big)
            rest = code.fma(code.negative(quotient), divisor, value)
            found.append(quotient)
        if not self.grid.whole:
            found[-1] = code.fma(rest, inverse, found[-1])
        return found, wide
