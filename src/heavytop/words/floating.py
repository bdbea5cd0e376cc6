"""One motion in double-double: what the machine code of :mod:`heavytop.words.double_double` works on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy

from heavytop.words import double_double as dd
from heavytop.words.machine import Doubles, Processor, doubles, once, pointer
from heavytop.words.pairs import split, split_constant
from heavytop.words.recurrence import LEAST_LOW_ORDER, MOST_ORDER, Layout
from heavytop.words.run import Run, Status
from heavytop.words.scaled import Scaled
from heavytop.words.split_orders import FIRST_UNITS, SLACK

BITS = 106
FALL_ALONE, FALL_IN_LANES = 1.3, 1.6
_MARGIN = 7.0
_DEEPEST = 84.0
_DOUBLE_BITS = 53
_ROUNDING_BITS = 4
_LEAST_ROOM, _LEAST_DEPTH = -66.0, -112.0
_SPLIT_BITS = 32
"""How far the rounding of S_n lies below the product of its two units (measured)."""
_USUAL_UNITS = -34.0
"""log2 of the product of two units where the state is about 1."""
_NEVER = -1000.0
LARGEST_TIME = Fraction(2) ** 1000
_STEPS_AT_ONCE = 1024
PLACES = (*range(6), *range(19, 22))
"""Where the first words of Ω, γ and ξ stand; the second are 8 behind."""


@dataclass(frozen=True, slots=True)
class Ladder:
    """How far the series goes, how long a step is, and what is kept in double-double.

    order: N.  reach: log2 of h/ρ.  room: log2 of the largest |y_n| h^n / |y_0| whose rounding to a double is allowed,
    at n0 + 1.  depth: log2 of what the products of two units h^n may be beside |y_0|, at the first n whose coefficients
    are split; none are where it is very small.
    """

    order: int
    reach: float
    room: float
    depth: float = _NEVER

    @classmethod
    @lru_cache(maxsize=256)
    def of(cls, tolerance: Fraction, fall: float = FALL_ALONE) -> Ladder:
        """For a local error of ``tolerance`` relative to the state.

        fall: of the logarithm of y_n h^n from one order to the next.  2 is best where the time goes into N² products
        (Jorba and Zou); a single motion waits for the last product of each order, so that many orders and long steps
        are faster.
        """
        log_tolerance = math.log(tolerance.numerator) - math.log(tolerance.denominator)
        # what is left out errs in the same way at every step: it shall not show beside roundings after 10^7 steps
        finest = tolerance <= Fraction(1, 2 ** (BITS - 1))
        depth = _DEEPEST if finest else _MARGIN - log_tolerance
        order = min(math.ceil(depth / fall), MOST_ORDER - 2)
        reach = -(depth / order + 0.7 / (order - 1)) / math.log(2)
        room = max(_DOUBLE_BITS - depth / math.log(2) - _ROUNDING_BITS, _LEAST_ROOM)
        # roundings of split coefficients average out: the finest may show 2^6 times less than double-double's
        return cls(order, reach, room, max(room - _DOUBLE_BITS, _LEAST_DEPTH) + _SPLIT_BITS)

    def pair_order(self, low_order: int) -> int:
        """The first order that is split in eight motions whose n0 is the same.

        It is that of coefficients which fall as those of a motion near a singularity, and rises with n0; with the
        largest n0 none are split.
        """
        if low_order >= self.order - 1:
            return low_order
        first = math.ceil(self.room / self.reach)
        usual = math.ceil((_USUAL_UNITS - self.depth) / -(self.reach + SLACK))
        return max(1, usual + (low_order - first) // 2)


machine = once(dd.build)
"""The machine code, compiled at its first use."""


class Floating(Run):
    """A motion that advances in double-double steps.

    low_order: n0 of the first step; None for the largest, from which it falls to what the motion needs.
    """

    def __init__(
        self,
        problem: Scaled,
        ladder: Ladder,
        forwards: bool,
        low_order: int | None = None,
        processor: Processor | None = None,
    ) -> None:
        self.machine, self.layout = machine(problem.system, len(problem.state) == 9, processor)
        self.problem, self.forwards = problem, forwards
        self.steps = 0
        self.words = _state_words(problem.state, self.layout)
        self.clock, self.counts = doubles(dd.CLOCK), numpy.zeros(dd.COUNTS, numpy.int64)
        self.clock[dd.SIGN] = 1.0 if forwards else -1.0
        self.clock[dd.ROOM] = ladder.room
        self.clock[dd.REACH] = ladder.reach
        most = ladder.order - 1
        self.counts[[dd.ORDER, dd.LOW_ORDER]] = ladder.order, low_order or most
        self.counts[[dd.LEAST, dd.MOST]] = LEAST_LOW_ORDER, most
        self.clock[dd.DEPTH] = ladder.depth
        self.table = _table(problem, ladder.order, self.layout)
        self.scratch = doubles((ladder.order + 5) * self.layout.row)
        self.at, self.found = doubles(1), doubles(16 * self.layout.vectors)
        self.sampling = [pointer(array) for array in (self.scratch, self.at, self.found)]

    @property
    def order(self) -> int:
        return int(self.counts[dd.ORDER])

    @property
    def time(self) -> Fraction:
        return self._time(dd.TIME)

    def _time(self, place: int) -> Fraction:
        return Fraction(self.clock[place]) + Fraction(self.clock[place + 1])

    @property
    def state(self) -> tuple[Fraction, ...]:
        return _exact_state(self.words, len(self.problem.state))

    def advance(self, target: Fraction, steps: int) -> Status:
        self.clock[dd.TARGET : dd.TARGET_LOW + 1] = split(min(target, LARGEST_TIME))
        arrays = [pointer(array) for array in (self.words, self.clock, self.counts, self.table, self.scratch)]
        taken = self.machine.functions["advance"](*arrays, steps)
        self.steps += taken
        return Status(int(self.counts[dd.STATUS]))

    def sample(self, time: Fraction) -> tuple[Fraction, ...]:
        return self.exact_state(self.words_at(time))

    def words_at(self, time: Fraction) -> Doubles:
        """The words of the state at ``time``, inside the last step."""
        behind = time - self._time(dd.BEGAN)
        self.at[0], low = split(behind if self.forwards else -behind)
        series, at, found = self.sampling
        self.machine.functions["samples"](series, self.order, at, 0, 1, 0.0, -low, 1.0, found)
        return self.found.copy()

    def exact_state(self, words: Doubles) -> tuple[Fraction, ...]:
        """A state out of its words."""
        return _exact_state(words, len(self.problem.state))

    def sampled(self, times: Doubles) -> tuple[Status, Doubles]:
        """Steps until the last of the times |τ| > 0, which are doubles in order; the words of the states that were
        reached, a row each: the bits of :meth:`advance` and :meth:`sample` one by one.
        """
        row, done, status = 16 * self.layout.vectors, 0, Status.FINE
        found, given = doubles(row * len(times)), times.astype(float)
        arrays = [pointer(array) for array in (self.words, self.clock, self.counts, self.table, self.scratch)]
        advance, samples, sign = *(self.machine.functions[name] for name in ("advance", "samples")), self.clock[dd.SIGN]
        ends = pointer(given), pointer(found)
        while done < len(times):
            covered = self._covered(given)
            if covered > done:
                began, low = self.clock[dd.BEGAN], self.clock[dd.BEGAN_LOW]
                if given[covered - 1] <= 2 * began or not began:  # then the difference is exact (Sterbenz)
                    samples(arrays[-1], self.order, ends[0], done, covered, began, low, sign, ends[1])
                else:
                    for place in range(done, covered):
                        found[row * place : row * (place + 1)] = self.words_at(Fraction(float(given[place])))
                done = covered
                continue
            self.clock[dd.TARGET], self.clock[dd.TARGET_LOW] = given[done], 0.0
            self.steps += advance(*arrays, _STEPS_AT_ONCE)
            status = Status(int(self.counts[dd.STATUS]))
            if status is not Status.FINE:
                break
        return status, found[: row * done].reshape(done, row)

    def _covered(self, times: Doubles) -> int:
        """How many of the times do not lie beyond the last step."""
        high, low = self.clock[dd.TIME], self.clock[dd.TIME + 1]
        return int(times.searchsorted(high, "right" if low >= 0 else "left")) if self.steps else 0

    def derivatives(self, n: int) -> tuple[Fraction, ...]:
        """y_n of the last step, exactly as it was computed; a step back in time has a negative length."""
        return _exact_state(self._row(n), len(self.problem.state))

    @property
    def length(self) -> Fraction:
        """h of the last step, negative back in time."""
        step = self.time - self._time(dd.BEGAN)
        return step if self.forwards else -step

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        step = self.time - self._time(dd.BEGAN)
        power = (step if self.forwards else -step) ** n
        return tuple(value * power for value in _exact_state(self._row(n), len(self.problem.state)))

    def _row(self, n: int) -> Doubles:
        """Both words of y_n, vector by vector."""
        vectors = range(self.layout.vectors)
        starts = [n * self.layout.row + self.layout.value(v) for v in vectors]
        return numpy.concatenate([self.scratch[start : start + 16] for start in starts])

    def place(self) -> tuple[str, ...]:
        clock = self.clock[[dd.BEGAN, dd.BEGAN_LOW]]
        counts = self.counts[[dd.USED, dd.USED_TRIES, dd.USED_SLOPE]]
        units = self.words[self.layout.units + 8 * self.layout.vectors :]
        return (*map(str, counts), *(float(word).hex() for word in (*clock, *self._row(0), *units)))

    def restore(self, place: tuple[str, ...], steps: int) -> None:
        self.counts[[dd.LOW_ORDER, dd.TRIES, dd.SLOPE]] = [int(text) for text in place[:3]]
        words = [float.fromhex(text) for text in place[3:]]
        self.clock[[dd.TIME, dd.TIME_LOW]] = words[:2]
        self.words[: len(words) - 2] = words[2:]
        self.steps = steps


def _state_words(state: tuple[Fraction, ...], layout: Layout) -> Doubles:
    words = doubles(layout.state)
    words[layout.units :] = FIRST_UNITS
    for index, value in enumerate(state):
        place = index if index < 6 else 16 + index - 3
        words[place], words[place + 8] = split(value)
    return words


def _exact_state(words: Doubles, size: int) -> tuple[Fraction, ...]:
    return tuple(Fraction(words[place]) + Fraction(words[place + 8]) for place in PLACES[:size])


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
