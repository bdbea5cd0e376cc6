"""Error of single steps, and the observed order of a method.

Each step is compared with the enclosure of the motion that starts exactly where the step starts: errors of earlier
steps play no part.  The order shows in steps of several lengths τ, whose error is C τ^(p+1).  At heyoka's own step
length h the truncation error is far below rounding; there the step's polynomial is asked beyond it, at 2 h and 3 h.
A method with fixed steps is asked for steps of 2 h, 4 h and on, until they err by more than rounding can.  Of one that
keeps a memory a single step is that of its starting method: its order is that of whole runs at h, h/2 and h/4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise
from math import log, log2
from statistics import median
from typing import Any

from flint import arb

from heavytop.errors import PeerFailed, Unsupported
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, whole_evaluation, working_precision
from heavytop.integrate import registry
from heavytop.integrate.peers.command import NOT_COUNTED
from heavytop.integrate.peers.contract import DEFAULT_STEP
from heavytop.integrate.registry import Integrator
from heavytop.integrate.trajectory import Outcome, Problem, TaylorStep, Trajectory
from heavytop.measure.running import RunningStatistics, Sums
from heavytop.measure.scalar import GUARD_BITS, largest, metric, resolved, to_ball
from heavytop.measure.scorer import OBSERVED_ORDER
from heavytop.precision import Precision, exact, rounded, six_digits, two_digits
from heavytop.records import Metric, Quantity, by_name
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State

_NEAR, _FAR = 2, 3
_ABOVE_ROUNDING = 1000
"""Multiple of eps and the size of the state above which the error of a rounded step shows an order."""
LOCAL_ERROR = Quantity("local_error_ulp")


@dataclass(frozen=True, slots=True)
class Call:
    """One call of an integrator that does not hand over its steps.

    start, end: states, shape (6,).  length: h.  further: where single steps of n h end, by n; none where the integrator
    takes steps of its own.
    """

    start: Any
    length: Fraction
    end: Any
    further: Mapping[int, Any] = field(default_factory=dict)


class LocalError:
    """Local error in units of eps times the largest component of the state, and the observed order.

    problem: the one that was integrated.  Takes in steps one by one.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.bits = problem.precision.bits + GUARD_BITS
        self.running = RunningStatistics()
        self.orders: list[float] = []
        self.calls: list[Call] = []

    def __call__(self, time: Fraction, step: TaylorStep | Call) -> None:
        """Add one step, which ends at ``time``."""
        p = self.problem
        begin = [exact(value) for value in step.start]
        truth = Validated(p.top, State(tuple(begin[:3]), tuple(begin[3:6])), p.system, p.parameters.rotor)
        beyond = (_NEAR, _FAR) if isinstance(step, TaylorStep) else step.further
        truths = {n: truth.state(n * exact(step.length), self.bits) for n in (1, *beyond)}
        sums, order = self._including(step, truths, max(map(abs, begin)))
        self.running.update(sums)
        self.calls += [step] if isinstance(step, Call) else []
        self.orders += order

    @whole_evaluation
    def _including(
        self, step: TaylorStep | Call, truths: Mapping[int, Sequence[arb]], size: Fraction
    ) -> tuple[Sums, tuple[float, ...]]:
        """The sums of the errors with this step, and the order seen in it, if any."""
        with working_precision(self.bits):
            scale = ball(self.problem.precision.eps * size)
            gaps = {n: largest(a - b for a, b in zip(_end(step, n), true, strict=True)) for n, true in truths.items()}
            least = ball(0) if isinstance(step, TaylorStep) else _ABOVE_ROUNDING * scale
            seen = [n for n, gap in gaps.items() if n > 1 and resolved(gap) and gap > least][:2]
            order: tuple[float, ...] = ()
            if len(seen) == 2:
                near, far = seen
                order = (float((gaps[far] / gaps[near]).log()) / log(far / near) - 1,)
            return self.running.including([gaps[1] / scale]), order

    @property
    def largest(self) -> Fraction:
        """The largest error of a step so far."""
        size = max(map(abs, self.problem.start.flat))
        return (
            (midpoint(self.running.sums.maximum) + radius(self.running.sums.maximum))
            * self.problem.precision.eps
            * size
        )

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``local_error_ulp_max``, ``_rms`` and ``observed_order``, the median over the steps as an integer.

        The order is left out where no step shows one.
        """
        with working_precision(self.bits):
            metrics = self.running.metrics(LOCAL_ERROR)
            if self.orders:
                metrics[OBSERVED_ORDER] = metric(arb(max(round(median(self.orders)), 0)), "value")
            elif not self.running.count:
                metrics[OBSERVED_ORDER] = Metric("missing", None, "value")
        metrics.pop(LOCAL_ERROR.over("final"))
        return by_name(metrics)


def _end(step: TaylorStep | Call, n: int) -> list[arb]:
    """The state after ``n`` lengths of the step: that of its polynomial without further rounding errors."""
    if isinstance(step, Call):
        return [to_ball(value) for value in (step.end if n == 1 else step.further[n])]
    if n == 1:
        return [to_ball(value) for value in step.end]
    tau = ball(n * exact(step.length))
    result = []
    for row in step.coefficients:
        value = arb(0)
        for coefficient in reversed(row):
            value = value * tau + to_ball(coefficient)
        result.append(value)
    return result


# Single steps of an integrator that does not expose them: calls over its own step size, from states of its run.


_CALLS = 16
_LONGER = (2, 4, 8, 16, 32, 64)
"""Lengths, in steps, of the single steps in which the order of a method with fixed steps shows."""
_LONGEST = 2
"""Radians: in longer steps no order shows."""
_UNSEEN = 10
"""Multiple of the largest error of 16 steps that another step may have."""


def single_calls(
    integrator: Integrator, top: HeavyTop, start: State, until: Fraction, precision: Precision, system: System
) -> tuple[Trajectory, list[tuple[Fraction, Call]]]:
    """A run to ``until`` > 0, and 16 calls, each with the time at which it ends; none where a run failed.

    A call starts at one of 16 states of the run, evenly spread from the start on, and goes over the step that a method
    with fixed steps is given, whatever it counts; of another over the mean step of the run.
    Raises PeerFailed for whatever a third-party integrator does wrong, also where it moved in no step, Unsupported for
    one that does not count its steps, and PeerFailed for a gyrostat unless it takes many motions.
    """
    integrator = stepped(integrator)
    whole = integrator.propagate(top, start, [until], precision, system)
    times = [rounded(until * i / _CALLS, precision) for i in range(1, _CALLS)]
    sampled = integrator.propagate(top, start, times, precision, system)
    begins = [whole.problem.native(whole.problem.start.flat), *sampled.states]
    problems = [_from(whole.problem, state) for state in begins]
    fixed = integrator.set_to is not None
    length = integrator.set_to[1] if integrator.set_to else until / max(whole.steps, 1)

    def over(n: int) -> list[Trajectory]:
        tau = rounded(n * length, precision)
        asked = replace(integrator, set_to=("step", tau)) if fixed else integrator
        return asked.propagate_many(problems, [tau])

    own = over(1)
    failed = next((run for run in (whole, sampled, *own) if run.outcome is not Outcome.SUCCESS), None)
    if failed is not None:
        return failed, []
    _require_count(integrator, whole)
    turned = length**2 * _rate_squared(whole.problem)
    longer = {}
    with suppress(PeerFailed):  # an implicit step of that length need not have a solution
        for n in _LONGER if fixed else ():
            if n**2 * turned <= _LONGEST**2:
                longer[n] = over(n)
    calls = [
        Call(begin, rounded(length, precision), own[i].states[0], _reached(longer, i)) for i, begin in enumerate(begins)
    ]
    return whole, [(time + call.length, call) for time, call in zip((Fraction(0), *times), calls, strict=True)]


def stepped(integrator: Integrator) -> Integrator:
    """The integrator with the step 1/100 where it has fixed steps and none is given."""
    if integrator.set_to is not None or registry.control_name(integrator) != "step":
        return integrator
    return replace(integrator, set_to=("step", DEFAULT_STEP))


def _require_count(integrator: Integrator, run: Trajectory) -> None:
    """Raises Unsupported where the steps of a run are not counted, PeerFailed where it moved in none."""
    if NOT_COUNTED.items() <= run.flags.items():
        raise Unsupported(f"{integrator.name} does not report its number of steps.", "Report it: `done steps N`.")
    moved = any(tuple(map(exact, state)) != run.problem.start.flat for state in run.states)
    if moved and run.steps == 0:
        raise PeerFailed(f"{integrator.name} moved, but reports 0 steps")


def unexplained(whole: Trajectory, length: Fraction, step: Fraction, amplification: float) -> str:
    """In a sentence, that a run ends further off than its steps can have taken it; "" where they can.

    length: of a step.  step: the largest error of one.  amplification: of any error by the motion itself.

    Errors of one sign add up, and are amplified; those between the calls may be larger.  That refutes no count: what
    errs more between the calls, and what keeps a memory, is off by more as well.
    """
    p, until = whole.problem, whole.times[-1]
    off, count = error_at_end(whole), until / length
    size: Fraction = max(map(abs, p.start.flat))
    turned = until * exact(float(_rate_squared(p)) ** 0.5)
    most = _UNSEEN * (1 + turned + exact(amplification)) * count * (step + p.precision.eps * size)
    if off <= most:
        return ""
    return (
        f"Its run to t = {six_digits(until)} is off by {two_digits(off)}, which {round(count)} steps, each "
        f"off by {two_digits(step)} at most where it starts anew, do not explain: it keeps a memory "
        "(one_step = false), errs more elsewhere, or takes fewer steps than it counts."
    )


def error_at_end(run: Trajectory) -> Fraction:
    """The largest component of the error of its last state."""
    p = run.problem
    bits = p.precision.bits + GUARD_BITS
    truth = Validated(p.top, p.start, p.system, p.parameters.rotor).state(run.times[-1], bits)
    off: Fraction = max(abs(exact(value) - midpoint(true)) for value, true in zip(run.states[-1], truth, strict=True))
    return off


# The order of whole runs, of which single steps are not evidence where a method keeps a memory.


_REFINED = (0, -1, -2, -3, -4)
_COARSENED = (1, 2, 3, 4, 5, 6)
"""Binary logarithms of steps over h: refined until two successive orders agree, or rounding dominates."""
_AGREE = 0.3


def order_of_runs(integrator: Integrator, whole: Trajectory) -> float | None:
    """The order that the ends of whole runs at h, h/2, h/4 show, and of finer ones where they do not agree on one.

    integrator: with the step h of the run ``whole``.  Where the errors at these steps are of rounding, coarser ones are
    taken.  None where no two orders in succession agree.
    """
    assert integrator.set_to is not None
    step, p, until = integrator.set_to[1], whole.problem, whole.times[-1]
    top, start = p.given or (p.top, p.start)
    size: Fraction = max(map(abs, p.start.flat))

    def error(level: int) -> Fraction | None:
        """At the step h 2^place; None where the run fails, or rounding may have made it."""
        taken = step * Fraction(2) ** level
        refined = replace(integrator, set_to=("step", taken))
        try:
            run = refined.propagate(top, start, [until], p.precision, p.system, again=False) if level else whole
        except PeerFailed:
            return None
        if run.outcome is not Outcome.SUCCESS:
            return None
        off = error_at_end(run)
        roundings: Fraction = max(Fraction(_ABOVE_ROUNDING), _UNSEEN * until / taken)
        return off if off > roundings * p.precision.eps * size else None

    errors: list[Fraction] = []
    for level in _REFINED:
        off = error(level)
        if off is None:
            break
        errors.append(off)
        if (order := _settled(errors)) is not None:
            return order
    errors = errors[:3]
    for level in _COARSENED if len(errors) < 3 else ():
        taken = step * Fraction(2) ** level
        if taken**2 * _rate_squared(p) > _LONGEST**2:
            break
        if (off := error(level)) is not None:
            errors.insert(0, off)
        if (order := _settled(errors[:3])) is not None:
            return order
    return None


def _settled(errors: Sequence[Fraction]) -> float | None:
    """The order of the last halving of the step, where that of the one before is the same."""
    if len(errors) < 3:
        return None
    before, last = (log2(float(a / b)) for a, b in pairwise(errors[-3:]))
    return last if abs(last - before) <= _AGREE else None


def _rate_squared(problem: Problem) -> Fraction:
    """The square of the largest rate of the motion: |Ω|, that of the rotor, or the root of |P r||γ|/I."""
    p, start = problem.parameters, problem.start.flat
    turning: Fraction = max(*map(abs, start[:3]), p.rotor_rate) ** 2
    falling: Fraction = max(map(abs, p.moment)) * max(map(abs, start[3:])) / max(p.inertia)
    return max(turning, falling)


def _reached(runs: dict[int, list[Trajectory]], level: int) -> dict[int, Any]:
    """Where the runs from one state end, without those that failed."""
    return {n: many[level].states[0] for n, many in runs.items() if len(many[level].states)}


def _from(problem: Problem, state: Sequence[Any]) -> Problem:
    """The problem from another state of its format."""
    values = tuple(exact(value) for value in state)
    return replace(problem, start=State(values[:3], values[3:]), given=None)
