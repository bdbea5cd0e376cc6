"""The tables `[[sweep]]` of a plan: many tops under one name, each made on demand."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from math import prod
from random import Random as Generator
from typing import Any, Literal

import msgspec
import numpy

from heavytop.cases import Case, require_possible
from heavytop.display import Lazy
from heavytop.errors import InputError, prefixed
from heavytop.precision import exact, shown, vector
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, system, system_of
from heavytop.top.heavy_top import HeavyTop, State

_MOST = 1_000_000
_AXES = ("inertia", "weight", "centre", "omega", "gamma", "rotor")


class Strict(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """A table of a plan; unknown keys are errors.  ``cases`` raises InputError for an impossible value."""

    name: str


class SweepGrid(Strict, tag="grid"):
    """Every combination of the listed values; numbers as exact text.

    inertia, weight, centre, omega, gamma: one value, or a list of values.  A point is called NAME[i,j,...] by its
    indices in the lists, from 0, in this order; the last one changes fastest.
    """

    inertia: list[str | list[str]]
    weight: str | list[str]
    centre: list[str | list[str]]
    omega: list[str | list[str]]
    gamma: list[str | list[str]]
    rotor: list[str | list[str]] | None = None
    system: str | None = None

    def cases(self) -> Sequence[Case]:
        """The points; raises InputError where any of them is invalid."""
        if self.system is not None:
            system(self.system)
        axes = [self._axis(quantity) for quantity in _AXES]
        shape = [len(axis) for axis in axes]
        size = _bounded(self.name, prod(shape))
        for quantity, axis in zip(_AXES, axes, strict=True):
            if repeated := [value for value, count in Counter(axis).items() if count > 1]:
                raise InputError(f"The sweep {self.name} has {quantity} {_text(repeated[0])} twice.", "List each once.")
        if not any(isinstance(axis, list) for axis in axes):
            raise InputError(f"The sweep {self.name} varies nothing.", "Give a list of values, or use [[top]].")

        def label(index: int) -> str:
            position = zip(numpy.unravel_index(index, shape), axes, strict=True)
            return f"{self.name}[{','.join(str(i) for i, axis in position if isinstance(axis, list))}]"

        def point(index: int) -> Case:
            position = numpy.unravel_index(index, shape)
            inertia, weight, centre, omega, gamma, rotor = (axis[i] for axis, i in zip(axes, position, strict=True))
            top = HeavyTop(inertia, weight, centre, rotor)
            return Case(label(index), "from a grid", system_of(self.system, top), top, State(omega, gamma))

        # for the gyrostat valid values are not enough: the combinations are checked
        for index in _along_axes(shape) if self.system != GYROSTAT.name else range(size):
            with prefixed(f"The sweep's {label(index)}"):
                for warning in require_possible(point(index)).top.warnings():
                    raise InputError(warning, "Each moment is at most the sum of the other two.")
        return Lazy(size, point)

    @property
    def exact_data(self) -> str:
        """The number of values of each quantity, and a digest of all of them."""
        axes = [self._axis(quantity) for quantity in _AXES]
        digest = hashlib.sha256(str(axes).encode()).hexdigest()
        return f"grid of {' x '.join(str(len(axis)) for axis in axes)}, {digest[:16]}"

    def _axis(self, quantity: str) -> list[Any] | tuple[Any]:
        """The values of one quantity: a list where the plan lists them, a tuple of one for a single value."""
        values = getattr(self, quantity)
        if values is None:  # no rotor
            return (None,)
        with prefixed(f"The sweep {self.name}"):
            if quantity == "weight":
                return [exact(value) for value in values] if isinstance(values, list) else (exact(values),)
            if not values or all(isinstance(part, list) for part in values):
                return [vector(value, quantity) for value in values]
            if all(isinstance(part, str) for part in values):
                return (vector(values, quantity),)
        raise InputError(f"The sweep {self.name}: {quantity} mixes numbers and lists.", "Give numbers, or lists.")


class Random(Strict, tag="random"):
    """``count`` heavy tops and starts drawn at random: NAME[0], NAME[1], ..., the same for one seed on every machine.

    Moments of inertia that bodies can have: sums of two second moments, each from 1/2 to 5/2.  Weight from 1/2 to 5/2;
    centre and omega uniform in the cube from -1 to 1; gamma uniform on the sphere.
    family: the class of the tops.
    """

    seed: int
    count: int
    family: Literal["any", "euler", "lagrange", "kovalevskaya"] = "any"

    def cases(self) -> Sequence[Case]:
        """The tops; each depends on the seed and its own index alone."""
        return Lazy(_bounded(self.name, self.count), self._case)

    @property
    def exact_data(self) -> str:
        """The parameters on which the tops depend, in words."""
        return f"{self.count} random tops, {self.family}, seed {self.seed}"

    def integers(self, index: int) -> tuple[int, ...]:
        """The fourteen integers of a motion: thousandths of the three moments, of the weight, of centre and omega; the
        three numerators of gamma and their denominator.
        """
        # random() alone is guaranteed to be the same in all versions of Python
        draw = Generator(f"{self.seed}/{index}").random

        def thousandths() -> int:
            return 2 * int(1000 * draw()) - 999

        x, y, z, weight = (1500 + thousandths() for _ in range(4))
        a, b, c = (thousandths() for _ in range(3))
        omega = [thousandths() for _ in range(3)]
        if self.family == "euler":
            a, b, c = 0, 0, 0
        elif self.family == "lagrange":
            y, a, b = x, 0, 0
        elif self.family == "kovalevskaya":
            y, z, c = x, 3 * x, 0
        return (y + z, z + x, x + y, weight, a, b, c, *omega, *_direction(thousandths))

    def _case(self, index: int) -> Case:
        parts = self.integers(index)
        inertia, centre, omega = ([Fraction(i, 1000) for i in parts[first : first + 3]] for first in (0, 4, 7))
        top = HeavyTop(inertia, Fraction(parts[3], 1000), centre)
        gamma = [Fraction(i, parts[13]) for i in parts[10:13]]
        return Case(f"{self.name}[{index}]", "drawn at random", HEAVY_TOP, top, State(omega, gamma))


def _direction(draw: Callable[[], int]) -> tuple[int, int, int, int]:
    """A rational unit vector, uniform on the sphere: the last row of the rotation by a uniform quaternion; its three
    numerators and their denominator.
    """
    while True:
        p, q, r, s = (draw() for _ in range(4))
        norm = p * p + q * q + r * r + s * s
        if norm < 1_000_000:
            return 2 * (q * s - p * r), 2 * (r * s + p * q), p * p + s * s - q * q - r * r, norm


Sweep = SweepGrid | Random


def _text(value: Fraction | Sequence[Fraction]) -> str:
    return shown(value) if isinstance(value, Fraction) else ", ".join(map(shown, value))


def _bounded(name: str, size: int) -> int:
    if not 1 <= size <= _MOST:
        raise InputError(f"The sweep {name} must have 1 to {_MOST} tops; got {size}.", "Change its number of tops.")
    return size


def _along_axes(shape: Sequence[int]) -> Iterator[int]:
    """Indices of the points with at most one index other than 0."""
    for k, size in enumerate(shape):
        yield from range(0, size * prod(shape[k + 1 :]), prod(shape[k + 1 :]))
