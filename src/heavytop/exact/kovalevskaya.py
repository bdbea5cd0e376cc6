"""Kovalevskaya's top, I1 = I2 = 2 I3, c = 0: every start but those on three kinds of degenerate levels.

The centre of mass may lie anywhere in the plane of the equal moments, and |γ| be anything but 0.  The two separated
variables (:mod:`heavytop.exact.kovalevskaya_level`) move along a straight line in Abel's integrals, which are inverted
in balls (:mod:`heavytop.exact.kovalevskaya_abel`): the cost does not depend on the time.  Near levels where the curve
has a multiple root the Fourier series there grow like the root of the distance; where they need more than 2^14 terms,
theta functions of two variables take over (:mod:`heavytop.exact.kovalevskaya_theta`), down to a distance of two roots
of 2^-27 of the largest.  Nearer than that the motion is refused, with the distance, and left to the enclosure.

Levels where the quintic has a multiple root, found exactly (Appelrot, Trudy otd. fiz. nauk 16 (1911)):

    k = 0                            Delone's class, elliptic: :mod:`heavytop.exact.delone`
    double root outside both gaps    as any other level, at any distance from it
    double root at an end of a gap   asymptotic motions (:mod:`heavytop.exact.asymptotic`)
    a variable at rest on it         Appelrot's especially remarkable motions (:mod:`heavytop.exact.resting`);
                                     refused if the other variable passes it
    common end of both gaps          both variables tend to it: refused
    double root of the cubic         refused

Source: S. Kovalevskaya, Acta Math. 12 (1889) 177; recovery of Ω and γ without Kötter's formulas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import LevelNotDone, NotInClass, OutOfReach
from heavytop.exact.azimuth import Bearing, WithBearing
from heavytop.exact.balls import to_bits
from heavytop.exact.closed_form import ClosedForm
from heavytop.exact.conditions import GAMMA, NOT_XI, plane_top
from heavytop.exact.flint_context import current_length, whole_evaluation
from heavytop.exact.kovalevskaya_abel import AbelMotion
from heavytop.exact.kovalevskaya_attitude import KovalevskayaAttitude
from heavytop.exact.kovalevskaya_gaps import Interval, intervals, ordered, pole
from heavytop.exact.kovalevskaya_level import Level, Root, roots, start_of
from heavytop.exact.kovalevskaya_theta import ThetaMotion, separation
from heavytop.exact.motion import kept
from heavytop.exact.separated import REMEDY, decide, refuse
from heavytop.precision import shown

MOST_TERMS = 1 << 14
SEPARATION = 2.0**-27
"""Where two roots are nearer than this, over the largest, the periods are not integrated."""
_DISTANCE = 3e-4
"""cosh β − 1 of :func:`pole` where the Fourier series take :data:`MOST_TERMS` terms for 50 digits."""


@dataclass(frozen=True, slots=True)
class Kovalevskaya(WithBearing, ClosedForm):
    """A motion of Kovalevskaya's top with the small moment on axis 3.

    Raises NotInClass unless I1 = I2 = 2 I3, P c = 0, P r ≠ 0 and γ ≠ 0, and on and near the levels that are not done.
    """

    method = "closed form: Kovalevskaya, inversion of Abel's integrals"
    body = plane_top(2)
    starts = GAMMA, NOT_XI

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        _require_done(Level.of(self.top, self.start))

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        return _motion(self).at(time, current_length())

    def bearing(self, time: Fraction) -> Bearing:
        """See :class:`heavytop.exact.azimuth.WithBearing`: not where a variable rests, nor very near M·γ = 0."""
        return _attitude(self).bearing(time)

    def exponent(self, bits: int) -> arb:
        """The rate λ of an asymptotic motion, > 0: its distance from the motion that it tends to goes like e^(−λ|t|).

        Raises NotInClass for any other motion.
        """

        def evaluate(working: int) -> list[arb]:
            motion = _motion(self)
            found = motion.exponents() if isinstance(motion, AbelMotion) else []
            if not found:
                raise NotInClass("The motion is not asymptotic.", "Only asymptotic ones have an exponent.")
            return found

        return to_bits(evaluate, bits)[0]

    def second_state(self, time: Fraction, bits: int) -> list[arb]:
        """The state at ``time`` by theta functions, to hold against :meth:`state`, which mostly inverts integrals.

        Raises OutOfReach on a degenerate level, where there are no such functions, and where :meth:`state` uses them.
        """

        def evaluate(working: int) -> list[arb]:
            if isinstance(_motion(self), ThetaMotion) or not _has_thetas(Level.of(self.top, self.start)):
                raise OutOfReach("There is one closed form of this motion only.", "Certify it by the enclosure.")
            return _thetas(self).at(time, 1)

        return to_bits(evaluate, bits, time, 1)


@kept
def _motion(case: Kovalevskaya) -> AbelMotion | ThetaMotion:
    level = Level.of(case.top, case.start)
    try:
        return AbelMotion.of(level, MOST_TERMS)
    except OutOfReach:
        if not _has_thetas(level):
            return AbelMotion.of(level, 8 * MOST_TERMS)
    return ThetaMotion.of(level)


@kept
def _attitude(case: Kovalevskaya) -> KovalevskayaAttitude:
    motion = _motion(case)
    if isinstance(motion, ThetaMotion):
        motion = AbelMotion.of(motion.level, 8 * MOST_TERMS)
    return KovalevskayaAttitude.of(motion, 8 * MOST_TERMS)


@kept
def _thetas(case: Kovalevskaya) -> ThetaMotion:
    return ThetaMotion.of(Level.of(case.top, case.start))


def _has_thetas(level: Level) -> bool:
    """Whether the five roots are distinct, and far enough from each other at the working precision."""
    values = [root.value for root in roots(level)]
    return len(values) == 5 and separation(values) >= SEPARATION


@whole_evaluation
def _require_done(level: Level) -> None:
    """Raises NotInClass on the levels that are not done here."""
    cubic, double = level.cubic(), level.double()
    if cubic.gcd(cubic.derivative()).degree() > 0:
        raise LevelNotDone("The level is degenerate: the cubic (w + h)(w^2 + G) - C^2/2 has a double root.", REMEDY)
    name = "The level is degenerate"
    if double * double == level.fourth:
        if _both_rest(level, double):
            raise LevelNotDone(f"{name}, and both separated variables rest at e = {shown(double)}.", REMEDY)
        name = f"{name}: l^2 = 2 |gamma|^2 (h + e) with e = {shown(double)}, e^2 = k^2"

    def test() -> None:
        curve = roots(level)
        _require_apart(curve, intervals(level, curve, start_of(level)), name)

    decide(test)


def _both_rest(level: Level, double: Fraction) -> bool:
    """Whether w1 = w2 = e: a double root of the quadratic of both."""
    beside = level.separated(double + 1), level.separated(double - 1)
    return level.separated(double) == 0 and beside[0] == beside[1]


def _require_apart(curve: Sequence[Root], ends: Sequence[Interval], name: str) -> None:
    """Raises NotInClass where neither of the two forms evaluates the motion."""
    limits = [number for pair in ends if pair[0] != pair[1] for number in pair]
    if sum(curve[number - 1].multiplicity > 1 for number in limits if number) > 1:
        raise LevelNotDone(f"{name}, and both separated variables tend to e.", REMEDY)
    order = [0, *(number + 1 for number in ordered(curve))]
    for low, high in ends:
        resting = [one for one, other in ends if one == other and low != high]
        if resting and order.index(high) < order.index(resting[0]) < order.index(low):
            raise LevelNotDone(f"{name}, one separated variable rests at e, and the other passes it.", REMEDY)
    nearest = separation([root.value for root in curve])
    if not nearest >= SEPARATION and pole(curve, ends)[1] < _DISTANCE:
        refuse(name, nearest, "two roots over the largest")
