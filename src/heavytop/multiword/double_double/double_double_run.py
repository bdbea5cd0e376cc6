"""One motion in double-double: the data of the machine code of :mod:`heavytop.multiword.double_double.steps`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

import numpy

from heavytop.multiword.codegen.machine_code import (
    LANES,
    Code,
    Doubles,
    Index,
    Operand,
    Pair,
    Processor,
    doubles,
    once,
    pointer,
)
from heavytop.multiword.codegen.recurrence import LEAST_LOW_ORDER, MOST_ORDER, ZERO, Layout, permutations
from heavytop.multiword.double_double import steps as dd
from heavytop.multiword.double_double.arithmetic import (
    Constant,
    accumulated,
    add,
    by_constant,
    divided,
    multiply,
    split,
    split_constant,
)
from heavytop.multiword.double_double.steps import FIRST_UNITS, SLACK, parts, quotient, rises
from heavytop.multiword.problem import ResumableRun, Scaled, Status
from heavytop.top.equations import System

BITS = 106
FALL_ALONE, FALL_IN_LANES = 1.3, 1.6
_MARGIN = 7.0
_DEEPEST = 84.0
_DOUBLE_BITS = 53
_ROUNDING_BITS = 4
_LEAST_ROOM, _LEAST_DEPTH = -66.0, -112.0
_SPLIT_BITS = 32
"""Bits by which the rounding error of S_n is below the product of its two units (measured)."""
_USUAL_UNITS = -34.0
"""log2 of the product of two units where the state is about 1."""
_NEVER = -1000.0
LARGEST_TIME = Fraction(2) ** 1000
SMALLEST_TIME = 1 / LARGEST_TIME
"""The least target: a smaller one would be 0 in two doubles, and no step would be taken."""
_STEPS_AT_ONCE, _SAMPLES_AT_ONCE = 1024, 2048
"""Steps and samples of a call: the words of the samples fit into a cache near the processor."""
PLACES = (*range(6), *range(19, 22))
"""Offsets of the first words of Ω, γ and ξ; the second follow 8 doubles later."""


@dataclass(frozen=True, slots=True)
class OrderSchedule:
    """The order of the series, the length of a step, and the orders kept in double-double.

    order: N.  reach: log2 of h/ρ.  room: log2 of the largest |y_n| h^n / |y_0| whose rounding to a double is allowed,
    at n0 + 1.  depth: log2 of what the products of two units h^n may be beside |y_0|, at the first n whose coefficients
    are split; none are split where it is very small.
    """

    order: int
    reach: float
    room: float
    depth: float = _NEVER

    @classmethod
    @lru_cache(maxsize=256)
    def of(cls, tolerance: Fraction, fall: float = FALL_ALONE) -> OrderSchedule:
        """The schedule for a local error of ``tolerance`` relative to the state.

        fall: of the logarithm of y_n h^n from one order to the next.  2 is best where N² products dominate the time
        (Jorba and Zou); a single motion waits for the last product of each order, so that high orders and long steps
        are faster.
        """
        log_tolerance = math.log(tolerance.numerator) - math.log(tolerance.denominator)
        # the truncation error has the same sign at every step: it must be below rounding noise after 10^7 steps
        finest = tolerance <= Fraction(1, 2 ** (BITS - 1))
        depth = _DEEPEST if finest else _MARGIN - log_tolerance
        order = min(math.ceil(depth / fall), MOST_ORDER - 2)
        reach = -(depth / order + 0.7 / (order - 1)) / math.log(2)
        room = max(_DOUBLE_BITS - depth / math.log(2) - _ROUNDING_BITS, _LEAST_ROOM)
        # roundings of split coefficients average out: the finest may be 2^6 times below those of double-double
        return cls(order, reach, room, max(room - _DOUBLE_BITS, _LEAST_DEPTH) + _SPLIT_BITS)

    def pair_order(self, low_order: int) -> int:
        """The first order that is split in eight motions with the same n0.

        It suits coefficients that fall as near a singularity, and rises with n0; with the largest n0 none are split.
        """
        if low_order >= self.order - 1:
            return low_order
        first = math.ceil(self.room / self.reach)
        usual = math.ceil((_USUAL_UNITS - self.depth) / -(self.reach + SLACK))
        return max(1, usual + (low_order - first) // 2)


machine = once(dd.build)
"""The machine code, compiled at its first use."""


class Floating(ResumableRun):
    """A motion that advances in double-double steps.

    low_order: n0 of the first step; None for the largest, from which it falls.
    """

    def __init__(
        self,
        problem: Scaled,
        schedule: OrderSchedule,
        forwards: bool,
        low_order: int | None = None,
        processor: Processor | None = None,
    ) -> None:
        attitude = len(problem.state) == 9
        self.machine, self.layout = machine(problem.system, attitude, processor), dd.layout_of(problem.system, attitude)
        self.problem, self.forwards = problem, forwards
        self.steps = 0
        self.words = doubles(self.layout.state)
        self.words[self.layout.units :] = FIRST_UNITS
        for offset, value in zip(PLACES, problem.state, strict=False):
            self.words[offset], self.words[offset + 8] = split(value)
        self.clock, self.counts = doubles(dd.CLOCK), numpy.zeros(dd.COUNTS, numpy.int64)
        self.clock[dd.SIGN] = 1.0 if forwards else -1.0
        self.clock[dd.ROOM] = schedule.room
        self.clock[dd.REACH] = schedule.reach
        most = schedule.order - 1
        self.counts[[dd.ORDER, dd.LOW_ORDER]] = schedule.order, low_order or most
        self.counts[[dd.LEAST, dd.MOST]] = LEAST_LOW_ORDER, most
        self.clock[dd.DEPTH] = schedule.depth
        self.table = _table(problem, schedule.order, self.layout)
        self.scratch = doubles((schedule.order + 5) * self.layout.row)
        self.found = doubles(16 * self.layout.vectors)
        self.sampling = [pointer(array) for array in (self.scratch, self.found)]

    @property
    def order(self) -> int:
        return int(self.counts[dd.ORDER])

    @property
    def time(self) -> Fraction:
        return self._time(dd.TIME)

    def _time(self, index: int) -> Fraction:
        return Fraction(self.clock[index]) + Fraction(self.clock[index + 1])

    @property
    def state(self) -> tuple[Fraction, ...]:
        return _exact_state(self.words, len(self.problem.state))

    def advance(self, target: Fraction, steps: int) -> Status:
        self.clock[dd.TARGET : dd.TARGET_LOW + 1] = split(max(SMALLEST_TIME, min(target, LARGEST_TIME)))
        arrays = [pointer(array) for array in (self.words, self.clock, self.counts, self.table, self.scratch)]
        taken = self.machine.functions["advance"](*arrays, steps)
        self.steps += taken
        return self.status

    def sample(self, time: Fraction) -> tuple[Fraction, ...]:
        return _exact_state(self.words_at(time), len(self.problem.state))

    def words_at(self, time: Fraction) -> Doubles:
        """The words of the state at ``time``, inside the last step."""
        behind = time - self._time(dd.BEGAN)
        series, words = self.sampling
        orders = int(self.counts[dd.USED]), self.order
        self.machine.functions["sample"](series, *orders, *split(behind if self.forwards else -behind), words)
        return self.found.copy()

    @property
    def status(self) -> Status:
        """The outcome of the last advance."""
        return Status(int(self.counts[dd.STATUS]))

    def sampled(self, highs: Doubles, lows: Doubles) -> Iterator[Doubles]:
        """Steps up to the last of the times |τ| > 0, ascending, in two words.

        Yields the words of states, a row each, many at a time, which the next chunk overwrites: the bits of single
        calls of :meth:`advance` and :meth:`sample`.
        """
        row, progress = 16 * self.layout.vectors, numpy.zeros(2, numpy.int64)
        samples = doubles(row * (min(len(highs), _SAMPLES_AT_ONCE) + dd.AT_ONCE))
        arrays_of_motion = [pointer(array) for array in (self.words, self.clock, self.counts, self.table, self.scratch)]
        for first in range(0, len(highs), _SAMPLES_AT_ONCE):
            times = [words[first : first + _SAMPLES_AT_ONCE] for words in (highs, lows)]
            arrays, count = [*arrays_of_motion, *map(pointer, times), pointer(progress)], len(times[0])
            progress[:] = 0
            while progress[0] < count and self.status is Status.OK:
                done, taken = progress
                self.machine.functions["follow"](*arrays, count, taken + _STEPS_AT_ONCE, pointer(samples))
                if self.status is Status.OK and tuple(progress) == (done, taken):  # a time that needs exact numbers
                    time = Fraction(times[0][done]) + Fraction(times[1][done])
                    samples[row * done : row * (done + 1)] = self.words_at(time)
                    progress[0] += 1
            self.steps += int(progress[1])
            yield samples[: row * progress[0]].reshape(-1, row)
            if self.status is not Status.OK:
                return

    def derivatives(self, n: int) -> tuple[Fraction, ...]:
        """y_n of the last step, as the exact values of its words; a step back in time has a negative length."""
        return _exact_state(self._row(n), len(self.problem.state))

    @property
    def length(self) -> Fraction:
        """h of the last step, negative back in time."""
        step = self.time - self._time(dd.BEGAN)
        return step if self.forwards else -step

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        power = self.length**n
        return tuple(value * power for value in self.derivatives(n))

    def _row(self, n: int) -> Doubles:
        """Both words of y_n, vector by vector."""
        vectors = range(self.layout.vectors)
        starts = [n * self.layout.row + self.layout.value(v) for v in vectors]
        return numpy.concatenate([self.scratch[start : start + 16] for start in starts])

    def resume_words(self) -> tuple[str, ...]:
        clock = self.clock[[dd.BEGAN, dd.BEGAN_LOW]]
        counts = self.counts[[dd.USED, dd.USED_TRIES, dd.USED_SLOPE]]
        units = self.words[self.layout.units + 8 * self.layout.vectors :]
        return (*map(str, counts), *(float(word).hex() for word in (*clock, *self._row(0), *units)))

    def restore(self, numbers: tuple[str, ...], steps: int) -> None:
        self.counts[[dd.LOW_ORDER, dd.TRIES, dd.SLOPE]] = [int(text) for text in numbers[:3]]
        words = [float.fromhex(text) for text in numbers[3:]]
        self.clock[[dd.TIME, dd.TIME_LOW]] = words[:2]
        self.words[: len(words) - 2] = words[2:]
        self.steps = steps


def _exact_state(words: Doubles, size: int) -> tuple[Fraction, ...]:
    return tuple(Fraction(words[offset]) + Fraction(words[offset + 8]) for offset in PLACES[:size])


def _table(problem: Scaled, order: int, layout: Layout) -> Doubles:
    """A and each B in three words; then for n = 0, 1, ..., N - 1: n + 1 and 1/(n + 1) in two words, A/(n + 1) and each
    B/(n + 1) in one.
    """
    flat = [row for vector in problem.coefficients.vectors for row in vector]
    begin = 24 * layout.constants
    table = doubles(begin + order * layout.table_row)
    constants = table[:begin].reshape(layout.constants, 3, 8)
    rows = table[begin:].reshape(order, 1 + layout.constants, 8)
    after = _after(order)
    rows[:, 0, :3] = after
    words = numpy.array([[split_constant(c) for c in row] for row in flat])
    lanes = words.shape[1]
    constants[: len(flat), :, :lanes] = words.transpose(0, 2, 1)
    nearest = numpy.array([[float(c) for c in row] for row in flat])
    rows[:, 1 : 1 + len(flat), :lanes] = nearest / after[:, :1, None]
    return table


@lru_cache(maxsize=64)
def _after(order: int) -> Doubles:
    """n + 1 and the two words of 1/(n + 1), a row for each n."""
    return numpy.array([(n, *split(Fraction(1, n))) for n in range(1, order + 1)])


# The Taylor recurrence of eight motions, a lane each: in double-double, split, and in plain doubles.


ROW = 6 * LANES
"""Doubles of one order in each of four tables."""
LOW, COARSE, OK, SCRATCH = (k * ROW * MOST_ORDER for k in range(1, 5))
"""Offsets of the tables of low words and of the two parts of split coefficients, after that of high words; low words of
orders above n0 are 0 from the beginning.  In separate tables the data of an order fit into the nearest cache."""

Products = Sequence[tuple[int, int, int, int]]
# (left, right, component of the sum, sign): Ω × Ω without its coefficients, and γ × Ω
_OMEGA = (1, 2, 0, 1), (2, 0, 1, 1), (0, 1, 2, 1)
_GAMMA = (4, 2, 3, 1), (5, 0, 4, 1), (3, 1, 5, 1), (5, 1, 3, -1), (3, 2, 4, -1), (4, 0, 5, -1)
_GROUPS = (range(3), _OMEGA), (range(3, 6), _GAMMA)


def terms(system: System) -> list[tuple[int, int, int]]:
    """(row of the coefficients, component, component that it multiplies) of the linear part."""
    return [
        (row, lane, source)
        for row, lanes in enumerate(permutations(system), 1)
        for lane, source in enumerate(lanes[:6])
        if source != ZERO
    ]


class LaneOrders:
    """Writes the recurrence.

    arrays: A and each B, 1/(n + 1), and a row for each order.  units: three vectors, 1.5 · 2^52 units of split
    coefficients, of Ω and of γ, and their slope.
    """

    def __init__(self, code: Code, system: System, arrays: tuple[Operand, Operand, Operand], units: Operand) -> None:
        self.code, self.units = code, units
        self.coefficients, self.quotients, self.scratch = arrays
        self.terms = [(k, component, source) for k, (_, component, source) in enumerate(terms(system), 3)]
        # whether a coefficient is 0 in every lane, a bit
        self.absent = {k: self.code.all_of(self._coefficient(k)[0] == 0) for k in (2, *(k for k, *_ in self.terms))}

    def write(self, pair_order: Operand, low_order: Operand, order: Operand) -> tuple[Operand, list[Operand]]:
        """y_1 to y_N; whether any are split, a bit, and the largest |y_m| 2^(e_0 - e_m) of Ω and of γ."""
        code = self.code
        code.loop(0, pair_order, self._pair_order, [])
        splitting = pair_order < low_order
        stop = code.select(splitting, pair_order + 1, 0)
        peaks = code.loop(0, stop, self._split_row, [code.zero] * 2)
        peaks = code.loop(pair_order, low_order, self._split_order, peaks)
        plain = partial(self._plain_orders, low_order, order)
        code.either(self.absent[2], lambda: plain(_OMEGA[:2]), lambda: plain(_OMEGA))
        return splitting, peaks

    def row(self, n: Index) -> Operand:
        """The address of the row of order n."""
        return self.code.address(self.scratch, self.code.integer(n) * ROW)

    def pair(self, row: Operand, i: int) -> Pair:
        """Both words of a component of a row."""
        return self.code.load(row, LANES * i), self.code.load(row, LOW + LANES * i)

    def _put(self, row: Operand, i: int, y: Pair) -> None:
        for word, table in zip(y, (0, LOW), strict=True):
            self.code.store(word, row, table + LANES * i)

    def _coefficient(self, k: int) -> Constant:
        high, middle, low = (self.code.load(self.coefficients, 24 * k + 8 * word) for word in range(3))
        return high, middle, low

    def _sums(self, group: Products, sums: Callable[[Products], list[Operand]]) -> list[Operand]:
        """``sums`` of a group of products; those of Ω3 are zeros, without computation, where all tops have I1 = I2."""
        if group is not _OMEGA:
            return sums(group)

        def two() -> list[Operand]:
            pair = sums(group[:2])
            return [*pair, *[self.code.zero] * (len(pair) // 2)]

        return self.code.either(self.absent[2], two, lambda: sums(group))

    def _quotient(self, n: Operand) -> Pair:
        """1/(n + 1) in every lane."""
        address = self.code.address(self.quotients, n << 1)
        words = [self.code.load_one(address, i) for i in range(2)]
        return self.code.spread(words[0]), self.code.spread(words[1])

    def _pair_order(self, n: Operand, _: list[Operand]) -> None:
        """y_(n+1) in double-double."""
        code = self.code
        y, next_row, quotient = self.row(n), self.row(n + 1), self._quotient(n)
        after = code.spread((n + 1).to_double())
        for rows, group in _GROUPS:
            words = self._sums(group, partial(self._pair_sums, n))
            for i in rows:
                total = code.quick_two_sum(*words[2 * (i % 3) : 2 * (i % 3) + 2])
                if i < 3:
                    total = by_constant(code, self._coefficient(i), total)
                for k, component, source in self.terms:
                    if component == i:
                        total = self._with_term(k, total, self.pair(y, source))
                high, low = code.quick_two_sum(*divided(code, total, after, quotient))
                self._put(next_row, i, (high, low))

    def _with_term(self, k: int, total: Pair, y: Pair) -> Pair:
        def added() -> list[Operand]:
            return [*add(self.code, total, by_constant(self.code, self._coefficient(k), y))]

        high, low = self.code.either(self.absent[k], lambda: [*total], added)
        return high, low

    def _pair_sums(self, n: Operand, group: Products) -> list[Operand]:
        products = partial(self._pair_products, n, group)
        return self.code.loop(1, n + 1, products, products(self.code.integer(0), []))

    def _pair_products(self, n: Operand, group: Products, m: Operand, words: list[Operand]) -> list[Operand]:
        left, right = self.row(m), self.row(n - m)
        products: list[Any] = list(words) or [None] * 2 * (1 + group[-1][2] % 3)
        for first, second, component, sign in group:
            (a, a_low), (c, c_low) = self.pair(left, first), self.pair(right, second)
            if sign < 0:
                c, c_low = -c, -c_low
            at = 2 * (component % 3)
            x, y = (a, a_low), (c, c_low)
            total = products[at], products[at + 1]
            products[at : at + 2] = (
                multiply(self.code, x, y) if total[0] is None else accumulated(self.code, total, x, y)
            )
        return products

    def _split_row(self, m: Operand, peaks: list[Operand]) -> list[Operand]:
        """Split y_m; returns the largest |y_m| 2^(e_0 - e_m) of Ω and of γ so far."""
        row = self.row(m)
        return self._put_parts(m, [self.pair(row, i) for i in range(6)], peaks)

    def _put_parts(self, m: Operand, y: list[Pair], peaks: list[Operand]) -> list[Operand]:
        code, row, stored = self.code, self.row(m), []
        up, down = rises(code, m, code.load(self.units, 16))
        for k, (rows, _) in enumerate(_GROUPS):
            big, largest = code.load(self.units, 8 * k) * up, code.zero
            for i in rows:
                coarse, fine = parts(y[i], big)
                largest = code.larger(code.absolute(y[i][0]), largest)
                code.store(coarse, row, COARSE + LANES * i)
                code.store(fine, row, OK + LANES * i)
            stored.append(code.larger(largest * down, peaks[k]))
        return stored

    def _split_order(self, n: Operand, peaks: list[Operand]) -> list[Operand]:
        """y_(n+1) from split coefficients."""
        y, next_row = self.row(n), self.row(n + 1)
        divisor = self.code.spread((n + 1).to_double()), self._quotient(n)[0]
        halves = []
        for rows, group in _GROUPS:
            words = self._sums(group, partial(self._split_sums, n))
            for i in rows:
                at = 3 * (i % 3)
                total = words[at], words[at + 1] + words[at + 2]
                factors = [(self._coefficient(i), total)] if i < 3 else []
                for k, component, source in self.terms:
                    if component == i:
                        factors.append((self._coefficient(k), self.pair(y, source)))
                pair = quotient(self.code, None if i < 3 else total, factors, divisor)
                self._put(next_row, i, pair)
                halves.append(pair)
        return self._put_parts(n + 1, halves, peaks)

    def _split_sums(self, n: Operand, group: Products) -> list[Operand]:
        zeros = [self.code.zero] * 3 * (1 + group[-1][2] % 3)
        return self.code.loop(0, n + 1, partial(self._split_products, n, group), zeros)

    def _split_products(self, n: Operand, group: Products, m: Operand, sums: list[Operand]) -> list[Operand]:
        code, left, right = self.code, self.row(m), self.row(n - m)
        result = list(sums)
        for first, second, component, sign in group:
            a, fine_left = (code.load(left, part + LANES * first) for part in (COARSE, OK))
            coarse, fine = (code.load(right, part + LANES * second) for part in (COARSE, OK))
            if sign < 0:
                a, fine_left = -a, -fine_left
            at = 3 * (component % 3)
            unsplit = code.load(right, LANES * second)
            for k, (left_part, factor) in enumerate(((a, coarse), (a, fine), (fine_left, unsplit))):
                result[at + k] = code.fma(left_part, factor, result[at + k])
        return result

    def _plain_orders(self, start: Operand, stop: Operand, omega: Products) -> list[Operand]:
        """y_(start+1) to y_stop in plain doubles; omega: those products of Ω that are needed."""

        def order(n: Operand, _: list[Operand]) -> None:
            sums = self.code.loop(0, n + 1, partial(self._plain_products, n, omega), [self.code.zero] * 6)
            self._plain_rates(n, sums)

        return self.code.loop(start, stop, order, [])

    def _plain_products(self, n: Operand, omega: Products, m: Operand, sums: list[Operand]) -> list[Operand]:
        """Sums with the products of y_m and Ω_(n−m)."""
        left, right, result = self._highs(m), self._highs(n - m), list(sums)
        for first, second, component, sign in (*omega, *_GAMMA):
            factor = left[first] if sign > 0 else -left[first]
            result[component] = self.code.fma(factor, right[second], result[component])
        return result

    def _highs(self, n: Operand) -> list[Operand]:
        """The high words of y_n."""
        row = self.row(n)
        return [self.code.load(row, LANES * i) for i in range(6)]

    def _plain_rates(self, n: Operand, sums: list[Operand]) -> None:
        """y_(n+1) from its sums."""
        code = self.code
        y, next_row, quotient = self.row(n), self.row(n + 1), self._quotient(n)[0]
        for i, products in enumerate(sums):
            total = self._coefficient(i)[0] * products if i < 3 else products
            for k, component, source in self.terms:
                if component == i:
                    total = code.fma(self._coefficient(k)[0], code.load(y, LANES * source), total)
            code.store(total * quotient, next_row, LANES * i)
