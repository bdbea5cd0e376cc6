"""One row of a baseline against the same row of a candidate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

import msgspec

from heavytop.measure.rounding_noise import least
from heavytop.precision import exact
from heavytop.records import NOISE, NOT_MEASURED, UNSUPPORTED, Identity, Metric, Quantity, Row
from heavytop.report.against import weaker
from heavytop.report.consistency import contradictions, law_text
from heavytop.report.kind import Kinds, kind_of
from heavytop.report.laws import judge_law
from heavytop.report.motion_data import other_data
from heavytop.report.noise import allowed_loss, irreproducible, noisier, of_starts, reaches_further, seldom_apart
from heavytop.report.outcomes import SUCCESS, judge_outcomes
from heavytop.report.policy import BITS, Limits, Lookup, Policy
from heavytop.report.rounding_bound import RoundingBound
from heavytop.report.series import judge_series
from heavytop.report.timings import BAND, judge_repeated
from heavytop.report.verdicts import MISSING, NAN, SAME, Judged, Verdict, beyond_limit, judge, judge_seconds, size

_STEPS = 2
"""The same method with the same setting takes as many steps, and evaluates the field as often: a factor beyond this is
another method."""
_ANOTHER: Judged = (Verdict.INCOMPARABLE, "it says that it is another quantity")


class Finding(msgspec.Struct, frozen=True, gc=False):
    """One metric of one row: verdict, the two values as text, and why.

    name: of the metric, "" for a whole row.  of: "" for a metric, series, growth for the law of one, seconds for a
    timing.
    """

    row: Identity
    name: str
    verdict: Verdict
    baseline: str | None
    candidate: str | None
    reason: str = ""
    of: Literal["", "series", "growth", "seconds"] = ""

    @property
    def metric(self) -> str:
        """What policies and other programs call it: ``drift_energy_max``, ``growth drift_energy``."""
        return f"{self.of} {self.name}".lstrip()

    @property
    def timing(self) -> bool:
        """Whether it is about seconds."""
        return self.of == "seconds"

    def to_json(self) -> dict[str, Any]:
        """The row of `compare --json`."""
        return self.row.named | {
            "metric": self.metric,
            "verdict": self.verdict.value,
            "baseline": self.baseline,
            "candidate": self.candidate,
            "reason": self.reason,
        }


class RowComparison:
    """Compares rows under one policy.

    timed: whether seconds are compared; repeated: whether those of runs that were repeated for it are.
    list_same: False to count what plainly stayed the same, in :attr:`same`.
    failed: rows of the candidate that failed in both reports, in the same way.
    checked: of the baseline and of the candidate, whether each row was found consistent as it was read.
    """

    def __init__(
        self,
        policy: Policy,
        kinds: Kinds,
        timed: bool,
        list_same: bool,
        checked: tuple[bool, bool] = (False, False),
        repeated: bool = False,
    ) -> None:
        self.policy = policy
        self.kinds = kinds
        self.list_same = list_same
        self.checked = checked
        self.same = 0
        self.failed: list[Row] = []
        self.lookup = Lookup(policy)
        self.timed = timed
        self.repeated = repeated

    def ignores(self, row: Row) -> bool:
        """Whether a rule leaves out the row as a whole: one whose pattern takes every metric."""
        return bool(self.policy.rule) and self.lookup.metric(self.lookup.row(row.key.kind, row.case), "").ignore

    def compare(self, old: Row, new: Row) -> list[Finding]:
        """All findings about a row that both reports have."""
        key = old.identity
        if UNSUPPORTED in (old.outcome, new.outcome) and (verdict := _support(old, new)) is not None:
            return [] if self.ignores(old) else self._whole(key, old, new, *verdict)
        if (judged := self._outcomes(old, new)) is not None:
            return [] if self.ignores(old) else [*self._whole(key, old, new, *judged), *self._limits(key, old, new)]
        if reason := self._incomparable(old, new):
            if self.ignores(old):
                return []
            return [Finding(key, "", Verdict.INCOMPARABLE, old.outcome, new.outcome, reason)]
        if new.outcome != SUCCESS and not self.ignores(old):
            self.failed.append(new)
        rules = self.lookup.row(old.key.kind, old.case) if self.policy.rule else ()
        found = self._metrics(key, rules, old, new)
        if old.laws or new.laws:
            found += self._laws(key, rules, old, new)
        if old.series:
            found += self._series(key, rules, old, new)
        if not self.ignores(old):
            found += self._row(key, old, new)
        if self.repeated and BAND in old.seconds:
            found += self._repeated(key, rules, old, new)
        elif self.timed:
            found += self._seconds(key, rules, old, new)
        return found

    def _whole(self, key: Identity, old: Row, new: Row, verdict: Verdict, why: str) -> list[Finding]:
        """The finding about a row that is judged by its outcome."""
        if verdict is Verdict.SAME and new.outcome != UNSUPPORTED:
            self.failed.append(new)
        if verdict is Verdict.SAME and not self.list_same:
            self.same += 1
            return []
        return [Finding(key, "", verdict, old.outcome, new.outcome, why)]

    def _outcomes(self, old: Row, new: Row) -> Judged | None:
        """The verdict of rows of one motion of which one, or both, did not reach the horizon; None else."""
        if old.outcome == new.outcome == SUCCESS or old.key.horizon != new.key.horizon:
            return None
        if None not in (old.data, new.data) and other_data(old.data, new.data):
            return None
        judged = judge_outcomes(old, new, self.lookup.metric((), "").duration)
        return judged if judged is None or not (why := self._inconsistent(old, new)) else (Verdict.INCOMPARABLE, why)

    def _limits(self, key: Identity, old: Row, new: Row) -> Iterator[Finding]:
        """What is beyond its limit in a row that has no numbers in the baseline."""
        if new.outcome == SUCCESS and self.policy.rule:
            rules = self.lookup.row(old.key.kind, old.case)
            for name, metric in new.metrics.items():
                limits = self.lookup.metric(rules, name)
                if not limits.ignore and (judged := beyond_limit(metric, limits)) is not None:
                    yield Finding(key, name, judged[0], None, metric.value, judged[1])

    def _metrics(self, key: Identity, rules: tuple[int, ...], old: Row, new: Row) -> list[Finding]:
        loss = self.lookup.metric((), "").loss
        found = []
        for name, metric in old.metrics.items():
            match = new.metrics.get(name)
            if (
                # most metrics of most reports: two numbers that differ by less than they may under every rule
                not rules
                and match is not None
                and metric.log10 is not None
                and match.log10 is not None
                and metric.kind == match.kind == "error"
                and -loss <= metric.log10 - match.log10 <= loss
                and metric.quantity == match.quantity
                and (match.band == metric.band or (match.band or 9e9) < (metric.band or 0.0))
                and seldom_apart(metric.band)
            ):
                if self.list_same:
                    found.append(Finding(key, name, Verdict.SAME, metric.value, match.value))
                else:
                    self.same += 1
            elif not (limits := self.lookup.metric(rules, name)).ignore:
                if match is None:
                    found.append(Finding(key, name, Verdict.MISSING, metric.value, None, "the metric is missing"))
                    continue
                verdict, why = self._metric(metric, match, limits, old, new)
                found.append(Finding(key, name, verdict, metric.value, match.value, why))
        if new.metrics.keys() != old.metrics.keys():
            found += [
                Finding(key, name, Verdict.NEW, None, metric.value)
                for name, metric in new.metrics.items()
                if name not in old.metrics and not self.lookup.metric(rules, name).ignore
            ]
        return found

    def _metric(self, metric: Metric, match: Metric, limits: Limits, old: Row, new: Row) -> Judged:
        """The noise of the baseline first, then the values, then the noise of the candidate, which is worse where it is
        more than chance and reaches further than that of the baseline.
        """
        if new.outcome != SUCCESS and metric.value == match.value in (NAN, MISSING):
            return SAME  # both stopped before there was one
        least_of = least(old.metrics, metric), least(new.metrics, match)
        kind = kind_of(old, self.kinds)
        bound = RoundingBound(old, kind) if (metric.band or match.band) and kind.noise_is_reruns(metric) else None
        if why := irreproducible(metric, least_of[0], bound):
            return beyond_limit(match, limits) or (Verdict.INCOMPARABLE, f"the baseline is {why}")
        known, found = of_starts(metric, old), of_starts(match, new)
        noise = kind.assumed_band(old.key.subject) if metric.band is None else kind.least_band(old.starts)
        if noise > (known.band or 0.0):
            known = msgspec.structs.replace(known, band=noise)
        eps = self._eps(metric.quantity, old)
        judged = judge(known, found, limits, eps, self.policy.suspicious_digits, least_of, bound)
        changed = judged[0] in (Verdict.WORSE, Verdict.BETTER) and limits.noise and not beyond_limit(match, limits)
        if changed and self._is_by_rounding(metric, match, old):
            return SAME
        if judged[0] in (Verdict.WORSE, Verdict.INCOMPARABLE):
            return judged
        if judged[0] is Verdict.SAME and metric.quantity != match.quantity:
            return _ANOTHER
        if metric.band is not None and match.band is None and match.log10 is not None:
            return Verdict.INCOMPARABLE, f"its noise is not measured, which was {metric.band:.2g} decades"
        why = irreproducible(match, least_of[1], bound)
        if not why and noisier(kind, metric, match, bool(old.reference.until)):
            why = f"noise: {match.band:.2g} decades, not {metric.band:.2g}"
        if why and reaches_further(metric, match, least_of, limits.loss):
            return Verdict.WORSE, why
        return judged

    def _laws(self, key: Identity, rules: tuple[int, ...], old: Row, new: Row) -> Iterator[Finding]:
        for name in dict.fromkeys((*old.laws, *new.laws)):
            limits = self.lookup.metric(rules, f"growth {name}")
            if limits.ignore:
                continue
            a, b = old.laws.get(name), new.laws.get(name)
            judged: Judged
            if a is None or b is None:
                judged = (Verdict.MISSING, "the law is missing") if b is None else (Verdict.NEW, "")
            else:
                # the same series again has no other roundings, so that another law of it is no chance
                rerun = name in old.series and name in new.series and old.series[name] != new.series[name]
                judged = judge_law(a, b, self._noise(name, old, limits), rerun)
                if judged[0] is Verdict.SAME and a.quantity != b.quantity:
                    judged = _ANOTHER
            before, after = (None if law is None else law_text(law) for law in (a, b))
            yield Finding(key, name, judged[0], before, after, judged[1], "growth")

    def _series(self, key: Identity, rules: tuple[int, ...], old: Row, new: Row) -> Iterator[Finding]:
        """What changed in a series: that of a candidate which is the same is not a finding."""
        for name, series in old.series.items():
            limits = self.lookup.metric(rules, f"series {name}")
            match = new.series.get(name)
            if limits.ignore or match == series:
                continue
            if match is None:
                before = f"{len(series.values)} samples"
                yield Finding(key, name, Verdict.MISSING, before, None, "it is missing", "series")
                continue
            exactly = any(metric.kind == "value" for metric in _of_series(name, old, "max", "final"))
            allowed = limits.value if exactly else max(limits.loss, self._noise(name, old, limits))
            if not exactly and limits.noise and self._is_series_by_rounding(name, old, new):
                allowed = math.inf
            judged = judge_series(series, match, allowed, limits.floor + self._eps(series.quantity, old), exactly)
            if judged[0] is Verdict.SAME and series.quantity != match.quantity:
                judged = _ANOTHER
            if judged[0] is not Verdict.SAME:
                found = [f"{len(each.values)} samples" for each in (series, match)]
                yield Finding(key, name, judged[0], found[0], found[1], judged[1], "series")

    def _row(self, key: Identity, old: Row, new: Row) -> Iterator[Finding]:
        """What makes numbers of a row incomparable beside the numbers themselves."""
        if old.finite and not new.finite:
            yield Finding(key, "", Verdict.WORSE, "finite", "not finite", "a value is no longer finite")
        if old.steps != new.steps and self.policy.flags != "ignore":
            few, many = sorted((old.steps, new.steps))
            if few * _STEPS < many:
                yield Finding(key, "", Verdict.INCOMPARABLE, str(old.steps), str(new.steps), "other steps")
        if old.evaluations is not None and self.policy.flags != "ignore":
            counts = [row.evaluations or 0 for row in (old, new)]
            if min(counts) * _STEPS < max(counts):
                before, after = (str(row.evaluations) for row in (old, new))
                yield Finding(key, "", Verdict.INCOMPARABLE, before, after, "other evaluations of the field")
        if old.order != new.order and self.policy.flags != "ignore":
            yield Finding(key, "", Verdict.INCOMPARABLE, str(old.order), str(new.order), "another order")
        fewer = _STEPS if kind_of(old, self.kinds).samples_are_steps else 1
        needed, found = -(-_samples(old) // fewer), _samples(new)
        if found < needed:
            why = "fewer samples: the largest of them is smaller"
            yield Finding(key, "", Verdict.INCOMPARABLE, f"{_samples(old)} samples", f"{found} samples", why)
        rounded = old.input_rounding
        if rounded is not None and new.input_rounding != rounded:
            eps = exact(2) ** (1 - old.bits)
            if new.input_rounding is None or exact(new.input_rounding) > max(exact(rounded), eps):
                why = "the data were rounded by more"
                yield Finding(key, "", Verdict.INCOMPARABLE, rounded, new.input_rounding, why)

    def _seconds(self, key: Identity, rules: tuple[int, ...], old: Row, new: Row) -> Iterator[Finding]:
        for name in sorted(old.seconds.keys() & new.seconds.keys()):
            if not self.lookup.metric(rules, f"seconds {name}").ignore:
                verdict, why = judge_seconds(old.seconds[name], new.seconds[name], self.policy.timings)
                before, after = (f"{row.seconds[name]:.3g} s" for row in (old, new))
                yield Finding(key, name, verdict, before, after, why, "seconds")

    def _repeated(self, key: Identity, rules: tuple[int, ...], old: Row, new: Row) -> Iterator[Finding]:
        """The seconds of runs that were repeated for a comparison; all count as one metric in a rule for ``run``."""
        limits = self.lookup.metric(rules, "seconds run")
        if not limits.ignore:
            for name, judged in judge_repeated(old.seconds, new.seconds, self.policy.timings.ratio, limits.noise):
                before, after = (f"{row.seconds[name]:.3g} s" if name in row.seconds else None for row in (old, new))
                yield Finding(key, name, judged[0], before, after, judged[1], "seconds")

    def _incomparable(self, old: Row, new: Row) -> str:
        """Why two rows cannot be compared; empty where they can."""
        if reason := self._inconsistent(old, new):
            return reason
        if old.horizon != new.horizon and exact(old.horizon) != exact(new.horizon):
            return f"horizon {old.horizon} against {new.horizon}"
        if old.bits != new.bits:
            return f"{old.bits} bits against {new.bits}"
        if old.starts != new.starts:
            return f"{old.starts} starts against {new.starts}"
        if reason := other_data(old.data, new.data):
            return reason
        if (old.steps == 0) != (new.steps == 0):
            return f"{old.steps} steps against {new.steps}"
        if old.flags != new.flags and self.policy.flags != "ignore":
            names = [n for n in sorted({*old.flags, *new.flags}) if old.flags.get(n) != new.flags.get(n)]
            return "flags differ: " + ", ".join(f"{n} {old.flags.get(n)} -> {new.flags.get(n)}" for n in names)
        if old.measured != new.measured:
            return f"{old.measured or 'nothing'} is measured, and {new.measured or 'nothing'}"
        return weaker(old.reference, new.reference)

    def _inconsistent(self, old: Row, new: Row) -> str:
        """What in one of the rows contradicts something else in it."""
        for row, which, checked in zip((old, new), ("baseline", "candidate"), self.checked, strict=True):
            if not checked and (problem := next(contradictions(row, kind_of(row, self.kinds)), "")):
                return f"the {which} contradicts itself: {problem}"
        return ""

    def _eps(self, quantity: Quantity | None, row: Row) -> float:
        """log10 of the eps of a row, or of what its roundings add up to."""
        return (1 - row.bits) * BITS + kind_of(row, self.kinds).roundings(quantity, row.steps)

    def _is_by_rounding(self, metric: Metric, match: Metric, old: Row) -> bool:
        """Of a row whose noise was not measured: whether roundings alone make errors as large as either of the two."""
        if old.flags.get(NOISE) != NOT_MEASURED or None in (metric.log10, match.log10) or metric.kind != "error":
            return False
        kind = kind_of(old, self.kinds)
        largest = max(size(metric), size(match))
        return kind.noise_is_reruns(metric) and RoundingBound(old, kind).explains(metric.quantity, largest)

    def _is_series_by_rounding(self, name: str, old: Row, new: Row) -> bool:
        """The same of what a series is largest."""
        pairs = zip(_of_series(name, old, "max"), _of_series(name, new, "max"), strict=False)
        found = [self._is_by_rounding(metric, match, old) for metric, match in pairs]
        return bool(found) and all(found)

    def _noise(self, name: str, row: Row, limits: Limits) -> float:
        """Decades by which noise may move what a series or a law is about: as the metrics of its quantity."""
        bands = [of_starts(metric, row) for metric in _of_series(name, row, "final", "rms", "max") if metric.band]
        widest = max((allowed_loss(metric, metric) for metric in bands), default=0.0)
        return limits.noise * max(widest, kind_of(row, self.kinds).assumed_band(row.key.subject))


def _support(old: Row, new: Row) -> tuple[Verdict, str] | None:
    """The verdict where a row was or is not supported; None where the other was not measured either."""
    if old.outcome == new.outcome:
        return Verdict.SAME, ""
    if new.outcome == UNSUPPORTED:
        return (Verdict.WORSE, "no longer supported") if old.outcome == "success" else None
    return (Verdict.BETTER, "now supported") if new.outcome == "success" else None


def _samples(row: Row) -> int:
    """How many samples the largest values of a row are over; at least those of its series, where it does not say."""
    return row.samples or max((len(series.times) for series in row.series.values()), default=0)


def _of_series(name: str, row: Row, *statistics: str) -> list[Metric]:
    """The metrics of a row that sum up its series of that name."""
    found = ((metric.quantity, metric) for metric in row.metrics.values())
    return [metric for q, metric in found if q and q.statistic in statistics and q.over("").text == name]
