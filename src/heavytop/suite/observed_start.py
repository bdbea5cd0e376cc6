"""The start of a file with attitudes: R and Ω as exact numbers, and the body with them in principal axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.measure.conventions import Convention, space_to_body
from heavytop.precision import Precision, decimal_text, round_to
from heavytop.top.angles import perpendicular
from heavytop.top.attitude import Angle, Attitude
from heavytop.top.heavy_top import State, Vector, cross, dot

_SLACK = 8
"""A quaternion or a matrix may be off by so many bits of rounding."""
_ROW_SLACK = Fraction(1, 100)
"""What is read from a row t = 0 is written with the digits of the other rows."""
_FAR = Fraction(1, 10)
"""A row whose quaternion or matrix is off by more is refused."""
_SPARE_BITS = 160
_IRRATIONAL_BITS = 1200
"""Of an attitude whose entries are irrational, before it is rounded to the format."""

Rows = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class RawStart:
    """The start as the file gives it.

    form: of ``values``: quaternion, matrix, euler, gamma; or plain, R from body to space whatever matrices are.
    omega: in body axes, or in those of space.
    gamma: given beside an attitude.  from_row: whether it is the row t = 0.  degrees: of angles.
    """

    form: str
    values: tuple[Fraction, ...]
    omega: Vector
    in_space: bool = False
    gamma: Vector | None = None
    from_row: bool = False
    degrees: bool = False

    def rounded(self, precision: Precision) -> RawStart:
        """The same in numbers of a format."""

        def both(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
            return tuple(round_to(value, precision.bits) for value in values)

        a, b, c = both(self.omega)
        return replace(self, values=both(self.values), omega=(a, b, c))


def rotation(raw: RawStart, said: Convention, precision: Precision, normalize: bool) -> Rows:
    """R in canonical axes of space, exactly orthogonal: three rows ξ, η, γ of exact numbers.

    normalize: take the rotation nearest to what is given, however far off it is.
    Raises InputError for a quaternion that has not length 1, a matrix that is not a rotation, and a γ beside it that is
    not its third row.
    """
    slack = _ROW_SLACK if raw.from_row else 2**_SLACK * precision.eps
    if raw.form == "gamma":
        return _of_gamma(raw, slack, normalize)
    where = "the row t = 0" if raw.from_row else "the start" if raw.form == "plain" else f"start_{raw.form}"
    if not normalize:
        require_rotation(raw.form, raw.values, slack, f"The {raw.form} of {where}")
    if raw.form == "quaternion":
        require_direction(raw.values, f"The quaternion of {where}")
        rows: Any = said.rotation("quaternion", raw.values, None)
    else:
        rows = _orthogonal(raw, said, precision)
    found = [tuple(row) for row in said.upright(rows)]
    if raw.gamma is not None:
        off = max(abs(a - b) for a, b in zip(raw.gamma, found[2], strict=True))
        if off > max(slack, Fraction(1, 10**6)):
            raise InputError(
                f"gamma and {where} contradict each other: gamma is ({_list(raw.gamma)}), but the third row of R is "
                f"({_list(found[2])}).",
                "Give one of them; with up = another axis than z gamma still points up.",
            )
    return found[0], found[1], found[2]


def _list(values: Sequence[Fraction]) -> str:
    return ", ".join(decimal_text(value, 6) for value in values)


def _of_gamma(raw: RawStart, slack: Fraction, normalize: bool) -> Rows:
    state = State(raw.omega, raw.values)
    if not normalize:
        state.require_unit_gamma(slack, "Give it in full, or use --normalize.")
    gamma = state.normalized(_SPARE_BITS + 64).gamma
    xi = perpendicular(gamma)
    a, b, c = cross(gamma, xi)
    return xi, (a, b, c), gamma


def _orthogonal(raw: RawStart, said: Convention, precision: Precision) -> Rows:
    """R of a matrix that is off by roundings, or of angles: of the quaternion next to it, so that it is orthogonal."""
    if raw.form == "euler":
        angles = tuple(Angle(value, raw.degrees) for value in raw.values)
        return Attitude("euler", angles=angles, sequence=said.sequence).rational_rows(precision.bits + _SPARE_BITS)
    plain = replace(said, matrix="body_to_space") if raw.form == "plain" else said
    return of_quaternion(nearest_quaternion(plain.rotation("matrix", raw.values, None)))


def of_quaternion(q: Sequence[Fraction]) -> Rows:
    """R of a quaternion w, x, y, z of any length, exactly."""
    first, second, third = (tuple(row) for row in Convention().rotation("quaternion", q, None))
    return first, second, third


def nearest_quaternion(rows: Sequence[Sequence[Fraction]]) -> list[Fraction]:
    """w, x, y, z of the direction of a rotation matrix, of no unit length; by the largest of the four."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    candidates = (
        [1 + a + e + i, h - f, c - g, d - b],
        [h - f, 1 + a - e - i, b + d, c + g],
        [c - g, b + d, 1 - a + e - i, f + h],
        [d - b, c + g, f + h, 1 - a - e + i],
    )
    return list(max(enumerate(candidates), key=lambda pair: pair[1][pair[0]])[1])


def require_direction(values: Sequence[Fraction], what: str) -> None:
    """Raises InputError for a quaternion 0, which is no attitude."""
    if not any(values):
        raise InputError(f"{what} is 0, which is no attitude.", "Give a quaternion of length 1.")


def require_rotation(form: str, values: Sequence[Fraction], slack: Fraction, what: str) -> None:
    """Raises InputError that says by how much, unless a quaternion has length 1 and a matrix is a rotation."""
    if form == "quaternion":
        off = dot((*values[:3],), (*values[:3],)) + values[3] ** 2 - 1
        if abs(off) > 2 * slack:
            raise InputError(
                f"{what} has not length 1: |q|^2 - 1 = {decimal_text(off, 6)}.",
                "Divide it by its length, or use --normalize (normalize=True in Python).",
            )
    if form == "matrix":
        require_matrix([values[0:3], values[3:6], values[6:9]], slack, what)


def require_matrix(rows: Sequence[Sequence[Fraction]], slack: Fraction, what: str) -> None:
    """Raises InputError for a reflection, and for rows that are not orthogonal and of length 1 within ``slack``."""
    determinant = dot(rows[0], cross(rows[1], rows[2]))
    products = [dot(rows[i], rows[j]) - (i == j) for i in range(3) for j in range(i + 1)]
    off = max(products, key=abs)
    if determinant < 0 and abs(off) <= _FAR:
        raise InputError(
            f"{what} is a reflection, not a rotation: its determinant is {decimal_text(determinant, 6)}.",
            "These are left-handed axes: reverse one axis of space or of the body.",
        )
    if abs(off) > 2 * slack:
        raise InputError(
            f"{what} is not orthogonal: R R^T is off the unit matrix by {decimal_text(off, 6)}.",
            "Give it in full, or use --normalize (normalize=True in Python), which takes the rotation next to it.",
        )


def require_rows(form: str, rows: Sequence[Sequence[Fraction] | None], places: Sequence[str], normalize: bool) -> None:
    """Raises InputError for the first row whose quaternion or matrix is far from one of a rotation."""
    for row, place in zip(rows, places, strict=True):
        if row is None:
            continue
        if form == "quaternion":
            require_direction(row, f"The quaternion of {place}")
        if not normalize:
            require_rotation(form, row, _FAR, f"The {form} of {place}")


def body_omega(raw: RawStart, said: Convention, rows: Rows) -> Vector:
    """Ω at t = 0 in body axes."""
    if not raw.in_space:
        return raw.omega
    a, b, c = space_to_body(rows, said.upright(raw.omega))
    return a, b, c


def raw_start(start: State) -> RawStart:
    """The start of a program: by its attitude where it has one, else by γ."""
    omega = start.omega if start.omega_space is None else start.omega_space
    space = start.omega_space is not None
    if start.attitude is None:
        return RawStart("gamma", start.gamma, omega, space)
    rows = start.attitude.rational_rows(_IRRATIONAL_BITS)
    return RawStart("plain", tuple(entry for row in rows for entry in row), omega, space)
