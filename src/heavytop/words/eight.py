"""Eight motions in double-double: what the machine code of :mod:`heavytop.words.lane_steps` works on."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy

from heavytop.top.equations import System
from heavytop.words import lane_steps as steps
from heavytop.words.floating import LARGEST_TIME, Ladder
from heavytop.words.lane_orders import LOW, ROW, SCRATCH, terms
from heavytop.words.machine import Doubles, Processor, doubles, once, pointer
from heavytop.words.pairs import split, split_constant, split_ratio
from heavytop.words.recurrence import LEAST_LOW_ORDER
from heavytop.words.run import Status, Steps
from heavytop.words.scaled import Scaled
from heavytop.words.split_orders import FIRST_UNITS, MOST_TRIES
from heavytop.words.vector import LANES

_NO_LIMIT = 2.0**53


machine = once(steps.build)
"""The machine code, compiled at its first use."""


class Eight:
    """Eight lanes of motions of one system, each idle or with a motion in it.

    low_order: n0, the same for all, 2 at least; a motion that needs a larger one stops.
    """

    def __init__(self, system: System, ladder: Ladder, low_order: int, processor: Processor | None = None) -> None:
        self.functions = machine(system, processor).functions
        self.ladder, self.low_order = ladder, max(LEAST_LOW_ORDER, min(low_order, ladder.order - 1))
        self.pair_order = min(self.low_order, ladder.pair_order(self.low_order))
        self.terms = terms(system)
        self.words, self.clock = doubles(12 * LANES), doubles(steps.CLOCK * LANES)
        self.flags = numpy.zeros(LANES, numpy.int64)
        self.constants = doubles(24 * (3 + len(self.terms)))
        self.quotients = doubles(2 * ladder.order)
        self.quotients[:] = [word for n in range(1, ladder.order + 1) for word in split(Fraction(1, n))]
        self.scratch = doubles(SCRATCH)
        self.moving = [pointer(array) for array in (self.words, self.clock, self.flags)]
        self.tables = [pointer(array) for array in (self.constants, self.quotients, self.scratch)]
        self.behind, self.sampled = doubles(2 * LANES), doubles(12 * LANES)
        self.sampling = [pointer(array) for array in (self.behind, self.sampled)]
        self.signs = [1] * LANES
        self._set(steps.ROOM, [ladder.room] * LANES)
        self._set(steps.REACH, [ladder.reach] * LANES)
        self._set(steps.DEPTH, [ladder.depth] * LANES)

    def _set(self, vector: int, values: Any) -> None:
        self.clock[LANES * vector : LANES * (vector + 1)] = values

    def put(self, lane: int, problem: Scaled, forwards: bool, most: int | None) -> None:
        """A motion at its beginning; most: the steps that it may take."""
        for i, value in enumerate(problem.state):
            self.words[LANES * i + lane], self.words[ROW + LANES * i + lane] = split(value)
        rows = problem.coefficients.vectors[0]
        given = [rows[0][i] for i in range(3)] + [rows[row][component] for row, component, _ in self.terms]
        for k, value in enumerate(given):
            self.constants[24 * k + lane : 24 * (k + 1) : LANES] = split_constant(value)
        self.flags[lane] = steps.FINE
        self.signs[lane] = 1 if forwards else -1
        values = {steps.TIME: 0.0, steps.TIME + 1: 0.0, steps.SIGN: float(self.signs[lane])}
        values |= {steps.UNITS: FIRST_UNITS, steps.UNITS + 1: FIRST_UNITS, steps.SLOPE: 0.0, steps.TRIES: 0.0}
        for vector, word in (values | {steps.LEFT: _NO_LIMIT if most is None else float(most)}).items():
            self.clock[LANES * vector + lane] = word

    def put_all(self, words: Any, constants: Any, most: int) -> None:
        """Eight motions at their beginning, forwards: their words (12, 8), and those of each constant (k, 3, 8)."""
        self.words[:], self.constants[:] = words.reshape(-1), constants.reshape(-1)
        self.flags[:], self.signs[:] = steps.FINE, [1] * LANES
        values = {steps.TIME: 0.0, steps.TIME + 1: 0.0, steps.SIGN: 1.0, steps.LEFT: float(most)}
        values |= {steps.UNITS: FIRST_UNITS, steps.UNITS + 1: FIRST_UNITS, steps.SLOPE: 0.0, steps.TRIES: 0.0}
        for vector, value in values.items():
            self._set(vector, value)

    def aim_all(self, targets: Any) -> None:
        """Where the lanes are to stop, |τ|, eight doubles."""
        self._set(steps.TARGET, targets)
        self._set(steps.TARGET + 1, 0.0)

    def sample_all(self, targets: Any) -> Doubles:
        """The states of eight motions forwards at doubles |τ| inside their next steps: (12, 8)."""
        behind, found = self.behind, self.sampled
        first, second = self.clock[:LANES], self.clock[LANES : 2 * LANES]
        total = targets - first
        part = total - targets
        low = ((targets - (total - part)) - (first + part)) - second
        behind[:LANES] = total + low
        behind[LANES:] = low - (behind[:LANES] - total)
        self.functions["sample"](self.tables[2], self.ladder.order, *self.sampling)
        return found.reshape(12, LANES).copy()

    def left_all(self) -> Doubles:
        """The steps that each lane may still take."""
        return self.clock[LANES * steps.LEFT : LANES * (steps.LEFT + 1)]

    def taken_out(self, lane: int) -> tuple[Doubles, Doubles]:
        """All that a motion needs to go on in another eight: its state, and its part of the clock."""
        return self.words[lane::LANES].copy(), self.clock[lane::LANES].copy()

    def put_back(self, lane: int, problem: Scaled, forwards: bool, moved: tuple[Doubles, Doubles]) -> None:
        """A motion that was taken out of another eight."""
        self.put(lane, problem, forwards, None)
        self.words[lane::LANES], self.clock[lane::LANES] = moved
        self.clock[LANES * steps.TRIES + lane] = 0.0

    def empty(self, lane: int) -> None:
        """Nothing in this lane: it takes no steps."""
        self.clock[LANES * steps.LEFT + lane] = 0.0

    def aim(self, lane: int, target: Fraction) -> None:
        """Where this lane is to stop, |τ|."""
        words = split(min(target, LARGEST_TIME))
        for k in range(2):
            self.clock[LANES * (steps.TARGET + k) + lane] = words[k]

    def advance(self, rounds: int) -> int:
        """Steps of all lanes that can go, at most so many; gives the rounds after which none could."""
        orders = self.ladder.order, self.low_order, self.pair_order
        taken: int = self.functions["advance"](*self.moving, *orders, *self.tables, rounds)
        return taken

    def time(self, lane: int) -> Fraction:
        """|τ| of the last step end of a lane."""
        return sum((Fraction(float(self.clock[LANES * (steps.TIME + k) + lane])) for k in range(2)), Fraction(0))

    def taken(self, lane: int, most: int | None) -> int:
        """Steps of the motion in a lane, which might take ``most``."""
        return int((_NO_LIMIT if most is None else most) - self.clock[LANES * steps.LEFT + lane])

    def status(self, lane: int) -> Status | None:
        """Whether the motion in a lane can go on; None where it needs a larger n0."""
        flags = int(self.flags[lane])
        if flags & steps.NON_FINITE:
            return Status.NON_FINITE
        if flags & steps.TOO_SMALL:
            return Status.TOO_SMALL
        return None if flags & steps.LARGER_N0 else Status.FINE

    def coefficients(self, lane: int, n: int) -> tuple[Fraction, ...]:
        """y_n of a lane's last series."""
        tables = [self.scratch[place + ROW * n : place + ROW * (n + 1)] for place in (0, LOW)]
        return exact_state(numpy.concatenate(tables)[lane::LANES])

    def state(self, lane: int) -> tuple[Fraction, ...]:
        """Where a lane's motion is."""
        return exact_state(self.words[lane::LANES])

    def samples(self, times: dict[int, Fraction]) -> dict[int, Doubles]:
        """The states of some lanes, each at a time |τ| inside its next step: high words, then low ones, shape (12,)."""
        behind, found = doubles(2 * LANES), doubles(12 * LANES)
        for lane, time in times.items():
            behind[lane], behind[LANES + lane] = self._behind(lane, time)
        self.functions["sample"](self.tables[2], self.ladder.order, pointer(behind), pointer(found))
        return {lane: found[lane::LANES] for lane in times}

    def _behind(self, lane: int, time: Fraction) -> tuple[float, float]:
        """τ of a time |τ| after the beginning of a lane's next step."""
        (a, b), (c, d) = (float(self.clock[LANES * (steps.TIME + k) + lane]).as_integer_ratio() for k in range(2))
        top, bottom = time.as_integer_ratio()
        return split_ratio(self.signs[lane] * (top * b * d - bottom * (a * d + c * b)), bottom * b * d)


def exact_state(words: Doubles) -> tuple[Fraction, ...]:
    """The sums of six high words and the six low ones behind them."""
    return tuple(
        Fraction(high) + Fraction(low) for high, low in zip(words[:6].tolist(), words[6:].tolist(), strict=True)
    )


class OneOfEight(Steps):
    """One step of a motion that is in all eight lanes, for the check of their machine code."""

    def __init__(self, problem: Scaled, ladder: Ladder, low_order: int) -> None:
        self.eight = Eight(problem.system, ladder, low_order)
        self.steps, self.forwards = 0, True
        for lane in range(LANES):
            self.eight.put(lane, problem, True, 1)
            self.eight.aim(lane, LARGEST_TIME)

    @property
    def order(self) -> int:
        return self.eight.ladder.order

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
        return Status.FINE if same and self.time > 0 else Status.NON_FINITE

    def sample(self, time: Fraction) -> tuple[Fraction, ...]:
        # the scratch holds the series at the beginning of the step, time 0
        return exact_state(self.eight.samples({0: self.time + time})[0])

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        return tuple(value * self.time**n for value in self.eight.coefficients(0, n))
