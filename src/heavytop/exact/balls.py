"""Balls (python-flint's arb): exact numbers in, enclosures out.

The working precision of FLINT is one for the whole process, so every evaluation stands inside
:class:`heavytop.exact.flint_context.working_precision`, which is to be had from here too.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import ROUND_CEILING, ROUND_HALF_EVEN, Decimal
from fractions import Fraction
from types import SimpleNamespace
from typing import SupportsInt

from flint import arb, fmpq

from heavytop.errors import OutOfReach
from heavytop.exact.flint_context import at_precision, whole_evaluation
from heavytop.exact.flint_context import working_precision as working_precision
from heavytop.precision import quotient_text, ratio_text

FUNCTIONS = SimpleNamespace(
    sqrt=arb.sqrt,
    exp=arb.exp,
    log=arb.log,
    sin=arb.sin,
    cos=arb.cos,
    tanh=arb.tanh,
    cosh=arb.cosh,
    arctan=arb.atan,
    arccos=arb.acos,
    atan2=lambda y, x: arb.atan2(y, x),
)
_MAX_BITS = 1 << 22
_HALF = arb(0.5)
_INTEGER = re.compile(r"-?[0-9]+")
_GUARD, _STEP = 16, 64
_RADIUS_BITS = 30
_RADIUS_DIGITS = 3
_ENOUGH = 1 << 15
"""Working bits that are always tried: tops whose moments, weight and spin differ by a thousand decades need them."""
_SERIES_DIVISION = ("leading term in denominator is not nonzero", "quotient would not be a power series")
"""What python-flint says of a division by a power series whose first coefficient may be 0, instead of nan."""


class Undecided(ArithmeticError):
    """The working precision does not decide a discrete question."""


def rational(value: Fraction | int) -> fmpq:
    """``value`` as FLINT's fraction."""
    return fmpq(value.numerator, value.denominator)


def ball(value: Fraction | int) -> arb:
    """``value`` as a ball at the working precision; of radius 0 where it is a binary number that fits."""
    return arb(rational(value))


def midpoint(value: arb) -> Fraction:
    """The exact midpoint of a finite ball."""
    return _fraction(*value.mid().man_exp())


def radius(value: arb) -> Fraction:
    """The exact radius of a finite ball."""
    return _fraction(*value.rad().man_exp())


def _fraction(mantissa: SupportsInt, exponent: SupportsInt) -> Fraction:
    """mantissa · 2^exponent."""
    m, e = int(mantissa), int(exponent)
    return Fraction(m << e) if e >= 0 else Fraction(m, 1 << -e)


def radius_text(value: Fraction) -> str:
    """A radius as decimal text of three digits, rounded up: it stays an upper bound."""
    return quotient_text(value, _RADIUS_DIGITS, ROUND_CEILING)


def ball_text(value: arb) -> str:
    """A ball as text that :func:`ball_from` makes the very same ball of: ``m e r s`` for m 2^e ± r 2^s, or ``nan``."""
    if not value.is_finite():
        return "nan"
    # Decimal, as Python refuses to write or read an int of more than 4300 digits, or of what the process set
    return " ".join(str(Decimal(int(part))) for part in (*value.mid().man_exp(), *value.rad().man_exp()))


@whole_evaluation
def ball_from(text: str) -> arb:
    """The ball of :func:`ball_text`.  Raises ValueError for other text."""
    if text == "nan":
        return arb("nan")
    m, e, r, s = (_integer(part) for part in text.split())
    if not r:
        return arb((m, e))
    with working_precision(m.bit_length() + 64):
        value = arb((m, e), (r, s))
        if r.bit_length() == _RADIUS_BITS:
            # FLINT rounds such a radius up on its way in, and takes an addition of next to nothing for one unit
            value = arb((m, e), (r - 1, s)) + arb(0, (1, s - 100))
    if ball_text(value) != text:
        raise ValueError(f"no ball is {text[:60]!r}")
    return value


def _integer(text: str) -> int:
    if not _INTEGER.fullmatch(text):
        raise ValueError(f"no integer is {text[:60]!r}")
    return int(Decimal(text))


def value_text(value: arb, digits: int) -> tuple[str, str]:
    """(value, radius) as decimal text: the radius encloses the ball and the rounding of the printed value."""
    (m, e), (r, s) = ((int(part[0]), int(part[1])) for part in (value.mid().man_exp(), value.rad().man_exp()))
    # over one denominator that need not be the least
    unit = min(e, s, 0)
    middle, wide = m << (e - unit), r << (s - unit)
    text = ratio_text(middle, 1 << -unit, digits, ROUND_HALF_EVEN)
    above, below = Decimal(text).as_integer_ratio()
    off = wide * below + abs((above << -unit) - middle * below)
    return text, ratio_text(off, below << -unit, _RADIUS_DIGITS, ROUND_CEILING)


@whole_evaluation
def whole(value: arb) -> int:
    """The whole number nearest to the middle of a ball; 0 if it is not finite."""
    found = (value + _HALF).mid().floor().unique_fmpz()
    return 0 if found is None else int(found)


def relative_bits(value: arb) -> int:
    """Bits that a ball of size about 1 or larger has right; absolute below 1; -1 if it is not finite."""
    return max(0, min(_MAX_BITS, value.rel_one_accuracy_bits())) if value.is_finite() else -1


def _size(value: arb) -> int:
    """The smallest e with |value| < 2^e, of an exact ball; a large negative number for 0."""
    mantissa, exponent = value.man_exp()
    return int(exponent) + int(mantissa).bit_length() if mantissa else -_MAX_BITS


def _graspable(value: arb, smallest: int) -> arb:
    """``value``, or a ball around 0 with it inside where it is smaller than 2^smallest.

    Near a saddle components fall like e^(−t): at t = 10^6 their exact midpoints have a million bits.
    """
    if float(value) or value.is_zero() or max(_size(value.mid()), _size(value.rad())) > smallest:
        return value
    return arb(0, arb(2) ** (smallest + 1))


@whole_evaluation
def to_bits(
    evaluate: Callable[[int], list[arb]], bits: int, time: Fraction | None = None, length: int = 1
) -> list[arb]:
    """``evaluate(working bits)`` repeated at growing working precision until every ball has ``bits`` bits.

    Bits count relative to a value above 1 and absolutely below it; none are right where it raises Undecided.
    time: what it is evaluated at; it costs its own bits, and the precision then comes in steps, so that lattices are
    made once.  length: of power series meanwhile.
    Raises OutOfReach where even a precision of 16 times the asked bits plus 4096, or of 32768, does not give them.
    """
    extra = -1 if time is None else _GUARD + (abs(time.numerator) // time.denominator).bit_length()
    working, smallest = bits + 32, -16 * bits - 4096
    most = max(-smallest, _ENOUGH)
    while True:
        inside = working if extra < 0 else -(-(working + extra) // _STEP) * _STEP
        try:
            values = at_precision(inside, length, evaluate)
        except Undecided:
            values = [arb("nan")]
        except ValueError as error:
            if str(error) not in _SERIES_DIVISION:
                raise
            values = [arb("nan")]
        right = [value.rel_one_accuracy_bits() for value in values]
        if min(right) >= bits:
            # only exact, infinite and very small values have more bits right than that
            if max(right) < -smallest:
                return values
            if all(value.is_finite() for value in values):
                return [v if r < -smallest else _graspable(v, smallest) for v, r in zip(values, right, strict=True)]
        reached = min(map(relative_bits, values))
        if working >= most:
            raise OutOfReach(
                f"Only {max(reached, 0)} of {bits} bits could be proven at a working precision of {inside} bits.",
                "Ask for fewer digits or an earlier time; moments, weights and rates of very different size cost most.",
            )
        working = min(most, working + (max(bits - reached, working // 2) if reached >= 0 else working))
