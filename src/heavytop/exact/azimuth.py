"""Attitude beside a variable that swings in one gap: the azimuth of a vector about the vertical is one more integral.

Let h be the level part of a vector that the motion knows, and Λ its azimuth in space about γ.  Where Λ' = f(v) with a
rational f of the variable v, Λ is an Abel integral over its phase: a polynomial over √g times the denominator of f,
which counts as roots of multiplicity two (:mod:`heavytop.exact.gaps`).  It grows by a fixed angle with every turn.
The vector that is along h at t = 0 and fixed in space then stands at the angle Λ(0) − Λ from h (:class:`WithBearing`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import arb

from heavytop.exact.balls import to_bits
from heavytop.exact.closed_form import Evaluated
from heavytop.exact.gaps import Gap
from heavytop.exact.motion import kept
from heavytop.top.heavy_top import cross, dot


@dataclass(frozen=True, slots=True)
class Azimuth:
    """Λ = Σ weights_j F_j of a gap whose roots hold the denominator of Λ'."""

    gap: Gap
    weights: tuple[arb, ...]

    def at(self, phase: arb, turns: int) -> arb:
        """Λ at the phase, after so many whole turns."""
        parts = zip(self.weights, self.gap.integrals(phase), self.gap.column, strict=True)
        return sum((weight * (value + turns * period) for weight, value, period in parts), arb(0))


@dataclass(frozen=True, slots=True)
class Bearing:
    """h and γ × h, unit vectors in body components, and Λ at one time."""

    along: tuple[arb, ...]
    across: tuple[arb, ...]
    azimuth: arb

    @classmethod
    def of(cls, gamma: Sequence[arb], vector: Sequence[arb], azimuth: arb) -> Bearing:
        """From γ of any length and a vector whose level part is not 0."""
        square = dot(gamma, gamma)
        share = dot(vector, gamma) / square
        level = [v - share * g for v, g in zip(vector, gamma, strict=True)]
        length = dot(level, level).sqrt()
        along = [v / length for v in level]
        return cls(tuple(along), cross([g / square.sqrt() for g in gamma], along), azimuth)

    def carried(self, azimuth: arb) -> list[arb]:
        """The body components here of the unit vector fixed in space that h had when Λ was ``azimuth``."""
        sine, cosine = (self.azimuth - azimuth).sin_cos()
        return [cosine * a - sine * b for a, b in zip(self.along, self.across, strict=True)]


class WithBearing(Evaluated):
    """A motion that knows the bearing of one vector, and so the attitude.

    Mixed into the dataclass of each case, which brings ``made``.
    """

    __slots__ = ()

    @abstractmethod
    def bearing(self, time: Fraction) -> Bearing:
        """At FLINT's working precision.

        Raises Undecided where that does not suffice, OutOfReach where the azimuth is not known.
        """

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, a unit vector fixed in space and ⟂ γ, in body components; at t = 0 along the level part of
        that vector.

        Raises OutOfReach where it is not known.
        """

        def evaluate(working: int) -> list[arb]:
            return self.bearing(time).carried(_began(self))

        return to_bits(evaluate, bits, self.own_time(time))


@kept
def _began(case: WithBearing) -> arb:
    return case.bearing(Fraction(0)).azimuth
