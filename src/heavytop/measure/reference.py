"""The library call behind ``heavytop reference``: proven states as decimal text, with the radius of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import msgspec

from heavytop.errors import InputError, OutOfReach
from heavytop.exact.balls import value_text
from heavytop.exact.catalogue import find
from heavytop.exact.scales import require_handy
from heavytop.exact.solution import ExactSolution
from heavytop.measure.certify import bits_of
from heavytop.precision import exact, exact_text, shown
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
    """The states at ``times`` to ``digits`` digits: each within 10^-digits, relative above 1 and absolute below.

    times: exact numbers in any order.  digits: 1 to 20,000.
    Raises InputError for other digits, for a time that is not a finite rational, and where the system does not admit
    the start; OutOfReach where the digits cannot be proven, and for numbers of more than 9,000 digits.
    """
    if digits not in DIGITS:
        raise InputError(f"{digits} digits are not available.", "References have 1 to 20000 digits.")
    instants = [exact(time) for time in times]
    require_handy(top, start, instants)
    solution = finder(top, start, system)
    return Reference(
        method=solution.method,
        digits=digits,
        times=[exact_text(time) for time in instants],
        states=[ball_texts(solution, time, digits) for time in instants],
        system=system.name,
    )


def ball_texts(solution: ExactSolution, time: Fraction, digits: int) -> list[Ball]:
    """The six balls at ``time`` as text.

    One significant digit more than ``digits`` is printed: rounded to ``digits`` of them, a value such as 1.04 may be
    wrong by five units of the digit that was promised.  Raises OutOfReach where a printed radius exceeds 10^-digits,
    relative to a value above 1.
    """
    found = [Ball(*value_text(value, digits + 1)) for value in solution.state(time, bits_of(digits))]
    for component, ball in enumerate(found, 1):
        if exact(ball.radius) > Fraction(1, 10**digits) * max(Fraction(1), abs(exact(ball.value))):
            raise OutOfReach(
                f"Component {component} at t = {shown(time)} is known within {ball.radius} only, not to {digits} "
                f"digits, by {solution.method}.",
                "Ask for fewer digits.",
            )
    return found
