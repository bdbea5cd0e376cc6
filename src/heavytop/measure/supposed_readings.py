"""What the columns of a file with attitudes may mean: one reading of its conventions, and its error beside a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import SimpleNamespace

import numpy

from heavytop.measure.conventions import UPS, Convention
from heavytop.measure.supposed_motion import Array, Beginning, BodyData, Course
from heavytop.top.attitude import matrix_of_quaternion, rows_of_euler

_NUMPY = SimpleNamespace(sin=numpy.sin, cos=numpy.cos)
_DEGREE = numpy.pi / 180
_EYE = tuple(map(tuple, numpy.eye(3).tolist()))
Square = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """What the columns mean, or the start.

    scalar_last, conjugate: of quaternions.  transposed: of matrices.  sequence, extrinsic, negated, degrees: of angles.
    up: the axis that points up.  swapped: Ω said to be in body axes is in space axes, and the other way round.
    omega, gamma: factors that the columns have beside Ω and γ.  momentum: M stands in place of Ω.
    space, body: rotations Q, B so that the file's vectors are Q v and B v.  mirror: the axis, from 0, that is reversed;
    pseudo: whether Ω is then turned over as well.
    scale: a factor of positions.  displaced: from the first position.  offset: added to every position, in canonical
    axes of space.  point: whose positions they are; None for the one that was said.
    """

    scalar_last: bool = False
    conjugate: bool = False
    transposed: bool = False
    sequence: str = ""
    extrinsic: bool = False
    negated: bool = False
    degrees: bool = False
    up: str = "z"
    swapped: bool = False
    omega: float = 1.0
    gamma: float = 1.0
    momentum: bool = False
    space: Square = _EYE
    body: Square = _EYE
    mirror: int | None = None
    pseudo: bool = True
    scale: float = 1.0
    displaced: bool = False
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    point: tuple[float, float, float] | None = None

    @classmethod
    def of(cls, said: Convention) -> Reading:
        """What a file says of itself."""
        return cls(
            scalar_last=said.quaternion_order == "xyzw",
            conjugate=said.quaternion == "space_to_body",
            transposed=said.matrix == "space_to_body",
            sequence=said.sequence,
            degrees=said.angles == "degrees",
            up=said.up,
        )

    def rotation(self, form: str, values: Array) -> Array:
        """R in canonical axes of space from the columns of ``form``, shape (n, 3, 3)."""
        found = self._plain(form, values)
        if self.mirror is not None:
            signs = numpy.where(numpy.arange(3) == self.mirror, -1.0, 1.0)
            found = found * signs[:, None] * signs
        return upright(numpy.array(self.space).T @ found @ numpy.array(self.body), self.up)

    def _plain(self, form: str, values: Array) -> Array:
        if form == "quaternion":
            unit = values / numpy.linalg.norm(values, axis=1)[:, None]
            w, x, y, z = (unit[:, [3, 0, 1, 2]] if self.scalar_last else unit).T
            found = _stacked(matrix_of_quaternion((w, x, y, z)), len(values))
            return found.transpose(0, 2, 1) if self.conjugate else found
        if form == "matrix":
            found = values.reshape(-1, 3, 3)
            return found.transpose(0, 2, 1) if self.transposed else found
        angles = values * (-1 if self.negated else 1) * (_DEGREE if self.degrees else 1)
        if self.extrinsic:
            return _stacked(rows_of_euler(self.sequence[::-1], list(angles[:, ::-1].T), _NUMPY), len(values))
        return _stacked(rows_of_euler(self.sequence, list(angles.T), _NUMPY), len(values))

    def vectors(self, values: Array, axial: bool = False) -> Array:
        """Vectors of space in canonical axes, shape (n, 3)."""
        turned: Array = self._reflected(values, axial) @ numpy.array(self.space)
        return upright_vectors(turned, self.up)

    def body_vectors(self, values: Array, axial: bool = False) -> Array:
        """Vectors of the body in the axes said, shape (n, 3)."""
        found: Array = self._reflected(values, axial) @ numpy.array(self.body)
        return found

    def _reflected(self, values: Array, axial: bool) -> Array:
        if self.mirror is None:
            return values
        signs = numpy.where(numpy.arange(3) == self.mirror, -1.0, 1.0)
        return values * (-signs if axial and self.pseudo else signs)


def _stacked(rows: object, count: int) -> Array:
    """Rows of columns as an array of matrices."""
    found = numpy.empty((count, 3, 3))
    for i, row in enumerate(rows):  # type: ignore[arg-type,var-annotated]
        for j, entry in enumerate(row):
            found[:, i, j] = entry
    return found


def upright(matrices: Array, up: str) -> Array:
    """Matrices whose rows are axes of space, with canonical ones in their place."""
    places, signs = UPS[up]
    found: Array = matrices[..., list(places), :] * numpy.array(signs, dtype=float)[:, None]
    return found


def upright_vectors(vectors: Array, up: str) -> Array:
    """Vectors of space in canonical axes."""
    places, signs = UPS[up]
    found: Array = vectors[..., list(places)] * numpy.array(signs, dtype=float)
    return found


@dataclass(frozen=True, slots=True)
class Start:
    """The start as it was given.

    form: of ``values``: quaternion, matrix, euler; "rows", R in canonical axes of space; or "plain", R in those of the
    file, whatever its matrices are.  omega: in body axes, or those of space where ``in_space``.
    """

    form: str
    values: Array
    omega: Array
    in_space: bool = False

    def begin(self, reading: Reading, inertia: Array) -> Beginning:
        """Where the motion begins if the start is to be read so."""
        if self.form == "rows":
            rotation = self.values.reshape(3, 3)
            if reading.gamma < 0:
                rotation = rotation * numpy.array([[1.0], [-1.0], [-1.0]])
        elif self.form == "plain":
            rotation = replace(reading, transposed=False).rotation("matrix", self.values[None, :])[0]
        else:
            rotation = reading.rotation(self.form, self.values[None, :])[0]
        said = self.omega[None, :] / reading.omega
        if self.in_space != reading.swapped:
            omega = rotation.T @ reading.vectors(said, True)[0]
        else:
            omega = reading.body_vectors(said, True)[0]
        return Beginning(rotation, numpy.linalg.solve(inertia, omega) if reading.momentum else omega)


@dataclass(frozen=True, slots=True)
class Seen:
    """The samples of a file that are looked at.

    times: of one sign.  columns: by the name of the quantity, shape (n, width).  body, start, said: as the file says.
    point, pivot: of positions.  of: how many samples the file has.
    """

    times: tuple[Fraction, ...]
    columns: Mapping[str, Array]
    body: BodyData
    start: Start
    said: Reading
    point: Array
    pivot: Array
    of: int
    rows: tuple[int, ...] = field(default=())

    def at(self, rows: list[int]) -> Seen:
        """The same at some of its samples."""
        times = tuple(self.times[row] for row in rows)
        return replace(self, times=times, columns={k: v[rows] for k, v in self.columns.items()}, rows=tuple(rows))


def error(seen: Seen, course: Course | None, reading: Reading, body: BodyData) -> float:
    """The largest error of the columns, read so, relative to the size of each quantity; infinite without a motion."""
    if course is None:
        return float("inf")
    worst = max(_errors(seen, course, reading, body).values())
    return worst if worst == worst else float("inf")


def _errors(seen: Seen, course: Course, reading: Reading, body: BodyData) -> dict[str, float]:
    found = {}
    for name, values in seen.columns.items():
        if name == "position":
            found[name] = _position_error(seen, course, reading, values)
            continue
        if name == "gamma":
            off = numpy.abs(reading.body_vectors(values) / reading.gamma - course.rotation[:, 2]).max()
        elif name in ("omega", "omega_space"):
            off = _omega_error(course, reading, body, name, values)
        else:
            off = numpy.abs(reading.rotation(name, values) - course.rotation).max()
        found[name] = float(off)
    return found


def _omega_error(course: Course, reading: Reading, body: BodyData, name: str, values: Array) -> float:
    omega = course.omega
    if reading.momentum:
        omega = omega @ body.tensor
    if (name == "omega_space") != reading.swapped:
        true = numpy.einsum("nij,nj->ni", course.rotation, omega)
        given = reading.vectors(values, True)
    else:
        true, given = omega, reading.body_vectors(values, True)
    size = float(numpy.linalg.norm(true, axis=1).max()) or 1.0
    return float(numpy.abs(given / reading.omega - true).max()) / size


def _position_error(seen: Seen, course: Course, reading: Reading, values: Array) -> float:
    point = seen.point if reading.point is None else numpy.array(reading.point)
    true = course.rotation @ point
    if reading.displaced:
        true = true - seen.start.begin(reading, numpy.eye(3)).rotation @ point
    size = float(numpy.linalg.norm(point)) or 1.0
    given = reading.vectors(values - seen.pivot)
    return float(numpy.abs((given - numpy.array(reading.offset)) / reading.scale - true).max()) / size


def disagreement(seen: Seen) -> dict[tuple[str, str], Array]:
    """How far columns that say the same are apart in each sample, by their names; relative for Ω and positions."""
    columns, said = seen.columns, seen.said
    forms = [form for form in ("quaternion", "matrix", "euler") if form in columns]
    rows = {form: said.rotation(form, columns[form]) for form in forms}
    found: dict[tuple[str, str], Array] = {}
    for other in forms[1:]:
        found[forms[0], other] = numpy.abs(rows[forms[0]] - rows[other]).max(axis=(1, 2))
    if not forms:
        return found
    first = rows[forms[0]]
    if "gamma" in columns:
        found[forms[0], "gamma"] = numpy.abs(first[:, 2] - columns["gamma"]).max(axis=1)
    if "position" in columns:
        size = float(numpy.linalg.norm(seen.point)) or 1.0
        given = said.vectors(columns["position"] - seen.pivot)
        found[forms[0], "position"] = numpy.abs(given - first @ seen.point).max(axis=1) / size
    if {"omega", "omega_space"} <= columns.keys():
        true = numpy.einsum("nij,nj->ni", first, columns["omega"])
        size = float(numpy.abs(true).max()) or 1.0
        found["omega", "omega_space"] = numpy.abs(said.vectors(columns["omega_space"]) - true).max(axis=1) / size
    return found
