"""Distance of a computed motion from a known one that starts from the same rounded data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.balls import rational, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Problem
from heavytop.measure.digits import relative_error
from heavytop.measure.drift import Running, Sums, parameter_balls
from heavytop.measure.scalar import GUARD_BITS, largest, resolved, root, to_ball
from heavytop.measure.truth import Truth
from heavytop.records import Metric, Quantity, Series, by_name
from heavytop.top.heavy_top import dot

SOLUTION_ERROR = "solution_error"
COMPONENTS = ("omega", "gamma", "along", "across")
_RELATIVE = "relative"

Errors = tuple[list[Sums], bool]
"""What :meth:`SolutionError.following` finds."""


class SolutionError:
    """Error of Ω and of γ (largest component), of the state along the flow (phase) and across it (Euclidean), and
    relative: the largest |error|/max(1, |true value|) of a component, which says how many digits are kept.

    truth: the true motion from the start and top of ``problem``, rounded, so no input rounding is charged; what it does
    not cover is not compared.
    threshold: the error of Ω, in units of Ω, whose first crossing is the escape time.
    until: the |t| up to which errors count; later ones go into the series alone.
    name: of the quantity, whose components are omega, gamma, along and across.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth,
        keep: Sequence[Fraction] = (),
        threshold: Fraction | None = None,
        until: float = math.inf,
        name: str = SOLUTION_ERROR,
    ) -> None:
        self.truth = truth
        self.bits = problem.precision.bits + GUARD_BITS
        self.keep = frozenset(keep)
        self.threshold = threshold
        self.until = until
        self.name = name
        self.escape: Fraction | None = None
        self.running = {part: Running() for part in (*COMPONENTS, _RELATIVE)}
        self.system = problem.system
        self.parameters = parameter_balls(problem, self.bits)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        self.take(time, self.following(time, state))

    def take(self, time: Fraction, errors: Errors | None) -> None:
        """Take in one state by its :meth:`following`."""
        if errors is None:
            return
        sums, left = errors
        keep = bool(self.keep) and time in self.keep
        counts = math.isinf(self.until) or abs(float(time)) <= self.until
        for running, part in zip(self.running.values(), sums, strict=True):
            (running.take if counts else running.remember)(time, part, keep)
        if left and self.escape is None:
            self.escape = time

    @whole_evaluation
    def following(self, time: Fraction, state: Sequence[Any]) -> Errors | None:
        """What the errors add up to with this native state, and whether Ω is off by more than the threshold; None where
        there is no truth.  Nothing is taken in.
        """
        truth = self.known(time)
        if truth is None:
            return None
        with working_precision(self.bits):
            return self.errors([to_ball(value) for value in state[:6]], truth)

    def known(self, time: Fraction) -> list[arb] | None:
        """The true state; None where there is none."""
        return self.truth.state(time, self.bits) if self.truth.covers(time) else None

    def errors(self, y: Sequence[arb], truth: Sequence[arb]) -> Errors:
        """:meth:`following` of a state of six balls, at a working precision of ``bits``."""
        delta = [value - true for value, true in zip(y, truth, strict=True)]
        flow = self.system.field(self.parameters, truth)
        omega = largest(delta[:3])
        values = omega, largest(delta[3:]), *split(delta, flow), relative_error(delta, truth)
        sums = [running.following(value) for running, value in zip(self.running.values(), values, strict=True)]
        return sums, self.threshold is not None and bool(omega > rational(self.threshold))

    @whole_evaluation
    def last(self, rate: Fraction) -> float:
        """The error of the last state that was taken in, at most: of Ω over ``rate``, or of γ, the larger."""
        with working_precision(self.bits):
            omega, gamma = (self.running[part].final for part in ("omega", "gamma"))
            return float(largest((omega / rational(rate), gamma)).abs_upper())

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``NAME_omega_max``, ``_rms``, ``_final``; the same for gamma, along, across; ``NAME_relative_max``."""
        with working_precision(self.bits):
            found = {q: m for part in COMPONENTS for q, m in self.running[part].metrics(self._of(part)).items()}
            largest_relative = self._of(_RELATIVE).over("max")
            relative = self.running[_RELATIVE].metrics(largest_relative)[largest_relative]
            return by_name(found | {largest_relative: relative})

    def series(self, time_text: Callable[[Fraction], str]) -> dict[str, Series]:
        """The same over the kept times, but for the relative error."""
        return {self._of(part).text: self.running[part].series(self._of(part), time_text) for part in COMPONENTS}

    def _of(self, component: str) -> Quantity:
        return Quantity(self.name, component)

    def quantities(self) -> dict[Quantity, Running]:
        """The running values by what they are of."""
        return {self._of(part): values for part, values in self.running.items()}

    def content(self) -> dict[str, Any]:
        """What was taken in so far, as plain text and integers, exact."""
        running = {name: run.content() for name, run in self.running.items()}
        return {"escape": None if self.escape is None else str(self.escape), **running}

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        self.escape = None if content["escape"] is None else Fraction(content["escape"])
        for name, run in self.running.items():
            run.restore(content[name])


def split(delta: Sequence[arb], flow: Sequence[arb]) -> tuple[arb, arb]:
    """|δ| along the unit vector of the flow, and the Euclidean rest across it; the whole across at an equilibrium."""
    total = _product(delta, delta)
    speed = _product(flow, flow)
    if not resolved(speed) or speed == 0:
        return arb(0), root(total)
    projection = _product(delta, flow)
    along = projection * projection / speed
    return root(along), root(total - along)


def _product(a: Sequence[arb], b: Sequence[arb]) -> Any:
    return dot(a[:3], b[:3]) + dot(a[3:], b[3:])
