"""Motions of a body in double, quickly and many times over, for suppositions about the conventions of a file.

Numbers are numpy arrays in the units of the file; a motion is computed in units in which its rates are about 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import floor, isfinite, log10

import numpy
from numpy.typing import NDArray

from heavytop.errors import HeavyTopError
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import DOUBLE
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

Array = NDArray[numpy.float64]
_STEPS = 50_000
"""Of heyoka, for one supposed motion."""
_LEAST = 1e-12
"""A principal moment below this part of the largest is not that of a body."""


@dataclass(frozen=True, slots=True)
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

    @property
    def steiner(self) -> Array:
        """What moving the tensor from the centre of mass to the fixed point adds to it."""
        c = self.centre
        found: Array = (self.mass or 0.0) * (float(c @ c) * numpy.eye(3) - numpy.outer(c, c))
        return found

    @property
    def tensor(self) -> Array:
        """About the fixed point."""
        return self.inertia + self.steiner if self.about_centre else self.inertia


@dataclass(frozen=True, slots=True)
class Beginning:
    """Where a motion begins: R in canonical axes of space, shape (3, 3), and Ω in body axes."""

    rotation: Array
    omega: Array


@dataclass(frozen=True, slots=True)
class Course:
    """A motion at some times: R in canonical axes of space, shape (n, 3, 3), and Ω in body axes, shape (n, 3)."""

    rotation: Array
    omega: Array

    @property
    def omega_space(self) -> Array:
        """R Ω."""
        found: Array = numpy.einsum("nij,nj->ni", self.rotation, self.omega)
        return found


def nearest_rotation(matrix: Array) -> Array:
    """The orthogonal matrix nearest to each of the last two axes; of determinant 1 where theirs is positive."""
    left, _, right = numpy.linalg.svd(matrix)
    found: Array = left @ right
    return found


def simulate(body: BodyData, start: Beginning, times: Sequence[Fraction]) -> Course | None:
    """The motion at ``times`` of one sign, in their order; None for what is no body, or cannot be computed."""
    tensor = body.tensor
    if not (numpy.isfinite(tensor).all() and numpy.isfinite(body.centre).all() and isfinite(body.force)):
        return None
    if not (numpy.isfinite(start.rotation).all() and numpy.isfinite(start.omega).all()):
        return None
    moments, axes = _principal((tensor + tensor.T) / 2)
    if not moments[0] > _LEAST * moments.max() or moments.min() <= 0:
        return None
    rows, omega, moment = start.rotation @ axes, axes.T @ start.omega, body.force * (axes.T @ body.centre)
    rate, size = _power(_rate(moments, moment, omega)), _power(float(moments.max()))
    try:
        whirl = None if body.rotor is None or not body.rotor.any() else axes.T @ body.rotor / (size * rate)
        top = HeavyTop(
            [Fraction(m / size) for m in moments],
            1,
            [Fraction(n / size / rate / rate) for n in moment],
            rotor=None if whirl is None else [Fraction(k) for k in whirl],
        )
        system = HEAVY_TOP if whirl is None else HEAVY_GYROSTAT
        state = State([Fraction(w / rate) for w in omega], [Fraction(g) for g in rows[2]])
        xi = (Fraction(rows[0, 0]), Fraction(rows[0, 1]), Fraction(rows[0, 2]))
        scaled = [time * Fraction(rate) for time in times]
        later = [t for t in scaled if t]
        run = propagate(top, state, later, DOUBLE, system=system, xi=xi, step_limit=_STEPS) if later else None
    except (HeavyTopError, OverflowError, ValueError):
        return None
    if run is not None and run.outcome is not Outcome.SUCCESS:
        return None
    first = [] if all(scaled) else [[*(omega / rate), *rows[2], *rows[0]]]
    values = numpy.array([*first, *(run.states if run is not None else [])], dtype=float)
    gamma, along = values[:, 3:6], values[:, 6:9]
    rotation = numpy.stack([along, numpy.cross(gamma, along), gamma], axis=1) @ axes.T
    return Course(rotation, values[:, :3] @ axes.T * rate)


def _principal(tensor: Array) -> tuple[Array, Array]:
    """Moments, and principal axes as the columns of a rotation: the axes given where the tensor is diagonal."""
    if not (tensor - numpy.diag(numpy.diag(tensor))).any():
        return numpy.diag(tensor), numpy.eye(3)
    moments, axes = numpy.linalg.eigh(tensor)
    if numpy.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return moments, axes


def _rate(moments: Array, moment: Array, omega: Array) -> float:
    fall = float(numpy.sqrt(numpy.linalg.norm(moment) / moments.max()))
    return max(float(numpy.linalg.norm(omega)), fall)


def _power(value: float) -> float:
    """The power of two next to a positive number; 1 for others."""
    return 2.0 ** floor(log10(value) / log10(2)) if value > 0 and isfinite(value) else 1.0


def turning(body: BodyData, start: Beginning) -> float:
    """Radians per time unit at which the motion turns, roughly."""
    moments = numpy.linalg.eigvalsh(body.tensor)
    return _rate(numpy.asarray(moments, dtype=numpy.float64), body.force * body.centre, start.omega) or 1.0


def with_tensor(body: BodyData, inertia: Array) -> BodyData:
    """The body with another tensor."""
    return replace(body, inertia=inertia)
