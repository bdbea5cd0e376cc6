"""What every exact motion offers."""

from __future__ import annotations

from fractions import Fraction
from typing import Protocol

from flint import arb, arb_series

from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State


class ExactSolution(Protocol):
    """A motion known at any time to any number of bits.

    method: the closed form or the enclosure behind it, for reports.
    """

    @property
    def method(self) -> str: ...

    @property
    def system(self) -> System: ...

    @property
    def top(self) -> HeavyTop: ...

    @property
    def start(self) -> State: ...

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """Six balls (Ω1, Ω2, Ω3, γ1, γ2, γ3) at ``time``.

        Each has at least ``bits`` correct bits, relative to a value above 1 and absolute below it.
        Raises OutOfReach where that cannot be proven.
        """
        ...

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """Six power series in ε, the motion at ``time`` + ε up to ε^(length − 1).

        Evaluated from the closed form (or the enclosure) itself, with t + ε in the place of t: substituted into the
        field they give the residual.  Bits as for :meth:`state`, for the coefficient of ε^0.
        """
        ...
