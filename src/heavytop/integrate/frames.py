"""Runs computed in principal axes, rotated into the axes in which the body was given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy
from numpy.typing import NDArray

from heavytop.errors import InputError
from heavytop.exact.resolved import resolve
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.multiword.pairs import Pairs
from heavytop.precision import DOUBLE, Precision, Vector, exact, number
from heavytop.top.attitude import perpendicular, rotated, transposed
from heavytop.top.bodies import Body, Frame
from heavytop.top.equations import GYROSTAT, System
from heavytop.top.heavy_top import HeavyTop, State


def framed(run: Trajectory, frame: Frame) -> Trajectory:
    """The run with its states, and ξ where it was computed, in the axes given; ``run`` is its ``principal``.

    Each number is rounded once, to the format of the run; none is where the axes are a permutation of the principal
    ones, up to signs.
    """
    states = in_frame(run.states, frame, run.problem.precision)
    attitude = None if run.attitude is None else in_frame(run.attitude, frame, run.problem.precision)
    return replace(run, states=states, attitude=attitude, frame=frame, principal=run)


def in_frame(values: NDArray[numpy.float64], frame: Frame, precision: Precision) -> Any:
    """Native numbers, shape (n, 3 m), m vectors each line, in the axes given."""
    if not len(values):
        return values
    rotated = numpy.array(values, copy=True)
    for begin in range(0, rotated.shape[1], 3):
        part = values[:, begin : begin + 3]
        if precision == DOUBLE:
            rotated[:, begin : begin + 3] = _in_double(part.astype(float), frame)
        else:
            lines = [_rotated_exactly(line, frame, precision) for line in part]
            rotated[:, begin : begin + 3] = numpy.array(lines, dtype=rotated.dtype)
    return rotated


def _rotated_exactly(line: Sequence[Any], frame: Frame, precision: Precision) -> list[Any]:
    try:
        vector = [exact(value) for value in line]
    except InputError:  # the last state of a run that failed
        return list(line)
    return [number(value, precision) for value in rotated(frame.axes, vector)]


def _in_double(part: NDArray[numpy.float64], frame: Frame) -> NDArray[numpy.float64]:
    """A times each vector in double-double, rounded once."""
    axes = Pairs.nearest(frame.axes)
    with numpy.errstate(invalid="ignore", over="ignore"):
        rows = (axes[i, 0] * part[:, 0] + axes[i, 1] * part[:, 1] + axes[i, 2] * part[:, 2] for i in range(3))
        return numpy.stack([row.high for row in rows], axis=1)


# A motion in principal axes, as integrators take it, and its results in the axes given.


_SPARE_BITS = 160
"""Irrational data of a run are rounded to so many bits more than its format has."""


@dataclass(frozen=True, slots=True)
class Setup:
    """A motion in principal axes.

    top, start: exact; irrational data to many bits more than the format has.
    carried: ξ at t = 0, where the data determine it.
    frame: the axes given; None where they are the principal ones.
    """

    top: HeavyTop
    start: State
    carried: Vector | None
    system: System
    precision: Precision
    frame: Frame | None

    @property
    def xi(self) -> Vector:
        """ξ at t = 0: of the attitude, else :func:`heavytop.top.attitude.perpendicular` of γ."""
        return perpendicular(self.start.gamma) if self.carried is None else self.carried

    @classmethod
    def of(cls, body: HeavyTop | Body, start: State, precision: Precision, system: System) -> Setup:
        """The motion of a body from ``start``."""
        if isinstance(body, HeavyTop) and start.attitude is None:
            return cls(body, start, None, system, precision, None)
        resolved = resolve(body, start, precision.bits + _SPARE_BITS)
        xi = perpendicular(resolved.start.gamma) if resolved.xi is None else resolved.xi
        if not resolved.is_rotated:
            return cls(resolved.top, resolved.start, xi, system, precision, None)
        if system is GYROSTAT:
            raise InputError(
                "The gyrostat has its rotor along a principal axis, but the axes given are not principal.",
                "Give principal axes, or a rotor in any axes: the heavy_gyrostat.",
            )
        frame = Frame(resolved.axes, body.centre, start.gamma, rotated(resolved.axes, xi))
        return cls(resolved.top, resolved.start, xi, system, precision, frame)

    def own(self, vector: Sequence[Fraction] | None) -> Sequence[Fraction] | None:
        """A vector of the axes given, in principal axes."""
        if vector is None or self.frame is None:
            return vector
        return rotated(transposed(self.frame.axes), vector)

    @property
    def problem(self) -> Problem:
        """The problem, as ensembles take it."""
        return Problem.of(self.top, self.start, self.precision, self.system)

    def in_body_axes(self, state: Any) -> Any:
        """A state of an observer in the axes given."""
        return state if self.frame is None else in_frame(numpy.array([state]), self.frame, self.precision)[0]

    def exactly_in_body_axes(self, state: Sequence[Fraction]) -> Sequence[Fraction]:
        """Vectors in principal axes, in the axes given, in exact rationals."""
        if self.frame is None:
            return state
        axes = self.frame.axes
        return [value for first in range(0, len(state), 3) for value in rotated(axes, state[first : first + 3])]

    def watched(self, observer: Callable[[Fraction, Any], object] | None) -> Callable[[Fraction, Any], object] | None:
        """An observer that is given the states in the axes given."""
        if observer is None or self.frame is None or not callable(observer):
            return observer
        return lambda time, state: observer(time, self.in_body_axes(state))

    def given(self, run: Trajectory) -> Trajectory:
        """The run in the axes given."""
        return run if self.frame is None else framed(run, self.frame)
