"""Laws of growth in a comparison: whether one can be, and one against another."""

from __future__ import annotations

import math

from heavytop.measure.growth import CLASSES, NEAR
from heavytop.precision import exact, log10
from heavytop.records import Law
from heavytop.report.verdicts import SAME, Judged, Verdict

_GROWTH = (*CLASSES, "exponential")
_ROUNDED = 1e-6
"""Exponents are written to six decimals."""
_WIDER = 5.0
"""The interval of a rerun may be wider by that factor: of 1,400 pairs of ensembles of 16 starts, none is by 4.2."""
_SPAN = 2.0
"""The fitted span of a rerun may begin later, or end earlier, by that factor."""
_DETECTS = math.log10(8)
"""Decades.  The smallest detectable fault of a rerun is larger by a factor of 6.6 at most, in the same pairs."""
_LOST_AT = 0.3
"""Decades by which the time of the last digit may come earlier, beyond what the noise of the error itself makes it."""


def law_text(law: Law) -> str:
    """A growth law in a few words."""
    if law.exponent is None:
        return law.growth
    span = "" if law.low is None or law.high is None else f" [{law.low:.3g}, {law.high:.3g}]"
    return f"{law.growth}, exponent {law.exponent:.3g}{span}"


def inconsistent(law: Law) -> str:
    """Why a law contradicts itself: class, exponent, interval and span; empty where it does not."""
    if (law.low is None) != (law.high is None) or (law.exponent is None and law.low is not None):
        return "half an interval, or one without its exponent"
    if not all(math.isfinite(number) for number in (law.exponent, law.low, law.high) if number is not None):
        return "an exponent or an interval that is not finite"
    if law.low is not None and law.high is not None and law.exponent is not None:
        if law.low > law.high:
            return f"an interval from {law.low:g} to {law.high:g}"
        if not law.low - _ROUNDED <= law.exponent <= law.high + _ROUNDED:
            return f"an interval from {law.low:g} to {law.high:g} without its exponent {law.exponent:g}"
    if law.first is not None and law.last is not None and exact(law.first) > exact(law.last):
        return f"a span from {law.first} to {law.last}"
    return "" if law.exponent is None else _another_class(law, law.exponent)


def _another_class(law: Law, exponent: float) -> str:
    """Why an exponent is not one of its class; empty where it is."""
    said = f"{law.growth} with the exponent {exponent:g}"
    if law.growth == "unresolved":
        return said
    if law.growth == "exponential":
        return "" if exponent > 0 else said
    others = [value for name, value in CLASSES.items() if name != law.growth]
    own = CLASSES[law.growth]
    if any(abs(value - exponent) < abs(own - exponent) - _ROUNDED for value in others):
        return said
    if law.low is None or law.high is None:
        return ""
    inside = law.low - NEAR - _ROUNDED <= own <= law.high + NEAR + _ROUNDED
    if not inside or any(law.low <= value <= law.high for value in others):
        return f"{said} in [{law.low:g}, {law.high:g}]"
    return ""


def judge_law(old: Law, new: Law, noise: float = 0.0) -> Judged:
    """A change of class is never noise; within a class, exponents whose intervals do not meet.

    The interval of the candidate counts as no wider than that of the baseline; one that is wider by more than chance
    is worse, and so is a lost power to detect.  An exponent without an interval is the same as one that it equals or
    whose interval holds it; else nobody can tell.
    noise: decades by which noise alone may move the error that the law is about.
    """
    for law in (old, new):
        if problem := inconsistent(law):
            return Verdict.INCOMPARABLE, problem
    if old.growth != new.growth:
        if "unresolved" in (old.growth, new.growth):
            return Verdict.INCOMPARABLE, "the growth is resolved in one report only"
        worse = _GROWTH.index(new.growth) > _GROWTH.index(old.growth)
        return (Verdict.WORSE if worse else Verdict.BETTER), f"grows like {new.growth}, not {old.growth}"
    if new.starts < old.starts:
        return Verdict.INCOMPARABLE, f"{old.starts} starts against {new.starts}"
    judged = _exponents(old, new)
    if judged[0] in (Verdict.WORSE, Verdict.INCOMPARABLE):
        return judged
    return _power_of_law(old, new, noise) or judged


def _exponents(old: Law, new: Law) -> Judged:
    if old.exponent is None or new.exponent is None:
        known = old.exponent is not None or new.exponent is not None
        return (Verdict.INCOMPARABLE, "an exponent in one report only") if known else SAME
    low, high = _interval(old, math.inf)
    width = high - low if old.low is not None else math.inf
    new_low, new_high = _interval(new, width)
    if new_low > high or new_high < low:
        if old.low is None or new.low is None:
            return Verdict.INCOMPARABLE, "another exponent, and no interval to tell noise from it"
        return (Verdict.WORSE, "a larger exponent") if new_low > high else (Verdict.BETTER, "a smaller exponent")
    if new.low is None and old.low is not None:
        return SAME
    if new.low is not None and new.high is not None and old.low is not None and new.high - new.low > _WIDER * width:
        return Verdict.WORSE, f"noise: the interval is {new.high - new.low:.2g} wide, not {width:.2g}"
    return SAME


def _interval(law: Law, width: float) -> tuple[float, float]:
    """That of the exponent, shrunk about it to at most ``width``; where it has none, the exponent alone."""
    assert law.exponent is not None
    if law.low is None or law.high is None:
        return law.exponent, law.exponent
    part = min(1.0, width / (law.high - law.low)) if law.high > law.low else 1.0
    return law.exponent - (law.exponent - law.low) * part, law.exponent + (law.high - law.exponent) * part


def _power_of_law(old: Law, new: Law, noise: float) -> Judged | None:
    """What the law of the candidate says less of: its detection power, its span, the time of the last digit."""
    for name in ("first", "last", "detects"):
        if getattr(old, name) is not None and getattr(new, name) is None:
            return Verdict.INCOMPARABLE, f"the law no longer says {name.replace('_', ' ')}"
    spans = [_log(law.first) - _log(law.last) for law in (old, new)]
    if _log(new.last) < _log(old.last) - math.log10(_SPAN) or spans[1] > spans[0] + math.log10(_SPAN):
        return Verdict.INCOMPARABLE, f"fitted from {new.first} to {new.last}, not from {old.first} to {old.last}"
    if _log(new.detects) > _log(old.detects) + max(_DETECTS, noise):
        return Verdict.WORSE, f"detects a fault of {new.detects} a step, not of {old.detects}"
    if new.lost_at is not None:
        power = CLASSES.get(new.growth, math.inf)
        earlier = (math.inf if old.lost_at is None else _log(old.lost_at)) - _log(new.lost_at)
        if earlier > _LOST_AT + (noise / power if power else 0.0):
            return Verdict.WORSE, f"no digit is left from t = {new.lost_at} on, not from {old.lost_at or 'any'}"
    elif old.lost_at is not None:
        return Verdict.INCOMPARABLE, "the law no longer says when no digit is left"
    return None


def _log(text: str | None) -> float:
    """log10 of decimal text; 0 for none, -inf for 0."""
    if text is None:
        return 0.0
    found = log10(exact(text))
    return -math.inf if found is None else found
