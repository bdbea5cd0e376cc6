"""What a row was compared with, as far as its text tells, and whether that of a candidate is weaker."""

from __future__ import annotations

import re
from dataclasses import dataclass

from heavytop.errors import InputError
from heavytop.precision import exact, log10

_NUMBER = r"(-?[\d./]+(?:[eE][-+]?\d+)?)"
_RADIUS = re.compile(rf"(?:radius below|agree within) {_NUMBER}")
_CERTIFIED = re.compile(rf"certified at t = {_NUMBER} to (\d+) digits")
_STARTS = re.compile(r"(\d+) of \d+ starts certified")
_PART = re.compile(rf"its error is {_NUMBER} of the error measured")
_PROVEN = re.compile(r"\(proven")

_RADIUS_DECADES = 1.0
"""A radius may grow by that much: that of a reference for the same bits does not move at all."""
_DIGITS_KEPT = 0.8
"""Part of the certified digits that must stay; other data of the same format lose a tenth."""
_TIME_KEPT = 0.5
"""Part of the certified time, and of the certified starts, that must stay."""
_PART_DECADES = 2.0
"""The error of a computed reference, in units of the measured one, varies by a decade from one ensemble to the next."""


@dataclass(frozen=True, slots=True)
class Against:
    """A reference: its kind (``known``, ``computed``, ...), and what it is known to.

    radius, time, part: log10 of its radius, of |t| where it is certified, and of its own error in units of the error
    measured.  digits, starts: certified ones.  None where the text does not say.
    """

    kind: str
    proven: bool
    radius: float | None
    time: float | None
    digits: int | None
    starts: int | None
    part: float | None

    @classmethod
    def of(cls, text: str) -> Against:
        """The reference that ``against`` of a row describes."""
        certified, starts = _CERTIFIED.search(text), _STARTS.search(text)
        return cls(
            text.partition(":")[0].partition(",")[0],
            bool(_PROVEN.search(text)),
            _log(_RADIUS.search(text)),
            _log(certified),
            int(certified[2]) if certified else None,
            int(starts[1]) if starts else None,
            _log(_PART.search(text)),
        )


def _log(found: re.Match[str] | None) -> float | None:
    try:
        return None if found is None else log10(exact(found[1]))
    except InputError:
        return None


def weaker(old: str, new: str) -> str:
    """Why a candidate's reference is another or proves less than that of the baseline; empty where it is as good.

    Known is known, whichever closed form or enclosure it was: a better certificate makes no difference.
    """
    if old == new:
        return ""
    a, b = Against.of(old), Against.of(new)
    if a.kind != b.kind:
        return f"compared with {a.kind!r} and {b.kind!r}"
    if a.proven and not b.proven:
        return "the reference is no longer proven"
    if _grew(a.radius, b.radius, _RADIUS_DECADES):
        return "the radius of the reference is larger, or not said"
    if _grew(a.part, b.part, _PART_DECADES):
        return "the error of the computed reference is larger, or not said"
    if a.digits is not None and (b.digits is None or b.digits < _DIGITS_KEPT * a.digits):
        return f"the reference is certified to {b.digits or 'no'} digits, not {a.digits}"
    if a.starts is not None and (b.starts is None or b.starts < _TIME_KEPT * a.starts):
        return f"the reference is certified for {b.starts or 'no'} starts, not {a.starts}"
    if a.time is not None and (b.time is None or 10 ** (b.time - a.time) < _TIME_KEPT):
        return "the reference is certified at an earlier time"
    return ""


def _grew(old: float | None, new: float | None, decades: float) -> bool:
    return old is not None and (new is None or new > old + decades)
