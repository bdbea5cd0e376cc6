"""Comparison of two reports, row by row and metric by metric."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from heavytop.errors import ExitCode, InputError
from heavytop.integrate.registry import is_third_party
from heavytop.processes import forked
from heavytop.records import Identity, Row
from heavytop.report.compare.findings import RANK, Change, Changes, sentences
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.rows import Finding, RowComparison
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.kind import Kinds, kind_of
from heavytop.report.document.motions import WorseMotions
from heavytop.report.store.store import UNREADABLE, AnyReport, Brief, BriefRows

__all__ = ["Differences", "Finding", "compare"]

_MANY = 10_000
"""Rows of each half from which a second process is faster."""
_MACHINE = ("system", "machine", "processor", "simd_width_double", "cpu_features")
_VERSIONS = ("python", "implementation", "flint", "llvm", "cpu_target")


@dataclass(frozen=True, slots=True)
class Differences:
    """All findings, and the differences of the plans and environments.

    same: the number of unchanged metrics that are not listed among the findings.  sentences: at most eight about the
    changes, the most telling first, one for each survey with motions that got worse, and one for each rule of the
    policy that is not applied.  rows: the changed ones, the worst first.  changed: the findings other than same, the
    worst first.  motions: of each survey whose records were joined.
    """

    findings: list[Finding]
    environment: list[tuple[str, str, str]]
    same: int = 0
    sentences: list[str] = field(default_factory=list)
    rows: list[Change] = field(default_factory=list)
    motions: list[WorseMotions] = field(default_factory=list)
    changed: list[Finding] = field(init=False)

    def __post_init__(self) -> None:
        changed = [finding for finding in self.findings if finding.verdict is not Verdict.SAME]
        object.__setattr__(self, "changed", sorted(changed, key=lambda finding: RANK.index(finding.verdict)))

    @property
    def tally(self) -> dict[Verdict, int]:
        """The number of findings of each verdict, the worst first and the same last."""
        verdicts = [finding.verdict for finding in self.changed]
        same = self.same + len(self.findings) - len(self.changed)
        counts = {verdict: verdicts.count(verdict) for verdict in RANK} | {Verdict.SAME: same}
        return {verdict: count for verdict, count in counts.items() if count}

    @property
    def verdict(self) -> str:
        """worse if any finding is; else incomparable if any is missing or incomparable; else better or same."""
        tally = self.tally
        if Verdict.WORSE in tally:
            return "worse"
        if Verdict.MISSING in tally or Verdict.INCOMPARABLE in tally:
            return "incomparable"
        return "better" if Verdict.BETTER in tally else "same"

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of `compare` and `gate`."""
        return {"worse": ExitCode.FINDING, "incomparable": ExitCode.INCOMPLETE}.get(self.verdict, ExitCode.GOOD)

    def to_json(self) -> dict[str, Any]:
        """The document of `compare --json`."""
        return {
            "verdict": self.verdict,
            "findings": self.sentences,
            "rows": [finding.to_json() for finding in self.findings],
            "environment": [{"name": n, "baseline": a, "candidate": b} for n, a, b in self.environment],
        } | ({"surveys": [survey.to_json() for survey in self.motions]} if self.motions else {})


def compare(
    baseline: AnyReport,
    candidate: AnyReport,
    policy: Policy,
    kinds: Kinds,
    *,
    list_same: bool = True,
    folders: tuple[Path, Path] | None = None,
) -> Differences:
    """Compares every row of either report, in the baseline's order, new ones last.

    list_same: False to count unchanged metrics in place of listing them.
    folders: of both reports; rows of kinds with records of single motions are joined by motion.
    Raises InputError where no row is in the baseline, or the policy leaves nothing to compare.
    """
    environments, when = (baseline.environment, candidate.environment), policy.timings.compare
    same_machine = _agree(*environments, _MACHINE)
    timed = when == "always" or (when == "same-machine" and same_machine)
    same_versions = _agree(*environments, _VERSIONS) and _packages(environments[0]) == _packages(environments[1])
    checked = isinstance(baseline, Brief), isinstance(candidate, Brief)
    repeated = same_machine and same_versions

    def new_part() -> _Part:
        return _Part(RowComparison(policy, kinds, timed, list_same, checked, repeated), folders)

    part = None
    if isinstance(baseline, Brief) and isinstance(candidate, Brief):
        if not list_same:
            part = _by_halves(baseline.rows, candidate.rows, new_part)
        candidate.rows.twins = baseline.rows
    if part is None:
        part = new_part()
        part.compare(baseline.rows, candidate.rows)
    part.judge_unmeasured()
    rows, changes = part.rows, part.changes
    excused = changes.excused()
    findings = [
        replace(finding, verdict=Verdict.SAME, reason="") if excused(finding) else finding
        for finding in chain.from_iterable(part.findings_by_row)
    ]
    if not rows.same and all(finding.verdict is Verdict.NEW for finding in findings):
        remedy = "Compare reports of `heavytop run` that have rows, by a policy that does not ignore all of them."
        raise InputError("There is nothing to compare.", remedy)
    same = rows.same + sum(finding.verdict is Verdict.SAME for finding in findings)
    planned = "seed" in baseline.plan | candidate.plan  # a score has no plan
    joined = [motion for motion in part.motions if motion is not None]
    return Differences(
        findings,
        (_differences({"plan": baseline.plan}, {"plan": candidate.plan}) if planned else [])
        + _differences(baseline.environment, candidate.environment),
        rows.same,
        [
            *sentences(changes, same, rows),
            *(motion.sentence for motion in joined if motion.sentence),
            *rows.limits.remarks,
        ],
        changes.worst_first,
        joined,
    )


@dataclass
class _Part:
    """The comparison of consecutive rows of both reports.

    measured: the integrators with a number.  unmeasured: of each third-party one without in a row, the place of the
    first such row among the findings, its number of unchanged metrics, and the row.
    findings_by_row: of rows that have some or no metrics.  unpaired: the number of rows that only one report has.
    """

    rows: RowComparison
    folders: tuple[Path, Path] | None
    changes: Changes = field(default_factory=Changes)
    findings_by_row: list[list[Finding]] = field(default_factory=list)
    motions: list[WorseMotions | None] = field(default_factory=list)
    measured: set[str] = field(default_factory=set)
    unmeasured: dict[str, tuple[int, int, Row]] = field(default_factory=dict)
    unpaired: int = 0

    def compare(self, baseline: Iterable[Row], candidate: Any) -> None:
        """Compares all rows, in the baseline's order, new ones last."""
        rows, unmatched = self.rows, _UnmatchedRows(candidate)
        missing: list[tuple[int, Row]] = []
        for row in baseline:
            if (match := unmatched.take(row)) is not None:
                self._pair(row, match)
            elif not rows.ignores(row):
                missing.append((len(self.findings_by_row), row))
                self.findings_by_row.append([])
        for index, row in missing:
            if (match := unmatched.take_elsewhere(row)) is not None:
                findings = rows.compare(row, match)[:1]
            else:
                findings = [Finding(row.identity, "", Verdict.MISSING, row.outcome, None, "the row is missing")]
            self.findings_by_row[index] = self.changes.add(row, match, findings)
        self.unpaired = len(missing)
        for row in unmatched.left():
            self.unpaired += 1
            if not rows.ignores(row):
                new = Finding(row.identity, "", Verdict.NEW, None, row.outcome)
                self.findings_by_row.append(self.changes.add(None, row, [new]))

    def _pair(self, row: Row, match: Row) -> None:
        rows, subject, same = self.rows, row.key.subject, self.rows.same
        findings = self.changes.add(row, match, rows.compare(row, match))
        if row.metrics or match.metrics:
            self.measured.add(subject.name)
        elif subject.what == "computed" and is_third_party(subject.name) and not rows.ignores(row):
            self.unmeasured.setdefault(subject.name, (len(self.findings_by_row), rows.same - same, match))
        if findings or not match.metrics:
            self.findings_by_row.append(findings)
        if self.folders is not None and not rows.ignores(row):
            self.motions.append(kind_of(row, rows.kinds).join(row, match, self.folders, partial(rows.limits, row)))

    def extend(self, later: _Part) -> None:
        """Adds the comparison of the rows that follow."""
        for name, (index, same, row) in later.unmeasured.items():
            self.unmeasured.setdefault(name, (index + len(self.findings_by_row), same, row))
        self.measured |= later.measured
        self.findings_by_row += later.findings_by_row
        self.motions += later.motions
        self.changes.extend(later.changes)
        self.rows.extend(later.rows)

    def judge_unmeasured(self) -> None:
        """Makes the first row of each third-party integrator without a number incomparable."""
        for name, (index, counted, row) in self.unmeasured.items():
            if name not in self.measured and not any(
                f.verdict is not Verdict.SAME for f in self.findings_by_row[index]
            ):
                cause = f"no row of {name} has a number"
                lacking = Finding(row.identity, "", Verdict.INCOMPARABLE, row.outcome, row.outcome, cause)
                self.findings_by_row[index] = self.changes.add(row, row, [lacking])
                self.rows.same -= counted


def _by_halves(baseline: BriefRows, candidate: BriefRows, new_part: Callable[[], _Part]) -> _Part | None:
    """The comparison of many rows in two processes; None for few rows, where a half has a row that only one report has,
    and where a row is repeated or invalid in the second half: then the order of all rows matters.
    """
    half = len(baseline) // 2
    if len(baseline) != len(candidate) or half < _MANY:
        return None
    aligned = False
    with suppress(*UNREADABLE):
        aligned = baseline[half].has_identity_of(candidate[half])
    if not aligned:
        return None

    def compared(places: slice) -> tuple[_Part, set[int], set[int]]:
        part, old, new = new_part(), baseline.at(places), candidate.at(places)
        new.twins = old
        part.compare(old, new)
        return part, old.seen, new.seen

    with forked(lambda: compared(slice(half, None))) as later_half:
        if later_half is None:
            return None
        part, *seen = compared(slice(half))
        result = None if part.unpaired else later_half()
    if result is None or result[0].unpaired or any(map(set.intersection, seen, result[1:])):
        return None
    part.extend(result[0])
    return part


class _UnmatchedRows:
    """The rows of the candidate, taken by identity in one pass: two reports of one plan have the same order."""

    def __init__(self, rows: Any) -> None:
        self._rows: Sequence[Row] = rows
        self._remaining = enumerate(rows)
        self._passed: dict[Identity, int] = {}
        self._by_elsewhere: dict[Identity, list[Identity]] | None = None

    def take(self, row: Row) -> Row | None:
        """The remaining row of the same identity, or None."""
        if self._passed and (index := self._passed.pop(row.identity, None)) is not None:
            return self._rows[index]
        other: Row
        for index, other in self._remaining:
            if other.has_identity_of(row):
                return other
            self._passed[other.identity] = index
        return None

    def take_elsewhere(self, row: Row) -> Row | None:
        """The remaining row that differs in its horizon alone, if there is exactly one; called after the pass."""
        if self._by_elsewhere is None:
            self._by_elsewhere = {}
            for identity in self._passed:
                self._by_elsewhere.setdefault(identity.elsewhere, []).append(identity)
        near = self._by_elsewhere.get(row.identity.elsewhere, [])
        return self._rows[self._passed.pop(near.pop())] if len(near) == 1 else None

    def left(self) -> Iterator[Row]:
        """The rows that were not taken."""
        for number in self._passed.values():
            yield self._rows[number]
        for _, row in self._remaining:
            yield row


def _agree(old: dict[str, Any], new: dict[str, Any], names: Sequence[str]) -> bool:
    """Whether two environments have the same entries of these names."""
    return all(name in old and old[name] == new.get(name) for name in names)


def _packages(environment: dict[str, Any]) -> dict[str, str]:
    """The versions of packages apart from this program, which is being compared."""
    return {name: version for name, version in environment.get("packages", {}).items() if name != "heavytop"}


def _differences(old: dict[str, Any], new: dict[str, Any]) -> list[tuple[str, str, str]]:
    flat_old, flat_new = dict(flatten(old)), dict(flatten(new))
    names = sorted(set(flat_old) | set(flat_new))
    pairs = ((n, flat_old.get(n, "absent"), flat_new.get(n, "absent")) for n in names)
    return [(name, *_differing_texts(a, b)) for name, a, b in pairs if a != b]


def _differing_texts(old: Any, new: Any) -> tuple[str, str]:
    """The texts of two entries that differ; of two lists the items that only one has."""
    if isinstance(old, list) and isinstance(new, list):
        only = ([part for part in items if part not in excluded] for items, excluded in ((old, new), (new, old)))
        first, second = (" ".join(map(str, parts)) or "nothing else" for parts in only)
        return first, second
    first, second = (f"{len(entry)} known" if isinstance(entry, list) else str(entry) for entry in (old, new))
    return first, second


def flatten(block: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The entries of an environment, those of inner blocks with dotted names."""
    for name, value in block.items():
        if isinstance(value, dict):
            yield from flatten(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
