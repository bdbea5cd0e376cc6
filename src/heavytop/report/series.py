"""One series of a baseline against the same series of a candidate."""

from __future__ import annotations

from fractions import Fraction
from statistics import median

from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact
from heavytop.records import Series
from heavytop.report.consistency import log_size
from heavytop.report.policy import BITS
from heavytop.report.verdicts import MISSING, NAN, SAME, Judged, Verdict

_NO_NUMBER = (NAN, MISSING)
_LOST_SHARE = 10
"""One in so many samples, and two, may no longer be resolved."""


def judge_series(old: Series, new: Series, allowed: float, floor: float, exactly: bool) -> Judged:
    """The same samples, as many of them numbers, and no larger: single samples are noise, their median is not.

    allowed: decades by which the median of the ratios may grow, or where the series must agree ``exactly`` the part of
    its largest value by which each may be off.  floor: log10 below which all errors are the same.
    """
    if old.times != new.times and list(map(exact, old.times)) != list(map(exact, new.times)):
        return Verdict.INCOMPARABLE, "other times"
    pairs = list(zip(old.values, new.values, strict=True))
    if any(b == NAN and a not in _NO_NUMBER for a, b in pairs):
        return Verdict.WORSE, "a value is no longer a number"
    if any(b == MISSING and a not in _NO_NUMBER for a, b in pairs):
        return Verdict.INCOMPARABLE, "a value is no longer measured"
    lost = sum(b == UNRESOLVED != a for a, b in pairs)
    if lost > 2 + len(pairs) / _LOST_SHARE:
        return Verdict.INCOMPARABLE, f"{lost} values are no longer resolved"
    numbers = [pair for pair in pairs if not {*pair} & {*_NO_NUMBER, UNRESOLVED}]
    if not numbers:
        return SAME
    if exactly:
        values = [(exact(a), exact(b)) for a, b in numbers]
        most = Fraction(allowed) * max(abs(a) for a, _ in values)
        off = any(abs(b - a) > most for a, b in values)
        return (Verdict.WORSE, "a value that must agree does not") if off else SAME
    grown = median(max(log_size(b), floor) - max(log_size(a), floor) for a, b in numbers)
    return (Verdict.WORSE, f"{grown / BITS:.1f} bits lost at half of the samples") if grown > allowed else SAME
