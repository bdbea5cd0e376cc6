"""One Taylor step on a grid of K words: the function ``series``.

Coefficients include h^n, so that the step is a sum.  Words that have become 0 in all lanes are skipped, saving most
of the time: :mod:`heavytop.multiword.fixed_point.products` stores coefficients and sums their products.  The series
ends where two successive coefficients are below
:attr:`heavytop.multiword.fixed_point.arithmetic.Grid.smallest`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial, reduce
from typing import Any

from heavytop.multiword.codegen.machine_code import (
    DOUBLE,
    INT,
    INT_POINTER,
    POINTER,
    Code,
    Following,
    Machine,
    Operand,
    Processor,
    Stepping,
    compiled,
    function,
    ir,
)
from heavytop.multiword.codegen.recurrence import GATHERED, paired_permutations, permutations
from heavytop.multiword.fixed_point.arithmetic import (
    EXPONENT_BITS,
    WIDEST,
    Accumulator,
    Grid,
    bounded_product,
    carried,
    centred,
    passed_on,
    summed,
)
from heavytop.multiword.fixed_point.products import DigitRows, ProductSize, Rows, WordRows
from heavytop.top.equations import System

FIRED, UNSETTLED = -1, -2
"""Results of ``series`` other than its number of orders: a sum left its range; no convergence."""
_WIDEST_DIVIDEND = 53
"""Bits of a divided word after the first."""
_NONE = 8
"""A lane of the second operand of a shuffle, which is 0."""
_HALVES = (0, 1, 2, *[_NONE] * 5), (3, 4, 5, *[_NONE] * 5)
_FEWEST_WORDS = 8
"""From so many words on products are summed in digits; with seven and fewer that is slower (measured)."""


def rows_of(grid: Grid) -> type[Rows]:
    """The implementation of sums of products on this grid."""
    return DigitRows if grid.bounded and grid.words >= _FEWEST_WORDS else WordRows


def size_of(grid: Grid, vectors: int) -> ProductSize:
    """The scratch of a step."""
    return rows_of(grid).size(grid, vectors, most_orders(grid) + 2)


def most_orders(grid: Grid) -> int:
    """Orders after which a step is abandoned."""
    return int(0.64 * grid.total) + 14


@dataclass(slots=True)
class SeriesCode:
    """Writes ``series(state, constants, inverses, rows, sums, starts, seen, factor, raises, result)``.

    state, result: K words of each vector.  constants: K words of A and each B (or of those of
    :attr:`heavytop.multiword.codegen.recurrence.Coefficients.paired`, where the grid is bounded), for each vector.
    inverses: 1/(n + 1).
    rows, sums, starts, seen: scratch, see :class:`heavytop.multiword.fixed_point.products.Rows`.
    factor, raises: from one order to the next coefficients are multiplied by factor 16^raises; factor is ± a power of
    two, at most 1.
    wide: as :attr:`heavytop.multiword.codegen.machine_code.Processor.wide`; results are the same.
    """

    module: ir.Module
    grid: Grid
    system: System
    vectors: int
    wide: bool
    code: Code = field(init=False)
    rows: Rows = field(init=False)

    def write(self) -> ir.Function:
        """The function."""
        kind = rows_of(self.grid)
        room = most_orders(self.grid) + 2
        row = kind.size(self.grid, self.vectors, 1).row
        kernels = kind.write_kernels(self.module, self.grid, row, self.wide)
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, DOUBLE, INT, POINTER]
        made, self.code = function(self.module, "series", INT, arguments)
        state, _, _, rows, sums, starts, seen, _, _, result = self.code.arguments
        code, b = self.code, self.code.builder
        words = self.grid.words
        y = [code.load(state, 8 * k) for k in range(words * self.vectors)]
        self.rows = kind(code, self.grid, self.vectors, room, rows, sums, starts, seen, kernels)
        code.store(code.zero, seen, 0)
        orders, small, wide, total = self._orders(y)
        bits = code.any_bit(code.load(seen, 0).bits()) & EXPONENT_BITS
        quiet = (bits == 0) & (code.largest(wide) < 1)
        settled = small >= 2
        for v in range(self.vectors):
            vector_sum = total[words * v : words * (v + 1)]
            vector_sum = carried(code, self.grid, carried(code, self.grid, vector_sum))
            for k, word in enumerate(vector_sum):
                code.store(word, result, 8 * (words * v + k))
        count = code.select(settled, orders, UNSETTLED)
        b.ret(code.select(quiet, count, FIRED))
        return made

    def _orders(self, first: list[Operand]) -> tuple[Operand, Operand, Operand, list[Operand]]:
        """The loop over orders: their number, how many were small at the end, the largest word, the sum."""
        code, count = self.code, len(first)
        floating = range(self.grid.words - 1, count, self.grid.words) if not self.grid.whole else ()
        begin = [code.integer(0)] * 3 + [
            self.rows.begin(first, code.zero),
            *first,
            *first,
            *(code.zero for _ in floating),
        ]

        def wanted(n: Operand, zeros: Operand, small: Operand, *_: Operand) -> Operand:
            return (n < most_orders(self.grid)) & (small < 2)

        def body(n: Operand, zeros: Operand, small: Operand, wide: Operand, *vectors: Operand) -> list[Operand]:
            y, total, rounding_errors = list(vectors[:count]), vectors[count : 2 * count], vectors[2 * count :]
            after = n + 1
            status, wide = self._order(n, zeros, wide, y)
            y_next, zeros, wide = self.rows.keep(after, status, zeros, wide)
            size = self.rows.largest_sum(y_next)
            small = code.select(size <= self.grid.smallest, small + 1, 0)
            sums = [a + c for a, c in zip(total, y_next, strict=True)]
            errors = []
            for k, before in zip(floating, rounding_errors, strict=True):
                sums[k], error = code.two_sum(total[k], y_next[k])
                errors.append(before + error)
            return [after, zeros, small, wide, *y_next, *sums, *errors]

        n, _, small, wide, *vectors = code.as_long_as(wanted, body, begin)
        total = vectors[count : 2 * count]
        for k, error in zip(floating, vectors[2 * count :], strict=True):
            total[k] = total[k] + error
        return n, small, wide, total

    def _order(self, n: Operand, zeros: Operand, wide: Operand, y: list[Operand]) -> tuple[list[Operand], Operand]:
        """y_(n+1) and the largest word over its limit."""
        words = self.grid.words
        order: list[Operand] = []
        for v in range(self.vectors):
            products = self.rows.products(n, zeros, v)
            rates, wide = self._rates(v, products, y[words * v : words * (v + 1)], wide)
            raised, wide = self._raised(rates, wide)
            quotient, wide = self._divided(n, self._times(raised), wide)
            order += quotient
        return order, wide

    def _rates(
        self, vector: int, sums: list[Operand], y: list[Operand], wide: Operand
    ) -> tuple[list[Operand], Operand]:
        """A ∘ gathered S + Σ B ∘ permuted y, and the largest word."""
        grid, gathered = self.grid, self._gathered(carried(self.code, self.grid, sums))
        wide = self.rows.watch(wide, gathered[0], 0, grid.most_bits(0))
        total = self._bounded_rates(vector, gathered, y) if grid.bounded else self._watched_rates(vector, gathered, y)
        return carried(self.code, grid, total), wide

    def _constants(self, row: int) -> list[Operand]:
        """The words of a row of the constants."""
        words = self.grid.words
        return [self.code.load(self.code.arguments[1], 8 * (words * row + i)) for i in range(words)]

    def _bounded_rates(self, vector: int, gathered: list[Operand], y: list[Operand]) -> list[Operand]:
        code, grid, (pairs, second) = self.code, self.grid, paired_permutations(self.system)
        offset = (1 + len(pairs)) * vector
        rates = bounded_product(code, grid, self._constants(offset), gathered)
        if vector and second:
            return rates  # neither weight nor rotor turns an attitude
        for k, lanes in enumerate(pairs, 1):
            moved = [code.shuffle(word, code.zero, lanes) for word in y]
            linear = bounded_product(code, grid, self._constants(offset + k), moved)
            if second:
                parts = [[code.shuffle(word, code.zero, half) for half in _HALVES] for word in linear]
                linear = [one + other for one, other in parts]
            if k > 1:  # sums of more than three products would overflow their words
                rates = carried(code, grid, rates)
            rates = [a + b for a, b in zip(rates, linear, strict=True)]
        return rates

    def _watched_rates(self, vector: int, gathered: list[Operand], y: list[Operand]) -> list[Operand]:
        code, grid, seen = self.code, self.grid, self.code.arguments[6]
        gathered_bits = code.load(seen, 0).bits()
        result = Accumulator(code, grid, 0, centred(code, grid, grid.words), gathered_bits)
        for factors, source in self.sources(vector, gathered, y):
            result.add_product(factors, source, watched=True, below=not grid.whole)
        result.look_at_all()
        code.store(result.seen.of_bits(), seen, 0)
        return summed(code, grid, result.sums)

    def sources(
        self, vector: int, gathered: list[Operand], y: list[Operand]
    ) -> list[tuple[list[Operand], list[Operand]]]:
        """The words of A and each B, each with its factor."""
        linear = permutations(self.system)
        sources = [gathered, *([self.code.shuffle(word, self.code.zero, lanes) for word in y] for lanes in linear)]
        return [(self._constants((1 + len(linear)) * vector + k), source) for k, source in enumerate(sources)]

    def _gathered(self, total: list[Operand]) -> list[Operand]:
        code, zero = self.code, self.code.zero
        gathered = []
        for word in total:
            parts = [
                code.shuffle(word, zero, [*(lane if sign else _NONE for lane, sign in column), _NONE, _NONE])
                for column in GATHERED
            ]
            third, fourth = (code.constant([*(sign for _, sign in column), 0, 0]) for column in GATHERED[2:])
            others = code.fma(parts[3], fourth, parts[2] * third)
            gathered.append(parts[0] + parts[1] + others)
        return gathered

    def _raised(self, words: list[Operand], wide: Operand) -> tuple[list[Operand], Operand]:
        """The words multiplied by 16 as often as requested, which is rare."""

        def once(_: Operand, values: list[Operand]) -> list[Operand]:
            products = [word * 16.0 for word in values[:-1]]
            widest = values[-1]
            for k, word in enumerate(products):
                widest = self.rows.watch(widest, word, k)
            return [*carried(self.code, self.grid, products), widest]

        values = self.code.loop(0, self.code.arguments[8], once, [*words, wide])
        return values[:-1], values[-1]

    def _times(self, words: list[Operand]) -> list[Operand]:
        """Each word times the factor, rounded to its grid; the exact remainder is added to the next."""
        code, products, left = self.code, [], None
        factor = code.spread(self.code.arguments[7])
        for k, word in enumerate(words):
            big = code.constant(self.grid.centre(k))
            high = code.fma(word, factor, big) - big
            low = code.fma(word, factor, -high)
            products.append(high if left is None else passed_on(code, self.grid, left, high))
            left = low
        return products

    def _divided(self, n: Operand, words: list[Operand], wide: Operand) -> tuple[list[Operand], Operand]:
        """The words divided by n + 1, digit by digit; each remainder is exact and is added to the next word."""
        code = self.code
        after = (n + 1).to_double()
        divisor, inverse = code.spread(after), code.spread(code.load_one(self.code.arguments[2], n))
        quotients, rests = [], list[Operand]()
        for k, word in enumerate(words):
            value = passed_on(code, self.grid, rests[-1], word) if rests else word
            wide = self.rows.watch(wide, value, k, _WIDEST_DIVIDEND if k else WIDEST)
            big = code.constant(self.grid.centre(k))
            quotient = code.fma(value, inverse, big) - big
            rests.append(code.fma(-quotient, divisor, value))
            quotients.append(quotient)
        if not self.grid.whole:
            quotients[-1] = code.fma(rests[-1], inverse, quotients[-1])
        return quotients, wide


# The polynomial of a step on a grid of K words, at times inside the step: the function ``samples``.
#
# Horner's scheme Σ y_n x^n with x = (t − t_0)/h from 0 to 1, for the coefficients y_n h^n of the step.  Its
# products are those of :func:`heavytop.multiword.fixed_point.arithmetic.bounded_product`: x is the smaller factor, and
# a partial sum may be :func:`most_of` at most, which is watched.


_SUM_BITS = 50
_WORDS_AT_ONCE = 12
_PARTS = 5
"""Loops over the orders, each for sums with fewer leading words that are 0."""


def most_of(grid: Grid) -> float:
    """The bound of partial sums: with words of more than 46 bits their products with x leave the range earlier."""
    return float(2.0 ** min(4, _SUM_BITS - grid.bits))


def sample_row(grid: Grid, vectors: int) -> int:
    """Doubles of a sample: K words of L of each vector, then the largest partial sum of each lane."""
    return 8 * (grid.words * vectors + 1)


def write_samples(module: ir.Module, grid: Grid, vectors: int) -> ir.Function:
    """Write ``samples(rows, order, at, first, last, result)``: from the first sample to before the last.

    rows: those of ``series``, and order what it gave.  at: K words of x for each sample, |x| at most 1, word 1 and on
    rounded.  result: a row of :func:`sample_row` for each.
    """
    made, code = function(module, "samples", ir.VoidType(), [POINTER, INT, POINTER, INT, INT, POINTER])
    coefficients, order, at, first, last, result = code.arguments
    words, null = grid.words, code.null
    count = max(1, _WORDS_AT_ONCE // words)  # with few words the operations of one sample depend on each other
    stored = rows_of(grid)(code, grid, vectors, most_orders(grid) + 2, coefficients, null, null, null, [])
    width = words * vectors + 1

    def several(block: Operand, _: list[Operand]) -> None:
        begin = first + block * count
        samples = [code.smaller(begin + i, last - 1) for i in range(count)]
        addresses = [code.address(at, offset * words) for offset in samples]
        x = [[code.spread(code.load_one(start, k)) for k in range(words)] for start in addresses]

        def term(zeros: int, k: Operand, values: list[Operand]) -> list[Operand]:
            rows, results = [stored.stored(order - k, v) for v in range(vectors)], []
            for i in range(count):
                sums, largest = [], values[width * (i + 1) - 1]
                for v, row in enumerate(rows):
                    offset = width * i + words * v
                    product = bounded_product(code, grid, x[i], values[offset : offset + words], zeros)
                    total = carried(code, grid, [one + other for one, other in zip(product, row, strict=True)])
                    largest = code.larger(code.absolute(total[0]), largest)
                    sums += total
                results += [*sums, largest]
            return results

        def vanish(zeros: int, values: list[Operand]) -> Operand:
            begins = [width * i + words * v for i in range(count) for v in range(vectors)]
            leading = [code.absolute(value) for begin in begins for value in values[begin : begin + zeros]]
            return ~code.any_of(reduce(code.larger, leading) > 0)

        # while leading words of the sums are 0, products with them are skipped: high orders are small
        k, values = code.integer(0), [code.zero] * (width * count)
        for zeros in reversed(range(0, words, -(-words // _PARTS))):
            holds = partial(vanish, zeros) if zeros else None
            k, values = code.loop_while(k, order + 1, holds, partial(term, zeros), values)
        for i, offset in enumerate(samples):
            row = code.address(result, offset * (8 * width))
            for index, value in enumerate(values[width * i : width * (i + 1)]):
                code.store(value, row, 8 * index)

    blocks = (last - first + (count - 1)) // count
    code.loop(0, blocks, several, [])
    code.builder.ret_void()
    return made


# Steps on a grid of K words: h = ± a power of two, halved and doubled by the number of orders that a step takes.
#
# A step that takes more than 0.53 K b orders is followed by one of half its length, one that takes fewer than 0.34 K b
# by one of twice its length where the time is a multiple of that.  A step that does not converge, or in which a sum
# left its range, is repeated with half its length; after too many halvings the run ends.


TIME, TARGET, BEGAN, SIGN, CLOCK = range(5)
"""Indices of the clock, doubles: |time|, its target, the beginning of the last step; the direction."""
HALVINGS, FEWEST, MOST, STATUS, ORDERS, REDONE, EXCESS, COUNTS = range(8)
"""Indices of the counts: −log2 h of the next step and its bounds, the outcome of the last one, its orders, repeated
steps; log2 of the divisor of the constants."""
OK, TOO_SMALL, CAPACITY = 0, 2, 3
_MANY_ORDERS, _FEW_ORDERS = 0.53, 0.34


def build(
    grid: Grid, system: System, attitude: bool, processor: Processor | None = None, stepping: bool = True
) -> Machine:
    """``series`` for this system and, with ``stepping``, ``advance``, ``follow`` and ``samples``; a relative grid has
    ``series`` alone.

    advance(state, constants, inverses, rows, sums, starts, seen, result, clock, counts, steps): at most so many steps,
    until the time reaches the target; returns their number.  The state before the last step follows the result.
    follow(those of advance but steps, times, at, progress, count, steps, samples): steps, and ``samples`` of the times
    that they cover, doubles > 0, up to the last time or so many steps.  at: room for the K words of each.
    progress: times and steps done; it also ends at a time that needs exact numbers, or whose sum leaves its range.
    """
    module = ir.Module("grid")
    series = SeriesCode(module, grid, system, 2 if attitude else 1, (processor or Processor.here()).wide)
    made = series.write()
    if stepping and not grid.relative:
        advance = _Advance(module, grid, series.vectors, made)
        advance.write()
        samples = write_samples(module, grid, series.vectors)
        _Follow(module, grid, series.vectors, samples).write(advance.made)
    return compiled(module, processor)


class _Advance(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, grid: Grid, vectors: int, series: ir.Function) -> None:
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, POINTER, POINTER, INT_POINTER, INT]
        self.made, code = function(module, "advance", INT, arguments)
        self.scratch, self.result = code.arguments[:7], code.arguments[7]
        clock, counts, most = code.arguments[8:]
        super().__init__(code, clock, counts, most, STATUS)
        self.grid, self.size, self.series = grid, grid.words * vectors, series

    def covered(self) -> Operand:
        return self.time(TIME) >= self.time(TARGET)

    def write_step(self) -> Operand:
        """Write one step; returns whether it is accepted."""
        code, b = self.code, self.code.builder
        halvings = self.count(HALVINGS)
        length = _power(halvings)
        exponent = self.count(EXCESS) - halvings
        raises = code.larger((exponent + 3) >> 2, 0)
        shift = (raises << 2) - exponent
        factor = self.time(SIGN) * _power(shift)
        orders = code.call(self.series, [*self.scratch, factor, raises, self.result])
        good = orders >= 0
        time = self.time(TIME)
        after = time + length
        moves = after - time == length
        good &= moves
        with b.if_then(good):
            for k in range(self.size):
                code.store(code.load(self.scratch[0], 8 * k), self.result, 8 * (self.size + k))
                code.store(code.load(self.result, 8 * k), self.scratch[0], 8 * k)
            code.store_one(time, self.clock, BEGAN)
            code.store_one(after, self.clock, TIME)
            self.set_count(orders, ORDERS)
        with b.if_then(~good):
            self.set_count(self.count(REDONE) + 1, REDONE)
            exhausted = halvings >= self.count(MOST)
            status = code.select(exhausted, CAPACITY, OK)
            self.set_count(code.select(moves, status, TOO_SMALL), STATUS)
        self._set_length(good, orders, halvings, length)
        return good

    def _set_length(self, good: Operand, orders: Operand, halvings: Operand, length: Operand) -> None:
        few, many = (int(share * self.grid.total) for share in (_FEW_ORDERS, _MANY_ORDERS))
        doubled = length + length
        quotient = self.time(TIME) / doubled
        aligned = quotient == quotient.to_integer().to_double()
        longer = good & aligned & (orders <= few) & (halvings > self.count(FEWEST))
        shorter = ~good | (orders > many)
        next_halvings = self.code.select(shorter, halvings + 1, halvings)
        self.set_count(self.code.select(longer, halvings - 1, next_halvings), HALVINGS)


class _Follow(Following):
    """Writes ``follow``."""

    def __init__(self, module: ir.Module, grid: Grid, vectors: int, samples: ir.Function) -> None:
        arrays = [*[POINTER] * 5, INT_POINTER, *[POINTER] * 3, INT_POINTER]
        kinds = [*arrays, POINTER, POINTER, INT_POINTER, INT, INT, POINTER]
        _, code = function(module, "follow", ir.VoidType(), kinds)
        super().__init__(code, code.arguments[:10], code.arguments[8], code.arguments[9], STATUS)
        self.grid, self.row, self.samples = grid, sample_row(grid, vectors), samples
        self.times, self.at = code.arguments[10:12]

    def covered(self, index: Operand) -> Operand:
        return self.code.load_one(self.times, index) <= self.time(TIME)

    def aim(self, index: Operand) -> None:
        self.code.store_one(self.code.load_one(self.times, index), self.clock, TARGET)

    def put(self, done: Operand, head: Any, otherwise: Any) -> None:
        code = self.code
        exact_end = self._while(done, self.times_count, self._is_known)
        order = code.load_one(self.counts, ORDERS)
        code.call(self.samples, [self.arrays[3], order, self.at, done, exact_end, self.result])
        good = self._while(done, exact_end, self._is_in_range)
        code.store_one(good, self.progress, 0)
        code.builder.cbranch(good > done, head, otherwise)

    def _while(self, start: Operand, stop: Operand, holds: Callable[[Operand], Operand]) -> Operand:
        """The first index from ``start`` on at which ``holds`` is false, at most ``stop``."""

        def wanted(index: Operand, so_far: Operand) -> Operand:
            return (index < stop) & so_far

        def body(index: Operand, _: Operand) -> list[Operand]:
            good = holds(index)
            return [index + good.extended(), good]

        return self.code.as_long_as(wanted, body, [start, self.code.true])[0]

    def _is_known(self, index: Operand) -> Operand:
        """Whether a time is in the last step and its words are exact, a bit; stores them.

        time − began is exact where began is 0, or no more than time ≤ 2 began (Sterbenz); a step is a power of two.
        """
        code, grid = self.code, self.grid
        time, began, end = code.load_one(self.times, index), self.time(BEGAN), self.time(TIME)
        remainder = (time - began) / (end - began)
        near = time <= began + began
        is_exact = (time <= end) & (near | (began == 0))
        for k in range(grid.words):
            digits = remainder * (1 / grid.unit(k))
            low = code.floor(digits)
            above = digits - low >= 0.5
            word = (low + code.select(above, 1.0, 0.0)) * grid.unit(k)
            code.store_one(word, self.at, index * grid.words + k)
            remainder -= word
        return is_exact & (remainder == 0)

    def _is_in_range(self, index: Operand) -> Operand:
        """Whether the partial sums of a sample were in their range, a bit."""
        row = self.code.address(self.result, index * self.row)
        largest = self.code.load(row, self.row - 8)
        return self.code.all_of(largest <= most_of(self.grid))


def raises_of(exponent: int) -> tuple[float, int]:
    """(factor, raises) with factor 16^raises = 2^exponent and factor at most 1, arguments of ``series``."""
    raises = max(0, (exponent + 3) >> 2)
    return 2.0 ** (exponent - 4 * raises), raises


def _power(halvings: Operand) -> Operand:
    """2^-halvings."""
    return ((1023 - halvings) << 52).of_bits()
