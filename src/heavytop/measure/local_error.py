"""Error of single steps of a Taylor method, and the order it has in truth.

Each step is compared with the enclosure of the motion that starts exactly where the step starts: what earlier steps did
wrong plays no part.  At heyoka's own step length the truncation error is far below rounding; so the order is seen by
asking the step's polynomial beyond the step, at 2 h and 3 h, where its error is C τ^(p+1).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import log
from statistics import median

from flint import arb

from heavytop.exact.balls import ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem, TaylorStep
from heavytop.measure.drift import Running, Sums
from heavytop.measure.scalar import GUARD_BITS, largest, metric, resolved, to_ball
from heavytop.precision import exact
from heavytop.records import Metric, Quantity, by_name
from heavytop.top.heavy_top import State

_NEAR, _FAR = 2, 3
LOCAL_ERROR, ORDER = Quantity("local_error_ulp"), Quantity("observed_order")


class LocalError:
    """Local error in units of eps times the largest component of the state, and the observed order.

    problem: the one that was integrated.  Takes in steps one by one.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.bits = problem.precision.bits + GUARD_BITS
        self.running = Running()
        self.orders: list[float] = []

    def __call__(self, time: Fraction, step: TaylorStep) -> None:
        """Take in one step that ends at ``time``."""
        p = self.problem
        begin = [exact(value) for value in step.start]
        truth = Validated(p.top, State(tuple(begin[:3]), tuple(begin[3:6])), p.system, p.parameters.rotor)
        length = exact(step.length)
        truths = [truth.state(n * length, self.bits) for n in (1, _NEAR, _FAR)]
        sums, order = self._following(step, truths, max(map(abs, begin)))
        self.running.take(time, sums, keep=False)
        self.orders += order

    @whole_evaluation
    def _following(
        self, step: TaylorStep, truths: Sequence[Sequence[arb]], size: Fraction
    ) -> tuple[Sums, tuple[float, ...]]:
        """What the errors add up to with this step, and the order seen in it, if any."""
        length = exact(step.length)
        with working_precision(self.bits):
            scale = ball(self.problem.precision.eps * size)
            computed = [to_ball(value) for value in step.end], *(_at(step, n * length) for n in (_NEAR, _FAR))
            own, near, far = (_largest_gap(*pair) for pair in zip(computed, truths, strict=True))
            order: tuple[float, ...] = ()
            if resolved(near) and resolved(far) and near > 0 and far > 0:
                order = (float((far / near).log()) / log(_FAR / _NEAR) - 1,)
            return self.running.following(own / scale), order

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``local_error_ulp_max``, ``_rms`` and ``observed_order``, the median over the steps as a whole number."""
        order = Metric("missing", None, "value")
        with working_precision(self.bits):
            found = self.running.metrics(LOCAL_ERROR)
            if self.orders:
                order = metric(arb(round(median(self.orders))), "value")
        found.pop(LOCAL_ERROR.over("final"))
        return by_name(found | {ORDER: order})


def _largest_gap(state: Sequence[arb], truth: Sequence[arb]) -> arb:
    return largest(value - true for value, true in zip(state, truth, strict=True))


def _at(step: TaylorStep, time: Fraction) -> list[arb]:
    """The step's polynomial at ``time`` after its start, without further rounding errors."""
    tau = ball(time)
    result = []
    for row in step.coefficients:
        value = arb(0)
        for coefficient in reversed(row):
            value = value * tau + to_ball(coefficient)
        result.append(value)
    return result
