"""Attitudes, positions and Ω in any axes, as a file gives them, compared with the true motion of the body.

Everything is in balls: no digit is lost where two attitudes all but agree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

from flint import arb

from heavytop.exact.balls import FUNCTIONS, ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Problem
from heavytop.measure.conventions import FORMS, Convention, body_to_space, space_to_body
from heavytop.measure.digits import relative_error
from heavytop.measure.drift import Drift, Running, parameter_balls
from heavytop.measure.scalar import GUARD_BITS, largest, root
from heavytop.measure.solution_error import SOLUTION_ERROR, split
from heavytop.measure.truth import Truth
from heavytop.records import Against, Metric, Quantity, Series, by_name
from heavytop.top.heavy_top import HeavyTop, State, Vector, dot

ATTITUDE_ERROR, POSITION_ERROR = "attitude_error", "position_error"
OVERLAP = Fraction(1, 10**6)
"""Columns that say the same must agree to that."""
_ONE = arb(1)

TimeText = Callable[[Fraction], str]
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
    square = sum(((a - b) ** 2 for u, v in zip(one, other, strict=True) for a, b in zip(u, v, strict=True)), arb(0)) / 8
    if square > _ONE:  # of what is no rotation
        return arb.pi()
    return 2 * arb.atan2(root(square), root(_ONE - square))


class ObservedErrors:
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
        self.running = {quantity: Running() for quantity in self._quantities(names)}
        self.last = 0.0
        self.apart: dict[tuple[str, str], Fraction] = {}

    def _quantities(self, names: Sequence[str]) -> list[Quantity]:
        found = []
        if {"omega", "omega_space"} & set(names):
            found.append(Quantity(SOLUTION_ERROR, "omega"))
        if "gamma" in names or self.form:
            found.append(Quantity(SOLUTION_ERROR, "gamma"))
        if whole(names):
            found += [Quantity(SOLUTION_ERROR, "along"), Quantity(SOLUTION_ERROR, "across")]
        if self.form:
            found.append(Quantity(ATTITUDE_ERROR))
        if "position" in names:
            found.append(Quantity(POSITION_ERROR))
            found += [Quantity(POSITION_ERROR, "relative")] if self.distance_squared else []
        return [*found, Quantity(SOLUTION_ERROR, "relative")]

    @whole_evaluation
    def __call__(self, time: Fraction, values: Values, state: Sequence[arb] | None) -> None:
        """Take in one sample.  state: as :func:`state_of` finds it."""
        true = self.truth.state(time, self.bits) if self.truth.covers(time) else None
        if true is None:
            return
        with working_precision(self.bits):
            found = self._errors(values, true)
            if state is not None:
                delta = [a - b for a, b in zip(state, true[:6], strict=True)]
                along, across = split(delta, self.system.field(self.parameters, true[:6]))
                found |= {Quantity(SOLUTION_ERROR, "along"): along, Quantity(SOLUTION_ERROR, "across"): across}
            for quantity, running in self.running.items():
                running.take(time, running.following(found[quantity]), time in self.keep)
            self.last = float(found[Quantity(SOLUTION_ERROR, "relative")].abs_upper())

    def _errors(self, values: Values, true: Sequence[arb]) -> dict[Quantity, arb]:
        """Each error at one sample, at the working precision."""
        axes = [[ball(entry) for entry in row] for row in self.posed.axes]
        omega, gamma = body_to_space(axes, true[:3]), body_to_space(axes, true[3:6])
        rows: list[list[arb]] | None = None
        if len(true) > 6:
            along = body_to_space(axes, true[6:9])
            rows = [along, _cross(gamma, along), gamma]
        given = {name: [ball(value) for value in part] for name, part in values.items()}
        found: dict[Quantity, arb] = {}
        columns: list[arb] = []
        for name, part in given.items():
            errors = self._of_columns(name, part, omega, gamma, rows)
            columns.append(errors.pop(Quantity(SOLUTION_ERROR, "relative")))
            for quantity, error in errors.items():
                found[quantity] = largest((found.get(quantity, error), error))
        return found | {Quantity(SOLUTION_ERROR, "relative"): largest(columns)}

    def _of_columns(
        self, name: str, part: list[arb], omega: list[arb], gamma: list[arb], rows: list[list[arb]] | None
    ) -> dict[Quantity, arb]:
        relative = Quantity(SOLUTION_ERROR, "relative")
        if name in ("omega", "gamma"):
            return _vector_error(name, part, omega if name == "omega" else gamma)
        assert rows is not None
        if name == "omega_space":
            return _vector_error("omega", self.said.upright(part), body_to_space(rows, omega))
        if name == "position":
            return self._position(part, rows)
        found = self.said.upright(self.said.rotation(name, part, ball_functions()))
        entries = largest(a - b for u, v in zip(found, rows, strict=True) for a, b in zip(u, v, strict=True))
        if name == "quaternion":
            entries = largest((entries, (sum((c * c for c in part), arb(0)) - 1) / 2))
        third = largest(a - b for a, b in zip(found[2], rows[2], strict=True))
        return {
            relative: entries,
            Quantity(ATTITUDE_ERROR): attitude_angle(found, rows),
            Quantity(SOLUTION_ERROR, "gamma"): third,
        }

    def _position(self, part: list[arb], rows: list[list[arb]]) -> dict[Quantity, arb]:
        pivot = [ball(value) for value in self.said.pivot]
        given = self.said.upright([a - b for a, b in zip(part, pivot, strict=True)])
        true = body_to_space(rows, [ball(value) for value in self.point])
        off = [a - b for a, b in zip(given, true, strict=True)]
        length, relative = root(dot(off, off)), Quantity(SOLUTION_ERROR, "relative")
        if not self.distance_squared:
            return {Quantity(POSITION_ERROR): length, relative: length}
        part_of = length / ball(self.distance_squared).sqrt()
        return {Quantity(POSITION_ERROR): length, Quantity(POSITION_ERROR, "relative"): part_of, relative: part_of}

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``attitude_error_max``, ``_rms``, ``_final``, ...; of the relative error of all columns the largest."""
        with working_precision(self.bits):
            found: dict[Quantity, Metric] = {}
            for quantity, running in self.running.items():
                every = running.metrics(quantity)
                only = quantity == Quantity(SOLUTION_ERROR, "relative")
                found |= {quantity.over("max"): every[quantity.over("max")]} if only else every
            return by_name(found)

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The same over the kept times, but for relative errors."""
        return {
            quantity.text: running.series(quantity, time_text)
            for quantity, running in self.running.items()
            if quantity.component != "relative"
        }


def _vector_error(name: str, given: Sequence[arb], true: Sequence[arb]) -> dict[Quantity, arb]:
    off = [a - b for a, b in zip(given, true, strict=True)]
    return {
        Quantity(SOLUTION_ERROR, name): largest(off),
        Quantity(SOLUTION_ERROR, "relative"): relative_error(off, true),
    }


def _cross(a: Sequence[arb], b: Sequence[arb]) -> list[arb]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def whole(names: Sequence[str]) -> bool:
    """Whether these columns give Ω and γ."""
    attitude = any(form in names for form in FORMS)
    return ("omega" in names or ("omega_space" in names and attitude)) and ("gamma" in names or attitude)


def state_of(values: Values, said: Convention, posed: Posed, bits: int) -> list[arb] | None:
    """Ω and γ in principal axes of a sample that gives both, else None; Ω of the body's axes before that of space."""
    if not whole(list(values)):
        return None
    with working_precision(bits):
        given = {name: [ball(value) for value in part] for name, part in values.items()}
        form = next((each for each in FORMS if each in given), None)
        rows = None if form is None else said.upright(said.rotation(form, given[form], ball_functions()))
        gamma = given["gamma"] if "gamma" in given else (rows or [])[2]
        if "omega" in given:
            omega = given["omega"]
        else:
            assert rows is not None
            omega = space_to_body(rows, said.upright(given["omega_space"]))
        axes = [[ball(entry) for entry in row] for row in posed.axes]
        return [*space_to_body(axes, omega), *space_to_body(axes, gamma)]


class ObservedScorer:
    """Drift where the state is whole, errors where there is a reference."""

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
        self.drift = Drift(plain, problem.integrals(), keep) if whole(names) else None
        self.error = None if isinstance(truth, str) else ObservedErrors(problem, truth, posed, said, names, keep)

    @whole_evaluation
    def __call__(self, time: Fraction, values: Values) -> None:
        """Take in one sample."""
        state = state_of(values, self.said, self.posed, self.bits)
        if self.drift is not None and state is not None:
            self.drift.take(time, self.drift.following(state))
        if self.error is not None:
            self.error(time, values, state)

    @property
    def against(self) -> Against:
        """What the motion was compared with."""
        if isinstance(self.truth, str):
            return Against("none", reason=f"no reference: {self.truth}")
        return self.truth.against

    def metrics(self) -> dict[str, Metric]:
        """``drift_NAME_max``, ... where the state is whole; the errors where there is a reference."""
        drift = self.drift.metrics() if self.drift else {}
        return drift | (self.error.metrics() if self.error else {})

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The same over the kept times."""
        drift = self.drift.series(time_text) if self.drift else {}
        return drift | (self.error.series(time_text) if self.error else {})
