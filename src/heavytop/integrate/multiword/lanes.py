"""Motions in double-double, eight side by side in each thread.

n0 is the same for all eight.  A motion that needs a larger one leaves its lane and resumes among others with a larger
n0; so its bits depend on nothing but itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from itertools import permutations
from math import ceil
from time import perf_counter
from typing import Any

import numpy
from numpy.typing import NDArray

from heavytop.integrate.ensemble import in_threads, work_of
from heavytop.integrate.heyoka.lanes import LaneIntegrator, LaneRun, Work
from heavytop.integrate.multiword.engines import DoubleDouble, choose, compiled_lanes, floats, wanted_tolerance
from heavytop.integrate.multiword.motions import (
    CHUNK_SECONDS,
    OUTCOMES,
    integrate_to_samples,
    native_state,
    sums_of_two,
)
from heavytop.integrate.trajectory import EnsembleObserver, Finished, Outcome, Problem, Trajectory
from heavytop.multiword.codegen.machine_code import LANES, Doubles
from heavytop.multiword.codegen.recurrence import LEAST_LOW_ORDER
from heavytop.multiword.double_double.double_double_run import terms
from heavytop.multiword.double_double.eight_lane_run import (
    LARGER_N0,
    LEFT,
    NON_FINITE,
    TOO_SMALL,
    Eight,
    exact_state,
)
from heavytop.multiword.fixed_point.fixed_point_run import TINY_BITS
from heavytop.multiword.pairs import Numerators, Pairs
from heavytop.multiword.problem import Scaled
from heavytop.precision import DOUBLE_DOUBLE
from heavytop.top.equations import HEAVY_TOP, Parameters

_FIRST_CHUNK = 64
_RISE = 2


@dataclass(slots=True, eq=False)
class _Motion(LaneRun):
    """A motion that is being computed.  instants: its exact times; moved: its words, between two groups of eight."""

    scaled: Scaled
    exponents: tuple[int, ...]
    instants: list[Fraction]
    moved: tuple[Doubles, Doubles] | None = None

    @property
    def target(self) -> Fraction:
        """The next of its times, |τ|."""
        return abs(self.instants[len(self.times)]) * self.scaled.rate

    def native(self, words: Doubles) -> Any:
        """A state in words of its units, rounded to the format; None where a number is too large for it."""
        pairs = zip(words[:6].tolist(), words[6:].tolist(), self.exponents, strict=True)
        numbers = sums_of_two(pairs, self.problem.precision)
        return self.exactly(exact_state(words)) if numbers is None else numpy.array(numbers)

    def exactly(self, state: tuple[Fraction, ...]) -> Any:
        """An exact state, rounded to the format; None where a number is too large for it."""
        return native_state(self.scaled.back(state), self.problem.precision)


def first_low_order(arithmetic: DoubleDouble) -> int:
    """n0 where coefficients fall by as much from order to order as those of a motion near a singularity do."""
    return max(LEAST_LOW_ORDER, ceil(arithmetic.in_lanes.room / arithmetic.in_lanes.reach))


@dataclass(slots=True)
class WordsLanes:
    """The eight lanes of a thread.  others: problems that need another arithmetic."""

    work: Work
    arithmetic: DoubleDouble
    tolerance: Fraction | None
    others: deque[tuple[int, Problem]] = field(default_factory=deque)
    lanes: dict[int, _Motion] = field(default_factory=dict)
    waiting: deque[_Motion] = field(default_factory=deque)
    outgrown: deque[_Motion] = field(default_factory=deque)
    chunk: int = _FIRST_CHUNK

    @property
    def forwards(self) -> bool:
        """Whether time is positive."""
        return bool(self.work.targets[-1] >= 0)

    def run(self) -> None:
        """Run until no problem is left, with a larger n0 for those that need it."""
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
        """Put a motion into every idle lane, while there are any."""
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
            arithmetic, scaled = choose(problem, self.tolerance)
            if arithmetic != self.arithmetic:
                self.others.append(taken)
                continue
            motion = _Motion(index, problem, perf_counter(), scaled, scaled.exponents, self.work.times)
            if not scaled.rest:
                return motion
            for _ in self.work.times:
                self.work.keep(motion, motion.exactly(scaled.state))
            self.work.end(motion, Outcome.SUCCESS, Fraction(0), 0)
        return None

    def _aim(self, eight: Eight, lane: int) -> None:
        """Set the next target of the motion in a lane; end the motion after its last sample."""
        motion = self.lanes[lane]
        if not motion.times and not motion.target:
            self.work.keep(motion, motion.exactly(motion.scaled.state))
        if len(motion.times) == len(self.work.times):
            steps = eight.taken(lane, self.work.step_limit)
            self._leave(eight, lane, Outcome.SUCCESS, steps + 1)
            return
        eight.aim(lane, motion.target)

    def _round(self, eight: Eight) -> None:
        """Take a chunk of steps; end or move motions, and sample where all lanes wait."""
        self.work.check()
        began = perf_counter()
        rounds = eight.advance(self.chunk)
        seconds_per_round = (perf_counter() - began) / (rounds + 1)
        waiting = rounds < self.chunk
        self.chunk = max(1, min(4 * self.chunk, int(CHUNK_SECONDS / seconds_per_round)))
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
        """Sample every motion at its target: all lanes wait there."""
        samples = eight.samples({lane: motion.target for lane, motion in self.lanes.items()})
        for lane, words in samples.items():
            motion = self.lanes[lane]
            if (native := motion.native(words)) is None:  # too large for the format
                self._leave(eight, lane, Outcome.NON_FINITE, eight.taken(lane, self.work.step_limit))
            else:
                self.work.keep(motion, native)
                self._aim(eight, lane)

    def _leave(self, eight: Eight, lane: int, outcome: Outcome, steps: int) -> None:
        motion = self.lanes.pop(lane)
        eight.empty(lane)
        sign = 1 if self.forwards else -1
        self.work.end(motion, outcome, sign * eight.time(lane) / motion.scaled.rate, steps)


# Many motions in multi-word arithmetic: eight in lanes where double-double serves, threads on top.


def propagate_multiword_ensemble(
    problems: Sequence[Problem],
    times: Sequence[Any],
    *,
    observer: EnsembleObserver | None = None,
    finished: Finished | None = None,
    threads: int | None = None,
    step_limit: int | None = None,
    tolerance: Fraction | None = None,
) -> list[Trajectory]:
    """The motions of ``problems`` at ``times``, computed in multi-word arithmetic, in the order of the problems.

    Where double-double serves the format and the tolerance, eight go side by side, unless they carry an attitude; else
    each by itself, to the bits of :func:`heavytop.integrate.multiword.motions.propagate_multiword`.  No bit of a motion
    depends on the others.  The arguments: as in :func:`heavytop.integrate.ensemble.propagate_ensemble`; tolerance: as
    in :func:`heavytop.integrate.multiword.motions.propagate_multiword`.

    Raises InputError for no problems, for problems of several kinds, for times out of order, for fewer than 1 thread,
    and what that raises.
    """
    first, work = work_of(problems, times, step_limit, observer)
    arithmetic = floats(wanted_tolerance(first.precision, tolerance))
    if arithmetic is not None and first.xi is None and work.moves:
        schedule = arithmetic.in_lanes
        rule = f"radius of convergence times 2^{schedule.reach:.3f}, ten bits"
        flags = arithmetic.flags | {"lanes": str(LANES), "order": str(schedule.order), "step_rule": rule}
        work.lanes = LaneIntegrator("multiword", schedule.order, compiled_lanes(first.system), flags)
        run = partial(_in_lanes, work, arithmetic, tolerance)
        return in_threads(run, work, threads, LANES, observer, finished)
    return in_threads(lambda: _alone(work, tolerance, iter(work.take, None)), work, threads, 1, observer, finished)


def _in_lanes(work: Work, arithmetic: DoubleDouble, tolerance: Fraction | None) -> None:
    """One thread of lanes, and afterwards the problems that need another arithmetic."""
    lanes = WordsLanes(work, arithmetic, tolerance)
    lanes.run()
    _alone(work, tolerance, lanes.others)


def _alone(work: Work, tolerance: Fraction | None, problems: Iterable[tuple[int, Problem]]) -> None:
    """Single runs, one after the other."""
    for index, problem in problems:
        observer = partial(work.observe, index) if work.observed else None
        run = integrate_to_samples(problem, work.targets, tolerance, work.step_limit, observer, work.check)
        work.finish(index, run)


# Many short motions of heavy tops at the same times, as arrays: double-double in lanes, no exact number per motion.
#
# The computation above for usual motions: doubles of moderate size, forwards.


_LARGE = 2.0**60
_RESTING = 2.0 ** (-2 * TINY_BITS)
_UNITS = numpy.eye(6).tolist()


def double_double_states(
    parameters: NDArray[numpy.float64],
    starts: NDArray[numpy.float64],
    times: Sequence[Fraction],
    tolerances: Sequence[Fraction],
    step_limit: int,
) -> list[tuple[Pairs, Any]]:
    """States (motions, samples, 6) of heavy tops by each tolerance, and for each motion whether they are valid.

    parameters: doubles (motions, 6), I and n.  starts: (motions, 6).  times: doubles, increasing from above 0.
    """
    compiled_lanes(HEAVY_TOP)
    with numpy.errstate(all="ignore"):
        grid = _Grid(parameters, starts, numpy.array([float(time) for time in times]))
        return [grid.run(tolerance, step_limit) for tolerance in tolerances]


class _Grid:
    """Problems in units in which their numbers are near 1, as in :mod:`heavytop.multiword.problem`, and their
    states.
    """

    def __init__(self, parameters: NDArray[numpy.float64], starts: NDArray[numpy.float64], times: Any) -> None:
        constants = _constants(parameters)
        gamma = _power_above(numpy.abs(starts[:, 3:]).max(axis=1))
        torque = numpy.abs(constants[3:, 0]).max(axis=0) * 2.0**gamma
        speed = numpy.abs(starts[:, :3]).max(axis=1)
        free, driven = _power_above(speed), -(-_power_above(torque) // 2)
        rate = numpy.where(torque == 0, free, numpy.where(speed == 0, driven, numpy.maximum(free, driven)))
        self.exponents = numpy.stack([rate] * 3 + [gamma] * 3, axis=1)
        self.begin = numpy.ldexp(starts, -self.exponents)
        constants[3:] = numpy.ldexp(constants[3:], gamma - 2 * rate)
        self.constants = constants
        self.times = numpy.ldexp(times[None, :], rate[:, None])
        self.order = numpy.argsort(numpy.maximum(speed, numpy.sqrt(torque)), kind="stable")
        self.usual = self._are_usual()

    def _are_usual(self) -> Any:
        """Motions that are no equilibria and all of whose components double-double resolves."""
        state, constants = numpy.abs(self.begin), numpy.abs(self.constants[:, 0].T)

        def above(values: NDArray[numpy.float64], bits: int) -> Any:
            return ((values == 0) | (values > 2.0**-bits)).all(axis=1)

        moderate = above(state, TINY_BITS // 2 - 1) & above(constants, TINY_BITS // 2 - 1)
        resolved = above(state, TINY_BITS - 1) & ((state > 0).all(axis=1) | moderate)
        turning = numpy.abs(numpy.cross(self.begin[:, 3:], self.begin[:, :3])).max(axis=1) > _RESTING
        bounded = (constants < _LARGE).all(axis=1) & (numpy.abs(self.exponents) < 300).all(axis=1)
        return resolved & turning & bounded & numpy.isfinite(self.begin).all(axis=1)

    def run(self, tolerance: Fraction, step_limit: int) -> tuple[Pairs, Any]:
        """The states by this tolerance, and for each motion whether they are valid."""
        arithmetic = floats(wanted_tolerance(DOUBLE_DOUBLE, tolerance))
        assert arithmetic is not None
        self.valid = numpy.zeros(len(self.begin), bool)
        self.samples = numpy.full((*self.times.shape, 12), numpy.nan)
        pending, low_order = numpy.flatnonzero(self.usual), first_low_order(arithmetic)
        while len(pending) and low_order < arithmetic.in_lanes.order:
            pending = self._advance(pending, arithmetic, low_order, step_limit)
            low_order += _RISE
        return self._states(), self.valid

    def _advance(self, pending: Any, arithmetic: DoubleDouble, low_order: int, step_limit: int) -> Any:
        """Compute these motions, those of like rates side by side; returns those that need a larger n0."""
        position = numpy.empty(len(self.order), int)
        position[self.order] = numpy.arange(len(self.order))
        ordered = pending[numpy.argsort(position[pending])]
        eight = Eight(HEAVY_TOP, arithmetic.in_lanes, low_order)
        larger = []
        for first in range(0, len(ordered), LANES):
            eights = ordered[numpy.minimum(numpy.arange(first, first + LANES), len(ordered) - 1)]
            words = numpy.zeros((12, LANES))
            words[:6] = self.begin[eights].T
            eight.begin(slice(None), words, self.constants[:, :, eights], True, step_limit)
            for sample, targets in enumerate(self.times[eights].T):
                self.samples[eights, sample] = eight.reach_all(targets).T
            larger += eights[(eight.flags & (LARGER_N0 | NON_FINITE | TOO_SMALL)) == LARGER_N0].tolist()
            self.valid[eights] = (eight.flags == 0) & (eight.clock[LEFT] > 0)
        return numpy.unique(numpy.array(larger, int))

    def _states(self) -> Pairs:
        """The samples in the units of the problems; NaN where they are not valid."""
        high, low = (numpy.ldexp(self.samples[:, :, k : k + 6], self.exponents[:, None, :]) for k in (0, 6))
        total = high + low
        total[~self.valid] = numpy.nan
        return Pairs(total, low - (total - high))


def _constants(parameters: NDArray[numpy.float64]) -> Doubles:
    """The coefficients of Ω × Ω and of the linear part, read off the field, three words each: (k, 3, motions)."""
    numbers = [Numerators(column, numpy.zeros(1)) for column in parameters.T]
    rounded = Parameters(tuple(numbers[:3]), tuple(numbers[3:6]), 0)

    def rate(component: int, *axes: int) -> Any:
        return HEAVY_TOP.field(rounded, [sum((_UNITS[axis][i] for axis in axes), 0.0) for i in range(6)])[component]

    cyclic = [order for order in permutations(range(3)) if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    products = [rate(i, j, k) for i, j, k in cyclic]
    return numpy.array([*products, *(rate(component, source) for _, component, source in terms(HEAVY_TOP))])


def _power_above(values: NDArray[numpy.float64]) -> Any:
    """log2 of the least powers of two that are not less; 0 for 0."""
    part, exponent = numpy.frexp(values)
    return exponent - (part == 0.5)
