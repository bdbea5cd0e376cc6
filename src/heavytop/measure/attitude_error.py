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

# How a trajectory file speaks of the attitude: order and direction of quaternions, Euler sequence, up, units.
#
# Here R takes components in body axes to components in the axes of space of the file; canonical axes of space are those
# whose third points up.  A file's are turned into them by a signed permutation of determinant 1.


UPS: dict[str, tuple[tuple[int, int, int], tuple[int, int, int]]] = {
    "z": ((0, 1, 2), (1, 1, 1)),
    "x": ((1, 2, 0), (1, 1, 1)),
    "y": ((2, 0, 1), (1, 1, 1)),
    "-z": ((0, 1, 2), (1, -1, -1)),
    "-x": ((1, 2, 0), (-1, 1, -1)),
    "-y": ((2, 0, 1), (1, -1, -1)),
}
"""The axis of space that points up: canonical component k is sign k times component number k of the file."""
ORDERS = ("wxyz", "xyzw")
DIRECTIONS = ("body_to_space", "space_to_body")
FRAMES = ("body", "space")
ANGLES = ("radians", "degrees")
FORMS = ("quaternion", "matrix", "euler")
"""Columns that give a whole attitude, the first that is there before the others."""
VECTORS = ("omega", "omega_space", "gamma", "position")
WIDTHS = {"quaternion": 4, "matrix": 9, "euler": 3, **dict.fromkeys(VECTORS, 3)}
"""Numbers of each quantity in a row, in the order in which they are scored and diagnosed."""


@dataclass(frozen=True, slots=True)
class Convention:
    """The conventions of the columns of a file.

    quaternion_order: "wxyz" or "xyzw".  quaternion, matrix: "body_to_space" (v_space = R v_body) or "space_to_body".
    sequence: of Euler angles, intrinsic.  angles: "radians" or "degrees".  up: the axis of space that points up.
    pivot: where the fixed point stands in the axes of space.  point: whose position it is, in body axes; None for the
    centre of mass.
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
        """R of the columns of ``form``, body to space of the file; of a quaternion of any length that of its direction.

        values: 4, 9 (row by row) or 3 numbers.  lib: functions of these numbers, with ``pi`` where angles are degrees.
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
        """A vector of the file's axes of space, or three rows of R, in canonical axes of space."""
        places, signs = UPS[self.up]
        return [_times(vector[index], sign) for index, sign in zip(places, signs, strict=True)]


def _directed(rows: Rows[Any], direction: str) -> list[list[Any]]:
    return [list(row) for row in (rows if direction == "body_to_space" else transposed(rows))]


def _times(value: Any, sign: int) -> Any:
    if sign > 0:
        return value
    return [-part for part in value] if isinstance(value, list | tuple) else -value


def space_to_body(rows: Rows[Any], vector: Sequence[Any]) -> tuple[Any, Any, Any]:
    """R^T v over any ring."""
    return rotated(transposed(rows), vector)


# Attitudes, positions and Ω in any axes, as a file gives them, compared with the true motion of the body.
#
# Everything is in balls: no digit is lost where two attitudes all but agree.


ATTITUDE_ERROR, POSITION_ERROR, JOINT_VIOLATION = "attitude_error", "position_error", "joint_violation"
_WORST = Quantity(SOLUTION_ERROR, "relative")
"""The largest error of a column."""
_ONE = arb(1)
Values = Mapping[str, Sequence[Fraction]]
"""The numbers of one sample by the name of the quantity."""


@dataclass(frozen=True, slots=True)
class Posed:
    """A body and its start in principal axes, as exact numbers.

    xi: the attitude vector at t = 0; None where no attitude is asked about.  axes: rows of A, v_given = A v_principal.
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


def attitude_angle(one: Sequence[Sequence[arb]], other: Sequence[Sequence[arb]]) -> arb:
    """The angle in [0, π] of the rotation from one matrix to the other.

    Twice atan2(s, c) with s = |R − S|/(2√2) and c² = 1 − s²: no digits are lost near 0.
    """
    off = [a - b for u, v in zip(one, other, strict=True) for a, b in zip(u, v, strict=True)]
    square = sum((part * part for part in off), arb(0)) / 8  # FLINT's power of a ball around 0 is nan
    if square > _ONE:  # off a rotation
        return arb.pi()
    return 2 * arb.atan2(root(square), root(_ONE - square))


class ObservedErrors(Statistics):
    """Errors of what one file gives, sample by sample.

    ``attitude_error``: the angle between the true attitude and the one given, in radians; ``position_error``: a length,
    and relative to the distance of the point from the fixed point; ``solution_error_omega`` and ``_gamma``: the largest
    component, in the axes of the columns; ``_along`` and ``_across`` the flow where the state is whole.
    ``solution_error_relative``: the largest error of a column: of Ω and γ relative to a value above 1, of the nine
    entries of R, of a quaternion's length, and of a position relative to the distance of the point.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth,
        posed: Posed,
        said: Convention,
        names: Sequence[str],
        keep: Sequence[Fraction] = (),
    ) -> None:
        self.truth, self.said, self.posed = truth, said, posed
        self.bits = problem.precision.bits + GUARD_BITS
        self.system = problem.system
        self.parameters = parameter_balls(problem, self.bits)
        self.keep = frozenset(keep)
        self.form = next((form for form in FORMS if form in names), None)
        self.point = posed.centre if said.point is None else said.point
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
        """Add one sample.  state: of :func:`state_of`."""
        if not self.truth.covers(time):
            return
        sums, self._last = self._including(time, values, state)
        for quantity, running in self.running.items():
            running.update(sums[quantity], 1, {time: sums[quantity].final} if time in self.keep else {})

    @whole_evaluation
    def _including(
        self, time: Fraction, values: Values, state: Sequence[arb] | None
    ) -> tuple[dict[Quantity, Sums], float]:
        """The sums of every error with this sample, and an upper bound of its largest error of a column."""
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
        """Each error at one sample, at the working precision."""
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
            return _vector_error("omega", self.said.upright(part), rotated(rows, omega))
        if name == "position":
            return self._position(part, rows)
        computed = self.said.upright(self.said.rotation(name, part, ball_functions()))
        entries = largest(a - b for u, v in zip(computed, rows, strict=True) for a, b in zip(u, v, strict=True))
        if name == "quaternion":
            entries = largest((entries, (sum((c * c for c in part), arb(0)) - 1) / 2))
        third = largest(a - b for a, b in zip(computed[2], rows[2], strict=True))
        return {
            _WORST: entries,
            Quantity(ATTITUDE_ERROR): attitude_angle(computed, rows),
            Quantity(SOLUTION_ERROR, "gamma"): third,
        }

    def _position(self, part: list[arb], rows: Rows[arb]) -> dict[Quantity, arb]:
        pivot = [ball(value) for value in self.said.pivot]
        position = self.said.upright([a - b for a, b in zip(part, pivot, strict=True)])
        true = rotated(rows, [ball(value) for value in self.point])
        off = [a - b for a, b in zip(position, true, strict=True)]
        length = root(dot(off, off))
        if not self.distance_squared:
            return {Quantity(POSITION_ERROR): length, _WORST: length}
        part_of = length / ball(self.distance_squared).sqrt()
        return {Quantity(POSITION_ERROR): length, Quantity(POSITION_ERROR, "relative"): part_of, _WORST: part_of}

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """The errors of the columns, by what they are of."""
        return self.running

    def maximum_only(self, quantity: Quantity) -> bool:
        """Whether it is the relative error of all columns."""
        return quantity == _WORST


def _vector_error(name: str, vector: Sequence[arb], true: Sequence[arb]) -> dict[Quantity, arb]:
    off = [a - b for a, b in zip(vector, true, strict=True)]
    return {
        Quantity(SOLUTION_ERROR, name): largest(off),
        _WORST: relative_error(off, true),
    }


def gives_state(names: Sequence[str]) -> bool:
    """Whether these columns give Ω and γ."""
    attitude = any(form in names for form in FORMS)
    return ("omega" in names or ("omega_space" in names and attitude)) and ("gamma" in names or attitude)


@whole_evaluation
def state_of(values: Values, said: Convention, posed: Posed, bits: int) -> list[arb] | None:
    """Ω and γ in principal axes of a sample that gives both, else None; Ω of the body's axes before that of space."""
    if not gives_state(list(values)):
        return None
    with working_precision(bits):
        columns = {name: [ball(value) for value in part] for name, part in values.items()}
        form = next((name for name in FORMS if name in columns), None)
        rows = None if form is None else said.upright(said.rotation(form, columns[form], ball_functions()))
        gamma = columns["gamma"] if "gamma" in columns else (rows or [])[2]
        if "omega" in columns:
            omega = columns["omega"]
        else:
            assert rows is not None
            omega = list(space_to_body(rows, said.upright(columns["omega_space"])))
        axes = [[ball(entry) for entry in row] for row in posed.axes]
        return [*space_to_body(axes, omega), *space_to_body(axes, gamma)]


class JointViolation(Statistics):
    """Distance of the body's fixed point from where it is held, of files that give attitude and position.

    Where the point whose position is given is the fixed one itself, the position alone says it.  It needs no reference.
    """

    def __init__(self, bits: int, posed: Posed, said: Convention, keep: Sequence[Fraction]) -> None:
        self.bits, self.said, self.keep = bits, said, frozenset(keep)
        self.point = posed.centre if said.point is None else said.point
        self.distances = RunningStatistics()

    def __call__(self, time: Fraction, values: Values) -> None:
        """Add one sample."""
        sums = self._including(values)
        self.distances.update(sums, 1, {time: sums.final} if time in self.keep else {})

    @whole_evaluation
    def _including(self, values: Values) -> Sums:
        with working_precision(self.bits):
            columns = {name: [ball(value) for value in part] for name, part in values.items()}
            position, pivot = columns["position"], [ball(value) for value in self.said.pivot]
            off = self.said.upright([a - b for a, b in zip(position, pivot, strict=True)])
            if any(self.point):
                form = next(form for form in FORMS if form in columns)
                rows = self.said.upright(self.said.rotation(form, columns[form], ball_functions()))
                arm = rotated(rows, [ball(value) for value in self.point])
                off = [a - b for a, b in zip(off, arm, strict=True)]
            return self.distances.including([root(dot(off, off))])

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """``joint_violation``."""
        return {Quantity(JOINT_VIOLATION): self.distances}


class ObservedScorer(DriftAndError):
    """Drift where the state is whole, errors where there is a reference, the joint where position and attitude are."""

    def __init__(
        self,
        problem: Problem,
        truth: Truth | str,
        posed: Posed,
        said: Convention,
        names: Sequence[str],
        keep: Sequence[Fraction] = (),
    ) -> None:
        self.truth, self.said, self.posed = truth, said, posed
        self.bits = problem.precision.bits + GUARD_BITS
        plain = replace(problem, xi=None)
        self.drift = Drift(plain, problem.integrals(), keep) if gives_state(names) else None
        self.error: ObservedErrors | None = None
        if not isinstance(truth, str):
            self.error = ObservedErrors(problem, truth, posed, said, names, keep)
        held = "position" in names and (
            set(FORMS) & set(names) or not any(posed.centre if said.point is None else said.point)
        )
        self.joint = JointViolation(self.bits, posed, said, keep) if held else None

    def _parts(self) -> list[Statistics]:
        return [*super()._parts(), *([] if self.joint is None else [self.joint])]

    def __call__(self, time: Fraction, values: Values) -> None:
        """Add one sample."""
        state = state_of(values, self.said, self.posed, self.bits)
        if self.drift is not None and state is not None:
            self.drift(time, state)
        if self.error is not None:
            self.error(time, values, state)
        if self.joint is not None:
            self.joint(time, values)


ATTITUDE, POSITION = Quantity(ATTITUDE_ERROR), Quantity(POSITION_ERROR)


class _AttitudeErrors(ObservedErrors):
    """Errors of the attitude and the position alone."""

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """Both errors, that of the position relative too."""
        return {q: running for q, running in self.running.items() if q.name in (ATTITUDE_ERROR, POSITION_ERROR)}


class AttitudeScorer(Scorer):
    """A scorer of states (Ω, γ, ξ): of Ω and γ as of any run, and where the true attitude is known of its angle to the
    one computed, in radians, and of the centre of mass.

    problem: rounded, with ξ.  known: of Ω and γ.  top, start: exact, in principal axes.  times: exact, of the states.
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

        turned = truth(problem, times)
        posed = Posed(top, start, (problem.xi[0], problem.xi[1], problem.xi[2]), IDENTITY, top.centre)
        names = ("matrix", "position") if any(top.centre) else ("matrix",)
        self._attitude: _AttitudeErrors | None = None
        if not isinstance(turned, str):
            self._attitude = _AttitudeErrors(problem, turned, posed, Convention(), names, keep)

    def _parts(self) -> list[Statistics]:
        return [*super()._parts(), *([] if self._attitude is None else [self._attitude])]

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in a native state; an attitude that is not finite counts for nothing."""
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
