"""The times at which a motion is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from operator import lt
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import exact, physical, shown
from heavytop.top.heavy_top import ordered

_SMALL, _LARGE = 1e-300, 1e149
"""Between them a nearest double is rounded relatively, and no time is too large."""


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
        return isinstance(other, tuple | RoundedTimes) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))


def check_times(times: Iterable[Any]) -> CheckedTimes:
    """Exact times; raises InputError unless they are of one sign and strictly monotone away from 0."""
    if isinstance(times, CheckedTimes):
        return times
    given = ordered(times, "times", "Give a list such as [1, 2, 5].")
    values = CheckedTimes(given if set(map(type, given)) == {Fraction} else map(exact, given))
    values.doubles = _in_order(values)
    if not values.doubles:
        _check_each(values)
    return values


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
