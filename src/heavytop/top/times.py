"""The times at which a motion is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import exact, physical, shown
from heavytop.top.heavy_top import ordered


def check_times(times: Iterable[Any]) -> list[Fraction]:
    """Exact times; raises InputError unless they are of one sign and strictly monotone away from 0."""
    values = [physical(exact(time), "a time") for time in ordered(times, "times", "Give a list such as [1, 2, 5].")]
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
    return values
