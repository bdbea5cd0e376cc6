"""Baseline against candidate, row by row and metric by metric."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import msgspec

from heavytop.errors import InputError
from heavytop.measure.luck import accumulated, assumed, least
from heavytop.precision import exact
from heavytop.records import UNMEASURED
from heavytop.report.policy import BITS, Lookup, Policy
from heavytop.report.store import AnyReport, AnyRow
from heavytop.report.verdicts import Judged, Verdict, judge, judge_law, judge_seconds, law_text

_MACHINE = ("system", "machine", "processor", "simd_width_double", "cpu_features")

_FIRST = (Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING, Verdict.BETTER, Verdict.NEW)


class Finding(msgspec.Struct, frozen=True, gc=False):
    """One metric of one row: verdict, the two values as text, and why.

    metric: "" for a whole row, ``growth NAME`` for the law of a series, ``seconds NAME`` for a timing.
    """

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
    """All findings, and the differences of the plans and environments.

    same: how many metrics are the same, where these are not among the findings.  changed: all findings but the
    same, the worst first.
    """

    findings: list[Finding]
    environment: list[tuple[str, str, str]]
    same: int = 0
    changed: list[Finding] = field(init=False)

    def __post_init__(self) -> None:
        changed = [finding for finding in self.findings if finding.verdict is not Verdict.SAME]
        object.__setattr__(self, "changed", sorted(changed, key=lambda finding: _FIRST.index(finding.verdict)))

    @property
    def tally(self) -> dict[Verdict, int]:
        """How many findings of each verdict, the worst first and the same last."""
        verdicts = [finding.verdict for finding in self.changed]
        same = self.same + len(self.findings) - len(self.changed)
        counts = {verdict: verdicts.count(verdict) for verdict in _FIRST} | {Verdict.SAME: same}
        return {verdict: count for verdict, count in counts.items() if count}

    @property
    def verdict(self) -> str:
        """worse if anything is; else incomparable if anything is missing or incomparable; else better or same."""
        seen = self.tally
        if Verdict.WORSE in seen:
            return "worse"
        if Verdict.MISSING in seen or Verdict.INCOMPARABLE in seen:
            return "incomparable"
        return "better" if Verdict.BETTER in seen else "same"

    @property
    def exit_code(self) -> int:
        """0, 1 or 3, as for every command."""
        return {"worse": 1, "incomparable": 3}.get(self.verdict, 0)

    def to_json(self) -> dict[str, Any]:
        """The document of `compare --json`."""
        return {
            "verdict": self.verdict,
            "rows": [finding.to_json() for finding in self.findings],
            "environment": [{"name": n, "baseline": a, "candidate": b} for n, a, b in self.environment],
        }


def compare(baseline: AnyReport, candidate: AnyReport, policy: Policy, *, list_same: bool = True) -> Comparison:
    """Every row of either report, in the baseline's order, new ones last.

    list_same: False to count what plainly stayed the same in place of listing it.
    Raises InputError where neither report has a row, or the policy leaves nothing to compare.
    """
    findings: list[Finding] = []
    rows = _Rows(policy, _timed(policy, baseline.environment, candidate.environment), list_same)
    others = _Others(candidate.rows)
    for row in baseline.rows:
        key = row.key
        match = others.take(key)
        if match is not None:
            findings += rows.compare(key, row, match)
        elif not rows.ignores(row):
            findings.append(Finding(key, "", Verdict.MISSING, row.outcome, None, "the row is missing"))
    findings += [Finding(row.key, "", Verdict.NEW, None, row.outcome) for row in others.left() if not rows.ignores(row)]
    if not findings and not rows.same:
        raise InputError("There is nothing to compare.", "Compare reports of `heavytop run` that have rows.")
    return Comparison(
        findings,
        _differences({"plan": baseline.plan}, {"plan": candidate.plan})
        + _differences(baseline.environment, candidate.environment),
        rows.same,
    )


class _Others:
    """The rows of the candidate by their keys, taken as they come: two reports of one plan have the same order."""

    def __init__(self, rows: Any) -> None:
        self._rows = rows
        self._coming = enumerate(rows)
        self._passed: dict[tuple[str, ...], int] = {}

    def take(self, key: tuple[str, ...]) -> AnyRow | None:
        if key in self._passed:
            row: AnyRow = self._rows[self._passed.pop(key)]
            return row
        for number, row in self._coming:
            if row.key == key:
                return row
            self._passed[row.key] = number
        return None

    def left(self) -> Iterator[AnyRow]:
        """Those that were not taken."""
        for number in self._passed.values():
            yield self._rows[number]
        for _, row in self._coming:
            yield row


class _Rows:
    def __init__(self, policy: Policy, timed: bool, list_same: bool) -> None:
        self.policy = policy
        self.list_same = list_same
        self.same = 0
        self.lookup = Lookup(policy)
        self.timed = timed

    def ignores(self, row: AnyRow) -> bool:
        """Whether a rule leaves out the row as a whole: one whose pattern takes every metric."""
        return bool(self.policy.rule) and self.lookup.metric(self.lookup.row(row.measure, row.case), "").ignore

    def compare(self, key: tuple[str, ...], old: AnyRow, new: AnyRow) -> list[Finding]:
        reason = self._incomparable(old, new)
        if reason:
            return (
                [] if self.ignores(old) else [Finding(key, "", Verdict.INCOMPARABLE, old.outcome, new.outcome, reason)]
            )
        rules = self.lookup.row(old.measure, old.case) if self.policy.rule else ()
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
            ):
                if self.list_same:
                    found.append(Finding(key, name, Verdict.SAME, metric.value, match.value))
                else:
                    self.same += 1
            elif not (limits := self.lookup.metric(rules, name)).ignore:
                if match is None:
                    found.append(Finding(key, name, Verdict.MISSING, metric.value, None, "the metric is missing"))
                    continue
                least_of = least(old.metrics, name), least(new.metrics, name)
                eps = (1 - old.bits) * BITS + accumulated(old.measure, name, old.steps)
                if metric.band is None and (luck := assumed(old.measure, old.integrator)):
                    metric = msgspec.structs.replace(metric, band=luck)
                verdict, why = judge(metric, match, limits, eps, self.policy.suspicious_digits, least_of)
                found.append(Finding(key, name, verdict, metric.value, match.value, why))
        if new.metrics.keys() != old.metrics.keys():
            found += [
                Finding(key, name, Verdict.NEW, None, metric.value)
                for name, metric in new.metrics.items()
                if name not in old.metrics and not self.lookup.metric(rules, name).ignore
            ]
        if old.laws or new.laws:
            found += self._laws(key, rules, old, new)
        if old.finite and not new.finite and not self.ignores(old):
            found.append(Finding(key, "", Verdict.INCOMPARABLE, "finite", "not finite", "a value is no longer finite"))
        if self.timed:
            for name in sorted(old.seconds.keys() & new.seconds.keys()):
                if not self.lookup.metric(rules, f"seconds {name}").ignore:
                    verdict, why = judge_seconds(old.seconds[name], new.seconds[name], self.policy.timings)
                    before, after = (f"{row.seconds[name]:.3g} s" for row in (old, new))
                    found.append(Finding(key, f"seconds {name}", verdict, before, after, why))
        return found

    def _laws(self, key: tuple[str, ...], rules: tuple[int, ...], old: AnyRow, new: AnyRow) -> Iterator[Finding]:
        for name in dict.fromkeys((*old.laws, *new.laws)):
            metric = f"growth {name}"
            if self.lookup.metric(rules, metric).ignore:
                continue
            a, b = old.laws.get(name), new.laws.get(name)
            judged: Judged
            if a is None or b is None:
                judged = (Verdict.MISSING, "the law is missing") if b is None else (Verdict.NEW, "")
            else:
                judged = judge_law(a, b)
            before, after = (None if law is None else law_text(law) for law in (a, b))
            yield Finding(key, metric, judged[0], before, after, judged[1])

    def _incomparable(self, old: AnyRow, new: AnyRow) -> str:
        """Why two rows cannot be compared; empty where they can."""
        for row, which in ((old, "baseline"), (new, "candidate")):
            if row.outcome != "success":
                why = f": {row.against.removeprefix('nothing: ')}" if row.outcome in UNMEASURED else ""
                return f"the {which} ended as {row.outcome} at t = {row.time_reached}{why}"
        if old.horizon != new.horizon and exact(old.horizon) != exact(new.horizon):
            return f"horizon {old.horizon} against {new.horizon}"
        if old.bits != new.bits:
            return f"{old.bits} bits against {new.bits}"
        if (old.starts == 1) != (new.starts == 1):
            return f"{old.starts} starts against {new.starts}"
        if old.flags != new.flags and self.policy.flags != "ignore":
            names = [n for n in sorted({*old.flags, *new.flags}) if old.flags.get(n) != new.flags.get(n)]
            return "flags differ: " + ", ".join(f"{n} {old.flags.get(n)} -> {new.flags.get(n)}" for n in names)
        if old.against != new.against:
            # known is known, whichever closed form or enclosure it was: a better certificate makes no difference
            kinds = [row.against.partition(":")[0].partition(",")[0] for row in (old, new)]
            if kinds[0] != kinds[1]:
                return f"held against {kinds[0]!r} and {kinds[1]!r}"
        return ""


def _timed(policy: Policy, old: dict[str, Any], new: dict[str, Any]) -> bool:
    when = policy.timings.compare
    return when == "always" or (
        when == "same-machine" and all(name in old and old[name] == new.get(name) for name in _MACHINE)
    )


def _differences(old: dict[str, Any], new: dict[str, Any]) -> list[tuple[str, str, str]]:
    flat_old, flat_new = dict(flatten(old)), dict(flatten(new))
    names = sorted(set(flat_old) | set(flat_new))
    pairs = ((n, flat_old.get(n, "absent"), flat_new.get(n, "absent")) for n in names)
    return [(name, *_apart(a, b)) for name, a, b in pairs if a != b]


def _apart(old: Any, new: Any) -> tuple[str, str]:
    """Two entries that differ; of two lists what only one of them holds."""
    if isinstance(old, list) and isinstance(new, list):
        only = ([part for part in one if part not in other] for one, other in ((old, new), (new, old)))
        first, second = (" ".join(map(str, parts)) or "nothing else" for parts in only)
        return first, second
    first, second = (f"{len(entry)} known" if isinstance(entry, list) else str(entry) for entry in (old, new))
    return first, second


def flatten(block: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The entries of an environment, those of inner blocks with the names before them."""
    for name, value in block.items():
        if isinstance(value, dict):
            yield from flatten(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
