"""Signs of numbers as far as they are known, and what follows for products and sums."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from heavytop.errors import HeavyTopError

NUMBER_BITS = 512
"""Of the balls of generators that are numbers."""


class Unprovable(HeavyTopError):
    """An expression that the exact algebra cannot carry: it leaves the verdict to the balls, and so undecided."""


class Sign(NamedTuple):
    """value: 1 for >= 0, -1 for <= 0, 0 for unknown.  strict: never 0 (also where the value is unknown)."""

    value: int
    strict: bool

    def times(self, other: Sign) -> Sign:
        """The sign of a product."""
        return Sign(self.value * other.value, self.strict and other.strict)


UNKNOWN = Sign(0, False)
PLUS = Sign(1, True)


def sum_of(signs: Iterable[Sign]) -> Sign:
    """The sign of a sum: that of its parts where they have one and the same."""
    values, strict = set(), False
    for value, part_strict in signs:
        values.add(value)
        strict = strict or part_strict
        if len(values) > 1 or value == 0:
            return UNKNOWN
    return Sign(values.pop(), strict) if values else Sign(1, False)


def used(p: Any) -> set[int]:
    """The generators that occur in a polynomial."""
    return {index for index, degree in enumerate(p.degrees()) if degree > 0}
