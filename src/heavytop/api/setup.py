"""A motion as it is handed to an integrator, in principal axes, and what comes back in the axes given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.exact.bodies import resolve
from heavytop.integrate.framed import framed, one_in_frame
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.precision import Precision
from heavytop.top.angles import perpendicular
from heavytop.top.attitude import rotated, transposed
from heavytop.top.bodies import Body, Frame
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State, Vector

_SPARE_BITS = 160
"""Irrational data of a run are rounded to so many bits more than its format has, of what it is told itself."""

Observer = Callable[[Fraction, Any], object]


@dataclass(frozen=True, slots=True)
class Setup:
    """A motion in principal axes.

    top, start: exact, of irrational data to many bits more than the format has.  xi: ξ at t = 0.
    frame: the axes given; None where they are the principal ones.
    """

    top: HeavyTop
    start: State
    xi: Vector
    system: System
    precision: Precision
    frame: Frame | None

    @classmethod
    def of(cls, body: HeavyTop | Body, start: State, precision: Precision, system: System) -> Setup:
        """The motion of a body from ``start``."""
        if isinstance(body, HeavyTop) and start.attitude is None:
            return cls(body, start, perpendicular(start.gamma), system, precision, None)
        found = resolve(body, start, precision.bits + _SPARE_BITS)
        xi = perpendicular(found.start.gamma) if found.xi is None else found.xi
        if not found.turned:
            return cls(found.top, found.start, xi, system, precision, None)
        frame = Frame(found.axes, body.centre, start.gamma, rotated(found.axes, xi))
        return cls(found.top, found.start, xi, system, precision, frame)

    def own(self, vector: Sequence[Fraction] | None) -> Sequence[Fraction] | None:
        """A vector of the axes given, in principal axes."""
        if vector is None or self.frame is None:
            return vector
        return rotated(transposed(self.frame.axes), vector)

    @property
    def problem(self) -> Problem:
        """What an ensemble is made of."""
        return Problem.of(self.top, self.start, self.precision, self.system)

    def turned(self, state: Any) -> Any:
        """A state of an observer in the axes given."""
        return state if self.frame is None else one_in_frame(state, self.frame, self.precision)

    def watched(self, observer: Observer | None) -> Observer | None:
        """An observer that is given the states in the axes given."""
        if observer is None or self.frame is None or not callable(observer):
            return observer
        return lambda time, state: observer(time, self.turned(state))

    def given(self, run: Trajectory) -> Trajectory:
        """The run in the axes given."""
        return run if self.frame is None else framed(run, self.frame)
