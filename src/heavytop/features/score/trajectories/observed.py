"""Trajectories as they are scored, from a document or from arrays: states, attitudes, positions, Ω in any axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Any

import numpy

from heavytop import written_numbers
from heavytop.arguments import MOST_STATES, SLACK_BITS, bits_of, component
from heavytop.errors import InputError, prefixed, require_as_many
from heavytop.exact.resolved import resolve
from heavytop.features.score.diagnose.readings import GivenStart, Observations, Reading, body_data
from heavytop.features.score.diagnose.samples import floats
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.attitude_error import Convention, Posed, space_to_body
from heavytop.precision import (
    Precision,
    Vector,
    cross,
    decimal_text,
    dot,
    number,
    round_to,
    shown,
    six_digits,
    square_root,
)
from heavytop.top.attitude import Angle, Attitude, multiple_of_quaternion, perpendicular, rotated, rotation_of
from heavytop.top.bodies import CENTRE, Body
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, VARIABLES, System, system_of
from heavytop.top.heavy_top import HeavyTop, State, require_physical
from heavytop.top.inertia_slips import determinant

# Bodies of trajectory files: rounded to a format, in principal axes, and in double.
#
# Irrational principal axes are replaced by a rational rotation near them, to 160 bits more than the format has: the
# products of inertia that remain are that much below the resolution of the format.


AnyBody = HeavyTop | Body
Tensor = tuple[Vector, Vector, Vector]


def _triple(values: Sequence[Fraction]) -> Vector:
    first, second, third = values
    return first, second, third


def _rounded(values: Sequence[Fraction], precision: Precision) -> tuple[Fraction, ...]:
    return tuple(round_to(value, precision.bits) for value in values)


def rounded_body(body: AnyBody, precision: Precision) -> AnyBody:
    """The body with each of its given numbers rounded to the format."""
    centre, rotor = _rounded(body.centre, precision), body.rotor and _rounded(body.rotor, precision)
    if isinstance(body, HeavyTop):
        return HeavyTop(_rounded(body.inertia, precision), round_to(body.weight, precision.bits), centre, rotor)
    mass, gravity = _rounded([body.mass, body.gravity], precision)
    tensor = [_rounded(row, precision) for row in (body.central if body.about == CENTRE else body.tensor)]
    return Body(mass, gravity, centre, tensor, body.about, rotor)


def in_principal_axes(body: AnyBody, bits: int) -> tuple[HeavyTop, Tensor]:
    """The body in principal axes, and the rows of A, v_given = A v_principal; irrational axes to so many bits."""
    resolved = resolve(body, State((0, 0, 0), (0, 0, 1)), bits)
    return resolved.top, resolved.axes


# The start of a file with attitudes: R and Ω as exact numbers, and the body with them in principal axes.


_ROW_SLACK = Fraction(1, 100)
"""Tolerance of a start read from a row t = 0: it has the digits of the other rows."""
_FAR = Fraction(1, 10)
"""Tolerance of the quaternion or matrix of a row."""
_IRRATIONAL_BITS = 1200
"""Precision of an attitude with irrational entries, before it is rounded to the format."""

Rows = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class RawStart:
    """The start as the file gives it.

    form: of ``values``: quaternion, matrix, euler, gamma; or plain, R from body to space in any convention of matrices.
    omega: in body axes, or in those of space where ``in_space``.
    gamma: given with an attitude.  from_row: whether it is the row t = 0.  degrees: the unit of angles.
    """

    form: str
    values: tuple[Fraction, ...]
    omega: Vector
    in_space: bool = False
    gamma: Vector | None = None
    from_row: bool = False
    degrees: bool = False

    def rounded(self, precision: Precision) -> RawStart:
        """These quantities in numbers of a format."""
        omega = _triple(_rounded(self.omega, precision))
        return replace(self, values=_rounded(self.values, precision), omega=omega)


def slack_of_start(from_row: bool, precision: Precision) -> Fraction:
    """The amount by which γ, a quaternion or a matrix at the start may be off, from the row t = 0 or by rounding."""
    return _ROW_SLACK if from_row else 2**SLACK_BITS * precision.eps


def rotation(raw: RawStart, convention: Convention, precision: Precision, normalize: bool) -> Rows:
    """R in canonical axes of space, exactly orthogonal: three rows ξ, η, γ of exact numbers.

    normalize: take the nearest rotation, however far it is.
    Raises InputError for a quaternion off length 1, a matrix that is not a rotation, and a γ that is not its third row.
    """
    slack = slack_of_start(raw.from_row, precision)
    if raw.form == "gamma":
        return _of_gamma(raw, slack, normalize)
    where = "the row t = 0" if raw.from_row else "the start" if raw.form == "plain" else f"start_{raw.form}"
    if not normalize:
        require_rotation(raw.form, raw.values, slack, f"The {raw.form} of {where}")
    if raw.form == "quaternion":
        require_direction(raw.values, f"The quaternion of {where}")
        rows: Any = convention.rotation("quaternion", raw.values, None)
    else:
        rows = _orthogonal(raw, convention, precision)
    rotations = [tuple(row) for row in convention.upright(rows)]
    if raw.gamma is not None:
        off = max(abs(a - b) for a, b in zip(raw.gamma, rotations[2], strict=True))
        if off > max(slack, Fraction(1, 10**6)):
            raise InputError(
                f"gamma and {where} contradict each other: gamma is ({_list(raw.gamma)}), but the third row of R is "
                f"({_list(rotations[2])}).",
                "Give one of them; with up = another axis than z gamma still points up.",
            )
    return rotations[0], rotations[1], rotations[2]


def _list(values: Sequence[Fraction]) -> str:
    return ", ".join(six_digits(value) for value in values)


def _of_gamma(raw: RawStart, slack: Fraction, normalize: bool) -> Rows:
    state = State(raw.omega, raw.values)
    if not normalize:
        state.require_unit_gamma(slack, "Write all its digits, or use --normalize.")
    gamma = state.normalized(_SPARE_BITS + 64).gamma
    xi = perpendicular(gamma)
    a, b, c = cross(gamma, xi)
    return xi, (a, b, c), gamma


def _orthogonal(raw: RawStart, convention: Convention, precision: Precision) -> Rows:
    """R, exactly orthogonal, near a rounded matrix or of angles."""
    if raw.form == "euler":
        angles = tuple(Angle(value, raw.degrees) for value in raw.values)
        return Attitude("euler", angles=angles, sequence=convention.sequence).rational_rows(
            precision.bits + _SPARE_BITS
        )
    plain = replace(convention, matrix="body_to_space") if raw.form == "plain" else convention
    return rotation_of(multiple_of_quaternion(plain.rotation("matrix", raw.values, None)))


def require_direction(values: Sequence[Fraction], what: str) -> None:
    """Raises InputError for a zero quaternion."""
    if not any(values):
        raise InputError(f"{what} must not be zero.", "Give a quaternion of length 1.")


def require_rotation(form: str, values: Sequence[Fraction], slack: Fraction, what: str) -> None:
    """Raises InputError that says by how much, unless a quaternion has length 1 and a matrix is a rotation."""
    if form == "quaternion":
        off = dot((*values[:3],), (*values[:3],)) + values[3] ** 2 - 1
        if abs(off) > 2 * slack:
            raise InputError(
                f"{what} must have length 1; |q|^2 - 1 = {six_digits(off)}.",
                "Divide it by its length, or use --normalize (normalize=True in Python).",
            )
    if form == "matrix":
        rows = [values[0:3], values[3:6], values[6:9]]
        volume = determinant(rows)
        off = max((dot(rows[i], rows[j]) - (i == j) for i in range(3) for j in range(i + 1)), key=abs)
        if volume < 0 and abs(off) <= _FAR:
            raise InputError(
                f"{what} is a reflection, not a rotation: its determinant is {six_digits(volume)}.",
                "These are left-handed axes: reverse one axis of space or of the body.",
            )
        if abs(off) > 2 * slack:
            remedy = "Write all its digits, or use --normalize (normalize=True in Python)"
            raise InputError(
                f"{what} is not orthogonal: R R^T differs from the identity by {six_digits(off)}.",
                f"{remedy}, which takes the nearest rotation.",
            )


def raw_start(start: State) -> RawStart:
    """The start of a program: by its attitude where it has one, else by γ."""
    omega = start.omega if start.omega_space is None else start.omega_space
    space = start.omega_space is not None
    if start.attitude is None:
        return RawStart("gamma", start.gamma, omega, space)
    rows = start.attitude.rational_rows(_IRRATIONAL_BITS)
    return RawStart("plain", tuple(entry for row in rows for entry in row), omega, space)


# Trajectories of other programs: exact times, states rounded to the format.


LONGEST_NAME = 200
_ODD_GAMMA = Fraction(1, 10)
"""Distance of |γ|² from 1 that neither rounding nor, in general, a method explains."""
_FITS_ANYWHERE = 1 << 1023
"""Every format represents numbers below that."""


@dataclass(frozen=True, slots=True)
class GivenTrajectory:
    """A trajectory of another program.

    times: exact, as written.  states: six exact numbers each, rounded to the format; None for a state that is not
    finite.  name, integrator: of the row.  flags: further keys of the file.  sha256: of the file.
    format_guessed: whether the format was inferred from the digits.  notes: assumptions made in reading the file.
    cut: why later rows of the file are not scored; empty where all are.
    observed: the quantities in place of Ω and γ in principal axes; the states are then all numbers of a row, and top
    and start are in principal axes.
    """

    name: str
    integrator: str
    top: HeavyTop
    start: State
    system: System
    precision: Precision
    times: list[Fraction]
    states: list[tuple[Fraction, ...] | None]
    outcome: Outcome
    steps: int
    flags: dict[str, str]
    sha256: str = ""
    format_guessed: bool = False
    notes: tuple[str, ...] = ()
    cut: str = ""
    observed: Observed | None = None

    @property
    def step(self) -> Fraction | None:
        """The step of the method, where the file gives it."""
        return written_numbers.number(self.flags["step"], "step") if "step" in self.flags else None

    def warnings(self) -> list[str]:
        """Warnings of data that no rigid body has, and of γ that suggests another order of the columns."""
        question = f"are the states in the order {' '.join(VARIABLES)}?"
        rows: Sequence[tuple[Fraction, ...] | None] = [state and state[3:] for state in self.states]
        if self.observed is not None:
            rows, question = self.observed.columns.get("gamma", []), "are these columns γ?"
        sentences = [*self.notes, *(self.top if self.observed is None else self.observed.body).warnings()]
        for time, row in zip(self.times, rows, strict=False):
            if row is not None and abs(off := dot(row, row) - 1) > _ODD_GAMMA:
                odd = f"|gamma|^2 differs from 1 by {decimal_text(off, 3)} at t = {shown(time)}"
                return [*sentences, f"{odd}: {question}"]
        return sentences


def of_arrays(
    top: HeavyTop,
    start: State,
    which: System,
    times: list[Fraction],
    rows: list[list[Any]],
    precision: Precision | None,
    name: str,
    integrator: str,
) -> GivenTrajectory:
    """A trajectory from memory: exact times, and states of six numbers each in any format or as text.

    precision: None for the narrowest format that holds every number as it is given.
    Raises InputError for what is not a number, for counts that differ or are too large, for names that cannot be shown.
    """
    require_states(times, rows)
    form = precision or written_numbers.of_bits(max(bits_of(value) for row in rows for value in row))
    states = [rounded_state([component(value) for value in row], form) for row in rows]
    return _from_memory((name, integrator), top, start, which, form, times, states)


def _from_memory(names: tuple[str, str], *data: Any, observed: Observed | None = None) -> GivenTrajectory:
    """The trajectory of this name and integrator; data: top, start, system, format, times and states."""
    name, integrator = named(names[0], "name"), named(names[1], "integrator")
    fields: Any = (*data, Outcome.NON_FINITE if None in data[-1] else Outcome.SUCCESS, 0, {})
    return replace(GivenTrajectory(name, integrator, *fields), observed=observed)


def require_states(times: list[Fraction], rows: list[Any]) -> None:
    """Raises InputError unless there are as many states as times, and not too many."""
    require_as_many("states", len(rows), len(times))
    if len(times) > MOST_STATES:
        raise too_many(len(times))


def too_many(count: int, what: str = "states") -> InputError:
    """Error text for too many states, or for lines that must hold too many."""
    every = -(-count // MOST_STATES)
    return InputError(
        f"{count} {what} are too many to score.", f"Give at most {MOST_STATES} states, such as one row in {every}."
    )


def named(text: str, what: str) -> str:
    """The text; raises InputError for one that is empty, too long or cannot be shown."""
    if not 0 < len(text) <= LONGEST_NAME or not text.isprintable():
        raise InputError(
            f"The {what} has {len(text)} characters; it begins {text[:40]!r}.",
            f"Use 1 to {LONGEST_NAME} printable characters.",
        )
    return text


def rounded_state(values: list[Fraction | None], precision: Precision) -> tuple[Fraction, ...] | None:
    """The numbers rounded to the format; None where one is not finite in it, as 1e400 in double."""
    numbers = tuple(round_to(value, precision.bits) for value in values if value is not None)
    finite = len(numbers) == len(values) and all(_fits(value, precision) for value in numbers)
    return numbers if finite else None


def _fits(value: Fraction, precision: Precision) -> bool:
    if abs(value) < _FITS_ANYWHERE:
        return True
    try:
        number(value, precision)
    except InputError:
        return False
    return True


_SPARE_BITS = 160
"""Bits of principal axes beyond those of the format."""


@dataclass(frozen=True, slots=True)
class Observed:
    """Quantities that a trajectory has in place of Ω and γ in principal axes.

    columns: by the name of the quantity, the rounded numbers of each sample up to the first that is not finite.
    convention: of these columns.  posed: the body and its start in principal axes, rounded to the format before.
    body, start: both in the axes of the file, for the diagnosis.  attitude: what the quaternions are in the file.
    """

    columns: Mapping[str, list[tuple[Fraction, ...]]]
    convention: Convention
    posed: Posed
    body: AnyBody
    start: RawStart
    attitude: str = "quaternion"

    @property
    def names(self) -> list[str]:
        """The quantities that are scored."""
        return list(self.columns)

    def sample(self, row: int) -> dict[str, tuple[Fraction, ...]]:
        """The numbers of one row."""
        return {name: rows[row] for name, rows in self.columns.items()}

    def observations(self, times: Sequence[Fraction]) -> Observations | None:
        """The samples in double; None where no double holds them."""
        try:
            columns = {name: numpy.array(rows, dtype=float) for name, rows in self.columns.items()}
            body, point = body_data(self.body), self.convention.point
            pivot, start = floats(self.convention.pivot), _start(self.start, self.posed)
        except OverflowError:
            return None
        of = body.centre if point is None else floats(point)
        count = min(map(len, columns.values()), default=0)
        reading = Reading.of(self.convention)
        if self.start.form == "euler" and "euler" not in columns:
            reading = replace(reading, angles="degrees" if self.start.degrees else "radians")
        return Observations(tuple(times[:count]), columns, body, start, reading, of, pivot) if count else None


def _start(raw: RawStart, posed: Posed) -> GivenStart:
    if raw.form != "gamma":
        return GivenStart(raw.form, floats(raw.values), floats(raw.omega), raw.in_space)
    assert posed.xi is not None
    principal = posed.xi, cross(posed.start.gamma, posed.xi), posed.start.gamma
    rows = [rotated(posed.axes, vector) for vector in principal]
    return GivenStart("rows", floats([entry for row in rows for entry in row]), floats(raw.omega), raw.in_space)


def posed(
    body: AnyBody, raw: RawStart, convention: Convention, precision: Precision, normalize: bool
) -> tuple[AnyBody, RawStart, Posed]:
    """Body and start rounded to the format, and both in principal axes."""
    body, start = rounded_body(body, precision), raw.rounded(precision)
    top, axes = in_principal_axes(body, precision.bits + _SPARE_BITS)
    rows = rotation(start, convention, precision, normalize)
    omega = space_to_body(rows, convention.upright(start.omega)) if start.in_space else start.omega
    in_principal = [space_to_body(axes, v) for v in (omega, rows[2], rows[0])]
    w, gamma, xi = (_triple(v) for v in in_principal)
    return body, start, Posed(top, State(w, gamma), xi, axes, body.centre)


def observed(
    body: AnyBody,
    raw: RawStart,
    convention: Convention,
    values: Mapping[str, Sequence[tuple[Fraction, ...] | None]],
    places: Sequence[str],
    precision: Precision,
    normalize: bool = False,
) -> tuple[Observed, list[tuple[Fraction, ...] | None]]:
    """Scored columns, and for each row all of its numbers, None where one is not finite.

    normalize: take quaternions and matrices of any length for their rotations, at the start and in the rows.
    Raises InputError for quaternions and matrices that are none, with their place.
    """
    rounded = {name: [row and rounded_state(list(row), precision) for row in rows] for name, rows in values.items()}
    for form in ("quaternion", "matrix"):
        for row, place in zip(rounded.get(form, ()), places, strict=False):
            if row is not None and form == "quaternion":
                require_direction(row, f"The quaternion of {place}")
            if row is not None and not normalize:
                require_rotation(form, row, _FAR, f"The {form} of {place}")
    rows = [tuple(chain(*filter(None, parts))) if all(parts) else None for parts in zip(*rounded.values(), strict=True)]
    done = next((i for i, row in enumerate(rows) if row is None), len(rows))
    columns = {name: [row for row in part[:done] if row is not None] for name, part in rounded.items()}
    if normalize:
        columns = {name: _normalized(name, part) for name, part in columns.items()}
    body, start, observed = posed(body, raw, convention, precision, normalize)
    return Observed(columns, convention, observed, body, start), rows


def _normalized(name: str, rows: list[tuple[Fraction, ...]]) -> list[tuple[Fraction, ...]]:
    """Quaternions of length 1 but for a rounding in 128 bits, and the rotations next to matrices."""
    if name == "quaternion":
        return [unit(row) for row in rows]
    if name != "matrix":
        return rows
    quaternions = [unit(multiple_of_quaternion([row[0:3], row[3:6], row[6:9]])) for row in rows]
    return [tuple(entry for row in rotation_of(quaternion) for entry in row) for quaternion in quaternions]


def unit(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The vector over its length, to 128 bits."""
    length, scale = square_root(sum((value * value for value in values), Fraction(0)), 128), 1 << 128
    return tuple(Fraction(round(value / length * scale), scale) for value in values)


def of_observed_arrays(
    body: AnyBody,
    raw: RawStart,
    convention: Convention,
    times: list[Fraction],
    arrays: Mapping[str, list[list[Any]]],
    precision: Precision | None,
    names: tuple[str, str],
    normalize: bool = False,
) -> GivenTrajectory:
    """A trajectory from memory: rows of numbers of each quantity, in any format or as text.

    precision: None for the narrowest format that holds every number as it is given.  names: of the row and the
    integrator.
    Raises InputError for what is not a number, for counts that differ or are too large, and as :func:`observed`.
    """
    for rows in arrays.values():
        require_states(times, rows)
    numbers = [value for rows in arrays.values() for row in rows for value in row]
    form = precision or written_numbers.of_bits(max(bits_of(value) for value in numbers))
    values = {name: [_row(row, f"{name}[{i}]") for i, row in enumerate(rows)] for name, rows in arrays.items()}
    places = [f"row {i}" for i in range(len(times))]
    quantities, states = observed(body, raw, convention, values, places, form, normalize)
    require_physical(quantities.posed.top, quantities.posed.start)
    top, start = quantities.posed.top, quantities.posed.start
    return _from_memory(names, top, start, system_of(None, body), form, times, states, observed=quantities)


def _row(row: Sequence[Any], where: str) -> tuple[Fraction, ...] | None:
    with prefixed(where):
        numbers = [component(value) for value in row]
    finite = tuple(value for value in numbers if value is not None)
    return finite if len(finite) == len(numbers) else None


def require_system(system: System) -> None:
    """Raises InputError for a system whose attitude is not scored."""
    if system not in (HEAVY_TOP, HEAVY_GYROSTAT):
        raise InputError(
            f"Attitudes and positions are not scored in the system {system.name}.", 'Use "heavy_top", or give Ω and γ.'
        )
