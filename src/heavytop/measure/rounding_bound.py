"""The largest error that rounding explains in a row, from the row's own body, start and horizon.

The roundings of n steps add up like a random walk, while the body rotates and the motion amplifies the error.  So in
units of the quantity an error may be rounding noise up to

    100 · eps · √max(n, τ) · max(τ, A),    τ = 1 + rate · |horizon|,

which is 100 · eps · τ^1.5 on a regular motion with one step per unit of its own time, and more by the amplification A
(:mod:`heavytop.top.amplification`) beyond τ.  A is computed from the data of the row, only where the other factors do
not suffice.  The drift of a first integral neither rotates nor is amplified: 100 · eps · √max(n, τ).
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property

from heavytop.errors import InputError
from heavytop.measure.scorer import DRIFT
from heavytop.precision import exact, log10
from heavytop.records import Quantity, Row
from heavytop.top.amplification import FOLLOWED, amplification, rate
from heavytop.top.equations import Parameters, System, holding, largest, system
from heavytop.top.heavy_top import HeavyTop, State

MARGIN = 2.0
"""Decades above the mean size of the accumulated roundings of a run."""
_EXCESS_RATE = 0.5
"""Fraction by which the rate of amplification of a chaotic motion may exceed its mean beyond the reach of double."""
_RELATIONS = ("hess", "goryachev_chaplygin")
"""Conserved on one level set alone: the motion amplifies deviations from it."""


class RoundingBound:
    """Bounds of the rounding errors of a row, as log10.

    row: of the trusted side of a comparison, the baseline.  Without body and start its rate counts as 1, and its
    amplification is the one stated in the row.  largest_amplification: within the times at which its errors count.
    """

    def __init__(self, row: Row, largest_amplification: float) -> None:
        self._row = row
        self._largest_amplification = math.log10(largest_amplification)

    def explains(self, quantity: Quantity | None, size: float) -> bool:
        """Whether rounding explains an error of that quantity, or a difference of two, of size 10^size."""
        roundings = max(self._tau, float(self._row.steps))
        bound = MARGIN + (1 - self._row.bits) * math.log10(2) + math.log10(roundings) / 2 + self._unit(quantity)
        if quantity is not None and quantity.name == DRIFT and quantity.component not in _RELATIONS:
            return size <= bound
        bound += math.log10(self._tau)
        if size <= bound:
            return True
        amplified = min(self._amplified(self._row.horizon), self._largest_amplification)
        return size <= bound + max(0.0, amplified - math.log10(self._tau))

    def explains_times(self, time: str, part: float) -> bool:
        """Whether rounding explains that an escape at ``time`` comes earlier by that fraction of it.

        An error that grows like the amplification A(t), about e^(rate t), reaches a threshold earlier by ln(100)/rate
        where it is 100 times as large; one may be 100 times larger than the mean, another 100 times smaller.
        """
        return part * self._amplified(time) <= 2 * MARGIN

    @cached_property
    def _motion(self) -> tuple[HeavyTop, State, System, Parameters] | None:
        data = self._row.data
        if data is None or not data.omega or not data.gamma:
            return None
        try:
            inertia, centre, rotor, omega, gamma = (
                tuple(map(exact, part)) for part in (data.inertia, data.centre, data.rotor, data.omega, data.gamma)
            )
            top, start = HeavyTop(inertia, exact(data.weight), centre, rotor or None), State(omega, gamma)
            which = system(self._row.system)
            return top, start, which, which.parameters(top, start)
        except InputError:
            return None

    @cached_property
    def _rate(self) -> Fraction:
        if self._motion is None:
            return Fraction(1)
        _, start, which, parameters = self._motion
        return rate(which, parameters, start.flat)

    @cached_property
    def _tau(self) -> float:
        return 1 + float(min(self._rate * abs(exact(self._row.horizon)), Fraction(10**300)))

    def _amplified(self, horizon: str) -> float:
        """log10 of A up to a time."""
        if self._motion is None:
            return math.log10(self._row.amplification or 1.0)
        _, start, which, parameters = self._motion
        decades = math.log10(amplification(which, parameters, tuple(start.flat), exact(horizon)))
        return decades + _EXCESS_RATE * max(0.0, decades - math.log10(FOLLOWED))

    def _unit(self, quantity: Quantity | None) -> float:
        """log10 of the size of a quantity along the motion."""
        turning = math.log10(self._rate) if self._rate else 0.0
        if self._motion is None or quantity is None:
            return max(turning, 0.0)
        if quantity.name == DRIFT:
            top, start, which, parameters = self._motion
            terms = (
                largest(i, parameters, self._rate) for i in holding(top, start, which) if i.name == quantity.component
            )
            return log10(next(terms, Fraction(0))) or 0.0
        return {"omega": turning, "gamma": 0.0}.get(quantity.component, max(turning, 0.0))
