"""Whether a trajectory file and the case that it is said to be of agree."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import decimal_text
from heavytop.suite.cases import Case
from heavytop.top.equations import NAMES, System
from heavytop.top.heavy_top import HeavyTop, State


def require_case(case: Case, top: HeavyTop, start: State, which: System, at_start: State | None) -> None:
    """Raises InputError where the file says something else than the case."""
    said: list[tuple[str, Any, Any]] = [("system", which.name, case.system.name)]
    said += [("weight", top.weight, case.top.weight)]
    said += [(f"I{i}", new, old) for i, (new, old) in enumerate(zip(top.inertia, case.top.inertia, strict=True), 1)]
    said += [
        (f"{name} of the centre", new, old) for name, new, old in zip("abc", top.centre, case.top.centre, strict=True)
    ]
    rotors = (each.rotor or (Fraction(0),) * 3 for each in (top, case.top))
    said += [(f"k{i} of the rotor", new, old) for i, (new, old) in enumerate(zip(*rotors, strict=True), 1)]
    said += [(name, new, old) for name, new, old in zip(NAMES, start.flat, case.start.flat, strict=True)]
    if at_start is not None:
        rows = zip(NAMES, at_start.flat, case.start.flat, strict=True)
        said += [(f"{name} of the row t = 0", new, old) for name, new, old in rows]
    for what, new, old in said:
        if new != old and (isinstance(new, str) or not _rounded_alike(new, old)):
            texts = [value if isinstance(value, str) else _briefly(value) for value in (new, old)]
            raise InputError(
                f"The file says {what} = {texts[0]}, but in the case {case.name} it is {texts[1]}.",
                f"`heavytop list --case {case.name}` shows the data; without a case the file is scored by its own.",
            )


def _briefly(value: Fraction) -> str:
    return str(value) if value.denominator < 1000 else decimal_text(value, 6)


def _rounded_alike(new: Fraction, old: Fraction) -> bool:
    """Whether a number is the other one, rounded to three digits or more."""
    return abs(new - old) <= max(abs(old), Fraction(1)) * Fraction(1, 1000)
