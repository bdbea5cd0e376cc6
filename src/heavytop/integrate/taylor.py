"""heyoka's Taylor integrators: the only file that builds its engines.

Runs are cut by steps, never by times: a sample is taken from the Taylor polynomial of the step that covers it, so the
steps and all later bits do not depend on which samples were asked for, nor on how often the run gave way to Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter
from typing import Any

import heyoka
import numpy

from heavytop.errors import InputError
from heavytop.integrate.selfcheck import check
from heavytop.integrate.trajectory import Outcome, Place, Problem, TaylorStep, Trajectory
from heavytop.precision import DOUBLE, Precision, exact, number, require
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, VARIABLES, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.times import check_times

# A machine-code cache on disk is not protected against corruption: a flipped bit there gives wrong numbers silently.
heyoka.llvm_state.set_diskcache_enabled(False)

Observer = Callable[[Fraction, Any], None]

CHUNK_SECONDS = 0.25
_XI = ("xi1", "xi2", "xi3")


@dataclass(slots=True)
class Compiled:
    """A compiled integrator of one system and format, used again for every top.

    spare: copies for threads, which must not share an engine.
    """

    engine: Any
    seconds: float
    flags: dict[str, str]
    spare: list[Any] = field(default_factory=list)

    @contextmanager
    def lent(self) -> Iterator[Any]:
        """A copy of the engine for one thread, given back at the end."""
        try:
            engine = self.spare.pop()
        except IndexError:
            engine = deepcopy(self.engine)
        try:
            yield engine
        finally:
            self.spare.append(engine)


_compiled: dict[tuple[Any, ...], Compiled] = {}


def expressions(system: System, attitude: bool, constants: Parameters | None = None) -> list[tuple[Any, Any]]:
    """The field as heyoka expressions with par[0..2] = I and par[3..5] = P r, or par[3] = λ for the gyrostat.

    constants: doubles in the place of all par[i].
    """
    names = VARIABLES + (_XI if attitude else ())
    y = heyoka.make_vars(*names)
    p = constants or Parameters(
        [heyoka.par[i] for i in range(3)],
        [heyoka.par[i] for i in range(3, 6)],
        heyoka.par[3] if system is GYROSTAT else None,
    )
    rates = system.field(p, y[:6])
    if attitude:
        rates = (*rates, *system.attitude(p, y[:6], y[6:]))
    return list(zip(y, rates, strict=True))


def compiled(
    system: System,
    precision: Precision,
    *,
    attitude: bool = False,
    tolerance: Fraction | None = None,
    high_accuracy: bool = False,
    compact_mode: bool | None = None,
    lanes: int | None = None,
    constants: Parameters | None = None,
) -> Compiled:
    """The integrator for this system and format, compiled at its first use.

    constants: exact parameters of one top, compiled into the code, in double only (heyoka demotes all constants to it);
    None for code that serves every top.

    lanes: that many motions at once in SIMD lanes, in double only; None for a scalar integrator, whose bits differ.
    tolerance: None for the format's eps.  compact_mode: None for off in double and extended (faster to run) and on in
    quad and real (else they take minutes to compile).

    Raises Contradiction where its first step, which is known, is wrong.
    """
    require(precision)
    compact = precision.family in ("quad", "real") if compact_mode is None else compact_mode
    if constants is not None and precision != DOUBLE:
        raise InputError(f"Constants cannot be compiled in for {precision.name}.", "Use double.")
    key = (system.name, precision, attitude, tolerance, high_accuracy, compact, lanes, constants)
    if key not in _compiled:
        one, zero = number(Fraction(1), precision), number(Fraction(0), precision)
        size = 9 if attitude else 6
        options: dict[str, Any] = {"compact_mode": compact, "high_accuracy": high_accuracy}
        if tolerance is not None:
            options["tol"] = number(tolerance, precision)
        if precision.family == "real":
            options["prec"] = precision.bits
        build, shape = (heyoka.taylor_adaptive, ()) if lanes is None else (heyoka.taylor_adaptive_batch, (lanes,))
        if constants is None:
            options["pars"] = numpy.full((4 if system is GYROSTAT else 6, *shape), one)
        before = perf_counter()
        engine = build(
            expressions(system, attitude, constants and _doubles(constants)),
            numpy.full((size, *shape), zero),
            fp_type=type(one),
            **options,
        )
        seconds = perf_counter() - before
        check(engine, system, precision, constants)
        _compiled[key] = Compiled(engine, seconds, _flags(engine))
    return _compiled[key]


def _doubles(p: Parameters) -> Parameters:
    return Parameters([float(v) for v in p.inertia], [float(v) for v in p.moment], float(p.rotor))


def _flags(engine: Any) -> dict[str, str]:
    """Everything that can change bits."""
    code = engine.llvm_state
    values = {
        "tolerance": engine.tol,
        "order": engine.order,
        "compact_mode": engine.compact_mode,
        "high_accuracy": engine.high_accuracy,
        "opt_level": code.opt_level,
        "fast_math": code.fast_math,
        "force_avx512": code.force_avx512,
        "slp_vectorize": code.slp_vectorize,
        "code_cache": "none",
        "coefficients": "par" if len(engine.pars) else "constants",
    }
    if hasattr(engine, "batch_size"):
        values["batch_size"] = engine.batch_size
    return {name: str(value).lower() for name, value in values.items()}


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
    _seconds_per_step: float = field(default=CHUNK_SECONDS)
    _one_by_one: bool = False
    _at_rest: Any = None
    _before: Any = None

    def reach(self, target: Any) -> Outcome:
        """Step until the polynomial of the last step covers ``target``."""
        while self._at_rest is None and not (self._covers and self._beyond(target)):
            if self.step_limit is not None and self.steps >= self.step_limit:
                return Outcome.STEP_LIMIT
            if self.between is not None:
                self.between()
            count = self._steps_short_of(target)
            outcome = self.single() if count < 2 else self._several(count, target)
            if outcome is not Outcome.SUCCESS:
                return outcome
        return Outcome.SUCCESS

    def _beyond(self, target: Any) -> bool:
        return bool(self.engine.time >= target if self.forwards else self.engine.time <= target)

    def _steps_short_of(self, target: Any) -> int:
        """How many steps can be taken at once, short of the target, the step limit and a quarter of a second."""
        if self._one_by_one or not self._largest_step or self._beyond(target):
            return 1
        distance = abs(float(target - self.engine.time))
        # many steps average out; each of a few may be as long as the longest so far
        far = distance > 100 * self._largest_step
        count = 0.95 * distance * self.steps / abs(float(self.time)) if far else distance / self._largest_step
        count = min(count, CHUNK_SECONDS / self._seconds_per_step)
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
            self._at_rest = state
            return Outcome.SUCCESS
        if self.engine.time == before:
            return Outcome.STEP_TOO_SMALL
        self.steps += 1
        self.time = self.engine.time
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
            self.engine.state[:] = state
            self.engine.dtime = time
            if failed:
                # over the same ground again, one by one, to find where
                self._one_by_one = True
            else:
                self._largest_step *= 1.5
            return Outcome.SUCCESS
        self.steps += done
        self.time = self.engine.time
        self._covers = False
        return Outcome.SUCCESS

    def polynomial(self) -> Any:
        """Taylor coefficients of the last step, a copy, shape (6 or 9, order + 1)."""
        return self.engine.tc.copy()

    def begin(self, place: Place) -> None:
        """Go on from there."""
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
        if self._at_rest is not None:
            return self._at_rest.copy()
        return self.engine.update_d_output(target).copy()


def propagate(
    top: HeavyTop,
    start: State,
    times: Sequence[Any],
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
    xi: tuple[Fraction, ...] | None = None,
    step_limit: int | None = None,
    observer: Observer | None = None,
    stepping: type[Stepper] = Stepper,
    place: Place | None = None,
    mark: Callable[[Place], None] | None = None,
    **options: Any,
) -> Trajectory:
    """The motion from ``start`` at t = 0, at ``times``, computed by heyoka in ``precision``.

    times: exact numbers of one sign, strictly monotone away from 0 (0 itself may come first).
    xi: exact initial attitude vector, to ride along.
    step_limit: stop after that many steps; the times reached until then are returned.
    observer: called with (exact time, native state) at each sample in place of keeping the states.
    stepping: how steps are taken; another than heyoka's own is for trying the detectors.
    place: where an earlier run of the same problem stopped; goes on behind its samples, to the same bits.
    mark: called after each sample with the place from which this run could go on.
    options: tolerance, high_accuracy, compact_mode as in :func:`compiled`.

    Raises InputError for times out of order, a format that the platform lacks, data outside its exponent range, a
    start that the system does not admit, and a place reached with other flags.  A failed run is an outcome, not an
    exception.
    """
    problem = Problem.of(top, start, precision, system, xi)
    targets = [number(time, precision) for time in check_times(times)]
    tool = compiled(system, precision, attitude=xi is not None, **options)
    return follow(tool, tool.engine, problem, targets, step_limit, observer, stepping=stepping, place=place, mark=mark)


def follow(
    tool: Compiled,
    engine: Any,
    problem: Problem,
    targets: Sequence[Any],
    step_limit: int | None,
    observer: Observer | None,
    between: Callable[[], None] | None = None,
    *,
    stepping: type[Stepper] = Stepper,
    place: Place | None = None,
    mark: Callable[[Place], None] | None = None,
) -> Trajectory:
    """The motion of ``problem`` at ``targets``, native numbers in order, computed by ``engine``, one of ``tool``'s."""
    load(engine, problem)
    forwards = bool(targets[-1] >= 0)
    stepper = stepping(engine, forwards, step_limit, far(forwards, problem.precision), between)
    kept_times: list[Fraction] = []
    kept_states: list[Any] = []
    outcome, done, began = Outcome.SUCCESS, 0, perf_counter()
    if place is not None:
        _require_same(place.flags, tool.flags)
        stepper.begin(place)
        done, began = place.samples, began - place.seconds
        kept_times = [exact(target) for target in targets[:done]]
        stepper.reach(targets[done - 1])
    for target in targets[done:]:
        if target == 0:
            state = engine.state.copy()
        else:
            outcome = stepper.reach(target)
            if outcome is not Outcome.SUCCESS:
                break
            state = stepper.sample(target)
        done += 1
        kept_times.append(exact(target))
        if observer is None:
            kept_states.append(state)
        else:
            observer(kept_times[-1], state)
        if mark is not None and target != 0:
            mark(stepper.place(done, perf_counter() - began, tool.flags))
    return Trajectory(
        problem,
        "heyoka",
        tuple(kept_times),
        tuple(kept_states),
        outcome,
        kept_times[-1] if outcome is Outcome.SUCCESS and kept_times else exact(stepper.time),
        stepper.steps,
        engine.order,
        {"compile": tool.seconds, "run": perf_counter() - began},
        tool.flags,
    )


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
    """The steps that begin before the time ``until`` > 0, at their ends and as polynomials; none at an equilibrium.

    stepping, options: as in :func:`propagate`.  Raises what that raises.
    """
    problem = Problem.of(top, start, precision, system)
    tool = compiled(system, precision, **options)
    load(tool.engine, problem)
    stepper = stepping(tool.engine, True, None, None)
    times: list[Fraction] = []
    steps: list[TaylorStep] = []
    outcome = Outcome.SUCCESS
    began = perf_counter()
    end = number(until, precision)
    while stepper.time < end and outcome is Outcome.SUCCESS and stepper._at_rest is None:
        before = tool.engine.state.copy()
        outcome = stepper.single()
        if outcome is Outcome.SUCCESS and stepper._at_rest is None:
            after = tool.engine.state.copy()
            steps.append(TaylorStep(before, tool.engine.last_h, stepper.polynomial(), after))
            times.append(exact(tool.engine.time))
    return Trajectory(
        problem,
        "heyoka",
        tuple(times),
        tuple(step.end for step in steps),
        outcome,
        times[-1] if times else Fraction(0),
        len(steps),
        tool.engine.order,
        {"compile": tool.seconds, "run": perf_counter() - began},
        tool.flags,
    ), steps


def load(engine: Any, problem: Problem) -> None:
    """Set an engine to the beginning of a problem."""
    parameters, engine.state[:] = arrays(problem)
    if len(engine.pars):
        engine.pars[:] = parameters
    engine.time = number(Fraction(0), problem.precision)


def _require_same(there: dict[str, str], here: dict[str, str]) -> None:
    different = [name for name in sorted(there.keys() | here.keys()) if there.get(name) != here.get(name)]
    if different:
        raise InputError(
            "The run that is to go on was integrated with "
            + ", ".join(f"{name} = {there.get(name)} (now {here.get(name)})" for name in different)
            + ".",
            "Go on with the program and machine that began it, or start anew in another folder.",
        )


def arrays(problem: Problem) -> tuple[Any, Any]:
    """The parameters and the state that an engine is given, as native arrays."""
    p = problem.parameters
    numbers = [*p.inertia, p.rotor] if problem.system is GYROSTAT else [*p.inertia, *p.moment]
    start = [*problem.start.flat, *(problem.xi or ())]
    return numpy.array(problem.native(numbers)), numpy.array(problem.native(start))


def far(forwards: bool, precision: Precision) -> Any:
    """A time beyond every other."""
    return number(Fraction(2) ** 1000 * (1 if forwards else -1), precision)


def at_rest(state: Any, coefficients: Any) -> bool:
    """Whether a motion is constant: at an equilibrium every Taylor coefficient is 0 and heyoka finds no step."""
    return bool(numpy.isfinite(state).all()) and not coefficients[:, 1:].any()
