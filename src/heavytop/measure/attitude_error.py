"""Errors of the attitude that an integrator carries beside Ω and γ, and of the position of the centre of mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from flint import arb

from heavytop.errors import InputError, quoted
from heavytop.exact.flint.balls import FUNCTIONS, ball, whole_evaluation, working_precision
from heavytop.integrate.trajectory import Problem
from heavytop.measure.running import RunningStatistics, Statistics, Sums
from heavytop.measure.scalar import GUARD_BITS, largest, relative_error, root
from heavytop.measure.scorer import SOLUTION_ERROR, Drift, DriftAndError, Scorer, parameter_balls, split
from heavytop.precision import Vector, cross, dot, exact
from heavytop.records import Quantity
from heavytop.top.attitude import SEQUENCES, Rows, matrix_of_quaternion, rotated, rows_of, rows_of_euler, transposed
from heavytop.top.bodies import IDENTITY
from heavytop.top.heavy_top import HeavyTop, State

if TYPE_CHECKING:
    from heavytop.measure.truth import Truth

# Conventions of a trajectory file for the attitude: order and direction of quaternions, Euler sequence, up, units.
#
# R maps components in body axes to components in the space axes of the file.  The third of the canonical space axes
# points up; a signed permutation of determinant 1 maps those of the file to them.


UPS: dict[str, tuple[tuple[int, int, int], tuple[int, int, int]]] = {
    "z": ((0, 1, 2), (1, 1, 1)),
    "x": ((1, 2, 0), (1, 1, 1)),
    "y": ((2, 0, 1), (1, 1, 1)),
    "-z": ((0, 1, 2), (1, -1, -1)),
    "-x": ((1, 2, 0), (-1, 1, -1)),
    "-y": ((2, 0, 1), (1, -1, -1)),
}
"""By the space axis that points up, (indices, signs): canonical component k is sign k times component indices[k]."""
ORDERS = ("wxyz", "xyzw")
DIRECTIONS = ("body_to_space", "space_to_body")
FRAMES = ("body", "space")
ANGLES = ("radians", "degrees")
FORMS = ("quaternion", "matrix", "euler")
"""Columns that give a complete attitude, in order of precedence."""
VECTORS = ("omega", "omega_space", "gamma", "position")
WIDTHS = {"quaternion": 4, "matrix": 9, "euler": 3, **dict.fromkeys(VECTORS, 3)}
"""Components of each quantity, in the order in which they are scored and diagnosed."""


@dataclass(frozen=True, slots=True)
class Convention:
    """The conventions of the columns of a file.

    quaternion_order: "wxyz" or "xyzw".  quaternion, matrix: "body_to_space" (v_space = R v_body) or "space_to_body".
    sequence: of Euler angles, intrinsic.  angles: "radians" or "degrees".  up: the axis of space that points up.
    pivot: the fixed point in space axes.  point: the body point of the position, in body axes; None for the centre of
    mass.
    """

    quaternion_order: str = "wxyz"
    quaternion: str = "body_to_space"
    matrix: str = "body_to_space"
    sequence: str = ""
    angles: str = "radians"
    up: str = "z"
    pivot: Vector = (Fraction(0), Fraction(0), Fraction(0))
    point: Vector | None = None

    def __post_init__(self) -> None:
        if (capitals := self.sequence.upper()) != self.sequence and capitals in SEQUENCES:
            raise InputError(
                f"sequence = {self.sequence} is ambiguous: in SciPy, small letters are extrinsic angles.",
                f"Write {capitals} if yours are intrinsic; extrinsic a, b, c are c, b, a of {capitals[::-1]}.",
            )
        known = {
            "quaternion_order": ORDERS,
            "quaternion": DIRECTIONS,
            "matrix": DIRECTIONS,
            "sequence": ("", *SEQUENCES),
            "angles": ANGLES,
            "up": tuple(UPS),
        }
        for name, values in known.items():
            if getattr(self, name) not in values:
                allowed = ", ".join(value for value in values if value)
                raise InputError(f"{name} = {quoted(getattr(self, name))} is not known.", f"Use one of {allowed}.")

    def rotation(self, form: str, values: Sequence[Any], lib: Any) -> list[list[Any]]:
        """R from the columns of ``form``, body to space of the file; a quaternion is normalised.

        values: 4, 9 (row by row) or 3 numbers.  lib: functions of their type, with ``pi`` where angles are in degrees.
        """
        if form == "quaternion":
            w, x, y, z = values if self.quaternion_order == "wxyz" else (values[3], *values[:3])
            rows = matrix_of_quaternion((w, x, y, z))
            square = w * w + x * x + y * y + z * z
            return _directed([[entry / square for entry in row] for row in rows], self.quaternion)
        if form == "matrix":
            return _directed([values[0:3], values[3:6], values[6:9]], self.matrix)
        angles = [value * lib.pi / 180 for value in values] if self.angles == "degrees" else values
        return [list(row) for row in rows_of_euler(self.sequence, angles, lib)]

    def upright(self, vector: Sequence[Any]) -> list[Any]:
        """A vector in the file's space axes, or three rows of R, in canonical space axes."""
        return [_times(vector[index], sign) for index, sign in zip(*UPS[self.up], strict=True)]


def _directed(rows: Rows[Any], direction: str) -> list[list[Any]]:
    return [list(row) for row in (rows if direction == "body_to_space" else transposed(rows))]


def _times(value: Any, sign: int) -> Any:
    if sign > 0:
        return value
    return [-part for part in value] if isinstance(value, list | tuple) else -value


def space_to_body(rows: Rows[Any], vector: Sequence[Any]) -> tuple[Any, Any, Any]:
    """R^T v over any ring."""
    return rotated(transposed(rows), vector)


# Errors of attitudes, positions and Ω of a file, in any axes, against the reference.
#
# All arithmetic is in balls: no digits are lost where two attitudes nearly agree.


ATTITUDE_ERROR, POSITION_ERROR, JOINT_VIOLATION = "attitude_error", "position_error", "joint_violation"
_WORST = Quantity(SOLUTION_ERROR, "relative")
"""The largest error of a column."""
_ONE = arb(1)
Values = Mapping[str, Sequence[Fraction]]
"""The components of one sample by the name of the quantity."""


@dataclass(frozen=True, slots=True)
class Posed:
    """A body and its start in principal axes, as exact numbers.

    xi: the attitude vector at t = 0; None if no attitude is requested.  axes: rows of A, v_given = A v_principal.
    centre: the centre of mass in the axes given.
    """

    top: HeavyTop
    start: State
    xi: Vector | None
    axes: tuple[Vector, Vector, Vector]
    centre: Vector


def ball_functions() -> Any:
    """Functions of balls with π at the working precision."""
    return SimpleNamespace(sin=FUNCTIONS.sin, cos=FUNCTIONS.cos, sqrt=FUNCTIONS.sqrt, pi=arb.pi())


def attitude_angle(first: Sequence[Sequence[arb]], second: Sequence[Sequence[arb]]) -> arb:
    """The angle in [0, π] of the rotation from one matrix to the other.

    Twice atan2(s, c) with s = |R − S|/(2√2) and c² = 1 − s²: no digits are lost near 0.
    """
    differences = [a - b for u, v in zip(first, second, strict=True) for a, b in zip(u, v, strict=True)]
    square = sum((part * part for part in differences), arb(0)) / 8  # FLINT's power of a ball around 0 is nan
    if square > _ONE:  # not a rotation
        return arb.pi()
    return 2 * arb.atan2(root(square), root(_ONE - square))


class ObservedErrors(Statistics):
    """Errors of the columns of one file, accumulated sample by sample.

    ``attitude_error``: the angle between the true attitude and that of the file, in radians; ``position_error``: a
    length, and relative to the distance of the point from the fixed point; ``solution_error_omega`` and ``_gamma``: the
    largest component, in the axes of the columns; ``_along`` and ``_across`` the flow if the file gives the state.
    ``solution_error_relative``: the largest error of a column: of Ω and γ relative to a value above 1, of the nine
    entries of R, of a quaternion's length, and of a position relative to the distance of the point.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth,
        posed: Posed,
        convention: Convention,
        names: Sequence[str],
        keep: Sequence[Fraction] = (),
    ) -> None:
        self.truth, self.convention, self.posed = truth, convention, posed
        self.bits = problem.precision.bits + GUARD_BITS
        self.system = problem.system
        self.parameters = parameter_balls(problem, self.bits)
        self.keep = frozenset(keep)
        self.form = next((form for form in FORMS if form in names), None)
        self.point = posed.centre if convention.point is None else convention.point
        self.distance_squared = dot(self.point, self.point)
        self.running = {quantity: RunningStatistics() for quantity in self._quantities(names)}
        self._last = 0.0

    def _quantities(self, names: Sequence[str]) -> list[Quantity]:
        quantities = []
        if {"omega", "omega_space"} & set(names):
            quantities.append(Quantity(SOLUTION_ERROR, "omega"))
        if "gamma" in names or self.form:
            quantities.append(Quantity(SOLUTION_ERROR, "gamma"))
        if gives_state(names):
            quantities += [Quantity(SOLUTION_ERROR, "along"), Quantity(SOLUTION_ERROR, "across")]
        if self.form:
            quantities.append(Quantity(ATTITUDE_ERROR))
        if "position" in names:
            quantities.append(Quantity(POSITION_ERROR))
            quantities += [Quantity(POSITION_ERROR, "relative")] if self.distance_squared else []
        return [*quantities, _WORST]

    def __call__(self, time: Fraction, values: Values, state: Sequence[arb] | None) -> None:
        """Add one sample.  state: from :func:`state_of`."""
        if not self.truth.covers(time):
            return
        sums, self._last = self._including(time, values, state)
        for quantity, running in self.running.items():
            running.update(sums[quantity], 1, {time: sums[quantity].final} if time in self.keep else {})

    @whole_evaluation
    def _including(
        self, time: Fraction, values: Values, state: Sequence[arb] | None
    ) -> tuple[dict[Quantity, Sums], float]:
        """The sums of each error with this sample, and an upper bound of the sample's largest error of a column."""
        true = self.truth.state(time, self.bits)
        with working_precision(self.bits):
            errors = self._errors(values, true)
            if state is not None:
                delta = [a - b for a, b in zip(state, true[:6], strict=True)]
                along, across = split(delta, self.system.field(self.parameters, true[:6]))
                errors |= {Quantity(SOLUTION_ERROR, "along"): along, Quantity(SOLUTION_ERROR, "across"): across}
            sums = {quantity: running.including([errors[quantity]]) for quantity, running in self.running.items()}
            return sums, float(errors[_WORST].abs_upper())

    def last(self, rate: Fraction) -> float:
        """The largest error of a column in the last sample."""
        return self._last

    def _errors(self, values: Values, true: Sequence[arb]) -> dict[Quantity, arb]:
        """The errors of one sample, at the working precision."""
        axes = [[ball(entry) for entry in row] for row in self.posed.axes]
        omega, gamma = rotated(axes, true[:3]), rotated(axes, true[3:6])
        rows: Rows[arb] | None = None
        if len(true) > 6:
            along = rotated(axes, true[6:9])
            rows = [along, cross(gamma, along), gamma]
        numbers = {name: [ball(value) for value in part] for name, part in values.items()}
        parts: dict[Quantity, arb] = {}
        columns: list[arb] = []
        for name, part in numbers.items():
            errors = self._of_columns(name, part, omega, gamma, rows)
            columns.append(errors.pop(_WORST))
            for quantity, error in errors.items():
                parts[quantity] = largest((parts.get(quantity, error), error))
        return parts | {_WORST: largest(columns)}

    def _of_columns(
        self, name: str, part: list[arb], omega: Sequence[arb], gamma: Sequence[arb], rows: Rows[arb] | None
    ) -> dict[Quantity, arb]:
        if name in ("omega", "gamma"):
            return _vector_error(name, part, omega if name == "omega" else gamma)
        assert rows is not None
        if name == "omega_space":
            return _vector_error("omega", self.convention.upright(part), rotated(rows, omega))
        if name == "position":
            return self._position(part, rows)
        computed = self.convention.upright(self.convention.rotation(name, part, ball_functions()))
        entries = largest(a - b for u, v in zip(computed, rows, strict=True) for a, b in zip(u, v, strict=True))
        if name == "quaternion":
            entries = largest((entries, (sum((c * c for c in part), arb(0)) - 1) / 2))
        third = largest(a - b for a, b in zip(computed[2], rows[2], strict=True))
        return {
            _WORST: entries,
            Quantity(ATTITUDE_ERROR): attitude_angle(computed, rows),
            Quantity(SOLUTION_ERROR, "gamma"): third,
        }

    def _position(self, columns: list[arb], rows: Rows[arb]) -> dict[Quantity, arb]:
        pivot = [ball(value) for value in self.convention.pivot]
        position = self.convention.upright([a - b for a, b in zip(columns, pivot, strict=True)])
        true = rotated(rows, [ball(value) for value in self.point])
        error = [a - b for a, b in zip(position, true, strict=True)]
        length = root(dot(error, error))
        if not self.distance_squared:
            return {Quantity(POSITION_ERROR): length, _WORST: length}
        relative = length / ball(self.distance_squared).sqrt()
        return {Quantity(POSITION_ERROR): length, Quantity(POSITION_ERROR, "relative"): relative, _WORST: relative}

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """The statistics of each error."""
        return self.running

    def maximum_only(self, quantity: Quantity) -> bool:
        """Whether ``quantity`` is the relative error over all columns."""
        return quantity == _WORST


def _vector_error(name: str, vector: Sequence[arb], true: Sequence[arb]) -> dict[Quantity, arb]:
    errors = [a - b for a, b in zip(vector, true, strict=True)]
    return {
        Quantity(SOLUTION_ERROR, name): largest(errors),
        _WORST: relative_error(errors, true),
    }


def gives_state(names: Sequence[str]) -> bool:
    """Whether columns of these names determine Ω and γ."""
    attitude = any(form in names for form in FORMS)
    return ("omega" in names or ("omega_space" in names and attitude)) and ("gamma" in names or attitude)


@whole_evaluation
def state_of(values: Values, convention: Convention, posed: Posed, bits: int) -> list[arb] | None:
    """Ω and γ of a sample in principal axes, or None; Ω in body axes takes precedence over that in space axes."""
    if not gives_state(list(values)):
        return None
    with working_precision(bits):
        columns = {name: [ball(value) for value in part] for name, part in values.items()}
        form = next((name for name in FORMS if name in columns), None)
        rows = None if form is None else convention.upright(convention.rotation(form, columns[form], ball_functions()))
        gamma = columns["gamma"] if "gamma" in columns else (rows or [])[2]
        if "omega" in columns:
            omega = columns["omega"]
        else:
            assert rows is not None
            omega = list(space_to_body(rows, convention.upright(columns["omega_space"])))
        axes = [[ball(entry) for entry in row] for row in posed.axes]
        return [*space_to_body(axes, omega), *space_to_body(axes, gamma)]


class JointViolation(Statistics):
    """Distance of the body's fixed point from the pivot, in files that give attitude and position.

    The position of the fixed point itself suffices without an attitude.  No reference is needed.
    """

    def __init__(self, bits: int, posed: Posed, convention: Convention, keep: Sequence[Fraction]) -> None:
        self.bits, self.convention, self.keep = bits, convention, frozenset(keep)
        self.point = posed.centre if convention.point is None else convention.point
        self.distances = RunningStatistics()

    def __call__(self, time: Fraction, values: Values) -> None:
        """Add one sample."""
        sums = self._including(values)
        self.distances.update(sums, 1, {time: sums.final} if time in self.keep else {})

    @whole_evaluation
    def _including(self, values: Values) -> Sums:
        with working_precision(self.bits):
            columns = {name: [ball(value) for value in part] for name, part in values.items()}
            position, pivot = columns["position"], [ball(value) for value in self.convention.pivot]
            offset = self.convention.upright([a - b for a, b in zip(position, pivot, strict=True)])
            if any(self.point):
                form = next(form for form in FORMS if form in columns)
                rows = self.convention.upright(self.convention.rotation(form, columns[form], ball_functions()))
                arm = rotated(rows, [ball(value) for value in self.point])
                offset = [a - b for a, b in zip(offset, arm, strict=True)]
            return self.distances.including([root(dot(offset, offset))])

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """``joint_violation``."""
        return {Quantity(JOINT_VIOLATION): self.distances}


class ObservedScorer(DriftAndError):
    """Drift if the file gives the state, errors if there is a reference, joint violation from position and attitude."""

    def __init__(
        self,
        problem: Problem,
        truth: Truth | str,
        posed: Posed,
        convention: Convention,
        names: Sequence[str],
        keep: Sequence[Fraction] = (),
    ) -> None:
        self.truth, self.convention, self.posed = truth, convention, posed
        self.bits = problem.precision.bits + GUARD_BITS
        without_attitude = replace(problem, xi=None)
        self.drift = Drift(without_attitude, problem.integrals(), keep) if gives_state(names) else None
        self.error: ObservedErrors | None = None
        if not isinstance(truth, str):
            self.error = ObservedErrors(problem, truth, posed, convention, names, keep)
        shows_joint = "position" in names and (
            set(FORMS) & set(names) or not any(posed.centre if convention.point is None else convention.point)
        )
        self.joint = JointViolation(self.bits, posed, convention, keep) if shows_joint else None

    def _parts(self) -> list[Statistics]:
        return [*super()._parts(), *([] if self.joint is None else [self.joint])]

    def __call__(self, time: Fraction, values: Values) -> None:
        """Add one sample."""
        state = state_of(values, self.convention, self.posed, self.bits)
        if self.drift is not None and state is not None:
            self.drift(time, state)
        if self.error is not None:
            self.error(time, values, state)
        if self.joint is not None:
            self.joint(time, values)


ATTITUDE, POSITION = Quantity(ATTITUDE_ERROR), Quantity(POSITION_ERROR)


class _AttitudeErrors(ObservedErrors):
    """Errors of the attitude and of the position alone."""

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """The attitude error, and the position error, absolute and relative."""
        return {q: running for q, running in self.running.items() if q.name in (ATTITUDE_ERROR, POSITION_ERROR)}


class AttitudeScorer(Scorer):
    """A scorer of states (Ω, γ, ξ): Ω and γ as in :class:`Scorer`; where the true attitude is known, also the angle
    between it and the computed one, in radians, and the error of the centre of mass.

    problem: rounded, with ξ.  known: reference of Ω and γ.  top, start: exact, in principal axes.  times: exact.
    """

    def __init__(
        self,
        problem: Problem,
        known: Truth | str,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        keep: Sequence[Fraction],
    ) -> None:
        super().__init__(replace(problem, xi=None), known, keep)
        assert problem.xi is not None
        from heavytop.measure.truth import truth

        true_attitude = truth(problem, times)
        posed = Posed(top, start, (problem.xi[0], problem.xi[1], problem.xi[2]), IDENTITY, top.centre)
        names = ("matrix", "position") if any(top.centre) else ("matrix",)
        self._attitude: _AttitudeErrors | None = None
        if not isinstance(true_attitude, str):
            self._attitude = _AttitudeErrors(problem, true_attitude, posed, Convention(), names, keep)

    def _parts(self) -> list[Statistics]:
        return [*super()._parts(), *([] if self._attitude is None else [self._attitude])]

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Add a native state; an attitude that is not finite is left out."""
        super().__call__(time, state[:6])
        if self._attitude is None:
            return
        try:
            values = [exact(value) for value in state[3:9]]
        except InputError:
            return
        rows = rows_of(values[:3], values[3:])
        columns = {"matrix": [entry for row in rows for entry in row]}
        if self._attitude.distance_squared:
            columns["position"] = list(rotated(rows, self._attitude.point))
        self._attitude(time, columns, None)
