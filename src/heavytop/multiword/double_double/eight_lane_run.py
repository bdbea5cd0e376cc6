"""Eight motions in double-double: the machine code and its data."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import reduce
from operator import and_
from typing import Any

import numpy

from heavytop.multiword.codegen.machine_code import (
    INT,
    INT_POINTER,
    INT_VECTOR,
    LANES,
    POINTER,
    Doubles,
    Machine,
    Operand,
    Pair,
    Processor,
    compiled,
    doubles,
    function,
    ir,
    once,
    pointer,
)
from heavytop.multiword.codegen.recurrence import LEAST_LOW_ORDER
from heavytop.multiword.double_double.arithmetic import (
    add,
    covered,
    later,
    log2,
    polynomials,
    split,
    split_constant,
    split_ratio,
    step_length,
    times,
)
from heavytop.multiword.double_double.double_double_run import (
    LARGEST_TIME,
    LOW,
    ROW,
    SCRATCH,
    LaneOrders,
    OrderSchedule,
    terms,
)
from heavytop.multiword.double_double.steps import (
    FIRST_UNITS,
    LOG2_OF_A_UNIT,
    MOST_TRIES,
    SLACK,
    STEEPEST,
    TOLERATED_SLOPE,
    in_range,
    next_unit,
)
from heavytop.multiword.problem import Scaled, Status, Steps
from heavytop.top.equations import System

# Eight motions, a lane each, in double-double with plain doubles above an order n0.
#
# Each lane has its own time, step and target, and its bits do not depend on the others: N and n0 are common and
# constant. A lane whose next step would cover its target waits; the scratch then holds the polynomial of that step.  A
# lane that needs a larger n0 stops with a flag.  One whose units of split coefficients do not fit repeats the step.


OK, NON_FINITE, TOO_SMALL, LARGER_N0 = 0, 1, 2, 4
"""Flags of a lane."""
TIME, TARGET, SIGN, LEFT, ROOM, REACH, DEPTH, UNITS, SLOPE, TRIES, CLOCK = 0, 2, 4, 5, 6, 7, 8, 9, 11, 12, 13
"""Vectors of the clock: |time| and its target, two words each; direction, steps left, room, reach and depth; units of
split coefficients, of Ω and of γ, their slope, and how often the next step was tried."""
_TOLERATED = 1.0


def build(system: System, processor: Processor | None = None) -> Machine:
    """``advance`` and ``sample`` of eight motions.

    advance(state, clock, flags, order, low_order, pair_order, coefficients, quotients, scratch, steps): at most so many
    rounds of steps, until no lane can advance; returns the number of rounds.  Orders from pair_order to low_order are
    split. sample(scratch, order, times, result): each lane's polynomial at its own time, in two words, behind its
    beginning.
    """
    module = ir.Module("lanes")
    _Round(module, system).write()
    _write_sample(module)
    return compiled(module, processor)


def _write_sample(module: ir.Module) -> None:
    _, code = function(module, "sample", ir.VoidType(), [POINTER, INT, POINTER, POINTER])
    scratch, order, times_, result = code.arguments
    b = code.builder

    def row(n: Operand) -> list[Pair]:
        at = code.address(scratch, n * ROW)
        return [(code.load(at, LANES * i), code.load(at, LOW + LANES * i)) for i in range(6)]

    words = polynomials(code, (order, order), [(code.load(times_, 0), code.load(times_, 8))], 6, row)[0]
    for index, word in enumerate(words):
        code.store(word, result, ROW * (index % 2) + LANES * (index // 2))
    b.ret_void()


class _Round:
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, system: System) -> None:
        arguments = [POINTER, POINTER, INT_POINTER, INT, INT, INT, POINTER, POINTER, POINTER, INT]
        _, self.code = function(module, "advance", INT, arguments)
        self.state, self.clock, self.flags, self.order, self.low_order, self.pair_order = self.code.arguments[:6]
        *arrays, self.most = self.code.arguments[6:]
        units = self.code.address(self.clock, 8 * UNITS)
        self.series = LaneOrders(self.code, system, (arrays[0], arrays[1], arrays[2]), units)

    def _clock(self, index: int) -> Operand:
        return self.code.load(self.clock, 8 * index)

    def write(self) -> None:
        """The loop of rounds."""
        code = self.code

        def body(taken: Operand, _: Operand) -> list[Operand]:
            first = self.series.row(0)
            for offset, table in ((0, 0), (ROW, LOW)):
                for at in range(0, ROW, LANES):
                    code.store(code.load(self.state, offset + at), first, table + at)
            splitting, peaks = self.series.write(self.pair_order, self.low_order, self.order)
            some = self._finish(peaks, splitting)
            return [taken + some.extended(), some]

        taken, _ = code.as_long_as(lambda taken, some: (taken < self.most) & some, body, [code.integer(0), code.true])
        code.builder.ret(taken)

    def _norm(self, n: Operand) -> Operand:
        row, largest = self.series.row(n), self.code.zero
        for i in range(6):
            largest = self.code.larger(self.code.absolute(self.code.load(row, LANES * i)), largest)
        return log2(largest)

    def _length(self, start: Operand) -> Operand:
        """Each lane's h > 0, as in :mod:`heavytop.multiword.double_double.steps`."""

        def radius(n: Operand) -> Operand:
            return (start - self._norm(n)) / self.code.spread(n.to_double())

        radii = radius(self.order), radius(self.order - 1)
        return step_length(self.code, radii, self._clock(REACH))

    def _sums(self, h: Operand) -> list[Pair]:
        """Σ y_n h^n of each component, from the highest order."""
        code = self.code

        def plain(k: Operand, totals: list[Operand]) -> list[Operand]:
            row = self.series.row(self.order - k)
            return [code.fma(total, h, code.load(row, LANES * i)) for i, total in enumerate(totals)]

        def pairs(k: Operand, words: list[Operand]) -> list[Operand]:
            row, sums = self.series.row(self.low_order - k), list[Operand]()
            for i in range(6):
                sums += add(code, times(code, (words[2 * i], words[2 * i + 1]), h), self.series.pair(row, i))
            return sums

        totals = code.loop(0, self.order - self.low_order, plain, [code.zero] * 6)
        begin = [word for total in totals for word in (total, code.zero)]
        words = code.loop(0, self.low_order + 1, pairs, begin)
        return [code.quick_two_sum(words[2 * i], words[2 * i + 1]) for i in range(6)]

    def _finish(self, peaks: list[Operand], splitting: Operand) -> Operand:
        """Advance the lanes that can; returns whether any advanced or repeats its step."""
        code = self.code
        start = self._norm(code.integer(0))
        length = self._length(start)
        step = length * self._clock(SIGN)
        results = self._sums(step)
        time, low = (code.load(self.clock, 8 * (TIME + k)) for k in range(2))
        total, total_low = later(code, (time, low), length)
        target, target_low = (code.load(self.clock, 8 * (TARGET + k)) for k in range(2))
        behind = covered((total, total_low), (target, target_low))
        fits, tried_out = self._fits(peaks, splitting, start, length)
        flags = self._judged(start, length, results, total > time, tried_out)
        fine, steps_left = flags == 0, self._clock(LEFT)
        alive = fine & (steps_left > 0)
        going, again = alive & (fits & ~behind), alive & ~fits
        old = [(self.state, ROW * word + 8 * i, results[i][word]) for i in range(6) for word in range(2)]
        old += [(self.clock, 8 * TIME, total), (self.clock, 8 * (TIME + 1), total_low)]
        old += [(self.clock, 8 * LEFT, steps_left - 1)]
        for base, offset, value in old:
            code.store(code.select(going, value, code.load(base, offset)), base, offset)
        self._follow(peaks, length, going, again)
        return code.any_of(going | again)

    def _fits(
        self, peaks: list[Operand], splitting: Operand, start: Operand, length: Operand
    ) -> tuple[Operand, Operand]:
        """Lanes with accurate split coefficients, and those with the largest number of tries."""
        code = self.code
        units = [self._clock(UNITS + k) for k in range(2)]
        slope = self._clock(SLOPE)
        fits = (slope - self._slope(length) < TOLERATED_SLOPE) & (code.absolute(slope) <= STEEPEST)
        for unit, peak in zip(units, peaks, strict=True):
            fits &= in_range(unit) & next_unit(code, unit, peak)[0]
        product_log = log2(units[0]) + log2(code.larger(*units))
        above = product_log - 2 * LOG2_OF_A_UNIT + (log2(length) - start)
        fall = -SLACK - self._clock(REACH)
        most = code.spread(self.pair_order.to_double()) * fall
        fits = code.select(splitting, fits & (above - self._clock(DEPTH) <= most), True)
        tried = self._clock(TRIES) >= MOST_TRIES
        return fits, code.select(splitting, tried & ~fits, False)

    def _slope(self, length: Operand) -> Operand:
        return self._clock(REACH) - log2(length) + SLACK

    def _follow(self, peaks: list[Operand], length: Operand, going: Operand, again: Operand) -> None:
        """Store the units of the next step; a waiting lane keeps its own, so that its series does not change."""
        code = self.code
        either = going | again
        tries = code.select(again, self._clock(TRIES) + 1, code.zero)
        values = [next_unit(code, self._clock(UNITS + k), peak)[1] for k, peak in enumerate(peaks)]
        for offset, value in zip((UNITS, UNITS + 1, SLOPE, TRIES), (*values, self._slope(length), tries), strict=True):
            code.store(code.select(either, value, self._clock(offset)), self.clock, 8 * offset)

    def _judged(self, start: Operand, length: Operand, results: list[Pair], moves: Operand, tried: Operand) -> Operand:
        """The flags of all lanes with those of this step; a lane without steps left gets none."""
        code, b = self.code, self.code.builder
        above = self.low_order + 1
        power = code.spread(above.to_double()) * log2(length)
        rounding = self._norm(above) + power - start
        limit = self._clock(ROOM) + _TOLERATED
        finite = reduce(and_, (code.absolute(word) < math.inf for pair in results for word in pair))

        def flag(condition: Operand, value: int) -> Operand:
            return code.select(condition, value, 0)

        flags = b.bitcast(self.flags, INT_VECTOR.as_pointer())
        flags_before = code.value(b.load(flags, align=8))
        status = flag(~finite, NON_FINITE) | flag(~moves, TOO_SMALL)
        status |= flag((rounding > limit) | tried, LARGER_N0)
        alive = self._clock(LEFT) > 0
        status = flags_before | code.select(alive, status, 0)
        b.store(status, flags, align=8)
        return status


_NO_LIMIT = 2.0**53
_ROUNDS = 4096


machine = once(build)
"""The machine code, compiled at its first use."""


class Eight:
    """Eight lanes of motions of one system, each idle or with a motion in it.

    low_order: n0 of all lanes, at least 2; a motion that needs a larger one stops.
    """

    def __init__(
        self, system: System, schedule: OrderSchedule, low_order: int, processor: Processor | None = None
    ) -> None:
        self.functions = machine(system, processor).functions
        self.schedule, self.low_order = schedule, max(LEAST_LOW_ORDER, min(low_order, schedule.order - 1))
        self.pair_order = min(self.low_order, schedule.pair_order(self.low_order))
        self.terms = terms(system)
        self.words, self.clock = doubles(12 * LANES).reshape(12, LANES), doubles(CLOCK * LANES).reshape(CLOCK, LANES)
        self.constants = doubles(24 * (3 + len(self.terms))).reshape(-1, 3, LANES)
        self.flags = numpy.zeros(LANES, numpy.int64)
        self.quotients = doubles(2 * schedule.order)
        self.quotients[:] = [word for n in range(1, schedule.order + 1) for word in split(Fraction(1, n))]
        self.scratch = doubles(SCRATCH)
        self.moving = [pointer(array) for array in (self.words, self.clock, self.flags)]
        self.tables = [pointer(array) for array in (self.constants, self.quotients, self.scratch)]
        self.behind, self.sampled = doubles(2 * LANES).reshape(2, LANES), doubles(12 * LANES).reshape(12, LANES)
        self.sampling = [pointer(array) for array in (self.behind, self.sampled)]
        self.clock[[ROOM, REACH, DEPTH]] = [[schedule.room], [schedule.reach], [schedule.depth]]

    def put(self, lane: int, problem: Scaled, forwards: bool, most: int | None) -> None:
        """Put a motion at its start into a lane; most: the largest number of steps."""
        rows = problem.coefficients.vectors[0]
        sources = [*rows[0][:3], *(rows[row][component] for row, component, _ in self.terms)]
        words = numpy.transpose([split(value) for value in problem.state]).ravel()
        self.begin(lane, words, numpy.array([split_constant(value) for value in sources]), forwards, most)

    def begin(self, lanes: Any, words: Any, constants: Any, forwards: bool, most: int | None) -> None:
        """Put motions at their start into a lane, or into all: the words of their states and of each constant."""
        self.words[:, lanes], self.constants[:, :, lanes], self.flags[lanes] = words, constants, OK
        self.clock[[TIME, TIME + 1, SLOPE, TRIES], lanes] = 0.0
        self.clock[[UNITS, UNITS + 1], lanes] = FIRST_UNITS
        self.clock[SIGN, lanes] = 1.0 if forwards else -1.0
        self.clock[LEFT, lanes] = _NO_LIMIT if most is None else most

    def reach_all(self, targets: Any) -> Doubles:
        """The states of eight motions, forwards in time, at one double |τ| each, not before the last: shape (12, 8)."""
        self.clock[TARGET] = targets
        while self.advance(_ROUNDS) == _ROUNDS:
            pass
        total = targets - self.clock[TIME]
        part = total - targets
        low = ((targets - (total - part)) - (self.clock[TIME] + part)) - self.clock[TIME + 1]
        self.behind[0] = total + low
        self.behind[1] = low - (self.behind[0] - total)
        return self._sample()

    def _sample(self) -> Doubles:
        """The states of all lanes at the set distances from the beginnings of their next steps."""
        self.functions["sample"](self.tables[2], self.schedule.order, *self.sampling)
        return self.sampled

    def taken_out(self, lane: int) -> tuple[Doubles, Doubles]:
        """The state and the clock of a motion, sufficient to continue it in another eight."""
        return self.words[:, lane].copy(), self.clock[:, lane].copy()

    def put_back(self, lane: int, problem: Scaled, forwards: bool, moved: tuple[Doubles, Doubles]) -> None:
        """Put a motion from another eight into a lane."""
        self.put(lane, problem, forwards, None)
        self.words[:, lane], self.clock[:, lane] = moved
        self.clock[TRIES, lane] = 0.0

    def empty(self, lane: int) -> None:
        """Empty this lane: it takes no steps."""
        self.clock[LEFT, lane] = 0.0

    def aim(self, lane: int, target: Fraction) -> None:
        """Set the target |τ| of a lane."""
        self.clock[TARGET : TARGET + 2, lane] = split(min(target, LARGEST_TIME))

    def advance(self, rounds: int) -> int:
        """Advance all lanes that can by at most ``rounds`` steps; returns the number of rounds taken."""
        orders = self.schedule.order, self.low_order, self.pair_order
        taken: int = self.functions["advance"](*self.moving, *orders, *self.tables, rounds)
        return taken

    def time(self, lane: int) -> Fraction:
        """|τ| at the end of the last step of a lane."""
        return Fraction(self.clock[TIME, lane]) + Fraction(self.clock[TIME + 1, lane])

    def taken(self, lane: int, most: int | None) -> int:
        """Steps taken by the motion in a lane, of at most ``most``."""
        return int((_NO_LIMIT if most is None else most) - self.clock[LEFT, lane])

    def status(self, lane: int) -> Status | None:
        """The status of the motion in a lane; None where it needs a larger n0."""
        flags = int(self.flags[lane])
        if flags & NON_FINITE:
            return Status.NON_FINITE
        if flags & TOO_SMALL:
            return Status.TOO_SMALL
        return None if flags & LARGER_N0 else Status.OK

    def coefficients(self, lane: int, n: int) -> tuple[Fraction, ...]:
        """y_n of a lane's last series."""
        words = [self.scratch[offset + ROW * n + lane : offset + ROW * (n + 1) : LANES] for offset in (0, LOW)]
        return exact_state(numpy.concatenate(words))

    def state(self, lane: int) -> tuple[Fraction, ...]:
        """The state of the motion in a lane."""
        return exact_state(self.words[:, lane])

    def samples(self, times: dict[int, Fraction]) -> dict[int, Doubles]:
        """The states of some lanes at times |τ| inside their next steps: high words, then low ones, shape (12,)."""
        for lane, time in times.items():
            self.behind[:, lane] = self._behind(lane, time)
        samples = self._sample()
        return {lane: samples[:, lane].copy() for lane in times}

    def _behind(self, lane: int, time: Fraction) -> tuple[float, float]:
        """τ of a time |τ| after the beginning of a lane's next step."""
        (a, b), (c, d) = (word.as_integer_ratio() for word in self.clock[TIME : TIME + 2, lane].tolist())
        top, bottom = time.as_integer_ratio()
        return split_ratio(int(self.clock[SIGN, lane]) * (top * b * d - bottom * (a * d + c * b)), bottom * b * d)


def exact_state(words: Doubles) -> tuple[Fraction, ...]:
    """The sums of six high words and the six low ones behind them."""
    return tuple(
        Fraction(high) + Fraction(low) for high, low in zip(words[:6].tolist(), words[6:].tolist(), strict=True)
    )


class OneOfEight(Steps):
    """One step of a motion that is in all eight lanes, for the check of their machine code."""

    def __init__(self, problem: Scaled, schedule: OrderSchedule, low_order: int) -> None:
        self.eight = Eight(problem.system, schedule, low_order)
        self.steps, self.forwards = 0, True
        for lane in range(LANES):
            self.eight.put(lane, problem, True, 1)
            self.eight.aim(lane, LARGEST_TIME)

    @property
    def order(self) -> int:
        return self.eight.schedule.order

    @property
    def time(self) -> Fraction:
        return self.eight.time(0)

    @property
    def state(self) -> tuple[Fraction, ...]:
        return self.eight.state(0)

    def advance(self, target: Fraction, steps: int) -> Status:
        # one round at a time, since the scratch holds the series of the last; the first ones may fit units only
        for _ in range(1 + MOST_TRIES):
            if self.time == 0:
                self.eight.advance(1)
        self.steps += 1
        same = all(self.eight.state(lane) == self.state and self.eight.time(lane) == self.time for lane in range(LANES))
        return Status.OK if same and self.time > 0 else Status.NON_FINITE

    def sample(self, time: Fraction) -> tuple[Fraction, ...]:
        # the scratch holds the series at the beginning of the step, time 0
        return exact_state(self.eight.samples({0: self.time + time})[0])

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        return tuple(value * self.time**n for value in self.eight.coefficients(0, n))
