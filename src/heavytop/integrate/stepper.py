"""One run of a compiled integrator, step by step.

Runs are cut by steps, never by times: a sample is taken from the Taylor polynomial of the step that covers it, so the
steps and all later bits do not depend on which samples were asked for, nor on how often the run gave way to Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from time import perf_counter
from typing import Any

import heyoka
import numpy

from heavytop.integrate.trajectory import Outcome, Place
from heavytop.precision import Precision, number

CHUNK_SECONDS = 0.25
_ON_A_GRID = ("double", "extended", "quad")
_MANY, _CLOSE = 256, 20
"""States at so many times, of which so many steps lie between two at most, are computed in one call of heyoka."""


@dataclass(slots=True)
class Stepper:
    """One run of a compiled integrator, advanced step by step to wherever the next sample lies.

    between: called between chunks; it may raise to give the run up.
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
    _mean_step: float = 0.0
    _part: float = 0.95
    _seconds_per_step: float = field(default=CHUNK_SECONDS)
    _one_by_one: bool = False
    rest: Any = None
    _before: Any = None

    def reach(self, target: Any) -> Outcome:
        """Step until the polynomial of the last step covers ``target``."""
        while self.rest is None and not (self._covers and self._beyond(target)):
            if self.step_limit is not None and self.steps >= self.step_limit:
                return Outcome.STEP_LIMIT
            if self.between is not None:
                self.between()
            count = self._steps_short_of(target)
            outcome = self.single() if count < 2 else self._several(count, target)
            if outcome is not Outcome.SUCCESS:
                return outcome
        return Outcome.SUCCESS

    def at(self, target: Any) -> tuple[Outcome, Any]:
        """The outcome of :meth:`reach` and, where that is success, the state there."""
        if target == 0:
            return Outcome.SUCCESS, self.engine.state.copy()
        outcome = self.reach(target)
        return outcome, self.sample(target) if outcome is Outcome.SUCCESS else None

    def _beyond(self, target: Any) -> bool:
        return bool(self.engine.time >= target if self.forwards else self.engine.time <= target)

    def _steps_short_of(self, target: Any) -> int:
        """How many steps can be taken at once, short of the target, the step limit and a quarter of a second."""
        if self._one_by_one or not self._largest_step or self._beyond(target):
            return 1
        distance = abs(float(target - self.engine.time))
        # many steps average out; each of a few may be as long as the longest so far
        far = distance > 100 * self._largest_step
        count = self._part * distance / self._mean_step if far else distance / self._largest_step
        # a few steps say little of the mean of many
        count = min(count, CHUNK_SECONDS / self._seconds_per_step, 16 * max(self.steps, 1))
        if self.step_limit is not None:
            count = min(count, self.step_limit - self.steps)
        return int(count)

    def single(self) -> Outcome:
        """One step, whose polynomial is then at hand."""
        before, state, began = self.engine.time, self.engine.state.copy(), perf_counter()
        self._before = state, self.engine.dtime, self.steps
        outcome, _ = (self.engine.step if self.forwards else self.engine.step_backward)(write_tc=True)
        self._seconds_per_step = perf_counter() - began
        self._covers = True
        if outcome == heyoka.taylor_outcome.err_nf_state or not numpy.isfinite(self.engine.time):
            if not at_rest(state, self.engine.tc):
                return Outcome.NON_FINITE
            self.rest = state
            return Outcome.SUCCESS
        if self.engine.time == before:
            return Outcome.STEP_TOO_SMALL
        self._went(1)
        self._largest_step = max(self._largest_step, abs(float(self.engine.last_h)))
        return Outcome.SUCCESS

    def _several(self, count: int, target: Any) -> Outcome:
        state, time = self.engine.state.copy(), self.engine.dtime
        began = perf_counter()
        outcome, _, largest, done, *_ = self.engine.propagate_until(self.far, max_steps=count)
        self._seconds_per_step = (perf_counter() - began) / max(done, 1)
        # a longest step that was ever taken seldom is too short; half as long again surely is enough soon
        self._largest_step = max(self._largest_step, abs(float(largest)))
        failed = outcome == heyoka.taylor_outcome.err_nf_state
        if failed or self._beyond(target):
            # what has been seen of the steps behind the target says how many lie before it
            self._mean_step, self._part = abs(float(self.engine.time)) / (self.steps + done), self._part / 2
            self.engine.state[:] = state
            self.engine.dtime = time
            if failed:
                # over the same ground again, one by one, to find where
                self._one_by_one = True
            else:
                self._largest_step *= 1.5
            return Outcome.SUCCESS
        self._went(done)
        self._covers = False
        return Outcome.SUCCESS

    def _went(self, steps: int) -> None:
        self.steps += steps
        self.time = self.engine.time
        self._mean_step, self._part = abs(float(self.time)) / self.steps, 0.95

    def polynomial(self) -> Any:
        """Taylor coefficients of the last step, a copy, shape (6 or 9, order + 1)."""
        return self.engine.tc.copy()

    def begin(self, place: Place) -> None:
        """Go on from there; raises ValueError for a state of another length."""
        if len(place.state) != len(self.engine.state):
            raise ValueError(f"a state of {len(place.state)} numbers")
        self.engine.state[:] = numpy.array(place.state)
        self.engine.dtime = place.time
        self.steps, self.time = place.steps, self.engine.time

    def place(self, samples: int, seconds: float, flags: dict[str, str]) -> Place:
        """Where the last step began."""
        state, time, steps = self._before
        return Place(samples, tuple(state), time, steps, seconds, flags)

    def sample(self, target: Any) -> Any:
        """The state at ``target``, inside the last step; a copy, shape (6,) or (9,)."""
        self._one_by_one = False
        if self.rest is not None:
            return self.rest.copy()
        return self.engine.update_d_output(target).copy()


def are_many(targets: Sequence[Any], precision: Precision) -> bool:
    """Whether one call of heyoka may be worth its while."""
    return len(targets) >= _MANY and precision.family in _ON_A_GRID


def dense(engine: Any, targets: Sequence[Any], precision: Precision) -> bool:
    """Whether there are few steps between :func:`are_many` targets; takes the first step of ``engine`` to see."""
    engine.propagate_until(far(bool(targets[-1] >= 0), precision), max_steps=1)
    return abs(float(targets[-1])) <= _CLOSE * len(targets) * abs(float(engine.time))


def on_a_grid(engine: Any, targets: Sequence[Any], precision: Precision, most: int | None) -> tuple[int, Any] | None:
    """Steps taken from t = 0 to the last of ``targets``, and the states at all of them, an array of shape (n, 6 or 9).

    The same bits as :class:`Stepper`, in one call of heyoka.  The grid goes on to a time beyond every other, so that no
    step is cut; the run is stopped behind the step that covers the last target.  None for a run that ends otherwise, or
    takes more than ``most`` steps: then the engine is anywhere.
    """
    sign, end = (1 if targets[-1] >= 0 else -1), far(bool(targets[-1] >= 0), precision)
    reached, last = sign * engine.time, sign * targets[-1]
    if precision.family == "double":
        last = float(last)  # compared at every step: numpy's numbers take longer

    def goes_on(stepped: Any) -> bool:
        nonlocal reached
        before, reached = reached, sign * stepped.time
        return bool(before < reached < last)

    start = [] if targets[0] == 0 else [engine.time]
    grid = numpy.concatenate([numpy.array([*start, targets[0]]), numpy.array(targets[1:]), numpy.array([end])])
    _, _, _, steps, _, states = engine.propagate_grid(grid, callback=goes_on, max_steps=most or 0)
    if len(states) != len(grid) - 1 or not numpy.isfinite(states[-1]).all():
        return None
    return steps, states[len(start) :]


@lru_cache(maxsize=64)
def far(forwards: bool, precision: Precision) -> Any:
    """A time beyond every other."""
    return number(Fraction(2) ** 1000 * (1 if forwards else -1), precision)


def at_rest(state: Any, coefficients: Any) -> bool:
    """Whether a motion is constant: at an equilibrium every Taylor coefficient is 0 and heyoka finds no step."""
    return bool(numpy.isfinite(state).all()) and not coefficients[:, 1:].any()
