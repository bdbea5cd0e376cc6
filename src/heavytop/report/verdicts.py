"""One number against another of the same kind: the verdict and why."""

from __future__ import annotations

import math
from enum import Enum
from fractions import Fraction

from heavytop.errors import InputError
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import Law, Metric
from heavytop.report.policy import BITS, Limits, Timings

_ROUNDED = 2e-6
"""Two logarithms of six decimals cannot tell a smaller difference."""
_GROWTH = ("bounded", "t^0.5", "t", "t^1.5", "t^2", "exponential")


class Verdict(Enum):
    """What became of a metric, or of a whole row."""

    SAME = "same"
    BETTER = "better"
    WORSE = "worse"
    MISSING = "missing"
    NEW = "new"
    INCOMPARABLE = "incomparable"


Judged = tuple[Verdict, str]
"""A verdict and why."""
SAME: Judged = (Verdict.SAME, "")


def judge(
    old: Metric, new: Metric, limits: Limits, eps: float, suspicious: float, least: tuple[float, float]
) -> Judged:
    """Two values of one metric.

    eps: log10 of the format's, or of what its roundings add up to.  suspicious: digits.  least: what an error counts as
    at least, as log10, in each row.
    """
    if old.kind != new.kind:
        return Verdict.INCOMPARABLE, f"kind {old.kind} against {new.kind}"
    for metric in (old, new):
        if metric.value in ("nan", "missing") or (
            metric.value == UNRESOLVED and old.kind == "error" and not metric.bound
        ):
            return Verdict.INCOMPARABLE, f"{metric.value} is no number"
    if old.kind == "error":
        return _errors(old, new, limits, limits.floor + eps, suspicious, least)
    if old.kind == "duration":
        return _durations(old, new, limits)
    return _values(old, new, limits)


def size(metric: Metric) -> float:
    """log10 of an error, or of its bound where it is unresolved; -inf for 0, and for what is no number."""
    if metric.log10 is not None:
        return metric.log10
    try:
        found = log10(exact(metric.bound or "0" if metric.value == UNRESOLVED else metric.value))
    except InputError:
        return -math.inf
    return -math.inf if found is None else found


def band(old: Metric, new: Metric) -> float:
    """Half-width in decades of the 95 % interval of the ratio: the bands of the two rows in quadrature."""
    return math.hypot(old.band or 0.0, new.band or 0.0)


def _errors(
    old: Metric, new: Metric, limits: Limits, floor: float, suspicious: float, least: tuple[float, float]
) -> Judged:
    """Smaller is better; below the floor all errors are the same.  What its reference does not resolve is at most its
    bound: never better, and incomparable where the bound itself would be worse.
    """
    a, b = max(size(old), floor, least[0]), max(size(new), floor, least[1])
    if limits.limit is not None and size(new) > limits.limit:
        known = new.value != UNRESOLVED
        return (Verdict.WORSE if known else Verdict.INCOMPARABLE), "above its limit" if known else "limit not resolved"
    noise = limits.noise * band(old, new)
    allowed = max(limits.loss, noise) + _ROUNDED
    if new.value == UNRESOLVED:
        return SAME if b <= a + allowed else (Verdict.INCOMPARABLE, f"unresolved below {new.bound}")
    if a == b or (old.value == UNRESOLVED and b <= a):
        return SAME
    if math.isinf(a) or math.isinf(b):
        return (Verdict.WORSE, "no longer exactly 0") if b > a else (Verdict.BETTER, "now exactly 0")
    lost = b - a
    if abs(lost) <= allowed:
        return SAME
    luck = f", luck moves it by {noise / BITS:.1f} bits" if noise > limits.loss else ""
    if lost > 0:
        return Verdict.WORSE, f"{lost / BITS:.1f} bits lost{luck}"
    odd = "; suspicious: look for a reason" if -lost > suspicious else ""
    return Verdict.BETTER, f"{-lost / BITS:.1f} bits gained{luck}{odd}"


def _durations(old: Metric, new: Metric, limits: Limits) -> Judged:
    """Longer is better; never is longest."""
    if limits.limit is not None and new.value != "never" and size(new) < limits.limit:
        return Verdict.WORSE, "below its limit"
    if old.value == new.value:
        return SAME
    if old.value == "never":
        return Verdict.WORSE, f"now at {new.value}"
    if new.value == "never":
        return Verdict.BETTER, "now never"
    if old.log10 is None:
        return Verdict.BETTER, f"now at {new.value}"
    ratio = 10 ** min(size(new) - old.log10, 300.0)
    luck = 10 ** min(limits.noise * band(old, new), 300.0)
    if ratio * luck < 1 and ratio < 1 - limits.duration:
        return Verdict.WORSE, f"{1 - ratio:.0%} earlier"
    if ratio > luck and ratio > 1 + limits.duration:
        return Verdict.BETTER, f"{ratio - 1:.0%} later"
    return SAME


def _values(old: Metric, new: Metric, limits: Limits) -> Judged:
    """A value must agree, whichever way it went."""
    if old.value == new.value:
        return SAME
    differs = Verdict.WORSE, "a value that must agree does not"
    if "never" in (old.value, new.value) or UNRESOLVED in (old.value, new.value):
        return differs
    a, b = exact(old.value), exact(new.value)
    off = max(limits.value, 10 ** min(limits.noise * band(old, new), 300.0) - 1)
    return SAME if abs(a - b) <= Fraction(off) * max(abs(a), abs(b)) else differs


def law_text(law: Law) -> str:
    """A growth law in a few words."""
    if law.exponent is None:
        return law.growth
    span = "" if law.low is None or law.high is None else f" [{law.low:.3g}, {law.high:.3g}]"
    return f"{law.growth}, exponent {law.exponent:.3g}{span}"


def judge_law(old: Law, new: Law) -> Judged:
    """A change of class is never noise; within a class, exponents whose intervals do not meet.

    An exponent without an interval is the same as one that it equals or whose interval holds it; else nobody can tell.
    """
    if old.growth != new.growth:
        if "unresolved" in (old.growth, new.growth):
            return Verdict.INCOMPARABLE, "the growth is resolved in one report only"
        worse = _GROWTH.index(new.growth) > _GROWTH.index(old.growth)
        return (Verdict.WORSE if worse else Verdict.BETTER), f"grows like {new.growth}, not {old.growth}"
    if old.exponent is None or new.exponent is None:
        known = old.exponent is not None or new.exponent is not None
        return (Verdict.INCOMPARABLE, "an exponent in one report only") if known else SAME
    (low, high), (new_low, new_high) = _interval(old), _interval(new)
    if new_low <= high and new_high >= low:
        return SAME
    if old.low is None or new.low is None:
        return Verdict.INCOMPARABLE, "another exponent, and no interval to tell luck from it"
    return (Verdict.WORSE, "a larger exponent") if new_low > high else (Verdict.BETTER, "a smaller exponent")


def _interval(law: Law) -> tuple[float, float]:
    """That of the exponent; where it has none, the exponent alone."""
    assert law.exponent is not None
    return (law.exponent, law.exponent) if law.low is None or law.high is None else (law.low, law.high)


def judge_seconds(old: float, new: float, timings: Timings) -> Judged:
    """Seconds by their own rule."""
    if not (math.isfinite(old) and math.isfinite(new)):
        return Verdict.INCOMPARABLE, "no finite time"
    ratio = max(new, timings.floor) / max(old, timings.floor)
    if ratio > timings.ratio:
        return Verdict.WORSE, f"{ratio:.2g} times as long"
    if ratio * timings.ratio < 1:
        return Verdict.BETTER, f"{1 / ratio:.2g} times as fast"
    return SAME
