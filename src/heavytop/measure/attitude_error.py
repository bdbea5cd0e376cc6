"""Errors of the attitude that an integrator carries beside Ω and γ, and of the position of the centre of mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Problem
from heavytop.measure.conventions import Convention
from heavytop.measure.drift import Running
from heavytop.measure.known_attitude import truth_with_attitude
from heavytop.measure.observations import ATTITUDE_ERROR, POSITION_ERROR, ObservedErrors, Posed
from heavytop.measure.scorer import Scorer
from heavytop.measure.truth import Truth
from heavytop.precision import exact
from heavytop.records import Metric, Quantity, Series
from heavytop.top.attitude import rotated, rows_of
from heavytop.top.heavy_top import HeavyTop, State, Vector
from heavytop.top.principal import IDENTITY

TimeText = Callable[[Fraction], str]
ATTITUDE, POSITION = Quantity(ATTITUDE_ERROR), Quantity(POSITION_ERROR)
_KEPT = (ATTITUDE_ERROR, POSITION_ERROR)


class AttitudeErrors:
    """The angle between the attitude computed and the true one, in radians, and the error of the centre of mass.

    problem: rounded, with ξ.  top, start: exact, in principal axes.  times: exact, those at which states come.
    There are none where the true attitude is not known.
    """

    def __init__(
        self, problem: Problem, top: HeavyTop, start: State, times: Sequence[Fraction], keep: Sequence[Fraction]
    ) -> None:
        assert problem.xi is not None
        truth = truth_with_attitude(problem, times)
        xi: Vector = (problem.xi[0], problem.xi[1], problem.xi[2])
        posed = Posed(top, start, xi, IDENTITY, top.centre)
        self._centre = top.centre
        names = ("matrix", "position") if any(top.centre) else ("matrix",)
        self._errors = (
            None if isinstance(truth, str) else ObservedErrors(problem, truth, posed, Convention(), names, keep)
        )

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in a native state (Ω, γ, ξ); one that is not finite counts for nothing."""
        if self._errors is None:
            return
        try:
            values = [exact(value) for value in state[3:9]]
        except InputError:
            return
        rows = rows_of(values[:3], values[3:])
        found = {"matrix": [entry for row in rows for entry in row]}
        if any(self._centre):
            found["position"] = list(rotated(rows, self._centre))
        self._errors(time, found, None)

    def running(self) -> dict[Quantity, Running]:
        """The running values of both errors, the position's absolute, by what they are of."""
        found = {} if self._errors is None else self._errors.running
        return {quantity: each for quantity, each in found.items() if quantity in (ATTITUDE, POSITION)}

    def metrics(self) -> dict[str, Metric]:
        """``attitude_error_max``, ``_rms``, ``_final``; ``position_error_*``, also relative, of a body with r ≠ 0."""
        found = {} if self._errors is None else self._errors.metrics()
        return {name: metric for name, metric in found.items() if name.startswith(_KEPT)}

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The same over the kept times."""
        found = {} if self._errors is None else self._errors.series(time_text)
        return {name: series for name, series in found.items() if name.startswith(_KEPT)}


class AttitudeScorer(Scorer):
    """A scorer of states (Ω, γ, ξ): of Ω and γ as of any run, and :class:`AttitudeErrors` beside them.

    problem: rounded, with ξ.  truth: of Ω and γ.  top, start: exact, in principal axes.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth | str,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        keep: Sequence[Fraction],
    ) -> None:
        super().__init__(replace(problem, xi=None), truth, keep)
        self._turned = AttitudeErrors(problem, top, start, times, keep)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        super().__call__(time, state[:6])
        self._turned(time, state)

    def running(self) -> dict[Quantity, Running]:
        return super().running() | self._turned.running()

    def metrics(self) -> dict[str, Metric]:
        return super().metrics() | self._turned.metrics()

    def series(self, time_text: TimeText) -> dict[str, Series]:
        return super().series(time_text) | self._turned.series(time_text)
