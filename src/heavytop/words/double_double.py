"""Taylor steps in double-double arithmetic (106 bits), with fewer bits from some order on.

The coefficients y_n of a motion fall with n.  From some order on split coefficients are exact enough
(:mod:`heavytop.words.split_orders`), and the low words of all above some n0 < N are too small to matter: there the
recurrence goes on in plain doubles.  n0 follows the motion: a step is done again with a larger one where
2^-53 |y_(n0+1)| h^(n0+1) comes out above what is allowed, and n0 falls where a smaller one would do.

The step is h = ρ exp(reach), with the radius ρ from the last two coefficients as Jorba and Zou have it (Exp. Math. 14
(2005) 99); its significand is cut to ten bits, so that h^4 is a double and h adds to the time exactly.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir

from heavytop.top.equations import System
from heavytop.words.lanes import turned
from heavytop.words.machine import DOUBLES, INTEGERS, Machine, Processor, compiled
from heavytop.words.pairs import add, covered, later, log2, polynomial, step_length, times
from heavytop.words.recurrence import Layout, Recurrence
from heavytop.words.split_orders import MOST_TRIES, SplitOrders, first_split, judged, near, slope_of, splits
from heavytop.words.stepping import Stepping
from heavytop.words.vector import DOUBLE, INT, INT_POINTER, POINTER, Index, Pair, function

TIME, TIME_LOW, TARGET, TARGET_LOW, BEGAN, BEGAN_LOW, SIGN, ROOM, REACH, DEPTH, CLOCK = range(11)
"""Places of the clock, doubles: |time| and its target and the beginning of the last step, in two words each; the
direction; log2 of the rounding allowed above n0, in units of 2^-53; log2 of h/ρ; log2 of what the products of the units
of split coefficients may be beside the state."""
ORDER, LOW_ORDER, LEAST, MOST, STATUS, USED, TRIES, SLOPE, USED_TRIES, USED_SLOPE, COUNTS = range(11)
"""Places of the counts: N, n0 of the next step, bounds of n0, how the last step ended, its n0; how often the next step
was tried in split coefficients, and the slope of their units; the same of the last step."""
FINE, NON_FINITE, TOO_SMALL = range(3)
_HYSTERESIS = 3.0
_TOLERATED = 1.0


def build(system: System, attitude: bool, processor: Processor | None = None) -> tuple[Machine, Layout]:
    """``advance`` and ``samples`` for this system.

    advance(state, clock, counts, table, scratch, steps): at most so many steps, until the time covers the target; gives
    their number.  The scratch holds the coefficients of the last one.
    samples(scratch, order, times, first, last, began, low, sign, result): the polynomial of the last step at the times
    from first to before last, a row of the result each.  The step began at began + low; times − began are doubles.
    """
    module = ir.Module("double_double")
    layout = Layout(2 if attitude else 1, len(turned(system)))
    _Step(module, layout, system).write()
    _write_samples(module, layout, system)
    integer, double = ctypes.c_int64, ctypes.c_double
    machine = compiled(
        module,
        {
            "advance": (integer, [DOUBLES, DOUBLES, INTEGERS, DOUBLES, DOUBLES, integer]),
            "samples": (None, [DOUBLES, integer, DOUBLES, integer, integer, double, double, double, DOUBLES]),
        },
        processor,
    )
    return machine, layout


def _write_samples(module: ir.Module, layout: Layout, system: System) -> None:
    arguments = [POINTER, INT, POINTER, INT, INT, DOUBLE, DOUBLE, DOUBLE, POINTER]
    made, code = function(module, "samples", ir.VoidType(), arguments)
    scratch, order, times, first, last, began, low, sign, result = made.args
    b = code.builder
    rows = Recurrence(code, layout, system, None, scratch)

    def row(n: Any) -> list[Pair]:
        at = rows.row(n)
        return [rows.pair(at, layout.value(v)) for v in rows.vectors]

    def one(place: Any, _: list[Any]) -> None:
        behind = b.fsub(b.load(code.address(times, place)), began)
        pair = code.two_sum(behind, b.fneg(low))
        at = [code.spread(b.fmul(word, sign)) for word in pair]
        words = polynomial(code, order, (at[0], at[1]), layout.vectors, row)
        begin = b.mul(place, code.integer(16 * layout.vectors))
        for index, word in enumerate(words):
            code.store(word, result, b.add(begin, code.integer(8 * index)))

    code.loop(first, last, one, [])
    b.ret_void()


class _Step(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, layout: Layout, system: System) -> None:
        arguments = [POINTER, POINTER, INT_POINTER, POINTER, POINTER, INT]
        made, code = function(module, "advance", INT, arguments)
        self.state, clock, counts, table, scratch, most = made.args
        super().__init__(code, clock, counts, most, STATUS)
        self.layout = layout
        self.series = Recurrence(self.code, layout, system, table, scratch)

    def covered(self) -> Any:
        time, low, target, target_low = (self.time(k) for k in (TIME, TIME_LOW, TARGET, TARGET_LOW))
        return covered(self.code, (time, low), (target, target_low))

    def write_step(self) -> Any:
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

    def _orders(self, first: list[Pair], start: Any, units: list[Any], slope: Any) -> tuple[Any, list[Any]]:
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

    def _units_fit(self, split: Any, units: list[Any], slope: Any, largest: list[Any], length: Any) -> Any:
        """Whether the units of split coefficients were good, a bit; puts those of what comes next."""
        code, b = self.code, self.code.builder
        fits, following = judged(code, units, largest)
        asked = slope_of(code, self.time(REACH), length)
        self.set_count(asked, SLOPE)
        for v, unit in enumerate(following):
            code.store(unit, self.state, self.layout.units + 8 * v)
        return b.or_(b.and_(fits, near(code, slope, asked)), b.not_(split))

    def _norm(self, n: Index) -> Any:
        row, found = self.series.row(n), self.code.zero
        for v in self.series.vectors:
            found = self.code.larger(self.code.absolute(self.code.load(row, self.layout.value(v))), found)
        return self.code.largest(found)

    def _length(self, order: Any, start: Any) -> Any:
        """h > 0, from log2 |y_0| and the last two coefficients."""
        b = self.code.builder

        def radius(n: Any) -> Any:
            return b.fdiv(b.fsub(start, log2(self.code, self._norm(n))), b.sitofp(n, DOUBLE))

        radii = radius(order), radius(b.sub(order, self.code.integer(1)))
        return step_length(self.code, radii, self.time(REACH))

    def _sum(self, order: Any, low_order: Any, step: Any) -> list[Pair]:
        """Σ y_n h^n: four sums in h^4 side by side, each from its highest order, then those of h^2 and h."""
        code, b, series, two = self.code, self.code.builder, self.series, self.code.integer(2)
        square = b.fmul(step, step)
        h, h2, h4 = code.spread(step), code.spread(square), code.spread(b.fmul(square, square))
        top, low_top = b.lshr(order, two), b.lshr(low_order, two)
        places = [(i, v) for i in range(4) for v in series.vectors]

        def row(k: Any, i: int) -> Any:
            return series.row(b.add(b.shl(k, two), code.integer(i)))

        def plain(k: Any, sums: list[Any]) -> list[Any]:
            at = b.sub(top, k)
            return [
                code.fma(total, h4, code.load(row(at, i), self.layout.value(v)))
                for total, (i, v) in zip(sums, places, strict=True)
            ]

        def pairs(k: Any, words: list[Any]) -> list[Any]:
            at = b.sub(low_top, k)
            found: list[Any] = []
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

    def _judge(self, length: Any, low_order: Any, start: Any, result: list[Pair]) -> Any:
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

    def _follow(self, good: Any, fits: Any, units: list[Any], slope: Any) -> None:
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

    def _rounding(self, n: Any, length: Any, start: Any) -> Any:
        """log2 of |y_n| h^n / |y_0|."""
        b = self.code.builder
        power = b.fmul(b.sitofp(n, DOUBLE), log2(self.code, length))
        return b.fsub(b.fadd(log2(self.code, self._norm(n)), power), start)

    def _accept(self, good: Any, length: Any, low_order: Any, result: list[Pair]) -> None:
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
