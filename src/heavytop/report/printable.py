"""Names of any origin as text that terminals, XML and pictures can show."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

from heavytop.errors import InputError
from heavytop.precision import decimal_text, exact

_NO_SHAPE = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str) -> str:
    """Text with U+FFFD for control characters other than tabs and line breaks, and for what XML 1.0 does not have."""
    return _NO_SHAPE.sub("\ufffd", text)


def short(value: str, digits: int = 3) -> str:
    """A metric's text with few digits; words stay as they are."""
    try:
        number = exact(value)
    except InputError:
        return value
    if number == 0:
        return "0"
    if Fraction(1, 1000) <= abs(number) < 10**5:
        return f"{float(number):.{digits + 2}g}"
    text = f"{Decimal(decimal_text(number, digits)):.{digits - 1}E}"
    mantissa, _, exponent = text.partition("E")
    if exact(text) == number:  # a time such as 10^6 has no more digits
        mantissa = mantissa.rstrip("0").removesuffix(".")
    return f"{mantissa}e{int(exponent)}"
