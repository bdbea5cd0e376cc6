"""The library call behind ``heavytop reference``: proven states as decimal text, with the radius of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import msgspec

from heavytop.errors import InputError
from heavytop.exact.balls import value_text
from heavytop.exact.catalogue import find
from heavytop.exact.solution import ExactSolution
from heavytop.measure.certify import bits_of
from heavytop.precision import exact
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

DIGITS = range(1, 20001)

Finder = Callable[[HeavyTop, State, System], ExactSolution]


class Ball(msgspec.Struct, frozen=True):
    """A value and a radius, as decimal text: the true number is within the radius of the printed value."""

    value: str
    radius: str


class Reference(msgspec.Struct, frozen=True):
    """Proven states; its JSON is that of ``heavytop reference``.

    times: exact, as decimals or fractions.  states: Ω1 Ω2 Ω3 γ1 γ2 γ3 at each.
    """

    method: str
    digits: int
    times: list[str]
    states: list[list[Ball]]
    system: str


def reference(
    top: HeavyTop,
    start: State,
    times: Sequence[Any],
    digits: int,
    system: System = HEAVY_TOP,
    finder: Finder = find,
) -> Reference:
    """The states at ``times`` to ``digits`` digits (relative above 1, absolute below).

    times: exact numbers in any order.  digits: 1 to 20,000.
    Raises InputError for other digits, for a time that is not a finite rational, and where the system does not admit
    the start; OutOfReach where the digits cannot be proven.
    """
    if digits not in DIGITS:
        raise InputError(f"{digits} digits are not available.", "References have 1 to 20000 digits.")
    instants = [exact(time) for time in times]
    solution = finder(top, start, system)
    return Reference(
        method=solution.method,
        digits=digits,
        times=[str(time) for time in instants],
        states=[ball_texts(solution, time, digits) for time in instants],
        system=system.name,
    )


def ball_texts(solution: ExactSolution, time: Fraction, digits: int) -> list[Ball]:
    """The six balls at ``time`` as text with ``digits`` significant digits."""
    return [Ball(*value_text(value, digits)) for value in solution.state(time, bits_of(digits))]
