"""The library call behind ``heavytop reference``: proven states as decimal text, with the radius of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import msgspec

from heavytop.display import Table, Tabular, path_picture
from heavytop.errors import InputError, OutOfReach, quoted
from heavytop.exact.attitude import attitude_of
from heavytop.exact.balls import radius_text, value_text
from heavytop.exact.catalogue import find
from heavytop.exact.scales import require_handy
from heavytop.exact.solution import ExactSolution
from heavytop.measure.certify import bits_of
from heavytop.precision import decimal_text, exact, exact_text, shown
from heavytop.top.equations import HEAVY_TOP, NAMES, System
from heavytop.top.heavy_top import HeavyTop, State

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

DIGITS = range(1, 20001)
_SHOWN = 15
"""Digits of a value in a table; all of them are in :meth:`Reference.texts`."""

Finder = Callable[[HeavyTop, State, System], ExactSolution]
Evaluate = Callable[[Fraction, int], Sequence[Any]]


class Ball(msgspec.Struct, frozen=True):
    """A value and a radius, as decimal text: the true number is within the radius of the printed value."""

    value: str
    radius: str


class Reference(Tabular, msgspec.Struct, frozen=True, omit_defaults=True):
    """Proven states; its JSON is that of ``heavytop reference``.

    times: exact, as decimals or fractions.  states: Ω1 Ω2 Ω3 γ1 γ2 γ3 at each.
    attitude: on request, ξ1 ξ2 ξ3 at each; a unit vector fixed in space and ⟂ γ, in body components, which starts at
    :func:`heavytop.top.angles.perpendicular` of γ; attitude_method: how it is known.
    """

    method: str
    digits: int
    times: list[str]
    states: list[list[Ball]]
    system: str
    attitude: list[list[Ball]] | None = None
    attitude_method: str | None = None

    def texts(self) -> list[list[str]]:
        """The values as decimal text, shape (n, 6)."""
        return [[ball.value for ball in state] for state in self.states]

    def to_numpy(self) -> NDArray[np.float64]:
        """The values rounded to double, shape (n, 6)."""
        import numpy

        return numpy.array([[float(ball.value) for ball in state] for state in self.states])

    def radii(self) -> NDArray[np.float64]:
        """The radii rounded up to double, shape (n, 6): they stay upper bounds, and none but 0 becomes 0."""
        import numpy

        return numpy.array([[rounded_up(ball.radius) for ball in state] for state in self.states])

    def _repr_html_(self) -> str:
        states, caption = self.states, "γ, the vertical in body axes, on the unit sphere"
        picture = path_picture(len(states), lambda place: [ball.value for ball in states[place][3:6]], caption)
        return self._table().html() + picture

    def _table(self) -> Table:
        worst = max((Fraction(ball.radius) for state in self.states for ball in state), default=Fraction(0))
        rows = [
            [time[:_SHOWN], *(decimal_text(Fraction(ball.value), min(_SHOWN, self.digits)) for ball in state)]
            for time, state in zip(self.times, self.states, strict=True)
        ]
        title = f"{self.system}, known to {self.digits} digits: {self.method}"
        return Table(title, ("t", *NAMES), rows, [f"largest radius {radius_text(worst)}"])


def rounded_up(text: str) -> float:
    """A decimal text as the nearest double that is not less."""
    value = float(text)
    return value if Fraction(value) >= Fraction(text) else math.nextafter(value, math.inf)


def reference(
    top: HeavyTop,
    start: State,
    times: Sequence[Any],
    digits: int,
    system: System = HEAVY_TOP,
    finder: Finder = find,
    attitude: bool = False,
) -> Reference:
    """The states at ``times`` to ``digits`` digits: each within 10^-digits, relative above 1 and absolute below.

    times: exact numbers in any order.  digits: 1 to 20,000.  attitude: give ξ too.
    Raises InputError for other digits, for a time that is not a finite rational, and where the system does not admit
    the start; OutOfReach where the digits cannot be proven, and for numbers of more than 9,000 digits.
    """
    if digits not in DIGITS:
        raise InputError(f"{quoted(digits)} digits are not available.", "References have 1 to 20000 digits.")
    instants = [exact(time) for time in times]
    require_handy(top, start, instants)
    solution = finder(top, start, system)
    latest = max(instants, key=abs, default=Fraction(0))
    method, xi = attitude_of(solution, latest, bits_of(digits)) if attitude else (None, None)
    return Reference(
        method=solution.method,
        digits=digits,
        times=[exact_text(time) for time in instants],
        states=[ball_texts(solution.state, solution.method, time, digits) for time in instants],
        system=system.name,
        attitude=None if xi is None else [ball_texts(xi, str(method), time, digits) for time in instants],
        attitude_method=method,
    )


def ball_texts(evaluate: Evaluate, method: str, time: Fraction, digits: int) -> list[Ball]:
    """The balls of ``evaluate(time, bits)`` as text.

    One significant digit more than ``digits`` is printed: rounded to ``digits`` of them, a value such as 1.04 may be
    wrong by five units of the digit that was promised.  Raises OutOfReach where a printed radius exceeds 10^-digits,
    relative to a value above 1.
    """
    found = [Ball(*value_text(value, digits + 1)) for value in evaluate(time, bits_of(digits))]
    for component, ball in enumerate(found, 1):
        if exact(ball.radius) > Fraction(1, 10**digits) * max(Fraction(1), abs(exact(ball.value))):
            raise OutOfReach(
                f"Component {component} at t = {shown(time)} is known within {ball.radius} only, not to {digits} "
                f"digits, by {method}.",
                "Ask for fewer digits.",
            )
    return found
