"""Motions side by side in the SIMD lanes of a batch engine.

The lanes step together, each by its own step size, and none waits for a sample.  A sample that a lane has passed is
computed afterwards by a second engine, which repeats the steps from a copy of the lane made before it and cuts the last
one short.  So no bit depends on the samples, on how many steps are taken between two checks, or on the other lanes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from threading import Event, Semaphore
from time import perf_counter
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

from heavytop.extras import import_heyoka
from heavytop.integrate.heyoka.engines import arrays, compiled, not_finite
from heavytop.integrate.heyoka.motions import CHUNK_SECONDS, at_rest
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE, OrderedRing, exact
from heavytop.top.equations import System

# steps between two checks near a sample; a check costs as much as about ten
_WINDOW = 64
# samples that may wait for the observer
_ROOM = 1000
_FAR = 2.0**1000
# parameters and state of an idle lane: a bounded motion in either system
_DUMMY = 1.0, numpy.linspace(0.1, 1.0, 9)


class StoppedError(Exception):
    """The ensemble was abandoned: another thread failed, or the user interrupted."""


class LaneIntegrator(NamedTuple):
    """An integrator that computes motions in lanes, as their trajectories name it.  seconds: of compiling."""

    name: str
    order: int
    seconds: float
    flags: dict[str, str]


@dataclass(slots=True)
class Work:
    """The work that the threads of an ensemble share.

    targets: native times in order; times: their exact values.  pending: problems that no thread has taken yet.
    send: passes a sample, or a motion that ended, to the thread that observes.  room: for samples on their way.
    lanes: by which integrator motions in lanes are computed.
    """

    targets: list[Any]
    times: list[Fraction]
    step_limit: int | None
    observed: bool
    pending: deque[tuple[int, Problem]]
    stop: Event = field(default_factory=Event)
    lanes: LaneIntegrator = field(init=False)
    send: Callable[[Any], None] = field(init=False)
    room: Semaphore = field(default_factory=lambda: Semaphore(_ROOM))

    @property
    def moves(self) -> bool:
        """Whether the request needs any step."""
        return bool(self.targets[-1] != 0) and (self.step_limit is None or self.step_limit > 0)

    def take(self) -> tuple[int, Problem] | None:
        """A problem that no thread has taken yet."""
        try:
            return self.pending.popleft()
        except IndexError:
            return None

    def observe(self, index: int, time: Fraction, state: Any) -> None:
        """Send one sample to the observer; wait while it is far behind."""
        while not self.room.acquire(timeout=CHUNK_SECONDS):
            self.check()
        self.send((index, time, state))

    def keep(self, run: LaneRun, state: Any) -> None:
        """Send the run's next sample to the observer, or store it."""
        time = self.times[len(run.times)]
        run.times.append(time)
        if self.observed:
            self.observe(run.index, time, state)
        else:
            run.states.append(state)

    def end(self, run: LaneRun, outcome: Outcome, reached: Fraction, steps: int) -> None:
        """Hand in a motion of a lane; reached: its last time, unless it reached its last sample."""
        name, order, compiling, flags = self.lanes
        ended = Trajectory(
            run.problem,
            name,
            tuple(run.times),
            tuple(run.states),
            outcome,
            run.times[-1] if outcome is Outcome.SUCCESS else reached,
            steps,
            order,
            {"compile": compiling, "run": perf_counter() - run.began},
            flags,
        )
        self.finish(run.index, ended)

    def finish(self, index: int, run: Trajectory) -> None:
        """Hand in a motion that ended, after its samples."""
        self.send((index, run))

    def check(self) -> None:
        """Raise StoppedError if the ensemble was abandoned."""
        if self.stop.is_set():
            raise StoppedError


@dataclass(slots=True, eq=False)
class LaneRun:
    """A problem of an ensemble that is being computed, and its samples so far."""

    index: int
    problem: Problem
    began: float
    times: list[Fraction] = field(default_factory=list, kw_only=True)
    states: list[Any] = field(default_factory=list, kw_only=True)


@dataclass(slots=True, eq=False)
class _Run(LaneRun):
    """A run in a lane, or out of it and waiting for its last samples.  passed: how many samples lie behind it."""

    parameters: Any
    passed: int = 0


class _Ends(NamedTuple):
    """The lanes at the end of a step: states (n, lanes), both words of the times, steps taken."""

    states: NDArray[numpy.float64]
    high: NDArray[numpy.float64]
    low: NDArray[numpy.float64]
    steps: Any


class _Sample(NamedTuple):
    """A sample to be computed at ``target``, by steps from the state of its lane before it."""

    run: _Run
    target: OrderedRing
    lane: int
    before: _Ends


class Lanes:
    """The lanes of a thread; each takes the next problem when its own has ended.

    mover and sampler: two copies of the batch engine.
    """

    def __init__(self, work: Work, mover: Any, sampler: Any) -> None:
        self.work = work
        self.mover = mover
        mover.set_time(0.0)
        self.sampler = sampler
        self.lanes: int = mover.batch_size
        self.targets = [target for target in work.targets if target != 0]
        self.direction = 1.0 if self.targets[0] > 0 else -1.0
        self.runs: list[_Run | None] = [None] * self.lanes
        self.distance = numpy.empty(self.lanes)
        self.limits = None if work.step_limit is None else numpy.empty(self.lanes)
        self.steps = numpy.empty(self.lanes, int)
        self.samples: deque[_Sample] = deque()
        self.seconds_per_step = CHUNK_SECONDS
        self.fresh = True
        self.unverified = 0

    def run(self) -> None:
        """Run problems until none is left; raises StoppedError when the ensemble is abandoned."""
        for lane in range(self.lanes):
            self._load(lane)
        while any(self.runs):
            self.work.check()
            self._advance()
        while self.samples:
            self._take_samples()

    def _load(self, lane: int) -> None:
        """Put the next problem into the lane; without one, a dummy motion."""
        taken = self.work.take()
        parameters, state = arrays(taken[1]) if taken else _DUMMY
        run = _Run(*taken, perf_counter(), parameters) if taken else None
        if run and self.work.times[0] == 0:
            self.work.keep(run, state)
        high, low = (word.copy() for word in self.mover.dtime)
        high[lane] = low[lane] = 0.0
        self.mover.set_dtime(high, low)
        self.mover.pars[:, lane] = parameters
        self.mover.state[:, lane] = state[: len(self.mover.state)]
        self.runs[lane] = run
        self.steps[lane] = 0
        self.distance[lane] = abs(self.targets[0]) if run else numpy.inf
        if self.limits is not None:
            self.limits[lane] = self.work.step_limit if run else numpy.inf
        self.fresh = True

    def _advance(self) -> None:
        """Take some steps of every lane; note samples that were passed and lanes that ended."""
        mover = self.mover
        high, low = mover.dtime
        before = _Ends(mover.state.copy(), high.copy(), low.copy(), self.steps.copy())
        count = self._count()
        if count > 1 and not self._several(count):
            # repeat by halves until the step that fails is a single one
            mover.state[:] = before.states
            mover.set_dtime(before.high, before.low)
            self.unverified = count
            return
        failed = self._single(before) if count == 1 else {}
        self.unverified = max(self.unverified - count, 0)
        self.fresh = False
        self.steps += count
        ahead = self.direction * mover.time
        passed = ahead >= self.distance
        if passed.any():
            for lane in numpy.flatnonzero(passed).tolist():
                self._passed(lane, ahead[lane], before)
        while len(self.samples) >= self.lanes:
            self._take_samples()
        for lane, outcome in failed.items():
            self._stop(lane, outcome, before.high[lane], before.steps[lane], before.states[:, lane])
        if self.limits is not None:
            for lane in numpy.flatnonzero(self.steps >= self.limits).tolist():
                self._stop(lane, Outcome.STEP_LIMIT, mover.time[lane], self.steps[lane])

    def _count(self) -> int:
        """How many steps to take at once: nearly up to the nearest sample, at most a quarter of a second of them."""
        if self.fresh:
            return 1
        ahead = self.direction * self.mover.time
        short = 0.95 * ((self.distance - ahead) * self.steps / ahead).min()
        count = max(_WINDOW, min(short, CHUNK_SECONDS / self.seconds_per_step))
        if self.unverified:
            count = min(count, max(self.unverified // 2, 1))
        if self.limits is not None:
            count = min(count, (self.limits - self.steps).min())
        return int(count)

    def _several(self, count: int) -> bool:
        """Take ``count`` steps at once; False if a lane failed in one of them, or its time may not have moved."""
        began = perf_counter()
        self.mover.propagate_until(self.direction * _FAR, max_steps=count)
        self.seconds_per_step = (perf_counter() - began) / count
        outcomes, smallest, *_ = zip(*self.mover.propagate_res, strict=True)
        ahead = self.direction * self.mover.time
        moved = (ahead < _FAR) & (2 * numpy.array(smallest) > numpy.spacing(ahead))
        return not_finite() not in outcomes and bool(moved.all())

    def _single(self, before: _Ends) -> dict[int, Outcome]:
        """Take one step; returns the lanes that failed in it, with SUCCESS for those at rest."""
        mover, bad = self.mover, not_finite()
        (mover.step if self.direction > 0 else mover.step_backward)(write_tc=True)
        failed = {}
        for lane, (outcome, _) in enumerate(mover.step_res):
            if outcome == bad:
                rests = at_rest(before.states[:, lane], mover.tc[:, :, lane])
                failed[lane] = Outcome.SUCCESS if rests else Outcome.NON_FINITE
            elif mover.time[lane] == before.high[lane]:
                failed[lane] = Outcome.STEP_TOO_SMALL
        if failed:
            # heyoka accepts no times while one is NaN
            high, low = (word.copy() for word in mover.dtime)
            for lane in failed:
                high[lane], low[lane] = before.high[lane], before.low[lane]
            mover.set_dtime(high, low)
        return failed

    def _passed(self, lane: int, ahead: Any, before: _Ends) -> None:
        """Note the samples that the lane has passed; after the last one, load the next problem."""
        run = self.runs[lane]
        assert run is not None
        while run.passed < len(self.targets) and ahead >= abs(target := self.targets[run.passed]):
            self.samples.append(_Sample(run, target, lane, before))
            run.passed += 1
        if run.passed < len(self.targets):
            self.distance[lane] = abs(self.targets[run.passed])
        else:
            self._load(lane)

    def _take_samples(self) -> None:
        """Compute the oldest samples, as many as there are lanes; a run whose last one is among them ends."""
        batch = [self.samples.popleft() for _ in range(min(self.lanes, len(self.samples)))]
        padded = batch + batch[:1] * (self.lanes - len(batch))
        sampler = self.sampler
        sampler.pars[:] = numpy.array([sample.run.parameters for sample in padded]).T
        sampler.state[:] = numpy.array([sample.before.states[:, sample.lane] for sample in padded]).T
        sampler.set_dtime(
            numpy.array([sample.before.high[sample.lane] for sample in padded]),
            numpy.array([sample.before.low[sample.lane] for sample in padded]),
        )
        sampler.propagate_until(numpy.array([sample.target for sample in padded]))
        states = sampler.state.T.copy()
        for sample, state, (*_, steps) in zip(batch, states, sampler.propagate_res, strict=False):
            run = sample.run
            self.work.keep(run, state)
            if len(run.times) == len(self.work.times):
                self.work.end(run, Outcome.SUCCESS, Fraction(0), int(sample.before.steps[sample.lane]) + steps)

    def _stop(self, lane: int, outcome: Outcome, time: OrderedRing, steps: Any, equilibrium: Any = None) -> None:
        """End the run in the lane; SUCCESS where it stays at ``equilibrium``."""
        while self.samples:
            self._take_samples()
        if run := self.runs[lane]:
            while outcome is Outcome.SUCCESS and len(run.times) < len(self.work.times):
                self.work.keep(run, equilibrium.copy())
            self.work.end(run, outcome, Fraction(0) if outcome is Outcome.SUCCESS else exact(time), int(steps))
        self._load(lane)


# Many short motions of one system at the same times, as arrays: heyoka's lanes, one call for eight motions.
#
# The states are those of :func:`heavytop.integrate.ensemble.propagate_ensemble`, bit for bit: heyoka's dense output is
# the polynomial of its step, and a step that is cut short evaluates the same one.


LANES = 8


def states_on_a_grid(
    system: System,
    parameters: NDArray[numpy.float64],
    starts: NDArray[numpy.float64],
    times: Sequence[Fraction],
    **options: Any,
) -> tuple[Any, Any, Any]:
    """States (motions, samples, 6), steps (motions,), and for each motion whether they are valid.

    parameters: (motions, k), doubles that enter the field.  starts: (motions, 6).  times: doubles, increasing from
    above 0.  options: tolerance.  The states are valid where this motion and the seven beside it reached the last time
    by steps that move their time.
    """
    heyoka = import_heyoka()

    tool = compiled(system, DOUBLE, lanes=LANES, **options)
    count, ends = len(starts), numpy.array([0.0, *map(float, times)])
    grid = numpy.repeat(ends[:, None], LANES, axis=1)
    spacing = numpy.spacing(ends[-1])
    states = numpy.full((count, len(times), 6), numpy.nan)
    steps, good = numpy.zeros(count, int), numpy.zeros(count, bool)
    with tool.borrowed() as engine, numpy.errstate(all="ignore"):
        for first in range(0, count, LANES):
            indices = numpy.minimum(numpy.arange(first, first + LANES), count - 1)
            engine.set_time(0.0)
            engine.pars[:] = parameters[indices].T
            engine.state[:] = starts[indices].T
            grid_run = engine.propagate_grid(grid)
            results = engine.propagate_res
            reached = heyoka.taylor_outcome.time_limit
            moved = all(result[0] == reached and 2 * result[1] > spacing for result in results)
            states[indices] = (grid_run[1] if isinstance(grid_run, tuple) else grid_run)[1:].transpose(2, 0, 1)
            steps[indices] = [result[3] for result in results]
            good[indices] = moved and numpy.isfinite(states[indices]).all()
    return states, steps, good
