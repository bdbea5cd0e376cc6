"""Error of single steps, and the order that a method has in truth.

Each step is compared with the enclosure of the motion that starts exactly where the step starts: what earlier steps did
wrong plays no part.  The order shows in steps of several lengths τ, whose error is C τ^(p+1).  At heyoka's own step
length h the truncation error is far below rounding; there the step's polynomial is asked beyond it, at 2 h and 3 h.
A method with fixed steps is asked for steps of 2 h, 4 h and on, until they err by more than rounding can.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import log
from statistics import median
from typing import Any

from flint import arb

from heavytop.exact.balls import ball, midpoint, radius, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem, TaylorStep
from heavytop.measure.drift import Running, Sums
from heavytop.measure.scalar import GUARD_BITS, largest, metric, resolved, to_ball
from heavytop.precision import exact
from heavytop.records import Metric, Quantity, by_name
from heavytop.top.heavy_top import State

_NEAR, _FAR = 2, 3
_ABOVE_ROUNDING = 1000
"""Times eps and the size of the state: an error from which the order of a rounded step is read."""
LOCAL_ERROR, ORDER = Quantity("local_error_ulp"), Quantity("observed_order")


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
        self.running = Running()
        self.orders: list[float] = []

    def __call__(self, time: Fraction, step: TaylorStep | Call) -> None:
        """Take in one step that ends at ``time``."""
        p = self.problem
        begin = [exact(value) for value in step.start]
        truth = Validated(p.top, State(tuple(begin[:3]), tuple(begin[3:6])), p.system, p.parameters.rotor)
        beyond = (_NEAR, _FAR) if isinstance(step, TaylorStep) else step.further
        truths = {n: truth.state(n * exact(step.length), self.bits) for n in (1, *beyond)}
        sums, order = self._following(step, truths, max(map(abs, begin)))
        self.running.take(time, sums, keep=False)
        self.orders += order

    @whole_evaluation
    def _following(
        self, step: TaylorStep | Call, truths: Mapping[int, Sequence[arb]], size: Fraction
    ) -> tuple[Sums, tuple[float, ...]]:
        """What the errors add up to with this step, and the order seen in it, if any."""
        with working_precision(self.bits):
            scale = ball(self.problem.precision.eps * size)
            gaps = {n: _largest_gap(_end(step, n), true) for n, true in truths.items()}
            least = ball(0) if isinstance(step, TaylorStep) else _ABOVE_ROUNDING * scale
            seen = [n for n, gap in gaps.items() if n > 1 and resolved(gap) and gap > least][:2]
            order: tuple[float, ...] = ()
            if len(seen) == 2:
                near, far = seen
                order = (float((gaps[far] / gaps[near]).log()) / log(far / near) - 1,)
            return self.running.following(gaps[1] / scale), order

    @property
    def largest(self) -> Fraction:
        """The largest error of a step so far."""
        size = max(map(abs, self.problem.start.flat))
        return (midpoint(self.running.maximum) + radius(self.running.maximum)) * self.problem.precision.eps * size

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``local_error_ulp_max``, ``_rms`` and ``observed_order``, the median over the steps as a whole number.

        The order is left out where no step shows one.
        """
        with working_precision(self.bits):
            found = self.running.metrics(LOCAL_ERROR)
            if self.orders:
                found[ORDER] = metric(arb(round(median(self.orders))), "value")
            elif not self.running.count:
                found[ORDER] = Metric("missing", None, "value")
        found.pop(LOCAL_ERROR.over("final"))
        return by_name(found)


def _largest_gap(state: Sequence[arb], truth: Sequence[arb]) -> arb:
    return largest(value - true for value, true in zip(state, truth, strict=True))


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
