"""Double-double arithmetic in machine code: a number is the exact sum of two doubles, high and low, 106 bits.

Sums and products leave the low word a few units of the high one wide; ``quick_two_sum`` brings a result to order.
Logarithms are taken from the bits of the exponent and a cubic: + - × only, the same on every processor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache

from llvmlite import ir

from heavytop.multiword.codegen.machine_code import DOUBLE, INT, INT_VECTOR, LANES, VECTOR, Code, Pair, Value

_FRACTION_BITS = 52
_BIAS = 1023
# log2(1 + f) = f + f (1 - f) (a + b f + c f²) to 2e-4 and 2^f likewise, exact at both ends (least squares)
_LOG = (0.43807325, -0.23669342, 0.0803073)
_POWER = (-0.30407153, -0.07912522)
_LEAST_EXPONENT = -900.0
_STEP_BITS, _LARGEST_STEP = 10, 6

Constant = tuple[Value, Value, Value]
"""A number in three words: their vectors."""


def add(code: Code, a: Pair, b: Pair) -> Pair:
    """a + b."""
    high, error = code.two_sum(a[0], b[0])
    return high, code.add(code.add(a[1], b[1]), error)


def multiply(code: Code, a: Pair, b: Pair) -> Pair:
    """a b."""
    product, error = code.two_product(a[0], b[0])
    return product, code.fma(a[0], b[1], code.fma(a[1], b[0], error))


def by_constant(code: Code, constant: Constant, a: Pair) -> Pair:
    """A constant in three words times a.

    What two words of a simple fraction such as 5/6 leave out does not average out: over 10^6 steps it adds up.  Nor do
    the roundings, if the high word is that of the first word of the constant only: its few remainders then are not as
    often below 0 as above.  So the high word is that of the whole product.
    """
    rest = code.fma(constant[1], a[0], code.multiply(constant[2], a[0]))
    product = code.fma(constant[0], a[0], rest)
    error = code.fma(constant[0], a[0], code.negative(product))
    return product, code.fma(constant[0], a[1], code.add(error, rest))


def times(code: Code, a: Pair, factor: Value) -> Pair:
    """a times a double."""
    product, error = code.two_product(a[0], factor)
    return product, code.fma(a[1], factor, error)


def accumulated(code: Code, total: Pair, a: Pair, b: Pair) -> Pair:
    """total + a b, its low word unordered: for long sums."""
    high = code.add(total[0], code.multiply(a[0], b[0]))
    part = code.subtract(high, total[0])
    rest = code.subtract(total[0], code.subtract(high, part))
    # the rounding of the product too
    low = code.fma(a[0], b[1], code.fma(a[1], b[0], code.fma(a[0], b[0], code.negative(part))))
    return high, code.add(total[1], code.add(rest, low))


def divided(code: Code, a: Pair, divisor: Value, inverse: Pair) -> Pair:
    """a over an integer whose inverse is given in two words.

    A product with the inverse would be wrong in the same way at every step, which adds up where roundings average out;
    the quotient of the exact remainder is not.
    """
    high = code.multiply(a[0], inverse[0])
    rest = code.add(code.fma(code.negative(high), divisor, a[0]), a[1])
    return high, code.fma(rest, inverse[0], code.multiply(rest, inverse[1]))


def later(code: Code, time: Pair, length: Value) -> Pair:
    """time + length, in order."""
    total, error = code.two_sum(time[0], length)
    return code.quick_two_sum(total, code.add(error, time[1]))


def covered(code: Code, time: Pair, target: Pair) -> Value:
    """Whether time is the target or behind it."""
    b = code.builder
    level = b.and_(b.fcmp_ordered("==", time[0], target[0]), b.fcmp_ordered(">=", time[1], target[1]))
    return b.or_(b.fcmp_ordered(">", time[0], target[0]), level)


def behind(code: Code, time: Pair, began: Pair, sign: Value) -> tuple[Pair, Value]:
    """± (time − began), doubles in order, and a bit: whether it surely is what :func:`split` makes of the exact one.

    The exact difference is s + l + e, where s is the nearest double to s + l, with more to spare than |e| or e = 0.
    """
    b = code.builder
    first, error = code.two_sum(time[0], b.fneg(began[0]))
    second, rest = code.two_sum(time[1], b.fneg(began[1]))
    total, low = code.two_sum(first, second)
    low, one = code.two_sum(low, error)
    low, other = code.two_sum(low, rest)
    high, low = code.two_sum(total, low)
    one_is, other_is = (b.fcmp_ordered("==", word, ir.Constant(DOUBLE, 0.0)) for word in (one, other))
    low, _ = code.two_sum(low, code.add(one, other))
    wider = code.multiply(low, ir.Constant(DOUBLE, 1 + 2.0**-40))
    nearest = b.fcmp_ordered("==", code.add(high, wider), high)
    sure = b.or_(b.and_(one_is, other_is), b.and_(b.or_(one_is, other_is), nearest))
    return (code.multiply(high, sign), code.multiply(low, sign)), sure


def polynomials(
    code: Code, orders: Pair, places: Sequence[Pair], count: int, row: Callable[[Value], list[Pair]]
) -> list[list[Value]]:
    """For each place, the words of Σ row(n) place^n for each of the ``count`` numbers of a row, from the highest order.

    orders: the last of those in double-double, and the highest; between them it goes on in plain doubles.
    The sums of one place wait for each other, those of several do not.
    """
    (low_order, order), b = orders, code.builder

    def plain(k: Value, sums: list[Value]) -> list[Value]:
        highs = [high for high, _ in row(b.sub(order, k))]
        both = [(at, high) for at, _ in places for high in highs]
        return [code.fma(total, at, high) for total, (at, high) in zip(sums, both, strict=True)]

    def term(k: Value, words: list[Value]) -> list[Value]:
        found: list[Value] = []
        coefficients = row(b.sub(low_order, k))
        for at in places:
            for coefficient in coefficients:
                total = multiply(code, (words[len(found)], words[len(found) + 1]), at)
                found += code.quick_two_sum(*add(code, total, coefficient))
        return found

    sums = code.loop(0, b.sub(order, low_order), plain, [code.zero] * (count * len(places)))
    begin = [word for total in sums for word in (total, code.zero)]
    words, width = code.loop(0, b.add(low_order, code.integer(1)), term, begin), 2 * count
    return [words[width * i : width * (i + 1)] for i in range(len(places))]


def step_length(code: Code, radii: Sequence[Value], reach: Value) -> Value:
    """h, from log2 of the radius of convergence as the last two coefficients have it; in a few bits."""
    b = code.builder
    least = b.select(b.fcmp_ordered("<", radii[0], radii[1]), radii[0], radii[1])
    return power_of_two(code, b.fadd(least, reach), _LARGEST_STEP, _STEP_BITS)


def split(value: Fraction) -> tuple[float, float]:
    """The two doubles nearest to ``value``; exact for numbers of 106 bits."""
    return split_ratio(*value.as_integer_ratio())


def split_ratio(top: int, bottom: int) -> tuple[float, float]:
    """The same of a quotient, which need not be in lowest terms."""
    high = top / bottom
    above, below = high.as_integer_ratio()
    return high, (top * below - above * bottom) / (bottom * below)


def split_constant(value: Fraction) -> tuple[float, float, float]:
    """The three doubles nearest to ``value``, as :func:`by_constant` takes them."""
    return _split_ratio(*value.as_integer_ratio())


@lru_cache(maxsize=1024)
def _split_ratio(top: int, bottom: int) -> tuple[float, float, float]:
    # motions of one top share their constants
    high, low = split(Fraction(top, bottom))
    return high, low, float(Fraction(top, bottom) - Fraction(high) - Fraction(low))


def log2(code: Code, value: Value) -> Value:
    """log2 of a double that is not negative, to 1e-3, or of each of eight; about -1023 for 0."""
    b, of = code.builder, _Like(value)
    bits = b.bitcast(value, of.integers)
    exponent = b.sub(b.lshr(bits, of.integer(_FRACTION_BITS)), of.integer(_BIAS))
    one = of.integer(_BIAS << _FRACTION_BITS)
    significand = b.or_(b.and_(bits, of.integer((1 << _FRACTION_BITS) - 1)), one)
    fraction = b.fsub(b.bitcast(significand, value.type), of.double(1.0))
    return b.fadd(b.sitofp(exponent, value.type), _bent(code, fraction, _LOG))


def power_of_two(code: Code, exponent: Value, most: int, bits: int) -> Value:
    """2^exponent to 1e-3, at most 2^most, its significand cut to that many bits; of a double, or of each of eight."""
    b, of = code.builder, _Like(exponent)
    low, high = of.double(_LEAST_EXPONENT), of.double(float(most))
    bounded = b.select(b.fcmp_ordered("<", exponent, high), exponent, high)
    bounded = b.select(b.fcmp_ordered(">", bounded, low), bounded, low)
    whole = b.fptosi(b.fsub(bounded, low), of.integers)
    fraction = b.fsub(b.fsub(bounded, low), b.sitofp(whole, exponent.type))
    significand = b.bitcast(b.fadd(of.double(1.0), _bent(code, fraction, _POWER)), of.integers)
    kept = ((1 << _FRACTION_BITS) - 1) ^ ((1 << (_FRACTION_BITS + 1 - bits)) - 1)
    biased = b.add(whole, of.integer(_BIAS + int(_LEAST_EXPONENT)))
    shifted = b.shl(biased, of.integer(_FRACTION_BITS))
    return b.bitcast(b.add(b.and_(significand, of.integer(kept)), shifted), exponent.type)


def _bent(code: Code, fraction: Value, bend: tuple[float, ...]) -> Value:
    """f + f (1 - f) times a polynomial in f."""
    b, of = code.builder, _Like(fraction)
    total = of.double(bend[-1])
    for coefficient in reversed(bend[:-1]):
        total = b.fadd(b.fmul(total, fraction), of.double(coefficient))
    return b.fadd(fraction, b.fmul(b.fmul(fraction, b.fsub(of.double(1.0), fraction)), total))


class _Like:
    """Constants of the shape of a value: one, or eight."""

    def __init__(self, value: Value) -> None:
        self.eight = value.type == VECTOR
        self.integers = INT_VECTOR if self.eight else INT
        self.doubles = value.type

    def integer(self, value: int) -> Value:
        one = ir.Constant(INT, value)
        return ir.Constant(INT_VECTOR, [one] * LANES) if self.eight else one

    def double(self, value: float) -> Value:
        one = ir.Constant(DOUBLE, value)
        return ir.Constant(VECTOR, [one] * LANES) if self.eight else one
