"""Motions computed by heyoka: from a start to the times that are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from time import perf_counter
from typing import Any

from heavytop.integrate.engines import Compiled, compiled, load
from heavytop.integrate.stepper import Stepper, are_many, dense, far, on_a_grid
from heavytop.integrate.trajectory import Outcome, Place, Problem, TaylorStep, Trajectory
from heavytop.precision import Precision, exact, number, numbers
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.times import RoundedTimes, check_times

Observer = Callable[[Fraction, Any], None]


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
    tolerance: Fraction | None = None,
    high_accuracy: bool = False,
    compact_mode: bool | None = None,
    constants: Parameters | None = None,
) -> Trajectory:
    """The motion from ``start`` at t = 0, at ``times``, computed by heyoka in ``precision``.

    times: exact numbers of one sign, strictly monotone away from 0 (0 itself may come first).
    xi: exact initial attitude vector, to ride along.
    step_limit: stop after that many steps; the times reached until then are returned.
    observer: called with (exact time, native state) at each sample in place of keeping the states.
    stepping: how steps are taken; another than heyoka's own is for trying the detectors.
    place: where an earlier run of the same problem stopped; goes on behind its samples, to the same bits.
    mark: called after each sample with the place from which this run could go on.
    tolerance, high_accuracy, compact_mode, constants: as in :func:`heavytop.integrate.engines.compiled`.

    Raises InputError for times out of order, a format that the platform lacks, data outside its exponent range, a
    start that the system does not admit, and a place reached with other flags.  A failed run is an outcome, not an
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
        constants=constants,
    )
    with tool.lent() as engine:
        return follow(tool, engine, problem, targets, step_limit, observer, stepping=stepping, place=place, mark=mark)


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
    if stepping is Stepper and all(each is None for each in (observer, between, place, mark)):
        found = _in_one_call(tool, engine, problem, targets, step_limit)
        if found is not None:
            return found
    load(engine, problem)
    forwards = bool(targets[-1] >= 0)
    stepper = stepping(engine, forwards, step_limit, far(forwards, problem.precision), between)
    kept_times: list[Fraction] = []
    kept_states: list[Any] = []
    outcome, done, began = Outcome.SUCCESS, 0, perf_counter()
    if place is not None:
        place.require_same(tool.flags)
        stepper.begin(place)
        done, began = place.samples, began - place.seconds
        kept_times = [exact(target) for target in targets[:done]]
        stepper.reach(targets[done - 1])
        if stepper.rest is None:
            place.require_covered(stepper.steps)
    for target in targets[done:]:
        outcome, state = stepper.at(target)
        if outcome is not Outcome.SUCCESS:
            break
        done += 1
        kept_times.append(exact(target))
        if observer is None:
            kept_states.append(state)
        else:
            observer(kept_times[-1], state)
        if mark is not None and target != 0:
            mark(stepper.place(done, perf_counter() - began, tool.flags))
    return _trajectory(
        tool, engine, problem, stepper, tuple(kept_times), tuple(kept_states), outcome, perf_counter() - began
    )


def states_at(
    engine: Any, parameters: Any, start: Any, targets: Sequence[Any], step_limit: int | None, precision: Precision
) -> tuple[Any, Outcome, Any, int]:
    """(states at the targets that were reached, outcome, time reached, steps), the bits of :func:`follow`.

    For who has native numbers already: ``parameters`` and ``start`` as arrays, targets that were checked.
    """

    def begin() -> None:
        engine.pars[:] = parameters
        engine.state[:] = start
        engine.time = targets[0] * 0

    if are_many(targets, precision):
        begin()
        if dense(engine, targets, precision):
            begin()
            found = on_a_grid(engine, targets, precision, step_limit)
            if found is not None:
                return found[1], Outcome.SUCCESS, targets[-1], found[0]
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


def _in_one_call(
    tool: Compiled, engine: Any, problem: Problem, targets: Sequence[Any], step_limit: int | None
) -> Trajectory | None:
    """The motion at many targets close to each other, by heyoka alone; None where there are few, or where it fails."""
    began = perf_counter()
    if not are_many(targets, problem.precision):
        return None
    load(engine, problem)
    if not dense(engine, targets, problem.precision):
        return None
    load(engine, problem)
    found = on_a_grid(engine, targets, problem.precision, step_limit)
    if found is None:
        return None
    stepper = Stepper(engine, bool(targets[-1] >= 0), None, None, steps=found[0])
    seconds = perf_counter() - began
    return _trajectory(tool, engine, problem, stepper, RoundedTimes(targets), found[1], Outcome.SUCCESS, seconds)


def _trajectory(
    tool: Compiled,
    engine: Any,
    problem: Problem,
    stepper: Stepper,
    times: Sequence[Fraction],
    states: Any,
    outcome: Outcome,
    seconds: float,
) -> Trajectory:
    return Trajectory(
        problem,
        "heyoka",
        times,
        states,
        outcome,
        times[-1] if outcome is Outcome.SUCCESS and times else exact(stepper.time),
        stepper.steps,
        engine.order,
        {"compile": tool.seconds, "run": seconds},
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

    stepping: as in :func:`propagate`; options: as in :func:`heavytop.integrate.engines.compiled`.
    """
    problem = Problem.of(top, start, precision, system)
    tool = compiled(system, precision, **options)
    times: list[Fraction] = []
    steps: list[TaylorStep] = []
    outcome = Outcome.SUCCESS
    began = perf_counter()
    end = number(until, precision)
    with tool.lent() as engine:
        load(engine, problem)
        stepper = stepping(engine, True, None, None)
        while stepper.time < end and outcome is Outcome.SUCCESS and stepper.rest is None:
            before = engine.state.copy()
            outcome = stepper.single()
            if outcome is Outcome.SUCCESS and stepper.rest is None:
                steps.append(TaylorStep(before, engine.last_h, stepper.polynomial(), engine.state.copy()))
                times.append(exact(engine.time))
        order = engine.order
    return Trajectory(
        problem,
        "heyoka",
        tuple(times),
        tuple(step.end for step in steps),
        outcome,
        times[-1] if times else Fraction(0),
        len(steps),
        order,
        {"compile": tool.seconds, "run": perf_counter() - began},
        tool.flags,
    ), steps
