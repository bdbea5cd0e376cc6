"""States of other equations, in other axes or in another order of columns than can be read off a heavy top's.

These are asked after everything simpler.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy

from heavytop.measure.mistaken_states import constant_column
from heavytop.measure.suspects import Array, Suspect
from heavytop.top.equations import HEAVY_TOP, NAMES, Parameters, System, heavy_top
from heavytop.top.heavy_top import State, cross

Found = tuple[str, dict[str, str], float]
"""Kind, numbers, and the error that is left."""


def _turned_back(p: Parameters, y: Any) -> tuple[Any, ...]:
    """The heavy top with γ' = Ω × γ."""
    return (*heavy_top(p, y)[:3], *cross(y[:3], y[3:6]))


_TURNED_BACK = System("gamma_turned_back", _turned_back, HEAVY_TOP.angular_velocity)
_OMEGA_BACK = numpy.array([-1.0, -1, -1, 1, 1, 1])


def suppositions(given: Suspect, truth: Array | None) -> Iterator[Found]:
    """Each with the error that is left."""
    if truth is not None:
        yield _any_order(given, truth)
        yield from _axes_of_space(given, truth)
        yield from constant_column(given, truth)
    if given.system is HEAVY_TOP:
        yield from _signs(given)


def _signs(given: Suspect) -> Iterator[Found]:
    """A sign in the equations turned over.

    With −Ω in the place of Ω, M' = Ω × M + P γ × r is M' = M × Ω − P γ × r, and γ' = γ × Ω is γ' = Ω × γ.
    """
    top, start = given.top, given.start
    lifted, reversed_start = (
        replace(top, weight=-top.weight),
        State([-w for w in start.omega], start.gamma),
    )
    other = replace(given, system=_TURNED_BACK)
    yield "kinematic_sign", {}, given.error(other.supposed(given.times))
    for kind, system in (("gyroscopic_sign", _TURNED_BACK), ("both_signs", HEAVY_TOP)):
        found = replace(given, system=system).supposed(given.times, lifted, reversed_start)
        yield kind, {}, given.error(None if found is None else found * _OMEGA_BACK)


def _axes_of_space(given: Suspect, truth: Array) -> Iterator[Found]:
    """Ω, or Ω and γ, in axes fixed in space, one of which is vertical: |Ω| and the vertical part Ω·γ tell."""
    omega, gamma = given.states[:, :3], given.states[:, 3:]
    size = max(numpy.abs(truth[:, :3]).max(), 1e-3 * given.rate)
    length = numpy.abs(numpy.linalg.norm(omega, axis=1) - numpy.linalg.norm(truth[:, :3], axis=1)).max() / size
    vertical = (truth[:, :3] * truth[:, 3:]).sum(axis=1)
    for axis in range(3):
        up = numpy.eye(3)[axis]
        part = numpy.abs(omega[:, axis] - vertical).max() / size
        for what, expected in (("omega", truth[:, 3:]), ("both", up)):
            left = max(length, part, numpy.abs(gamma - expected).max())
            yield "axes_of_space", {"of": what, "vertical": str(axis + 1)}, float(left)


def _any_order(given: Suspect, truth: Array) -> Found:
    """Each column as that component, or its negative, that it is nearest to."""
    sizes = numpy.repeat([max(numpy.abs(truth[:, :3]).max(), 1e-3 * given.rate), numpy.abs(truth[:, 3:]).max()], 3)
    both = numpy.hstack([truth, -truth]) / numpy.tile(sizes, 2)
    off = numpy.array(
        [numpy.abs(column[:, None] / numpy.tile(sizes, 2) - both).max(axis=0) for column in given.states.T]
    )
    nearest = off.argmin(axis=1)
    if sorted(nearest % 6) != list(range(6)):
        return "column_order", {}, float("inf")
    names = ", ".join(("−" if place >= 6 else "") + NAMES[place % 6] for place in nearest)
    return "column_order", {"columns": names}, float(off.min(axis=1).max())
