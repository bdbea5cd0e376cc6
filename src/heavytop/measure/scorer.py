"""The scorer: states in; drift, distance from the known motion and what it was compared with, out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from typing import Any

from heavytop.exact.balls import working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Problem
from heavytop.measure.drift import Drift, Running, Sums
from heavytop.measure.scalar import to_ball
from heavytop.measure.solution_error import SOLUTION_ERROR, Errors, SolutionError
from heavytop.measure.truth import Truth
from heavytop.records import Against, Metric, Quantity, Series

TimeText = Callable[[Fraction], str]


class Scorer:
    """Takes in the states of one motion, one after the other, and holds what they are worth.

    problem: what the integrator was given.  truth: the true motion, or why there is none.
    keep: the times whose values go into the series.
    threshold, until, name: as in :class:`heavytop.measure.solution_error.SolutionError`.
    Drift is in the units of each integral, errors of Ω are in 1/time unit, of γ in none.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth | str,
        keep: Sequence[Fraction] = (),
        *,
        threshold: Fraction | None = None,
        until: float = math.inf,
        name: str = SOLUTION_ERROR,
    ) -> None:
        self.drift = Drift(problem, problem.integrals(), keep)
        self.truth = truth
        self.error: SolutionError | None = None
        if not isinstance(truth, str):
            self.error = SolutionError(problem, truth, keep, threshold, until, name)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        drifts, errors = self._following(time, state)
        self.drift.take(time, drifts)
        if self.error is not None:
            self.error.take(time, errors)

    @whole_evaluation
    def _following(self, time: Fraction, state: Sequence[Any]) -> tuple[list[Sums], Errors | None]:
        error = self.error
        truth = None if error is None else error.known(time)
        with working_precision(self.drift.bits):
            y = [to_ball(value) for value in state]  # once for both
            return self.drift.sums(y), None if error is None or truth is None else error.errors(y[:6], truth)

    def take(self, times: Iterable[Fraction], states: Iterable[Sequence[Any]]) -> None:
        """Take in an array of native states, one at each of the exact times."""
        for time, state in zip(times, states, strict=True):
            self(time, state)

    @property
    def against(self) -> Against:
        """What the motion was compared with."""
        if isinstance(self.truth, str):
            return Against("none", reason=f"no reference: {self.truth}")
        return self.truth.against

    def running(self) -> dict[Quantity, Running]:
        """The running values of every drift and error by what they are of."""
        return self.drift.quantities() | (self.error.quantities() if self.error else {})

    def metrics(self) -> dict[str, Metric]:
        """``drift_NAME_max``, ... for every integral; ``solution_error_omega_max``, ... where there is a reference."""
        return self.drift.metrics() | (self.error.metrics() if self.error else {})

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The same over the kept times."""
        return self.drift.series(time_text) | (self.error.series(time_text) if self.error else {})

    def content(self) -> dict[str, Any]:
        """What was taken in so far, as plain text and integers, exact."""
        return {"drift": self.drift.content()} | ({"error": self.error.content()} if self.error else {})

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        self.drift.restore(content["drift"])
        if self.error is not None:
            self.error.restore(content["error"])
