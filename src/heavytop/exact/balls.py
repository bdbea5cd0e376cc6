"""Balls (python-flint's arb): exact numbers in, enclosures out.

The working precision of FLINT is global, so every evaluation stands inside :func:`working_precision`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import MAX_EMAX, MIN_EMIN, ROUND_CEILING, Context, Decimal
from fractions import Fraction
from types import SimpleNamespace

from flint import arb, ctx, fmpq

from heavytop.errors import OutOfReach
from heavytop.precision import decimal_text

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


@contextmanager
def working_precision(bits: int) -> Iterator[None]:
    """FLINT's working precision set to ``bits`` within the block."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


def ball(value: Fraction | int) -> arb:
    """``value`` as a ball at the working precision; of radius 0 where it is a binary number that fits."""
    return arb(fmpq(value.numerator, value.denominator))


def midpoint(value: arb) -> Fraction:
    """The exact midpoint of a finite ball."""
    mantissa, exponent = value.mid().man_exp()
    return int(mantissa) * Fraction(2) ** int(exponent)


def radius(value: arb) -> Fraction:
    """The exact radius of a finite ball."""
    mantissa, exponent = value.rad().man_exp()
    return int(mantissa) * Fraction(2) ** int(exponent)


def radius_text(value: Fraction) -> str:
    """A radius as decimal text of three digits, rounded up: it stays an upper bound."""
    context = Context(prec=3, rounding=ROUND_CEILING, Emax=MAX_EMAX, Emin=MIN_EMIN)
    quotient = context.divide(Decimal(value.numerator), Decimal(value.denominator))
    return str(quotient) if quotient else "0"


def value_text(value: arb, digits: int) -> tuple[str, str]:
    """(value, radius) as decimal text: the radius encloses the ball and the rounding of the printed value."""
    text = decimal_text(midpoint(value), digits)
    return text, radius_text(radius(value) + abs(Fraction(text) - midpoint(value)))


def relative_bits(value: arb) -> int:
    """Bits that a ball of size about 1 or larger has right; absolute below 1; -1 if it is not finite."""
    if not value.is_finite():
        return -1
    if value.is_exact():
        return _MAX_BITS
    # exponents only: values like exp(-1e9) have no fraction that fits into memory
    return min(_MAX_BITS, max(0, max(0, _size(value.mid()) - 1) - _size(value.rad())))


def _size(value: arb) -> int:
    """The smallest e with |value| < 2^e, of an exact ball; a large negative number for 0."""
    mantissa, exponent = value.man_exp()
    return int(exponent) + int(mantissa).bit_length() if mantissa else -_MAX_BITS


def _graspable(value: arb) -> arb:
    """``value``, or a ball around 0 with it inside where it is smaller than 2^-_MAX_BITS."""
    tiny = -_MAX_BITS
    if (value.is_exact() and value == 0) or max(_size(value.mid()), _size(value.rad())) > tiny:
        return value
    return arb(0, arb(2) ** (tiny + 1))


def to_bits(evaluate: Callable[[int], list[arb]], bits: int) -> list[arb]:
    """``evaluate(working bits)`` repeated at growing working precision until every ball has ``bits`` bits.

    Bits count relative to a value above 1 and absolutely below it.  Raises OutOfReach where even a precision of
    16 times the asked bits plus 4096 does not give them.
    """
    working = bits + 32
    reached = -1
    while working <= 16 * bits + 4096:
        with working_precision(working):
            values = evaluate(working)
        reached = min(relative_bits(value) for value in values)
        if reached >= bits:
            return [_graspable(value) for value in values]
        working += max(bits - reached, working // 2) if reached >= 0 else working
    raise OutOfReach(
        f"Only {max(reached, 0)} of {bits} bits could be proven.", "Ask for fewer digits or an earlier time."
    )
