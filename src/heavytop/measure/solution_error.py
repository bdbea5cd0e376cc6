"""Distance of a computed motion from a known one that starts from the same rounded data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.balls import ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.solution import ExactSolution
from heavytop.integrate.trajectory import Problem
from heavytop.measure.digits import relative_error
from heavytop.measure.drift import Running, Sums, parameter_balls
from heavytop.measure.scalar import GUARD_BITS, largest, resolved, to_ball
from heavytop.records import Metric, Series

_ERRORS = ("omega", "gamma", "along", "across")


class SolutionError:
    """Error of Ω and of γ (largest component), of the state along the flow (phase) and across it (Euclidean), and
    relative: the largest |error|/max(1, |true value|) of a component, which says how many digits are kept.

    known: the exact motion; its start and top are those of ``problem``, rounded, so no input rounding is charged.
    threshold: the error of Ω, in units of Ω, whose first crossing is the break-away time.
    """

    def __init__(
        self,
        problem: Problem,
        known: ExactSolution,
        keep: Sequence[Fraction] = (),
        threshold: Fraction | None = None,
    ) -> None:
        self.known = known
        self.bits = problem.precision.bits + GUARD_BITS
        self.keep = frozenset(keep)
        self.threshold = threshold
        self.break_away: Fraction | None = None
        self.running = {name: Running() for name in (*_ERRORS, "relative")}
        self.system = problem.system
        self.parameters = parameter_balls(problem, self.bits)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        sums, left = self._following(state, self.known.state(time, self.bits))
        keep = time in self.keep
        for running, part in zip(self.running.values(), sums, strict=True):
            running.take(time, part, keep)
        if left and self.break_away is None:
            self.break_away = time

    @whole_evaluation
    def _following(self, state: Sequence[Any], truth: Sequence[arb]) -> tuple[list[Sums], bool]:
        """What the errors add up to with this state, and whether Ω is off by more than the threshold."""
        with working_precision(self.bits + GUARD_BITS):
            delta = [to_ball(value) - true for value, true in zip(state[:6], truth, strict=True)]
            flow = self.system.field(self.parameters, truth)
            omega = largest(delta[:3])
            relative = relative_error(delta, truth)
            values = omega, largest(delta[3:]), *split(delta, flow), relative
            sums = [running.following(value) for running, value in zip(self.running.values(), values, strict=True)]
            return sums, self.threshold is not None and bool(omega > ball(self.threshold))

    @whole_evaluation
    def metrics(self, prefix: str = "solution_error") -> dict[str, Metric]:
        """``PREFIX_omega_max``, ``_rms``, ``_final``; the same for gamma, along, across; ``PREFIX_relative_max``."""
        with working_precision(self.bits):
            found = {k: m for name in _ERRORS for k, m in self.running[name].metrics(f"{prefix}_{name}").items()}
            relative = f"{prefix}_relative_max"
            return found | {relative: self.running["relative"].metrics(f"{prefix}_relative")[relative]}

    def series(self, time_text: Callable[[Fraction], str], prefix: str = "solution_error") -> dict[str, Series]:
        """The same over the kept times, but for the relative error."""
        return {f"{prefix}_{name}": self.running[name].series(time_text) for name in _ERRORS}

    def content(self) -> dict[str, Any]:
        """What was taken in so far, as plain text and integers, exact."""
        running = {name: run.content() for name, run in self.running.items()}
        return {"break_away": None if self.break_away is None else str(self.break_away), **running}

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        self.break_away = None if content["break_away"] is None else Fraction(content["break_away"])
        for name, run in self.running.items():
            run.restore(content[name])


def split(delta: Sequence[arb], flow: Sequence[arb]) -> tuple[arb, arb]:
    """|δ| along the unit vector of the flow, and the Euclidean rest across it; the whole across at an equilibrium."""
    total = sum((x * x for x in delta), arb(0))
    speed = sum((x * x for x in flow), arb(0))
    if not resolved(speed) or speed == 0:
        return arb(0), root(total)
    projection = sum((x * f for x, f in zip(delta, flow, strict=True)), arb(0))
    along = projection * projection / speed
    return root(along), root(total - along)


def root(value: arb) -> arb:
    """√value of a ball around a number that is not negative, though the ball may reach below 0."""
    return value.sqrt() if value >= 0 else value.abs_upper().sqrt().union(arb(0))
