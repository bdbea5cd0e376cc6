"""Verdicts on pairs of numbers of one kind, and their reasons."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from fractions import Fraction

from heavytop.measure.rounding_bound import RoundingBound
from heavytop.measure.scalar import RESOLVED_RADII, UNRESOLVED
from heavytop.measure.scorer import OBSERVED_ORDER
from heavytop.precision import exact
from heavytop.records import (
    CONTRADICTION,
    FAILED,
    NOT_ASKED,
    OUT_OF_REACH,
    OUT_OF_TIME,
    UNMEASURED,
    UNRESOLVED_SECONDS,
    UNSUPPORTED,
    Against,
    Certified,
    Metric,
    Row,
)
from heavytop.report.compare.noise import (
    BITS,
    STEP_CONTROL,
    Limits,
    Timings,
    allowed_gain,
    allowed_loss,
    apart,
    log_of,
)

_ROUNDED = 2e-6
"""Differences below this are not resolved by logarithms of six decimals."""
_UNRESOLVED = math.log10(1 + RESOLVED_RADII)
"""Decades by which the bound of an unresolved error may change while its reference does not: it is |midpoint| + radius,
from one radius to eleven."""


class Verdict(Enum):
    """The verdict on a metric, or on a whole row."""

    SAME = "same"
    BETTER = "better"
    WORSE = "worse"
    MISSING = "missing"
    NEW = "new"
    INCOMPARABLE = "incomparable"


NAN, MISSING = "nan", "missing"
"""Words in place of a number: not a number, and not measured."""
Judged = tuple[Verdict, str]
"""A verdict and its reason."""
SAME: Judged = (Verdict.SAME, "")


def judge(
    old: Metric, new: Metric, limits: Limits, floors: tuple[float, float], bound: RoundingBound | None = None
) -> Judged:
    """The verdict on two values of one metric.

    floors: log10 of the size below which all errors are the same, in each row.  bound: the largest error that rounding
    explains; None where the noise band alone decides.
    """
    if old.kind != new.kind:
        return Verdict.INCOMPARABLE, f"kind {old.kind} → {new.kind}"
    if judged := _not_numbers(old, new, limits) or beyond_limit(new, limits):
        return judged
    if old.kind == "error":
        return _errors(old, new, limits, floors, bound)
    return _durations(old, new, limits, bound) if old.kind == "duration" else _values(old, new, limits)


def _not_numbers(old: Metric, new: Metric, limits: Limits) -> Judged | None:
    """The verdict where a value is not a number in one row or in both; None for two numbers.

    NaN is worse than any number, and not the same as NaN.  A value that was not measured is incomparable.
    """
    if MISSING not in (old.value, new.value) and old.value != new.value:
        if new.value == NAN:
            return Verdict.WORSE, "no longer finite"
        if old.value == NAN:
            return beyond_limit(new, limits) or (Verdict.BETTER, "now finite")
    for metric in (old, new):
        if metric.value in (NAN, MISSING) or (metric.value == UNRESOLVED and old.kind == "error" and not metric.bound):
            return Verdict.INCOMPARABLE, f"the value is {metric.value}"
    return None


def size(metric: Metric) -> float:
    """log10 of an error, or of its bound where it is unresolved; -inf for 0 and for words such as nan."""
    return -math.inf if metric.size is None else metric.size


def _errors(
    old: Metric, new: Metric, limits: Limits, floors: tuple[float, float], bound: RoundingBound | None
) -> Judged:
    """Smaller is better; below the floor all errors are the same.  An unresolved error is at most its bound: never
    better, and incomparable where the bound itself would be worse, or is so much smaller that the error or the
    reference must be another one.
    """
    a, b = max(size(old), floors[0]), max(size(new), floors[1])
    noise = limits.noise * (allowed_loss(old, new) if b > a else allowed_gain(old, new))
    if noise > STEP_CONTROL and b - a > max(limits.loss, STEP_CONTROL) and bound is not None:
        noise = noise if bound.explains(old.quantity, apart(a, b - a)) else STEP_CONTROL
    allowed = max(limits.loss, noise) + _ROUNDED
    if new.value == UNRESOLVED:
        # two bounds depend on their references; the floor applies to errors alone
        moved = abs(size(new) - size(old) if old.value == UNRESOLVED else b - a)
        if b - a > allowed:
            return Verdict.INCOMPARABLE, f"unresolved below {new.bound}"
        far = moved > allowed + _UNRESOLVED
        return (Verdict.INCOMPARABLE, f"unresolved below {new.bound}, {moved:.1f} decades away") if far else SAME
    if a == b or (old.value == UNRESOLVED and b <= a):
        return SAME
    if size(old) == size(new) or (a < b) != (size(old) < size(new)):  # a floor alone moved
        return SAME
    if math.isinf(a) or math.isinf(b):
        return (Verdict.WORSE, "no longer exactly 0") if b > a else (Verdict.BETTER, "now exactly 0")
    loss = b - a
    if abs(loss) <= allowed:
        return SAME
    beyond = f"; its noise is {noise / BITS:.1f} bits" if noise > limits.loss else ""
    if loss > 0:
        return Verdict.WORSE, f"{loss / BITS:.1f} bits lost{beyond}"
    return Verdict.BETTER, f"{-loss / BITS:.1f} bits gained{beyond}"


def beyond_limit(new: Metric, limits: Limits) -> Judged | None:
    """The verdict on a number beyond the limit of a policy, whatever the baseline is; None within it."""
    if limits.limit is None or new.value == "never" or new.kind == "value":
        return None
    if new.kind == "duration":
        return (Verdict.WORSE, "below its limit") if size(new) < limits.limit else None
    if size(new) <= limits.limit:
        return None
    if new.value == UNRESOLVED:
        return Verdict.INCOMPARABLE, "unresolved at its limit"
    return Verdict.WORSE, "above its limit"


def _durations(old: Metric, new: Metric, limits: Limits, bound: RoundingBound | None) -> Judged:
    """Longer is better; never is longest."""
    if old.value == new.value:
        return SAME
    if old.value == "never":
        return Verdict.WORSE, f"now at {new.value}"
    if new.value == "never":
        return Verdict.BETTER, "now never"
    if old.log10 is None:
        return Verdict.BETTER, f"now at {new.value}"
    ratio = 10 ** min(size(new) - old.log10, 300.0)
    shorter, longer = (10 ** min(limits.noise * band(old, new), 300.0) for band in (allowed_loss, allowed_gain))
    by_noise = ratio * shorter >= 1 and (bound is None or bound.explains_times(old.value, 1 - ratio))
    if ratio < 1 - limits.duration and not by_noise:
        return Verdict.WORSE, f"{1 - ratio:.0%} earlier"
    if ratio > longer and ratio > 1 + limits.duration:
        return Verdict.BETTER, f"{ratio - 1:.0%} later"
    return SAME


def _values(old: Metric, new: Metric, limits: Limits) -> Judged:
    """Values must agree; neither direction is better, but of an observed order, which may not fall."""
    if old.value == new.value:
        return SAME
    differs = Verdict.WORSE, "a value that must be equal differs"
    if "never" in (old.value, new.value) or UNRESOLVED in (old.value, new.value):
        return differs
    a, b = exact(old.number), exact(new.number)
    tolerance = max(limits.value, 10 ** min(limits.noise * allowed_loss(old, new), 300.0) - 1)
    if abs(a - b) <= Fraction(tolerance) * max(abs(a), abs(b)):
        return SAME
    if old.quantity is None or old.quantity.name != OBSERVED_ORDER.name:
        return differs
    return (Verdict.BETTER, "a higher order") if b > a else (Verdict.WORSE, "a lower order")


def judge_seconds(old: float, new: float, timings: Timings) -> Judged:
    """The verdict on seconds by the allowed ratio, above the floor."""
    if not (math.isfinite(old) and math.isfinite(new)):
        return Verdict.INCOMPARABLE, "no finite time"
    ratio = max(new, timings.floor) / max(old, timings.floor)
    slower, faster = (_times(a / b) if b else "many times" for a, b in ((new, old), (old, new)))
    if ratio > timings.ratio:
        return Verdict.WORSE, f"{slower} as long"
    return (Verdict.BETTER, f"{faster} as fast") if ratio * timings.ratio < 1 else SAME


def _times(ratio: float) -> str:
    """``2.1 times``, ``295 times``: no exponent."""
    return f"{ratio:.3g} times" if ratio < 1000 else f"{ratio:.0f} times"


# Comparison of the seconds of repeated runs on one machine.


BAND = "band"
"""Key of the band of seconds: half-width in decades of the interval that holds the middle 95 % of the runs."""
_WIDEST = 0.25
"""Decades.  Runs that scatter by a factor of 3 do not determine the speed of a machine."""


def judge_repeated(
    old: Mapping[str, float], new: Mapping[str, float], ratio: float, noise: float
) -> Iterator[tuple[str, Judged]]:
    """The name and the verdict of each timing: the median, the fastest run, and the scatter of the runs.

    Median and minimum may grow by ``ratio``, or by ``noise`` times the scatter between two runs of the baseline; that
    of the candidate is no excuse.
    """
    if missing := [name for name in ("run", "least", BAND) if name not in new]:
        yield missing[0], (Verdict.INCOMPARABLE, "its runs are no longer repeated")
        return
    if not all(math.isfinite(seconds) for seconds_of_rows in (old, new) for seconds in seconds_of_rows.values()):
        yield "run", (Verdict.INCOMPARABLE, "no finite time")
        return
    resolved = old.get(UNRESOLVED_SECONDS, 0.0), new.get(UNRESOLVED_SECONDS, 0.0)
    if all(resolved):
        return
    if old[BAND] > _WIDEST and not resolved[0]:
        yield BAND, (Verdict.INCOMPARABLE, f"runs of the baseline scatter by a factor of {10 ** (2 * old[BAND]):.2g}")
        return
    allowed = max(math.log10(ratio), noise * math.sqrt(2) * (0.0 if resolved[0] else old[BAND]))
    for name in ("run", "least"):
        known = "at least " if old.get(name, 0.0) < resolved[0] or new[name] < resolved[1] else ""
        yield name, _seconds_verdict(max(old.get(name, 0.0), resolved[0]), max(new[name], resolved[1]), allowed, known)
    if new[BAND] > _WIDEST and not resolved[1]:
        yield BAND, (Verdict.INCOMPARABLE, f"its runs scatter by a factor of {10 ** (2 * new[BAND]):.2g}")


def _seconds_verdict(old: float, new: float, allowed: float, known: str) -> Judged:
    """The verdict on seconds by the allowed growth in decades; known: "at least " where one is not resolved."""
    if min(old, new) <= 0:
        return SAME if old == new else (Verdict.INCOMPARABLE, "a run that took no time")
    grown = math.log10(new / old)
    if abs(grown) <= allowed:
        return SAME
    if grown > 0:
        return Verdict.WORSE, f"{known}{_times(10**grown)} as long; {10**allowed:.2g} is allowed"
    return Verdict.BETTER, f"{known}{_times(10**-grown)} as fast; {10**allowed:.2g} is allowed"


# Outcomes: the comparison of two rows of which at least one did not reach its horizon.


SUCCESS = "success"
_NO_RUN = (OUT_OF_REACH, CONTRADICTION, UNSUPPORTED)
"""Outcomes that are not about the integrator's run, but about its reference or its declared capabilities."""
_TOO_LONG = {OUT_OF_TIME, NOT_ASKED}
"""Outcomes of an integrator that does not return; which of its rows are skipped depends on the number of workers."""


def ended(row: Row, which: str) -> str:
    """``the candidate ended as failed: it returned NaN``; the time of a run that was measured so far."""
    how = f": {row.reference.reason}" if row.outcome in UNMEASURED else f" at t = {row.time_reached}"
    return f"the {which} ended as {row.outcome}{how}"


def judge_outcomes(old: Row, new: Row, duration: float) -> Judged | None:
    """The verdict on two outcomes; None where both are success, or equal and the numbers decide.

    A run that no longer reaches its horizon is worse, whatever the cause, and one that now does is better.  Two runs
    that failed in the same way are the same, otherwise incomparable: neither has numbers.  Of two runs that stopped
    early, the one that stops earlier by more than the fraction ``duration`` is worse.
    """
    before, after = old.outcome, new.outcome
    if before == after == SUCCESS:
        return None
    for row, which in ((old, "baseline"), (new, "candidate")):
        if row.outcome in _NO_RUN:
            return Verdict.INCOMPARABLE, ended(row, which)
    if before == SUCCESS:
        return (Verdict.INCOMPARABLE if after == NOT_ASKED else Verdict.WORSE), ended(new, "candidate")
    if after == SUCCESS:
        return Verdict.BETTER, f"it reaches its horizon; {ended(old, 'baseline')}"
    if {before, after} <= _TOO_LONG:
        return Verdict.SAME, "timed out in both reports"
    if before != after:
        return Verdict.INCOMPARABLE, f"{ended(old, 'baseline')}, {ended(new, 'candidate')}"
    if before == FAILED:
        return Verdict.SAME, "failed in both reports"
    if abs(exact(new.time_reached)) < abs(exact(old.time_reached)) * (1 - exact(duration)):
        return Verdict.WORSE, f"{ended(new, 'candidate')}, the baseline at {old.time_reached}"
    return None


def judge_support(old: Row, new: Row) -> Judged | None:
    """The verdict where a row is unsupported in either report; None where the other was not measured."""
    if old.outcome == new.outcome:
        return SAME
    if new.outcome == UNSUPPORTED:
        return (Verdict.WORSE, "no longer supported") if old.outcome == SUCCESS else None
    return (Verdict.BETTER, "now supported") if new.outcome == SUCCESS else None


# Whether the reference of a candidate is weaker than that of its baseline.


_RADIUS_DECADES = 1.0
"""Allowed growth of a radius; that of a reference for the same bits does not change at all."""
_DIGITS_KEPT = 0.8
"""Fraction of the certified digits that must remain; other data of the same format lose a tenth."""
_TIME_KEPT = 0.5
"""Fraction of the certified time, and of the certified starts, that must remain."""
_COMPUTED_DECADES = 2.0
"""Agreement of two computed runs varies by a decade from one ensemble to the next."""


def weaker(old: Against, new: Against) -> str:
    """The reason why a candidate's reference is another or proves less than the baseline's; empty where it does not.

    All proofs count alike, closed form or enclosure: a better certificate makes no difference.
    """
    if old == new:
        return ""
    if old.how != new.how:
        return f"different references: {_reference_name(old)} → {_reference_name(new)}"
    if old.how == "equations" and old.method != new.method:
        return f"different references: {old.method!r} → {new.method!r}"
    proven = [a.how == "proven" and all(c.proven != "computed" for c in a.certificates) for a in (old, new)]
    if proven[0] and not proven[1]:
        return "the reference is no longer proven"
    if new.until and not (old.until and log_of(new.until) >= log_of(old.until) + math.log10(_TIME_KEPT)):
        return "the reference is valid until an earlier time"
    decades = _RADIUS_DECADES if old.how == "proven" else _COMPUTED_DECADES
    if old.radius and not (new.radius and log_of(new.radius) <= log_of(old.radius) + decades):
        return "the radius of the reference is larger or missing"
    return _certified_less(old.certificates, new.certificates)


def _certified_less(old: Sequence[Certified], new: Sequence[Certified]) -> str:
    digits, fewer = ([math.inf if part.digits is None else part.digits for part in parts] for parts in (old, new))
    if not _all_enough(digits, fewer, lambda before, after: after >= _DIGITS_KEPT * before):
        stated, lacking = (
            " and ".join("all" if math.isinf(count) else str(count) for count in part) or "no"
            for part in (digits, fewer)
        )
        return f"the reference is certified to {lacking} digits (was {stated})"
    starts, lost = (next((part.starts for part in parts if part.starts is not None), None) for parts in (old, new))
    if starts is not None and (lost or 0) < _TIME_KEPT * starts:
        return f"the reference is certified for {lost or 'no'} starts (was {starts})"
    times, earlier = ([log_of(part.time) for part in parts] for parts in (old, new))
    if not _all_enough(times, earlier, lambda before, after: after >= before + math.log10(_TIME_KEPT)):
        return "the reference is certified at an earlier time"
    return ""


def _reference_name(reference: Against) -> str:
    return {"none": "first integrals alone", "equations": reference.method}.get(
        reference.how, f"a {reference.how} reference"
    )


def _all_enough(old: Sequence[float], new: Sequence[float], enough: Callable[[float, float], bool]) -> bool:
    """Whether the candidate has each number of the baseline, and large enough."""
    return len(new) >= len(old) and all(map(enough, old, new))
