"""A run that was computed in principal axes, in the axes in which its body was given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import DOUBLE, Precision, exact, number
from heavytop.top.attitude import rotated
from heavytop.top.bodies import Frame

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SPLIT = 134217729.0
"""2^27 + 1, by which Dekker splits a double."""


def framed(run: Trajectory, frame: Frame) -> Trajectory:
    """The run with its states, and ξ where it was computed, in the axes given; ``run`` is its ``principal``.

    Each number is rounded once, to the format of the run; where the axes are the principal ones in another order or of
    the other sign, none is.
    """
    states = in_frame(run.states, frame, run.problem.precision)
    attitude = None if run.attitude is None else in_frame(run.attitude, frame, run.problem.precision)
    return replace(run, states=states, attitude=attitude, frame=frame, principal=run)


def in_frame(values: NDArray[np.float64], frame: Frame, precision: Precision) -> Any:
    """Native numbers, shape (n, 3 m), m vectors each line, in the axes given."""
    import numpy

    if not len(values):
        return values
    found = numpy.array(values, copy=True)
    whole = [[entry.denominator == 1 for entry in row] for row in frame.axes]
    for place in range(0, found.shape[1], 3):
        part = values[:, place : place + 3]
        if all(map(all, whole)):
            turned = _permuted(part, frame)
        elif precision == DOUBLE:
            turned = _in_double(part.astype(float), frame)
        else:
            turned = numpy.array([_turned_exactly(line, frame, precision) for line in part], dtype=found.dtype)
        found[:, place : place + 3] = turned
    return found


def one_in_frame(state: Sequence[Any], frame: Frame, precision: Precision) -> Any:
    """One state of an observer, as :func:`in_frame`."""
    import numpy

    return in_frame(numpy.array([state]), frame, precision)[0]


def _permuted(part: NDArray[np.float64], frame: Frame) -> Any:
    """Each component of the axes given is one of the others, or its negative."""
    import numpy

    columns = []
    for row in frame.axes:
        axis = next(i for i in range(3) if row[i])
        columns.append(part[:, axis] if row[axis] > 0 else -part[:, axis])
    return numpy.stack(columns, axis=1)


def _turned_exactly(line: Sequence[Any], frame: Frame, precision: Precision) -> list[Any]:
    try:
        vector = [exact(value) for value in line]
    except InputError:  # the last state of a run that failed
        return list(line)
    return [number(value, precision) for value in rotated(frame.axes, vector)]


def _in_double(part: NDArray[np.float64], frame: Frame) -> NDArray[np.float64]:
    """A times each vector, A in two doubles, products without error and sums in two doubles: rounded once."""
    import numpy

    high = numpy.array([[float(entry) for entry in row] for row in frame.axes])
    low = numpy.array([[float(entry - Fraction(float(entry))) for entry in row] for row in frame.axes])
    found = numpy.empty_like(part)
    with numpy.errstate(invalid="ignore", over="ignore"):
        for i in range(3):
            total, rest = numpy.zeros(len(part)), numpy.zeros(len(part))
            for j in range(3):
                product, error = _product(part[:, j], high[i, j])
                before, total = total, total + product
                back = total - before
                rest += (before - (total - back)) + (product - back) + error + part[:, j] * low[i, j]
            found[:, i] = total + rest
    return found


def _product(a: NDArray[np.float64], b: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """a b and the rounding error of it, exactly (Dekker), where nothing under- or overflows."""
    product = a * b
    scaled, other = _SPLIT * a, _SPLIT * b
    a_high, b_high = scaled - (scaled - a), other - (other - b)
    a_low, b_low = a - a_high, b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
