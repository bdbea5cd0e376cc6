"""Motions in double-double, eight side by side in each thread.

n0 is the same for all eight.  A motion that comes to need a larger one leaves its lane, and goes on from where it was
among others with a larger one; so its bits depend on nothing but itself.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil
from time import perf_counter
from typing import Any

import numpy

from heavytop.integrate.lanes import Work
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.integrate.words import CHUNK_SECONDS, OUTCOMES, native_state, sums_of_two
from heavytop.integrate.words_engines import DoubleDouble, choose
from heavytop.words.eight import Eight, exact_state
from heavytop.words.machine import Doubles
from heavytop.words.recurrence import LEAST_LOW_ORDER
from heavytop.words.scaled import Scaled
from heavytop.words.vector import LANES

_FIRST_CHUNK = 64
_RISE = 2


@dataclass(slots=True, eq=False)
class _Motion:
    """A problem on its way; targets: its times |τ|; moved: its words, between two eights."""

    index: int
    problem: Problem
    scaled: Scaled
    exponents: tuple[int, ...]
    targets: list[Fraction]
    began: float
    moved: tuple[Doubles, Doubles] | None = None
    times: list[Fraction] = field(default_factory=list)
    states: list[Any] = field(default_factory=list)

    @property
    def target(self) -> Fraction:
        """The next of its times."""
        return self.targets[len(self.times)]

    def native(self, words: Doubles) -> Any:
        """A state in words of its units, rounded to the format; None where a number is too large for it."""
        each = zip(words[:6].tolist(), words[6:].tolist(), self.exponents, strict=True)
        found = sums_of_two(each, self.problem.precision)
        return self.exactly(exact_state(words)) if found is None else numpy.array(found)

    def exactly(self, state: tuple[Fraction, ...]) -> Any:
        """The same of an exact state."""
        return native_state(self.scaled.back(state), self.problem.precision)


def first_low_order(arithmetic: DoubleDouble) -> int:
    """n0 where coefficients fall by as much from order to order as those of a motion near a singularity do."""
    return max(LEAST_LOW_ORDER, ceil(arithmetic.in_lanes.room / arithmetic.in_lanes.reach))


class WordsLanes:
    """One thread's eight lanes.

    seconds: of compiling.  others: where problems go that need another arithmetic.
    """

    def __init__(
        self,
        work: Work,
        arithmetic: DoubleDouble,
        tolerance: Fraction | None,
        seconds: float,
        others: deque[tuple[int, Problem]],
    ) -> None:
        self.work, self.arithmetic, self.tolerance, self.seconds = work, arithmetic, tolerance, seconds
        self.others = others
        self.forwards = bool(work.targets[-1] >= 0)
        self.targets: dict[Fraction, list[Fraction]] = {}
        self.lanes: dict[int, _Motion] = {}
        self.waiting: deque[_Motion] = deque()
        self.outgrown: deque[_Motion] = deque()
        self.chunk = _FIRST_CHUNK

    def _own_flags(self) -> dict[str, str]:
        ladder = self.arithmetic.in_lanes
        rule = f"radius of convergence times 2^{ladder.reach:.3f}, ten bits"
        return {"lanes": str(LANES), "order": str(ladder.order), "step_rule": rule}

    def run(self) -> None:
        """Until no problem is left, with n0 rising for those that outgrow it."""
        low_order = first_low_order(self.arithmetic)
        while True:
            eight: Eight | None = None
            while (eight := self._fill(eight, low_order)) is not None and self.lanes:
                self._round(eight)
            if not self.outgrown:
                return
            self.waiting, self.outgrown = self.outgrown, deque()
            low_order += _RISE

    def _fill(self, eight: Eight | None, low_order: int) -> Eight | None:
        """Put a motion into every lane that has none, as long as there are any."""
        for lane in range(LANES):
            while lane not in self.lanes and (motion := self._next()) is not None:
                if eight is None:
                    eight = Eight(motion.problem.system, self.arithmetic.in_lanes, low_order)
                if motion.moved is None:
                    eight.put(lane, motion.scaled, self.forwards, self.work.step_limit)
                else:
                    eight.put_back(lane, motion.scaled, self.forwards, motion.moved)
                self.lanes[lane] = motion
                self._aim(eight, lane)
        return eight

    def _next(self) -> _Motion | None:
        if self.waiting:
            return self.waiting.popleft()
        while (taken := self.work.take()) is not None:
            index, problem = taken
            own, scaled = choose(problem, self.tolerance)
            if own != self.arithmetic:
                self.others.append(taken)
                continue
            if scaled.rate not in self.targets:
                self.targets[scaled.rate] = [abs(time) * scaled.rate for time in self.work.times]
            motion = _Motion(index, problem, scaled, scaled.exponents, self.targets[scaled.rate], perf_counter())
            if not scaled.rest:
                return motion
            for _ in self.work.times:
                self._record(motion, motion.exactly(scaled.state))
            self._finish(motion, Outcome.SUCCESS, Fraction(0), 0)
        return None

    def _aim(self, eight: Eight, lane: int) -> None:
        """The next time of the motion in a lane; at 0 it is there already.  Without one left it is over."""
        motion = self.lanes[lane]
        if not motion.times and not motion.target:
            self._record(motion, motion.exactly(motion.scaled.state))
        if len(motion.times) == len(self.work.times):
            steps = eight.taken(lane, self.work.step_limit)
            self._leave(eight, lane, Outcome.SUCCESS, steps + 1)
            return
        eight.aim(lane, motion.target)

    def _round(self, eight: Eight) -> None:
        """A chunk of steps, and whatever the lanes came to."""
        self.work.check()
        began = perf_counter()
        rounds = eight.advance(self.chunk)
        a_round = (perf_counter() - began) / (rounds + 1)
        waiting = rounds < self.chunk
        self.chunk = max(1, min(4 * self.chunk, int(CHUNK_SECONDS / a_round)))
        for lane, motion in list(self.lanes.items()):
            status = eight.status(lane)
            if status is None:
                motion.moved = eight.taken_out(lane)
                self.outgrown.append(motion)
                del self.lanes[lane]
                eight.empty(lane)
            elif (outcome := OUTCOMES[status]) is not Outcome.SUCCESS:
                self._leave(eight, lane, outcome, eight.taken(lane, self.work.step_limit))
            elif waiting and eight.taken(lane, self.work.step_limit) == self.work.step_limit:
                self._leave(eight, lane, Outcome.STEP_LIMIT, self.work.step_limit)
        if waiting:
            self._sample(eight)

    def _sample(self, eight: Eight) -> None:
        """The next time of every motion: each lane that is left waits for it."""
        found = eight.samples({lane: motion.target for lane, motion in self.lanes.items()})
        for lane, words in found.items():
            motion = self.lanes[lane]
            if self._record(motion, motion.native(words)):
                self._aim(eight, lane)
            else:
                self._leave(eight, lane, Outcome.NON_FINITE, eight.taken(lane, self.work.step_limit))

    def _record(self, motion: _Motion, native: Any) -> bool:
        """Keep a sample, or send it to the observer; False where there is none, being too large for the format."""
        if native is None:
            return False
        time = self.work.times[len(motion.times)]
        motion.times.append(time)
        if self.work.observed:
            self.work.observe(motion.index, time, native)
        else:
            motion.states.append(native)
        return True

    def _leave(self, eight: Eight, lane: int, outcome: Outcome, steps: int) -> None:
        motion = self.lanes.pop(lane)
        eight.empty(lane)
        sign = 1 if self.forwards else -1
        self._finish(motion, outcome, sign * eight.time(lane) / motion.scaled.rate, steps)

    def _finish(self, motion: _Motion, outcome: Outcome, reached: Fraction, steps: int) -> None:
        self.work.finish(
            motion.index,
            Trajectory(
                motion.problem,
                "multiword",
                tuple(motion.times),
                tuple(motion.states),
                outcome,
                motion.times[-1] if outcome is Outcome.SUCCESS else reached,
                steps,
                self.arithmetic.in_lanes.order,
                {"compile": self.seconds, "run": perf_counter() - motion.began},
                self.arithmetic.flags | self._own_flags(),
            ),
        )
