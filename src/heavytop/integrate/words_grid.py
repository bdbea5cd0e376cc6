"""Many short motions of heavy tops at the same times, as arrays: double-double in lanes, no exact number per motion.

What :mod:`heavytop.integrate.words_lanes` does motion by motion, for usual ones: doubles of moderate size, forwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import permutations
from typing import Any

import numpy

from heavytop.integrate.pair_arrays import Numerators, Pairs
from heavytop.integrate.words_engines import DoubleDouble, compiled_lanes, floats, wanted_tolerance
from heavytop.integrate.words_lanes import first_low_order
from heavytop.precision import DOUBLE_DOUBLE
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.words.eight import Eight
from heavytop.words.fixed import TINY_BITS
from heavytop.words.lane_orders import terms
from heavytop.words.vector import LANES

_RISE = 2
_ROUNDS = 4096
_LARGE = 2.0**60
_RESTING = 2.0 ** (-2 * TINY_BITS)
_UNITS = numpy.eye(6).tolist()


def double_double_states(
    parameters: Any, starts: Any, times: Sequence[Fraction], tolerance: Fraction, step_limit: int
) -> tuple[Pairs, Any]:
    """States (motions, samples, 6) of heavy tops, and which motions they are good for: the others need more care.

    parameters: doubles (motions, 6), I and n.  starts: (motions, 6).  times: doubles, increasing from above 0.
    """
    arithmetic = floats(wanted_tolerance(DOUBLE_DOUBLE, tolerance))
    assert arithmetic is not None
    compiled_lanes(HEAVY_TOP)
    with numpy.errstate(all="ignore"):
        run = _Grid(parameters, starts, numpy.array([float(time) for time in times]))
        pending, low_order = numpy.flatnonzero(run.usual), first_low_order(arithmetic)
        while len(pending) and low_order < arithmetic.in_lanes.order:
            pending = run.advance(pending, arithmetic, low_order, step_limit)
            low_order += _RISE
        return run.states(), run.good


class _Grid:
    """Problems in units in which their numbers are near 1, as in :mod:`heavytop.words.scaled`, and their states."""

    def __init__(self, parameters: Any, starts: Any, times: Any) -> None:
        constants = _constants(parameters)
        gamma = _power_above(numpy.abs(starts[:, 3:]).max(axis=1))
        torque = numpy.abs(constants[3:, 0]).max(axis=0) * 2.0**gamma
        speed = numpy.abs(starts[:, :3]).max(axis=1)
        turned, swung = _power_above(speed), -(-_power_above(torque) // 2)
        rate = numpy.where(torque == 0, turned, numpy.where(speed == 0, swung, numpy.maximum(turned, swung)))
        self.exponents = numpy.stack([rate] * 3 + [gamma] * 3, axis=1)
        self.begin = numpy.ldexp(starts, -self.exponents)
        constants[3:] = numpy.ldexp(constants[3:], gamma - 2 * rate)
        self.constants = constants
        self.times = numpy.ldexp(times[None, :], rate[:, None])
        self.order = numpy.argsort(numpy.maximum(speed, numpy.sqrt(torque)), kind="stable")
        self.usual = self._are_usual()
        self.good = numpy.zeros(len(starts), bool)
        self.found = numpy.full((len(starts), len(times), 12), numpy.nan)

    def _are_usual(self) -> Any:
        """Motions of which double-double keeps every component, that do not rest."""
        state, constants = numpy.abs(self.begin), numpy.abs(self.constants[:, 0].T)

        def above(values: Any, bits: int) -> Any:
            return ((values == 0) | (values > 2.0**-bits)).all(axis=1)

        clear = above(state, TINY_BITS // 2 - 1) & above(constants, TINY_BITS // 2 - 1)
        fine = above(state, TINY_BITS - 1) & ((state > 0).all(axis=1) | clear)
        turning = numpy.abs(numpy.cross(self.begin[:, 3:], self.begin[:, :3])).max(axis=1) > _RESTING
        bounded = (constants < _LARGE).all(axis=1) & (numpy.abs(self.exponents) < 300).all(axis=1)
        return fine & turning & bounded & numpy.isfinite(self.begin).all(axis=1)

    def advance(self, pending: Any, arithmetic: DoubleDouble, low_order: int, step_limit: int) -> Any:
        """All these motions, those of like rates side by side; gives those that need a larger n0."""
        place = numpy.empty(len(self.order), int)
        place[self.order] = numpy.arange(len(self.order))
        ordered = pending[numpy.argsort(place[pending])]
        eight = Eight(HEAVY_TOP, arithmetic.in_lanes, low_order)
        larger = []
        for first in range(0, len(ordered), LANES):
            eights = ordered[numpy.minimum(numpy.arange(first, first + LANES), len(ordered) - 1)]
            self._eight(eight, eights, step_limit)
            outgrown = [eight.status(lane) is None for lane in range(LANES)]
            larger += eights[outgrown].tolist()
            self.good[eights] = (eight.flags == 0) & (eight.left_all() > 0)
        return numpy.unique(numpy.array(larger, int))

    def _eight(self, eight: Eight, eights: Any, step_limit: int) -> None:
        words = numpy.zeros((12, LANES))
        words[:6] = self.begin[eights].T
        eight.put_all(words, self.constants[:, :, eights], step_limit)
        for sample, targets in enumerate(self.times[eights].T):
            eight.aim_all(targets)
            while eight.advance(_ROUNDS) == _ROUNDS:
                pass
            self.found[eights, sample] = eight.sample_all(targets).T

    def states(self) -> Pairs:
        """In the units of the problems; NaN where they are not good."""
        high, low = (numpy.ldexp(self.found[:, :, k : k + 6], self.exponents[:, None, :]) for k in (0, 6))
        total = high + low
        bad = ~self.good
        total[bad] = numpy.nan
        return Pairs(total, low - (total - high))


def _constants(parameters: Any) -> Any:
    """The coefficients of Ω × Ω and of the linear part, read off the field, three words each: (k, 3, motions)."""
    numbers = [Numerators(column, numpy.zeros(1)) for column in parameters.T]
    given = Parameters(tuple(numbers[:3]), tuple(numbers[3:6]), 0)

    def rate(component: int, *axes: int) -> Any:
        return HEAVY_TOP.field(given, [sum(_UNITS[axis][i] for axis in axes) for i in range(6)])[component]

    cyclic = [each for each in permutations(range(3)) if each in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    products = [rate(i, j, k) for i, j, k in cyclic]
    return numpy.array([*products, *(rate(component, source) for _, component, source in terms(HEAVY_TOP))])


def _power_above(values: Any) -> Any:
    """log2 of the least powers of two that are not less; 0 for 0."""
    part, exponent = numpy.frexp(values)
    return exponent - (part == 0.5)
