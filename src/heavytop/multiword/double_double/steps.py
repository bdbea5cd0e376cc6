"""Taylor steps in double-double arithmetic (106 bits), with fewer bits from some order on.

The coefficients y_n of a motion fall with n.  From some order on split coefficients are accurate enough, and the low
words above some n0 < N are negligible: there the recurrence uses plain doubles.  n0 adapts to the motion: a step is
repeated with a larger one where 2^-53 |y_(n0+1)| h^(n0+1) exceeds its bound, and n0 falls where a smaller one suffices.


The step is h = ρ exp(reach), with the radius ρ from the last two coefficients as Jorba and Zou have it (Exp. Math. 14
(2005) 99); its significand is cut to ten bits, so that h^4 is a double and h adds to the time exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from heavytop.multiword.codegen.machine_code import (
    DOUBLE,
    INT,
    INT_POINTER,
    POINTER,
    Code,
    Following,
    Index,
    Machine,
    Operand,
    Pair,
    Processor,
    Stepping,
    compiled,
    function,
    ir,
)
from heavytop.multiword.codegen.recurrence import LEFT, RIGHT, Layout, Recurrence, permutations
from heavytop.multiword.double_double.arithmetic import (
    Constant,
    add,
    behind,
    covered,
    later,
    log2,
    polynomials,
    step_length,
    times,
)
from heavytop.top.equations import System

# Taylor orders between double-double and plain doubles: coefficients split in two.
#
# y_m = a + b, where a is a multiple of a unit 2^e_m and |y_m| <= 2^21 units, and b a double of half a unit at most.
# Up to rounding e_m is linear in m, so that the products in S_n have a common unit: products and
# sums of a are exact in plain doubles.  With L = a + b, and R likewise,
#
#     S_n = Σ a_m a_(n−m) + Σ (a_m b_(n−m) + b_m R_(n−m)),
#
# three operations a product instead of the ten of double-double.  The error is some 2^-72 of the largest products,
# which suffices where y_n h^n is small enough beside the state.
#
# The units adapt to the motion from step to step.  A step whose coefficients exceed them, or use few bits of them, is
# repeated with others.


UNIT_BITS = 21
"""|y_m| is 2^21 units at most, so that L and R are 2^22 at most.  Rounding e_m may halve the common unit of 61
products, and the field adds up to four of their sums: 2^44 · 2 · 61 · 4 < 2^53 units, which doubles hold exactly."""
SLOPE_BITS = 16
"""e_m = e_0 + m slope, the slope in units of 2^-16."""
_MOST_UNIT_BITS, STEEPEST = 400, 8
"""|e_0| and |slope| at most."""
_SPARSE, _ROOM = 2.0**-6, 8.0
"""The least share of 2^21 units in use; the next units have room for four to eight times the largest coefficient."""
SLACK, TOLERATED_SLOPE = 0.25, 0.375
"""Excess of the slope over log2 of the inverse radius, and its tolerance."""
MOST_TRIES = 3
_FRACTION_BITS, _BIAS = 52, 1023
_EXPONENT = ((1 << 11) - 1) << _FRACTION_BITS
# the bits of 1.5 · 2^52 units and of the inverse of 2^21 units add to this
_SCALES = (2 * _BIAS + _FRACTION_BITS - UNIT_BITS << _FRACTION_BITS) + (1 << (_FRACTION_BITS - 1))
FIRST_UNITS = 1.5 * 2.0 ** (_FRACTION_BITS - UNIT_BITS + 1)
LOG2_OF_A_UNIT = math.log2(1.5) + _FRACTION_BITS
# Ω, γ
_ROUND = ([1, 2, 0, 4, 5, 3, 6, 7], [2, 0, 1, 5, 3, 4, 6, 7])


def splits(code: Code, units: list[Operand], slope: Operand) -> Operand:
    """Whether the units are in range, a bit; units: 1.5 · 2^52 of them, lane by lane."""
    steepest = STEEPEST << SLOPE_BITS
    splits = code.unsigned_less(slope + steepest, 2 * steepest)
    for unit in units:
        splits &= code.all_of(in_range(unit))
    return splits


def in_range(unit: Operand) -> Operand:
    """Whether 1.5 · 2^52 units are far from underflow and overflow, lane by lane."""
    low, high = (2.0 ** (_FRACTION_BITS + sign * _MOST_UNIT_BITS) for sign in (-1, 1))
    return (unit > low) & (unit < high)


def next_unit(code: Code, unit: Operand, peak: Operand) -> tuple[Operand, Operand]:
    """Whether the units of a step fit, and the units of the next, lane by lane.

    unit: 1.5 · 2^52 of them.  peak: the largest |y_m| 2^(e_0 - e_m).
    """
    # the inverse of 2^21 units of y_0
    inverse = _SCALES - unit.bits()
    used = peak * inverse.of_bits()
    nothing = used == 0
    fits = (used <= 1.0) & (used >= _SPARSE)
    power = (used.bits() & _EXPONENT).of_bits()
    factor = code.select(nothing, 1.0, power * _ROOM)
    return nothing | fits, unit * factor


def rises(code: Code, m: Operand, slope: Operand) -> Pair:
    """2^(e_m - e_0) and its inverse, lane by lane, for slopes that are doubles."""
    rounded = code.fma(code.spread(m.to_double()), slope, 1.5 * 2.0**_FRACTION_BITS)
    shift = rounded.bits() << _FRACTION_BITS
    unit_bits = _BIAS << _FRACTION_BITS
    return (unit_bits + shift).of_bits(), (unit_bits - shift).of_bits()


def parts(y: Pair, big: Operand) -> Pair:
    """y as a multiple of a unit and the rest; big: 1.5 · 2^52 units."""
    coarse = y[0] + big - big
    return coarse, y[0] - coarse + y[1]


def quotient(code: Code, first: Pair | None, factors: list[tuple[Constant, Pair]], divisor: Pair) -> Pair:
    """The sum of a pair and of products of a constant and a pair, over an integer, normalised.

    divisor: the number and its inverse.
    """
    total = first
    for constant, factor in factors:
        product, error = code.two_product(constant[0], factor[0])
        remainder = code.fma(constant[0], factor[1], code.fma(constant[1], factor[0], error))
        if total is None:
            total = product, remainder
        else:
            high, sum_error = code.two_sum(total[0], product)
            total = high, total[1] + (remainder + sum_error)
    assert total is not None
    integer, inverse = divisor
    quotient = total[0] * inverse
    remainder = code.fma(-quotient, integer, total[0]) + total[1]
    return code.quick_two_sum(quotient, remainder * inverse)


def first_split(code: Code, units: list[Operand], slope: Operand, reach: Operand, depth: Operand) -> Operand:
    """The order from which split coefficients are accurate enough, an integer.

    depth: log2 of the state and how many bits below it the products of the units of Ω and the largest may be.
    """
    lanes = [(units[0], 0), *((unit, 3) for unit in units)]
    lanes_bits = [code.lane(unit, lane).bits() for unit, lane in lanes]
    largest = lanes_bits[0]
    for bits in lanes_bits[1:]:
        largest = code.larger(bits, largest)
    exponents = lanes_bits[0].unsigned_shift(_FRACTION_BITS) + largest.unsigned_shift(_FRACTION_BITS)
    units_bits = exponents.to_double() - 2.0 * (_BIAS + _FRACTION_BITS)
    length = reach - slope.to_double() * 2.0**-SLOPE_BITS
    fall = -SLACK - reach
    orders = (units_bits + length - depth) / fall
    return code.smaller(code.larger(orders, 1.0), 1000.0).to_integer()


def judged(code: Code, units: list[Operand], largest: list[Operand]) -> tuple[Operand, list[Operand]]:
    """Whether the units of a step were good, a bit, and those of the next.

    largest: |y_m| 2^(e_0 - e_m), lane by lane.
    """
    good, next_units = code.true, []
    for unit, lanewise in zip(units, largest, strict=True):
        peak = lanewise
        for lanes in _ROUND:
            peak = code.larger(peak, code.shuffle(lanewise, code.zero, lanes))
        fits, after = next_unit(code, unit, peak)
        good &= code.all_of(fits)
        next_units.append(after)
    return good, next_units


def near(slope: Operand, suggested: Operand) -> Operand:
    """Whether units with this slope are fine enough where another is suggested, a bit."""
    return slope - suggested < int(TOLERATED_SLOPE * 2**SLOPE_BITS)


def slope_of(reach: Operand, length: Operand) -> Operand:
    """The slope that goes with a step of this length: log2 of the inverse radius of convergence, and a little more."""
    value = reach - log2(length) + (SLACK + 2.0 * _BIAS)
    return (value * 2.0**SLOPE_BITS).to_integer() - (2 * _BIAS << SLOPE_BITS)


@dataclass(frozen=True, slots=True)
class SplitOrders:
    """Writes the orders in split coefficients.

    units: 1.5 · 2^52 units of y_0, lane by lane, for each vector.  zero_row: a row of zeros.
    """

    series: Recurrence
    units: list[Operand]
    slope: Operand
    zero_row: Operand

    def begin(self, last: Operand) -> list[Operand]:
        """Split y_0 to y_last; returns the largest |y_m| 2^(e_0 - e_m), lane by lane."""
        series = self.series

        def order(m: Operand, largest: list[Operand]) -> list[Operand]:
            row = series.row(m)
            y = [series.pair(row, series.layout.value(v)) for v in series.vectors]
            return self._put(m, y, largest)[-len(largest) :]

        stop = last + 1
        return series.code.loop(0, stop, order, [series.code.zero for _ in series.vectors])

    def orders(
        self, start: Operand, stop: Operand, last: list[Operand], largest: list[Operand]
    ) -> tuple[list[Operand], list[Operand]]:
        """Write y_(start+1) to y_stop; returns the words of the last, and the largest |y_m| as :meth:`begin`."""
        code, series, width = self.series.code, self.series, len(self.series.vectors)

        def order(n: Operand, values: list[Operand]) -> list[Operand]:
            words, sides = values[: 2 * width], values[2 * width : -width]
            products = self._products(n, sides)
            next_pairs = [self._next(n, v, sums, (words[2 * v], words[2 * v + 1])) for v, sums in enumerate(products)]
            after = n + 1
            row = series.row(after)
            for v, pair in enumerate(next_pairs):
                for word in range(2):
                    code.store(pair[word], row, series.layout.value(v) + 8 * word)
            return [*(word for pair in next_pairs for word in pair), *self._put(after, next_pairs, values[-width:])]

        row = series.row(start)
        sides = [code.load(row, offset) for offset in self._places]
        values = code.loop(start, stop, order, [*last, *sides, *largest])
        return values[: 2 * width], values[-width:]

    @property
    def _places(self) -> list[int]:
        """Offsets in a row of R and its parts, and of the parts of each L."""
        lefts = (self.series.layout.left(v) for v in self.series.vectors)
        return [0, 16, 24, *(offset + k for offset in lefts for k in (16, 24))]

    def _rise(self, m: Operand) -> Pair:
        """2^(e_m - e_0) and its inverse."""
        rise = (m * self.slope + (1 << SLOPE_BITS - 1)) >> SLOPE_BITS
        shifts = [(_BIAS + part) << _FRACTION_BITS for part in (rise, -rise)]
        up, down = (self.series.code.spread(shift.of_bits()) for shift in shifts)
        return up, down

    def _put(self, m: Operand, y: list[Pair], largest: list[Operand]) -> list[Operand]:
        """Split and store both sides of order m; returns R and its parts, the parts of each L, and the largest |y|
        2^(e_0 - e_m) so far.
        """
        code, series = self.series.code, self.series
        row, sides, peaks = series.row(m), list[Operand](), []
        up, down = self._rise(m)
        for v in series.vectors:
            big = self.units[v] * up
            peaks.append(code.larger(code.absolute(y[v][0] * down), largest[v]))
            split = parts(y[v], big)
            right = [series.side(part, RIGHT) for part in split] if v == 0 else []
            left = [series.side(part, LEFT) for part in split]
            for part, offset in ((right, 0), (left, series.layout.left(v))):
                if part:
                    sides += [part[0] + part[1], *part][offset > 0 :]
                    code.store(part[0] + part[1], row, offset)
                    for k, word in enumerate(part):
                        code.store(word, row, offset + 16 + 8 * k)
        return sides + peaks

    def _products(self, n: Operand, sides: list[Operand]) -> list[Pair]:
        """Σ L_m R_(n−m) of each vector: the exact sums of the coarse parts, and the rest."""
        code, width = self.series.code, len(self.series.vectors)

        def row(m: Index) -> list[Operand]:
            at = self.series.row(m)
            return [code.load(at, offset) for offset in self._places]

        def pair_of_orders(m: Operand, sums: list[Operand]) -> list[Operand]:
            row_m, row_rest = row(m), row(n - m)
            return self._added(row_m, row_rest, sums[: 3 * width]) + self._added(row_rest, row_m, sums[3 * width :])

        sums = code.loop(1, (n + 1).unsigned_shift(1), pair_of_orders, [code.zero] * (6 * width))
        odd = (n & 1) != 0
        middle, start = row(code.select(odd, self.zero_row, n.unsigned_shift(1))), row(0)
        first, second = self._added(middle, middle, sums[: 3 * width]), sums[3 * width :]
        first, second = self._added(start, sides, first), self._added(sides, start, second)
        total = [x + y for x, y in zip(first, second, strict=True)]
        return [(total[3 * v], total[3 * v + 1] + total[3 * v + 2]) for v in self.series.vectors]

    def _added(self, left_row: list[Operand], right_row: list[Operand], sums: list[Operand]) -> list[Operand]:
        """Three sums of each vector, with the products of L of one order and R of another."""
        unsplit, coarse, fine = right_row[:3]
        result = []
        for v in self.series.vectors:
            a, b = left_row[3 + 2 * v : 5 + 2 * v]
            for left, right, total in zip((a, a, b), (coarse, fine, unsplit), sums[3 * v : 3 * v + 3], strict=True):
                result.append(self.series.code.fma(left, right, total))
        return result

    def _next(self, n: Operand, vector: int, sums: Pair, y: Pair) -> Pair:
        """y_(n+1) = (A ∘ gathered S_n + Σ B ∘ permuted y_n)/(n + 1)."""
        code, series = self.series.code, self.series
        factors = [(series.constant(vector, 0), (series.gathered(sums[0]), series.gathered(sums[1])))]
        for k, lanes in enumerate(permutations(series.system), 1):
            moved = [code.shuffle(word, code.zero, lanes) for word in y]
            factors.append((series.constant(vector, k), (moved[0], moved[1])))
        return quotient(code, None, factors, series.divisor(n))


TIME, TIME_LOW, TARGET, TARGET_LOW, BEGAN, BEGAN_LOW, SIGN, ROOM, REACH, DEPTH, CLOCK = range(11)
"""Indices of the clock, doubles: |time|, its target and the beginning of the last step, in two words each; the
direction; log2 of the rounding allowed above n0, in units of 2^-53; log2 of h/ρ; log2 of the largest products of the
units of split coefficients over the state."""
ORDER, LOW_ORDER, LEAST, MOST, STATUS, USED, TRIES, SLOPE, USED_TRIES, USED_SLOPE, COUNTS = range(11)
"""Indices of the counts: N, n0 of the next step, bounds of n0, the outcome of the last step, its n0; the tries of the
next step in split coefficients, and the slope of their units; both of the last step."""
OK, NON_FINITE, TOO_SMALL = range(3)
AT_ONCE = 4
"""Samples that are evaluated together, as the operations of one depend on each other."""
_HYSTERESIS = 3.0
_TOLERATED = 1.0


def layout_of(system: System, attitude: bool) -> Layout:
    """The layout of a motion."""
    return Layout(2 if attitude else 1, len(permutations(system)))


def build(system: System, attitude: bool, processor: Processor | None = None) -> Machine:
    """``advance``, ``sample`` and ``follow`` for this system.

    advance(state, clock, counts, table, scratch, steps): at most so many steps, until the time reaches the target;
    returns their number.  The scratch holds the coefficients of the last one.
    sample(scratch, n0, order, high, low, result): the polynomial of the last step at a time after its beginning.
    follow(state, clock, counts, table, scratch, highs, lows, progress, times, steps, result): steps, and a row of the
    result for each time that they cover, up to the last time or so many steps.  The times |τ| > 0 are in two words.
    progress: times and steps done; it also ends at a time whose distance from the beginning of its step needs exact
    numbers.
    """
    module = ir.Module("double_double")
    layout = layout_of(system, attitude)
    advance = _Step(module, layout, system)
    advance.write()
    _write_sample(module, layout, system)
    _Follow(module, layout, system).write(advance.made)
    return compiled(module, processor)


def _write_sample(module: ir.Module, layout: Layout, system: System) -> None:
    _, code = function(module, "sample", ir.VoidType(), [POINTER, INT, INT, DOUBLE, DOUBLE, POINTER])
    scratch, low_order, order, high, low, result = code.arguments
    _put_samples(Recurrence(code, layout, system, code.null, scratch), (low_order, order), [(high, low)], result)
    code.builder.ret_void()


def _put_samples(rows: Recurrence, orders: Pair, times: Sequence[Pair], result: Operand) -> None:
    """Write the polynomial of the last step at times after its beginning, a row of the result for each.

    orders: its n0, above which doubles suffice as in the sum at the end of the step, and its N.
    """

    def row(n: Operand) -> list[Pair]:
        address = rows.row(n)
        return [rows.pair(address, rows.layout.value(v)) for v in rows.vectors]

    spread = [(rows.code.spread(high), rows.code.spread(low)) for high, low in times]
    words = [word for sample in polynomials(rows.code, orders, spread, len(rows.vectors), row) for word in sample]
    for index, word in enumerate(words):
        rows.code.store(word, result, 8 * index)


class _Follow(Following):
    """Writes ``follow``."""

    def __init__(self, module: ir.Module, layout: Layout, system: System) -> None:
        kinds = [POINTER, POINTER, INT_POINTER, *[POINTER] * 4, INT_POINTER, INT, INT, POINTER]
        _, code = function(module, "follow", ir.VoidType(), kinds)
        super().__init__(code, code.arguments[:5], code.arguments[1], code.arguments[2], STATUS)
        self.times, self.layout = (code.arguments[5], code.arguments[6]), layout
        self.rows = Recurrence(code, layout, system, code.null, self.arrays[-1])

    def covered(self, index: Operand) -> Operand:
        return covered((self.time(TIME), self.time(TIME_LOW)), self._target(index))

    def aim(self, index: Operand) -> None:
        for word, at in zip(self._target(index), (TARGET, TARGET_LOW), strict=True):
            self.code.store_one(word, self.clock, at)

    def put(self, done: Operand, head: Any, otherwise: Any) -> None:
        single = self.code.builder.append_basic_block("one")
        self._put(done, AT_ONCE, head, single)
        self.code.builder.position_at_end(single)
        self._put(done, 1, head, otherwise)

    def _put(self, done: Operand, count: int, head: Any, otherwise: Any) -> None:
        """Store ``count`` rows of the result, of which those with covered times count, and branch to the head; or to
        ``otherwise`` where one of these times needs exact numbers.
        """
        code, b = self.code, self.code.builder
        began, put = (self.time(BEGAN), self.time(BEGAN_LOW)), b.append_basic_block("put")
        sure, times, end = code.true, [], done
        for k in range(count):
            index = code.smaller(done + k, self.times_count - 1)
            at, exact = behind(code, self._target(index), began, self.time(SIGN))
            is_covered = self.covered(index)
            sure &= exact | ~is_covered
            end += is_covered.extended()
            times.append(at)
        b.cbranch(sure, put, otherwise)
        b.position_at_end(put)
        result = code.address(self.result, done * (16 * self.layout.vectors))
        low_order, order = (code.load_one(self.counts, offset) for offset in (USED, ORDER))
        _put_samples(self.rows, (low_order, order), times, result)
        code.store_one(code.smaller(end, self.times_count), self.progress, 0)
        b.branch(head)

    def _target(self, index: Operand) -> Pair:
        return self.code.load_one(self.times[0], index), self.code.load_one(self.times[1], index)


class _Step(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, layout: Layout, system: System) -> None:
        arguments = [POINTER, POINTER, INT_POINTER, POINTER, POINTER, INT]
        self.made, code = function(module, "advance", INT, arguments)
        self.state, clock, counts, table, scratch, most = code.arguments
        super().__init__(code, clock, counts, most, STATUS)
        self.layout = layout
        self.series = Recurrence(self.code, layout, system, table, scratch)

    def covered(self) -> Operand:
        time, low, target, target_low = (self.time(k) for k in (TIME, TIME_LOW, TARGET, TARGET_LOW))
        return covered((time, low), (target, target_low))

    def write_step(self) -> Operand:
        """Write one step; returns whether it is accepted."""
        order, low_order = self.count(ORDER), self.count(LOW_ORDER)
        first = [self.series.pair(self.state, 16 * v) for v in self.series.vectors]
        self.series.put(0, first)
        start = log2(self._norm(0))
        units = [self.code.load(self.state, self.layout.units + 8 * v) for v in self.series.vectors]
        slope = self.count(SLOPE)
        split, largest = self._orders(first, start, units, slope)
        length = self._length(order, start)
        result = self._sum(order, low_order, length * self.time(SIGN))
        fits = self._units_fit(split, units, slope, largest, length)
        good = self._judge(length, low_order, start, result) & fits
        self._follow(good, fits, units, slope)
        self._accept(good, length, low_order, result)
        return good

    def _orders(
        self, first: list[Pair], start: Operand, units: list[Operand], slope: Operand
    ) -> tuple[Operand, list[Operand]]:
        """Write y_1 to y_N; returns whether some are split, a bit, and their largest sizes."""
        code, series = self.code, self.series
        order, low_order = self.count(ORDER), self.count(LOW_ORDER)
        tried = self.count(TRIES) >= MOST_TRIES
        first_order = first_split(code, units, slope, self.time(REACH), start + self.time(DEPTH))
        split = splits(code, units, slope) & (first_order < low_order) & ~tried
        pair_order = code.select(split, first_order, low_order)
        words = series.orders_in_pairs(first, pair_order)
        parts = SplitOrders(series, units, slope, order + 1)
        largest = parts.begin(code.select(split, pair_order, -1))
        words, largest = parts.orders(pair_order, low_order, words, largest)
        series.plain_orders(low_order, order, [words[2 * v] for v in series.vectors])
        return split, largest

    def _units_fit(
        self, split: Operand, units: list[Operand], slope: Operand, largest: list[Operand], length: Operand
    ) -> Operand:
        """Whether the units of split coefficients fit, a bit; stores those of the next step."""
        fits, next_units = judged(self.code, units, largest)
        suggested = slope_of(self.time(REACH), length)
        self.set_count(suggested, SLOPE)
        for v, unit in enumerate(next_units):
            self.code.store(unit, self.state, self.layout.units + 8 * v)
        return (fits & near(slope, suggested)) | ~split

    def _norm(self, n: Index) -> Operand:
        row, largest = self.series.row(n), self.code.zero
        for v in self.series.vectors:
            largest = self.code.larger(self.code.absolute(self.code.load(row, self.layout.value(v))), largest)
        return self.code.largest(largest)

    def _length(self, order: Operand, start: Operand) -> Operand:
        """h > 0, from log2 |y_0| and the last two coefficients."""

        def radius(n: Operand) -> Operand:
            return (start - log2(self._norm(n))) / n.to_double()

        radii = radius(order), radius(order - 1)
        return step_length(self.code, radii, self.time(REACH))

    def _sum(self, order: Operand, low_order: Operand, step: Operand) -> list[Pair]:
        """Σ y_n h^n: four sums in h^4 side by side, each from its highest order, then those of h^2 and h."""
        code, series = self.code, self.series
        square = step * step
        h, h2, h4 = code.spread(step), code.spread(square), code.spread(square * square)
        top, low_top = order.unsigned_shift(2), low_order.unsigned_shift(2)
        quarters = [(i, v) for i in range(4) for v in series.vectors]

        def row(k: Operand, i: int) -> Operand:
            return series.row((k << 2) + i)

        def plain(k: Operand, sums: list[Operand]) -> list[Operand]:
            at = top - k
            return [
                code.fma(total, h4, code.load(row(at, i), self.layout.value(v)))
                for total, (i, v) in zip(sums, quarters, strict=True)
            ]

        def pairs(k: Operand, words: list[Operand]) -> list[Operand]:
            at = low_top - k
            sums: list[Operand] = []
            for index, (i, v) in enumerate(quarters):
                total = times(code, (words[2 * index], words[2 * index + 1]), h4)
                sums += add(code, total, series.pair(row(at, i), self.layout.value(v)))
            return sums

        sums = code.loop(0, top - low_top, plain, [code.zero] * len(quarters))
        words = code.loop(0, low_top + 1, pairs, [w for s in sums for w in (s, code.zero)])
        quarter = {offset: (words[2 * k], words[2 * k + 1]) for k, offset in enumerate(quarters)}
        result = []
        for v in series.vectors:
            even = add(code, times(code, quarter[2, v], h2), quarter[0, v])
            odd = add(code, times(code, quarter[3, v], h2), quarter[1, v])
            result.append(code.quick_two_sum(*add(code, times(code, odd, h), even)))
        return result

    def _judge(self, length: Operand, low_order: Operand, start: Operand, result: list[Pair]) -> Operand:
        """Whether the step is accepted; sets the status, and the n0 of the next step."""
        code = self.code
        time, room = self.time(TIME), self.time(ROOM)
        finite = code.true
        for pair in result:
            finite &= code.finite(pair[0]) & code.finite(pair[1])
        moves = time + length > time
        status = code.select(finite, code.select(moves, OK, TOO_SMALL), NON_FINITE)
        self.set_count(status, STATUS)
        above = self._rounding(low_order + 1, length, start)
        below = self._rounding(low_order, length, start)
        can_rise = low_order < self.count(MOST)
        can_fall = low_order > self.count(LEAST)
        rise = (above > room) & can_rise
        fall = (below < room - _HYSTERESIS) & can_fall
        next_order = code.select(rise, low_order + 1, code.select(fall, low_order - 1, low_order))
        self.set_count(next_order, LOW_ORDER)
        again = (above > room + _TOLERATED) & can_rise
        return ~again & (status == OK)

    def _follow(self, good: Operand, fits: Operand, units: list[Operand], slope: Operand) -> None:
        """Store the units of an accepted step, and the number of tries of the next."""
        code, b = self.code, self.code.builder
        tries = self.count(TRIES)
        with b.if_then(good):
            self.set_count(tries, USED_TRIES)
            self.set_count(slope, USED_SLOPE)
            for v, unit in enumerate(units):
                code.store(unit, self.state, self.layout.units + 8 * (len(units) + v))
        again = code.select(fits, tries, tries + 1)
        self.set_count(code.select(good, 0, again), TRIES)

    def _rounding(self, n: Operand, length: Operand, start: Operand) -> Operand:
        """log2 of |y_n| h^n / |y_0|."""
        power = n.to_double() * log2(length)
        return log2(self._norm(n)) + power - start

    def _accept(self, good: Operand, length: Operand, low_order: Operand, result: list[Pair]) -> None:
        code, b = self.code, self.code.builder
        time, low = self.time(TIME), self.time(TIME_LOW)
        with b.if_then(good):
            for vector, pair in enumerate(result):
                for word in range(2):
                    code.store(pair[word], self.state, 16 * vector + 8 * word)
            total, low_word = later(code, (time, low), length)
            for value, offset in ((time, BEGAN), (low, BEGAN_LOW), (total, TIME), (low_word, TIME_LOW)):
                code.store_one(value, self.clock, offset)
            self.set_count(low_order, USED)
