"""The times at which a motion is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Decimal
from fractions import Fraction
from operator import lt
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import exact, exact_text, physical, shown
from heavytop.top.vectors import MOST_MEMBERS, ordered

_SMALL, _LARGE = 1e-300, 1e149
"""Between them a nearest double is rounded relatively, and no time is too large."""
_LONGEST = 60
"""Digits of a time that is written as a decimal; a fraction is shorter than a longer one."""


class TimeText(str):
    """A time as exact text, as it was given: ``12345.678``, ``1e3`` or ``1/3``.

    ``float`` of it is the nearest double, ``Fraction`` of it the number itself.
    """

    __slots__ = ()

    def __float__(self) -> float:
        return float(exact(str(self)))

    @classmethod
    def of(cls, value: Any) -> TimeText:
        """The text of a time.

        Text stays as it is; of a float and of any other number the exact decimal, where it has one of up to 60 digits,
        else the fraction.  Raises InputError for what is not a number.
        """
        number = exact(value)
        if isinstance(value, str):
            return cls(value.strip())
        if isinstance(value, Decimal):
            return cls(str(value))
        if isinstance(value, Fraction):
            return cls(exact_text(value))
        twos = (number.denominator & -number.denominator).bit_length() - 1
        places = twos  # of a binary number; of any other the division below leaves a rest
        if number.denominator != 1 << twos or places > _LONGEST:
            return cls(exact_text(number))
        digits = abs(number.numerator) * 5**places
        text = str(Decimal(digits)).rjust(places + 1, "0")
        text = f"{text[: len(text) - places]}.{text[len(text) - places :]}" if places else text
        return cls(f"-{text}" if number < 0 else text)


class CheckedTimes(list[Fraction]):
    """Exact times that were checked.

    doubles: the nearest to each; empty where these alone do not show that the times are in order.
    """

    doubles: list[float]


class RoundedTimes(Sequence[Fraction]):
    """Times that were rounded to a format: numbers of it, each made exact when it is asked for."""

    __slots__ = ("numbers",)

    def __init__(self, numbers: Sequence[Any]) -> None:
        self.numbers = numbers

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, place: Any) -> Any:
        found = self.numbers[place]
        return tuple(map(exact, found)) if isinstance(place, slice) else exact(found)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, tuple | list | RoundedTimes) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))


class DoubleTimes(RoundedTimes):
    """Times that were given as doubles and checked.

    doubles: an array of them.
    """

    __slots__ = ()
    are_doubles = True

    @property
    def doubles(self) -> Any:
        return self.numbers


def check_times(times: Iterable[Any]) -> CheckedTimes | DoubleTimes:
    """Exact times; raises InputError unless they are of one sign and strictly monotone away from 0."""
    if isinstance(times, CheckedTimes | DoubleTimes):
        return times
    doubles = _as_doubles(times)
    if doubles is not None:
        return DoubleTimes(doubles)
    given = ordered(times, "times", "Give a list such as [1, 2, 5].")
    values = CheckedTimes(given if set(map(type, given)) == {Fraction} else map(exact, given))
    values.doubles = _in_order(values)
    if not values.doubles:
        _check_each(values)
    return values


def _as_doubles(times: Any) -> Any:
    """An array of the times where they are doubles and, as they stand, in order; None where each is to be looked at."""
    import numpy

    floats = isinstance(times, list | tuple) and set(map(type, times)) == {float}
    if not floats and not (isinstance(times, numpy.ndarray) and times.dtype == numpy.float64 and times.ndim == 1):
        return None
    found = numpy.array(times, dtype=numpy.float64)
    if not 0 < len(found) <= MOST_MEMBERS:
        return None
    sizes = found if found[-1] > 0 else -found
    far = (sizes[0] > _SMALL or sizes[0] == 0) and sizes[-1] < _LARGE
    return found if far and bool((sizes[1:] > sizes[:-1]).all()) else None


def _in_order(values: list[Fraction]) -> list[float]:
    """The nearest doubles, where they are of one sign, grow strictly and are far from the ends of the doubles.

    What is rounded to different doubles is in their order, so these times need not be compared.
    """
    try:
        doubles = [above / below for above, below in map(Fraction.as_integer_ratio, values)]
    except OverflowError:
        return []
    sizes = doubles if doubles and doubles[-1] > 0 else [-value for value in doubles]
    # 0 itself may come first
    far = bool(sizes) and (sizes[0] > _SMALL or not values[0]) and sizes[-1] < _LARGE
    return doubles if far and all(map(lt, sizes, sizes[1:])) else []


def _check_each(values: list[Fraction]) -> None:
    for value in values:
        physical(value, "a time")
    if not values:
        raise InputError("No times were given.", "Give at least one, such as 1, 2, 5.")
    for earlier, later in zip([Fraction(0), *values], values, strict=False):
        if earlier * later < 0:
            raise InputError(
                f"The times {shown(earlier)} and {shown(later)} have different signs.", "Run each direction by itself."
            )
        if abs(later) <= abs(earlier) and (later or earlier):
            raise InputError(
                f"The time {shown(later)} does not come after {shown(earlier)}.",
                "Times go strictly away from 0, each once.",
            )
    if values.count(Fraction(0)) > 1:
        raise InputError("The time 0 is given more than once.", "Times go strictly away from 0, each once.")
