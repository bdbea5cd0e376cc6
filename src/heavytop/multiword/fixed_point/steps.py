"""One Taylor step on a grid of K words: the function ``series``.

Coefficients carry h^n, so that the step is a sum.  What has become 0 in all lanes is skipped, which is most of the
speed: :mod:`heavytop.multiword.fixed_point.products` and :mod:`heavytop.multiword.fixed_point.products` keep
coefficients and sum their products. The series ends where two coefficients in a row are below
:attr:`heavytop.multiword.fixed_point.arithmetic.Grid.smallest`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from llvmlite import ir

from heavytop.multiword.codegen.machine_code import (
    DOUBLE,
    DOUBLES,
    INT,
    INT_POINTER,
    INT_VECTOR,
    INTEGERS,
    POINTER,
    VECTOR,
    Code,
    Index,
    Machine,
    Processor,
    Stepping,
    Value,
    compiled,
    function,
)
from heavytop.multiword.codegen.recurrence import GATHERED, beside, turned
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


def size_of(grid: Grid, vectors: int) -> ProductSize:
    """The scratch of a step."""
    return rows_of(grid).size(grid, vectors, most_orders(grid) + 2)


def most_orders(grid: Grid) -> int:
    """Orders after which a step is abandoned."""
    return int(0.64 * grid.total) + 14


@dataclass(slots=True)
class SeriesCode:
    """Writes ``series(state, constants, inverses, rows, sums, places, seen, factor, raises, result)``.

    state, result: K words of each vector.  constants: K words of A and each B (or of those of
    :attr:`heavytop.multiword.codegen.recurrence.Coefficients.beside`, where the grid is bounded), for each vector.
    inverses: 1/(n + 1).
    rows, sums, places, seen: scratch, see :class:`heavytop.multiword.fixed_point.products.Rows`.
    factor, raises: from one order to the next coefficients are multiplied by factor 16^raises; factor is ± a power of
    two, at most 1.
    wide: as :attr:`heavytop.multiword.codegen.machine_code.Processor.wide`; results are the same.
    """

    module: ir.Module
    grid: Grid
    system: System
    vectors: int
    wide: bool
    made: Value = field(init=False)
    code: Code = field(init=False)
    rows: Rows = field(init=False)

    def write(self) -> Value:
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

    def _orders(self, first: list[Value]) -> tuple[Value, Value, Value, list[Value]]:
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
        carried = [n, zeros, small, wide, *y, *total, *rest.values()]
        begin = [code.integer(0)] * 3 + [wide_before, *first, *first, *(code.zero for _ in rest)]
        for phi, value in zip(carried, begin, strict=True):
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
        for phi, value in zip(carried, values, strict=True):
            phi.add_incoming(value, b.block)
        b.branch(head)
        b.position_at_end(out)
        return n, small, wide, [code.add(word, rest[k]) if k in rest else word for k, word in enumerate(total)]

    def _order(self, n: Value, zeros: Value, wide: Value, y: list[Value]) -> tuple[list[Value], Value]:
        """y_(n+1) and the largest word over its limit."""
        words = self.grid.words
        found: list[Value] = []
        for v in range(self.vectors):
            products = self.rows.products(n, zeros, v)
            rates, wide = self._rates(v, products, y[words * v : words * (v + 1)], wide)
            raised, wide = self._raised(rates, wide)
            quotient, wide = self._divided(n, self._times(raised), wide)
            found += quotient
        return found, wide

    def _rates(self, vector: int, sums: list[Value], y: list[Value], wide: Value) -> tuple[list[Value], Value]:
        """A ∘ gathered S + Σ B ∘ permuted y, and the largest word."""
        grid, gathered = self.grid, self._gathered(carried(self.code, self.grid, sums))
        wide = self.rows.watch(wide, gathered[0], 0, grid.most_bits(0))
        total = self._bounded_rates(vector, gathered, y) if grid.bounded else self._watched_rates(vector, gathered, y)
        return carried(self.code, grid, total), wide

    def _constants(self, row: int) -> list[Value]:
        """The words of a row of the constants."""
        words = self.grid.words
        return [self.code.load(self.made.args[1], 8 * (words * row + i)) for i in range(words)]

    def _bounded_rates(self, vector: int, gathered: list[Value], y: list[Value]) -> list[Value]:
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

    def _watched_rates(self, vector: int, gathered: list[Value], y: list[Value]) -> list[Value]:
        code, b, grid, seen = self.code, self.code.builder, self.grid, self.made.args[6]
        gathered_bits = b.bitcast(code.load(seen, 0), INT_VECTOR)
        result = Accumulator(code, grid, 0, centred(code, grid, grid.words), gathered_bits)
        for factors, source in self.sources(vector, gathered, y):
            result.add_product(factors, source, each=True, below=not grid.whole)
        result.look_at_all()
        code.store(b.bitcast(result.seen, VECTOR), seen, 0)
        return summed(code, grid, result.sums)

    def sources(self, vector: int, gathered: list[Value], y: list[Value]) -> list[tuple[list[Value], list[Value]]]:
        """The words of A and each B, and what they are multiplied by."""
        linear = turned(self.system)
        sources = [gathered, *([self.code.shuffle(word, self.code.zero, lanes) for word in y] for lanes in linear)]
        return [(self._constants((1 + len(linear)) * vector + k), source) for k, source in enumerate(sources)]

    def _gathered(self, total: list[Value]) -> list[Value]:
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

    def _raised(self, words: list[Value], wide: Value) -> tuple[list[Value], Value]:
        """Multiplied by 16 as often as is asked; seldom at all."""
        code, sixteen = self.code, self.code.constant(16.0)

        def once(_: Value, values: list[Value]) -> list[Value]:
            products = [code.multiply(word, sixteen) for word in values[:-1]]
            widest = values[-1]
            for k, word in enumerate(products):
                widest = self.rows.watch(widest, word, k)
            return [*carried(code, self.grid, products), widest]

        values = code.loop(0, self.made.args[8], once, [*words, wide])
        return values[:-1], values[-1]

    def _times(self, words: list[Value]) -> list[Value]:
        """Each word times the factor, rounded to its grid; what is left goes to the next, exactly."""
        code, found, left = self.code, [], None
        factor = code.spread(self.made.args[7])
        for k, word in enumerate(words):
            big = code.constant(self.grid.centre(k))
            high = code.subtract(code.fma(word, factor, big), big)
            low = code.fma(word, factor, code.negative(high))
            found.append(high if left is None else passed_on(code, self.grid, left, high))
            left = low
        return found

    def _divided(self, n: Value, words: list[Value], wide: Value) -> tuple[list[Value], Value]:
        """Divided by n + 1, digit by digit: each remainder is exact and goes to the next word."""
        code, b = self.code, self.code.builder
        after = b.sitofp(b.add(n, code.integer(1)), DOUBLE)
        divisor, inverse = code.spread(after), code.spread(b.load(code.address(self.made.args[2], n)))
        found, rest = [], None
        for k, word in enumerate(words):
            value = word if rest is None else passed_on(code, self.grid, rest, word)
            wide = self.rows.watch(wide, value, k, _WIDEST_DIVIDEND if k else WIDEST)
            big = code.constant(self.grid.centre(k))
            quotient = code.subtract(code.fma(value, inverse, big), big)
            rest = code.fma(code.negative(quotient), divisor, value)
            found.append(quotient)
        if not self.grid.whole:
            found[-1] = code.fma(rest, inverse, found[-1])
        return found, wide


# The polynomial of a step on a grid of K words, at times inside the step: the function ``samples``.
#
# Horner's scheme Σ y_n x^n with x = (t − t_0)/h from 0 to 1, for the coefficients y_n h^n that the step has left.  Its
# products are those of :func:`heavytop.multiword.fixed_point.arithmetic.bounded_product`: x is the smaller factor, and
# a partial sum may be :func:`most_of` at most, which is watched.


_SUM_BITS = 50
_WORDS_AT_ONCE = 12


def most_of(grid: Grid) -> float:
    """What a partial sum may be: with words of more than 46 bits its products with x leave their range earlier."""
    return float(2.0 ** min(4, _SUM_BITS - grid.bits))


def sample_row(grid: Grid, vectors: int) -> int:
    """Doubles of a sample: K words of L of each vector, then the largest partial sum of each lane."""
    return 8 * (grid.words * vectors + 1)


def samples_at_once(grid: Grid) -> int:
    """Samples that are taken side by side: of few words the operations of one wait for each other."""
    return max(1, _WORDS_AT_ONCE // grid.words)


def write_samples(module: ir.Module, grid: Grid, vectors: int) -> Value:
    """Write ``samples(rows, order, at, first, last, result)``: from the first sample to before the last.

    rows: those of ``series``, and order what it gave.  at: K words of x for each sample, |x| at most 1, word 1 and on
    rounded.  result: a row of :func:`sample_row` for each.
    """
    made, code = function(module, "samples", ir.VoidType(), [POINTER, INT, POINTER, INT, INT, POINTER])
    coefficients, order, at, first, last, result = made.args
    b, words, count = code.builder, grid.words, samples_at_once(grid)
    kept = rows_of(grid)(code, grid, vectors, most_orders(grid) + 2, coefficients, None, None, None, [])
    width = words * vectors + 1

    def several(block: Value, _: list[Value]) -> None:
        begin = b.add(first, b.mul(block, code.integer(count)))
        places = [code.least(b.add(begin, code.integer(i)), b.sub(last, code.integer(1))) for i in range(count)]
        starts = [code.address(at, b.mul(place, code.integer(words))) for place in places]
        x = [[code.spread(b.load(code.address(start, k))) for k in range(words)] for start in starts]

        def term(k: Value, values: list[Value]) -> list[Value]:
            rows, found = [kept.stored(b.sub(order, k), v) for v in range(vectors)], []
            for i in range(count):
                sums, largest = [], values[width * (i + 1) - 1]
                for v, row in enumerate(rows):
                    place = width * i + words * v
                    product = bounded_product(code, grid, x[i], values[place : place + words])
                    total = carried(code, grid, [code.add(one, other) for one, other in zip(product, row, strict=True)])
                    largest = code.larger(code.absolute(total[0]), largest)
                    sums += total
                found += [*sums, largest]
            return found

        values = code.loop(0, b.add(order, code.integer(1)), term, [code.zero] * (width * count))
        for i, place in enumerate(places):
            row = code.address(result, b.mul(place, code.integer(8 * width)))
            for index, value in enumerate(values[width * i : width * (i + 1)]):
                code.store(value, row, 8 * index)

    blocks = b.sdiv(b.add(b.sub(last, first), code.integer(count - 1)), code.integer(count))
    code.loop(0, blocks, several, [])
    b.ret_void()
    return made


# Steps on a grid of K words: h = ± a power of two, halved and doubled by the number of orders that a step takes.
#
# A step that takes more than 0.53 K b orders is followed by one of half its length, one that takes fewer than 0.34 K b
# by one of twice its length where the time is a multiple of that.  A step that does not converge, or in which a sum
# left its range, is done again with half its length; where that goes on, the run ends.


TIME, TARGET, BEGAN, SIGN, CLOCK = range(5)
"""Places of the clock, doubles: |time|, its target, the beginning of the last step; the direction."""
HALVINGS, FEWEST, MOST, STATUS, ORDERS, REDONE, EXCESS, COUNTS = range(8)
"""Places of the counts: −log2 h of the next step and its bounds, how the last one ended, its orders, steps redone;
log2 of what the constants were divided by."""
FINE, TOO_SMALL, CAPACITY = 0, 2, 3
_MANY_ORDERS, _FEW_ORDERS = 0.53, 0.34


def build(grid: Grid, system: System, attitude: bool, processor: Processor | None = None) -> Machine:
    """``series`` for this system and, unless the grid is relative, ``advance``, ``follow`` and ``samples``.

    advance(state, constants, inverses, rows, sums, places, seen, result, clock, counts, steps): at most so many steps,
    until the time covers the target; gives their number.  Behind the result lies the state before the last step.
    follow(those of advance but steps, times, at, progress, count, steps, samples): steps, and ``samples`` of the times
    that they cover, doubles > 0, until all are or so many steps are taken.  at: room for the K words of each.
    progress: times and steps done; it ends, too, at a time that takes exact numbers, or whose sum leaves its range.
    """
    module = ir.Module("grid")
    series = SeriesCode(module, grid, system, 2 if attitude else 1, (processor or Processor.here()).wide)
    made, integer = series.write(), ctypes.c_int64
    pointers = [DOUBLES] * 5 + [INTEGERS, DOUBLES]
    signatures: dict[str, tuple[Any, Sequence[Any]]] = {
        "series": (integer, [*pointers, ctypes.c_double, integer, DOUBLES]),
    }
    if not grid.relative:
        advance = _Advance(module, grid, series.vectors, made)
        advance.write()
        samples = write_samples(module, grid, series.vectors)
        _Follow(module, grid, series.vectors, advance.made, samples).write()
        signatures["advance"] = (integer, [*pointers, DOUBLES, DOUBLES, INTEGERS, integer])
        signatures["samples"] = (None, [DOUBLES, integer, DOUBLES, integer, integer, DOUBLES])
        follow = [*pointers, *[DOUBLES] * 2, INTEGERS, *[DOUBLES] * 2, INTEGERS, integer, integer, DOUBLES]
        signatures["follow"] = (None, follow)
    return compiled(module, signatures, processor)


class _Advance(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, grid: Grid, vectors: int, series: Value) -> None:
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, POINTER, POINTER, INT_POINTER, INT]
        self.made, code = function(module, "advance", INT, arguments)
        self.scratch, self.result = self.made.args[:7], self.made.args[7]
        clock, counts, most = self.made.args[8:]
        super().__init__(code, clock, counts, most, STATUS)
        self.grid, self.size, self.series = grid, grid.words * vectors, series

    def covered(self) -> Value:
        return self.code.builder.fcmp_ordered(">=", self.time(TIME), self.time(TARGET))

    def write_step(self) -> Value:
        """One step; whether it stands."""
        code, b = self.code, self.code.builder
        halvings = self.count(HALVINGS)
        length = _power(code, halvings)
        exponent = b.sub(self.count(EXCESS), halvings)
        raises = b.ashr(b.add(exponent, code.integer(3)), code.integer(2))
        raises = b.select(b.icmp_signed(">", raises, code.integer(0)), raises, code.integer(0))
        rest = b.sub(b.shl(raises, code.integer(2)), exponent)
        factor = b.fmul(self.time(SIGN), _power(code, rest))
        orders = b.call(self.series, [*self.scratch, factor, raises, self.result])
        good = b.icmp_signed(">=", orders, code.integer(0))
        time = self.time(TIME)
        after = b.fadd(time, length)
        moves = b.fcmp_ordered("==", b.fsub(after, time), length)
        good = b.and_(good, moves)
        with b.if_then(good):
            for k in range(self.size):
                code.store(code.load(self.scratch[0], 8 * k), self.result, 8 * (self.size + k))
                code.store(code.load(self.result, 8 * k), self.scratch[0], 8 * k)
            b.store(time, code.address(self.clock, BEGAN))
            b.store(after, code.address(self.clock, TIME))
            self.set_count(orders, ORDERS)
        with b.if_then(b.not_(good)):
            self.set_count(b.add(self.count(REDONE), code.integer(1)), REDONE)
            exhausted = b.icmp_signed(">=", halvings, self.count(MOST))
            status = b.select(exhausted, code.integer(CAPACITY), code.integer(FINE))
            self.set_count(b.select(moves, status, code.integer(TOO_SMALL)), STATUS)
        self._set_length(good, orders, halvings, length)
        return good

    def _set_length(self, good: Value, orders: Value, halvings: Value, length: Value) -> None:
        code, b, one = self.code, self.code.builder, self.code.integer(1)
        few, many = (code.integer(int(share * self.grid.total)) for share in (_FEW_ORDERS, _MANY_ORDERS))
        doubled = b.fadd(length, length)
        quotient = b.fdiv(self.time(TIME), doubled)
        whole = b.sitofp(b.fptosi(quotient, INT), DOUBLE)
        aligned = b.fcmp_ordered("==", quotient, whole)
        longer = b.and_(b.and_(good, aligned), b.icmp_signed("<=", orders, few))
        longer = b.and_(longer, b.icmp_signed(">", halvings, self.count(FEWEST)))
        shorter = b.or_(b.not_(good), b.icmp_signed(">", orders, many))
        following = b.select(shorter, b.add(halvings, one), halvings)
        self.set_count(b.select(longer, b.sub(halvings, one), following), HALVINGS)


class _Follow:
    """Writes ``follow``."""

    def __init__(self, module: ir.Module, grid: Grid, vectors: int, advance: Value, samples: Value) -> None:
        arrays = [*[POINTER] * 5, INT_POINTER, *[POINTER] * 3, INT_POINTER]
        kinds = [*arrays, POINTER, POINTER, INT_POINTER, INT, INT, POINTER]
        made, self.code = function(module, "follow", ir.VoidType(), kinds)
        self.grid, self.row, self.functions = grid, sample_row(grid, vectors), (advance, samples)
        self.arrays, (self.times, self.at, self.progress, *rest) = made.args[:10], made.args[10:]
        self.count, self.most, self.result = rest

    def write(self) -> None:
        """The loop over times and steps."""
        code, b = self.code, self.code.builder
        head, inside, step, sample, out = map(b.append_basic_block, ("head", "in", "step", "at", "out"))
        b.branch(head)
        b.position_at_end(head)
        done, taken = (self._word(self.progress, place) for place in range(2))
        running = b.icmp_signed("==", self._word(self.arrays[9], STATUS), code.integer(FINE))
        left = b.and_(b.icmp_signed("<", done, self.count), b.icmp_signed("<", taken, self.most))
        b.cbranch(b.and_(running, left), inside, out)
        b.position_at_end(inside)
        target = self._word(self.times, done)
        b.cbranch(b.fcmp_ordered("<=", target, self._clock(TIME)), sample, step)
        b.position_at_end(step)
        b.store(target, code.address(self.arrays[8], TARGET))
        more = b.call(self.functions[0], [*self.arrays, b.sub(self.most, taken)])
        b.store(b.add(taken, more), code.address(self.progress, 1))
        b.branch(head)
        b.position_at_end(sample)
        known = self._while(done, self.count, self._is_known)
        order = self._word(self.arrays[9], ORDERS)
        b.call(self.functions[1], [self.arrays[3], order, self.at, done, known, self.result])
        good = self._while(done, known, self._is_in_range)
        b.store(good, code.address(self.progress, 0))
        b.cbranch(b.icmp_signed(">", good, done), head, out)
        b.position_at_end(out)
        b.ret_void()

    def _while(self, start: Value, stop: Value, holds: Callable[[Value], Value]) -> Value:
        """The first place from ``start`` on that ``holds`` does not, ``stop`` at the latest."""
        b = self.code.builder
        entry, head, body, out = b.block, *map(b.append_basic_block, ("while", "holds", "so_far"))
        b.branch(head)
        b.position_at_end(head)
        place = b.phi(INT)
        place.add_incoming(start, entry)
        b.cbranch(b.icmp_signed("<", place, stop), body, out)
        b.position_at_end(body)
        found, after = holds(place), b.add(place, self.code.integer(1))
        place.add_incoming(after, b.block)
        b.cbranch(found, head, out)
        b.position_at_end(out)
        return place

    def _is_known(self, place: Value) -> Value:
        """Whether a time is in the last step and its words are exact, a bit; puts them.

        time − began is exact where began is 0, or no more than time ≤ 2 began (Sterbenz); a step is a power of two.
        """
        code, b, grid = self.code, self.code.builder, self.grid
        time, began, end = self._word(self.times, place), self._clock(BEGAN), self._clock(TIME)
        rest = b.fdiv(b.fsub(time, began), b.fsub(end, began))
        zero, one = (ir.Constant(DOUBLE, value) for value in (0.0, 1.0))
        near = b.fcmp_ordered("<=", time, b.fadd(began, began))
        known = b.and_(b.fcmp_ordered("<=", time, end), b.or_(near, b.fcmp_ordered("==", began, zero)))
        for k in range(grid.words):
            digits = b.fmul(rest, ir.Constant(DOUBLE, 1 / grid.unit(k)))
            low = code.floor(digits)
            above = b.fcmp_ordered(">=", b.fsub(digits, low), ir.Constant(DOUBLE, 0.5))
            word = b.fmul(b.fadd(low, b.select(above, one, zero)), ir.Constant(DOUBLE, grid.unit(k)))
            at = b.add(b.mul(place, code.integer(grid.words)), code.integer(k))
            b.store(word, code.address(self.at, at))
            rest = b.fsub(rest, word)
        return b.and_(known, b.fcmp_ordered("==", rest, zero))

    def _is_in_range(self, place: Value) -> Value:
        """Whether the partial sums of a sample were in their range, a bit."""
        row = self.code.address(self.result, self.code.builder.mul(place, self.code.integer(self.row)))
        largest = self.code.load(row, self.row - 8)
        limit = self.code.constant(most_of(self.grid))
        return self.code.all_of(self.code.builder.fcmp_ordered("<=", largest, limit))

    def _clock(self, place: int) -> Value:
        return self._word(self.arrays[8], place)

    def _word(self, array: Value, place: Index) -> Value:
        return self.code.builder.load(self.code.address(array, place))


def raises_of(exponent: int) -> tuple[float, int]:
    """(factor, raises) with factor 16^raises = 2^exponent and factor at most 1, as ``advance`` takes them."""
    raises = max(0, (exponent + 3) >> 2)
    return 2.0 ** (exponent - 4 * raises), raises


def _power(code: Code, halvings: Value) -> Value:
    """2^-halvings."""
    b = code.builder
    return b.bitcast(b.shl(b.sub(code.integer(1023), halvings), code.integer(52)), DOUBLE)
