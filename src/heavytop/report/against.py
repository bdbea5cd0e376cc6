"""What a row was compared with, as far as its text tells, and whether that of a candidate is weaker."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import exact, log10

_NUMBER = r"(-?[\d./]+(?:[eE][-+]?\d+)?)"
_RADIUS = re.compile(rf"(?:radius below|agree within) {_NUMBER}")
_CERTIFIED = re.compile(rf"certified at t = {_NUMBER} to (\d+) digits")
_CERTIFIED_STARTS = re.compile(r"(\d+) of \d+ starts certified")
_CHECKED = re.compile(rf"on (\d+) starts up to \|t\| = {_NUMBER},")
_PART = re.compile(rf"its error is {_NUMBER} of the error measured")
_HOW = re.compile(r"\((proven at both ends|proven|computed)\)")
_ENCLOSURE = "known: validated"
"""What is proven where it says no more: an enclosure is its own proof."""
_NOTHING = "its own first integrals"
"""A row without a reference: what its text says beyond that is why."""

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

    radius, part: log10 of its radius, and of its own error in units of the error measured.  digits, times: of each
    certificate, the first start's before that of all starts; log10 of |t|.  starts: certified ones, or those that a
    computed reference was checked on; then ``times`` holds the |t| up to which it was.  None or empty where the text
    does not say.
    """

    kind: str
    proven: bool
    radius: float | None
    part: float | None
    digits: tuple[int, ...]
    times: tuple[float, ...]
    starts: int | None

    @classmethod
    def of(cls, text: str) -> Against:
        """The reference that ``against`` of a row describes."""
        kind = re.split("[:,;]", text, maxsplit=1)[0]
        if kind == _NOTHING:
            return cls(kind, False, None, None, (), (), None)
        certificates, checked = _CERTIFIED.findall(text), _CHECKED.search(text)
        starts = checked or _CERTIFIED_STARTS.search(text)
        times = [time for time, _ in certificates] + ([checked[2]] if checked else [])
        how = set(_HOW.findall(text))
        return cls(
            kind,
            "computed" not in how if how else text.startswith(_ENCLOSURE),
            _first_log(_RADIUS.search(text)),
            _first_log(_PART.search(text)),
            tuple(int(digits) for _, digits in certificates),
            tuple(map(_log, times)),
            int(starts[1]) if starts else None,
        )


def _first_log(found: re.Match[str] | None) -> float | None:
    return None if found is None else _log(found[1])


def _log(text: str) -> float:
    """log10 |number|, -inf for 0; nan for what is no number, which is within no bound."""
    try:
        size = log10(exact(text))
    except InputError:
        return math.nan
    return -math.inf if size is None else size


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
    if not _kept(a.digits, b.digits, lambda old, new: new >= _DIGITS_KEPT * old):
        return f"the reference is certified to {_digits_text(b)} digits, not {_digits_text(a)}"
    if a.starts is not None and (b.starts is None or b.starts < _TIME_KEPT * a.starts):
        return f"the reference is certified or checked for {b.starts or 'no'} starts, not {a.starts}"
    if not _kept(a.times, b.times, lambda old, new: new >= old + math.log10(_TIME_KEPT)):
        return "the reference is certified or checked at an earlier time"
    return ""


def _grew(old: float | None, new: float | None, decades: float) -> bool:
    return old is not None and (new is None or not new <= old + decades)


def _kept(old: tuple[Any, ...], new: tuple[Any, ...], enough: Callable[[Any, Any], bool]) -> bool:
    """Whether each number that the baseline says is there, and is enough."""
    return len(new) >= len(old) and all(map(enough, old, new))


def _digits_text(reference: Against) -> str:
    return " and ".join(map(str, reference.digits)) or "no"
