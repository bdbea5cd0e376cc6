"""Lagrange's gyrostat: I1 = I2, n and k along axis 3: a Lagrange top seen from axes that turn about its axis.

M3 = I3 Ω3 + k3 is constant.  The top with the same moments and weight and the spin Ω3 + k3/I3 has the same M, so that
its axis and γ move in space as those of the gyrostat do, and its body turns ahead by the angle (k3/I3) t: with Rz the
rotation about axis 3,

    Ω = Rz(k3 t/I3) Ω* − (k3/I3) e3,   γ = Rz(k3 t/I3) γ*,   ξ = Rz(k3 t/I3) ξ*
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.balls import ball, to_bits
from heavytop.exact.closed_form import ClosedForm, instant
from heavytop.exact.conditions import AXIAL_ROTOR, SYMMETRIC
from heavytop.exact.flint_context import series_length
from heavytop.exact.lagrange import Lagrange
from heavytop.top.equations import HEAVY_GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State

_ATTITUDE_BITS = 8


@dataclass(frozen=True, slots=True)
class LagrangeGyrostat(ClosedForm):
    """The motion of Lagrange's gyrostat from any start, γ of any length.

    Raises NotInClass unless I1 = I2, P a = P b = 0 and k1 = k2 = 0.
    """

    method = "closed form: Lagrange's gyrostat, Weierstrass functions of gamma3"
    system = HEAVY_GYROSTAT
    body = *SYMMETRIC, AXIAL_ROTOR

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        self.made["top"] = self._top()

    def _top(self) -> Lagrange:
        first, second, third = self.start.omega
        plain = HeavyTop(self.top.inertia, self.top.weight, self.top.centre)
        return Lagrange(plain, State((first, second, third + self._ahead), self.start.gamma))

    @property
    def _ahead(self) -> Fraction:
        """k3/I3."""
        return Fraction(self.top.rotor[2] / self.top.inertia[2]) if self.top.rotor else Fraction(0)

    @property
    def lagrange(self) -> Lagrange:
        """The motion of the top."""
        found: Lagrange = self.made["top"]
        return found

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        turned = self._turned(self.lagrange.evaluate(time), instant(time))
        return [*turned[:2], turned[2] - ball(self._ahead), *turned[3:]]

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, a unit vector fixed in space and ⟂ γ, in body components."""

        def evaluate(working: int) -> list[arb]:
            known = self.lagrange.attitude(time, working + _ATTITUDE_BITS)
            with series_length(1):
                return self._turned(known, ball(time))

        return to_bits(evaluate, bits, time)

    def _turned(self, vectors: Sequence[Any], time: Any) -> list[Any]:
        """Rz(k3 t/I3) of each three components."""
        sine, cosine = (time * ball(self._ahead)).sin_cos()
        found: list[Any] = []
        for place in range(0, len(vectors), 3):
            x, y, z = vectors[place : place + 3]
            found += [cosine * x - sine * y, sine * x + cosine * y, z]
        return found
