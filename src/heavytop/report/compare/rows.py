"""Comparison of a row of a baseline with the same row of a candidate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from operator import sub
from statistics import median
from typing import Any, Literal

import msgspec

from heavytop.integrate.registry import is_third_party
from heavytop.measure.growth import BENT, CLASSES, Interval
from heavytop.measure.rounding_bound import RoundingBound
from heavytop.measure.rounding_noise import least
from heavytop.measure.scalar import UNRESOLVED
from heavytop.measure.scorer import OBSERVED_ORDER
from heavytop.precision import exact
from heavytop.records import (
    HEYOKA,
    NOISE,
    NOT_MEASURED,
    UNRESOLVED_SECONDS,
    UNSUPPORTED,
    Identity,
    Law,
    Metric,
    Quantity,
    Row,
    Series,
)
from heavytop.report.compare.noise import (
    BITS,
    STEP_CONTROL,
    Limits,
    Lookup,
    Policy,
    allowed_loss,
    apart,
    log_of,
    noisier,
    of_starts,
    reaches_further,
)
from heavytop.report.compare.verdicts import (
    BAND,
    MISSING,
    NAN,
    SAME,
    SUCCESS,
    Judged,
    Verdict,
    beyond_limit,
    judge,
    judge_outcomes,
    judge_repeated,
    judge_seconds,
    judge_support,
    size,
    weaker,
)
from heavytop.report.document.kind import Kinds, ReportedKind, kind_of
from heavytop.report.store.checks import (
    contradictions,
    inconsistent,
    interval_of,
    law_text,
    log_sizes,
    other_data,
    other_request,
)

# Comparison of growth laws.


_GROWTH = (*CLASSES, "exponential")
_WIDER = 5.0
"""Allowed ratio of the widths of intervals of two runs: in 1,400 pairs of ensembles of 16 starts it is below 4.2."""
_SPAN = 2.0
"""Factor by which the fitted span of a rerun may begin later or end earlier."""
_DETECTS = math.log10(8)
"""Decades.  In the same pairs the smallest detectable fault grows by a factor of 6.6 at most."""
_BY_CHANCE = 1.4
"""Factor by which the interval of a rerun may be wider than that of the baseline by chance, as its noise bands may."""
_EXPONENT_GAP = 0.1
"""Least gap between the exponents of two runs, in widths of the baseline's interval: of the dozens of laws in a report
some intervals just do not overlap.  Figures: docs/compare.md."""
_BEND_GAP = 0.5
"""Least difference of bends, each the difference of two exponents over half of the span."""
_LOST_AT = 0.3
"""Decades by which the time of the last digit may come earlier, beyond the effect of noise in the error itself."""


def judge_law(old: Law, new: Law, noise: float = 0.0, rerun: bool = False) -> Judged:
    """The verdict on two laws: they differ in class, or within a class by exponents or bends with disjoint intervals.

    A law that is resolved in one report only is judged as within a class: of two ensembles of one motion one may bend
    slightly more than a law may.  A loss of information is judged too.
    noise: decades by which noise alone may move the error that the law describes.
    rerun: whether the laws belong to two runs.  Then barely disjoint intervals may be chance, and so may two classes
    with exponents half way between them; for one and the same series they are not.
    """
    for law in (old, new):
        if problem := inconsistent(law):
            return Verdict.INCOMPARABLE, problem
    if old == new:
        return SAME
    if old.growth != new.growth:
        powers = [law.exponent for law in (old, new) if law.exponent is not None and law.growth != "exponential"]
        between_classes = rerun and len(powers) == 2 and abs(powers[1] - powers[0]) <= BENT
        if "unresolved" not in (old.growth, new.growth) and not between_classes:
            worse = _GROWTH.index(new.growth) > _GROWTH.index(old.growth)
            return (Verdict.WORSE if worse else Verdict.BETTER), f"grows like {new.growth} (was {old.growth})"
        if len(powers) < 2:
            return Verdict.INCOMPARABLE, "the growth is resolved in one report only"
    if new.starts < old.starts:
        return Verdict.INCOMPARABLE, f"{old.starts} → {new.starts} starts"
    judged = _judge_exponents(old, new, rerun)
    if judged[0] is Verdict.SAME:
        judged = _judge_bends(old, new, rerun)
    if judged[0] in (Verdict.WORSE, Verdict.INCOMPARABLE):
        return judged
    return _judge_information(old, new, noise) or judged


def _judge_exponents(old: Law, new: Law, rerun: bool) -> Judged:
    if old.exponent is None or new.exponent is None:
        in_one_report = old.exponent is not None or new.exponent is not None
        return (Verdict.INCOMPARABLE, "an exponent in one report only") if in_one_report else SAME
    if old.low is not None and new.low is not None:
        return _judge_intervals("exponent", interval_of(old), interval_of(new), new.exponent, rerun, _EXPONENT_GAP)
    (low, high), (new_low, new_high) = interval_of(old), interval_of(new)
    if new_low > high or new_high < low:
        return Verdict.INCOMPARABLE, "a different exponent, without an interval to judge it"
    return SAME


def _judge_bends(old: Law, new: Law, rerun: bool) -> Judged:
    """The verdict on bends, where only one class is known: two laws of one class bend no more than a law may."""
    if "unresolved" not in (old.growth, new.growth) or old.growth == new.growth:
        return SAME
    if old.bend is None or new.bend is None:
        return Verdict.INCOMPARABLE, "the growth is resolved in one report only, and its curvature is not known in both"
    return _judge_intervals("curvature at the end", old.bend, new.bend, sum(new.bend) / 2, rerun, _BEND_GAP)


def _judge_intervals(quantity: str, old: Interval, new: Interval, middle: float, rerun: bool, gap: float) -> Judged:
    """The verdict on two intervals; that of the candidate, about ``middle``, counts as no wider than the baseline's.

    An interval wider by more than chance is worse.  Those of a rerun must be ``gap`` widths of the baseline's apart.
    """
    width, new_width = (interval[1] - interval[0] for interval in (old, new))
    shrinkage = min(1.0, (_BY_CHANCE if rerun else 1.0) * width / new_width) if new_width > 0 else 1.0
    low, high = (middle + (end - middle) * shrinkage for end in new)
    required = gap * width if rerun else 0.0
    if low - old[1] > required:
        return Verdict.WORSE, f"a larger {quantity}"
    if old[0] - high > required:
        return Verdict.BETTER, f"a smaller {quantity}"
    if new_width > _WIDER * width:
        return Verdict.WORSE, f"noise: the interval of the {quantity} is {new_width:.2g} wide (was {width:.2g})"
    return SAME


def _judge_information(old: Law, new: Law, noise: float) -> Judged | None:
    """The verdict where the candidate's law loses detection power, span, or the time of the last digit; None else."""
    for name in ("first", "last", "detects"):
        if getattr(old, name) is not None and getattr(new, name) is None:
            return Verdict.INCOMPARABLE, f"the law no longer has {name}"
    spans = [log_of(law.first) - log_of(law.last) for law in (old, new)]
    if log_of(new.last) < log_of(old.last) - math.log10(_SPAN) or spans[1] > spans[0] + math.log10(_SPAN):
        return Verdict.INCOMPARABLE, f"fitted from {new.first} to {new.last} (was {old.first} to {old.last})"
    if log_of(new.detects) > log_of(old.detects) + max(_DETECTS, noise):
        return Verdict.WORSE, f"smallest fault detected per step {old.detects} → {new.detects}"
    if "unresolved" in (old.growth, new.growth) and None in (old.lost_at, new.lost_at):
        return None  # an unresolved law is not extrapolated
    if "unresolved" not in (old.growth, new.growth) and old.growth != new.growth:
        return None  # extrapolated with different powers
    if new.lost_at is not None:
        power = CLASSES.get(new.growth, math.inf)
        earlier = (math.inf if old.lost_at is None else log_of(old.lost_at)) - log_of(new.lost_at)
        if earlier > _LOST_AT + (noise / power if power else 0.0):
            before = old.lost_at or "never"
            return Verdict.WORSE, f"all significant digits are lost from t = {new.lost_at} on (was {before})"
    elif old.lost_at is not None:
        return Verdict.INCOMPARABLE, "the law no longer predicts when all significant digits are lost"
    return None


# Comparison of series.


_NOT_NUMBERS = (NAN, MISSING)
_WORDS = frozenset((*_NOT_NUMBERS, UNRESOLVED))
_LOST_SHARE = 10
"""Up to n/10 + 2 of n samples may become unresolved."""


def judge_series(old: Series, new: Series, allowed: float, floor: float, exactly: bool) -> Judged:
    """Require the same times, as many numbers, and no larger ones: single samples are noise, the median ratio is not.

    allowed: decades by which the median ratio may grow; where the series must agree ``exactly`` the allowed difference
    of each value as a fraction of the largest.  floor: log10 below which all errors are the same.
    """
    if old.times != new.times and list(map(exact, old.times)) != list(map(exact, new.times)):
        return Verdict.INCOMPARABLE, "different times"
    before, after = old.values, new.values
    if not (_WORDS.isdisjoint(before) and _WORDS.isdisjoint(after)):
        pairs = list(zip(before, after, strict=True))
        if any(b == NAN and a not in _NOT_NUMBERS for a, b in pairs):
            return Verdict.WORSE, "a value is no longer finite"
        if any(b == MISSING and a not in _NOT_NUMBERS for a, b in pairs):
            return Verdict.INCOMPARABLE, "a value is no longer measured"
        unresolved = sum(b == UNRESOLVED != a for a, b in pairs)
        if unresolved > 2 + len(pairs) / _LOST_SHARE:
            return Verdict.INCOMPARABLE, f"{unresolved} values are no longer resolved"
        numbers = [pair for pair in pairs if _WORDS.isdisjoint(pair)]
        before, after = ([pair[side] for pair in numbers] for side in (0, 1))
    if not before:
        return SAME
    if exactly:
        values = list(zip(map(exact, before), map(exact, after), strict=True))
        tolerance = Fraction(allowed) * max(abs(a) for a, _ in values)
        differs = any(abs(b - a) > tolerance for a, b in values)
        return (Verdict.WORSE, "a value that must be equal differs") if differs else SAME
    sizes = [log_sizes(tuple(texts)) for texts in (before, after)]
    if max(sizes[1]) <= max(floor, min(sizes[0])):
        return SAME
    if min(map(min, sizes)) < floor:
        sizes = [[max(size, floor) for size in part] for part in sizes]
    growth = median(map(sub, sizes[1], sizes[0]))
    return (Verdict.WORSE, f"{growth / BITS:.1f} bits lost at half of the samples") if growth > allowed else SAME


_STEPS = 2
"""Factor: beyond this ratio of steps, or of evaluations of the field, the method must be another one."""
_NO_ORDER = "the errors no longer show an order: they are of rounding, or fall by no one power of the step"
OTHER_QUANTITY: Judged = (Verdict.INCOMPARABLE, "it is declared as a different quantity")


class Finding(msgspec.Struct, frozen=True, gc=False):
    """The verdict on one metric of one row, with the two values as text and the reason.

    name: of the metric, "" for a whole row.  of: "" for a metric; series; growth for the law of a series; seconds for a
    timing.  slight: a loss by truncation that would be allowed of other errors.
    """

    row: Identity
    name: str
    verdict: Verdict
    baseline: str | None
    candidate: str | None
    reason: str = ""
    of: Literal["", "series", "growth", "seconds"] = ""
    slight: bool = False

    @property
    def metric(self) -> str:
        """The name of the metric in policies and other programs: ``drift_energy_max``, ``growth drift_energy``."""
        return f"{self.of} {self.name}".lstrip()

    @property
    def method(self) -> tuple[str, str]:
        """The integrator and its format."""
        return self.row.key.subject.name, self.row.key.precision

    @property
    def of_yardstick(self) -> bool:
        """Whether the row is heyoka's, which is measured beside another integrator for scale."""
        name, _ = self.method
        return name.partition(":")[0] == HEYOKA and not is_third_party(name)

    @property
    def timing(self) -> bool:
        """Whether the metric is a timing."""
        return self.of == "seconds"

    def to_json(self) -> dict[str, Any]:
        """The row of `compare --json`."""
        versions = {"versions": self.row.versions} if self.row.versions else {}
        return self.row.named | {
            "metric": self.metric,
            "verdict": self.verdict.value,
            "baseline": self.baseline,
            "candidate": self.candidate,
            "reason": self.reason,
            **versions,
        }


@dataclass
class RowPair:
    """A row of the baseline and the same row of the candidate, with the kind of both."""

    old: Row
    new: Row
    kind: ReportedKind

    @cached_property
    def key(self) -> Identity:
        """The identity of both, with the two versions of a program that has them."""
        versions = self.old.key.subject.version, self.new.key.subject.version
        return self.old.identity._replace(versions=versions if all(versions) else ())

    @cached_property
    def bound(self) -> RoundingBound:
        """The bound of the rounding errors of both."""
        return RoundingBound(self.old, self.kind.largest_amplification)

    def eps(self, quantity: Quantity | None) -> float:
        """log10 of the eps of the rows, or of the sum of their roundings."""
        return (1 - self.old.bits) * BITS + self.kind.roundings(quantity, self.old.steps)

    def noise(self, name: str, limits: Limits) -> float:
        """Decades by which noise may move a series or its law: those of the metrics that summarize it."""
        metrics = (of_starts(metric, self.old) for metric in summaries(self.old, name, "max", "rms", "final"))
        widest = max((allowed_loss(metric, metric) for metric in metrics if metric.band), default=0.0)
        return limits.noise * max(widest, self.kind.assumed_band(self.old.key.subject))

    def is_by_rounding(self, metric: Metric, match: Metric) -> bool:
        """Whether rounding alone explains both errors, in a row whose noise was not measured."""
        if self.old.flags.get(NOISE) != NOT_MEASURED or None in (metric.log10, match.log10) or metric.kind != "error":
            return False
        largest = max(size(metric), size(match))
        return self.kind.noise_is_reruns(metric) and self.bound.explains(metric.quantity, largest)

    def is_truncation(self, metric: Metric, match: Metric) -> bool:
        """Whether two errors differ by truncation: with the same steps, by more than rounding explains.

        Without a requested step size and without reruns that measure rounding noise, equal evaluations show that the
        steps are the same: they include the steps that step control rejects.
        """
        old, new, subject = self.old, self.new, self.old.key.subject
        if metric.kind != "error" or metric.log10 is None or match.log10 is None:
            return False
        reruns = metric.band is not None and self.kind.noise_is_reruns(metric)
        same_steps = (old.steps, old.evaluations) == (new.steps, new.evaluations)
        if not (same_steps and (subject.step or (old.steps and (old.evaluations or reruns)))):
            return False
        if not (reruns or self.kind.assumed_band(subject)):
            return False
        low, high = sorted((metric.log10, match.log10))
        return not self.bound.explains(metric.quantity, apart(low, high - low))


@dataclass
class RowComparison:
    """Compares rows under one policy.

    timed: whether seconds are compared; repeated: whether those of repeated runs are.
    list_same: False to count unchanged metrics in :attr:`same` instead of listing them.
    failed: rows of the candidate that failed in both reports, in the same way.  unsupported: the number of rows that
    are not supported in both.  moved: whether any metric of a row is not equal.  steps: the largest
    relative change of the steps of a row.
    checked: of the baseline and of the candidate, whether each row was already checked on reading.
    """

    policy: Policy
    kinds: Kinds
    timed: bool
    list_same: bool
    checked: tuple[bool, bool] = (False, False)
    repeated: bool = False
    same: int = field(default=0, init=False)
    failed: list[Row] = field(default_factory=list, init=False)
    unsupported: int = field(default=0, init=False)
    moved: bool = field(default=False, init=False)
    steps: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self.limits = Lookup(self.policy)

    def extend(self, later: RowComparison) -> None:
        """Adds the counts and failures of the rows that follow, and the rules applied to them."""
        self.same += later.same
        self.failed += later.failed
        self.unsupported += later.unsupported
        self.moved |= later.moved
        self.steps = max(self.steps, later.steps)
        self.limits.hidden |= later.limits.hidden
        self.limits.unused = {i: rule for i, rule in self.limits.unused.items() if i in later.limits.unused}

    def ignores(self, row: Row) -> bool:
        """Whether a rule ignores the whole row: one whose pattern matches every metric."""
        self.limits.note(row)
        return self.limits(row, "").ignore

    def compare(self, old: Row, new: Row) -> list[Finding]:
        """All findings about a row that both reports have."""
        pair = RowPair(old, new, kind_of(old, self.kinds))
        ignored = self.ignores(old)
        self.limits.note(new)
        if (judged := self._outcomes(old, new)) is not None:
            return [] if ignored else [*self._whole_row(pair, judged), *self._limits(pair)]
        if reason := self._incomparable(old, new):
            return [] if ignored else self._whole_row(pair, (Verdict.INCOMPARABLE, reason))
        if new.outcome != SUCCESS and not ignored:
            self.failed.append(new)
        self.moved = self.moved or old.metrics != new.metrics
        if old.steps != new.steps and not ignored:
            self.steps = max(self.steps, abs(new.steps / old.steps - 1))
        findings = self._metrics(pair)
        if old.laws or new.laws:
            findings += self._laws(pair)
        if old.series is not new.series:
            findings += self._series(pair)
        if not ignored:
            findings += self._row(pair)
        if self.timed or self.repeated:
            findings += self._seconds(pair)
        return findings

    def _whole_row(self, pair: RowPair, judged: Judged) -> list[Finding]:
        """The finding about a row that is judged as a whole."""
        if judged[0] is Verdict.SAME and pair.new.outcome == UNSUPPORTED:
            self.unsupported += 1
        elif judged[0] is Verdict.SAME:
            self.failed.append(pair.new)
        if judged[0] is Verdict.SAME and not self.list_same:
            self.same += 1
            return []
        return [Finding(pair.key, "", judged[0], pair.old.outcome, pair.new.outcome, judged[1])]

    def _outcomes(self, old: Row, new: Row) -> Judged | None:
        """The verdict on rows of one motion of which at least one did not reach the horizon; None else."""
        if old.outcome == new.outcome == SUCCESS:
            return None
        if UNSUPPORTED in (old.outcome, new.outcome) and (support := judge_support(old, new)) is not None:
            return support
        if old.key.horizon != new.key.horizon or other_request(old, new):
            return None
        if None not in (old.data, new.data) and other_data(old.data, new.data):
            return None
        judged = judge_outcomes(old, new, self.limits.usual.duration)
        return judged if judged is None or not (why := self._inconsistent(old, new)) else (Verdict.INCOMPARABLE, why)

    def _limits(self, pair: RowPair) -> Iterator[Finding]:
        """Findings of metrics beyond their limits in a row that has no numbers in the baseline."""
        if pair.new.outcome == SUCCESS and pair.old.outcome != UNSUPPORTED and self.policy.rule:
            for name, metric in pair.new.metrics.items():
                limits = self.limits(pair.old, name)
                if not limits.ignore and (judged := beyond_limit(metric, limits)) is not None:
                    yield Finding(pair.key, name, judged[0], None, metric.value, judged[1])

    def _metrics(self, pair: RowPair) -> list[Finding]:
        old, new, usual = pair.old, pair.new, self.limits.usual
        findings = []
        for name, metric in old.metrics.items():
            match, limits = new.metrics.get(name), self.limits(old, name)
            if limits is usual and match is not None and self._is_plainly_same(pair, metric, match):
                if self.list_same:
                    findings.append(Finding(pair.key, name, Verdict.SAME, metric.value, match.value))
                else:
                    self.same += 1
            elif not limits.ignore:
                if match is None:
                    order = metric.quantity is not None and metric.quantity.name == OBSERVED_ORDER.name
                    reason = _NO_ORDER if order else "the metric is missing"
                    findings.append(Finding(pair.key, name, Verdict.MISSING, metric.value, None, reason))
                    continue
                verdict, why = self._metric(pair, metric, match, limits)
                slight = (  # a loss of truncation alone
                    verdict is Verdict.WORSE
                    and limits.truncation < size(match) - size(metric) <= limits.loss
                    and beyond_limit(match, limits) is None
                    and pair.is_truncation(metric, match)
                )
                findings.append(Finding(pair.key, name, verdict, metric.value, match.value, why, slight=slight))
        if new.metrics.keys() != old.metrics.keys():
            findings += [
                Finding(pair.key, name, Verdict.NEW, None, metric.value)
                for name, metric in new.metrics.items()
                if name not in old.metrics and not self.limits(old, name).ignore
            ]
        return findings

    def _is_plainly_same(self, pair: RowPair, metric: Metric, match: Metric) -> bool:
        """Whether two errors without a rule differ by less than the smallest allowance, as most errors do.

        Then neither truncation nor step control matter, which :meth:`_metric` considers.
        """
        before, after, usual = metric.log10, match.log10, self.limits.usual
        if before is None or after is None or not metric.kind == match.kind == "error":
            return False
        band, new_band, allowed = metric.band, match.band, usual.truncation
        if metric.quantity != match.quantity or (new_band is None and band is not None):
            return False
        if -allowed <= before - after <= allowed and (band == new_band or (new_band or math.inf) < (band or 0.0)):
            return True
        if band is not None and pair.old.starts == pair.new.starts == 1:
            allowed = max(allowed, min(STEP_CONTROL, usual.noise * allowed_loss(metric, match)))
        if abs(before - after) > allowed or metric.bound or match.bound:
            return False
        if (new_band or 0.0) > (band or 0.0) and noisier(pair.kind, metric, match, bool(pair.old.reference.until)):
            return False
        if metric.quantity is None or metric.quantity.statistic != "final":
            return True
        old, new = pair.old.metrics, pair.new.metrics
        return abs(max(before, least(old, metric)) - max(after, least(new, match))) <= allowed

    def _metric(self, pair: RowPair, metric: Metric, match: Metric, limits: Limits) -> Judged:
        """The verdict by the values, then by the noise of the candidate: worse where it exceeds chance, and value and
        noise together exceed those of the baseline.
        """
        old, new, kind = pair.old, pair.new, pair.kind
        if new.outcome != SUCCESS and metric.value == match.value in (NAN, MISSING):
            return SAME  # both stopped before the first value
        smallest = least(old.metrics, metric), least(new.metrics, match)
        bound = pair.bound if (metric.band or match.band) and kind.noise_is_reruns(metric) else None
        old_banded, new_banded = of_starts(metric, old), of_starts(match, new)
        truncated = pair.is_truncation(metric, match)
        assumed = 0.0 if truncated else kind.assumed_band(old.key.subject)
        noise = assumed if metric.band is None else kind.least_band(old.starts)
        if noise > (old_banded.band or 0.0):
            old_banded = msgspec.structs.replace(old_banded, band=noise)
        allowed = msgspec.structs.replace(limits, loss=limits.truncation) if truncated else limits
        floor = limits.floor + pair.eps(metric.quantity)
        judged = judge(old_banded, new_banded, allowed, (max(floor, smallest[0]), max(floor, smallest[1])), bound)
        changed = judged[0] in (Verdict.WORSE, Verdict.BETTER) and limits.noise and not beyond_limit(match, limits)
        if changed and pair.is_by_rounding(metric, match):
            return SAME
        if judged[0] in (Verdict.WORSE, Verdict.INCOMPARABLE):
            return judged
        if judged[0] is Verdict.SAME and metric.quantity != match.quantity:
            return OTHER_QUANTITY
        if metric.band is not None and match.band is None and match.log10 is not None:
            return Verdict.INCOMPARABLE, f"its noise is not measured (was {metric.band:.2g} decades)"
        wider = noisier(kind, metric, match, bool(old.reference.until))
        if wider and reaches_further(metric, match, smallest, limits.loss):
            return Verdict.WORSE, f"noise: {metric.band:.2g} → {match.band:.2g} decades"
        return judged

    def _laws(self, pair: RowPair) -> Iterator[Finding]:
        olds, news, series, new_series = pair.old.laws, pair.new.laws, pair.old.series, pair.new.series
        for name in dict.fromkeys((*olds, *news)):
            limits = self.limits(pair.old, f"growth {name}")
            if limits.ignore:
                continue
            old, new = olds.get(name), news.get(name)
            if old is None or new is None:
                judged = (Verdict.MISSING, "the law is missing") if new is None else (Verdict.NEW, "")
            else:
                # an equal series has equal roundings, so that a different law of it is not chance
                rerun = name in series and name in new_series and series[name] != new_series[name]
                judged = judge_law(old, new, pair.noise(name, limits), rerun)
                if judged[0] is Verdict.SAME and old.quantity != new.quantity:
                    judged = OTHER_QUANTITY
            before, after = (None if law is None else law_text(law) for law in (old, new))
            yield Finding(pair.key, name, judged[0], before, after, judged[1], "growth")

    def _series(self, pair: RowPair) -> Iterator[Finding]:
        """Findings of series that changed; equal ones give none."""
        for name, old in pair.old.series.items():
            limits, new = self.limits(pair.old, f"series {name}"), pair.new.series.get(name)
            if limits.ignore or new == old:
                continue
            judged = (
                (Verdict.MISSING, "it is missing") if new is None else self._judge_series(pair, name, old, new, limits)
            )
            if judged[0] is not Verdict.SAME:
                before, after = (None if one is None else f"{len(one.values)} samples kept" for one in (old, new))
                yield Finding(pair.key, name, judged[0], before, after, judged[1], "series")

    def _judge_series(self, pair: RowPair, name: str, old: Series, new: Series, limits: Limits) -> Judged:
        exactly = any(metric.kind == "value" for metric in summaries(pair.old, name, "max", "final"))
        allowed = limits.value if exactly else max(limits.loss, pair.noise(name, limits))
        floor = limits.floor + pair.eps(old.quantity)
        judged = judge_series(old, new, allowed, floor, exactly)
        if judged[0] is Verdict.WORSE and not exactly and limits.noise:
            largest = list(zip(*(summaries(row, name, "max") for row in (pair.old, pair.new)), strict=False))
            if largest and all(pair.is_by_rounding(*metrics) for metrics in largest):
                judged = judge_series(old, new, math.inf, floor, exactly)
        return OTHER_QUANTITY if judged[0] is Verdict.SAME and old.quantity != new.quantity else judged

    def _row(self, pair: RowPair) -> Iterator[Finding]:
        """Findings, apart from metrics, by which the numbers are incomparable."""
        old, new = pair.old, pair.new
        if old.finite and not new.finite:
            yield Finding(pair.key, "", Verdict.WORSE, "finite", "not finite", "a value is no longer finite")
        counts = (
            ("different steps", old.steps, new.steps, _STEPS),
            ("different evaluations of the field", old.evaluations, new.evaluations, _STEPS),
            ("different order", old.order, new.order, 1),
        )
        for reason, before, after, factor in counts if self.policy.flags != "ignore" else ():
            if before == after or (before is None and factor == _STEPS):
                continue
            few, many = sorted(-1 if count is None else count for count in (before, after))
            if few * factor < many:
                yield Finding(pair.key, "", Verdict.INCOMPARABLE, str(before), str(after), reason)
        samples, new_samples = _samples(old), _samples(new)
        if new_samples < -(-samples // (_STEPS if pair.kind.samples_are_steps else 1)):
            reason, fewer = "fewer samples, so their maximum is smaller", f"{new_samples} samples"
            yield Finding(pair.key, "", Verdict.INCOMPARABLE, f"{samples} samples", fewer, reason)
        rounded = old.input_rounding
        if rounded is not None and new.input_rounding != rounded:
            eps = exact(2) ** (1 - old.bits)
            if new.input_rounding is None or exact(new.input_rounding) > max(exact(rounded), eps):
                reason = "the data were rounded more"
                yield Finding(pair.key, "", Verdict.INCOMPARABLE, rounded, new.input_rounding, reason)

    def _seconds(self, pair: RowPair) -> Iterator[Finding]:
        """Findings about the seconds of repeated runs, or of the fastest of several, as other work only adds seconds.

        A rule for ``run`` applies to all of them.  Not judged: a single run, compilation, which depends on caches, the
        reference, counts, and seconds that a program reports.
        """
        limits, timings = self.limits(pair.old, "seconds run"), self.policy.timings
        old, new = pair.old.seconds, pair.new.seconds
        judged: Iterable[tuple[str, Judged]] = ()
        if self.repeated and BAND in old:
            judged = judge_repeated(old, new, timings.ratio, limits.noise)
        elif self.timed and "least" in old and "least" in new:
            old, new = ({"run": max(part["least"], part.get(UNRESOLVED_SECONDS, 0.0))} for part in (old, new))
            judged = [("run", judge_seconds(old["run"], new["run"], timings))]
        for name, (verdict, why) in judged if not limits.ignore else ():
            before, after = (f"{part[name]:.3g} s" if name in part else None for part in (old, new))
            yield Finding(pair.key, name, verdict, before, after, why, "seconds")

    def _incomparable(self, old: Row, new: Row) -> str:
        """The reason why two rows are incomparable; empty where they are not."""
        if reason := self._inconsistent(old, new):
            return reason
        if old.horizon != new.horizon and exact(old.horizon) != exact(new.horizon):
            return f"horizon {old.horizon} → {new.horizon}"
        if old.bits != new.bits:
            return f"{old.bits} → {new.bits} bits"
        if old.starts != new.starts:
            return f"{old.starts} → {new.starts} starts"
        if reason := other_data(old.data, new.data) or other_request(old, new):
            return reason
        if (old.steps == 0) != (new.steps == 0):
            return f"{old.steps} → {new.steps} steps"
        if old.flags != new.flags and self.policy.flags != "ignore":
            names = [n for n in sorted({*old.flags, *new.flags}) if old.flags.get(n) != new.flags.get(n)]
            return "flags differ: " + ", ".join(f"{n} {old.flags.get(n)} -> {new.flags.get(n)}" for n in names)
        if old.measured != new.measured:
            return f"measured: {old.measured or 'nothing'} → {new.measured or 'nothing'}"
        return weaker(old.reference, new.reference)

    def _inconsistent(self, old: Row, new: Row) -> str:
        """The first contradiction within one of the rows; empty without any."""
        for row, which in () if all(self.checked) else ((old, "baseline"), (new, "candidate")):
            if problem := next(contradictions(row, kind_of(row, self.kinds)), ""):
                return f"the {which} is inconsistent: {problem}"
        return ""


def _samples(row: Row) -> int:
    """The number of samples of a row; where it is not stated that of its longest series."""
    return row.samples or (max(len(series.times) for series in row.series.values()) if row.series else 0)


def summaries(row: Row, series: str, *statistics: str) -> list[Metric]:
    """The metrics of a row that are such statistics of a series."""
    return [
        metric
        for metric in row.metrics.values()
        if (quantity := metric.quantity) and quantity.statistic in statistics and _series_key(quantity) == series
    ]


@lru_cache(1 << 12)
def _series_key(quantity: Quantity) -> str:
    """The key of the series that a quantity summarizes."""
    return quantity.over("").text
