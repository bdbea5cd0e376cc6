"""Bodies of trajectory files: rounded to a format, in principal axes, and in double.

A body whose principal axes are irrational is turned by a rational rotation next to them, exact to 160 bits more than
the format has: what is left of its tensor is that much below what the format can show.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy

from heavytop.measure.supposed_motion import BodyData
from heavytop.precision import Precision, round_to
from heavytop.top.bodies import CENTRE, Body
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, Vector, dot
from heavytop.top.principal import IDENTITY

AnyBody = HeavyTop | Body
Tensor = tuple[Vector, Vector, Vector]


def as_given(body: Body) -> Tensor:
    """The tensor about the point that it was given about, exactly."""
    if body.about != CENTRE:
        return body.tensor
    c, square = body.centre, dot(body.centre, body.centre)
    first, second, third = (
        _triple([body.tensor[i][j] - body.mass * ((square if i == j else 0) - c[i] * c[j]) for j in range(3)])
        for i in range(3)
    )
    return first, second, third


def _triple(values: Sequence[Fraction]) -> Vector:
    first, second, third = values
    return first, second, third


def rounded_body(body: AnyBody, precision: Precision) -> AnyBody:
    """The body with every number that was given rounded to the format."""

    def near(values: Sequence[Fraction]) -> Vector:
        return _triple([round_to(value, precision.bits) for value in values])

    rotor = None if body.rotor is None else near(body.rotor)
    if isinstance(body, HeavyTop):
        weight = round_to(body.weight, precision.bits)
        return HeavyTop(near(body.inertia), weight, near(body.centre), rotor=rotor)
    mass, gravity = (round_to(value, precision.bits) for value in (body.mass, body.gravity))
    return Body(mass, gravity, near(body.centre), [near(row) for row in as_given(body)], body.about, rotor)


def in_principal_axes(body: AnyBody, bits: int) -> tuple[HeavyTop, Tensor]:
    """The body in principal axes, and the rows of A, v_given = A v_principal; irrational axes to so many bits."""
    if isinstance(body, HeavyTop):
        return body, IDENTITY
    found = body.principal(bits)
    top = body.top_in(found)
    if found.exact:
        return top, found.axes
    # short numbers in place of long ones, which are not exact anyway
    centre = [round_to(value, bits) for value in top.centre]
    rotor = None if top.rotor is None else [round_to(value, bits) for value in top.rotor]
    return HeavyTop(top.inertia, top.weight, centre, rotor=rotor), found.axes


def system_of(body: AnyBody, named: System) -> System:
    """The system in which a body moves: that of a heavy top with a rotor where it has one."""
    return HEAVY_GYROSTAT if named is HEAVY_TOP and body.rotor is not None else named


def body_data(body: AnyBody) -> BodyData:
    """The body in double."""
    centre = numpy.array([float(value) for value in body.centre])
    rotor = numpy.array([float(value) for value in body.rotor or (0, 0, 0)])
    if isinstance(body, HeavyTop):
        inertia = numpy.diag([float(value) for value in body.inertia])
        return BodyData(inertia, centre, None, float(body.weight), False, rotor)
    inertia = numpy.array([[float(value) for value in row] for row in as_given(body)])
    return BodyData(inertia, centre, float(body.mass), float(body.gravity), body.about == CENTRE, rotor)
