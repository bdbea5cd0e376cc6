"""Baseline against candidate, row by row and metric by metric."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import Metric, Report, Row

_LOG10_2 = math.log10(2)


class Verdict(Enum):
    """What became of a metric, or of a whole row."""

    SAME = "same"
    BETTER = "better"
    WORSE = "worse"
    MISSING = "missing"
    NEW = "new"
    INCOMPARABLE = "incomparable"


@dataclass(frozen=True, slots=True)
class Policy:
    """When two numbers count as the same.

    floor: errors below floor·eps of the row's format are rounding luck and all the same.
    loss: an error may grow by that many bits.  duration: a duration may shrink by that fraction.
    value: a value that must agree may be off by that fraction.
    """

    floor: Fraction = Fraction(4)
    loss: Fraction = Fraction(2)
    duration: Fraction = Fraction(1, 20)
    value: Fraction = Fraction(1, 10**6)

    def __post_init__(self) -> None:
        for name in ("floor", "loss", "duration", "value"):
            if getattr(self, name) < 0:
                raise InputError(f"{name} = {getattr(self, name)} is negative.", "Give 0 or more.")


@dataclass(frozen=True, slots=True)
class Finding:
    """One metric of one row: verdict, the two values as text, and why.  ``metric`` is "" for a whole row."""

    key: tuple[str, ...]
    metric: str
    verdict: Verdict
    baseline: str | None
    candidate: str | None
    reason: str = ""

    def to_json(self) -> dict[str, Any]:
        """The row of `compare --json`."""
        measure, case, system, integrator, precision = self.key
        return {
            "case": case,
            "metric": self.metric,
            "verdict": self.verdict.value,
            "baseline": self.baseline,
            "candidate": self.candidate,
            "reason": self.reason,
            "measure": measure,
            "system": system,
            "integrator": integrator,
            "precision": precision,
        }


@dataclass(frozen=True, slots=True)
class Comparison:
    """All findings, and the differences of the environments."""

    findings: list[Finding]
    environment: list[tuple[str, str, str]]

    @property
    def verdict(self) -> str:
        """worse if anything is; else incomparable if anything is missing or incomparable; else better or same."""
        seen = {finding.verdict for finding in self.findings}
        if Verdict.WORSE in seen:
            return "worse"
        if Verdict.MISSING in seen or Verdict.INCOMPARABLE in seen:
            return "incomparable"
        return "better" if Verdict.BETTER in seen else "same"

    @property
    def exit_code(self) -> int:
        """0, 1 or 3, as for every command."""
        return {"worse": 1, "incomparable": 3}.get(self.verdict, 0)


def compare(baseline: Report, candidate: Report, policy: Policy) -> Comparison:
    """Every row of either report, in the baseline's order, new ones last."""
    findings: list[Finding] = []
    other = {row.key: row for row in candidate.rows}
    for row in baseline.rows:
        match = other.pop(row.key, None)
        if match is None:
            findings.append(Finding(row.key, "", Verdict.MISSING, row.outcome, None, "the row is missing"))
        else:
            findings += _rows(row, match, policy)
    findings += [Finding(key, "", Verdict.NEW, None, row.outcome) for key, row in other.items()]
    if not findings:
        raise InputError("Neither report has a row.", "Compare reports of `heavytop run`.")
    return Comparison(findings, _differences(baseline.environment, candidate.environment))


def _rows(old: Row, new: Row, policy: Policy) -> list[Finding]:
    reason = _incomparable(old, new)
    if reason:
        return [Finding(old.key, "", Verdict.INCOMPARABLE, old.outcome, new.outcome, reason)]
    findings = []
    for name, metric in old.metrics.items():
        match = new.metrics.get(name)
        if match is None:
            findings.append(Finding(old.key, name, Verdict.MISSING, metric.value, None, "the metric is missing"))
        else:
            verdict, why = _metrics(metric, match, Fraction(2) ** (1 - old.bits), policy)
            findings.append(Finding(old.key, name, verdict, metric.value, match.value, why))
    findings += [
        Finding(old.key, name, Verdict.NEW, None, metric.value)
        for name, metric in new.metrics.items()
        if name not in old.metrics
    ]
    return findings


def _incomparable(old: Row, new: Row) -> str:
    """Why two rows cannot be compared; empty where they can."""
    for row, which in ((old, "baseline"), (new, "candidate")):
        if row.outcome != "success":
            return f"the {which} ended as {row.outcome} at t = {row.time_reached}"
    if Fraction(old.horizon) != Fraction(new.horizon):
        return f"horizon {old.horizon} against {new.horizon}"
    if old.bits != new.bits:
        return f"{old.bits} bits against {new.bits}"
    names = sorted(set(old.flags) | set(new.flags))
    changed = [name for name in names if old.flags.get(name) != new.flags.get(name)]
    if changed:
        return "flags differ: " + ", ".join(f"{n} {old.flags.get(n)} -> {new.flags.get(n)}" for n in changed)
    # known is known, whichever closed form or enclosure it was: a better certificate makes no difference
    kinds = [row.against.partition(":")[0].partition(",")[0] for row in (old, new)]
    if kinds[0] != kinds[1]:
        return f"held against {kinds[0]!r} and {kinds[1]!r}"
    return ""


def _metrics(old: Metric, new: Metric, eps: Fraction, policy: Policy) -> tuple[Verdict, str]:
    if old.kind != new.kind:
        return Verdict.INCOMPARABLE, f"kind {old.kind} against {new.kind}"
    for metric in (old, new):
        if metric.value in ("nan", "missing") or (
            metric.value == UNRESOLVED and old.kind == "error" and not metric.bound
        ):
            return Verdict.INCOMPARABLE, f"{metric.value} is no number"
    if old.kind == "error":
        return _errors(old, new, policy.floor * eps, policy)
    if old.value == new.value:
        return Verdict.SAME, ""
    if old.kind == "duration":
        return _durations(old, new, policy)
    if "never" in (old.value, new.value) or UNRESOLVED in (old.value, new.value):
        return Verdict.WORSE, "a value that must agree does not"
    a, b = exact(old.value), exact(new.value)
    agree = abs(a - b) <= policy.value * max(abs(a), abs(b))
    return (Verdict.SAME, "") if agree else (Verdict.WORSE, "a value that must agree does not")


def _errors(old: Metric, new: Metric, floor: Fraction, policy: Policy) -> tuple[Verdict, str]:
    """Smaller is better; below the floor all errors are the same.  What its reference does not resolve is at most its
    bound: never better, and incomparable where the bound itself would be worse.
    """
    a, b = (max(abs(exact((m.bound or "") if m.value == UNRESOLVED else m.value)), floor) for m in (old, new))
    if new.value == UNRESOLVED:
        small = b <= a * Fraction(2) ** int(policy.loss)
        return (Verdict.SAME, "") if small else (Verdict.INCOMPARABLE, f"unresolved below {new.bound}")
    if old.value == UNRESOLVED and b <= a:
        return Verdict.SAME, ""
    if a == b:
        return Verdict.SAME, ""
    if not a or not b:
        return (Verdict.WORSE, "no longer exactly 0") if b else (Verdict.BETTER, "now exactly 0")
    grown = ((log10(b) or 0.0) - (log10(a) or 0.0)) / _LOG10_2
    if grown > policy.loss:
        return Verdict.WORSE, f"{grown:.1f} bits lost"
    if -grown > policy.loss:
        return Verdict.BETTER, f"{-grown:.1f} bits gained"
    return Verdict.SAME, ""


def _durations(old: Metric, new: Metric, policy: Policy) -> tuple[Verdict, str]:
    """Longer is better; never is longest."""
    if old.value == "never":
        return Verdict.WORSE, f"now at {new.value}"
    if new.value == "never":
        return Verdict.BETTER, "now never"
    if exact(old.value) == 0:
        return Verdict.BETTER, f"now at {new.value}"
    ratio = exact(new.value) / exact(old.value)
    if ratio < 1 - policy.duration:
        return Verdict.WORSE, f"{float(1 - ratio):.0%} earlier"
    if ratio > 1 + policy.duration:
        return Verdict.BETTER, f"{float(ratio - 1):.0%} later"
    return Verdict.SAME, ""


def _differences(old: dict[str, Any], new: dict[str, Any]) -> list[tuple[str, str, str]]:
    flat_old, flat_new = dict(_flatten(old)), dict(_flatten(new))
    names = sorted(set(flat_old) | set(flat_new))
    pairs = ((n, flat_old.get(n, "absent"), flat_new.get(n, "absent")) for n in names)
    return [(name, a, b) for name, a, b in pairs if a != b]


def _flatten(block: dict[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    result: list[tuple[str, str]] = []
    for name, value in block.items():
        if isinstance(value, dict):
            result += _flatten(value, f"{prefix}{name}.")
        else:
            result.append((f"{prefix}{name}", str(value)))
    return result
