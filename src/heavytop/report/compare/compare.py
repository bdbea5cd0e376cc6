"""Baseline against candidate, row by row and metric by metric."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec
import numpy

from heavytop.cases import Case
from heavytop.errors import InputError
from heavytop.features.survey.gathered import DATA, FILE, command
from heavytop.harness.plan import uniform
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import exact, log10, parse
from heavytop.records import Identity, Row, Spread
from heavytop.report.compare.findings import RANK, Change, Changes, sentences
from heavytop.report.compare.noise import Limits, Policy
from heavytop.report.compare.rows import Finding, RowComparison
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.kind import Kinds
from heavytop.report.store.store import AnyReport, Brief
from heavytop.top.equations import system
from heavytop.top.heavy_top import HeavyTop, State

# The motions of a survey that got worse: two survey.parquet joined by motion, where both hold the same tops.
#
# The quantiles of the row decide the verdict; a fault in a small part of the motions moves none but the maximum, and
# the list names it.  A motion is worse where it does not reach its horizon any more, or where its error has grown by
# more than the policy allows and by more than rounding noise: the noise band is the half-width of the central 95 % of
# all changes of error, taken on the side where fewer decades are, for a fault widens one side alone.


MOST = 5
"""Motions of a survey that are listed; the others are counted."""
METRIC = "solution_error_relative_max"
"""Whose allowance in a policy is that of a motion's error too."""
_SAME = ("sweep", "integrator", "tolerance", "precision", "horizon")
_TAIL = 0.025


class WorseMotion(msgspec.Struct, frozen=True):
    """A motion by its index in the sweep: digits right before and after, None where the run failed, how it ended now,
    and the command that measures it alone.
    """

    index: int
    before: float | None
    after: float | None
    outcome: str
    command: str

    @property
    def text(self) -> str:
        """``motion 531: digits right 14.2 → 9.1``."""
        digits = ["-" if each is None else f"{each:.1f}" for each in (self.before, self.after)]
        ended = "" if self.outcome == Outcome.SUCCESS.value else f", {self.outcome}"
        return f"motion {self.index}: digits right {digits[0]} → {digits[1]}{ended}"


class WorseMotions(msgspec.Struct, frozen=True):
    """Of one survey: how many motions both have, how many of them got worse, the first few, those that lost most first.

    reason: why the two are not joined by motion; empty where they are.
    """

    row: Identity
    joined: int = 0
    worse: int = 0
    first: tuple[WorseMotion, ...] = ()
    reason: str = ""

    @property
    def sentence(self) -> str:
        """What a comparison says of it; empty where no motion got worse."""
        name = f"{self.row.case} by {self.row.integrator} {self.row.key.precision}"
        if self.reason:
            return f"The motions of {name} are not compared one by one: {self.reason}."
        if not self.worse:
            return ""
        return f"{self.worse} of {self.joined} motions of {name} got worse; {self.first[0].text}."

    def to_json(self) -> dict[str, Any]:
        """One of the surveys of `compare --json`."""
        found = {"joined": self.joined, "worse": self.worse, "reason": self.reason}
        return self.row.named | found | {"motions": [msgspec.structs.asdict(each) for each in self.first]}


def beside(report: Path) -> Path:
    """The file of the records beside a report, which is its folder or its file."""
    return (report if report.is_dir() else report.parent) / FILE


def worse_motions(old: Row, new: Row, files: tuple[Path, Path], limits: Limits) -> WorseMotions | None:
    """The motions of two rows of one survey, from the files of both reports; None where a file is missing.

    Raises InputError for a file that cannot be read.
    """
    if not all(file.is_file() for file in files):
        return None
    before, after = (_records(file, row) for file, row in zip(files, (old, new), strict=True))
    _, here, there = numpy.intersect1d(before["index"], after["index"], return_indices=True)
    if not len(here):
        return WorseMotions(new.identity, reason="they have none in common")
    before, after = ({name: c[k] for name, c in t.items()} for t, k in ((before, here), (after, there)))
    others = [~numpy.isclose(before[name], after[name], rtol=0, atol=0, equal_nan=True) for name in DATA]
    if (other := numpy.logical_or.reduce(others)).any():
        first = before["index"][other][0]
        return WorseMotions(new.identity, len(here), reason=f"motion {first} is another top or start")
    lost = _lost(before, after, limits, old)
    worse = numpy.flatnonzero(lost > 0)
    order = worse[numpy.lexsort((before["index"][worse], -lost[worse]))]
    first = tuple(_motion(new, before, after, place) for place in order[:MOST].tolist())
    return WorseMotions(new.identity, len(here), len(worse), first)


def _records(file: Path, row: Row) -> dict[str, Any]:
    """Columns of the motions of one row, by their index."""
    import pyarrow
    from pyarrow.parquet import read_table

    subject, key = row.key.subject, row.key
    same = dict(zip(_SAME, (key.case, subject.name, subject.tolerance, key.precision, key.horizon), strict=True))
    columns = ["index", "outcome", "error_max", "digits_right", *DATA]
    try:
        table = read_table(file, columns=columns, filters=[(name, "=", text) for name, text in same.items()])
    except (OSError, pyarrow.ArrowException) as error:
        raise InputError(f"{file} cannot be read: {error}.", "Give the folder of a finished run.") from None
    found = {name: table[name].to_numpy() for name in columns if name != "outcome"}
    return found | {"outcome": table["outcome"].cast("string").to_numpy()}


def _lost(before: dict[str, Any], after: dict[str, Any], limits: Limits, row: Row) -> Any:
    """Decades by which the error of each motion grew beyond what is allowed; infinite where it fails now, 0 for none.

    A motion that failed before is never worse.
    """
    reached = [each["outcome"] == Outcome.SUCCESS.value for each in (before, after)]
    eps = log10(parse(row.precision).eps)
    assert eps is not None
    floor = 10.0 ** max(limits.floor + eps, -300.0)
    with numpy.errstate(all="ignore"):
        sizes = [numpy.log10(numpy.fmax(each["error_max"], floor)) for each in (before, after)]
        grown = numpy.where(reached[0] & reached[1], sizes[1] - sizes[0], 0.0)
        grown = numpy.where(numpy.isnan(grown), 0.0, grown)
    up, down = numpy.quantile(grown, 1 - _TAIL), -numpy.quantile(grown, _TAIL)
    allowed = limits.loss + limits.noise * max(0.0, min(float(up), float(down)))
    return numpy.where(reached[0] & ~reached[1], math.inf, numpy.where(grown > allowed, grown, 0.0))


def _motion(row: Row, before: dict[str, Any], after: dict[str, Any], place: int) -> WorseMotion:
    index, outcome = int(after["index"][place]), str(after["outcome"][place])
    digits = [round(float(each["digits_right"][place]), 2) for each in (before, after)]
    known = [None if math.isnan(each) else each for each in digits]
    worst = row.worst if isinstance(row.worst, tuple) else ()
    said = next((each.command for each in worst if each.index == index), "")
    return WorseMotion(index, known[0], known[1], outcome, said or _command(row, after, place, outcome))


def _command(row: Row, columns: dict[str, Any], place: int, outcome: str) -> str:
    """Of the rounded top and start: the same motion in double, one within a rounding of double in other formats."""
    numbers = [Fraction(repr(float(columns[name][place]))) for name in DATA]
    inertia, moment, rotor, omega, gamma = (numbers[k : k + 3] for k in range(0, 15, 3))
    top = HeavyTop(inertia, 1, moment, rotor if any(rotor) else None)
    case = Case("motion", "a motion of a survey", system(row.system), top, State(omega, gamma))
    times, _ = uniform(exact(row.key.horizon), row.samples)
    return command(row.key, times, case, outcome == Outcome.SUCCESS.value)


__all__ = ["Differences", "Finding", "compare"]

_MACHINE = ("system", "machine", "processor", "simd_width_double", "cpu_features")
_VERSIONS = ("python", "implementation", "flint", "llvm", "cpu_target")


@dataclass(frozen=True, slots=True)
class Differences:
    """All findings, and the differences of the plans and environments.

    same: how many metrics are the same, where these are not among the findings.  sentences: what changed, at most
    eight, the most telling first, and one for each survey with motions that got worse.  rows: those that changed, the
    worst first.  changed: all findings but the same, the worst first.  motions: of each survey whose records were
    joined.
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
        """How many findings of each verdict, the worst first and the same last."""
        verdicts = [finding.verdict for finding in self.changed]
        same = self.same + len(self.findings) - len(self.changed)
        counts = {verdict: verdicts.count(verdict) for verdict in RANK} | {Verdict.SAME: same}
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
            "findings": self.sentences,
            "rows": [finding.to_json() for finding in self.findings],
            "environment": [{"name": n, "baseline": a, "candidate": b} for n, a, b in self.environment],
        } | ({"surveys": [each.to_json() for each in self.motions]} if self.motions else {})


def compare(
    baseline: AnyReport,
    candidate: AnyReport,
    policy: Policy,
    kinds: Kinds,
    *,
    list_same: bool = True,
    surveys: tuple[Path, Path] | None = None,
) -> Differences:
    """Every row of either report, in the baseline's order, new ones last.

    list_same: False to count what plainly stayed the same in place of listing it.
    surveys: the files of the records of surveys, which are joined by motion where both are there.
    Raises InputError where neither report has a row, or the policy leaves nothing to compare.
    """
    found: list[list[Finding]] = []
    missing: list[tuple[int, Row]] = []
    motions: list[WorseMotions | None] = []
    changes = Changes()
    timed = _timed(policy, baseline.environment, candidate.environment)
    repeated = _alike(baseline.environment, candidate.environment)
    checked = isinstance(baseline, Brief), isinstance(candidate, Brief)
    rows = RowComparison(policy, kinds, timed, list_same, checked, repeated)
    others = _Others(candidate.rows)
    for row in baseline.rows:
        match = others.take(row.identity)
        if match is not None:
            found.append(changes.add(row, match, rows.compare(row, match)))
            if surveys is not None and isinstance(match.spread, Spread) and not rows.ignores(row):
                motions.append(worse_motions(row, match, surveys, rows.limits(row, METRIC)))
        elif not rows.ignores(row):
            missing.append((len(found), row))
            found.append([Finding(row.identity, "", Verdict.MISSING, row.outcome, None, "the row is missing")])
    for place, row in missing:
        if (match := others.take_elsewhere(row.identity)) is not None:
            found[place] = rows.compare(row, match)[:1]
        changes.add(row, match, found[place])
    if mended := changes.mended():
        found = [[each.set_off(mended) for each in findings] for findings in found]
    for row in others.left():
        if not rows.ignores(row):
            new = Finding(row.identity, "", Verdict.NEW, None, row.outcome)
            found.append(changes.add(None, row, [new]))
    if changes.take_yardstick():
        found = [[each.as_same() if each.of_yardstick else each for each in findings] for findings in found]
    findings = [finding for each in found for finding in each]
    if not findings and not rows.same:
        raise InputError("There is nothing to compare.", "Compare reports of `heavytop run` that have rows.")
    same = rows.same + sum(finding.verdict is Verdict.SAME for finding in findings)
    joined = [each for each in motions if each is not None]
    return Differences(
        findings,
        _differences({"plan": baseline.plan}, {"plan": candidate.plan})
        + _differences(baseline.environment, candidate.environment),
        rows.same,
        [*sentences(changes, same, rows.failed), *(each.sentence for each in joined if each.sentence)],
        changes.worst_first,
        joined,
    )


class _Others:
    """The rows of the candidate by their keys, taken as they come: two reports of one plan have the same order."""

    def __init__(self, rows: Any) -> None:
        self._rows = rows
        self._coming = enumerate(rows)
        self._passed: dict[Identity, int] = {}
        self._elsewhere: dict[Identity, list[Identity]] | None = None

    def take(self, identity: Identity) -> Row | None:
        if identity in self._passed:
            row: Row = self._rows[self._passed.pop(identity)]
            return row
        for number, row in self._coming:
            if row.identity == identity:
                return row
            self._passed[row.identity] = number
        return None

    def take_elsewhere(self, identity: Identity) -> Row | None:
        """The one row, of those that are left, that differs in its horizon alone; called when all are passed."""
        if self._elsewhere is None:
            self._elsewhere = {}
            for each in self._passed:
                self._elsewhere.setdefault(each.elsewhere, []).append(each)
        near = self._elsewhere.get(identity.elsewhere, [])
        return self.take(near.pop()) if len(near) == 1 else None

    def left(self) -> Iterator[Row]:
        """Those that were not taken."""
        for number in self._passed.values():
            yield self._rows[number]
        for _, row in self._coming:
            yield row


def _timed(policy: Policy, old: dict[str, Any], new: dict[str, Any]) -> bool:
    when = policy.timings.compare
    return when == "always" or (
        when == "same-machine" and all(name in old and old[name] == new.get(name) for name in _MACHINE)
    )


def _alike(old: dict[str, Any], new: dict[str, Any]) -> bool:
    """Whether processor and versions agree, that of this program apart, which is what is compared."""
    first, second = (
        {name: version for name, version in each.get("packages", {}).items() if name != "heavytop"}
        for each in (old, new)
    )
    known = (*_MACHINE, *_VERSIONS)
    return first == second and all(name in old and old[name] == new.get(name) for name in known)


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
