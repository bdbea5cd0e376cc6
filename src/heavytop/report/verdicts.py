"""One number against another of the same kind: the verdict and why."""

from __future__ import annotations

import math
from enum import Enum
from fractions import Fraction

from heavytop.errors import InputError
from heavytop.measure.scalar import RESOLVED_RADII, UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import Metric
from heavytop.report.noise import STEP_CONTROL, allowed_gain, allowed_loss, apart
from heavytop.report.policy import BITS, Limits, Timings
from heavytop.report.rounding_bound import RoundingBound

_ROUNDED = 2e-6
"""Two logarithms of six decimals cannot tell a smaller difference."""
_UNRESOLVED = math.log10(1 + RESOLVED_RADII)
"""Decades by which the bound of an unresolved error may move with its reference as it was: it is |midpoint| + radius,
from one radius to eleven."""


class Verdict(Enum):
    """What became of a metric, or of a whole row."""

    SAME = "same"
    BETTER = "better"
    WORSE = "worse"
    MISSING = "missing"
    NEW = "new"
    INCOMPARABLE = "incomparable"


NAN, MISSING = "nan", "missing"
"""Words in the place of a number: the value is none, or it was not measured."""
Judged = tuple[Verdict, str]
"""A verdict and why."""
SAME: Judged = (Verdict.SAME, "")


def judge(
    old: Metric,
    new: Metric,
    limits: Limits,
    eps: float,
    suspicious: float,
    least: tuple[float, float],
    bound: RoundingBound | None = None,
) -> Judged:
    """Two values of one metric.

    eps: log10 of the format's, or of what its roundings add up to.  suspicious: digits.  least: what an error counts as
    at least, as log10, in each row.  bound: the most that noise makes of it; None where its band says so by itself.
    """
    if old.kind != new.kind:
        return Verdict.INCOMPARABLE, f"kind {old.kind} against {new.kind}"
    if (word := _no_number(old, new, limits)) is not None:
        return word
    if old.kind == "error":
        return _errors(old, new, limits, limits.floor + eps, suspicious, least, bound)
    if old.kind == "duration":
        return _durations(old, new, limits, bound)
    return _values(old, new, limits)


def _no_number(old: Metric, new: Metric, limits: Limits) -> Judged | None:
    """The verdict where a value is no number in one row or in both; None where both are.

    NaN is worse than any number, and never the same, not even as itself.  What was not measured is incomparable.
    """
    if MISSING not in (old.value, new.value) and old.value != new.value:
        if new.value == NAN:
            return Verdict.WORSE, "no longer a number"
        if old.value == NAN:
            return beyond_limit(new, limits) or (Verdict.BETTER, "now a number")
    for metric in (old, new):
        if metric.value in (NAN, MISSING) or (metric.value == UNRESOLVED and old.kind == "error" and not metric.bound):
            return Verdict.INCOMPARABLE, f"the value is {metric.value}"
    return None


def size(metric: Metric) -> float:
    """log10 of an error, or of its bound where it is unresolved; -inf for 0 and for words such as nan."""
    if metric.log10 is not None:
        return metric.log10
    try:
        found = log10(exact(metric.bound or "0" if metric.value == UNRESOLVED else metric.value))
    except InputError:
        return -math.inf
    return -math.inf if found is None else found


def _errors(
    old: Metric,
    new: Metric,
    limits: Limits,
    floor: float,
    suspicious: float,
    least: tuple[float, float],
    bound: RoundingBound | None,
) -> Judged:
    """Smaller is better; below the floor all errors are the same.  What its reference does not resolve is at most its
    bound: never better, and incomparable where the bound itself would be worse, or where it has fallen so far that it
    is another error or another reference.
    """
    a, b = max(size(old), floor, least[0]), max(size(new), floor, least[1])
    if limited := beyond_limit(new, limits):
        return limited
    noise = limits.noise * (allowed_loss(old, new) if b > a else allowed_gain(old, new))
    if noise > STEP_CONTROL and b - a > max(limits.loss, STEP_CONTROL) and bound is not None:
        noise = noise if bound.explains(old.quantity, apart(a, b - a)) else STEP_CONTROL
    allowed = max(limits.loss, noise) + _ROUNDED
    if new.value == UNRESOLVED:
        return _unresolved(old, new, b - a, allowed)
    if a == b or (old.value == UNRESOLVED and b <= a):
        return SAME
    if math.isinf(a) or math.isinf(b):
        return (Verdict.WORSE, "no longer exactly 0") if b > a else (Verdict.BETTER, "now exactly 0")
    lost = b - a
    if abs(lost) <= allowed:
        return SAME
    beyond = f", noise moves it by {noise / BITS:.1f} bits" if noise > limits.loss else ""
    if lost > 0:
        return Verdict.WORSE, f"{lost / BITS:.1f} bits lost{beyond}"
    odd = "; suspicious: look for a reason" if -lost > suspicious else ""
    return Verdict.BETTER, f"{-lost / BITS:.1f} bits gained{beyond}{odd}"


def _unresolved(old: Metric, new: Metric, lost: float, allowed: float) -> Judged:
    """lost: decades from the error or bound of the baseline to the bound of the candidate, above the floor."""
    if lost > allowed:
        return Verdict.INCOMPARABLE, f"unresolved below {new.bound}"
    # two bounds are those of a reference, and the floor is about errors
    moved = size(new) - size(old) if old.value == UNRESOLVED else lost
    if abs(moved) > allowed + _UNRESOLVED:
        return Verdict.INCOMPARABLE, f"unresolved below {new.bound}, {abs(moved):.1f} decades away"
    return SAME


def beyond_limit(new: Metric, limits: Limits) -> Judged | None:
    """The verdict of a number beyond the limit of a policy, whatever the baseline was; None of any other."""
    if limits.limit is None or new.value == "never" or new.kind == "value":
        return None
    if new.kind == "duration":
        return (Verdict.WORSE, "below its limit") if size(new) < limits.limit else None
    if size(new) <= limits.limit:
        return None
    if new.value == UNRESOLVED:
        return Verdict.INCOMPARABLE, "limit not resolved"
    return Verdict.WORSE, "above its limit"


def _durations(old: Metric, new: Metric, limits: Limits, bound: RoundingBound | None) -> Judged:
    """Longer is better; never is longest."""
    if limited := beyond_limit(new, limits):
        return limited
    if old.value == new.value:
        return SAME
    if old.value == "never":
        return Verdict.WORSE, f"now at {new.value}"
    if new.value == "never":
        return Verdict.BETTER, "now never"
    if old.log10 is None:
        return Verdict.BETTER, f"now at {new.value}"
    ratio = 10 ** min(size(new) - old.log10, 300.0)
    shorter, longer = (
        10 ** min(limits.noise * band, 300.0) for band in (allowed_loss(old, new), allowed_gain(old, new))
    )
    by_noise = ratio * shorter >= 1 and (bound is None or bound.explains_times(old.value, 1 - ratio))
    if ratio < 1 - limits.duration and not by_noise:
        return Verdict.WORSE, f"{1 - ratio:.0%} earlier"
    if ratio > longer and ratio > 1 + limits.duration:
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
    off = max(limits.value, 10 ** min(limits.noise * allowed_loss(old, new), 300.0) - 1)
    return SAME if abs(a - b) <= Fraction(off) * max(abs(a), abs(b)) else differs


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
