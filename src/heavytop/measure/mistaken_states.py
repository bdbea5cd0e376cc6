"""Columns that mean something else than Ω and γ in body axes: axes renamed or reversed, γ down, M in place of Ω."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import permutations, product

import numpy

from heavytop.measure.suspects import ALIKE, FLOOR, Array, Suspect, named, notable
from heavytop.precision import decimal_text
from heavytop.top.equations import NAMES

_DEGREES = 180 / numpy.pi
_TURNS = 1 / (2 * numpy.pi)
_RPM = 60 * _TURNS
UNITS_OF_OMEGA = {"degrees": _DEGREES, "turns": _TURNS, "rpm": _RPM}
"""Of angular velocity, each as a multiple of radians per time unit; rpm where times are in seconds."""
_FEWEST = 3
"""Numbers of which one factor may be told."""
_PRESENT = 1e-6
"""A column of the true states counts as 0 below this part of its vector."""
_MEANINGS: dict[str, tuple[float, float, bool]] = {
    "": (1, 1, False),
    "gamma_down": (1, -1, False),
    "omega_reversed": (-1, 1, False),
    "both_reversed": (-1, -1, False),
    "momentum": (1, 1, True),
    "momentum_gamma_down": (1, -1, True),
    "omega_in_degrees": (_DEGREES, 1, False),
    "omega_in_turns": (_TURNS, 1, False),
    "omega_in_rpm": (_RPM, 1, False),
}
"""Factor of Ω, factor of γ, and whether M stands in place of Ω."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What the six columns may be.

    meaning: a key of the table above.  axes: column i of a vector holds ±(axis |axes[i]|), counted from 1.
    of: "both", "omega" or "gamma", the vectors whose axes these are.  swapped: γ stands before Ω.
    """

    meaning: str = ""
    axes: tuple[int, int, int] = (1, 2, 3)
    of: str = "both"
    swapped: bool = False

    @property
    def changes(self) -> int:
        """How many things are other than they should be."""
        moved = self.axes != (1, 2, 3)
        signs = sum(axis < 0 for axis in self.axes)
        return bool(self.meaning) + ("_gamma_down" in self.meaning) + self.swapped + moved + signs + (self.of != "both")

    def columns(self, states: Array, inertia: Array) -> Array:
        """The columns that a file with this reading has where the states are ``states``."""
        omega_factor, gamma_factor, momentum = _MEANINGS[self.meaning]
        order, signs = [abs(axis) - 1 for axis in self.axes], numpy.sign(self.axes)
        omega, gamma = states[:, :3] * omega_factor * (inertia if momentum else 1), states[:, 3:] * gamma_factor
        if self.of != "gamma":
            omega = omega[:, order] * signs
        if self.of != "omega":
            gamma = gamma[:, order] * signs
        return numpy.hstack([gamma, omega] if self.swapped else [omega, gamma])


def _readings() -> Iterator[Reading]:
    renamed = [(a, b, c) for a, b, c in permutations((1, 2, 3))]
    signed = [
        (a * s, b * t, c * u) for a, b, c in renamed for s, t, u in product((1, -1), repeat=3) if (s, t, u) != (-1,) * 3
    ]
    kinds = [("both", axes) for axes in signed]
    kinds += [(of, axes) for of in ("omega", "gamma") for axes in renamed[1:]]
    for meaning, swapped, (of, axes) in product(_MEANINGS, (False, True), kinds):
        yield Reading(meaning, axes, of, swapped)


READINGS = sorted((reading for reading in _readings() if reading.changes), key=lambda reading: reading.changes)
"""Every reading that is tried, the simplest first."""


def reading(given: Suspect, truth: Array) -> tuple[Reading, float] | None:
    """The simplest reading of the columns that fits about as well as the best, and its error."""
    inertia = numpy.array([float(value) for value in given.top.inertia])
    errors = [given.error(each.columns(truth, inertia)) for each in READINGS]
    best = min(errors)
    return next(
        ((each, error) for each, error in zip(READINGS, errors, strict=True) if error <= ALIKE * max(best, FLOOR)), None
    )


def scaled(given: Suspect, truth: Array) -> Iterator[tuple[str, dict[str, str], float]]:
    """Ω, γ or one column times a constant factor: kind, numbers, and the error of the states divided by the factor."""
    groups = [("omega_scaled", slice(0, 3)), ("gamma_scaled", slice(3, 6))]
    groups += [("column_scaled", slice(column, column + 1)) for column in range(6)]
    for kind, columns in groups:
        true, whole = truth[:, columns], truth[:, :3] if columns.start < 3 else truth[:, 3:]
        if true.size < _FEWEST or numpy.abs(true).max() <= _PRESENT * numpy.abs(whole).max():
            continue
        fitted = float((given.states[:, columns] * true).sum() / (true * true).sum())
        if not numpy.isfinite(fitted) or not fitted:
            continue
        left = _divided(given, truth, columns, fitted)
        factor = named(fitted, ALIKE * max(left, FLOOR) * abs(fitted))
        if factor and factor != -1 and notable(factor, Fraction(1)):
            numbers = {"column": NAMES[columns.start]} if kind == "column_scaled" else {}
            text = decimal_text(factor, 8)
            yield kind, {**numbers, "factor": text}, _divided(given, truth, columns, float(factor))


def _divided(given: Suspect, truth: Array, columns: slice, factor: float) -> float:
    states = given.states.copy()
    states[:, columns] /= factor
    return replace(given, states=states).error(truth)


def constant_column(given: Suspect, truth: Array) -> Iterator[tuple[str, dict[str, str], float]]:
    """A column that is the same in every state, and the error of the other five."""
    if len(given.rows) < _FEWEST:
        return
    for column in numpy.flatnonzero((given.all_states == given.all_states[0]).all(axis=0)):
        states = given.states.copy()
        states[:, column] = truth[:, column]
        value = Fraction(float(given.states[0, column])) / (given.units.time if column < 3 else 1)
        numbers = {"column": NAMES[column], "value": decimal_text(value, 6)}
        yield "column_constant", numbers, replace(given, states=states).error(truth)
