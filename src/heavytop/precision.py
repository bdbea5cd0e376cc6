"""Number formats, and conversions between exact numbers and numbers of a format.

Numbers inside the program are of :class:`fractions.Fraction`.  They are rounded to a format only here, by
:func:`number`; :func:`exact` returns the exact value of a rounded number.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, ROUND_HALF_EVEN, Context, Decimal, Overflow
from fractions import Fraction
from functools import lru_cache, wraps
from itertools import islice
from math import isqrt
from numbers import Rational
from operator import index, is_
from threading import RLock
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, Protocol, Self, SupportsIndex, TypeAlias, TypeVar, cast

from heavytop.errors import HeavyTopError, InputError, argument, quoted, refusal
from heavytop.extras import import_heyoka

if TYPE_CHECKING:
    from numpy.typing import NDArray

REAL_BITS = range(24, 20001)
_MAX_TEXT = 100_000
LARGEST = Fraction(10) ** 150
"""Larger physical data overflow in some float of the program; other units avoid this."""
_LARGE_POWER = 498
"""2^498 is below :data:`LARGEST`."""
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")
_REMEDY = "Write an integer, a decimal such as 0.25 or 1e-3, or a fraction such as -2/5."


Given: TypeAlias = int | float | str | Fraction | Decimal | SupportsIndex
"""A number as an argument: an integer, a float of any format (taken as the exact binary number), or exact text."""
Array: TypeAlias = "NDArray[Any]"
"""An array of the numbers of a format, whatever their dtype."""


@dataclass(frozen=True, slots=True)
class Precision:
    """A binary floating-point format: its name on the command line and the bits of its significand."""

    name: str
    bits: int

    @property
    def eps(self) -> Fraction:
        """Distance from 1 to the next larger number, 2^(1 - bits)."""
        return Fraction(2) ** (1 - self.bits)

    @property
    def digits(self) -> int:
        """Significant decimal digits that determine a number of this format."""
        return 1 + math.ceil(self.bits * math.log10(2))

    @property
    def family(self) -> str:
        """``double``, ``extended``, ``double-double``, ``quad`` or ``real``."""
        return self.name.partition(":")[0]


DOUBLE = Precision("double", 53)
EXTENDED = Precision("extended", 64)
DOUBLE_DOUBLE = Precision("double-double", 106)
"""The sum of two doubles; its numbers are returned as heyoka's real of 106 bits.  Only ``multiword`` has it."""
QUAD = Precision("quad", 113)
FORMATS = DOUBLE, EXTENDED, DOUBLE_DOUBLE, QUAD


def real(bits: int) -> Precision:
    """The arbitrary-precision format with ``bits`` (24 to 20000) significant bits; raises InputError outside."""
    count = as_integer(bits, "BITS of real:BITS")
    if count not in REAL_BITS:
        raise refusal("BITS of real:BITS", "from 24 to 20000", quoted(count), "Give, for example, real:200.")
    return Precision(f"real:{count}", count)


def parse(name: str) -> Precision:
    """The format of that name; raises InputError unless it is one of FORMATS or ``real:BITS``."""
    if isinstance(name, str):
        for precision in FORMATS:
            if name == precision.name:
                return precision
        if re.fullmatch(r"real:[1-9][0-9]{0,8}", name):
            return real(int(name[5:]))
    raise InputError(
        f"Unknown precision {quoted(name)}.",
        "Use double, extended, double-double, quad or real:BITS (real:24 is single precision).",
    )


def as_integer(value: Any, what: str) -> int:
    """``value`` as an integer; raises InputError for bools, floats (even integral ones) and anything else."""
    try:
        if type(value).__name__ != "bool":  # Python's or numpy's
            return index(value)
    except Exception:  # no integer, or a foreign __index__ that raises
        pass
    raise refusal(what, "an integer", quoted(value), "Give an integer.")


def available() -> dict[str, str | None]:
    """For each family of formats None if this platform has it, else the reason why not."""
    heyoka = import_heyoka()
    import numpy

    mantissa = int(numpy.finfo(numpy.longdouble).nmant) + 1
    mpfr = None if hasattr(heyoka, "real") else "this build of heyoka has no arbitrary precision (MPFR)"
    return {
        "double": None,
        "extended": None if mantissa == EXTENDED.bits else f"long double has {mantissa} bits here, not 64",
        "double-double": mpfr,
        "quad": None if hasattr(heyoka, "real128") else "this build of heyoka has no quadruple precision (real128)",
        "real": mpfr,
    }


def require(precision: Precision) -> Precision:
    """``precision`` itself; raises InputError if this platform lacks it."""
    reason = None if precision.family == "double" else available()[precision.family]
    if reason:
        raise InputError(
            f"Precision {precision.name} is not available: {reason}.",
            "`heavytop list --json` shows which formats are available.",
        )
    return precision


def usable_tolerance(value: Given, precision: Precision) -> Fraction:
    """An exact tolerance; raises InputError unless it goes from the eps of the format to 1."""
    tolerance = physical(value, "tolerance")
    if not precision.eps <= tolerance <= 1:
        raise refusal(
            f"The tolerance in {precision.name}",
            f"from its eps, {decimal_text(precision.eps, 3)}, to 1",
            shown(tolerance),
            "Leave it out for the accuracy of the format.",
        )
    return tolerance


def exact(value: Any) -> Fraction:
    """The exact value of an int, Fraction, Decimal, decimal or fraction string, or binary float of any format.

    The value of a float is that of its binary representation, not of its printed decimal.  Raises InputError for text
    that is not a number, for bools, NaN and infinities, and for too long text or exponents.
    """
    if type(value) is Fraction and type(value.numerator) is int is type(value.denominator):
        return value
    if isinstance(value, str):
        return _from_short_text(value) if len(value) <= _SHORT else _from_text(value)
    if isinstance(value, float) and math.isfinite(value):
        return Fraction(float(value))
    kind = type(value).__name__
    if kind == "mpfr":
        return _from_mpfr(value)
    if kind == "fmpq":
        return Fraction(int(value.p), int(value.q))
    if kind in ("real", "real128"):
        return _from_quad(value) if kind == "real128" else round_to(_from_text(str(value)), int(value.prec))
    if isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) > _MAX_TEXT:
        raise _too_large(value)
    # Python treats bool and numpy.bool as integers
    if kind != "bool":
        try:
            if isinstance(value, Rational):
                return Fraction(int(value.numerator), int(value.denominator))
            if hasattr(value, "as_integer_ratio"):
                return Fraction(*map(int, value.as_integer_ratio()))
            return Fraction(index(value))
        except Exception:  # NaN, infinities, and errors of a foreign number type
            pass
    if kind == "mpf":
        return _from_mantissa(value)
    if kind == "ndarray" and value.ndim == 0:
        return exact(value[()])
    if isinstance(value, float | Decimal) or (kind != "bool" and hasattr(value, "as_integer_ratio")):
        raise InputError(f"{quoted(value)} is not a finite number.", _REMEDY)
    raise InputError(f"{quoted(value)} is not a number.", _REMEDY)


def _from_quad(value: Any) -> Fraction:
    """The exact value of heyoka's real128, from its bits: sign, 15 of the exponent, 112 of the fraction (IEEE 754)."""
    bits = int.from_bytes(value.tobytes(), sys.byteorder)
    biased = bits >> 112 & 0x7FFF
    if biased == 0x7FFF:
        raise InputError(f"{quoted(value)} is not a finite number.", _REMEDY)
    significand = bits & (1 << 112) - 1 | (biased > 0) << 112
    return _binary(-significand if bits >> 127 else significand, max(biased, 1) - 16495)


def _binary(significand: int, exponent: int) -> Fraction:
    return Fraction(significand << exponent) if exponent >= 0 else Fraction(significand, 1 << -exponent)


def _from_mpfr(value: Any) -> Fraction:
    """The exact value of gmpy2's mpfr, whose exponent may have nine digits."""
    try:
        mantissa, exponent = map(int, value.as_mantissa_exp())
    except (OverflowError, ValueError):
        raise InputError(f"{quoted(value)} is not a finite number.", _REMEDY) from None
    if abs(exponent) > 4 * _MAX_TEXT:
        raise _too_large(value)
    return _binary(mantissa, exponent)


def _from_mantissa(value: Any) -> Fraction:
    """The exact value of mpmath's mpf."""
    sign, mantissa, exponent, _ = value._mpf_
    if not mantissa and exponent:
        raise InputError(f"{quoted(value)} is not a finite number.", _REMEDY)
    if abs(exponent) > 4 * _MAX_TEXT:
        raise _too_large(value)
    return _binary(-int(mantissa) if sign else int(mantissa), int(exponent))


def _too_large(value: object) -> InputError:
    return InputError(f"The exponent of {quoted(value)} is too large.", f"Use exponents up to {_MAX_TEXT}.")


def shown(value: Fraction, most: int = 20) -> str:
    """An exact number for a message: exact if that takes at most ``most`` characters, else to six digits."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) < 100 and len(text := str(value)) <= most:
        return text
    # rounded first: converting a fraction of a million digits to decimal takes seconds
    return six_digits(round_to(value, 64))


def six_digits(value: Fraction) -> str:
    """A number for a sentence, to six digits without trailing zeros."""
    text = decimal_text(value, 6)
    return f"{float(text):.6g}" if 1e-300 < abs(float(text)) < 1e300 else text


def two_digits(value: Fraction) -> str:
    """A size for a sentence, such as an error: ``1.8e-11``."""
    return decimal_text(value, 2).lower()


_MOST_DISTINCT = 40
"""Digits of a number in a sentence, beyond which the difference is written instead."""


def distinct_digits(one: Fraction, other: Fraction) -> tuple[str, str]:
    """Two numbers that differ, for a sentence: to six digits, or to as many up to 40 as it takes to see the difference.

    Beyond 40 digits the first is written as the second and the difference.
    """
    texts = six_digits(one), six_digits(other)
    if texts[0] != texts[1]:
        return texts
    for digits in range(7, _MOST_DISTINCT + 1):
        texts = plain_decimal(one, digits), plain_decimal(other, digits)
        if texts[0] != texts[1]:
            return texts
    return f"{texts[1]} {'+' if one > other else '-'} {decimal_text(abs(one - other), 3)}", texts[1]


def plain_decimal(value: Fraction, digits: int) -> str:
    """A decimal of at most ``digits`` digits, without trailing zeros."""
    text = decimal_text(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text and "E" not in text else text


def time_text(time: Fraction) -> str:
    """A time in reports: exact if 20 digits suffice, else rounded to 20."""
    text = decimal_text(time, 20)
    if abs(time) >= 10**15:
        return text
    text = format(Decimal(text), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def exact_text(value: Fraction) -> str:
    """An exact number as ``str`` prints it, without Python's limit of 4300 digits."""
    numerator, denominator = Decimal(value.numerator), Decimal(value.denominator)
    return f"{numerator}" if denominator == 1 else f"{numerator}/{denominator}"


def physical(number: Any, what: str) -> Fraction:
    """The exact value; raises InputError unless it is a number up to 10^150.  what: its name, for the error."""
    try:
        value = exact(number)
    except InputError as error:
        raise InputError(f"{argument(what)}: {error.cause}", error.remedy) from None
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    if exponent >= _LARGE_POWER and abs(value) > LARGEST:
        raise InputError(f"{argument(what)} = {shown(value)} is too large.", "Choose other units: at most 1e150.")
    return value


def _from_text(text: str) -> Fraction:
    numerator, slash, denominator = text.strip().partition("/")
    top = _from_decimal(numerator, text)
    if not slash:
        return top
    bottom = _from_decimal(denominator, text)
    if bottom == 0:
        raise InputError(f"{quoted(text)} divides by zero.", _REMEDY)
    return top / bottom


_SHORT = 64
_from_short_text = lru_cache(maxsize=4096)(_from_text)
"""Scripts repeat texts, as times or as data."""


def _from_decimal(text: str, original: str) -> Fraction:
    text = text.strip()
    if len(text) > _MAX_TEXT:
        raise InputError(f"A number of {len(text)} characters is too long.", f"Use at most {_MAX_TEXT} characters.")
    match = _DECIMAL.fullmatch(text)
    if not match or not text.isascii():
        with_point = text.replace(",", ".", 1)
        remedy = f"Write a decimal point: {with_point}." if "," in text and _DECIMAL.fullmatch(with_point) else _REMEDY
        raise InputError(f"{quoted(original)} is not a finite number.", remedy)
    exponent = match[3].lstrip("eE+-").lstrip("0") if match[3] else ""
    if len(exponent) > len(str(_MAX_TEXT)) or int(exponent or 0) > _MAX_TEXT:
        raise _too_large(original)
    return Fraction(*Decimal(text).as_integer_ratio())


def round_to(value: Fraction, bits: int) -> Fraction:
    """``value`` rounded to ``bits`` significant bits, to nearest, ties to even; no limit on the exponent."""
    if value == 0:
        return value
    return _binary(*_significand(value, bits))


def _significand(value: Fraction, bits: int) -> tuple[int, int]:
    """Integers (m, e) with m of ``bits`` bits and m 2^e nearest to ``value``."""
    exponent = value.numerator.bit_length() - value.denominator.bit_length() - bits
    significand = _nearest(value, exponent)
    if abs(significand) >= 1 << bits:
        exponent += 1
        significand = _nearest(value, exponent)
    return significand, exponent


def _nearest(value: Fraction, exponent: int) -> int:
    """value/2^exponent rounded to the nearest integer, ties to even."""
    above, below = value.numerator << max(0, -exponent), value.denominator << max(0, exponent)
    quotient, remainder = divmod(above, below)
    return quotient + (2 * remainder > below or (2 * remainder == below and quotient % 2))


def number(value: Fraction, precision: Precision) -> Any:
    """``value`` rounded to nearest in ``precision``, as a number of the type of that format.

    double: numpy.float64; extended: numpy.longdouble; quad: heyoka.real128; real, double-double: heyoka.real.
    Raises InputError if the value is outside of the exponent range of the format.
    """
    import numpy

    if precision.family == "double":
        return numpy.float64(_nearest_double(value))
    result = _wide(*(_significand(value, precision.bits) if value else (0, 0)), precision)
    if not numpy.isfinite(result) or (result == 0 and value != 0):
        raise _out_of_range(value, precision)
    return result


def _nearest_double(value: Fraction) -> float:
    """The double nearest to ``value``; raises InputError outside of the exponent range."""
    try:
        result = float(value)
    except OverflowError:
        raise _out_of_range(value, DOUBLE) from None
    if math.isinf(result) or (result == 0 and value != 0):
        raise _out_of_range(value, DOUBLE)
    return result


def _out_of_range(value: Fraction, precision: Precision) -> InputError:
    return InputError(
        f"{six_digits(value)} is outside the exponent range of {precision.name}.",
        "Choose other units, or a format with a wider range such as real:237.",
    )


def numbers(values: Sequence[Fraction], precision: Precision) -> Sequence[Any]:
    """:func:`number` of each; an array if the values have attached doubles.  Raises InputError as there.

    values: may have attributes ``doubles``, the nearest ones, and ``are_doubles``, whether all values equal them.
    """
    nearest = getattr(values, "doubles", None)
    if nearest is None or not len(nearest):
        return [number(value, precision) for value in values]
    import numpy

    doubles = numpy.array(nearest)
    if precision.family == "double":
        return cast(Sequence[Any], doubles)
    if precision.bits >= DOUBLE.bits and getattr(values, "are_doubles", False):
        return cast(Sequence[Any], _widened(doubles, precision))
    if precision.family == "extended":
        return cast(Sequence[Any], _long_doubles(values, doubles))
    return [number(value, precision) for value in values]


def _widened(doubles: Array, precision: Precision) -> Any:
    """An array of doubles as numbers of a format with at least as many bits."""
    if precision.family == "extended":
        return doubles.astype("longdouble")
    heyoka = import_heyoka()

    return doubles.astype(heyoka.real128) if precision.family == "quad" else heyoka.real(0, precision.bits) + doubles


def _long_doubles(values: Sequence[Fraction], doubles: Array) -> Any:
    """``values`` rounded to extended, as the nearest double plus the double nearest to the remainder."""
    import numpy

    lows = numpy.array([_rest(*pair) for pair in zip(values, doubles.tolist(), strict=True)])
    highs = doubles.astype(numpy.longdouble)
    sums = highs + lows
    error = lows - (sums - highs)
    for k in map(int, numpy.flatnonzero(sums + error * (1 + 2.0**-38) != sums)):  # nearly a tie
        sums[k] = number(values[k], EXTENDED)
    return sums


def _rest(value: Fraction, high: float) -> float:
    top, bottom = value.as_integer_ratio()
    above, below = high.as_integer_ratio()
    return (top * below - above * bottom) / (bottom * below)


def _wide(significand: int, exponent: int, precision: Precision) -> Any:
    """m 2^e in a format wider than double."""
    import numpy

    if precision.family == "extended":
        high, low = divmod(significand, 1 << 32)
        with numpy.errstate(over="ignore", under="ignore"):
            return numpy.ldexp(numpy.longdouble(high) * numpy.longdouble(1 << 32) + numpy.longdouble(low), exponent)
    heyoka = import_heyoka()

    text = _integer_and_exponent(significand, exponent)
    return heyoka.real128(text) if precision.family == "quad" else heyoka.real(text, precision.bits)


def _integer_and_exponent(significand: int, exponent: int) -> str:
    """m 2^e as decimal text without a decimal point, whose meaning depends on the locale."""
    if exponent >= 0:
        return str(Decimal(significand << exponent))
    return f"{Decimal(significand * 5**-exponent)}e{exponent}"


_NORMAL = 16_000
"""Numbers from 2^-16000 to 2^16000 are normal in every format wider than double."""


def rounded(value: Fraction, precision: Precision) -> Fraction:
    """The exact value of ``value`` rounded to nearest in ``precision``; raises InputError as :func:`number`."""
    if precision.family == "double":
        return Fraction(_nearest_double(value))
    exponent = value.numerator.bit_length() - value.denominator.bit_length()
    return round_to(value, precision.bits) if abs(exponent) < _NORMAL else exact(number(value, precision))


def decimal_text(value: Fraction, digits: int) -> str:
    """``value`` as decimal text with ``digits`` significant digits, rounded to nearest."""
    return quotient_text(value, digits, ROUND_HALF_EVEN)


def quotient_text(value: Fraction, digits: int, rounding: str) -> str:
    """``value`` as decimal text with ``digits`` significant digits, with a rounding mode of ``decimal``."""
    return ratio_text(value.numerator, value.denominator, digits, rounding)


def ratio_text(above: int, below: int, digits: int, rounding: str) -> str:
    """:func:`quotient_text` of above/below, which need not be coprime: a large common factor takes long to find."""
    context = _context(digits, rounding)
    quotient = context.divide(Decimal(above), Decimal(below))
    return context.to_sci_string(quotient) if quotient else "0"


@lru_cache(maxsize=64)
def _context(digits: int, rounding: str) -> Context:
    """A context independent of decimal.DefaultContext, which is shared by the process; its flags are not used."""
    return Context(digits, rounding, Emin=MIN_EMIN, Emax=MAX_EMAX, capitals=1, clamp=0, flags=[], traps=[Overflow])


def log10(value: Fraction) -> float | None:
    """log10 |value| to six decimals, None for 0; no exponent is too large or too small."""
    if value == 0:
        return None
    with suppress(OverflowError):
        if 1e-300 < (size := abs(float(value))) < 1e300:
            return round(math.log10(size), 6)
    shift = value.numerator.bit_length() - value.denominator.bit_length()
    return round(shift * math.log10(2) + math.log10(abs(value) / Fraction(2) ** shift), 6)


def native(text: str, precision: Precision) -> Any:
    """The number of ``precision`` from :func:`native_text`; "-0" is the negative zero."""
    value = number(exact(text), precision)
    return -value if value == 0 and text.startswith("-") else value


def native_text(value: Any, precision: Precision) -> str:
    """Decimal text that determines a number of ``precision``, or ``nan``, ``inf`` or ``-inf``."""
    import numpy

    if not numpy.isfinite(value):
        return str(value)
    return decimal_text(exact(value), precision.digits)


# Cached results of functions.


P = ParamSpec("P")
Result = TypeVar("Result")


def cache_last_call(function: Callable[P, Result]) -> Callable[P, Result]:
    """``function`` of immutable arguments, with a cache of its last result, valid for identical argument objects.

    Calls with keywords and exceptions are not cached.  Thread-safe: at worst each thread computes the result.
    """
    cached: tuple[tuple[Any, ...], Any] | None = None

    @wraps(function)
    def cached_function(*arguments: P.args, **named: P.kwargs) -> Result:
        nonlocal cached
        if named:
            return function(*arguments, **named)
        last = cached
        if last is not None and len(last[0]) == len(arguments) and all(map(is_, last[0], arguments)):
            value: Result = last[1]
            return value
        value = function(*arguments, **named)
        cached = arguments, value
        return value

    return cached_function


class OncePerArguments(Generic[Result]):
    """A function that is called once for equal arguments; other threads wait for the result.

    results: by the arguments.  Exceptions are not cached.
    """

    def __init__(self, function: Callable[..., Result]) -> None:
        self.function = function
        self.results: dict[tuple[Any, ...], Result] = {}
        self._locks: dict[tuple[Any, ...], RLock] = {}

    def __call__(self, *arguments: Any) -> Result:
        if arguments not in self.results:
            with self._locks.setdefault(arguments, RLock()):
                if arguments not in self.results:
                    self.results[arguments] = self.function(*arguments)
        return self.results[arguments]


# Vectors of three exact numbers, and their products over any ring.


class Ring(Protocol):
    """The arithmetic of the algebra of tops: of Fraction, float, ball, array, and expressions of heyoka and sympy."""

    def __add__(self, other: Self, /) -> Self: ...
    def __sub__(self, other: Self, /) -> Self: ...
    def __mul__(self, other: Self, /) -> Self: ...
    def __rmul__(self, other: int, /) -> Self: ...
    def __truediv__(self, other: int, /) -> Self: ...


class OrderedRing(Ring, Protocol):
    """Real numbers, which can be approximated by a float."""

    def __sub__(self, other: Self | int, /) -> Self: ...
    def __truediv__(self, other: Self | int, /) -> Self: ...
    def __radd__(self, other: int, /) -> Self: ...
    def __rsub__(self, other: int, /) -> Self: ...
    def __rtruediv__(self, other: int, /) -> Self: ...
    def __neg__(self) -> Self: ...
    def __float__(self) -> float: ...


Scalar = TypeVar("Scalar", bound=Ring)
"""The ring of the arguments and the result."""
Real = TypeVar("Real", bound=OrderedRing)
Vector = tuple[Fraction, Fraction, Fraction]
MOST_MEMBERS = 10_000_000
"""The most members of a list; a generator may be infinite."""


def vector(values: Iterable[Any], what: str) -> Vector:
    """Three exact rationals of components that :func:`exact` reads; raises InputError otherwise."""
    parts = ordered(values, what, "Give three numbers, such as (3, 2, 1).")
    if len(parts) != 3:
        raise InputError(f"{argument(what)} must have 3 numbers; got {len(parts)}.", "Give x,y,z.")
    try:
        first, second, third = (exact(part) for part in parts)
    except InputError as error:
        raise InputError(f"{argument(what)}: {error.cause}", error.remedy) from None
    return first, second, third


def ordered(values: Any, what: str, remedy: str) -> list[Any]:
    """The members of a list, a tuple, an array or another iterable with an order of its own.

    Raises InputError for text, whose characters are not a list of numbers, sets, mappings, and anything else.
    """
    if not isinstance(values, str | bytes | bytearray | Set | Mapping):
        try:
            # a table iterates over the names of its columns, some arrays over scalars of their own
            if hasattr(values, "__array__") and (hasattr(values, "columns") or _is_foreign(next(iter(values), 0))):
                import numpy

                values = numpy.asarray(values)
            members = list(islice(values, MOST_MEMBERS + 1))
            if len(members) > MOST_MEMBERS:
                raise InputError(f"{what} has more than {MOST_MEMBERS} members.", remedy)
            return members
        except HeavyTopError:
            raise
        except Exception:  # not iterable: an array without dimensions, a generator that fails
            pass
    raise refusal(what, "a list", quoted(values), remedy)


def _is_foreign(member: Any) -> bool:
    """Whether a member of an array is neither a number nor a row."""
    if isinstance(member, list | tuple) or getattr(member, "shape", None):
        return False
    try:
        exact(member)
    except InputError:
        return True
    return False


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """a · b over any ring."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Scalar], b: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """a × b over any ring."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def square_root(value: Fraction, bits: int) -> Fraction:
    """The square root of a positive rational, relatively within some 2^-bits."""
    shift = bits + max(0, value.denominator.bit_length() - value.numerator.bit_length()) // 2
    return Fraction(isqrt((value.numerator << 2 * shift) // value.denominator), 1 << shift)


def rational_root(square: Fraction) -> Fraction | None:
    """√square if that is rational, else None."""
    if square < 0:
        return None
    root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
    return root if root * root == square else None
