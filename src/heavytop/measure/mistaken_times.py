"""Times that mean something else: reversed, shifted, in another unit, or off by a row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy

from heavytop.measure.suspects import ALIKE, FARTHEST, FLOOR, Array, Suspect
from heavytop.precision import decimal_text

_GRID = 1500
_WITHIN = 0.3
"""A place of the grid is tried if the first state is so near to it, relative to the size of the motion."""
_TRIED = 12
_REFINED = 6
_SPAN = Fraction(1, 10)
"""The samples must spread over so much of their time: an integrator's own lag grows with time and is no shift."""
_NEAR_ONE = 0.05
"""A clock that is off by less may be an integrator's own lag, unless the factor is a short decimal."""
_SHORT = 3
_EXACTLY = 1e-9
_UNITS = {Fraction(n, d) for n, d in ((1000, 1), (60, 1), (3600, 1), (1, 1000), (1, 60), (1, 3600))}
_CIRCLE = (2 * numpy.pi, 1 / (2 * numpy.pi), numpy.pi / 180, 180 / numpy.pi)


@dataclass(frozen=True, slots=True)
class Clock:
    """What the times may be.

    kind: time_reversed, start_row_missing, rows_off_by_one, rows_reversed, times_shifted (by ``shift``: the state said
    to be at t is that of t + shift), or time_unit (the state said to be at t is that of factor·t).
    fitted: whether the number was fitted, and not one that units differ by.
    """

    kind: str
    shift: float = 0.0
    factor: float = 1.0
    fitted: bool = False


def clock(given: Suspect) -> tuple[Clock, float] | None:
    """The simplest of the suppositions about the times that are about as good as the best, and its error."""
    found = [(each, given.error(given.supposed(times))) for each, times in _without_numbers(given) if len(times)]
    if len(given.rows) >= 3:
        found += _fitted(given)
    best = min((error for _, error in found), default=0.0)
    return next((pair for pair in found if pair[1] <= ALIKE * max(best, FLOOR)), None)


def _without_numbers(given: Suspect) -> Iterator[tuple[Clock, list[Fraction]]]:
    every = given.all_times
    yield Clock("time_reversed"), [-time for time in given.times]
    if len(every) > 1:
        yield Clock("start_row_missing"), [every[row - 1] if row else Fraction(0) for row in given.rows]
        yield Clock("rows_reversed"), [every[-1 - row] for row in given.rows]
        later = [*every[1:], 2 * every[-1] - every[-2]]
        yield Clock("rows_off_by_one"), [later[row] for row in given.rows]
    for factor in sorted(_UNITS | {Fraction(value) for value in _CIRCLE}):
        if abs(float(factor * given.times[-1])) * given.rate <= FARTHEST:
            yield Clock("time_unit", factor=float(factor)), [factor * time for time in given.times]


def _fitted(given: Suspect) -> Iterator[tuple[Clock, float]]:
    """Shifts and units that bring the first states onto the motion, refined over all samples."""
    times = numpy.array([float(time) for time in given.times])
    if abs(times[-1] - times[0]) < _SPAN * abs(times[0]):
        return
    reach = min(1.5 * abs(times[-1]) + 6 / given.rate, FARTHEST / given.rate)
    grid = numpy.linspace(-reach, reach, _GRID)
    orbit = given.supposed([Fraction(value) for value in grid])
    if orbit is None:
        return
    sizes = numpy.array([max(orbit[:, :3].max(), -orbit[:, :3].min()) or 1.0] * 3 + [1.0] * 3)
    # a method's own lag explains the samples of an oscillation as well as any clock
    slower = list(_refined(given, "time_unit", 1.0, times, sizes))
    lag = min((error for found, error in slower if abs(found.factor - 1) < _NEAR_ONE), default=float("inf"))
    yield from (each for each in slower if abs(each[0].factor - 1) >= _NEAR_ONE or _is_short(each[0].factor))
    for kind in ("times_shifted", "time_unit"):
        # a shift is the same for every sample; a unit shows best at the earliest sample away from 0
        tried = []
        for place in _near(orbit / sizes, given.states[0] / sizes):
            number = grid[place] - times[0] if kind == "times_shifted" else grid[place] / times[0] if times[0] else 1.0
            supposed = numpy.interp(_moved(kind, number, times), grid, numpy.arange(_GRID))
            off = numpy.abs(orbit[numpy.rint(supposed).astype(int)] - given.states) / sizes
            tried.append((float(numpy.median(off.max(axis=1))), number))
        for _, number in sorted(tried)[: _TRIED // 3]:
            for found, error in _refined(given, kind, number, times, sizes):
                near_one = kind == "time_unit" and abs(found.factor - 1) < _NEAR_ONE
                if _is_short(found.factor) if near_one else ALIKE * error < lag:
                    yield found, error


def _is_short(factor: float) -> bool:
    """Whether the factor, or one over it, is a decimal of three digits, as no integrator's lag is; 1 is none."""
    near = [Fraction(decimal_text(Fraction(each), _SHORT)) for each in (factor, 1 / factor)]
    return any(
        one != 1 and abs(one / Fraction(each) - 1) < _EXACTLY
        for one, each in zip(near, (factor, 1 / factor), strict=True)
    )


def _near(orbit: Array, state: Array) -> list[int]:
    """Places of the grid where the orbit comes nearest to a state, the nearest first."""
    far = numpy.abs(orbit - state).max(axis=1)
    lower = (far <= numpy.roll(far, 1)) & (far <= numpy.roll(far, -1)) & (far < _WITHIN)
    places = numpy.flatnonzero(lower)
    return [int(place) for place in places[numpy.argsort(far[places])][:_TRIED]]


def _moved(kind: str, number: float, times: Array) -> Array:
    return times + number if kind == "times_shifted" else times * number


def _refined(given: Suspect, kind: str, number: float, times: Array, sizes: Array) -> Iterator[tuple[Clock, float]]:
    """Gauss-Newton on the one number; the rate of the motion is a difference quotient of the motion itself."""
    small = 1e-6 / given.rate
    for _ in range(_REFINED):
        at = _moved(kind, number, times)
        here = given.supposed([Fraction(value) for value in at])
        there = given.supposed([Fraction(value) for value in at + small])
        if here is None or there is None:
            return
        slope = (there - here) / small / sizes * (1.0 if kind == "times_shifted" else times[:, None])
        square = float((slope * slope).sum())
        if not square:
            return
        number += float((slope * (given.states - here) / sizes).sum()) / square
        if not abs(_moved(kind, number, times)).max() * given.rate <= FARTHEST:
            return
    error = given.error(given.supposed([Fraction(value) for value in _moved(kind, number, times)]))
    shift, factor = (number, 1.0) if kind == "times_shifted" else (0.0, number)
    yield Clock(kind, shift, factor, fitted=True), error
