"""Checks and conversions of the arguments of public functions; invalid ones raise InputError."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from heavytop import written_numbers
from heavytop.errors import ImpossibleBody, InputError, quoted, refusal
from heavytop.precision import (
    DOUBLE,
    EXTENDED,
    QUAD,
    Given,
    Precision,
    as_integer,
    cache_last_call,
    dot,
    exact,
    exact_text,
    ordered,
    parse,
    physical,
    require,
    shown,
    usable_tolerance,
    vector,
)
from heavytop.top.bodies import Body
from heavytop.top.equations import SYSTEMS, WHICH_SYSTEM, System, system_of
from heavytop.top.heavy_top import HeavyTop, State, require_physical

Number: TypeAlias = Given
"""A number: an integer, a float of any format (taken as the exact binary number), or exact text such as "-2/5"."""
Numbers: TypeAlias = Iterable[Any]
"""A list, a tuple or an array of :data:`Number`; type checkers take lists of several kinds for lists of anything."""

SLACK_BITS = 8
"""|γ|² − 1, |ξ|² − 1 and ξ·γ of rounded data may be as large as eps times 2 to this power."""
_MOST = 10**18
"""The largest limit; larger counts are reduced to it."""
_TYPES = "Give heavytop.HeavyTop(inertia, weight, centre) and heavytop.State(omega, gamma)."
_Kind = TypeVar("_Kind", HeavyTop, State)


def is_a(value: object, kind: type[_Kind], what: str) -> _Kind:
    """``value``, checked to be of type ``kind``."""
    if not isinstance(value, kind):
        raise refusal(what, f"a {kind.__name__}", quoted(value), _TYPES)
    return value


@cache_last_call
def motion(
    top: object, start: object, precision: Precision = DOUBLE, *, of_any_size: bool = False
) -> tuple[HeavyTop | Body, State]:
    """A top, or a body, and a start that is possible for it.

    of_any_size: for exact computations, which have no bounds.
    Raises InputError for other types, data beyond 1e150, and a γ that deviates from the unit sphere by more than
    rounding to ``precision``.
    """
    body: HeavyTop | Body = top if isinstance(top, Body) else is_a(top, HeavyTop, "top")
    state = is_a(start, State, "start")
    for text in body.warnings():
        warnings.warn(text, ImpossibleBody, stacklevel=_level_of_the_caller())
    if not of_any_size:
        require_physical(body.top if isinstance(body, Body) else body, state)
    return body, state.require_unit_gamma(slack_of(precision))


def _level_of_the_caller() -> int:
    """The ``stacklevel`` of a warning that names the calling line of the user."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    return level


def slack_of(precision: Precision) -> Fraction:
    """The allowed deviation from 1 or 0 due to rounded data: at least that of double, for every format of the run."""
    return max(precision.eps, DOUBLE.eps) * (1 << SLACK_BITS)


def system(value: System | str | None, *tops: HeavyTop | Body) -> System:
    """The system, or the one of that name; for None heavy_gyrostat if a top has a rotor, else heavy_top.

    Raises InputError for a system without rotor if a top has one.
    """
    if not (value is None or isinstance(value, str) or any(value is known for known in SYSTEMS)):
        raise refusal("system", "a name", quoted(value), f"Give {WHICH_SYSTEM}, as text.")
    return system_of(value, *tops)


def precision(value: Precision | str) -> Precision:
    """The format, or the one of that name; raises InputError if it does not exist, or this platform lacks it."""
    if not isinstance(value, Precision):
        return require(parse(value))
    precision_of_name = require(parse(value.name))
    if precision_of_name != value:
        raise InputError(f"Unknown precision {quoted(value)}.", "Use DOUBLE, EXTENDED, QUAD or real(BITS).")
    return precision_of_name


def any_times(values: Numbers) -> list[Fraction]:
    """Exact times in any order, at least one."""
    instants = [physical(value, "a time") for value in ordered(values, "times", "Give a list such as [1, 2, 5].")]
    if not instants:
        raise InputError("No times were given.", "Give at least one, such as 1, 2, 5.")
    return instants


def attitude(xi: Numbers | None, start: State, form: Precision) -> tuple[Fraction, ...] | None:
    """ξ: a unit vector ⟂ γ up to rounding; raises InputError for any other."""
    if xi is None:
        return None
    attitude_vector = vector(xi, "xi")
    slack = slack_of(form)
    for value, what in (
        (dot(attitude_vector, attitude_vector) - 1, "|xi|^2 - 1"),
        (dot(attitude_vector, start.gamma), "xi·gamma"),
    ):
        if abs(value) > slack:
            size = float(value) if abs(value) < 10**300 else float("inf")
            raise InputError(
                f"xi must be a unit vector perpendicular to gamma; {what} = {size:.6g}.",
                "Give the space axis x, in body axes.",
            )
    return attitude_vector


def tolerance(value: Number | None, form: Precision) -> Fraction | None:
    """An exact tolerance from the eps of the format to 1, or None for eps."""
    return None if value is None else usable_tolerance(value, form)


def positive(value: Number | None, what: str) -> Fraction | None:
    """A positive number, or None."""
    number = None if value is None else physical(value, what)
    if number is not None and number <= 0:
        raise refusal(what, "positive", shown(number), "Give a number above 0.")
    return number


def count(value: int | None, what: str) -> int | None:
    """A positive integer, or None."""
    if value is None:
        return None
    number = as_integer(value, what)
    if number < 1:
        raise refusal(what, "at least 1", quoted(number), "Give 1 or more, or leave it out.")
    return min(number, _MOST)


def steps(value: int | None) -> int | None:
    """A limit of steps, or None."""
    return count(value, "step_limit")


def limit(value: Number | None, what: str) -> str | None:
    """A number of a policy as text, or None."""
    if value is None:
        return None
    number = physical(value, what)
    return exact_text(number) if number == 0 or abs(number) > Fraction(1, 10**150) else "0"


def flag(value: bool | None, what: str) -> bool | None:
    """A bool, Python's or numpy's, or None."""
    if type(value).__name__ not in ("NoneType", "bool", "bool_"):
        raise refusal(what, "a bool", quoted(value), "Give True or False.")
    return None if value is None else bool(value)


_Call = TypeVar("_Call", bound=Callable[..., object])


def callback(value: _Call | None, what: str) -> _Call | None:
    """Something to call, or None."""
    if value is not None and not callable(value):
        raise refusal(what, "callable", quoted(value), "Give a function, or None.")
    return value


def path(value: str | os.PathLike[str], what: str) -> Path:
    """A path."""
    try:
        checked = Path(value)
        checked.exists()
        if b"\0" in os.fsencode(checked):
            raise ValueError
    except (OSError, TypeError, ValueError):  # no path, or one that no file can have
        raise refusal(what, "a path", quoted(value), "Give text or a pathlib.Path.") from None
    return checked


def text(value: object, what: str) -> str:
    """Text."""
    if not isinstance(value, str):
        raise refusal(what, "text", quoted(value), "Give a str.")
    return value


def listed(values: object, kind: type[_Kind], what: str) -> Sequence[_Kind]:
    """One object of type ``kind``, or several, as a sequence."""
    if isinstance(values, kind):
        return [values]
    return [is_a(value, kind, f"{what}[{i}]") for i, value in enumerate(ordered(values, what, _TYPES))]


def bodies(values: object, what: str) -> Sequence[HeavyTop | Body]:
    """One top or body, or several, as a sequence."""
    if isinstance(values, HeavyTop | Body):
        return [values]
    listed = ordered(values, what, _TYPES)
    return [v if isinstance(v, Body) else is_a(v, HeavyTop, f"{what}[{i}]") for i, v in enumerate(listed)]


MOST_STATES = 100_000
"""The most states, or Jacobians, of a score."""


def required(digits: Any) -> Fraction:
    """The required digits, exact; raises InputError unless they are a positive number."""
    number = physical(digits, "require")
    if number <= 0:
        raise refusal("require", "positive", quoted(digits), "Give a number of digits, such as 9.5.")
    return number


def component(value: Any) -> Fraction | None:
    """The exact value of a number of any format or of text; None for NaN and infinities."""
    if isinstance(value, str):
        return written_numbers.number(value, "a component of a state")
    try:
        return exact(value)
    except InputError:
        import numpy

        if isinstance(value, float | Decimal | numpy.floating) or type(value).__name__ in ("real", "real128", "mpf"):
            return None
        raise


def bits_of(value: Any) -> int:
    """Bits of the format of a number; of exact numbers and text, those of their digits."""
    kind = type(value).__name__
    if kind in ("real128", "longdouble", "real"):
        return {"real128": QUAD.bits, "longdouble": EXTENDED.bits}.get(kind) or int(value.prec)
    exactly = isinstance(value, str | int | Fraction | Decimal) and not isinstance(value, bool)
    return written_numbers.bits_of(str(value)) if exactly else DOUBLE.bits
