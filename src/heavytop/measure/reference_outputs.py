"""What a reference tells of the attitude, as balls: each to the digits asked, from a state of some more bits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.balls import FUNCTIONS, ball, midpoint, radius, value_text, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.measure.certify import bits_of
from heavytop.precision import exact, shown
from heavytop.top.attitude import euler_terms, rows_of
from heavytop.top.heavy_top import Vector, dot, vector
from heavytop.top.outputs import Output, first_sign, signs

Whole = Callable[[Fraction, int], Sequence[Any]]
"""Ω, γ and ξ at (time, bits): nine balls."""
GUARD_BITS = 32
"""Bits of a state beyond those asked for: no output loses so many but Euler angles near gimbal lock."""
_WORKING_BITS = 32
_ATTEMPTS = 5
_SMALL = Fraction(1, 10**290)
UNDEFINED = "nan", "inf"
"""Value and radius of an Euler angle at gimbal lock."""


class KnownMotion:
    """A known motion at the times of a reference, to be asked for outputs; it keeps the balls that were evaluated.

    whole: Ω, γ, ξ.  times: exact.  digits: of each output.  centre: of mass.  gamma: at t = 0.  method: for errors.
    as_written: the balls are those that were printed, and no others are to be had; outputs are as wide as they make
    them.
    """

    def __init__(
        self,
        whole: Whole,
        times: Sequence[Fraction],
        digits: int,
        centre: Vector,
        gamma: Vector,
        method: str,
        as_written: bool = False,
    ) -> None:
        self.whole, self.times, self.digits, self.method = whole, times, digits, method
        self.centre, self.gamma, self.as_written = centre, gamma, as_written
        self._unit = dot(gamma, gamma) == 1
        self._kept: dict[int, Sequence[arb]] = {}
        self._signs: list[int] | None = None

    def at(self, place: int, extra: int = GUARD_BITS) -> Sequence[arb]:
        """Ω, γ and ξ at the time of that place, of ``extra`` bits more than the digits take."""
        if extra != GUARD_BITS:
            return self.whole(self.times[place], bits_of(self.digits) + extra)
        if place not in self._kept:
            self._kept[place] = self.whole(self.times[place], bits_of(self.digits) + extra)
        return self._kept[place]

    def balls(self, output: Output) -> list[list[arb | None]]:
        """The output at every time, flat, each to the digits asked; None for an Euler angle that is not defined.

        A position is right to the digits relative to |p|, any other number relative to a size above 1.
        Raises OutOfReach where the digits cannot be proven.
        """
        narrow = self._narrow(output)
        found = [self._value(place, output, narrow) for place in range(len(self.times))]
        if output.name == "quaternion" and found:
            turns = self.signs(found)
            # a ball is negated exactly: the minus sign would round it to FLINT's precision of the moment
            return [
                [part.neg(exact=True) if part is not None and sign < 0 else part for part in q]
                for q, sign in zip(found, turns, strict=True)
            ]
        return found

    def signs(self, quaternions: Sequence[Sequence[Any]]) -> list[int]:
        """±1 for each quaternion, in the order of the times: continuous from t = 0 forwards and from it backwards."""
        if self._signs is None:
            import numpy

            start, found = self._start(), [1] * len(self.times)
            floats = numpy.array([[float(part) for part in q] for q in quaternions])
            for side in (1, -1):
                places = [p for p, time in enumerate(self.times) if (time >= 0) == (side > 0)]
                places.sort(key=lambda p: abs(self.times[p]))
                for place, sign in zip(places, signs(start, floats[places]) if places else (), strict=True):
                    found[place] = int(sign)
            self._signs = found
        return self._signs

    @whole_evaluation
    def _start(self) -> list[float]:
        bits = bits_of(self.digits) + GUARD_BITS
        q = [midpoint(part) for part in self._evaluated(self.whole(Fraction(0), bits), bits, Output("quaternion"))]
        sign = first_sign(q, Fraction(1, 1 << bits_of(self.digits)))
        return [sign * float(part) for part in q]

    def _value(self, place: int, output: Output, narrow: float) -> list[arb | None]:
        asked, extra = bits_of(self.digits), GUARD_BITS
        most = 2 * asked + 2 * GUARD_BITS if output.name == "euler" else math.inf
        whole = self.at(place)
        for _ in range(_ATTEMPTS):
            values = self._evaluated(whole, asked + extra, output)
            lacking = max(self._lacking(value, output, narrow) for value in values)
            if lacking <= 0:
                return list(values)
            if extra >= most or (output.name == "euler" and self._locked(whole, output)):
                break
            extra += int(lacking) + GUARD_BITS if lacking < math.inf else asked + GUARD_BITS
            try:
                whole = self.at(place, extra)
            except OutOfReach:
                if output.name != "euler":
                    raise
                break
        if output.name == "euler":
            return [None if self._lacking(value, output, narrow) > 0 else value for value in values]
        raise OutOfReach(
            f"The {output.name} at t = {shown(self.times[place])} is not known to {self.digits} digits, by "
            f"{self.method}.",
            "Ask for fewer digits.",
        )

    @whole_evaluation
    def _locked(self, whole: Sequence[arb], output: Output) -> bool:
        """Whether two Euler angles turn about one axis, exactly."""
        return bool(euler_terms(rows_of(whole[3:6], whole[6:]), output.sequence)[1][0].is_zero())

    @whole_evaluation
    def _evaluated(self, whole: Sequence[arb], bits: int, output: Output) -> list[arb]:
        with working_precision(bits + _WORKING_BITS):
            omega, gamma, xi = whole[:3], whole[3:6], whole[6:]
            if not self._unit:
                length = ball(dot(self.gamma, self.gamma)).sqrt()
                gamma = [part / length for part in gamma]
            return list(output.at(omega, gamma, xi, self.centre, _BALLS, ball))

    def _narrow(self, output: Output) -> float:
        """A radius of a position that is small enough at any rate; 0 where doubles do not tell, and of others."""
        if output.name != "position":
            return 0.0
        size = max(abs(part) for part in (*output.point_of(self.centre), *output.pivot))
        tenth = Fraction(8, 10 ** (self.digits + 1))
        return float(size * tenth) if _SMALL < size * tenth < 1 else 0.0

    def _lacking(self, value: arb, output: Output, narrow: float) -> float:
        """Bits by which a ball is too wide; inf where it is not finite.  narrow: of :meth:`_narrow`."""
        if not value.is_finite():
            return math.inf
        if self.as_written:
            return 0
        if output.name != "position":
            if value.rel_one_accuracy_bits() >= bits_of(self.digits):
                return 0
        elif float(value.rad()) < narrow:
            return 0
        scale = max(Fraction(1), abs(midpoint(value)))
        if output.name == "position":
            scale = max(abs(part) for part in (*output.point_of(self.centre), *output.pivot))
        # the printed value is rounded to one digit more than was asked for, by at most half a unit of it
        most, wide = scale * Fraction(9, 10 ** (self.digits + 1)), radius(value)
        if wide <= most:
            return 0
        return (wide / most).__ceil__().bit_length() if most else math.inf


def _root(value: arb) -> arb:
    """√ of a number that is not negative, whose ball may reach below 0."""
    if value >= 0:
        return arb.sqrt(value)
    return arb(0).union(value.abs_upper().sqrt())


def _atan2(y: arb, x: arb) -> arb:
    """atan2 in (−π, π], but that a ball which reaches over the cut lies around π."""
    if x < 0 and not (y > 0 or y < 0):
        return arb.pi() + arb.atan2(-y, -x)
    return arb.atan2(y, x) if not (y.contains(0) and x.contains(0)) else arb("nan")


_BALLS = SimpleNamespace(**vars(FUNCTIONS) | {"sqrt": _root, "atan2": _atan2})


def text(value: arb | None, digits: int) -> tuple[str, str]:
    """(value, radius) as decimal text, of one digit more than is proven; ``nan`` and ``inf`` for what is undefined."""
    return UNDEFINED if value is None else value_text(value, digits + 1)


def nearest(value: arb | None) -> float:
    """The double nearest to the middle of a ball; nan for what is undefined."""
    return math.nan if value is None else float(midpoint(value))


@whole_evaluation
def as_written(
    states: Sequence[Sequence[Any]],
    attitude: Sequence[Sequence[Any]],
    times: Sequence[str],
    digits: int,
    centre: Sequence[str],
    gamma: Sequence[str],
    start_xi: Sequence[str],
) -> KnownMotion:
    """A known motion out of printed balls: what has a ``value`` and a ``radius`` as text."""
    with working_precision(bits_of(digits) + 2 * GUARD_BITS):
        lines = [
            [ball(exact(each.value)) + arb(0, ball(exact(each.radius))) for each in (*y, *xi)]
            for y, xi in zip(states, attitude, strict=True)
        ]
        start = vector(gamma, "gamma")
        at_start = [ball(value) for value in (*start, *start, *vector(start_xi, "xi"))]
    instants = [exact(str(time)) for time in times]
    found = {Fraction(0): at_start, **dict(zip(instants, lines, strict=True))}

    def whole(time: Fraction, bits: int) -> Sequence[Any]:
        return found[time]

    return KnownMotion(whole, instants, digits, vector(centre, "centre"), start, "the printed balls", as_written=True)
