"""The largest error that rounding explains in a row, from the row's own body, start and horizon.

The roundings of n steps walk at random, the body turns on meanwhile, and the motion amplifies what there is.  So in
units of the quantity an error is rounding noise up to

    100 · eps · √max(n, τ) · max(τ, A),    τ = 1 + rate · |horizon|,

which is 100 · eps · τ^1.5 on a regular motion followed with one step per unit of its own time, and more by the
amplification A (:mod:`heavytop.top.amplification`) beyond τ.  A is computed from the data of the row, only where the
rest does not suffice.  The drift of a first integral neither turns on nor is amplified: 100 · eps · √max(n, τ).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property

from heavytop.errors import InputError
from heavytop.precision import exact, log10
from heavytop.records import Quantity, Row
from heavytop.report.kind import Kind
from heavytop.report.policy import BITS
from heavytop.top.amplification import FOLLOWED, amplification, rate
from heavytop.top.equations import Parameters, System, system
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.integrals import holding, largest

MARGIN = 2.0
"""Decades above what the roundings of a run amount to on average."""
_FASTER = 0.5
"""A chaotic motion that double does not follow may be amplified faster by such a part than until there."""
_DRIFT = "drift"
Motion = tuple[System, Parameters, tuple[Fraction, ...]]
_RELATIONS = ("hess", "goryachev_chaplygin")
"""Conserved on one level set alone: the motion amplifies what leaves it."""


class RoundingBound:
    """How large rounding can make the errors of a row, each as log10.

    row: of the side of a comparison that is trusted.  Without body and start its rate counts as 1, and its
    amplification as what the row itself says.
    """

    def __init__(self, row: Row, kind: Kind) -> None:
        self.row = row
        self.kind = kind

    def explains(self, quantity: Quantity | None, size: float) -> bool:
        """Whether rounding makes an error of that quantity, or a difference of two, as large as 10^size."""
        found = MARGIN + (1 - self.row.bits) * BITS + math.log10(self._roundings) / 2 + self._unit(quantity)
        if quantity is not None and quantity.name == _DRIFT and quantity.component not in _RELATIONS:
            return size <= found
        found += math.log10(self._turns)
        if size <= found:
            return True
        amplified = min(self._amplified(self.row.horizon), math.log10(self.kind.largest_amplification))
        return size <= found + max(0.0, amplified - math.log10(self._turns))

    def explains_times(self, time: str, part: float) -> bool:
        """Whether rounding moves an escape at ``time`` by that part of it.

        An error that grows like the amplification A(t), about e^(rate t), comes to a threshold earlier by ln(100)/rate
        where it is 100 times as large; one is up to 100 times larger than usual, another as much smaller.
        """
        return part * self._amplified(time) <= 2 * MARGIN

    @cached_property
    def _given(self) -> tuple[HeavyTop, State] | None:
        data = self.row.data
        if data is None or not data.omega or not data.gamma:
            return None
        try:
            rotor = _exact(data.rotor) if data.rotor else None
            top = HeavyTop(_exact(data.inertia), exact(data.weight), _exact(data.centre), rotor)
            return top, State(_exact(data.omega), _exact(data.gamma))
        except InputError:
            return None

    @cached_property
    def _motion(self) -> Motion | None:
        if self._given is None:
            return None
        try:
            which = system(self.row.system)
            return which, which.parameters(*self._given), tuple(self._given[1].flat)
        except InputError:
            return None

    @cached_property
    def _rate(self) -> Fraction:
        return Fraction(1) if self._motion is None else rate(*self._motion)

    @cached_property
    def _turns(self) -> float:
        return 1 + float(min(self._rate * abs(exact(self.row.horizon)), Fraction(10**300)))

    @property
    def _roundings(self) -> float:
        return max(self._turns, float(self.row.steps))

    def _amplified(self, horizon: str) -> float:
        """log10 of A up to a time."""
        if self._motion is None:
            return math.log10(self.row.amplification or 1.0)
        found = math.log10(amplification(*self._motion, exact(horizon)))
        return found + _FASTER * max(0.0, found - math.log10(FOLLOWED))

    def _unit(self, quantity: Quantity | None) -> float:
        """log10 of the size of a quantity along the motion."""
        turning = max(math.log10(self._rate) if self._rate else 0.0, 0.0)
        if quantity is None or self._motion is None:
            return turning
        if quantity.name == _DRIFT:
            return self._integral(quantity.component)
        if quantity.component == "omega":
            return math.log10(self._rate) if self._rate else 0.0
        return 0.0 if quantity.component == "gamma" else turning

    def _integral(self, name: str) -> float:
        """log10 of the size of the terms of a first integral."""
        assert self._motion is not None
        assert self._given is not None
        which, p, _ = self._motion
        found = next((each for each in holding(*self._given, which) if each.name == name), None)
        size = Fraction(0) if found is None else largest(found, p, self._rate)
        return (log10(size) or 0.0) if size else 0.0


def _exact(texts: Sequence[str]) -> tuple[Fraction, ...]:
    return tuple(map(exact, texts))
