"""Exact values of numbers written by other programs, and the format that they were written from."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, prefixed, refusal
from heavytop.precision import DOUBLE, EXTENDED, QUAD, Precision, decimal_text, exact, real, round_to

_HEX = re.compile(r"([+-]?)0[xX](?=\.?[0-9a-fA-F])([0-9a-fA-F]*)\.?([0-9a-fA-F]*)(?:[pP]([+-]?[0-9]{1,6}))?")
_NOT_FINITE = re.compile(r"[+-]?(nan(\([^)]*\))?|inf|infinity|1\.?#(inf|ind|qnan|snan)\d*)", re.IGNORECASE)
_FORTRAN = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[dDqQ]|(?=[+-]\d{3,}$))([+-]?\d+)")
"""1.5D+00, 1.5Q+00, and 1.5-101, where the exponent leaves no room for the letter."""
_PLAIN = re.compile(r"[+-]?\d{1,40}(\.\d{0,40})?([eE][+-]?\d{1,3})?")
"""Most numbers; all of these are within the limits."""
_WIDEST = 20_000
"""The largest exponent of 2 in a file: quad has 16,384, and larger powers take minutes."""
_REMEDY = "`heavytop docs score` describes both file formats."
_SAMPLE = 600
"""The most numbers from which the format is inferred."""


def number(value: Any, what: str) -> Fraction | None:
    """The exact number of decimal or hexadecimal text; None for NaN and infinities; raises InputError for others."""
    if not isinstance(value, str):
        raise InputError(f"{what} must be a number; got a {type(value).__name__}.", _REMEDY)
    text = value.strip()
    if not text:
        raise InputError(f"{what} is empty.", "Give every row all columns, and nan for a missing number.")
    if _PLAIN.fullmatch(text):
        return exact(text)
    if _NOT_FINITE.fullmatch(text):
        return None
    hexadecimal, fortran = _HEX.fullmatch(text), _FORTRAN.fullmatch(text)
    if hexadecimal is not None:
        sign, integer, part, power = hexadecimal.groups()
        fraction = Fraction(int(f"{sign}{integer}{part}", 16)) * Fraction(2) ** (int(power or 0) - 4 * len(part))
    else:
        with prefixed(what):
            fraction = exact(f"{fortran[1]}e{fortran[2]}" if fortran else text)
    if fraction and abs(fraction.numerator.bit_length() - fraction.denominator.bit_length()) > _WIDEST:
        raise InputError(f"{what} must be 0 or of size 2^-{_WIDEST} to 2^{_WIDEST}; got {text[:60]!r}.", _REMEDY)
    return fraction


def finite(value: Any, what: str) -> Fraction:
    """A finite number; raises InputError also for NaN and infinities."""
    parsed = number(value, what)
    if parsed is None:
        raise refusal(what, "finite", value.strip(), "Give a finite number.")
    return parsed


def format_of(texts: Iterable[str]) -> Precision:
    """The narrowest format from which every number may have been printed.

    A program may print more digits than its format has: 0.1000000000000000056 is a double in 19 digits, because the
    nearest double has these digits.
    """
    numbers = list(texts)
    bits = max((bits_of(text) for text in numbers), default=0)
    sample = numbers[:: max(1, len(numbers) // _SAMPLE)]
    for form in (DOUBLE, EXTENDED, QUAD):
        if bits <= form.bits or all(_is_printed_from(text, form) for text in sample):
            return form
    return real(bits)


def of_bits(bits: int) -> Precision:
    """The narrowest format with as many bits."""
    return next((form for form in (DOUBLE, EXTENDED, QUAD) if bits <= form.bits), None) or real(bits)


def bits_of(text: str) -> int:
    """Bits of the format of a number: its own if hexadecimal, else those that its decimal digits correspond to."""
    if _HEX.fullmatch(text.strip()):
        value = number(text, "a number") or Fraction(0)
        return (value.numerator // (value.numerator & -value.numerator)).bit_length() if value else 0
    digits = digits_written(text)
    return next((form.bits for form in (DOUBLE, EXTENDED, QUAD) if digits <= form.digits), 0) or int(
        (digits - 1) / math.log10(2)
    )


def digits_written(text: str) -> int:
    """Significant digits of a decimal number."""
    return len(re.sub(r"[eEdDqQ].*|(?<=[\d.])[+-].*|[^0-9]", "", text).lstrip("0"))


def _is_printed_from(text: str, form: Precision) -> bool:
    """Whether the number, rounded to the format and printed with as many digits, is unchanged."""
    value = number(text, "a number")
    if not value:
        return True
    if _HEX.fullmatch(text.strip()) or "/" in text:
        return round_to(value, form.bits) == value
    return Fraction(decimal_text(round_to(value, form.bits), max(digits_written(text), 1))) == value
