"""When two numbers count as the same: defaults, or a TOML file of rules.  docs/compare.md shows every key."""

from __future__ import annotations

import math
import re
import tomllib
from fnmatch import translate
from pathlib import Path
from typing import Literal

import msgspec

from heavytop.errors import InputError
from heavytop.precision import exact, log10, physical
from heavytop.suite.files import read_whole

BITS = math.log10(2)
"""Decades in one bit."""
_REMEDY = "docs/compare.md shows every key of a policy."


class Allowance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What one metric may do.  Numbers are exact text or TOML numbers; unset ones are taken from the whole policy.

    floor: errors below floor·eps of the row's format are all the same.
    loss_bits or loss_digits: an error may grow by that much.
    noise: and by that many times its noise band, where the rows hold one; 0 for no band.
    duration: a duration may shrink by that fraction.  value: a value that must agree may be off by that fraction.
    """

    floor: str | float | None = None
    loss_bits: str | float | None = None
    loss_digits: str | float | None = None
    noise: str | float | None = None
    duration: str | float | None = None
    value: str | float | None = None

    def __post_init__(self) -> None:
        if self.loss_bits is not None and self.loss_digits is not None:
            raise InputError("A policy gives both loss_bits and loss_digits.", "Give one of them.")
        for name in ("floor", "loss_bits", "loss_digits", "noise", "duration", "value"):
            if (given := getattr(self, name)) is not None:
                _not_negative(name, given)


class Rule(Allowance, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An allowance for the metrics whose measure, case and name match these glob patterns; the first match counts.

    ignore: such metrics are left out.  limit: an error above it is worse, a duration below it too, whatever was before.
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


class Timings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Seconds compare never, between runs of one machine, or always.  They may grow by ``ratio``; below ``floor``
    seconds all are the same.

    Those of a plan with ``timings = true`` compare wherever processor and versions agree, without a floor.
    """

    compare: Literal["never", "same-machine", "always"] = "never"
    ratio: float = 1.5
    floor: float = 0.1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.ratio) and self.ratio >= 1):
            raise InputError(f"timings ratio = {self.ratio} is not 1 or more.", _REMEDY)
        _not_negative("timings floor", self.floor)


class Policy(Allowance, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The allowance of every metric that no rule is about, and the rules.

    flags: whether rows whose flags changed are incomparable.
    suspicious_digits: a gain of more than that many digits is better, and marked as one to look into.
    """

    floor: str | float | None = 4
    loss_bits: str | float | None = None
    noise: str | float | None = 2
    duration: str | float | None = 0.05
    value: str | float | None = 1e-6
    suspicious_digits: float = 3
    flags: Literal["incomparable", "ignore"] = "incomparable"
    timings: Timings = msgspec.field(default_factory=Timings)
    rule: tuple[Rule, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        _not_negative("suspicious_digits", self.suspicious_digits)


class Limits(msgspec.Struct, frozen=True):
    """The numbers that decide about one metric, in decades: log10 of the floor in eps, allowed loss, factor of the
    band; fractions of durations and values; log10 of the limit; ignored or not.
    """

    floor: float
    loss: float
    noise: float
    duration: float
    value: float
    limit: float | None = None
    ignore: bool = False


class Lookup:
    """The limits of each metric of a policy, each worked out once."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._patterns = [(glob(r.measure), glob(r.case), glob(r.metric)) for r in policy.rule]
        self._of_rule = [_limits(rule, policy) for rule in policy.rule]
        self._of_rest = _limits(Rule(), policy)
        self._found: dict[tuple[tuple[int, ...], str], Limits] = {}

    def row(self, measure: str, case: str) -> tuple[int, ...]:
        """The rules that are about a row."""
        return tuple(
            index for index, (m, c, _) in enumerate(self._patterns) if m.fullmatch(measure) and c.fullmatch(case)
        )

    def metric(self, rules: tuple[int, ...], name: str) -> Limits:
        """The limits of a metric in a row that these rules are about."""
        if not rules:
            return self._of_rest
        key = rules, name
        if key not in self._found:
            first = next((i for i in rules if self._patterns[i][2].fullmatch(name)), None)
            self._found[key] = self._of_rest if first is None else self._of_rule[first]
        return self._found[key]


def load(path: Path) -> Policy:
    """The policy in a TOML file; raises InputError for a key that is unknown, a negative number, an empty pattern."""
    try:
        return msgspec.convert(tomllib.loads(read_whole(path).decode("utf-8")), Policy)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"The policy {str(path)[:200]} cannot be read: {reason}.", "Give a TOML file.") from None
    except InputError as error:
        raise InputError(f"The policy {path} is not valid: {error.cause}", error.remedy) from None
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"The policy {path} is not valid: {error}.", _REMEDY) from None


def adjusted(policy: Policy, floor: str | None = None, loss_bits: str | None = None) -> Policy:
    """The policy with another floor or loss for what no rule is about; raises InputError for a negative one."""
    if floor is not None:
        policy = msgspec.structs.replace(policy, floor=floor)
    if loss_bits is not None:
        policy = msgspec.structs.replace(policy, loss_bits=loss_bits, loss_digits=None)
    return policy


def _limits(rule: Rule, policy: Policy) -> Limits:
    def number(name: str) -> float:
        given = getattr(rule, name)
        return float(exact(getattr(policy, name) if given is None else given))

    digits, bits = rule.loss_digits, rule.loss_bits
    if digits is None and bits is None:
        digits, bits = policy.loss_digits, policy.loss_bits
    if digits is None and bits is None:
        bits = 2
    loss = float(exact(digits)) if digits is not None else float(exact(bits)) * BITS
    floor = log10(exact(policy.floor if rule.floor is None else rule.floor))
    limit = None if rule.limit is None else log10(exact(rule.limit))
    return Limits(
        -math.inf if floor is None else floor,
        loss,
        number("noise"),
        number("duration"),
        number("value"),
        -math.inf if rule.limit is not None and limit is None else limit,
        rule.ignore,
    )


def _not_negative(name: str, given: str | float) -> None:
    if physical(exact(given), name) < 0:
        shown = f"{given:g}" if isinstance(given, float) else given
        raise InputError(f"{name} = {shown} is negative.", "Give 0 or more.")


def glob(pattern: str) -> re.Pattern[str]:
    """A pattern of `*`, `?` and `[...]`; raises InputError for an empty one, or one whose bracket is not closed."""
    if not pattern or pattern.count("[") > pattern.count("]"):
        raise InputError(f"{pattern!r} is no glob pattern.", "Use *, ? and [...], such as drift_*_max.")
    return re.compile(translate(pattern))
