"""The scorer: a stream of states in; drift, distance from the known motion and what it was compared with, out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from heavytop.integrate.trajectory import Problem
from heavytop.measure.drift import Drift
from heavytop.measure.known import Known, known_motion
from heavytop.measure.solution_error import SolutionError
from heavytop.records import Metric, Series

TimeText = Callable[[Fraction], str]


class Scorer:
    """Takes in the states of one motion, one after the other, and holds what they are worth.

    problem: what the integrator was given.  horizon: the last exact time in the format, where the known motion is
    certified.  keep: the times whose values go into the series.
    known: the known motion, or why there is none; by default it is looked for.
    Drift is in the units of each integral, errors of Ω are in 1/time unit, of γ in none.
    """

    def __init__(
        self,
        problem: Problem,
        horizon: Fraction,
        keep: Sequence[Fraction] = (),
        known: Known | str | None = None,
    ) -> None:
        self.drift = Drift(problem, problem.integrals(), keep)
        self.known = known_motion(problem, horizon) if known is None else known
        self.error = None if isinstance(self.known, str) else SolutionError(problem, self.known.solution, keep)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        self.drift(time, state)
        if self.error is not None:
            self.error(time, state)

    @property
    def against(self) -> str:
        """What the motion was compared with, in words."""
        if isinstance(self.known, str):
            return f"its own first integrals; no reference: {self.known}"
        return self.known.text

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
