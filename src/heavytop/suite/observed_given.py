"""Trajectories with attitudes, positions or Ω in any axes, as they are scored: from a document or from arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy

from heavytop import written_numbers
from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.conventions import Convention, space_to_body
from heavytop.measure.observations import Posed
from heavytop.measure.supposed_readings import Reading, Seen, Start
from heavytop.precision import Precision
from heavytop.suite.given import Given, bits_of, component, named, require_states, rounded_state
from heavytop.suite.observed_body import AnyBody, body_data, in_principal_axes, rounded_body, system_of
from heavytop.suite.observed_start import (
    RawStart,
    body_omega,
    nearest_quaternion,
    of_quaternion,
    require_rows,
    rotation,
)
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import State, Vector, require_physical

_SPARE_BITS = 160
"""Bits of principal axes beyond those of the format."""


@dataclass(frozen=True, slots=True)
class Observed:
    """What a trajectory gives in place of Ω and γ in principal axes.

    columns: by the name of the quantity, the rounded numbers of each sample up to the first that is not finite.
    said: their conventions.  posed: the body and its start, rounded to the format and exact from there.
    body, start: the same as they were given, for suppositions.
    """

    columns: Mapping[str, list[tuple[Fraction, ...]]]
    said: Convention
    posed: Posed
    body: AnyBody
    start: RawStart

    @property
    def names(self) -> list[str]:
        """The quantities that are scored."""
        return list(self.columns)

    def sample(self, row: int) -> dict[str, tuple[Fraction, ...]]:
        """The numbers of one row."""
        return {name: rows[row] for name, rows in self.columns.items()}

    def seen(self, times: Sequence[Fraction]) -> Seen | None:
        """The samples in double; None where no double holds them."""
        try:
            columns = {name: numpy.array(rows, dtype=float) for name, rows in self.columns.items()}
            body, point = body_data(self.body), self.said.point
            pivot = numpy.array([float(v) for v in self.said.pivot])
            start = _start(self.start, self.posed)
        except OverflowError:
            return None
        if not all(numpy.isfinite(values).all() for values in columns.values()):
            return None
        of = body.centre if point is None else numpy.array([float(v) for v in point])
        count = min(map(len, columns.values()), default=0)
        said = Reading.of(self.said)
        if self.start.form == "euler" and self.start.degrees != said.degrees and "euler" not in columns:
            said = replace(said, degrees=self.start.degrees)
        return Seen(tuple(times[:count]), columns, body, start, said, of, pivot, count) if count else None


def _start(raw: RawStart, posed: Posed) -> Start:
    omega = numpy.array([float(value) for value in raw.omega])
    if raw.form != "gamma":
        return Start(raw.form, numpy.array([float(value) for value in raw.values]), omega, raw.in_space)
    assert posed.xi is not None
    rows = [_given(posed, v) for v in (posed.xi, _cross(posed.start.gamma, posed.xi), posed.start.gamma)]
    return Start("rows", numpy.array(rows, dtype=float).reshape(-1), omega, raw.in_space)


def _given(posed: Posed, principal_vector: Sequence[Fraction]) -> list[float]:
    return [float(sum(a * v for a, v in zip(row, principal_vector, strict=True))) for row in posed.axes]


def _cross(a: Sequence[Fraction], b: Sequence[Fraction]) -> list[Fraction]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def posed(
    body: AnyBody, raw: RawStart, said: Convention, precision: Precision, normalize: bool
) -> tuple[AnyBody, RawStart, Posed]:
    """Body and start rounded to the format, and both in principal axes."""
    body, start = rounded_body(body, precision), raw.rounded(precision)
    top, axes = in_principal_axes(body, precision.bits + _SPARE_BITS)
    rows = rotation(start, said, precision, normalize)
    omega = body_omega(start, said, rows)
    in_principal = [space_to_body(axes, v) for v in (omega, rows[2], rows[0])]
    w, gamma, xi = (_vector(v) for v in in_principal)
    return body, start, Posed(top, State(w, gamma), xi, axes, body.centre)


def _vector(values: Sequence[Fraction]) -> Vector:
    a, b, c = values
    return a, b, c


def observed(
    body: AnyBody,
    raw: RawStart,
    said: Convention,
    values: Mapping[str, Sequence[tuple[Fraction, ...] | None]],
    places: Sequence[str],
    precision: Precision,
    normalize: bool = False,
) -> tuple[Observed, list[tuple[Fraction, ...] | None]]:
    """What is scored, and for each row all of its numbers, None where one is not finite.

    normalize: take quaternions and matrices of any length for their rotations, at the start and in the rows.
    Raises InputError for quaternions and matrices that are none, with their place.
    """
    rounded = {name: [_rounded(row, precision) for row in rows] for name, rows in values.items()}
    for form in ("quaternion", "matrix"):
        if form in rounded:
            require_rows(form, rounded[form], places, normalize)
    count = max(map(len, rounded.values()))
    rows = [_joined([part[i] for part in rounded.values()]) for i in range(count)]
    done = next((i for i, row in enumerate(rows) if row is None), count)
    columns = {name: [row for row in part[:done] if row is not None] for name, part in rounded.items()}
    if normalize:
        columns = {name: _normalized(name, part, said) for name, part in columns.items()}
    body, start, found = posed(body, raw, said, precision, normalize)
    return Observed(columns, said, found, body, start), rows


def _normalized(name: str, rows: list[tuple[Fraction, ...]], said: Convention) -> list[tuple[Fraction, ...]]:
    """Quaternions of length 1 but for a rounding in 128 bits, and the rotations next to matrices."""
    if name == "quaternion":
        return [unit(row) for row in rows]
    if name != "matrix":
        return rows
    squares = [nearest_quaternion([row[0:3], row[3:6], row[6:9]]) for row in rows]
    return [tuple(entry for row in of_quaternion(unit(each)) for entry in row) for each in squares]


def unit(values: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The vector over its length, to 128 bits."""
    largest = max(map(abs, values))
    scaled = [value / largest for value in values]
    square, scale = sum(value * value for value in scaled), 1 << 128
    length = Fraction(isqrt(int(square * scale * scale)), scale)
    return tuple(Fraction(round(value / length * scale), scale) for value in scaled)


def _rounded(row: tuple[Fraction, ...] | None, precision: Precision) -> tuple[Fraction, ...] | None:
    return None if row is None else rounded_state(list(row), precision)


def _joined(parts: Sequence[tuple[Fraction, ...] | None]) -> tuple[Fraction, ...] | None:
    found: list[Fraction] = []
    for part in parts:
        if part is None:
            return None
        found += part
    return tuple(found)


def of_observed_arrays(
    body: AnyBody,
    raw: RawStart,
    said: Convention,
    times: list[Fraction],
    arrays: Mapping[str, list[list[Any]]],
    precision: Precision | None,
    names: tuple[str, str],
    normalize: bool = False,
) -> Given:
    """A trajectory from memory: rows of numbers of each quantity, in any format or as text.

    precision: None for the narrowest format that holds every number as it is given.  names: of the row and the
    integrator.
    Raises InputError for what is no number, for counts that differ or are too large, and as :func:`observed`.
    """
    for rows in arrays.values():
        require_states(times, rows)
    numbers = [value for rows in arrays.values() for row in rows for value in row]
    form = precision or written_numbers.of_bits(max(bits_of(value) for value in numbers))
    values = {name: [_row(row, f"{name}[{i}]") for i, row in enumerate(rows)] for name, rows in arrays.items()}
    places = [f"row {i}" for i in range(len(times))]
    found, states = observed(body, raw, said, values, places, form, normalize)
    outcome = Outcome.NON_FINITE if None in states else Outcome.SUCCESS
    name, integrator = named(names[0], "name"), named(names[1], "integrator")
    top, start = found.posed.top, found.posed.start
    require_physical(top, start)
    return Given(
        name,
        integrator,
        top,
        start,
        system_of(body, HEAVY_TOP),
        form,
        times,
        states,
        outcome,
        0,
        {},
        "",
        observed=found,
    )


def _row(row: Sequence[Any], where: str) -> tuple[Fraction, ...] | None:
    try:
        found = [component(value) for value in row]
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", error.remedy) from None
    finite = tuple(value for value in found if value is not None)
    return finite if len(finite) == len(found) else None


def require_system(system: System) -> None:
    """Raises InputError for a system whose attitude is not scored."""
    if system not in (HEAVY_TOP, HEAVY_GYROSTAT):
        raise InputError(
            f"Attitudes and positions are not scored in the system {system.name}.", 'Use "heavy_top", or give Ω and γ.'
        )
