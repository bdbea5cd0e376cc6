"""A motion as it is handed to an integrator, in principal axes, and what comes back in the axes given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.exact.bodies import resolve
from heavytop.integrate.framed import framed, one_in_frame
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.precision import Precision, decimal_text, exact_text
from heavytop.top.angles import perpendicular
from heavytop.top.attitude import rotated, transposed
from heavytop.top.bodies import PIVOT, Body, Frame
from heavytop.top.equations import GYROSTAT, System
from heavytop.top.heavy_top import HeavyTop, State, Vector, dot

_SPARE_BITS = 160
"""Irrational data of a run are rounded to so many bits more than its format has, of what it is told itself."""

Observer = Callable[[Fraction, Any], object]


@dataclass(frozen=True, slots=True)
class Setup:
    """A motion in principal axes.

    top, start: exact, of irrational data to many bits more than the format has.
    carried: ξ at t = 0, where the data say it.
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
        """ξ at t = 0: of the attitude, else :func:`heavytop.top.angles.perpendicular` of γ."""
        return perpendicular(self.start.gamma) if self.carried is None else self.carried

    @classmethod
    def of(cls, body: HeavyTop | Body, start: State, precision: Precision, system: System) -> Setup:
        """The motion of a body from ``start``."""
        if isinstance(body, HeavyTop) and start.attitude is None:
            return cls(body, start, None, system, precision, None)
        found = resolve(body, start, precision.bits + _SPARE_BITS)
        xi = perpendicular(found.start.gamma) if found.xi is None else found.xi
        if not found.turned:
            return cls(found.top, found.start, xi, system, precision, None)
        if system is GYROSTAT:
            raise InputError(
                "The gyrostat has its rotor along a principal axis, but the axes given are not principal.",
                "Give principal axes, or a rotor in any axes: the heavy_gyrostat.",
            )
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

    def turned_exactly(self, state: Sequence[Fraction]) -> Sequence[Fraction]:
        """Vectors in principal axes, in the axes given, in exact rationals."""
        if self.frame is None:
            return state
        axes = self.frame.axes
        return [value for place in range(0, len(state), 3) for value in rotated(axes, state[place : place + 3])]

    def watched(self, observer: Observer | None) -> Observer | None:
        """An observer that is given the states in the axes given."""
        if observer is None or self.frame is None or not callable(observer):
            return observer
        return lambda time, state: observer(time, self.turned(state))

    def given(self, run: Trajectory) -> Trajectory:
        """The run in the axes given."""
        return run if self.frame is None else framed(run, self.frame)


def motion_texts(body: HeavyTop | Body, start: State, digits: int) -> dict[str, Any]:
    """A body and its start as exact text, by the keys of every file and document.

    digits: of γ, and of Ω that was given in space axes, where the attitude is irrational.
    """
    found: dict[str, Any] = {}
    if isinstance(body, HeavyTop):
        found |= {"inertia": _texts(body.inertia), "weight": exact_text(body.weight)}
    else:
        tensor = [value for row in body.tensor for value in row]
        found |= {"mass": exact_text(body.mass), "gravity": exact_text(body.gravity)}
        found |= {"inertia": _texts(tensor), "about": PIVOT}
    found["centre"] = _texts(body.centre)
    if body.rotor is not None:
        found["rotor"] = _texts(body.rotor)
    attitude = start.attitude
    exact = attitude is None or attitude.exact_rows() is not None

    def rounded(values: Sequence[Fraction], known: bool) -> list[str]:
        return _texts(values) if known else [decimal_text(value, digits + 1) for value in values]

    found["omega"] = rounded(start.omega, exact or start.omega_space is None)
    found["gamma"] = rounded(start.gamma, exact)
    if attitude is not None and attitude.kind in ("quaternion", "matrix"):
        found[f"start_{attitude.kind}"] = _texts(attitude.numbers)
    elif attitude is not None:
        # read back by score, which takes it for the rotation next to it
        near = attitude.rational_rows(8 * digits + 128)
        found["start_matrix"] = [decimal_text(value, 2 * digits + 20) for row in near for value in row]
        found["start_attitude"] = f"{attitude.kind} {attitude}"
    return found


def _texts(values: Sequence[Fraction]) -> list[str]:
    return [exact_text(value) for value in values]


def xi_texts(start: State, digits: int) -> list[str] | None:
    """ξ at t = 0 in the axes given: of the attitude, else of γ alone; exact where it is rational.

    None for |γ| ≠ 1 without an attitude.
    """
    if start.attitude is not None:
        rows = start.attitude.exact_rows()
        if rows is not None:
            return _texts(rows[0])
        near = start.attitude.rational_rows(4 * digits + 64)
        return [decimal_text(value, digits + 1) for value in near[0]]
    if dot(start.gamma, start.gamma) != 1:
        return None
    return _texts(perpendicular(start.gamma))
