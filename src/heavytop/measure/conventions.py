"""How a trajectory file speaks of the attitude: order and direction of quaternions, Euler sequence, up, units.

Here R takes components in body axes to components in the axes of space of the file; canonical axes of space are those
whose third points up.  A file's are turned into them by a signed permutation of determinant 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, quoted
from heavytop.top.attitude import SEQUENCES, matrix_of_quaternion, rows_of_euler
from heavytop.top.heavy_top import Vector

Rows = Sequence[Sequence[Any]]
"""Three rows of three numbers over any ring."""

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
    """What the columns of a file mean.

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
                said = ", ".join(value for value in values if value)
                raise InputError(f"{name} = {quoted(getattr(self, name))} is not known.", f"Use one of {said}.")

    def rotation(self, form: str, values: Sequence[Any], lib: Any) -> list[list[Any]]:
        """R of the columns of ``form``, body to space of the file; of a quaternion of any length that of its direction.

        values: 4, 9 (row by row) or 3 numbers.  lib: functions of these numbers, with ``pi`` where angles are degrees.
        """
        if form == "quaternion":
            w, x, y, z = values if self.quaternion_order == "wxyz" else (values[3], *values[:3])
            found = matrix_of_quaternion((w, x, y, z))
            square = w * w + x * x + y * y + z * z
            return _directed([[entry / square for entry in row] for row in found], self.quaternion)
        if form == "matrix":
            return _directed([values[0:3], values[3:6], values[6:9]], self.matrix)
        angles = [value * lib.pi / 180 for value in values] if self.angles == "degrees" else values
        return [list(row) for row in rows_of_euler(self.sequence, angles, lib)]

    def upright(self, vector: Sequence[Any]) -> list[Any]:
        """A vector of the file's axes of space, or three rows of R, in canonical axes of space."""
        places, signs = UPS[self.up]
        return [_times(vector[place], sign) for place, sign in zip(places, signs, strict=True)]


def _directed(rows: Rows, direction: str) -> list[list[Any]]:
    if direction == "body_to_space":
        return [list(row) for row in rows]
    return [[rows[k][i] for k in range(3)] for i in range(3)]


def _times(value: Any, sign: int) -> Any:
    if sign > 0:
        return value
    return [-part for part in value] if isinstance(value, list | tuple) else -value


def body_to_space(rows: Rows, vector: Sequence[Any]) -> list[Any]:
    """R v over any ring."""
    return [row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2] for row in rows]


def space_to_body(rows: Rows, vector: Sequence[Any]) -> list[Any]:
    """R^T v over any ring."""
    return [rows[0][i] * vector[0] + rows[1][i] * vector[1] + rows[2][i] * vector[2] for i in range(3)]
