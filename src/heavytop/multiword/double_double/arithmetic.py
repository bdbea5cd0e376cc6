"""Double-double arithmetic in machine code: a number is the exact sum of two doubles, high and low, 106 bits.

After sums and products the low word may be a few units of the high one; ``quick_two_sum`` normalises a result.
Logarithms are taken from the bits of the exponent and a cubic: + - × only, the same on every processor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache

from heavytop.multiword.codegen.machine_code import Code, Number, Operand, Pair

_FRACTION_BITS = 52
_BIAS = 1023
# log2(1 + f) = f + f (1 - f) (a + b f + c f²) to 2e-4 and 2^f likewise, exact at both ends (least squares)
_LOG = (0.43807325, -0.23669342, 0.0803073)
_POWER = (-0.30407153, -0.07912522)
_LEAST_EXPONENT = -900.0
_STEP_BITS, _LARGEST_STEP = 10, 6

Constant = tuple[Operand, Operand, Operand]
"""A number in three words: their vectors."""


def add(code: Code, a: Pair, b: Pair) -> Pair:
    """a + b."""
    high, error = code.two_sum(a[0], b[0])
    return high, a[1] + b[1] + error


def multiply(code: Code, a: Pair, b: Pair) -> Pair:
    """a b."""
    product, error = code.two_product(a[0], b[0])
    return product, code.fma(a[0], b[1], code.fma(a[1], b[0], error))


def by_constant(code: Code, constant: Constant, a: Pair) -> Pair:
    """A constant in three words times a.

    The error of two words of a simple fraction such as 5/6 does not average out: it accumulates over 10^6 steps.  Nor
    do the roundings, if the high word is the product of the first word of the constant only, as its few remainders are
    biased.  So the high word is that of the whole product.
    """
    low = code.fma(constant[1], a[0], constant[2] * a[0])
    product = code.fma(constant[0], a[0], low)
    error = code.fma(constant[0], a[0], -product)
    return product, code.fma(constant[0], a[1], error + low)


def times(code: Code, a: Pair, factor: Operand) -> Pair:
    """a times a double."""
    product, error = code.two_product(a[0], factor)
    return product, code.fma(a[1], factor, error)


def accumulated(code: Code, total: Pair, a: Pair, b: Pair) -> Pair:
    """total + a b for long sums, with its low word not normalised."""
    high = total[0] + a[0] * b[0]
    part = high - total[0]
    error = total[0] - (high - part)
    # the rounding of the product too
    low = code.fma(a[0], b[1], code.fma(a[1], b[0], code.fma(a[0], b[0], -part)))
    return high, total[1] + (error + low)


def divided(code: Code, a: Pair, divisor: Operand, inverse: Pair) -> Pair:
    """a over an integer whose inverse is given in two words.

    A product with the inverse has the same error at every step, which accumulates where roundings average out; the
    quotient of the exact remainder has not.
    """
    high = a[0] * inverse[0]
    remainder = code.fma(-high, divisor, a[0]) + a[1]
    return high, code.fma(remainder, inverse[0], remainder * inverse[1])


def later(code: Code, time: Pair, length: Operand) -> Pair:
    """time + length, normalised."""
    total, error = code.two_sum(time[0], length)
    return code.quick_two_sum(total, error + time[1])


def covered(time: Pair, target: Pair) -> Operand:
    """Whether time has reached the target."""
    level = (time[0] == target[0]) & (time[1] >= target[1])
    return (time[0] > target[0]) | level


def behind(code: Code, time: Pair, began: Pair, sign: Operand) -> tuple[Pair, Operand]:
    """± (time − began), normalised, and a bit: whether it is certainly the pair of :func:`split` of the exact number.

    The exact difference is s + l + e, where s is the nearest double to s + l, with more to spare than |e| or e = 0.
    """
    first, error = code.two_sum(time[0], -began[0])
    second, low_error = code.two_sum(time[1], -began[1])
    total, low = code.two_sum(first, second)
    low, error1 = code.two_sum(low, error)
    low, error2 = code.two_sum(low, low_error)
    high, low = code.two_sum(total, low)
    exact1, exact2 = error1 == 0, error2 == 0
    low, _ = code.two_sum(low, error1 + error2)
    wider = low * (1 + 2.0**-40)
    nearest = high + wider == high
    sure = (exact1 & exact2) | ((exact1 | exact2) & nearest)
    return (high * sign, low * sign), sure


def polynomials(
    code: Code, orders: Pair, points: Sequence[Pair], count: int, row: Callable[[Operand], list[Pair]]
) -> list[list[Operand]]:
    """The words of Σ row(n) x^n at each point x, for each of the ``count`` numbers of a row, from the highest order.

    orders: the last one in double-double, and the highest; those between are in plain doubles.
    The sums of one point depend on each other, those of several do not.
    """
    low_order, order = orders

    def plain(k: Operand, sums: list[Operand]) -> list[Operand]:
        highs = [high for high, _ in row(order - k)]
        factors = [(at, high) for at, _ in points for high in highs]
        return [code.fma(total, at, high) for total, (at, high) in zip(sums, factors, strict=True)]

    def term(k: Operand, words: list[Operand]) -> list[Operand]:
        result: list[Operand] = []
        coefficients = row(low_order - k)
        for at in points:
            for coefficient in coefficients:
                total = multiply(code, (words[len(result)], words[len(result) + 1]), at)
                result += code.quick_two_sum(*add(code, total, coefficient))
        return result

    sums = code.loop(0, order - low_order, plain, [code.zero] * (count * len(points)))
    begin = [word for total in sums for word in (total, code.zero)]
    words, width = code.loop(0, low_order + 1, term, begin), 2 * count
    return [words[width * i : width * (i + 1)] for i in range(len(points))]


def step_length(code: Code, radii: Sequence[Operand], reach: Operand) -> Operand:
    """h to few bits, from log2 of the radius of convergence by the last two coefficients."""
    smallest = code.smaller(radii[0], radii[1])
    return power_of_two(code, smallest + reach, _LARGEST_STEP, _STEP_BITS)


def split(value: Fraction) -> tuple[float, float]:
    """The two doubles nearest to ``value``; exact for numbers of 106 bits."""
    return split_ratio(*value.as_integer_ratio())


def split_ratio(top: int, bottom: int) -> tuple[float, float]:
    """The two doubles nearest to a quotient, which need not be in lowest terms."""
    high = top / bottom
    above, below = high.as_integer_ratio()
    return high, (top * below - above * bottom) / (bottom * below)


def split_constant(value: Fraction) -> tuple[float, float, float]:
    """The three doubles nearest to ``value``, for :func:`by_constant`."""
    return _split_ratio(*value.as_integer_ratio())


@lru_cache(maxsize=1024)
def _split_ratio(top: int, bottom: int) -> tuple[float, float, float]:
    # motions of one top share their constants
    high, low = split(Fraction(top, bottom))
    return high, low, float(Fraction(top, bottom) - Fraction(high) - Fraction(low))


def log2(value: Operand) -> Operand:
    """log2 of a double that is not negative, to 1e-3, or of each of eight; about -1023 for 0."""
    bits = value.bits()
    exponent = bits.unsigned_shift(_FRACTION_BITS) - _BIAS
    significand = (bits & (1 << _FRACTION_BITS) - 1) | (_BIAS << _FRACTION_BITS)
    fraction = significand.of_bits() - 1.0
    return exponent.to_double() + _bent(fraction, _LOG)


def power_of_two(code: Code, exponent: Operand, most: int, bits: int) -> Operand:
    """2^exponent to 1e-3, at most 2^most, its significand cut to that many bits; of a double, or of each of eight."""
    bounded = code.larger(code.smaller(exponent, most), _LEAST_EXPONENT)
    integral = (bounded - _LEAST_EXPONENT).to_integer()
    fraction = bounded - _LEAST_EXPONENT - integral.to_double()
    significand = (1.0 + _bent(fraction, _POWER)).bits()
    mask = ((1 << _FRACTION_BITS) - 1) ^ ((1 << (_FRACTION_BITS + 1 - bits)) - 1)
    biased = integral + (_BIAS + int(_LEAST_EXPONENT))
    shifted = biased << _FRACTION_BITS
    return ((significand & mask) + shifted).of_bits()


def _bent(fraction: Operand, bend: tuple[float, ...]) -> Operand:
    """f + f (1 - f) times a polynomial in f."""
    total: Number = bend[-1]
    for coefficient in reversed(bend[:-1]):
        total = total * fraction + coefficient
    return fraction + fraction * (1.0 - fraction) * total
