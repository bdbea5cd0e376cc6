"""Motions computed by heyoka at requested times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from operator import ge, le
from time import perf_counter
from typing import Any

import numpy

from heavytop.integrate.heyoka.engines import Compiled, compiled, load, not_finite
from heavytop.integrate.trajectory import (
    Ended,
    Observer,
    Outcome,
    Problem,
    ResumePoint,
    SampledRun,
    TaylorStep,
    Trajectory,
    sampled,
    trajectory_of,
)
from heavytop.precision import DOUBLE, OrderedRing, Precision, exact, number, numbers
from heavytop.top.amplification import rate
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, RoundedTimes, State, check_times

# One run of a compiled integrator, step by step.
#
# No step is cut at a sample: the state there is that of the Taylor polynomial of the step that covers it.  So the steps
# and all later bits depend neither on the requested times nor on how often the run paused for Ctrl-C.


CHUNK_SECONDS = 0.25
_MANY, _CLOSE = 256, 200
"""States at so many times, with at most so many steps between two of them, are computed on a grid by heyoka."""
_AT_ONCE = {"double": 500_000, "extended": 100_000, "quad": 10_000}
"""The most steps of a run that cannot be interrupted: about a second."""
_SHORT, _FEW = 0.97, 100
"""The part of the way to a sample that is taken in steps of the mean length, where more than so many steps are left."""
_GROWTH = 16
"""At most so many times the steps so far are taken at once: few steps say little about the longest."""
_SLOWEST, _FASTEST, _SLOW, _FAST = Fraction(1, 2**48), Fraction(2) ** 40, 2.0**-46, 2.0**38
"""Rates between which no Taylor coefficient leaves the exponent range of double."""


@dataclass(slots=True)
class Stepper(SampledRun):
    """One run of a compiled integrator, advanced step by step to the next sample.

    far: a time beyond every other.  rest: the state, where it is an equilibrium.
    """

    engine: Any
    forwards: bool
    step_limit: int | None
    far: Any
    between: Callable[[], None] | None = None
    steps: int = 0
    time: Any = 0
    _covers: bool = False
    _largest_step: float = 0.0
    _seconds_per_step: float = field(default=CHUNK_SECONDS)
    _one_by_one: bool = False
    rest: Any = None
    _before: Any = None
    _not_finite: Any = field(default_factory=not_finite)

    def covers(self, target: OrderedRing) -> bool:
        """Whether the polynomial of the last step covers ``target``, or the motion is at rest."""
        return self.rest is not None or (self._covers and self._beyond(target))

    def advance(self, target: OrderedRing, most: int | None) -> Outcome:
        """One step, or as many as lie before ``target`` in a quarter of a second."""
        count = self._steps_short_of(target) if most is None else min(self._steps_short_of(target), most)
        return self.single() if count < 2 else self._several(count, target)

    def at(self, target: Any, time: Fraction | None = None) -> tuple[Outcome, Any]:
        """The outcome of :meth:`reach` and, where that is success, the state there."""
        if target == 0:
            return Outcome.SUCCESS, self.engine.state.copy()
        outcome = self.reach(target)
        return outcome, self.sample(target) if outcome is Outcome.SUCCESS else None

    def _beyond(self, target: OrderedRing) -> bool:
        reached = self.engine.dtime  # its sum is the exact time, by which heyoka's grid decides
        return bool(reached >= (target, 0.0) if self.forwards else reached <= (target, 0.0))

    def _steps_short_of(self, target: OrderedRing) -> int:
        """How many steps as long as the longest lie before the target and a quarter of a second."""
        distance = float(target - self.engine.time)
        if not self.forwards:
            distance = -distance
        if self._one_by_one or not self._largest_step or distance < 2 * self._largest_step:
            return 1
        count = min(distance / self._largest_step, CHUNK_SECONDS / self._seconds_per_step, _GROWTH * max(self.steps, 1))
        return int(count)

    def single(self) -> Outcome:
        """Take one step, whose polynomial is then available."""
        engine = self.engine
        state, before, began = engine.state.copy(), engine.dtime, perf_counter()
        self._before = state, before, self.steps
        outcome, length = (engine.step if self.forwards else engine.step_backward)(True)  # write_tc
        self._seconds_per_step = perf_counter() - began
        self._covers, now = True, engine.time
        if outcome == self._not_finite or now - now != 0:  # infinity and nan
            if not at_rest(state, engine.tc):
                return Outcome.NON_FINITE
            self.rest = state
            return Outcome.SUCCESS
        if now == before[0]:
            return Outcome.STEP_TOO_SMALL
        self.steps, self.time = self.steps + 1, now
        size = abs(float(length))
        if size > self._largest_step:
            self._largest_step = size
        return Outcome.SUCCESS

    def _several(self, count: int, target: OrderedRing) -> Outcome:
        state, time = self.engine.state.copy(), self.engine.dtime
        began = perf_counter()
        outcome, _, largest, done, *_ = self.engine.propagate_until(self.far, max_steps=count)
        self._seconds_per_step = (perf_counter() - began) / max(done, 1)
        self._largest_step = max(self._largest_step, abs(float(largest)))
        failed = outcome == self._not_finite
        if failed or self._beyond(target):
            self.engine.state[:] = state
            self.engine.dtime = time
            if failed:
                # repeat one by one, to find the step that fails
                self._one_by_one = True
            else:  # the steps grow
                self._largest_step *= 1.5
            return Outcome.SUCCESS
        self.steps, self.time = self.steps + done, self.engine.time
        self._covers = False
        return Outcome.SUCCESS

    def polynomial(self) -> Any:
        """Taylor coefficients of the last step, a copy, shape (6 or 9, order + 1)."""
        return self.engine.tc.copy()

    def take_up(self, resume_point: ResumePoint, covered: Any) -> None:
        """Resume there: repeat the step that covers the last sample.

        Raises ValueError for a state of another length.
        """
        if len(resume_point.state) != len(self.engine.state):
            raise ValueError(f"a state of {len(resume_point.state)} numbers")
        self.engine.state[:] = numpy.array(resume_point.state)
        self.engine.dtime = resume_point.time
        self.steps, self.time = resume_point.steps, self.engine.time
        self.reach(covered)
        if self.rest is None:
            resume_point.require_covered(self.steps)

    def place(self, samples: int, seconds: float, flags: dict[str, str]) -> ResumePoint:
        """The resume point at the beginning of the last step."""
        state, time, steps = self._before
        return ResumePoint(samples, tuple(state), time, steps, seconds, flags)

    def sample(self, target: OrderedRing) -> Any:
        """The state at ``target``, inside the last step; a copy, shape (6,) or (9,)."""
        self._one_by_one = False
        if self.rest is not None:
            return self.rest.copy()
        return self.engine.update_d_output(target).copy()


@lru_cache(maxsize=64)
def far(forwards: bool, precision: Precision) -> Any:
    """A time beyond every other."""
    time = number(Fraction(2) ** 1000 * (1 if forwards else -1), precision)
    return float(time) if precision.family == "double" else time  # heyoka takes Python's floats in half the time


def at_rest(state: Any, coefficients: Any) -> bool:
    """Whether a motion is constant: at an equilibrium every Taylor coefficient is 0 and heyoka finds no step."""
    return bool(numpy.isfinite(state).all()) and not coefficients[:, 1:].any()


def propagate(
    top: HeavyTop,
    start: State,
    times: Sequence[OrderedRing],
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
    xi: tuple[Fraction, ...] | None = None,
    step_limit: int | None = None,
    observer: Observer | None = None,
    stepping: type[Stepper] = Stepper,
    place: ResumePoint | None = None,
    mark: Callable[[ResumePoint], None] | None = None,
    tolerance: Fraction | None = None,
    high_accuracy: bool = False,
    compact_mode: bool | None = None,
    constants: bool = False,
) -> Trajectory:
    """The motion from ``start`` at t = 0, at ``times``, computed by heyoka in ``precision``.

    times: exact numbers of one sign, strictly monotone away from 0 (0 itself may come first).
    xi: exact initial attitude vector, integrated too.
    step_limit: stop after that many steps; the times reached until then are returned.
    observer: called with (exact time, native state) at each sample in place of storing the states.
    stepping: how steps are taken; another class than heyoka's own has a planted fault.
    place: the resume point of an earlier run of the same problem; the run continues after it, to the same bits.
    mark: called after each sample with the resume point there.
    tolerance, high_accuracy, compact_mode: as in :func:`heavytop.integrate.heyoka.engines.compiled`.
    constants: compile the parameters into the code.

    Raises InputError for times out of order, a format that the platform lacks, data outside its exponent range, a
    start that the system does not admit, and a resume point of other flags.  A failed run is an outcome, not an
    exception.
    """
    problem = Problem.of(top, start, precision, system, xi)
    targets = numbers(check_times(times), precision)
    tool = compiled(
        system,
        precision,
        attitude=xi is not None,
        tolerance=tolerance,
        high_accuracy=high_accuracy,
        compact_mode=compact_mode,
        constants=in_unit(problem, unit_of(problem)).parameters if constants else None,
    )
    engine = tool.take()
    try:
        return integrate_to_samples(
            tool, engine, problem, targets, step_limit, observer, stepping=stepping, place=place, mark=mark
        )
    finally:
        tool.spare.append(engine)


def integrate_to_samples(
    tool: Compiled,
    engine: Any,
    problem: Problem,
    targets: Sequence[Any],
    step_limit: int | None,
    observer: Observer | None,
    between: Callable[[], None] | None = None,
    *,
    stepping: type[Stepper] = Stepper,
    place: ResumePoint | None = None,
    mark: Callable[[ResumePoint], None] | None = None,
) -> Trajectory:
    """The motion of ``problem`` at ``targets``, native numbers in order, computed by ``engine``, one of ``tool``'s."""
    unit = unit_of(problem)
    if unit != 1 and place is None:
        scaled, factor = in_unit(problem, unit), number(unit, problem.precision)
        unscaled = observer and (lambda time, state: observer(time / unit, _from_unit(state, unit)))
        run = integrate_to_samples(
            tool, engine, scaled, [t * factor for t in targets], step_limit, unscaled, between, stepping=stepping
        )
        times, states = tuple(time / unit for time in run.times), [_from_unit(state, unit) for state in run.states]
        return replace(
            run,
            problem=problem,
            times=times,
            states=numpy.array(states).reshape(-1, len(engine.state)),
            time_reached=run.time_reached / unit,
            flags={**run.flags, "unit": f"2^{unit.numerator.bit_length() - unit.denominator.bit_length()}"},
        )
    began = perf_counter()
    if problem.precision.family == "double":
        targets = list(map(float, targets))  # as far() is
    if stepping is Stepper and all(option is None for option in (between, place, mark)):
        at_once = _at_once(engine, lambda: load(engine, problem), targets, step_limit, problem.precision)
        if at_once is not None:
            steps, states = at_once
            stepper = Stepper(engine, bool(targets[-1] >= 0), None, None, steps=steps)
            rounded_times = RoundedTimes(targets)
            if observer is not None:
                for time, state in zip(rounded_times, states, strict=True):
                    observer(time, state)
                states = states[:0]
            seconds = perf_counter() - began
            return _trajectory(tool, problem, stepper, rounded_times, states, Outcome.SUCCESS, seconds)
    load(engine, problem)
    forwards = bool(targets[-1] >= 0)
    stepper = stepping(engine, forwards, step_limit, far(forwards, problem.precision), between)
    ended = sampled(stepper, targets, tool.flags, perf_counter(), observer, place, mark)
    return _trajectory(tool, problem, stepper, *ended)


def unit_of(problem: Problem) -> Fraction:
    """The power of 2 by which time is scaled for the integration: the rate of the motion where a Taylor coefficient of
    double, rate^20 at heyoka's order, would be 0 or infinite; else 1.
    """
    if problem.precision.family != "double" or problem.precision.bits != DOUBLE.bits:
        return Fraction(1)
    p, start = problem.parameters, problem.start.flat
    driven = max(abs(float(value)) for value in (*p.moment, *p.rotors))
    if _SLOW < max(abs(float(value)) for value in start[:3]) < _FAST and driven < _FAST * float(min(p.inertia)):
        return Fraction(1)  # without fractions
    if problem.xi is not None and not any(problem.system.field(p, start)):
        p = p._replace(moment=(Fraction(0),) * 3)  # a steady rotation, whose attitude alone moves
    scale = rate(problem.system, p, start)
    return Fraction(1) if not scale or _SLOWEST < scale < _FASTEST else scale


def in_unit(problem: Problem, unit: Fraction) -> Problem:
    """The motion in the time t ``unit``; exact within the exponent range of the format."""
    p, rotors = problem.parameters, tuple(Fraction(value) / unit for value in problem.parameters.rotors)
    moment = tuple(Fraction(value) / unit**2 for value in p.moment)
    slower = Parameters(p.inertia, moment, rotors if isinstance(p.rotor, tuple) else rotors[0])
    start = State([value / unit for value in problem.start.omega], problem.start.gamma)
    return Problem(problem.system, problem.precision, slower, start, problem.xi)


def _from_unit(state: Any, unit: Fraction) -> Any:
    """A native state in the units of the problem."""
    return numpy.concatenate([state[:3] * float(unit), state[3:]])


def states_at(
    engine: Any, parameters: Any, start: Any, targets: Sequence[Any], step_limit: int | None, precision: Precision
) -> tuple[Any, Outcome, Any, int]:
    """(states at the targets reached, outcome, time reached, steps), bit for bit as :func:`integrate_to_samples`.

    parameters, start: native arrays.  targets: native times, checked.
    """

    def begin() -> None:
        engine.pars[:] = parameters
        engine.state[:] = start
        engine.time = targets[0] * 0

    at_once = _at_once(engine, begin, targets, step_limit, precision)
    if at_once is not None:
        return at_once[1], Outcome.SUCCESS, targets[-1], at_once[0]
    begin()
    forwards = bool(targets[-1] >= 0)
    stepper = Stepper(engine, forwards, step_limit, far(forwards, precision))
    states: list[Any] = []
    for target in targets:
        outcome, state = stepper.at(target)
        if outcome is not Outcome.SUCCESS:
            return states, outcome, stepper.time, stepper.steps
        states.append(state)
    return states, Outcome.SUCCESS, targets[-1], stepper.steps


def _at_once(
    engine: Any, begin: Callable[[], None], targets: Sequence[Any], step_limit: int | None, precision: Precision
) -> tuple[int, Any] | None:
    """Steps and states at many targets, with the bits of :class:`Stepper`, without interruption.

    begin: sets the engine to the beginning; called first to measure the first step, and again for the run.
    On a grid heyoka cuts the last step alone, whose polynomial does not depend on its length.  None for few targets, in
    arbitrary precision, for long runs, and where the last target is not reached; the state of the engine is then
    undefined.
    """
    most = _AT_ONCE.get(precision.family, 0)
    if len(targets) < _MANY or not most:
        return None
    begin()
    end = far(bool(targets[-1] >= 0), precision)
    engine.propagate_until(end, max_steps=1)
    if engine.time == end:  # at rest
        return None
    expected = abs(float(targets[-1])) / abs(float(engine.time))
    if expected > most:
        return None
    begin()
    most = min(step_limit or most, most)
    if expected > _CLOSE * len(targets):
        return _in_strides(engine, targets, most, end)
    start = [] if targets[0] == 0 else [engine.time]
    grid = numpy.concatenate([numpy.array([*start, targets[0]]), numpy.array(targets[1:])])
    _, _, _, steps, _, states = engine.propagate_grid(grid, max_steps=most)
    if len(states) != len(grid) or not numpy.isfinite(states[-1]).all():
        return None
    return steps, states[len(start) :]


def _in_strides(engine: Any, targets: Sequence[Any], most: int, end: Any) -> tuple[int, Any] | None:
    """As :func:`_at_once`, with polynomials of the last steps before each target; heyoka's grid has those of all."""
    states, steps, longest, even, failed = [], 0, 0.0, True, not_finite()
    step, reached = (engine.step, ge) if end > 0 else (engine.step_backward, le)
    for target in targets:
        goal = target, 0.0
        while not reached(now := engine.dtime, goal):
            left = abs(float(target - now[0]))
            count = left / longest if steps else 1
            if by_mean := even and count > _FEW and steps > _FEW:
                count = _SHORT * left * steps / abs(float(now[0]))
            if count < 3:
                (outcome, length), done = step(True), 1  # write_tc
            else:
                state = engine.state.copy()
                outcome, _, length, done, _, _ = engine.propagate_until(end, max_steps=int(count))
                if reached(engine.dtime, goal):
                    engine.state[:], engine.dtime, longest, even = state, now, 1.5 * longest, not by_mean
                    continue
            steps, longest = steps + done, max(longest, abs(float(length)))
            if steps > most or outcome == failed:
                return None
        states.append(engine.update_d_output(target).copy() if steps else engine.state.copy())
    return steps, states


def _trajectory(tool: Compiled, problem: Problem, run: Stepper, *ended: *Ended) -> Trajectory:
    return trajectory_of(problem, "heyoka", run, run.engine.order, tool.seconds, tool.flags, *ended)


def first_steps(
    top: HeavyTop,
    start: State,
    until: Fraction,
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
    stepping: type[Stepper] = Stepper,
    **options: Any,
) -> tuple[Trajectory, list[TaylorStep]]:
    """The steps that begin before the time ``until`` > 0: their ends and polynomials; none at an equilibrium.

    stepping: as in :func:`propagate`; options: as in :func:`heavytop.integrate.heyoka.engines.compiled`.
    """
    problem = Problem.of(top, start, precision, system)
    tool = compiled(system, precision, **options)
    times: list[Fraction] = []
    steps: list[TaylorStep] = []
    outcome = Outcome.SUCCESS
    began = perf_counter()
    end = number(until, precision)
    with tool.borrowed() as engine:
        load(engine, problem)
        stepper = stepping(engine, True, None, None)
        while stepper.time < end and outcome is Outcome.SUCCESS and stepper.rest is None:
            before = engine.state.copy()
            outcome = stepper.single()
            if outcome is Outcome.SUCCESS and stepper.rest is None:
                steps.append(TaylorStep(before, engine.last_h, stepper.polynomial(), engine.state.copy()))
                times.append(exact(engine.time))
        ends = tuple(step.end for step in steps)
        return _trajectory(tool, problem, stepper, tuple(times), ends, outcome, perf_counter() - began), steps
