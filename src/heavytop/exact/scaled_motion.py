"""A motion in units in which it is of ordinary size, and the arithmetic that carries its Taylor coefficients."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any

from gmpy2 import mpq

from heavytop.errors import Contradiction
from heavytop.exact.quadratic import Quadratic, quadratic
from heavytop.exact.step_series import lacking
from heavytop.top.equations import Parameters, System
from heavytop.words import fixed
from heavytop.words.digits import grid_of
from heavytop.words.kernels import Grid
from heavytop.words.lanes import coefficients, rates
from heavytop.words.proven import Carrier
from heavytop.words.scaled import Scaled

_GRIDS = tuple(grid_of(words, whole=True) for words in (3, 4, 6, 7, 8, 10, 12, 16, 24))
"""Few of those that there are: each is compiled at its first use."""
_STEPS_A_WORD = 2
"""Fewer steps than that are not worth the machine code."""
_LARGEST_EXCESS = 8
_seen_right: set[tuple[Grid, str, int]] = set()


@dataclass(slots=True)
class ScaledMotion:
    """A motion from exact data in one direction of time.

    field: of the scaled state, backwards in time with its sign changed.  in_words: whether the lanes of
    :mod:`heavytop.words.lanes` compute this field, proven over the rationals, with coefficients of ordinary size; a
    state that stays is cheaper in integers.
    """

    scaled: Scaled
    field: Quadratic
    forwards: bool
    in_words: bool
    _carriers: dict[int, Carrier] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, system: System, p: Parameters, y: tuple[Fraction, ...], forwards: bool) -> ScaledMotion:
        """The motion of (Ω, γ), or of (Ω, γ, ξ), from ``y``."""
        return cls._in_units(Scaled.of(system, p, y, bounded=True), p, forwards)

    def with_parameters(self, p: Parameters) -> ScaledMotion:
        """Of the same state in the same units, another field's."""
        scaled = self.scaled
        given = coefficients(scaled.system, p, len(scaled.state) == 9)
        unit, gamma = scaled.rate, scaled.sizes[3]
        linear = given.with_linear(gamma / unit**2, 1 / unit)
        return self._in_units(dataclasses.replace(scaled, coefficients=linear), p, self.forwards)

    @classmethod
    def _in_units(cls, scaled: Scaled, p: Parameters, forwards: bool) -> ScaledMotion:
        system, size = scaled.system, len(scaled.state)
        own = own_parameters(scaled, p).mapped(mpq)
        sign = 1 if forwards else -1

        def given(state: tuple[Any, ...]) -> list[Any]:
            found = [*system.field(own, state[:6])]
            if len(state) == 9:
                found += system.attitude(own, state[:6], state[6:])
            return [sign * rate for rate in found]

        def by_lanes(state: tuple[Any, ...]) -> list[Any]:
            return [sign * rate for rate in rates(system, scaled.coefficients, state)]

        motion = quadratic(given, size)
        in_words = not scaled.rest and fixed.excess(scaled) <= _LARGEST_EXCESS
        if in_words:
            planned = quadratic(by_lanes, size)
            in_words = (planned.pairs, planned.rows) == (motion.pairs, motion.rows)
        return cls(scaled, motion, forwards, in_words)

    def precision(self, bits: float, steps: float) -> tuple[int, bool]:
        """The working precision at or above ``bits`` for so many steps, and whether it is that of words."""
        if self.in_words:
            for grid in _GRIDS:
                if grid.total >= bits:
                    if steps < _STEPS_A_WORD * grid.words:
                        break
                    return grid.total, True
        return _ladder(bits), False

    def carrier(self, precision: int) -> Carrier:
        """The Taylor coefficients in ``precision`` bits, one of those that words have."""
        if precision not in self._carriers:
            grid = next(grid for grid in _GRIDS if grid.total == precision)
            carrier = Carrier(self.scaled, grid, self.forwards)
            self._require_right(carrier)
            self._carriers[precision] = carrier
        return self._carriers[precision]

    def _require_right(self, carrier: Carrier) -> None:
        """The first step that machine code takes in this process is compared with exact integers."""
        grid, size = carrier.grid, len(self.scaled.state)
        key = (grid, self.scaled.system.name, size)
        if key in _seen_right:
            return
        centre = [round(value * 2**grid.total) for value in self.scaled.state]
        for halvings in range(2, 64):
            series = carrier.series(centre, halvings)
            if series is not None:
                if sum(lacking(self.field, series, grid.total, halvings)) > Fraction(series.rounding):
                    raise Contradiction(
                        f"Machine code in {grid.total} bits gives Taylor coefficients that are further from the truth "
                        "than they can be.",
                        "It is damaged: run again; if it stays, this machine or LLVM is faulty.",
                    )
                _seen_right.add(key)
                return


def own_parameters(scaled: Scaled, p: Parameters) -> Parameters:
    """``p`` in the units of a scaled motion."""
    unit, gamma = scaled.rate, scaled.sizes[3]
    return p.mapped(lambda value: Fraction(value) / unit)._replace(
        inertia=p.inertia, moment=tuple(gamma * n / unit**2 for n in p.moment)
    )


def _ladder(bits: float) -> int:
    """Multiples of an eighth of the power of two below."""
    whole = max(64, ceil(bits))
    unit = 1 << max(4, whole.bit_length() - 4)
    return -(-whole // unit) * unit
