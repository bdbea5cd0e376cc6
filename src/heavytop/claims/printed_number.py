"""A number as it stands in print: its value, the unit of its last digit, and how many of its digits are right."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction

from heavytop.errors import InputError, quoted

_DECIMAL = re.compile(r"[+-]?(?P<whole>[0-9]*)(?:\.(?P<part>[0-9]*))?(?:[eEdD](?P<power>[+-]?[0-9]{1,5}))?")
_MINUS = "\N{MINUS SIGN}"
_MOST_DIGITS = 1_000
_LARGEST_POWER = 9_000
_REMEDY = "Write it as it is printed, as text: a decimal such as 0.450, -1.5e-3 or 12; its zeros at the end count."


@dataclass(frozen=True, slots=True)
class PrintedNumber:
    """A decimal number with so many digits written; zeros at the end count, those at the front do not.

    text: as it is printed.  unit: of the last digit.  digits: from the first that is not 0; of 0.000 all of them.
    """

    text: str
    value: Fraction
    unit: Fraction
    digits: int

    @classmethod
    def read(cls, text: str, what: str) -> PrintedNumber:
        """Raises InputError for what is no decimal number, and for one of more than 1000 digits or beyond 1e±9000."""
        plain = text.strip().replace(_MINUS, "-")
        found = _DECIMAL.fullmatch(plain)
        whole, part = (found["whole"], found["part"] or "") if found is not None else ("", "")
        if found is None or not whole + part:
            raise InputError(f"{what}: {quoted(text)} is no decimal number.", _REMEDY)
        power = int(found["power"] or 0)
        if len(whole + part) > _MOST_DIGITS or abs(power) > _LARGEST_POWER:
            raise InputError(
                f"{what}: {quoted(text)} is too long a number.",
                f"Give at most {_MOST_DIGITS} digits, and exponents up to {_LARGEST_POWER}.",
            )
        unit = Fraction(10) ** (power - len(part))
        size = int(whole + part)
        digits = len(str(size)) if size else len(part) + 1
        return cls(text.strip(), (-size if plain.startswith("-") else size) * unit, unit, digits)

    def right(self, error: Fraction) -> int:
        """How many digits are right of a number that is off by ``error`` ≥ 0: the most that are so to half a unit."""
        room = self.unit / 2
        count = self.digits
        while count and error > room:
            count, room = count - 1, room * 10
        return count

    @property
    def half_unit(self) -> Fraction:
        """Half a unit of the last digit: by so much the true number may be off and be printed so."""
        return self.unit / 2
