"""Laws of growth in a comparison: whether one can be, and one against another."""

from __future__ import annotations

import math

from heavytop.measure.growth import BENT, CLASSES, Interval
from heavytop.precision import exact, log10
from heavytop.records import Law
from heavytop.report.consistency import inconsistent, interval_of
from heavytop.report.verdicts import SAME, Judged, Verdict

_GROWTH = (*CLASSES, "exponential")
_WIDER = 5.0
"""The interval of a rerun may be wider by that factor: of 1,400 pairs of ensembles of 16 starts, none is by 4.2."""
_SPAN = 2.0
"""The fitted span of a rerun may begin later, or end earlier, by that factor."""
_DETECTS = math.log10(8)
"""Decades.  The smallest detectable fault of a rerun is larger by a factor of 6.6 at most, in the same pairs."""
_BY_CHANCE = 1.4
"""Of a rerun the interval counts as no wider than that of the baseline by this factor, as its noise bands do."""
_APART = 0.1
"""Exponents of two reruns are apart by that part of the width of the baseline's interval: of the dozens of laws in a
report some intervals just do not meet.  Figures: docs/compare.md."""
_BENDS_APART = 0.5
"""The same of bends, each the difference of two exponents over half of the span."""
_LOST_AT = 0.3
"""Decades by which the time of the last digit may come earlier, beyond what the noise of the error itself makes it."""


def judge_law(old: Law, new: Law, noise: float = 0.0, rerun: bool = False) -> Judged:
    """A change of class is a change; within a class, exponents or bends whose intervals do not meet.

    A law that is resolved in one report only is judged as within a class: of two ensembles of one motion one may bend
    by a little more than a law may.  What it says less of than the other is judged too.
    noise: decades by which noise alone may move the error that the law is about.
    rerun: whether the two are of two runs.  Intervals that just do not meet may then be chance, and so may two classes
    with exponents half way between them; of one and the same series they are not.
    """
    for law in (old, new):
        if problem := inconsistent(law):
            return Verdict.INCOMPARABLE, problem
    if old.growth != new.growth:
        if "unresolved" not in (old.growth, new.growth) and not (rerun and _between_classes(old, new)):
            worse = _GROWTH.index(new.growth) > _GROWTH.index(old.growth)
            return (Verdict.WORSE if worse else Verdict.BETTER), f"grows like {new.growth}, not {old.growth}"
        if "exponential" in (old.growth, new.growth) or None in (old.exponent, new.exponent):
            return Verdict.INCOMPARABLE, "the growth is resolved in one report only"
    if new.starts < old.starts:
        return Verdict.INCOMPARABLE, f"{old.starts} starts against {new.starts}"
    for judged in (_exponents(old, new, rerun), _bends(old, new, rerun)):
        if judged[0] is not Verdict.SAME:
            break
    if judged[0] in (Verdict.WORSE, Verdict.INCOMPARABLE):
        return judged
    return _power_of_law(old, new, noise) or judged


def _between_classes(old: Law, new: Law) -> bool:
    """Whether the powers of two laws are so near that each might be of the class of the other."""
    if "exponential" in (old.growth, new.growth) or old.exponent is None or new.exponent is None:
        return False
    return abs(new.exponent - old.exponent) <= BENT


def _exponents(old: Law, new: Law, rerun: bool) -> Judged:
    if old.exponent is None or new.exponent is None:
        known = old.exponent is not None or new.exponent is not None
        return (Verdict.INCOMPARABLE, "an exponent in one report only") if known else SAME
    if old.low is not None and new.low is not None:
        return _apart("exponent", interval_of(old), interval_of(new), new.exponent, rerun, _APART)
    (low, high), (new_low, new_high) = interval_of(old), interval_of(new)
    if new_low > high or new_high < low:
        return Verdict.INCOMPARABLE, "another exponent, and no interval to tell noise from it"
    return SAME


def _bends(old: Law, new: Law, rerun: bool) -> Judged:
    """Where the class of one alone is known: of two laws of a class neither bends by more than a law may."""
    if "unresolved" not in (old.growth, new.growth) or old.growth == new.growth:
        return SAME
    if old.bend is None or new.bend is None:
        return Verdict.INCOMPARABLE, "the growth is resolved in one report only, and how it bends is not known of both"
    return _apart("bend towards the end", old.bend, new.bend, sum(new.bend) / 2, rerun, _BENDS_APART)


def _apart(what: str, old: Interval, new: Interval, middle: float, rerun: bool, gap: float) -> Judged:
    """Two intervals, that of the candidate about ``middle``, which counts as no wider than that of the baseline.

    One that is wider by more than chance is worse.  Those of a rerun are apart by ``gap`` widths of the baseline's.
    """
    width, own = (interval[1] - interval[0] for interval in (old, new))
    part = min(1.0, (_BY_CHANCE if rerun else 1.0) * width / own) if own > 0 else 1.0
    low, high = (middle + (end - middle) * part for end in new)
    least = gap * width if rerun else 0.0
    if low - old[1] > least:
        return Verdict.WORSE, f"a larger {what}"
    if old[0] - high > least:
        return Verdict.BETTER, f"a smaller {what}"
    if own > _WIDER * width:
        return Verdict.WORSE, f"noise: the interval of the {what} is {own:.2g} wide, not {width:.2g}"
    return SAME


def _power_of_law(old: Law, new: Law, noise: float) -> Judged | None:
    """What the law of the candidate says less of: its detection power, its span, the time of the last digit."""
    for name in ("first", "last", "detects"):
        if getattr(old, name) is not None and getattr(new, name) is None:
            return Verdict.INCOMPARABLE, f"the law no longer says {name}"
    spans = [_log(law.first) - _log(law.last) for law in (old, new)]
    if _log(new.last) < _log(old.last) - math.log10(_SPAN) or spans[1] > spans[0] + math.log10(_SPAN):
        return Verdict.INCOMPARABLE, f"fitted from {new.first} to {new.last}, not from {old.first} to {old.last}"
    if _log(new.detects) > _log(old.detects) + max(_DETECTS, noise):
        return Verdict.WORSE, f"detects a fault of {new.detects} a step, not of {old.detects}"
    if "unresolved" in (old.growth, new.growth) and None in (old.lost_at, new.lost_at):
        return None  # it is not extrapolated
    if "unresolved" not in (old.growth, new.growth) and old.growth != new.growth:
        return None  # extrapolated by two powers
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
