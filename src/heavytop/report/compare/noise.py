"""Noise bands in a comparison: the loss that they allow, and candidates noisier by more than chance.

The allowed loss follows from the baseline: a candidate must not excuse itself.  And no band excuses a loss larger than
step control makes of a rounding, unless rounding explains it.

A band is itself an estimate from 16 runs, or from the starts of an ensemble.  The ratio of two such estimates is at
most 4.2 (drift), 4.4 (growth) and 5.7 (homoclinic, where one random amplitude decides everything) in 175,000 pairs:
`validation/false_alarms.py`.  Each kind's ``noise_factor`` is above that.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from fnmatch import translate
from fractions import Fraction
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Literal

import msgspec

from heavytop.errors import InputError, invalid
from heavytop.files import read_whole, readable
from heavytop.measure.scorer import SOLUTION_ERROR
from heavytop.precision import exact, log10, physical
from heavytop.records import Metric, Row
from heavytop.report.document.document import clip
from heavytop.report.document.kind import ReportedKind

# Policies: when two numbers count as the same, by default or by a TOML file of rules.  docs/compare.md shows every key.


BITS = math.log10(2)
"""Decades in one bit."""
_LOSS = 2 * BITS
"""Allowed growth of an error where the policy gives none."""
_TENTH = math.log10(1.1)
"""Allowed growth of a truncation error, which is the same on every machine."""
_REMEDY = "`heavytop docs compare` shows every key of a policy."


class Allowance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The allowance of one metric.  Numbers are exact text or TOML numbers; unset ones are taken from the whole policy.

    floor: errors below floor·eps of the row's format are all the same.
    loss_bits or loss_digits: allowed growth of an error; by default 2 bits, for a truncation error a tenth.
    noise: allowed growth in units of the noise band, where the rows have one; 0 ignores bands.
    duration: fraction by which a duration may shrink.  value: relative difference allowed for a value that must agree.
    """

    floor: str | float | None = None
    loss_bits: str | float | None = None
    loss_digits: str | float | None = None
    noise: str | float | None = None
    duration: str | float | None = None
    value: str | float | None = None

    def __post_init__(self) -> None:
        if self.loss_bits is not None and self.loss_digits is not None:
            raise InputError("loss_bits and loss_digits were given.", "Give one of them.")
        for name in ("floor", "loss_bits", "loss_digits", "noise", "duration", "value"):
            if (value := getattr(self, name)) is not None:
                _not_negative(name, value)
                if name == "duration" and physical(value, name) > 1:
                    raise InputError(f"duration must be at most 1; got {value}.", "Give a fraction: 0.05 is 5 %.")


class Rule(Allowance, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An allowance for the metrics whose measure, case and name match these glob patterns; the first match counts.

    ignore: such metrics are left out.  limit: a larger error, or a shorter duration, is worse whatever the baseline.
    """

    measure: str = "*"
    case: str = "*"
    metric: str = "*"
    ignore: bool = False
    limit: str | float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for pattern in (self.measure, self.case, self.metric):
            glob(pattern)
        if self.limit is not None:
            _not_negative("limit", self.limit)
        if self.metric.startswith("seconds"):
            for name in ("limit", "floor", "loss_bits", "loss_digits", "duration", "value"):
                if getattr(self, name) is not None:
                    raise InputError(f"{name} was given for seconds.", "Give their ratio and floor in [timings].")

    @property
    def text(self) -> str:
        """Its patterns, apart from those that match everything: ``case = "euler", metric = "drift_*"``."""
        patterns = {"measure": self.measure, "case": self.case, "metric": self.metric}
        return ", ".join(f'{key} = "{clip(pattern, 40)}"' for key, pattern in patterns.items() if pattern != "*")


class Timings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether seconds are compared: never, between runs of one machine, or always.  They may grow by ``ratio``; below
    ``floor`` seconds all are the same.

    Those of a plan with ``timings = true`` are compared wherever processor and versions agree, without a floor.
    """

    compare: Literal["never", "same-machine", "always"] = "never"
    ratio: float = 1.5
    floor: float = 0.1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.ratio) and self.ratio >= 1):
            raise InputError(f"timings ratio must be at least 1; got {self.ratio}.", _REMEDY)
        _not_negative("timings floor", self.floor)


class Policy(Allowance, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The allowance of every metric that no rule is about, and the rules.

    flags: whether rows whose flags changed are incomparable.
    """

    floor: str | float | None = 4
    loss_bits: str | float | None = None
    noise: str | float | None = 2
    duration: str | float | None = 0.05
    value: str | float | None = 1e-6
    flags: Literal["incomparable", "ignore"] = "incomparable"
    timings: Timings = msgspec.field(default_factory=Timings)
    rule: tuple[Rule, ...] = ()


class Limits(msgspec.Struct, frozen=True):
    """The limits of one metric, in decades: log10 of the floor in eps; allowed loss, also of a truncation error;
    factor of the band; fractions of durations and values; log10 of the limit; whether it is ignored.
    """

    floor: float
    loss: float
    truncation: float
    noise: float
    duration: float
    value: float
    limit: float | None = None
    ignore: bool = False


class Lookup:
    """The limits of each metric of a row under a policy, cached.

    usual: those of metrics without a rule.  unused: the rules that apply to no metric of the rows so far, by their
    place.  hidden: the places of those that match some, each of which an earlier rule matches.
    """

    def __init__(self, policy: Policy) -> None:
        self.usual = _limits(Rule(), policy)
        self.unused = dict(enumerate(policy.rule))
        self.hidden: set[int] = set()
        self._rules = [(_patterns(rule), _limits(rule, policy)) for rule in policy.rule]
        self._known: dict[tuple[str, str, str], Limits] = {}

    def __call__(self, row: Row, metric: str) -> Limits:
        """The limits of a metric of a row: those of the first rule that matches it."""
        if not self._rules:
            return self.usual
        key = row.key.kind, row.case, metric
        if key not in self._known:
            matching = (limits for patterns, limits in self._rules if all(map(re.Pattern.fullmatch, patterns, key)))
            self._known[key] = next(matching, self.usual)
        return self._known[key]

    def note(self, row: Row) -> None:
        """Removes the rules that apply to something in the row from the unused ones."""
        if not self.unused:
            return
        parts = (f"series {name}" for name in row.series), (f"growth {name}" for name in row.laws)
        for name in chain(("", "seconds run"), row.metrics, *parts):
            key = row.key.kind, row.case, name
            matching = [
                i for i, (patterns, _) in enumerate(self._rules) if all(map(re.Pattern.fullmatch, patterns, key))
            ]
            self.hidden.update(matching[1:])
            if matching:
                self.unused.pop(matching[0], None)

    @property
    def remarks(self) -> Iterator[str]:
        """A sentence on each rule that was not applied."""
        for place, rule in self.unused.items():
            why = "is not applied: earlier rules match the same metrics" if place in self.hidden else "matches nothing"
            yield f"The rule of the policy with {rule.text} {why}."


def _patterns(rule: Rule) -> tuple[re.Pattern[str], re.Pattern[str], re.Pattern[str]]:
    return glob(rule.measure), glob(rule.case), glob(rule.metric)


def load(path: Path) -> Policy:
    """The policy in a TOML file; raises InputError for a key that is unknown, a negative number, an empty pattern."""
    with readable(f"The policy {str(path)[:200]}", "Give a TOML file."):
        text = read_whole(path).decode("utf-8")
    try:
        return msgspec.convert(tomllib.loads(text), Policy)
    except InputError as error:
        raise InputError(f"The policy {path} is not valid: {error.cause}", error.remedy) from None
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"The policy {path} is not valid: {invalid(error, Policy)}.", _REMEDY) from None


def adjusted(policy: Policy, floor: str | None = None, loss_bits: str | None = None) -> Policy:
    """The policy with another floor or loss for metrics without a rule; raises InputError for a negative one."""
    if floor is not None:
        policy = msgspec.structs.replace(policy, floor=floor)
    if loss_bits is not None:
        policy = msgspec.structs.replace(policy, loss_bits=loss_bits, loss_digits=None)
    return policy


def _limits(rule: Rule, policy: Policy) -> Limits:
    def number(name: str) -> Fraction:
        return exact(getattr(policy if getattr(rule, name) is None else rule, name))

    losses = policy if rule.loss_digits is None and rule.loss_bits is None else rule
    if losses.loss_digits is not None:
        loss = truncation = float(exact(losses.loss_digits))
    elif losses.loss_bits is not None:
        loss = truncation = float(exact(losses.loss_bits)) * BITS
    else:
        loss, truncation = _LOSS, _TENTH
    noise, duration, value = (float(number(name)) for name in ("noise", "duration", "value"))
    limit = None if rule.limit is None else log_of(rule.limit)
    return Limits(log_of(number("floor")), loss, truncation, noise, duration, value, limit, rule.ignore)


@lru_cache(1 << 12)
def log_of(number: str | float | Fraction | None) -> float:
    """log10 |number|, 0 for None, -inf for 0; nan for text that is not a number, which is within no bound."""
    try:
        size = 0.0 if number is None else log10(exact(number))
    except InputError:
        return math.nan
    return -math.inf if size is None else size


def _not_negative(name: str, value: str | float) -> None:
    if physical(value, name) < 0:
        shown = f"{value:g}" if isinstance(value, float) else value
        raise InputError(f"{name} must not be negative; got {shown}.", "Give 0 or more.")


@lru_cache
def glob(pattern: str) -> re.Pattern[str]:
    """A pattern of `*`, `?` and `[...]`; raises InputError for an empty one, or one whose bracket is not closed."""
    if not pattern or pattern.count("[") > pattern.count("]"):
        raise InputError(f"A pattern must be a glob; got {pattern!r}.", "Use *, ? and [...], such as drift_*_max.")
    return re.compile(translate(pattern))


_BY_CHANCE = 1.4
"""One rerun in ten has a band wider by more than this factor, up to which the candidate's band is allowed for."""
_LEAST_BAND = 0.05
"""Decades.  A narrower band allows nothing beyond the allowed loss; its own scatter is irrelevant."""
_LEAST_BAND_LOST = 0.3
"""Decades, where all significant digits are lost before the end: the errors are as large as the motion, and a rerun
that returns near the motion by chance determines the band."""
STEP_CONTROL = 1.2
"""Decades.  A rounding may change the steps chosen by step control, and so the truncation error by this at most: no
band excuses a larger loss that rounding does not explain."""


def allowed_loss(old: Metric, new: Metric) -> float:
    """Half-width in decades of the 95 % interval of the ratio, for a change to the worse.

    Both bands in quadrature, that of the candidate no wider than 1.4 times that of the baseline.
    """
    band = old.band or 0.0
    return math.hypot(band, min(_BY_CHANCE * band, new.band or 0.0))


def allowed_gain(old: Metric, new: Metric) -> float:
    """Half-width in decades for a change to the better, with both bands as they are."""
    return math.hypot(old.band or 0.0, new.band or 0.0)


def of_starts(metric: Metric, row: Row) -> Metric:
    """The metric with its band; over n starts that of the widest component of its error: a motion that amplifies one
    start more than the others carries errors from each component to the others.

    No wider than ½ log10 n, the most by which one start can raise a RMS.
    """
    if row.starts == 1 or metric.band is None:
        return metric
    band = metric.band
    if metric.quantity is not None and metric.quantity.name == SOLUTION_ERROR:
        parts = (
            metric for metric in row.metrics.values() if metric.quantity and metric.quantity.name == SOLUTION_ERROR
        )
        band = max(metric.band or 0.0 for metric in parts)
    return msgspec.structs.replace(metric, band=min(band, math.log10(row.starts) / 2))


def apart(size: float, gap: float) -> float:
    """log10 of 10^(size + gap) − 10^size."""
    return size + gap + math.log10(-math.expm1(-gap * math.log(10))) if gap > 0 else -math.inf


def reaches_further(old: Metric, new: Metric, least: tuple[float, float], loss: float) -> bool:
    """Whether value and band of the candidate together exceed those of the baseline: only then its noise counts.

    Noise may offset a gain of the value itself, up to the allowed loss.
    """
    if new.kind == "value":
        return True
    if new.kind == "duration":
        ends = [-math.inf if m.log10 is None else m.log10 - (m.band or 0.0) for m in (old, new)]
        return ends[1] < ends[0]
    before, after = (
        max(floor if m.log10 is None else m.log10, floor) for m, floor in zip((old, new), least, strict=True)
    )
    spared = min(loss, max(0.0, before - after))
    return after + (new.band or 0.0) > before + (old.band or 0.0) + spared


def noisier(kind: ReportedKind, old: Metric, new: Metric, lost: bool = False) -> bool:
    """Whether the candidate's band is wider than the baseline's by more than chance.

    lost: whether the motion has lost all significant digits before the end.
    """
    if old.band is None or new.band is None or new.band <= old.band:
        return False
    factor = kind.noise_factor or 1.0
    if not kind.noise_is_added(old):
        return new.band > factor * max(old.band, _LEAST_BAND_LOST if lost else _LEAST_BAND)
    # added noise is wider in decades where the number is smaller
    return _added(new) > _added(old) + math.log10(factor)


def _added(metric: Metric) -> float:
    """log10 of the noise of a number, in its own unit; -inf where absent."""
    if metric.log10 is None:
        return -math.inf
    return math.log10(10 ** max(metric.band or 0.0, _LEAST_BAND / 10) - 1) + metric.log10
