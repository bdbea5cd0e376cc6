"""A trajectory that another program computed, as it is scored: exact times, states rounded to its format."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy

from heavytop import written_numbers
from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import DOUBLE, EXTENDED, QUAD, Precision, decimal_text, exact, number, round_to, shown
from heavytop.top.equations import VARIABLES, System
from heavytop.top.heavy_top import HeavyTop, State, dot

if TYPE_CHECKING:
    from heavytop.suite.observed_given import Observed

MOST = 100_000
"""States that are scored."""
LONGEST_NAME = 200
_ODD_GAMMA = Fraction(1, 10)
"""A state whose |γ|² is off 1 by more is no rounding, and seldom a method."""
_FITS_ANYWHERE = 1 << 1023
"""Every format holds numbers below that."""
_SMALLEST, _LARGEST = Fraction(1, 1 << 1000), 1 << 1000
"""Between them a double has all its bits."""


@dataclass(frozen=True, slots=True)
class Given:
    """A trajectory as it was given.

    times: exact, as written.  states: six exact numbers each, rounded to the format; None for a state that is not
    finite.  name, integrator: as the row will call them.  flags: what else the file says.  sha256: of the file.
    format_guessed: whether the format was read off the digits written.  notes: what reading the file took for granted.
    observed: what it gives in place of Ω and γ in principal axes; the states are then all numbers of a row, and top and
    start are those in principal axes.
    """

    name: str
    integrator: str
    top: HeavyTop
    start: State
    system: System
    precision: Precision
    times: list[Fraction]
    states: list[tuple[Fraction, ...] | None]
    outcome: Outcome
    steps: int
    flags: dict[str, str]
    sha256: str
    format_guessed: bool = False
    notes: tuple[str, ...] = ()
    observed: Observed | None = None

    def warnings(self) -> list[str]:
        """What no rigid body can have, and a γ so far off the unit sphere that the columns may be in another order."""
        found = [*self.notes, *self.top.warnings()]
        if self.observed is not None:
            return found
        for time, state in zip(self.times, self.states, strict=True):
            if state is not None and abs(off := dot(state[3:], state[3:]) - 1) > _ODD_GAMMA:
                found.append(
                    f"|gamma|^2 is off 1 by {decimal_text(off, 3)} at t = {shown(time)}: "
                    f"are the states in the order {' '.join(VARIABLES)}?"
                )
                break
        return found


def of_arrays(
    top: HeavyTop,
    start: State,
    which: System,
    times: list[Fraction],
    rows: list[list[Any]],
    precision: Precision | None,
    name: str,
    integrator: str,
) -> Given:
    """A trajectory from memory: exact times, and states of six numbers each in any format or as text.

    precision: None for the narrowest format that holds every number as it is given.
    Raises InputError for what is no number, for counts that differ or are too large, for names that cannot be shown.
    """
    require_states(times, rows)
    form = precision or written_numbers.of_bits(max(bits_of(value) for row in rows for value in row))
    states = [rounded_state([component(value) for value in row], form) for row in rows]
    outcome = Outcome.NON_FINITE if None in states else Outcome.SUCCESS
    names = named(name, "name"), named(integrator, "integrator")
    return Given(*names, top, start, which, form, times, states, outcome, 0, {}, "")


def require_states(times: list[Fraction], rows: list[Any]) -> None:
    """Raises InputError unless there are as many states as times, and not too many."""
    if len(rows) != len(times):
        raise InputError(f"There are {len(times)} times and {len(rows)} states.", "Give one state for each time.")
    if len(times) > MOST:
        raise too_many(len(times))


def too_many(count: int) -> InputError:
    """What is said of so many states."""
    every = -(-count // MOST)
    return InputError(
        f"{count} states are too many to score.", f"Give at most {MOST} of them, such as one row in {every}."
    )


def component(value: Any) -> Fraction | None:
    """An exact number out of a number of any format or text; None for NaN and infinities."""
    if isinstance(value, str):
        return written_numbers.component(value)
    try:
        return exact(value)
    except InputError:
        if isinstance(value, float | Decimal | numpy.floating) or type(value).__name__ in ("real", "real128", "mpf"):
            return None
        raise


def bits_of(value: Any) -> int:
    """Bits of the format of a number in memory; of exact numbers, those that they are written with."""
    kind = type(value).__name__
    if kind in ("real128", "longdouble", "real"):
        return {"real128": QUAD.bits, "longdouble": EXTENDED.bits}.get(kind) or int(value.prec)
    exactly = isinstance(value, str | int | Fraction | Decimal) and not isinstance(value, bool)
    return written_numbers.bits_of(str(value)) if exactly else DOUBLE.bits


def named(text: str, what: str) -> str:
    """The text; raises InputError for one that is empty, too long or cannot be shown."""
    if not 0 < len(text) <= LONGEST_NAME or not text.isprintable():
        raise InputError(
            f"The {what} of {len(text)} characters begins {text[:40]!r}.",
            f"Use 1 to {LONGEST_NAME} printable characters.",
        )
    return text


def rounded_state(values: list[Fraction | None], precision: Precision) -> tuple[Fraction, ...] | None:
    """The numbers rounded to the format; None where one is not finite there, as 1e400 in double."""
    found = tuple(_rounded(value, precision) for value in values if value is not None)
    finite = len(found) == len(values) and all(_fits(value, precision) for value in found)
    return found if finite else None


def _rounded(value: Fraction, precision: Precision) -> Fraction:
    """As :func:`heavytop.precision.round_to`; the processor's own rounding where it does the same."""
    if precision is DOUBLE and _SMALLEST <= abs(value) < _LARGEST:
        return Fraction(float(value))
    return round_to(value, precision.bits)


def _fits(value: Fraction, precision: Precision) -> bool:
    if abs(value) < _FITS_ANYWHERE:
        return True
    try:
        number(value, precision)
    except InputError:
        return False
    return True
