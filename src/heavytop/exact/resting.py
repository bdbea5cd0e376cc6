"""One of two variables rests at a double root of the polynomial: what is left of Abel's integrals for the other.

Where v_o rests at a double root e the integrand v^j/√g of the other has a pole at e, and with G_j = ε F_j + (...) of
:mod:`heavytop.exact.abel` only the combination without it moves,

    H(θ) = F_1(θ) − e F_0(θ),   dH/dθ = (v − e)/√g,

which is of one sign: an integral of a lower genus.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb
from numpy.typing import NDArray

from heavytop.exact.abel import Variable


class Rest:
    """The variable at rest at ``place``; its phase is 0 for ever."""

    turn = 1.0
    periodic = False

    def __init__(self, place: arb) -> None:
        self.middle = place
        self.column = [arb(0), arb(0)]

    def position(self, phase: Any) -> Any:
        """See :class:`heavytop.exact.abel.Variable`."""
        return phase * 0 + self.middle

    def density(self, v: Any) -> Any:
        """1: no phase depends on it."""
        return v * 0 + 1

    def ends(self, phase: Any) -> tuple[Any, Any]:
        """√(v − e), at both ends, which are one."""
        return phase * 0, phase * 0

    def bend(self, phase: Any) -> Any:
        """See :class:`heavytop.exact.abel.Variable`."""
        return phase * 0

    def phase(self, v: arb, slope: arb) -> arb:
        """0."""
        return arb(0)

    def integrals(self, phase: arb) -> list[arb]:
        """See :class:`heavytop.exact.abel.Variable`."""
        return [arb(0), arb(0)]

    def estimates(self, phase: float) -> NDArray[np.float64]:
        """See :class:`heavytop.exact.abel.Variable`."""
        return np.zeros(2)


class Beside:
    """``variable`` with the one integral H for a variable at rest at ``place``, outside its gap."""

    def __init__(self, variable: Variable, place: arb) -> None:
        self.variable, self.place = variable, place
        self.turn, self.periodic, self.middle = variable.turn, variable.periodic, variable.middle
        self.position, self.ends = variable.position, variable.ends
        self.bend, self.phase = variable.bend, variable.phase

    def _combined(self, first: Any, second: Any) -> Any:
        return second - first * self.place

    @property
    def column(self) -> list[arb]:
        """See :class:`heavytop.exact.abel.Variable`."""
        return [self._combined(*self.variable.column)]

    def density(self, v: Any) -> Any:
        """dH by dphase, of either sign."""
        return (v - self.place) * self.variable.density(v)

    def integrals(self, phase: arb) -> list[arb]:
        """See :class:`heavytop.exact.abel.Variable`."""
        return [self._combined(*self.variable.integrals(phase))]

    def estimates(self, phase: float) -> NDArray[np.float64]:
        """See :class:`heavytop.exact.abel.Variable`."""
        first, second = self.variable.estimates(phase)
        return np.array([second - float(self.place) * first])
