"""Whether what a candidate was compared with is weaker than what its baseline was compared with."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import exact, log10
from heavytop.records import Against

_RADIUS_DECADES = 1.0
"""A radius may grow by that much: that of a reference for the same bits does not move at all."""
_DIGITS_KEPT = 0.8
"""Part of the certified digits that must stay; other data of the same format lose a tenth."""
_TIME_KEPT = 0.5
"""Part of the certified time, and of the certified starts, that must stay."""
_COMPUTED_DECADES = 2.0
"""What two computed runs agree within varies by a decade from one ensemble to the next."""


def weaker(old: Against, new: Against) -> str:
    """Why a candidate's reference is another or proves less than that of the baseline; empty where it is as good.

    Proven is proven, whichever closed form or enclosure it was: a better certificate makes no difference.
    """
    if old == new:
        return ""
    if old.how != new.how:
        return f"compared with {_kind(old)} and with {_kind(new)}"
    if old.how == "equations" and old.method != new.method:
        return f"compared with {old.method!r} and {new.method!r}"
    if _is_proven(old) and not _is_proven(new):
        return "the reference is no longer proven"
    if _earlier(old.until, new.until):
        return "the truth ends earlier"
    if _grew(old.radius, new.radius, _RADIUS_DECADES if old.how == "proven" else _COMPUTED_DECADES):
        return "the radius of the reference is larger, or not said"
    if not _kept(_digits(old), _digits(new), lambda before, after: after >= _DIGITS_KEPT * before):
        return f"the reference is certified to {_digits_text(new)} digits, not {_digits_text(old)}"
    starts = _starts(old), _starts(new)
    if starts[0] is not None and (starts[1] is None or starts[1] < _TIME_KEPT * starts[0]):
        return f"the reference is certified for {starts[1] or 'no'} starts, not {starts[0]}"
    if not _kept(_times(old), _times(new), lambda before, after: after >= before + math.log10(_TIME_KEPT)):
        return "the reference is certified at an earlier time"
    return ""


def _kind(reference: Against) -> str:
    return {"none": "first integrals alone", "equations": reference.method}.get(
        reference.how, f"a {reference.how} reference"
    )


def _is_proven(reference: Against) -> bool:
    return reference.how == "proven" and all(each.proven != "computed" for each in reference.certificates)


def _digits(reference: Against) -> tuple[float, ...]:
    return tuple(math.inf if each.digits is None else each.digits for each in reference.certificates)


def _digits_text(reference: Against) -> str:
    return " and ".join("all" if math.isinf(each) else str(each) for each in _digits(reference)) or "no"


def _starts(reference: Against) -> int | None:
    """How many starts are certified."""
    return next((each.starts for each in reference.certificates if each.starts is not None), None)


def _times(reference: Against) -> tuple[float, ...]:
    """log10 |t| of each certificate."""
    return tuple(_log(each.time) for each in reference.certificates)


def _log(text: str) -> float:
    """log10 |number|, -inf for 0; nan for what is no number, which is within no bound."""
    try:
        size = log10(exact(text))
    except InputError:
        return math.nan
    return -math.inf if size is None else size


def _grew(old: str, new: str, decades: float) -> bool:
    return bool(old) and (not new or not _log(new) <= _log(old) + decades)


def _earlier(old: str, new: str) -> bool:
    """Whether a truth that had an end, or none, ends at less than half of the time now."""
    return bool(new) and not (old and _log(new) >= _log(old) + math.log10(_TIME_KEPT))


def _kept(old: tuple[Any, ...], new: tuple[Any, ...], enough: Callable[[Any, Any], bool]) -> bool:
    """Whether each number that the baseline says is there, and is enough."""
    return len(new) >= len(old) and all(map(enough, old, new))
