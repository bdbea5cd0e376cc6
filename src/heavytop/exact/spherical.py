"""The spherical top, I1 = I2 = I3 with its centre of mass anywhere: Lagrange's top about r.

Every axis of it is one of symmetry.  The direction of r is irrational in general, but the equalities that define the
class, the cubic of n·γ and both functions of the second kind are rational in the exact data
(:mod:`heavytop.exact.lagrange`): the class is tested exactly, and any motion is known at any time.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from heavytop.exact.conditions import SPHERICAL, TORQUE
from heavytop.exact.lagrange import Lagrange, across
from heavytop.exact.scales import exponent
from heavytop.top.heavy_top import Vector


@dataclass(frozen=True, slots=True)
class SphericalTop(Lagrange):
    """The motion of a spherical top from any start, its centre of mass anywhere but at the fixed point.

    Raises NotInClass unless I1 = I2 = I3 and P r ≠ 0.
    """

    method = "closed form: spherical top, Weierstrass functions of n·gamma"
    body = SPHERICAL, TORQUE

    @property
    def frame(self) -> tuple[Vector, Vector]:
        """(u, a): a = n in a unit in which it is of ordinary size, and a vector across it."""
        unit = Fraction(2) ** exponent(max(map(abs, self.top.moment)))
        first, second, third = (n / unit for n in self.top.moment)
        axis = first, second, third
        return across(axis), axis
