"""Conversions of balls to the numbers of a report, and of native numbers to balls."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial, reduce
from math import isfinite
from sys import float_info
from typing import Any

import numpy
from flint import arb
from numpy.typing import NDArray

from heavytop.errors import InputError
from heavytop.exact.flint.balls import ball, midpoint, radius, radius_text
from heavytop.precision import Precision, decimal_text, exact, log10, round_to
from heavytop.records import Metric, MetricKind, Quantity, Row

DIGITS = 8
UNRESOLVED = "unresolved"
GUARD_BITS = 64
RESOLVED_RADII = 10
_SURELY_RESOLVED = 8
_ZERO = arb(0)
_WIDE = ("longdouble", "real128", "real")


def to_ball(value: Any) -> arb:
    """A native number as a ball of radius 0 (working precision permitting); NaN, infinities and balls stay."""
    if isinstance(value, arb):
        return value
    if isinstance(value, float):
        return arb(float(value))
    if (converted := _by_doubles(value)) is not None:
        return converted
    try:
        return ball(exact(value))
    except InputError:
        return arb("nan")


def to_balls(state: Sequence[Any]) -> list[arb]:
    """:func:`to_ball` of each number of a state; of doubles Python's own take a third of the time."""
    return [to_ball(value) for value in (state.tolist() if isinstance(state, numpy.ndarray) else state)]


def _by_doubles(value: Any) -> arb | None:
    """A wide native float as an exact sum of doubles; None for other numbers, and beyond the range of doubles."""
    if type(value).__name__ not in _WIDE:
        return None
    total, remainder = arb(0), value
    while part := float(remainder):
        if not isfinite(part):
            return None
        total, remainder = total + arb(part), remainder - part
    return total if remainder == 0 else None


def resolved(value: arb) -> bool:
    """Whether |value| is at least ten times its radius, or exactly 0."""
    # at that relative accuracy |value| exceeds 64 radii
    if value.rel_accuracy_bits() >= _SURELY_RESOLVED:
        return bool(value.is_finite())
    return bool(value.is_finite()) and abs(midpoint(value)) >= RESOLVED_RADII * radius(value)


def decided(value: arb) -> bool:
    """Whether all numbers in a ball have the same :func:`text`."""
    if not resolved(value):
        return False
    middle, wide = midpoint(value), radius(value)
    return decimal_text(middle - wide, DIGITS) == decimal_text(middle + wide, DIGITS)


def text(value: arb, digits: int = DIGITS) -> str:
    """A ball as report text: decimal, ``nan`` or ``unresolved``."""
    if not value.is_finite():
        return "nan"
    return decimal_text(midpoint(value), digits) if resolved(value) else UNRESOLVED


def metric(value: arb, kind: MetricKind = "error", digits: int = DIGITS) -> Metric:
    """A ball as a metric."""
    words = text(value, digits)
    if words == "nan":
        return Metric(words, None, kind)
    if words == UNRESOLVED:
        return Metric(words, None, kind, radius_text(abs(midpoint(value)) + radius(value)))
    return of_fraction(Fraction(words), kind, words)


def of_fraction(value: Fraction, kind: MetricKind = "error", words: str | None = None) -> Metric:
    """An exact number as a metric; log10 to six decimals."""
    return Metric(words or decimal_text(value, DIGITS), log10(value), kind)


def larger(first: arb, second: arb) -> arb:
    """The ball around the larger value: one of the two if they are disjoint, without FLINT's slower maximum."""
    if first > second:
        return first
    return second if second > first else first.max(second)


def root(value: arb) -> arb:
    """√value of a ball that encloses a nonnegative number, and may extend below 0."""
    return value.sqrt() if value >= 0 else value.abs_upper().sqrt().union(arb(0))


def largest(values: Iterable[arb]) -> arb:
    """The ball around max |value|."""
    return reduce(larger, map(abs, values), _ZERO)


# Correct digits of a motion: one definition for every table, page and document.


RELATIVE = Quantity("solution_error", "relative", "max")
"""The metric behind the digits right: the largest |error|/max(1, |true value|) of a component of Ω or γ over the
samples."""

_ONE = arb(1)


def relative_error(errors: Sequence[arb], truth: Sequence[arb]) -> arb:
    """The largest |error|/max(1, |true value|) over the components of one state, at the working precision."""
    sizes = map(abs, truth)
    return largest(error if size < _ONE else error / size.max(_ONE) for error, size in zip(errors, sizes, strict=True))


def digits_kept(row: Row) -> float | None:
    """:func:`digits_right`, rounded to two decimals."""
    right = digits_right(row)
    return None if right is None else round(right, 2)


def digits_right(row: Row) -> float | None:
    """−log10 of the largest |error|/max(1, |true value|) over the samples and the components of Ω and γ.

    At most the digits of the format.  If the reference does not resolve the error, the digits that are proven.
    For an ensemble, from the root mean square over the starts of the maximum of each.
    0 if an error is as large as the value, and if the format has lost all significant digits before the end.
    None without a reference, without a sample, and for a value that is not finite.
    """
    metric = row.metrics.get(RELATIVE.text)
    if metric is None or (metric.log10 is None and metric.bound is None and metric.value != "0"):
        return None
    if row.reference.until:
        return 0.0
    format_digits = row.bits * math.log10(2)
    return format_digits if metric.size is None else min(format_digits, max(0.0, -metric.size))


def digits_text(kept: float) -> str:
    """Digits right as text, with one decimal."""
    return f"{kept:.1f}"


def digits_of(bits: int) -> int:
    """Decimal digits of a format with so many bits: 16 in double, 34 in quad."""
    return round(bits * math.log10(2))


# The rounding of written states, inferred from the numbers themselves.


_SPARE = 3
"""A rounding is to at least so many digits fewer than the format has."""
LEAST = 12
"""The fewest numbers from which a rounding is inferred."""
_SINGLE = 24
_FINER = 2
"""Decimals of single-precision numbers are finer than single precision by at least this factor."""
EXPLAINS = 1.5
"""An error is due to rounding if it is at most so many times the largest rounding error, ..."""
_PART = 0.01
"""... and at least this fraction of it: an exact short number has not been rounded."""


@dataclass(frozen=True, slots=True)
class Rounding:
    """A rounding common to all states.

    kind: "significant" digits, "decimals" after the point, or "single" precision.  digits: how many, 24 bits for the
    last.  error: the largest rounding of a component, relative to max(1, |value|).
    """

    kind: str
    digits: int
    error: float

    def spacing(self, values: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
        """The distance of neighbouring rounded numbers at each value."""
        if self.kind == "decimals":
            return numpy.full_like(values, 10.0**-self.digits)
        base = 2.0 if self.kind == "single" else 10.0
        size = numpy.maximum(numpy.abs(values), float_info.min)
        return numpy.where(values == 0, 0.0, base ** (numpy.floor(numpy.log(size) / numpy.log(base)) + 1 - self.digits))


def roundings(states: Sequence[Sequence[Fraction]], precision: Precision, least: int = LEAST) -> list[Rounding]:
    """The roundings common to all numbers, the coarsest first; none for fewer numbers than ``least``."""
    numbers = [value for state in states for value in state if value]
    return sorted(_roundings(numbers, precision), key=lambda r: -r.error) if len(numbers) >= least else []


def explains(rounding: Rounding, error: float) -> bool:
    """Whether an error, relative to max(1, |value|), has the size of the rounding error."""
    return _PART * rounding.error <= error <= EXPLAINS * rounding.error


def _roundings(numbers: Sequence[Fraction], precision: Precision) -> Iterator[Rounding]:
    largest = min(Fraction(1), max(map(abs, numbers)))
    worst, leading = float(largest), 10.0 ** math.floor(log10(largest) or 0)  # place of the first digit
    written: list[Callable[[Fraction], Fraction]] = [lambda value: value]
    single = Rounding("single", _SINGLE, worst * 2.0**-_SINGLE)
    kinds: dict[str, tuple[Callable[..., Fraction], float]] = {
        "decimals": (lambda value, digits: Fraction(round(value * 10**digits), 10**digits), 0.5),
        "significant": (lambda value, digits: Fraction(decimal_text(value, digits)), 5 * leading),
    }
    for kind, (rounded_to, scale) in kinds.items():
        for digits in range(1, precision.digits - _SPARE):
            if all(round_to(rounded_to(value, digits), precision.bits) == value for value in numbers):
                rounding = Rounding(kind, digits, scale * 10.0**-digits)
                yield rounding
                written += [partial(rounded_to, digits=digits)] * (_FINER * rounding.error < single.error)
                break
    for write in written if precision.bits > _SINGLE else ():
        if all(round_to(write(round_to(value, _SINGLE)), precision.bits) == value for value in numbers):
            yield single
            break
