"""Attitude of Delone's motions: the azimuth of :mod:`heavytop.exact.kovalevskaya_attitude` where w2 = 0 for ever.

In its units, and with k = 0, one separated variable is 0 and the other, w ≤ 0, has w'² = −2 ((w + h)(w² + G) − C²/2).
The level vector v has v² = 4e (q² w − e q²) and the azimuth Λ' = (l/2) (1 + e/(w − e)), e = l²/2 − h.  As
2p, r and s/c, γ^3 are plane vectors of lengths √(2h) and 1 with the product l, e ≤ 0; e = 0 (they are parallel) is
refused: v = 0 there.  In V = 1/(w − μ), V = m + d cos θ in its gap, θ' = √g and

    t = ∫ dθ/√g,    Λ = (l/2) (t + e ∫ V/((1 − εV) √g) dθ),    ε = e − μ

φ(e) ≥ 0 keeps e out of the gap.  A double root of the cubic leaves no period: refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.abel import Inversion
from heavytop.exact.azimuth import Azimuth, Bearing
from heavytop.exact.balls import Undecided, ball
from heavytop.exact.flint_context import coefficient, series_length
from heavytop.exact.gaps import Gap, Roots
from heavytop.exact.kovalevskaya_attitude import along_gamma, level_vector
from heavytop.exact.kovalevskaya_gaps import Interval, ordered, pole
from heavytop.exact.kovalevskaya_level import Level, Root, Start, start_of

_REMEDY = "Ask for the state alone, or for the enclosure's attitude."
MOST_TERMS = 1 << 16


@dataclass(frozen=True, slots=True)
class DeloneAzimuth:
    """Λ beside a motion of Delone's at one working precision.

    gap: of V.  origin: t' = 0 in its integral.  integral: of Λ, but for (l/2) t'.  None where l = 0 and Λ rests.
    """

    level: Level
    gap: Gap
    origin: arb
    integral: Azimuth | None

    @classmethod
    def of(cls, level: Level) -> DeloneAzimuth:
        """At the working precision.

        Raises Undecided where it does not suffice, OutOfReach for e = 0, a double root of the cubic, and Fourier series
        of too many terms.
        """
        cubic, e = level.cubic(), level.double()
        if e == 0 or cubic.gcd(cubic.derivative()).degree() > 0:
            raise OutOfReach(f"Delone's level is degenerate: e = {e}, or a double root of its cubic.", _REMEDY)
        found: Any = cubic.complex_roots()
        curve = [Root(acb(value), 1, True) for value, _ in found]
        start = start_of(level)
        interval = _interval(curve, start)
        # beyond the cubic's roots, or between them and 0, where the other variable rests
        mu, _ = pole([*curve, Root(acb(0), 2, False)], [interval])
        gap, offset = _gap(curve, interval, mu), ball(e) - mu
        with series_length(2):
            place = start.inverses(mu)[0]
            value, slope = arb(coefficient(place, 0)), arb(coefficient(place, 1))
        phase = gap.phase(value, slope * gap.density(value))
        if level.area == 0:
            return cls(level, gap, gap.integrals(phase)[0], None)
        low, high = gap.middle - gap.reach, gap.middle + gap.reach
        beside = Gap(low, high, gap.rest.with_line(offset), count=2, most=MOST_TERMS)
        side = -1 if offset * gap.middle > 1 else 1
        weight = side * ball(e) * along_gamma(level) / 2
        return cls(level, gap, gap.integrals(phase)[0], Azimuth(beside, (arb(0), weight)))

    def bearing(self, time: Fraction, state: Sequence[arb]) -> Bearing:
        """v in the top's own axes, and Λ; state: Ω and γ at ``time``."""
        level, moment = self.level, ball(time * self.level.rate)
        state = _turned(level, state)
        azimuth = along_gamma(level) * moment / 2
        if self.integral is not None:
            (phase,), (turns,) = Inversion((self.gap,), (1,)).phases([self.origin + moment])
            if not phase.is_finite():
                raise Undecided
            azimuth += self.integral.at(phase, turns)
        return Bearing.of(level.in_body(state[3:]), level.in_body(level_vector(level, state)), azimuth)


def _turned(level: Level, state: Sequence[arb]) -> list[arb]:
    """Ω and γ in the level's units and turned frame."""
    (n1, n2), c = (ball(n) for n in level.moment), ball(level.moment_square).sqrt()
    found = []
    for unit, (x, y, z) in ((level.rate, state[:3]), (level.size, state[3:])):
        found += [part / ball(unit) for part in ((n1 * x + n2 * y) / c, (n1 * y - n2 * x) / c, z)]
    return found


def _interval(curve: list[Root], start: Start) -> Interval:
    """Where w moves, as in :func:`heavytop.exact.kovalevskaya_gaps.intervals`."""
    real = ordered(curve)
    allowed = [(real[0] + 1, 0)] + ([(real[2] + 1, real[1] + 1)] if len(real) == 3 else [])
    found = [
        (upper, lower)
        for upper, lower in allowed
        if not start.above(0, curve[upper - 1].value.real) > 0
        and not (lower > 0 and start.above(0, curve[lower - 1].value.real) < 0)
    ]
    if len(found) != 1:
        raise Undecided
    return found[0]


def _gap(curve: list[Root], interval: Interval, mu: arb) -> Gap:
    """The gap of V with the integral of the time."""
    branch, lead = [acb(0)], arb(2)
    for root in curve:
        found = 1 / (root.value - mu)
        branch.append(acb(found.real) if root.value.imag.is_zero() else found)
        lead *= abs(mu - root.value)
    low, high = (branch[number].real for number in interval)
    others = [(b, 1) for number, b in enumerate(branch) if number not in interval]
    return Gap(low, high, Roots.of(lead, others), count=1, most=MOST_TERMS)
