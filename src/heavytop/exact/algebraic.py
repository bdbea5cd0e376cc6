"""Motions whose tops or starts are algebraic numbers: known as balls to any precision, and rational data near them.

Of Goryachev's, N. Kowalewski's and Chaplygin's motions no start with rational data is known, but for the moments of
inertia.  So such a motion is a curve with rational coefficients (:mod:`heavytop.exact.one_gap`) and a rational place
on it; N, Ω and γ follow as square roots of rational numbers, |γ| = 1.

What a program integrates are rational data near them, :meth:`AlgebraicMotion.rounded`.  These are outside the class:
their own truth is the validated enclosure (:mod:`heavytop.exact.validated`), as for any top, up to its reach and no
farther.  :meth:`AlgebraicMotion.departure` encloses how far the two motions are apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import InputError
from heavytop.exact.azimuth import Azimuth, Bearing, WithBearing
from heavytop.exact.balls import ball, midpoint, to_bits, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.motion import kept
from heavytop.exact.one_gap import Curve, OneGapMotion, gaps, value
from heavytop.exact.scales import exponent
from heavytop.exact.validated import Validated
from heavytop.precision import decimal_text, round_to, shown
from heavytop.top.heavy_top import HeavyTop, State

_ROUNDED_BITS = 256


@dataclass(frozen=True, slots=True)
class AlgebraicMotion(WithBearing):
    """A motion on a curve with P r = (N, 0, 0), N > 0 and |γ| = 1.

    place: x at t = 0.  signs: of Ω2 and Ω3 there (of √Q and √R, where x is not Ω1); +1 or −1.
    Raises InputError where the curve has no real motion through the place.
    """

    curve: Curve
    place: Fraction
    signs: tuple[int, int]
    method: str
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        squares = self.curve.squares(self.place)
        if min(squares) < 0 or max(squares) == 0:
            allowed = " and ".join(f"[{low:.6g}, {high:.6g}]" for low, high in gaps(self.curve))
            raise InputError(
                f"No motion at {shown(self.place)}: Omega2^2 and Omega3^2 would be {_signs(squares)}.",
                f"Real motions have it in {allowed}." if allowed else "No such motion of this top is real.",
            )

    @property
    def inertia(self) -> tuple[Fraction, Fraction, Fraction]:
        """(A, B, C), exact."""
        return self.curve.inertia

    def moment(self, bits: int) -> list[arb]:
        """P r with at least so many bits."""
        square = self.curve.gamma_square()
        return to_bits(lambda _working: [ball(square).sqrt(), arb(0), arb(0)], bits)

    def start(self, bits: int) -> list[arb]:
        """The state at t = 0, from square roots alone."""

        def evaluate(_working: int) -> list[arb]:
            q, r = (
                sign * ball(square).sqrt()
                for sign, square in zip(self.signs, self.curve.squares(self.place), strict=True)
            )
            size = ball(self.curve.gamma_square()).sqrt()
            first = ball(self.place**self.curve.power)
            factor = ball(self.place ** (self.curve.power // 2))
            s, t, u = (ball(value(height, self.place)) / size for height in self.curve.heights)
            return [first, factor * q, factor * r, s, q * t, r * u]

        return to_bits(evaluate, bits)

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.Evaluated`."""
        motion, size = _motion(self).at(ball(time)), ball(self.curve.gamma_square()).sqrt()
        return [*motion[:3], *(component / size for component in motion[3:])]

    def bearing(self, time: Fraction) -> Bearing:
        """See :class:`heavytop.exact.azimuth.WithBearing`: of M, and of what M/x tends to in Chaplygin's at rest."""
        return _motion(self).bearing(_azimuth(self), ball(time))

    def rounded(self, bits: int = _ROUNDED_BITS) -> tuple[HeavyTop, State]:
        """A top of weight 1 and a start, exact, within 2^(3 − bits) of this one's, relative to sizes above 1; |γ| = 1.

        The inertia is this one's.  Their own motion is that of any top: see the head of this file.
        """
        (n, _, _), start = self.moment(bits + 8), self.start(bits + 8)
        values = [round_to(midpoint(x), bits) for x in start]
        top = HeavyTop(self.inertia, 1, (round_to(midpoint(n), bits), 0, 0))
        return top, State(values[:3], values[3:]).normalized(bits)

    def departure(self, top: HeavyTop, start: State, time: Fraction, bits: int) -> arb:
        """A ball that holds the largest difference of a component of the motion from that start to this one's.

        Raises OutOfReach where the enclosure of the other motion does not reach that time with so many bits.
        """
        other = Validated(top, start).state(time, bits)
        return _largest(self.state(time, bits), other, bits)


@kept
def _azimuth(motion: AlgebraicMotion) -> Azimuth:
    return _motion(motion).azimuth()


@kept
def _motion(motion: AlgebraicMotion) -> OneGapMotion:
    q, r = motion.curve.squares(motion.place)
    return OneGapMotion.of(motion.curve, motion.place, (motion.signs[0] * (q > 0), motion.signs[1] * (r > 0)))


@whole_evaluation
def _largest(one: list[arb], other: list[arb], bits: int) -> arb:
    with working_precision(bits + 64):
        found = arb(0)
        for a, b in zip(one, other, strict=True):
            found = found.max(abs(a - b))
        return found


def _signs(squares: tuple[Fraction, Fraction]) -> str:
    return " and ".join(decimal_text(square, 4) for square in squares)


def algebraic_motion(
    name: str, make: Callable[[], Curve], place: Fraction | None, signs: tuple[int, int]
) -> AlgebraicMotion:
    """The motion on the curve that ``make`` gives, through ``place``, or through the middle of its first gap.

    Raises InputError where the moments would not be positive, and where no motion is real.
    """
    try:
        curve = make()
    except ZeroDivisionError:
        curve = None
    if curve is None or min(curve.inertia) <= 0 or curve.gamma_square() <= 0:
        raise InputError(f"No top has {name} motion with these numbers.", "Its builder says which are possible.")
    if place is None:
        found = gaps(curve)
        if not found:
            raise InputError(f"{name} motion of this top is not real.", "Its builder says which are.")
        (low, high), *_ = found
        unit = Fraction(2) ** (exponent(Fraction(high) - Fraction(low)) - 4)
        place = round(Fraction(low + high) / (2 * unit)) * unit
    return AlgebraicMotion(curve, place, signs, f"algebraic: {name} motion, inversion of an Abel integral")
