"""Goryachev-Chaplygin: I1 = I2 = 4 I3, c = 0, M·γ = 0, by inversion of Abel's integrals; Sretensky's gyrostat too.

Sretensky's gyrostat is that top with a rotor along axis 3, on M·γ = 0 with M = IΩ + k.  The centre of mass may lie
anywhere in the plane of the equal moments, and |γ| be anything but 0.  The separated variables
(:mod:`heavytop.exact.goryachev_chaplygin_abel`) move along a straight line in Abel's integrals, at a cost that does not
depend on the time; the attitude is beside them (:mod:`heavytop.exact.goryachev_chaplygin_attitude`).

Levels where f has a multiple root are found exactly.  Where it lies outside both gaps they are levels like any other.
Where one variable tends to it the motion is asymptotic (:mod:`heavytop.exact.asymptotic`), and one may rest on it
(:mod:`heavytop.exact.resting`).  Motions where both tend to it (G = 0; without a rotor:
:mod:`heavytop.exact.goryachev_chaplygin_rest`) or both rest are refused; so are motions so near to them that the
Fourier series do not resolve them, with the distance.
Source: Chaplygin, Trudy otd. fiz. nauk 12 (1904); L. N. Sretensky, Doklady Akad. Nauk SSSR 149 (1963) 292.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import LevelNotDone
from heavytop.exact.azimuth import Bearing, WithBearing
from heavytop.exact.balls import ball
from heavytop.exact.closed_form import ClosedForm
from heavytop.exact.conditions import AXIAL_ROTOR, GAMMA, LEVEL_MOMENTUM, plane_top
from heavytop.exact.flint_context import current_length, whole_evaluation
from heavytop.exact.gaps import distance_of_others
from heavytop.exact.goryachev_chaplygin_abel import Motion
from heavytop.exact.goryachev_chaplygin_attitude import GoryachevChaplyginAttitude
from heavytop.exact.goryachev_chaplygin_level import Level, Root, gap_ends, roots, separated_start
from heavytop.exact.motion import kept
from heavytop.exact.separated import REMEDY, decide, refuse
from heavytop.top.equations import HEAVY_GYROSTAT

_DISTANCE = 1e-5
"""cosh β − 1 (:mod:`heavytop.exact.gaps`) where the Fourier series take nearly 2^17 terms for 50 digits."""


@dataclass(frozen=True, slots=True)
class GoryachevChaplygin(WithBearing, ClosedForm):
    """A motion of the Goryachev-Chaplygin top with the small moment on axis 3.

    Raises NotInClass unless I1 = I2 = 4 I3, P c = 0, P r ≠ 0, M·γ = 0 and γ ≠ 0, and on the levels not done.
    """

    method = "closed form: Goryachev-Chaplygin, inversion of Abel's integrals"
    body = plane_top(4)
    starts = GAMMA, LEVEL_MOMENTUM

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        _require_done(Level.of(self.top, self.start))

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        return _motion(self).at(time, current_length())

    def bearing(self, time: Fraction) -> Bearing:
        """See :class:`heavytop.exact.azimuth.WithBearing`: not for asymptotic motions, nor to very many digits."""
        return _attitude(self).bearing(time)


@dataclass(frozen=True, slots=True)
class Sretensky(GoryachevChaplygin):
    """A motion of Sretensky's gyrostat with the small moment and the rotor on axis 3.

    Raises NotInClass unless I1 = I2 = 4 I3, P c = 0, P r ≠ 0, k1 = k2 = 0, M·γ = 0 with M = IΩ + k, and γ ≠ 0, and on
    the levels not done.
    """

    method = "closed form: Sretensky's gyrostat, inversion of Abel's integrals"
    system = HEAVY_GYROSTAT
    body = *GoryachevChaplygin.body, AXIAL_ROTOR


@kept
def _attitude(case: GoryachevChaplygin) -> GoryachevChaplyginAttitude:
    return GoryachevChaplyginAttitude.of(_motion(case))


@kept
def _motion(case: GoryachevChaplygin) -> Motion:
    return Motion.of(Level.of(case.top, case.start))


def _passes(curve: Sequence[Root], ends: tuple[int, int], place: Fraction) -> bool:
    low, high = (curve[number].value.real for number in ends)
    return not (low > ball(place) or high < ball(place))


@whole_evaluation
def _require_done(level: Level) -> None:
    """Raises NotInClass on the levels that are not done here, and too near to them."""
    resting = level.resting()
    if resting == 0:
        raise LevelNotDone("The level is degenerate: both separated variables rest, or one rests at 0.", REMEDY)

    def test() -> None:
        curve = roots(level)
        ends = gap_ends(level, curve, separated_start(level))
        # 0 is a root of both factors only, once of each, or more often for h = ±a
        if any(min(curve[number].counts) > 0 for pair in ends for number in pair):
            raise LevelNotDone(
                "The level is degenerate: G = 0, and both separated variables, or one, tend to 0.", REMEDY
            )
        moving = [(low, high) for low, high in ends if low != high]
        if resting is not None and all(_passes(curve, pair, resting) for pair in moving):
            raise LevelNotDone("The level is degenerate: one variable rests, and the other passes it.", REMEDY)
        apart = min((distance_of_others([root.value for root in curve], pair) for pair in moving), key=arb.mid)
        if not apart > _DISTANCE:
            refuse("The level is degenerate", apart, "a root to a gap")

    decide(test)
