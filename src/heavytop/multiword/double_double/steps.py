"""Taylor steps in double-double arithmetic (106 bits), with fewer bits from some order on.

The coefficients y_n of a motion fall with n.  From some order on split coefficients are exact enough, and the low words
of all above some n0 < N are too small to matter: there the recurrence goes on in plain doubles.  n0 follows the motion:
a step is done again with a larger one where 2^-53 |y_(n0+1)| h^(n0+1) comes out above what is allowed, and n0 falls
where a smaller one would do.

The step is h = ρ exp(reach), with the radius ρ from the last two coefficients as Jorba and Zou have it (Exp. Math. 14
(2005) 99); its significand is cut to ten bits, so that h^4 is a double and h adds to the time exactly.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass

from llvmlite import ir

from heavytop.multiword.codegen.machine_code import (
    DOUBLE,
    DOUBLES,
    INT,
    INT_POINTER,
    INT_VECTOR,
    INTEGERS,
    LANES,
    POINTER,
    Code,
    Index,
    Machine,
    Pair,
    Processor,
    Stepping,
    Value,
    compiled,
    function,
)
from heavytop.multiword.codegen.recurrence import LEFT, RIGHT, Layout, Recurrence, turned
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

# Taylor orders between those in double-double and those in plain doubles: coefficients split in two.
#
# y_m = a + b, where a is a multiple of a unit 2^e_m and |y_m| <= 2^21 units, and b a double of half a unit at most.
# But for its rounding e_m is linear in m, so that the products of series that make S_n have a common unit: products and
# sums of a are exact in plain doubles.  With L = a + b, and R likewise,
#
#     S_n = Σ a_m a_(n−m) + Σ (a_m b_(n−m) + b_m R_(n−m)),
#
# three operations a product instead of the ten of double-double.  The error is some 2^-72 of the largest products:
# enough where y_n h^n lies as far below the state as that is above what is asked.
#
# The units follow the motion from step to step.  A step whose coefficients exceed them, or use few bits of them only,
# is done again with others.


UNIT_BITS = 21
"""|y_m| is 2^21 units at most, so that L and R are 2^22 at most.  Rounding e_m may halve the common unit of 61
products, and the field adds up to four of their sums: 2^44 · 2 · 61 · 4 < 2^53 units, which doubles hold exactly."""
SLOPE_BITS = 16
"""e_m = e_0 + m slope, the slope in units of 2^-16."""
_MOST_UNIT_BITS, STEEPEST = 400, 8
"""|e_0| and |slope| at most."""
_SPARSE, _ROOM = 2.0**-6, 8.0
"""The part of 2^21 units that a step uses at least; the next has between four and eight times what this one needed."""
SLACK, TOLERATED_SLOPE = 0.25, 0.375
"""What the slope exceeds log2 of the inverse radius by, and what it may have too much beside that."""
MOST_TRIES = 3
_FRACTION_BITS, _BIAS = 52, 1023
_EXPONENT = ((1 << 11) - 1) << _FRACTION_BITS
# the bits of 1.5 · 2^52 units and of the inverse of 2^21 units add to this
_SCALES = (2 * _BIAS + _FRACTION_BITS - UNIT_BITS << _FRACTION_BITS) + (1 << (_FRACTION_BITS - 1))
FIRST_UNITS = 1.5 * 2.0 ** (_FRACTION_BITS - UNIT_BITS + 1)
LOG2_OF_A_UNIT = math.log2(1.5) + _FRACTION_BITS
# Ω, γ
_ROUND = ([1, 2, 0, 4, 5, 3, 6, 7], [2, 0, 1, 5, 3, 4, 6, 7])


def splits(code: Code, units: list[Value], slope: Value) -> Value:
    """Whether there are such units, a bit; units: 1.5 · 2^52 of them, lane by lane."""
    b = code.builder
    steepest = STEEPEST << SLOPE_BITS
    found = b.icmp_unsigned("<", b.add(slope, code.integer(steepest)), code.integer(2 * steepest))
    for unit in units:
        found = b.and_(found, code.all_of(in_range(code, unit)))
    return found


def in_range(code: Code, unit: Value) -> Value:
    """Whether 1.5 · 2^52 units are far from the ends of the exponents of doubles, lane by lane."""
    low, high = (code.constant(2.0 ** (_FRACTION_BITS + sign * _MOST_UNIT_BITS)) for sign in (-1, 1))
    return code.builder.and_(code.builder.fcmp_ordered(">", unit, low), code.builder.fcmp_ordered("<", unit, high))


def next_unit(code: Code, unit: Value, peak: Value) -> tuple[Value, Value]:
    """Whether the units of a step were good, and those of the next, lane by lane.

    unit: 1.5 · 2^52 of them.  peak: the largest |y_m| 2^(e_0 - e_m).
    """
    b = code.builder
    # the inverse of 2^21 units of y_0
    inverse = b.sub(_all(_SCALES), b.bitcast(unit, INT_VECTOR))
    used = code.multiply(peak, b.bitcast(inverse, peak.type))
    nothing = b.fcmp_ordered("==", used, code.zero)
    fits = b.and_(b.fcmp_ordered("<=", used, code.constant(1.0)), b.fcmp_ordered(">=", used, code.constant(_SPARSE)))
    power = b.bitcast(b.and_(b.bitcast(used, INT_VECTOR), _all(_EXPONENT)), used.type)
    factor = b.select(nothing, code.constant(1.0), code.multiply(power, code.constant(_ROOM)))
    return b.or_(nothing, fits), code.multiply(unit, factor)


def rises(code: Code, m: Value, slope: Value) -> Pair:
    """2^(e_m - e_0) and its inverse, lane by lane, for slopes that are doubles."""
    b = code.builder
    rounded = code.fma(code.spread(b.sitofp(m, DOUBLE)), slope, code.constant(1.5 * 2.0**_FRACTION_BITS))
    shift = b.shl(b.bitcast(rounded, INT_VECTOR), _all(_FRACTION_BITS))
    one = _all(_BIAS << _FRACTION_BITS)
    return b.bitcast(b.add(one, shift), slope.type), b.bitcast(b.sub(one, shift), slope.type)


def parts(code: Code, y: Pair, big: Value) -> Pair:
    """y as a multiple of a unit and the rest; big: 1.5 · 2^52 units."""
    coarse = code.subtract(code.add(y[0], big), big)
    return coarse, code.add(code.subtract(y[0], coarse), y[1])


def quotient(code: Code, first: Pair | None, factors: list[tuple[Constant, Pair]], divisor: Pair) -> Pair:
    """The sum of a pair and of products of a constant and a pair, over an integer; in order.

    divisor: the number and its inverse.
    """
    high, low = first or (None, None)
    for constant, factor in factors:
        product, error = code.two_product(constant[0], factor[0])
        rest = code.fma(constant[0], factor[1], code.fma(constant[1], factor[0], error))
        if high is None:
            high, low = product, rest
        else:
            high, lost = code.two_sum(high, product)
            low = code.add(low, code.add(rest, lost))
    whole, inverse = divisor
    found = code.multiply(high, inverse)
    rest = code.add(code.fma(code.negative(found), whole, high), low)
    return code.quick_two_sum(found, code.multiply(rest, inverse))


def first_split(code: Code, units: list[Value], slope: Value, reach: Value, depth: Value) -> Value:
    """The order from which split coefficients are exact enough, an integer.

    depth: log2 of the state and how many bits below it the products of the units of Ω and the largest may be.
    """
    b = code.builder
    lanes = [(units[0], 0), *((unit, 3) for unit in units)]
    found = [b.bitcast(b.extract_element(unit, ir.Constant(ir.IntType(32), lane)), INT) for unit, lane in lanes]
    largest = found[0]
    for bits in found[1:]:
        largest = b.select(b.icmp_signed(">", bits, largest), bits, largest)
    both = b.add(b.lshr(found[0], code.integer(_FRACTION_BITS)), b.lshr(largest, code.integer(_FRACTION_BITS)))
    units_bits = b.fsub(b.sitofp(both, DOUBLE), ir.Constant(DOUBLE, 2.0 * (_BIAS + _FRACTION_BITS)))
    length = b.fsub(reach, b.fmul(b.sitofp(slope, DOUBLE), ir.Constant(DOUBLE, 2.0**-SLOPE_BITS)))
    fall = b.fsub(ir.Constant(DOUBLE, -SLACK), reach)
    orders = b.fdiv(b.fsub(b.fadd(units_bits, length), depth), fall)
    least = ir.Constant(DOUBLE, 1.0)
    bounded = b.select(b.fcmp_ordered(">", orders, least), orders, least)
    most = ir.Constant(DOUBLE, 1000.0)
    return b.fptosi(b.select(b.fcmp_ordered("<", bounded, most), bounded, most), INT)


def judged(code: Code, units: list[Value], largest: list[Value]) -> tuple[Value, list[Value]]:
    """Whether the units of a step were good, a bit, and those of the next.

    largest: |y_m| 2^(e_0 - e_m), lane by lane.
    """
    b = code.builder
    good, following = ir.Constant(ir.IntType(1), 1), []
    for unit, lanewise in zip(units, largest, strict=True):
        peak = lanewise
        for lanes in _ROUND:
            peak = code.larger(peak, code.shuffle(lanewise, code.zero, lanes))
        fits, after = next_unit(code, unit, peak)
        good = b.and_(good, code.all_of(fits))
        following.append(after)
    return good, following


def near(code: Code, slope: Value, asked: Value) -> Value:
    """Whether units that rise with ``slope`` are fine enough where ``asked`` is wanted, a bit."""
    b = code.builder
    return b.icmp_signed("<", b.sub(slope, asked), code.integer(int(TOLERATED_SLOPE * 2**SLOPE_BITS)))


def slope_of(code: Code, reach: Value, length: Value) -> Value:
    """The slope that goes with a step of this length: log2 of the inverse radius of convergence, and a little more."""
    b = code.builder
    value = b.fadd(b.fsub(reach, log2(code, length)), ir.Constant(DOUBLE, SLACK + 2.0 * _BIAS))
    scaled = b.fptosi(b.fmul(value, ir.Constant(DOUBLE, 2.0**SLOPE_BITS)), INT)
    return b.sub(scaled, code.integer(2 * _BIAS << SLOPE_BITS))


@dataclass(frozen=True, slots=True)
class SplitOrders:
    """Writes the orders in split coefficients.

    units: 1.5 · 2^52 units of y_0, lane by lane, for each vector.  zero_row: a row of zeros.
    """

    series: Recurrence
    units: list[Value]
    slope: Value
    zero_row: Value

    def begin(self, last: Value) -> list[Value]:
        """Split y_0 to y_last; gives the largest |y_m| 2^(e_0 - e_m), lane by lane."""
        series = self.series

        def one(m: Value, largest: list[Value]) -> list[Value]:
            row = series.row(m)
            y = [series.pair(row, series.layout.value(v)) for v in series.vectors]
            return self._put(m, y, largest)[-len(largest) :]

        stop = series.code.builder.add(last, series.code.integer(1))
        return series.code.loop(0, stop, one, [series.code.zero for _ in series.vectors])

    def orders(
        self, start: Value, stop: Value, last: list[Value], largest: list[Value]
    ) -> tuple[list[Value], list[Value]]:
        """y_(start+1) to y_stop; gives the words of the last, and the largest |y_m| as :meth:`begin` does."""
        code, series, width = self.series.code, self.series, len(self.series.vectors)

        def order(n: Value, values: list[Value]) -> list[Value]:
            words, sides = values[: 2 * width], values[2 * width : -width]
            products = self._products(n, sides)
            following = [self._next(n, v, sums, (words[2 * v], words[2 * v + 1])) for v, sums in enumerate(products)]
            after = code.builder.add(n, code.integer(1))
            row = series.row(after)
            for v, pair in enumerate(following):
                for word in range(2):
                    code.store(pair[word], row, series.layout.value(v) + 8 * word)
            return [*(word for pair in following for word in pair), *self._put(after, following, values[-width:])]

        row = series.row(start)
        sides = [code.load(row, place) for place in self._places]
        values = code.loop(start, stop, order, [*last, *sides, *largest])
        return values[: 2 * width], values[-width:]

    @property
    def _places(self) -> list[int]:
        """Where R and its parts are in a row, and the parts of each L."""
        lefts = (self.series.layout.left(v) for v in self.series.vectors)
        return [0, 16, 24, *(place + k for place in lefts for k in (16, 24))]

    def _rise(self, m: Value) -> Pair:
        """2^(e_m - e_0) and its inverse."""
        code, b = self.series.code, self.series.code.builder
        half = code.integer(1 << (SLOPE_BITS - 1))
        rise = b.ashr(b.add(b.mul(m, self.slope), half), code.integer(SLOPE_BITS))
        shifts = [b.shl(b.add(code.integer(_BIAS), part), code.integer(_FRACTION_BITS)) for part in (rise, b.neg(rise))]
        up, down = (code.spread(b.bitcast(shift, DOUBLE)) for shift in shifts)
        return up, down

    def _put(self, m: Value, y: list[Pair], largest: list[Value]) -> list[Value]:
        """Split both sides of order m and store them; gives R and its parts, the parts of each L, and the largest |y|
        2^(e_0 - e_m), this one with it.
        """
        code, series = self.series.code, self.series
        row, sides, peaks = series.row(m), list[Value](), []
        up, down = self._rise(m)
        for v in series.vectors:
            big = code.multiply(self.units[v], up)
            peaks.append(code.larger(code.absolute(code.multiply(y[v][0], down)), largest[v]))
            split = parts(code, y[v], big)
            right = [series.side(part, RIGHT) for part in split] if v == 0 else []
            left = [series.side(part, LEFT) for part in split]
            for part, place in ((right, 0), (left, series.layout.left(v))):
                if part:
                    sides += [code.add(*part), *part][place > 0 :]
                    code.store(code.add(*part), row, place)
                    for k, word in enumerate(part):
                        code.store(word, row, place + 16 + 8 * k)
        return sides + peaks

    def _products(self, n: Value, sides: list[Value]) -> list[Pair]:
        """Σ L_m R_(n−m) of each vector: the exact sums of the coarse parts, and the rest."""
        code, b, width = self.series.code, self.series.code.builder, len(self.series.vectors)
        one = code.integer(1)

        def row(m: Index) -> list[Value]:
            at = self.series.row(m)
            return [code.load(at, place) for place in self._places]

        def both(m: Value, sums: list[Value]) -> list[Value]:
            one, other = row(m), row(b.sub(n, m))
            return self._added(one, other, sums[: 3 * width]) + self._added(other, one, sums[3 * width :])

        sums = code.loop(1, b.lshr(b.add(n, one), one), both, [code.zero] * (6 * width))
        odd = b.icmp_unsigned("!=", b.and_(n, one), code.integer(0))
        middle, start = row(b.select(odd, self.zero_row, b.lshr(n, one))), row(0)
        first, second = self._added(middle, middle, sums[: 3 * width]), sums[3 * width :]
        first, second = self._added(start, sides, first), self._added(sides, start, second)
        total = [code.add(x, y) for x, y in zip(first, second, strict=True)]
        return [(total[3 * v], code.add(total[3 * v + 1], total[3 * v + 2])) for v in self.series.vectors]

    def _added(self, one: list[Value], other: list[Value], sums: list[Value]) -> list[Value]:
        """Three sums of each vector, with the products of L of one order and R of another."""
        whole, coarse, fine = other[:3]
        found = []
        for v in self.series.vectors:
            a, rest = one[3 + 2 * v : 5 + 2 * v]
            for left, right, total in zip((a, a, rest), (coarse, fine, whole), sums[3 * v : 3 * v + 3], strict=True):
                found.append(self.series.code.fma(left, right, total))
        return found

    def _next(self, n: Value, vector: int, sums: Pair, y: Pair) -> Pair:
        """y_(n+1) = (A ∘ gathered S_n + Σ B ∘ permuted y_n)/(n + 1)."""
        code, series = self.series.code, self.series
        factors = [(series.constant(vector, 0), (series.gathered(sums[0]), series.gathered(sums[1])))]
        for k, lanes in enumerate(turned(series.system), 1):
            moved = [code.shuffle(word, code.zero, lanes) for word in y]
            factors.append((series.constant(vector, k), (moved[0], moved[1])))
        return quotient(code, None, factors, series.divisor(n))


def _all(value: int) -> Value:
    return ir.Constant(INT_VECTOR, [ir.Constant(INT, value)] * LANES)


TIME, TIME_LOW, TARGET, TARGET_LOW, BEGAN, BEGAN_LOW, SIGN, ROOM, REACH, DEPTH, CLOCK = range(11)
"""Places of the clock, doubles: |time| and its target and the beginning of the last step, in two words each; the
direction; log2 of the rounding allowed above n0, in units of 2^-53; log2 of h/ρ; log2 of what the products of the units
of split coefficients may be beside the state."""
ORDER, LOW_ORDER, LEAST, MOST, STATUS, USED, TRIES, SLOPE, USED_TRIES, USED_SLOPE, COUNTS = range(11)
"""Places of the counts: N, n0 of the next step, bounds of n0, how the last step ended, its n0; how often the next step
was tried in split coefficients, and the slope of their units; the same of the last step."""
FINE, NON_FINITE, TOO_SMALL = range(3)
AT_ONCE = 4
"""Samples that are taken side by side: the operations of one wait for each other."""
_HYSTERESIS = 3.0
_TOLERATED = 1.0


def build(system: System, attitude: bool, processor: Processor | None = None) -> tuple[Machine, Layout]:
    """``advance``, ``sample`` and ``follow`` for this system.

    advance(state, clock, counts, table, scratch, steps): at most so many steps, until the time covers the target; gives
    their number.  The scratch holds the coefficients of the last one.
    sample(scratch, n0, order, high, low, result): the polynomial of the last step at a time behind its beginning.
    follow(state, clock, counts, table, scratch, highs, lows, progress, times, steps, result): steps and a row of the
    result for each time that they cover, until all are or so many steps are taken.  The times |τ| > 0 in two words.
    progress: times and steps done; it ends, too, at a time whose distance from the beginning of its step takes exact
    numbers.
    """
    module = ir.Module("double_double")
    layout = Layout(2 if attitude else 1, len(turned(system)))
    advance = _Step(module, layout, system)
    advance.write()
    _write_sample(module, layout, system)
    _Follow(module, layout, system, advance.made).write()
    integer, double = ctypes.c_int64, ctypes.c_double
    machine = compiled(
        module,
        {
            "advance": (integer, [DOUBLES, DOUBLES, INTEGERS, DOUBLES, DOUBLES, integer]),
            "sample": (None, [DOUBLES, integer, integer, double, double, DOUBLES]),
            "follow": (None, [*[DOUBLES] * 2, INTEGERS, *[DOUBLES] * 4, INTEGERS, integer, integer, DOUBLES]),
        },
        processor,
    )
    return machine, layout


def _write_sample(module: ir.Module, layout: Layout, system: System) -> None:
    made, code = function(module, "sample", ir.VoidType(), [POINTER, INT, INT, DOUBLE, DOUBLE, POINTER])
    scratch, low_order, order, high, low, result = made.args
    _put_samples(Recurrence(code, layout, system, None, scratch), (low_order, order), [(high, low)], result)
    code.builder.ret_void()


def _put_samples(rows: Recurrence, orders: Pair, times: Sequence[Pair], result: Value) -> None:
    """The polynomial of the last step, at times behind its beginning; a row of the result for each.

    orders: its n0, above which doubles are enough here as they are in the sum at the end of the step, and its N.
    """

    def row(n: Value) -> list[Pair]:
        place = rows.row(n)
        return [rows.pair(place, rows.layout.value(v)) for v in rows.vectors]

    spread = [(rows.code.spread(high), rows.code.spread(low)) for high, low in times]
    words = [word for sample in polynomials(rows.code, orders, spread, len(rows.vectors), row) for word in sample]
    for index, word in enumerate(words):
        rows.code.store(word, result, 8 * index)


class _Follow:
    """Writes ``follow``."""

    def __init__(self, module: ir.Module, layout: Layout, system: System, advance: Value) -> None:
        kinds = [POINTER, POINTER, INT_POINTER, *[POINTER] * 4, INT_POINTER, INT, INT, POINTER]
        made, self.code = function(module, "follow", ir.VoidType(), kinds)
        self.arrays, (highs, lows, self.progress, self.count, self.most, self.result) = made.args[:5], made.args[5:]
        self.times, self.advance, self.layout = (highs, lows), advance, layout
        self.rows = Recurrence(self.code, layout, system, None, self.arrays[-1])

    def write(self) -> None:
        """The loop over times and steps."""
        code, b = self.code, self.code.builder
        head, inside, step, sample, one, out = map(b.append_basic_block, ("head", "in", "step", "at", "one", "out"))
        b.branch(head)
        b.position_at_end(head)
        done, taken = (self._word(self.progress, place) for place in range(2))
        running = b.icmp_signed("==", self._word(self.arrays[2], STATUS), code.integer(0))
        left = b.and_(b.icmp_signed("<", done, self.count), b.icmp_signed("<", taken, self.most))
        b.cbranch(b.and_(running, left), inside, out)
        b.position_at_end(inside)
        b.cbranch(self._covered(done), sample, step)
        b.position_at_end(step)
        for word, place in zip(self._target(done), (TARGET, TARGET_LOW), strict=True):
            b.store(word, code.address(self.arrays[1], place))
        more = b.call(self.advance, [*self.arrays, b.sub(self.most, taken)])
        b.store(b.add(taken, more), code.address(self.progress, 1))
        b.branch(head)
        b.position_at_end(sample)
        self._put(done, AT_ONCE, head, one)
        b.position_at_end(one)
        self._put(done, 1, head, out)
        b.position_at_end(out)
        b.ret_void()

    def _put(self, done: Value, count: int, head: Value, otherwise: Value) -> None:
        """Put so many rows of the result, of which those count whose times are covered, and go to the head; or nothing,
        where one of these times takes exact numbers.
        """
        code, b = self.code, self.code.builder
        began, put = (self._clock(BEGAN), self._clock(BEGAN_LOW)), b.append_basic_block("put")
        sure, times, end = ir.Constant(ir.IntType(1), 1), [], done
        for k in range(count):
            place = code.least(b.add(done, code.integer(k)), b.sub(self.count, code.integer(1)))
            at, known = behind(code, self._target(place), began, self._clock(SIGN))
            is_covered = self._covered(place)
            sure = b.and_(sure, b.or_(known, b.not_(is_covered)))
            end = b.add(end, b.zext(is_covered, INT))
            times.append(at)
        b.cbranch(sure, put, otherwise)
        b.position_at_end(put)
        result = code.address(self.result, b.mul(done, code.integer(16 * self.layout.vectors)))
        low_order, order = (self._word(self.arrays[2], place) for place in (USED, ORDER))
        _put_samples(self.rows, (low_order, order), times, result)
        b.store(code.least(end, self.count), code.address(self.progress, 0))
        b.branch(head)

    def _target(self, place: Value) -> Pair:
        return self._word(self.times[0], place), self._word(self.times[1], place)

    def _covered(self, place: Value) -> Value:
        return covered(self.code, (self._clock(TIME), self._clock(TIME_LOW)), self._target(place))

    def _clock(self, place: int) -> Value:
        return self._word(self.arrays[1], place)

    def _word(self, array: Value, place: Value) -> Value:
        return self.code.builder.load(self.code.address(array, place))


class _Step(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, layout: Layout, system: System) -> None:
        arguments = [POINTER, POINTER, INT_POINTER, POINTER, POINTER, INT]
        self.made, code = function(module, "advance", INT, arguments)
        self.state, clock, counts, table, scratch, most = self.made.args
        super().__init__(code, clock, counts, most, STATUS)
        self.layout = layout
        self.series = Recurrence(self.code, layout, system, table, scratch)

    def covered(self) -> Value:
        time, low, target, target_low = (self.time(k) for k in (TIME, TIME_LOW, TARGET, TARGET_LOW))
        return covered(self.code, (time, low), (target, target_low))

    def write_step(self) -> Value:
        """One step; whether it stands."""
        order, low_order = self.count(ORDER), self.count(LOW_ORDER)
        first = [self.series.pair(self.state, 16 * v) for v in self.series.vectors]
        self.series.put(0, first)
        start = log2(self.code, self._norm(0))
        units = [self.code.load(self.state, self.layout.units + 8 * v) for v in self.series.vectors]
        slope = self.count(SLOPE)
        split, largest = self._orders(first, start, units, slope)
        length = self._length(order, start)
        result = self._sum(order, low_order, self.code.builder.fmul(length, self.time(SIGN)))
        fits = self._units_fit(split, units, slope, largest, length)
        good = self.code.builder.and_(self._judge(length, low_order, start, result), fits)
        self._follow(good, fits, units, slope)
        self._accept(good, length, low_order, result)
        return good

    def _orders(self, first: list[Pair], start: Value, units: list[Value], slope: Value) -> tuple[Value, list[Value]]:
        """y_1 to y_N; whether some are split, a bit, and the largest of their units."""
        code, b, series = self.code, self.code.builder, self.series
        order, low_order = self.count(ORDER), self.count(LOW_ORDER)
        tried = b.icmp_signed(">=", self.count(TRIES), code.integer(MOST_TRIES))
        wanted = first_split(code, units, slope, self.time(REACH), b.fadd(start, self.time(DEPTH)))
        split = b.and_(splits(code, units, slope), b.icmp_signed("<", wanted, low_order))
        split = b.and_(split, b.not_(tried))
        pair_order = b.select(split, wanted, low_order)
        words = series.orders_in_pairs(first, pair_order)
        parts = SplitOrders(series, units, slope, b.add(order, code.integer(1)))
        largest = parts.begin(b.select(split, pair_order, code.integer(-1)))
        words, largest = parts.orders(pair_order, low_order, words, largest)
        series.plain_orders(low_order, order, [words[2 * v] for v in series.vectors])
        return split, largest

    def _units_fit(self, split: Value, units: list[Value], slope: Value, largest: list[Value], length: Value) -> Value:
        """Whether the units of split coefficients were good, a bit; puts those of what comes next."""
        code, b = self.code, self.code.builder
        fits, following = judged(code, units, largest)
        asked = slope_of(code, self.time(REACH), length)
        self.set_count(asked, SLOPE)
        for v, unit in enumerate(following):
            code.store(unit, self.state, self.layout.units + 8 * v)
        return b.or_(b.and_(fits, near(code, slope, asked)), b.not_(split))

    def _norm(self, n: Index) -> Value:
        row, found = self.series.row(n), self.code.zero
        for v in self.series.vectors:
            found = self.code.larger(self.code.absolute(self.code.load(row, self.layout.value(v))), found)
        return self.code.largest(found)

    def _length(self, order: Value, start: Value) -> Value:
        """h > 0, from log2 |y_0| and the last two coefficients."""
        b = self.code.builder

        def radius(n: Value) -> Value:
            return b.fdiv(b.fsub(start, log2(self.code, self._norm(n))), b.sitofp(n, DOUBLE))

        radii = radius(order), radius(b.sub(order, self.code.integer(1)))
        return step_length(self.code, radii, self.time(REACH))

    def _sum(self, order: Value, low_order: Value, step: Value) -> list[Pair]:
        """Σ y_n h^n: four sums in h^4 side by side, each from its highest order, then those of h^2 and h."""
        code, b, series, two = self.code, self.code.builder, self.series, self.code.integer(2)
        square = b.fmul(step, step)
        h, h2, h4 = code.spread(step), code.spread(square), code.spread(b.fmul(square, square))
        top, low_top = b.lshr(order, two), b.lshr(low_order, two)
        places = [(i, v) for i in range(4) for v in series.vectors]

        def row(k: Value, i: int) -> Value:
            return series.row(b.add(b.shl(k, two), code.integer(i)))

        def plain(k: Value, sums: list[Value]) -> list[Value]:
            at = b.sub(top, k)
            return [
                code.fma(total, h4, code.load(row(at, i), self.layout.value(v)))
                for total, (i, v) in zip(sums, places, strict=True)
            ]

        def pairs(k: Value, words: list[Value]) -> list[Value]:
            at = b.sub(low_top, k)
            found: list[Value] = []
            for index, (i, v) in enumerate(places):
                total = times(code, (words[2 * index], words[2 * index + 1]), h4)
                found += add(code, total, series.pair(row(at, i), self.layout.value(v)))
            return found

        sums = code.loop(0, b.sub(top, low_top), plain, [code.zero] * len(places))
        words = code.loop(0, b.add(low_top, code.integer(1)), pairs, [w for s in sums for w in (s, code.zero)])
        quarter = {place: (words[2 * k], words[2 * k + 1]) for k, place in enumerate(places)}
        found = []
        for v in series.vectors:
            even = add(code, times(code, quarter[2, v], h2), quarter[0, v])
            odd = add(code, times(code, quarter[3, v], h2), quarter[1, v])
            found.append(code.quick_two_sum(*add(code, times(code, odd, h), even)))
        return found

    def _judge(self, length: Value, low_order: Value, start: Value, result: list[Pair]) -> Value:
        """Whether the step stands; sets the status, and the n0 of what comes next."""
        code, b, one = self.code, self.code.builder, self.code.integer(1)
        time, room = self.time(TIME), self.time(ROOM)
        finite = ir.Constant(ir.IntType(1), 1)
        for pair in result:
            finite = b.and_(finite, b.and_(code.finite(pair[0]), code.finite(pair[1])))
        moves = b.fcmp_ordered(">", b.fadd(time, length), time)
        status = b.select(moves, code.integer(FINE), code.integer(TOO_SMALL))
        status = b.select(finite, status, code.integer(NON_FINITE))
        self.set_count(status, STATUS)
        above = self._rounding(b.add(low_order, one), length, start)
        below = self._rounding(low_order, length, start)
        can_rise = b.icmp_signed("<", low_order, self.count(MOST))
        can_fall = b.icmp_signed(">", low_order, self.count(LEAST))
        rise = b.and_(b.fcmp_ordered(">", above, room), can_rise)
        fall = b.and_(b.fcmp_ordered("<", below, b.fsub(room, ir.Constant(DOUBLE, _HYSTERESIS))), can_fall)
        following = b.select(rise, b.add(low_order, one), b.select(fall, b.sub(low_order, one), low_order))
        self.set_count(following, LOW_ORDER)
        again = b.and_(b.fcmp_ordered(">", above, b.fadd(room, ir.Constant(DOUBLE, _TOLERATED))), can_rise)
        return b.and_(b.not_(again), b.icmp_signed("==", status, code.integer(FINE)))

    def _follow(self, good: Value, fits: Value, units: list[Value], slope: Value) -> None:
        """What split coefficients the step was done with, if it stands, and how often the next was tried."""
        code, b = self.code, self.code.builder
        tries = self.count(TRIES)
        with b.if_then(good):
            self.set_count(tries, USED_TRIES)
            self.set_count(slope, USED_SLOPE)
            for v, unit in enumerate(units):
                code.store(unit, self.state, self.layout.units + 8 * (len(units) + v))
        again = b.select(fits, tries, b.add(tries, code.integer(1)))
        self.set_count(b.select(good, code.integer(0), again), TRIES)

    def _rounding(self, n: Value, length: Value, start: Value) -> Value:
        """log2 of |y_n| h^n / |y_0|."""
        b = self.code.builder
        power = b.fmul(b.sitofp(n, DOUBLE), log2(self.code, length))
        return b.fsub(b.fadd(log2(self.code, self._norm(n)), power), start)

    def _accept(self, good: Value, length: Value, low_order: Value, result: list[Pair]) -> None:
        code, b = self.code, self.code.builder
        time, low = self.time(TIME), self.time(TIME_LOW)
        with b.if_then(good):
            for vector, pair in enumerate(result):
                for word in range(2):
                    code.store(pair[word], self.state, 16 * vector + 8 * word)
            total, rest = later(code, (time, low), length)
            for value, place in ((time, BEGAN), (low, BEGAN_LOW), (total, TIME), (rest, TIME_LOW)):
                b.store(value, code.address(self.clock, place))
            self.set_count(low_order, USED)
