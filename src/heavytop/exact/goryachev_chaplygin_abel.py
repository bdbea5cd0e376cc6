"""Goryachev and Chaplygin's top, and Sretensky's gyrostat, by real Abel inversion: the state from two phases.

With I = (4, 4, 1), a rotor k = (0, 0, λ), λ = 0 for the top, n = (c, 0, 0) (:mod:`heavytop.exact.reduced`), on M·γ = 0,
with s = p² + q², ρ = r + λ = M3 and a = c|γ|

    h = 2s + r²/2 + cγ1 − λ²/2,   G = (r − λ) s − c p γ3,   u1,2 = ½ (ρ ± √(ρ² + 16 s)),   u1 ≥ 0 ≥ u2
    X(u) = ½ (u³ − 2λ u² − 2h u − 4G)
    x_k = X(u_k) = c (2pγ3 − γ1 u_k),   y_k = u_k' (u_k − u_other) = c (2qγ3 − γ2 u_k),   x_k² + y_k² = a² u_k²
    f(u) = a² u² − X² = (au − X)(au + X),   y_k² = f(u_k),   Σ du/y = 0,   Σ u du/y = dt

f has rational coefficients.  u_k = m + d cos θ_k, f = (u − lo)(hi − u) g (:mod:`heavytop.exact.gaps`),

    θ1' = −√g1/(u1 − u2),   θ2' = −√g2/(u1 − u2),   G_0 constant,   G_1 → G_1 − t   (ε1 = 1, ε2 = −1)

With α_k = √|au_k − X(u_k)|, β_k = √|au_k + X(u_k)|, analytic in θ_k, y1 = α1 β1, y2 = −α2 β2, and one sign σ for the
whole motion

    r = u1 + u2 − λ    p = σ (α1β2 + α2β1)/(4a)           q = −σ (β1β2 − α1α2)/(4a)
    γ1 = −(X(u1) − X(u2))/(c (u1 − u2))     γ2 = −(α1β1 + α2β2)/(c (u1 − u2))     γ3 = −σ (α1β2 − α2β1)/(c (u1 − u2))

so that turning points are points like any other.  σ is found by exclusion at the start.
Source: Chaplygin, Trudy otd. fiz. nauk 12 (1904); L. N. Sretensky, Doklady Akad. Nauk SSSR 149 (1963) 292.
Signs, recovery and the place of λ derived here from the integrals (tests/exact/test_sretensky.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb, arb_series

from heavytop.exact.abel import Variable
from heavytop.exact.balls import Undecided, ball
from heavytop.exact.closed_form import constant, series_length
from heavytop.exact.gaps import MOST_TERMS, Roots
from heavytop.exact.goryachev_chaplygin_level import Level, Root, gap_ends, roots, separated_start, size_of
from heavytop.exact.resting import Rest
from heavytop.exact.separated import Line, variable_between

_MINUS, _PLUS = 0, 1
"""The factors au − X and au + X of f."""


@dataclass(frozen=True, slots=True)
class Motion:
    """The motion of a level at one working precision.

    moment, size: c and a.  ends: numbers of the roots at both ends of each gap.  sign: σ.
    """

    level: Level
    moment: arb
    size: arb
    curve: tuple[Root, ...]
    ends: tuple[tuple[int, int], ...]
    line: Line
    sign: int

    @classmethod
    def of(cls, level: Level) -> Motion:
        """At the working precision.

        Raises Undecided where it does not suffice, OutOfReach where the Fourier series need too many terms.
        """
        curve, places = roots(level), separated_start(level)
        ends = gap_ends(level, curve, places)
        gaps = tuple(_variable(curve, pair) for pair in ends)
        c, a = ball(level.moment_square).sqrt(), size_of(level)
        turned = level.turned()
        speeds = [c * (2 * turned[1] * turned[5] - turned[4] * u) for u in places]
        # du/dθ is −y1/√g1 and y2/√g2
        slopes = -speeds[0] * gaps[0].density(places[0]), speeds[1] * gaps[1].density(places[1])
        phases = [gap.phase(u, slope) for gap, u, slope in zip(gaps, places, slopes, strict=True)]
        line = Line.of(gaps, (1, -1), (0, -1), phases)
        with series_length(1):
            possible = []
            for sign in (1, -1):
                motion = cls(level, c, a, tuple(curve), tuple(ends), line, sign)
                found = motion.turned([arb_series([phase], prec=1) for phase in phases], [0, 0])
                if all(one[0].overlaps(other) for one, other in zip(found, turned, strict=True)):
                    possible.append(motion)
        if len(possible) != 1:
            raise Undecided
        return possible[0]

    def at(self, time: Fraction, length: int) -> list[Any]:
        """The six components at ``time``, numbers, or series in t of that length.

        Raises Undecided where the working precision does not prove the phases.
        """
        phases, turns = self.phases(time)
        with series_length(length):
            moving = self.line.series(phases, self._rates)
            return self.level.restored(self.turned(moving, turns), length)

    def phases(self, time: Fraction) -> tuple[list[arb], list[int]]:
        """The phases at ``time`` in the first turns, and whole turns; see :meth:`Line.phases`."""
        return self.line.phases(ball(time * self.level.rate))

    def _rates(self, u1: Any, u2: Any) -> list[Any]:
        """θ1' and θ2'."""
        return [
            u * 0 if isinstance(gap, Rest) else -1 / ((u1 - u2) * gap.density(u))
            for gap, u in zip(self.line.variables, (u1, u2), strict=True)
        ]

    def turned(self, phases: Sequence[Any], turns: Sequence[int]) -> list[Any]:
        """The six components in the turned frame."""
        (u1, a1, b1), (u2, a2, b2) = (self.halves(k, phases[k], turns[k]) for k in (0, 1))
        h, rotor, apart = ball(self.level.energy), ball(self.level.rotor), 1 / (self.moment * (u1 - u2))
        quarter = self.sign / (4 * self.size)
        # (X(u1) − X(u2))/(u1 − u2)
        slope = (u1 * u1 + u1 * u2 + u2 * u2) / 2 - rotor * (u1 + u2) - h
        return [
            quarter * (a1 * b2 + a2 * b1),
            quarter * (a1 * a2 - b1 * b2),
            u1 + u2 - rotor,
            -slope / self.moment,
            -(a1 * b1 + a2 * b2) * apart,
            -self.sign * (a1 * b2 - a2 * b1) * apart,
        ]

    def halves(self, variable: int, phase: Any, turns: int) -> tuple[Any, Any, Any]:
        """(u, α, β), at a phase of the first turn or a series there."""
        gap, (low, high) = self.line.variables[variable], self.ends[variable]
        u, side = gap.position(phase), -1 if turns % 2 else 1
        at_end = dict(zip((low, high), gap.ends(phase), strict=True))
        found = []
        for factor in (_MINUS, _PLUS):
            value, rest = phase * 0 + 1, phase * 0 + arb(1) / 2
            for number, root in enumerate(self.curve):
                if root.counts[factor] and number in at_end:
                    # no power: FLINT takes logarithms for that, of 0 at a turning point
                    value *= side * at_end[number] * (at_end[number] if root.counts[factor] > 1 else 1)
                elif root.counts[factor]:
                    rest *= _distance(u, root.value, root.counts[factor], gap.middle)
            found.append(value * rest.sqrt())
        # y_k = ±α_k β_k has the sign of −du/dθ
        return u, -found[0] if constant(gap.bend(phase)) < 0 else found[0], found[1]


def _distance(u: Any, root: acb, many: int, middle: arb) -> Any:
    """|u − root|^many for a real root, its square for a pair once; 1 for the other of the pair."""
    if root.imag.is_zero():
        return (u - root.real if root.real < middle else root.real - u) ** many
    if root.imag < 0:
        return 1
    return ((u - root.real) ** 2 + root.imag**2) ** many


def _variable(curve: Sequence[Root], ends: tuple[int, int]) -> Variable:
    """The gap between two simple roots, or the way from a simple one to a double one and back."""
    low, high = (curve[number].value.real for number in ends)
    if ends[0] == ends[1]:
        return Rest(low)
    rest = Roots.of(arb(1) / 4, [(root.value, root.multiplicity) for i, root in enumerate(curve) if i not in ends])
    double = curve[ends[0]].multiplicity > 1, curve[ends[1]].multiplicity > 1
    return variable_between(low, high, double, rest, MOST_TERMS)
