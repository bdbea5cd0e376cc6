"""Single steps of an integrator that keeps them to itself: calls over its own step size, from where its run stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from heavytop.errors import PeerFailed, Unsupported
from heavytop.exact.balls import midpoint
from heavytop.exact.validated import Validated
from heavytop.integrate import peers, taylor
from heavytop.integrate.peers.command import NOT_COUNTED
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.measure.local_error import Call
from heavytop.measure.scalar import GUARD_BITS
from heavytop.precision import Precision, decimal_text, exact, number
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State

_CALLS = 16
_LONGER = (2, 4, 8, 16, 32, 64)
"""Lengths, in steps, of the single steps in which the order of a method with fixed steps shows."""
_LONGEST = 2
"""Radians: in longer steps no order shows."""
_UNSEEN = 10
"""Times as large as the largest error of 16 steps may be that of another."""
_ROUNDINGS = 32
"""Of one step, in eps of the state: 17 stages of a splitting method come to 16."""
_MOST_STEPS = 64
"""Steps in one call over the mean step: CVODE and LSODA, which begin with order 1 and small steps, take 18."""


def single_calls(
    integrator: ChosenIntegrator, top: HeavyTop, start: State, until: Fraction, precision: Precision, system: System
) -> tuple[Trajectory, list[tuple[Fraction, Call]]]:
    """A run to ``until`` > 0, and 16 calls, each with the time at which it ends; none where a run failed.

    A call starts at one of 16 states of the run, evenly spread from the start on, and goes over the mean step of the
    run, which a method with fixed steps takes as its step.  Raises PeerFailed for whatever an integrator of others
    does wrong, also where its count of steps cannot be, and for a gyrostat unless it takes many motions.
    """
    whole = integrator.propagate(top, start, [until], precision, system)
    times = [exact(number(until * i / _CALLS, precision)) for i in range(1, _CALLS)]
    sampled = integrator.propagate(top, start, times, precision, system)
    begins = [whole.problem.native(whole.problem.start.flat), *sampled.states]
    problems = [_from(whole.problem, state) for state in begins]
    fixed = peers.knob(integrator.which) == "step"
    length = until / max(whole.steps, 1)

    def over(n: int) -> list[Trajectory]:
        tau = exact(number(n * length, precision))
        asked = replace(integrator, setting=("step", tau)) if fixed else integrator
        return asked.propagate_many(problems, [tau])

    own = over(1)
    failed = next((run for run in (whole, sampled, *own) if run.outcome is not Outcome.SUCCESS), None)
    if failed is not None:
        return failed, []
    _require_count(integrator, [whole], whole.steps)
    _require_count(integrator, own, 1 if fixed else _MOST_STEPS)
    turned = length**2 * _rate_squared(whole.problem)
    longer = {n: over(n) for n in (_LONGER if fixed else ()) if n**2 * turned <= _LONGEST**2}
    calls = [
        Call(begin, exact(number(length, precision)), own[i].states[0], _reached(longer, i))
        for i, begin in enumerate(begins)
    ]
    return whole, [(time + call.length, call) for time, call in zip((Fraction(0), *times), calls, strict=True)]


def _require_count(integrator: ChosenIntegrator, runs: Sequence[Trajectory], most: int) -> None:
    """Raises PeerFailed where a run moved in no step, or took more than ``most`` over one mean step.

    A mean step follows from the count of steps: one too many times too large would make every call look exact.
    """
    for run in runs:
        if NOT_COUNTED.items() <= run.flags.items():
            raise Unsupported(f"{integrator.name} does not say how many steps it takes.", "Say it: `done steps N`.")
        moved = any(tuple(map(exact, state)) != run.problem.start.flat for state in run.states)
        if moved and run.steps == 0:
            raise PeerFailed(f"{integrator.name} moved, and says that it took no step")
        if run.steps > most:
            raise PeerFailed(
                f"{integrator.name} counts its steps wrongly: {run.steps} in a call over the mean step of its own run"
            )


def require_sum(integrator: ChosenIntegrator, whole: Trajectory, step: Fraction) -> None:
    """Raises PeerFailed where an integrator ends further off than its steps, each a number, can have taken it.

    step: the largest error of a step over the mean step, which follows from its count of steps; one too large makes
    every step short, and its error small.  Errors add up, roundings as a random walk, and grow along the motion as its
    neighbours part, or with the angle that it turns by.
    """
    p, until = whole.problem, whole.times[-1]
    growth = 1 + until * exact(float(_rate_squared(p)) ** 0.5) + _parting(p, until)
    bits = p.precision.bits + GUARD_BITS
    truth = Validated(p.top, p.start, p.system, p.parameters.rotor).state(until, bits)
    off = max(abs(exact(value) - midpoint(true)) for value, true in zip(whole.states[-1], truth, strict=True))
    rounding = p.precision.eps * max(map(abs, p.start.flat))
    at_random = step <= _ROUNDINGS * rounding
    added = exact(whole.steps**0.5) if at_random else whole.steps
    most = _UNSEEN * growth * added * (step + rounding)
    if off > most:
        raise PeerFailed(
            f"{integrator.name} counts its steps wrongly: {whole.steps}, each off by {decimal_text(step, 2)} at most, "
            f"and its run to t = {decimal_text(until, 6)} is off by {decimal_text(off, 2)}"
        )


def _parting(problem: Problem, until: Fraction) -> Fraction:
    """How many times as far apart two neighbouring motions are in the end, by heyoka."""
    top, start = problem.given or (problem.top, problem.start)
    by = Fraction(1, 1 << problem.precision.bits // 2)
    near = State(*([(1 + by) * value for value in part] for part in (start.omega, start.gamma)))
    one, other = (
        taylor.propagate(top, each, [until], problem.precision, system=problem.system) for each in (start, near)
    )
    if Outcome.SUCCESS is not one.outcome or one.outcome is not other.outcome:
        return Fraction(0)
    apart: Fraction = max(abs(exact(a) - exact(b)) for a, b in zip(one.states[0], other.states[0], strict=True))
    return apart / by / max(map(abs, start.flat))


def _rate_squared(problem: Problem) -> Fraction:
    """The square of the largest rate of the motion: |Ω|, that of the rotor, or the root of |P r||γ|/I."""
    p, start = problem.parameters, problem.start.flat
    turning: Fraction = max(*map(abs, start[:3]), p.rotor_rate) ** 2
    falling: Fraction = max(map(abs, p.moment)) * max(map(abs, start[3:])) / max(p.inertia)
    return max(turning, falling)


def _reached(runs: dict[int, list[Trajectory]], place: int) -> dict[int, Any]:
    """Where the runs from one state end, without those that failed."""
    return {n: many[place].states[0] for n, many in runs.items() if len(many[place].states)}


def _from(problem: Problem, state: Sequence[Any]) -> Problem:
    """The same problem from another state of its format."""
    values = tuple(exact(value) for value in state)
    return replace(problem, start=State(values[:3], values[3:]), given=None)
