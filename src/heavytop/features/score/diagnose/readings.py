"""Readings of the columns of a file with attitudes, and their errors relative to a simulated motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from math import floor, isfinite, log10
from types import SimpleNamespace

import numpy

from heavytop.features.score.diagnose.samples import floats, motion_in_double, principal
from heavytop.features.score.diagnose.search import Array
from heavytop.measure.attitude_error import DIRECTIONS, FORMS, UPS, Convention
from heavytop.precision import cross
from heavytop.top.attitude import quaternion_products, rows_of
from heavytop.top.bodies import CENTRE, Body
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

# Motions of a body in double, for hypotheses about the conventions of a file.
#
# Numbers are numpy arrays in the units of the file; a motion is computed in units in which its rates are about 1.


_WIDEST = 1.0
"""Radians between neighbouring samples up to which the mean of Ω approximates the rate of the rotation."""
_LEAST = 1e-12
"""Smallest ratio of two principal moments of a body."""


@dataclass(frozen=True, eq=False)
class BodyData:
    """A body as a file describes it, in its own axes.

    inertia: the tensor, shape (3, 3), about the fixed point or, where ``about_centre``, about the centre of mass.
    centre: from the fixed point.  mass: None where a weight alone is known.  gravity: acceleration, or the weight where
    there is no mass.  rotor: its constant angular momentum, None for none.
    """

    inertia: Array
    centre: Array
    mass: float | None
    gravity: float
    about_centre: bool = False
    rotor: Array | None = None

    @property
    def force(self) -> float:
        """The weight."""
        return self.gravity * (1.0 if self.mass is None else self.mass)

    @cached_property
    def steiner(self) -> Array:
        """Steiner's term: the tensor about the fixed point less that about the centre of mass."""
        c = self.centre
        tensor: Array = (self.mass or 0.0) * (float(c @ c) * numpy.eye(3) - numpy.outer(c, c))
        return tensor

    @cached_property
    def tensor(self) -> Array:
        """The inertia tensor about the fixed point."""
        return self.inertia + self.steiner if self.about_centre else self.inertia

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal moments about the fixed point, and axes as the columns of a rotation."""
        return principal((self.tensor + self.tensor.T) / 2)


@dataclass(frozen=True, eq=False)
class InitialState:
    """Start of a motion: R in canonical axes of space, shape (3, 3), and Ω in body axes."""

    rotation: Array
    omega: Array


@dataclass(frozen=True, slots=True)
class SimulatedMotion:
    """A motion at some times: R in canonical axes of space, shape (n, 3, 3), and Ω in body axes, shape (n, 3)."""

    rotation: Array
    omega: Array

    @property
    def omega_space(self) -> Array:
        """R Ω."""
        vectors: Array = numpy.einsum("nij,nj->ni", self.rotation, self.omega)
        return vectors


def nearest_rotation(matrix: Array) -> Array:
    """The orthogonal matrix nearest to each of the last two axes; of determinant 1 where theirs is positive."""
    left, _, right = numpy.linalg.svd(matrix)
    rotation: Array = left @ right
    return rotation


@lru_cache(maxsize=512)
def simulate(body: BodyData, start: InitialState, times: tuple[float, ...]) -> SimulatedMotion | None:
    """The motion at ``times``; None for an invalid body, and where it cannot be computed."""
    tensor = body.tensor
    if not (numpy.isfinite(tensor).all() and numpy.isfinite(body.centre).all() and isfinite(body.force)):
        return None
    if not (numpy.isfinite(start.rotation).all() and numpy.isfinite(start.omega).all()):
        return None
    moments, axes = body.principal
    if not moments[0] > _LEAST * moments.max() or moments.min() <= 0:
        return None
    rows, omega, moment = start.rotation @ axes, axes.T @ start.omega, body.force * (axes.T @ body.centre)
    rate, size = _power(_rate(moments, moment, omega)), _power(float(moments.max()))
    whirl = numpy.zeros(0) if body.rotor is None or not body.rotor.any() else axes.T @ body.rotor / (size * rate)
    system = HEAVY_GYROSTAT if len(whirl) else HEAVY_TOP
    numbers = numpy.concatenate([moments / size, moment / size / rate / rate, whirl])
    first = numpy.concatenate([omega / rate, rows[2], rows[0]])
    values = motion_in_double(system, numbers, first, rate * numpy.array(times))
    if values is None:
        return None
    gamma, along = values[:, 3:6], values[:, 6:9]
    rotation = numpy.stack([along, numpy.array(cross([*gamma.T], [*along.T])).T, gamma], axis=1) @ axes.T
    return SimulatedMotion(rotation, values[:, :3] @ axes.T * rate)


def _rate(moments: Array, moment: Array, omega: Array) -> float:
    fall = float(numpy.sqrt(numpy.linalg.norm(moment) / moments.max()))
    return max(float(numpy.linalg.norm(omega)), fall)


def _power(value: float) -> float:
    """The power of two next to a positive number; 1 for others."""
    return 2.0 ** floor(log10(value) / log10(2)) if value > 0 and isfinite(value) else 1.0


def turning(body: BodyData, start: InitialState) -> float:
    """Radians per time unit at which the motion turns, roughly."""
    moments = numpy.linalg.eigvalsh(body.tensor)
    return _rate(numpy.asarray(moments, dtype=numpy.float64), body.force * body.centre, start.omega) or 1.0


_NUMPY = SimpleNamespace(sin=numpy.sin, cos=numpy.cos, pi=numpy.pi)
_EYE = tuple(map(tuple, numpy.eye(3).tolist()))
Square = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Reading(Convention):
    """A reading of the columns or of the start: a convention, and changes that no file can declare.

    extrinsic, negated: of Euler angles.  swapped: Ω declared in body axes is in space axes, and conversely.
    omega, gamma: factors of the columns of Ω and γ.  momentum: the columns of Ω are M.
    space, body: rotations Q, B so that the file's vectors are Q v and B v.  mirror: the axis, from 0, that is reversed;
    pseudo: whether Ω then transforms as an axial vector.
    scale: a factor of positions.  displaced: from the first position.  offset: added to every position, in canonical
    axes of space.  of_point: whose positions they are; None for the declared one.
    """

    extrinsic: bool = False
    negated: bool = False
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
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    of_point: tuple[float, ...] | None = None

    @classmethod
    def of(cls, stated: Convention) -> Reading:
        """The reading that a file declares."""
        return cls(stated.quaternion_order, stated.quaternion, stated.matrix, stated.sequence, stated.angles, stated.up)

    def rotations(self, form: str, values: Array) -> Array:
        """R in canonical axes of space from the columns of ``form``, shape (n, 3, 3)."""
        convention: Convention = self
        if form == "euler" and self.extrinsic:
            convention, values = replace(self, sequence=self.sequence[::-1]), values[:, ::-1]
        if form == "euler" and self.negated:
            values = -values
        rotations: Array = numpy.array(convention.rotation(form, [*values.T], _NUMPY)).transpose(2, 0, 1)
        if self.mirror is not None:
            signs = numpy.where(numpy.arange(3) == self.mirror, -1.0, 1.0)
            rotations = rotations * signs[:, None] * signs
        columns = numpy.array(self.body).T @ rotations.transpose(0, 2, 1) @ numpy.array(self.space)
        return upright(columns, self.up).transpose(0, 2, 1)

    def angular_velocity(self, name: str, values: Array) -> tuple[Array, bool]:
        """Ω of the columns of that name, shape (n, 3), and whether it is in axes of space."""
        in_space = (name == "omega_space") != self.swapped
        return (self.vectors if in_space else self.body_vectors)(values, True) / self.omega, in_space

    def vectors(self, values: Array, axial: bool = False) -> Array:
        """Vectors of space in canonical axes, shape (n, 3)."""
        return upright(self._reflected(values, axial) @ numpy.array(self.space), self.up)

    def body_vectors(self, values: Array, axial: bool = False) -> Array:
        """Vectors of the body in its declared axes, shape (n, 3)."""
        vectors: Array = self._reflected(values, axial) @ numpy.array(self.body)
        return vectors

    def _reflected(self, values: Array, axial: bool) -> Array:
        if self.mirror is None:
            return values
        signs = numpy.where(numpy.arange(3) == self.mirror, -1.0, 1.0)
        return values * (-signs if axial and self.pseudo else signs)


def upright(vectors: Array, up: str) -> Array:
    """Vectors of space along the last axis, in canonical axes."""
    places, signs = UPS[up]
    turned: Array = vectors[..., list(places)] * numpy.array(signs, dtype=float)
    return turned


@dataclass(frozen=True, eq=False)
class GivenStart:
    """The start as the file declares it.

    form: of ``values``: quaternion, matrix, euler; "rows", R in canonical axes of space; or "plain", R in those of the
    file, whatever its matrices are.  omega: in body axes, or those of space where ``in_space``.
    """

    form: str
    values: Array
    omega: Array
    in_space: bool = False

    def begin(self, reading: Reading, inertia: Array) -> InitialState:
        """The start of the motion in this reading."""
        begin = _as_read(self, reading)
        if not reading.momentum:
            return begin
        return InitialState(begin.rotation, numpy.linalg.solve(inertia, begin.omega).astype(float))

    def as_read(self, reading: Reading) -> InitialState:
        """R, and Ω in body axes, or M where its columns are the momentum."""
        if self.form == "rows":
            rotation = self.values.reshape(3, 3)
            if reading.gamma < 0:
                rotation = rotation * numpy.array([[1.0], [-1.0], [-1.0]])
        elif self.form == "plain":
            rotation = replace(reading, matrix=DIRECTIONS[0]).rotations("matrix", self.values[None, :])[0]
        else:
            rotation = reading.rotations(self.form, self.values[None, :])[0]
        scaled = self.omega[None, :] / reading.omega
        if self.in_space != reading.swapped:
            omega = rotation.T @ reading.vectors(scaled, True)[0]
        else:
            omega = reading.body_vectors(scaled, True)[0]
        return InitialState(rotation, omega)


_as_read = lru_cache(maxsize=256)(GivenStart.as_read)


@dataclass(frozen=True, slots=True)
class Observations:
    """Samples of a file.

    times: of one sign.  columns: by the name of the quantity, shape (n, width).  body, start, declared: of the file.
    point, pivot: of positions.
    """

    times: tuple[Fraction, ...]
    columns: Mapping[str, Array]
    body: BodyData
    start: GivenStart
    declared: Reading
    point: Array
    pivot: Array

    def at(self, rows: list[int]) -> Observations:
        """The file at some of its samples."""
        times = tuple(self.times[row] for row in rows)
        return replace(self, times=times, columns={k: v[rows] for k, v in self.columns.items()})


def residuals(samples: Observations, simulated: SimulatedMotion, reading: Reading, body: BodyData) -> Array:
    """Columns in this reading less the motion, relative to the size of each quantity, sample by sample."""
    parts = [_residual(samples, simulated, reading, body, name, values) for name, values in samples.columns.items()]
    return numpy.concatenate(parts, axis=1).reshape(-1)


def _residual(
    samples: Observations, simulated: SimulatedMotion, reading: Reading, body: BodyData, name: str, values: Array
) -> Array:
    size, true = 1.0, simulated.rotation
    if name == "position":
        point = samples.point if reading.of_point is None else numpy.array(reading.of_point)
        true = simulated.rotation @ point
        if reading.displaced:
            true = true - samples.start.begin(reading, numpy.eye(3)).rotation @ point
        size = float(numpy.linalg.norm(point)) or 1.0
        read = (reading.vectors(values - samples.pivot) - numpy.array(reading.offset)) / reading.scale
    elif name == "gamma":
        read, true = reading.body_vectors(values) / reading.gamma, simulated.rotation[:, 2]
    elif name in ("omega", "omega_space"):
        true = simulated.omega @ body.tensor if reading.momentum else simulated.omega
        read, in_space = reading.angular_velocity(name, values)
        if in_space:
            true = numpy.einsum("nij,nj->ni", simulated.rotation, true)
        size = float(numpy.linalg.norm(true, axis=1).max()) or 1.0
    else:
        read = reading.rotations(name, values)
    off: Array = ((read - true) / size).reshape(len(values), -1)
    return off


def rates_off(samples: Observations, reading: Reading) -> Array | None:
    """How far Ω is from the rate at which the attitude turns, between neighbouring samples and relative to Ω.

    No motion is computed.  None unless the file gives both; infinite where the body turns too far in between.
    """
    form = next((form for form in FORMS if form in samples.columns), None)
    name = next((name for name in ("omega", "omega_space") if name in samples.columns), None)
    if form is None or name is None or len(samples.times) < 2:
        return None
    rotation = reading.rotations(form, samples.columns[form])
    turn = rotation[:-1].transpose(0, 2, 1) @ rotation[1:]
    skew = numpy.stack([turn[:, k, j] - turn[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1) / 2
    cosine = (numpy.trace(turn, axis1=1, axis2=2) - 1) / 2
    angle = numpy.arctan2(numpy.linalg.norm(skew, axis=1), cosine)
    spans = numpy.diff(numpy.array([float(time) for time in samples.times]))
    rate = skew * (angle / numpy.maximum(numpy.sin(angle), 1e-300) / spans)[:, None]
    omega, in_space = reading.angular_velocity(name, samples.columns[name])
    if in_space:
        omega = numpy.einsum("nji,nj->ni", rotation, omega)
    size = max(float(numpy.linalg.norm(rate, axis=1).max()), 1e-300)
    off: Array = numpy.abs((omega[:-1] + omega[1:]) / 2 - rate).max(axis=1) / size
    return numpy.where(angle < _WIDEST, off, numpy.inf)


def disagreement(samples: Observations) -> dict[tuple[str, str], Array]:
    """Differences of columns of one quantity in each sample, by their names; relative for Ω."""
    columns, declared = samples.columns, samples.declared
    forms = [form for form in FORMS if form in columns]
    rows = {form: declared.rotations(form, columns[form]) for form in forms}
    errors: dict[tuple[str, str], Array] = {}
    for other in forms[1:]:
        errors[forms[0], other] = numpy.abs(rows[forms[0]] - rows[other]).max(axis=(1, 2))
    if not forms:
        return errors
    first = rows[forms[0]]
    if "gamma" in columns:
        errors[forms[0], "gamma"] = numpy.abs(first[:, 2] - columns["gamma"]).max(axis=1)
    if {"omega", "omega_space"} <= columns.keys():
        true = numpy.einsum("nij,nj->ni", first, columns["omega"])
        size = float(numpy.abs(true).max()) or 1.0
        errors["omega", "omega_space"] = numpy.abs(declared.vectors(columns["omega_space"]) - true).max(axis=1) / size
    return errors


def of_states(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    states: Sequence[Sequence[Fraction | None]],
    xi: Sequence[Fraction] | None = None,
) -> Observations | None:
    """A file in principal axes of Ω and γ, or with ξ of Ω and a quaternion; None where no double holds its numbers."""
    try:
        columns = numpy.array(states, dtype=float)
        omega, gamma, along = (floats(part or ()) for part in (start.omega, start.gamma, xi))
        body = body_data(top)
    except OverflowError:
        return None
    if not len(columns) or not numpy.isfinite(columns).all():
        return None
    if xi is None:
        along = numpy.cross(gamma, numpy.eye(3)[int(numpy.abs(gamma).argmin())])
    rows = numpy.array([along, numpy.cross(gamma, along), gamma])
    reading = GivenStart("rows", (rows / numpy.linalg.norm(rows, axis=1)[:, None]).reshape(-1), omega)
    split = {"omega": columns[:, :3], "gamma": columns[:, 3:6]}
    if xi is not None:
        up, first = ([*columns[:, part].T] for part in (slice(3, 6), slice(6, 9)))
        products: Array = numpy.array(quaternion_products(rows_of(up, first)))
        largest = numpy.einsum("iin->ni", products).argmax(axis=1)
        split = {"omega": columns[:, :3], "quaternion": products[largest, :, range(len(columns))]}
    return Observations(tuple(times), split, body, reading, Reading(), body.centre, numpy.zeros(3))


def body_data(body: HeavyTop | Body) -> BodyData:
    """The body in double; of a top with a mass about its centre of mass, as a program is given it."""
    rotor = None if body.rotor is None else floats(body.rotor)
    realised = body if isinstance(body, Body) else None if body.mass is None else Body.realising(body)
    if isinstance(body, HeavyTop) and realised is None:
        return BodyData(numpy.diag(floats(body.inertia)), floats(body.centre), None, float(body.weight), rotor=rotor)
    assert realised is not None
    about_centre = realised is not body or realised.about == CENTRE
    tensor = numpy.array([floats(row) for row in (realised.central if about_centre else realised.tensor)])
    mass, gravity = float(realised.mass), float(realised.gravity)
    return BodyData(tensor, floats(realised.centre), mass, gravity, about_centre, rotor)
