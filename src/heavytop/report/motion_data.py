"""Whether the rows of two reports are of one motion: the exact data of the top and its start."""

from __future__ import annotations

import re
from fractions import Fraction

from heavytop.errors import InputError
from heavytop.precision import exact
from heavytop.records import Data

_PLAIN = re.compile(r"(-?[0-9]{1,400}(/[1-9][0-9]{0,399})? )+")
"""Exact numbers as rows hold them, each with a space behind: told without the cost of reading them."""
_VECTORS = ("inertia", "centre", "omega", "gamma", "rotor")


def other_data(old: Data | None, new: Data | None) -> str:
    """Why the data of a candidate are not those of its baseline; empty where they are, however they are written.

    An ensemble of a baseline that does not name the start by which the random ones are drawn is compared by its top.
    """
    if old == new:
        return ""
    if old is None or new is None:
        return f"only the {'candidate' if old is None else 'baseline'} says of which top and start it is"
    of_top, of_start = ("inertia", "weight", "centre", "rotor"), ("omega", "gamma")
    for name in of_top + of_start if old.omega else of_top:
        before, after = (getattr(data, name) for data in (old, new))
        if before != after and _numbers(before) != _numbers(after):
            return f"other data: {name} {_text(before)} against {_text(after)}"
    return ""


def impossible(data: Data, starts: int) -> str:
    """What in the data of a row of so many starts no run writes; empty where nothing is."""
    for name in _VECTORS:
        count = len(getattr(data, name))
        if count != 3 and (count or name in _VECTORS[:2] or (starts == 1 and name != "rotor")):
            return f"{count} components of {name}"
    if bool(data.omega) != bool(data.gamma):
        return "half a start"
    texts = (data.weight, *data.inertia, *data.centre, *data.omega, *data.gamma, *data.rotor)
    if not _PLAIN.fullmatch("".join(f"{text} " for text in texts)):
        try:
            _numbers(texts)
        except InputError as error:
            return error.cause
    if any(text[0] not in "123456789" and exact(text) <= 0 for text in data.inertia):
        return "a moment of inertia that is not positive"
    return ""


def _numbers(texts: str | tuple[str, ...]) -> list[Fraction]:
    return [exact(text) for text in ((texts,) if isinstance(texts, str) else texts)]


def _text(texts: str | tuple[str, ...]) -> str:
    return (texts if isinstance(texts, str) else ", ".join(texts) or "none")[:120]
