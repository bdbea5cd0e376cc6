"""What is told of an attitude: quaternion, matrix, Euler angles, the position of a point, Ω in space axes.

Each is a function of a state (Ω, γ) and of ξ over any ring; the conventions are those of :mod:`heavytop.top.attitude`.
A point p of the body, in body axes, stands at pivot + R p in space: the fixed point is the origin unless a pivot is
given, and p is the centre of mass unless a point is given.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, quoted
from heavytop.precision import exact_text, physical
from heavytop.top.attitude import euler_of_rows, quaternion_of_rows, require_sequence, rotated, rows_of
from heavytop.top.heavy_top import Vector, vector

SHAPES: dict[str, tuple[int, ...]] = {
    "quaternion": (4,),
    "matrix": (3, 3),
    "euler": (3,),
    "position": (3,),
    "omega-space": (3,),
}
"""Of each output, the shape of its value at one time."""
_COLUMNS = {
    "quaternion": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"R{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
    "position": ("x", "y", "z"),
    "omega-space": ("omega_space_x", "omega_space_y", "omega_space_z"),
}
_ORIGIN = (Fraction(0), Fraction(0), Fraction(0))
_REMEDY = "Use quaternion, matrix, euler:ZXZ (or another sequence), position, omega-space."


def key_of(name: str) -> str:
    """The key of an output in a JSON document."""
    return name.replace("-", "_")


@dataclass(frozen=True, slots=True)
class Output:
    """One of :data:`SHAPES`; Euler angles with their sequence, a position with its point and pivot.

    point: in body axes, None for the centre of mass.  pivot: where the fixed point stands in space.
    """

    name: str
    sequence: str = ""
    point: Vector | None = None
    pivot: Vector = _ORIGIN

    @property
    def key(self) -> str:
        """In a JSON document."""
        return key_of(self.name)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the value at one time."""
        return SHAPES[self.name]

    @property
    def columns(self) -> tuple[str, ...]:
        """In a CSV file."""
        return _COLUMNS.get(self.name) or tuple(f"euler{place}" for place in (1, 2, 3))

    def at(
        self, omega: Any, gamma: Any, xi: Any, centre: Vector, lib: Any, number: Callable[[Fraction], Any]
    ) -> tuple[Any, ...]:
        """The value at one time, flat: a matrix row by row; a quaternion of either sign.

        omega, gamma, xi: three numbers of ``lib`` each, |γ| = |ξ| = 1.  centre: of mass, in the same axes.
        number: what makes an exact rational one of them.
        """
        rows = rows_of(gamma, xi)
        if self.name == "quaternion":
            return quaternion_of_rows(rows, lib)
        if self.name == "matrix":
            return tuple(entry for row in rows for entry in row)
        if self.name == "euler":
            return euler_of_rows(rows, self.sequence, lib)
        if self.name == "omega-space":
            return rotated(rows, omega)
        point = [number(value) for value in self.point_of(centre)]
        shift = [number(value) for value in self.pivot]
        return tuple(a + b for a, b in zip(shift, rotated(rows, point), strict=True))

    def point_of(self, centre: Vector) -> Vector:
        """The point whose position is told."""
        return centre if self.point is None else self.point


def output(text: str | Output, point: Any = None, pivot: Any = None) -> Output:
    """The output of that name, "euler:ZXZ" with its sequence; one that was read before, as it is.

    point, pivot: three exact numbers each, of a position alone.
    Raises InputError for an unknown name or sequence, and for a point or pivot of another output.
    """
    if isinstance(text, Output) and point is None and pivot is None:
        return text
    name, colon, sequence = (text if isinstance(text, str) else "").strip().partition(":")
    name = name.replace("_", "-").lower()
    if name not in SHAPES or (colon and name != "euler"):
        raise InputError(f"Unknown output {quoted(text)}.", _REMEDY)
    if name == "euler":
        if not sequence:
            raise InputError("Euler angles need their sequence.", "Give it as in euler:ZXZ.")
        sequence = require_sequence(sequence.strip())
    if name != "position" and (point is not None or pivot is not None):
        raise InputError(f"{name} has no point and no pivot.", "Ask for position, or leave them out.")
    found = None if point is None else _place(point, "point")
    return Output(name, sequence, found, _ORIGIN if pivot is None else _place(pivot, "pivot"))


def _place(value: Any, what: str) -> Vector:
    first, second, third = (physical(part, what) for part in vector(value, what))
    return first, second, third


def outputs(text: str, point: Any = None, pivot: Any = None) -> tuple[Output, ...]:
    """The outputs of a text such as "quaternion,euler:ZXZ,position", each once.

    Raises InputError as :func:`output`, for one that stands twice (two sequences of Euler angles included), and for a
    point or pivot where no position is asked for.
    """
    parts = [part for part in text.split(",") if part.strip()]
    names = [part.strip().partition(":")[0].replace("_", "-").lower() for part in parts]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"The output {quoted(name)} stands twice.", "Give each once; Euler angles of one sequence."
            )
    if "position" not in names and (point is not None or pivot is not None):
        raise InputError("A point or a pivot is given, but no position is asked for.", "Add position to the outputs.")
    if not parts:
        raise InputError(f"{quoted(text)} names no output.", _REMEDY)
    return tuple(
        output(part, *((point, pivot) if name == "position" else ())) for part, name in zip(parts, names, strict=True)
    )


def shaped(values: Sequence[Any], shape: tuple[int, ...]) -> list[Any]:
    """A flat list as nested lists of that shape."""
    if len(shape) == 1:
        return list(values)
    size = len(values) // shape[0]
    return [shaped(values[place : place + size], shape[1:]) for place in range(0, len(values), size)]


def first_sign(q: Sequence[Any], slack: Fraction = Fraction(0)) -> int:
    """±1, by which a quaternion (or a multiple of it) is multiplied at the start of a motion.

    So that w > 0, or the first of x, y, z that is not 0 is positive where w = 0; what is within ``slack`` of 0 counts
    as 0.  q: exact rationals.
    """
    return next((1 if value > 0 else -1 for value in q if abs(value) > slack), 1)


def signs(start: Sequence[float], quaternions: Any) -> Any:
    """±1 for each quaternion, an array: q goes on from ``start`` at t = 0 without a jump.

    Each is the nearer to the one before of q and −q; the motion meant is that of the samples: where the body turns by
    more than half a turn in between, the sign says nothing.
    quaternions: doubles, shape (n, 4), in the order in which the motion passes them.
    """
    import numpy

    chain = numpy.concatenate([[start], quaternions])
    return numpy.cumprod(numpy.where((chain[1:] * chain[:-1]).sum(axis=1) < 0, -1.0, 1.0))


def document_of(outputs: Sequence[Output], values: Callable[[Output], Any]) -> dict[str, Any]:
    """The keys of a JSON document for these outputs."""
    found: dict[str, Any] = {}
    for output in outputs:
        found[output.key] = values(output)
        if output.name == "euler":
            found["sequence"] = output.sequence
        if output.point is not None:
            found["point"] = [exact_text(value) for value in output.point]
        if any(output.pivot):
            found["pivot"] = [exact_text(value) for value in output.pivot]
    return found
