"""The changes between two reports, ranked: at most eight sentences, and a line per row.

A sentence is made from the records of the two rows, never from another sentence.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, groupby, pairwise, product
from typing import NamedTuple

import msgspec

from heavytop.display import plural
from heavytop.integrate.registry import is_third_party
from heavytop.measure.scalar import digits_kept, digits_text
from heavytop.measure.scorer import DRIFT, ERRORS, OBSERVED_ORDER, ORDER_OF_RUNS, SOLUTION_ERROR
from heavytop.records import FAILED, NOT_ASKED, UNMEASURED, UNSUPPORTED, Identity, Law, Metric, Quantity, Row, Series
from heavytop.report.compare.rows import Finding, RowComparison
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.document import clip, integral_text, short

MOST, _LONGEST, _CLIPPED = 8, 300, 20
"""Most sentences, most characters of one, and the characters that give the length of a clipped text."""
RANK = (Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING, Verdict.BETTER, Verdict.NEW, Verdict.SAME)
"""The verdicts, the worst first."""
_ORDER_MOVED = 0.5
"""Least reported change of an order between two settings: errors near rounding change it by as much."""
_FINER = 0.05
"""Decades: settings whose steps differ by less show no order, as errors vary by more between them."""
_DIGITS_MOVED = 0.1
"""Least reported change of digits right, which are written with one decimal."""
_ENDS_AS_BEFORE = 0.5
"""Decades by which the error of the last state may grow where only the dense output is worse."""
_STEPS_MOVED = 0.02
"""Decades: different roundings in step size control change the steps by less."""
_STEPS_SAID = 0.005
"""Least change of steps, as a fraction, that is said where no metric is beyond its limit."""
_LEAST_LOSS = math.log10(1.1)
"""Decades: a smaller loss is no loss of order, where only the limit of a policy makes an error worse."""
_LESS = 0.5
"""Largest loss at coarser settings, as a fraction of that at the finest, for a new error of lower order."""
_LOWER_ORDER = (
    "; coarser settings {}: the new error is of lower order than the method, as from a wrong coefficient or a "
    "stage in lower precision"
)
_MOST_HELD = 20_000
"""Most rows held with their numbers; further ones are counted, and described by their findings alone."""
_ERROR = ERRORS[0].text
_DIGITS = (SOLUTION_ERROR, ERRORS[0].name)
"""Quantities that the digits right summarize."""
_WORDS = {
    "solution_error": "error",
    "local_error_ulp": "error of a step in eps",
    "break_away_time": "escape time",
    "drift": "drift",
    "seconds run": "seconds",
    "seconds least": "seconds of the fastest run",
}
_GROWS = {"exponential": "exponentially", "bounded": "within a bound", "unresolved": "by no resolved law"}
_COMPONENTS = {
    "along": "along the flow",
    "across": "across the flow",
    "gamma_squared": "of |γ|²",
    "momentum_squared": "of |M|²",
    "area": "of M·γ",
    "energy": "of the energy",
    "kovalevskaya": "of Kovalevskaya's integral",
    "omega": "of Ω",
    "gamma": "of γ",
    "runs": "in whole runs",
}


_Curve = tuple[str, str, str]
_Pair = tuple[float, float]


class Change(NamedTuple):
    """A row that changed.  old, new: None where a report does not have it.

    findings: all with a verdict other than same, the worst first; never empty.
    """

    identity: Identity
    old: Row | None
    new: Row | None
    findings: list[Finding]

    @property
    def verdict(self) -> Verdict:
        """The verdict of its worst finding."""
        return self.findings[0].verdict

    @property
    def digits(self) -> tuple[float, float] | None:
        """Digits right before and after, where both are known."""
        old, new = map(_digits, (self.old, self.new))
        return None if old is None or new is None else (old, new)

    @property
    def lost(self) -> float:
        """Digits lost; without digits right the decades of the largest loss."""
        if self.digits is not None:
            return self.digits[0] - self.digits[1]
        return max(
            (moved for finding in self.findings if (moved := self.decades(finding.metric)) is not None), default=0.0
        )

    def decades(self, name: str) -> float | None:
        """Decades by which the error of that name grew; None for other metrics, and where either is not a number."""
        old, new = self.metrics(name)
        if old is None or new is None or old.log10 is None or new.log10 is None or old.kind != "error":
            return None
        return new.log10 - old.log10

    def metrics(self, name: str) -> tuple[Metric | None, Metric | None]:
        """The metric of that name in both rows; None where the row or the metric is missing."""
        old, new = (None if row is None else row.metrics.get(name) for row in (self.old, self.new))
        return old, new

    @property
    def growth_of_steps(self) -> float:
        """log10 of the growth of the steps; nan where either report has none."""
        old, new = (0 if row is None else row.steps for row in (self.old, self.new))
        return math.log10(new / old) if old and new else math.nan

    @property
    def largest_loss(self) -> float:
        """Decades of the largest loss of an error."""
        worse = (self.decades(finding.metric) for finding in self.findings if finding.verdict is Verdict.WORSE)
        return max((moved for moved in worse if moved is not None), default=0.0)

    @property
    def lost_accuracy(self) -> bool:
        """Whether errors or samples are worse, and not only beyond the limit of a policy."""
        worse = [finding for finding in self.findings if finding.verdict is Verdict.WORSE]
        return self.largest_loss >= _LEAST_LOSS or any(finding.of == "series" for finding in worse)

    def about(self, finding: Finding) -> Quantity | None:
        """The quantity of a metric or series, without its statistic; None for laws, seconds, whole rows."""
        quantity = self.measured(finding)
        return quantity and quantity.over("")

    def measured(self, finding: Finding) -> Quantity | None:
        """The quantity of a finding with its statistic."""
        for row in (self.old, self.new):
            if row is not None and finding.of in ("", "series"):
                measure = (row.series if finding.of else row.metrics).get(finding.name)
                if measure is not None and measure.quantity is not None:
                    return measure.quantity
        return None


@dataclass(slots=True)
class Changes:
    """The changes between two reports, collected row by row.

    points: log10 of the steps of a setting in both reports, and of its errors, by work-precision curve.
    yardstick: changes of heyoka where the baseline measures it beside a third-party integrator: no verdict on the
    latter.
    """

    rows: list[Change] = field(default_factory=list)
    points: dict[_Curve, list[tuple[_Pair, _Pair]]] = field(default_factory=dict)
    yardstick: list[Change] = field(default_factory=list)
    _third_party: bool = False

    def add(self, old: Row | None, new: Row | None, findings: list[Finding]) -> list[Finding]:
        """Adds the findings about one row, of one report or of both, and returns them unchanged."""
        if old is not None and not self._third_party:
            subject = old.key.subject
            self._third_party = subject.what == "computed" and is_third_party(subject.name)
        changed = [finding for finding in findings if finding.verdict is not Verdict.SAME]
        if changed:
            changed.sort(key=lambda finding: RANK.index(finding.verdict))
            before, after = (old, new) if len(self.rows) < _MOST_HELD else (None, None)
            self.rows.append(Change(changed[0].row, _without_samples(before), _without_samples(after), changed))
        if old is not None and new is not None and old.steps and new.steps:
            errors = [metric.log10 for row in (old, new) if (metric := row.metrics.get(_ERROR)) is not None]
            if len(errors) == 2 and errors[0] is not None and errors[1] is not None:
                point = (math.log10(old.steps), math.log10(new.steps)), (errors[0], errors[1])
                self.points.setdefault(_curve(old.identity), []).append(point)
        return findings

    def extend(self, later: Changes) -> None:
        """Adds the changes of the rows that follow."""
        held = max(0, _MOST_HELD - len(self.rows))
        self.rows += later.rows[:held] + [change._replace(old=None, new=None) for change in later.rows[held:]]
        for curve, points in later.points.items():
            self.points.setdefault(curve, []).extend(points)
        self._third_party |= later._third_party

    def excused(self) -> Callable[[Finding], bool]:
        """Removes excused findings from the rows, and returns the test for them.

        Excused are slight losses of an integrator with larger gains: of two methods, each slightly better somewhere,
        the one with the largest loss is worse.  And changes of heyoka beside a third-party integrator.
        """
        gained: dict[tuple[str, str], float] = {}
        lost: dict[tuple[str, str], float] = {}
        for change in self.rows:
            for finding in change.findings:
                if finding.slight or (finding.verdict is Verdict.BETTER and not finding.of):
                    side, moved = (lost if finding.slight else gained), change.decades(finding.metric)
                    side[finding.method] = max(side.get(finding.method, 0.0), math.inf if moved is None else abs(moved))

        def is_compensated(finding: Finding) -> bool:
            return finding.slight and gained.get(finding.method, 0.0) > lost[finding.method]

        def is_yardstick(finding: Finding) -> bool:
            return self._third_party and finding.of_yardstick

        rows = (c._replace(findings=[f for f in c.findings if not is_compensated(f)]) for c in self.rows)
        verdicts = [change for change in rows if change.findings]
        self.yardstick = [change for change in verdicts if is_yardstick(change.findings[0])]
        self.rows = [change for change in verdicts if not is_yardstick(change.findings[0])]
        return lambda finding: is_compensated(finding) or is_yardstick(finding)

    def by_curve(self) -> dict[_Curve, list[Change]]:
        """The rows of each work-precision curve."""
        curves: dict[_Curve, list[Change]] = {}
        for change in self.rows:
            curves.setdefault(_curve(change.identity), []).append(change)
        return curves

    def coarser(self, curve: _Curve, changed: Sequence[Change]) -> str:
        """``are the same`` or ``lost less`` where the finest setting of an integrator on a case lost most, with equal
        steps; else empty.  changed: the rows of the curve.

        Such a new error decreases more slowly than the error of the method, which hides it at coarser settings.
        """
        points = self.points.get(curve, [])
        if len(points) < 2 or not all(abs(change.growth_of_steps) <= _STEPS_MOVED for change in changed):
            return ""
        finest = max(steps for (steps, _), _ in points)
        settings = {math.log10(change.old.steps): change for change in changed if change.old}
        worst = settings.pop(finest, None)
        if worst is None or not worst.lost_accuracy:
            return ""
        if any(change.largest_loss > _LESS * worst.largest_loss for change in settings.values()):
            return ""
        return "lost less" if settings else "are the same"

    @property
    def worst_first(self) -> list[Change]:
        """The rows by verdict, then by digits lost."""
        return sorted(self.rows, key=lambda change: (RANK.index(change.verdict), -change.lost))


class Sentence(NamedTuple):
    """One sentence, and the rows that it describes."""

    text: str
    rows: frozenset[Identity]


def sentences(changes: Changes, same: int, compared: RowComparison) -> list[str]:
    """At most eight sentences, the most important first; losses before gains.

    same: the number of unchanged metrics, where a row without metrics in both reports counts as one.
    """
    failed, unsupported = compared.failed, compared.unsupported
    if not changes.rows:
        counted = same - unsupported - sum(row.outcome in UNMEASURED for row in failed)
        numbers = f"Nothing changed: {plural(counted, 'metric is', 'metrics are')} within the limits."
        if compared.moved:
            steps = f"; steps changed by up to {compared.steps:.0%}" if compared.steps >= _STEPS_SAID else ""
            numbers = f"No metric of {counted} changed beyond its limit{steps}."
        nothing = f"Nothing is compared: {plural(unsupported, 'row is', 'rows are')} not supported in either report."
        said = [numbers] if counted else [nothing] if unsupported else []
        return [*said, *_still_failed(failed), *_yardstick(changes)]
    orders = list(_orders(changes))
    ranked = [*_explained(changes), *(sentence for moved, sentence in orders if moved < 0)]
    by_rank = sorted(changes.rows, key=lambda change: RANK.index(change.verdict))
    ranked += _whole_rows(by_rank, Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING)
    for verdicts in ({Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING}, {Verdict.BETTER}):
        rows = [change for change in changes.worst_first if change.verdict in verdicts]
        for make in (_digits_moved, _steps_moved, _laws_moved, partial(_others_moved, changes)):
            ranked += make(rows, verdicts)
    ranked += [sentence for moved, sentence in orders if moved > 0]
    still, scale = _still_failed(failed), _yardstick(changes)
    ranked = [*ranked, *_whole_rows(changes.rows, Verdict.BETTER, Verdict.NEW)][: MOST - 1 - len(still) - len(scale)]
    named = frozenset[Identity]().union(*(group.rows for group in ranked))
    unnamed = [change for change in changes.rows if change.identity not in named]
    end = f"{plural(len(unnamed), 'other row' if ranked else 'row')} changed." if unnamed else "No other row changed."
    if len(unnamed) == 1:
        end = f"{end[:-1]}, {_where(unnamed[0].identity)}: {line(unnamed[0])}."
    if not same and all(change.verdict in (Verdict.MISSING, Verdict.NEW) for change in changes.rows):
        keys = {msgspec.structs.replace(change.identity.key, case="") for change in changes.rows}
        names = " and ".join(_case(change.identity) for change in changes.rows)
        advice = (
            f"Their names differ: {names}. Rows of the same name (`# name:` of a trajectory) are compared."
            if (len(keys), len(changes.rows)) == (1, 2)
            else "Were they made with the same plan?"
        )
        end = f"The reports have no row in common. {advice}"
    return [clip(text, _LONGEST) for text in (*(group.text for group in ranked), *still, end, *scale)]


def _yardstick(changes: Changes) -> list[str]:
    """A sentence about changes of heyoka, measured for scale; none without changes."""
    if not changes.yardstick:
        return []
    first = min(changes.yardstick, key=lambda change: RANK.index(change.verdict))
    rows = plural(len(changes.yardstick), "row")
    return [f"heyoka, measured for scale but not judged, changed in {rows}{_on([first.identity])}: {line(first)}."]


def _still_failed(rows: Sequence[Row]) -> list[str]:
    """A sentence for the rows that failed in both reports; none without such a row."""
    if not rows:
        return []
    whose, on = _whose([row.identity for row in rows]), _on([row.identity for row in rows])
    return [f"{plural(len(rows), 'row')}{whose} failed in both reports{on}: {clip(_why(rows[0]), 160)}."]


def _why(row: Row) -> str:
    """The reason that the integrator gives for a failure, or the outcome and the time reached."""
    if row.outcome == FAILED:
        return row.reference.reason
    stopped = f"at t = {short(row.time_reached)} of {short(row.horizon)}"
    return f"{row.outcome}, {row.reference.reason if row.outcome in UNMEASURED else stopped}"


def line(change: Change) -> str:
    """The change of one row in short: digits lost or gained, else its largest change for the worse."""
    worst = max(
        change.findings, key=lambda finding: (-RANK.index(finding.verdict), change.decades(finding.metric) or -math.inf)
    )
    if not worst.metric:
        return worst.reason or f"only in the {'candidate' if worst.verdict is Verdict.NEW else 'baseline'}"
    digits, count = change.digits, len(change.findings)
    more = f"; {count} metrics changed" if count > 1 else ""
    more += next((f"; {finding.reason}" for finding in change.findings if not finding.metric), "")
    better = change.verdict is Verdict.BETTER
    if digits is not None and abs(digits[0] - digits[1]) >= _DIGITS_MOVED and (digits[1] > digits[0]) is better:
        return f"digits right {digits_text(digits[0])} → {digits_text(digits[1])}{more}"
    text = f"{clip(worst.metric, 40)} {short(worst.baseline or '-')} → {short(worst.candidate or '-')}"
    if worst.of == "series":
        text = clip(worst.metric, 40)
    return text + (f", {worst.reason}" if worst.reason else "") + more


def folded(change: Change) -> Iterator[tuple[str, list[Finding]]]:
    """The findings of a row grouped by quantity, its largest, rms and last value and series together; worst first."""
    together: dict[tuple[Verdict, str], list[Finding]] = {}
    for finding in change.findings:
        quantity = change.about(finding)
        name = quantity.text if quantity else finding.name if finding.of == "series" else finding.metric
        together.setdefault((finding.verdict, name), []).append(finding)
    for (_, name), findings in together.items():
        yield name or "whole row", findings


def statistics(change: Change, name: str, findings: Sequence[Finding]) -> str:
    """Which statistics of a quantity changed: ``drift_energy: max, rms, series``."""
    measured = ((finding, change.measured(finding)) for finding in findings)
    parts = (
        "series" if finding.of == "series" else quantity.statistic if quantity else "" for finding, quantity in measured
    )
    listed = ", ".join(part for part in parts if part)
    return f"{name}: {listed}" if listed else name


def _without_samples(row: Row | None) -> Row | None:
    """The row with empty series, which make up most of its size: sentences need only their quantities."""
    if row is None or not row.series:
        return row
    series = {name: Series([], [], series.quantity) for name, series in row.series.items()}
    return msgspec.structs.replace(row, series=series)


def _digits(row: Row | None) -> float | None:
    """Digits right; by the largest absolute error where a row has no relative one."""
    if row is None:
        return None
    if (kept := digits_kept(row)) is not None:
        return kept
    error = row.metrics.get(_ERROR)
    return None if error is None or error.log10 is None else -error.log10


def _curve(row: Identity) -> _Curve:
    """Case, integrator and format, which identify one work-precision curve."""
    return row.case, row.key.subject.name, row.key.precision


def _where(row: Identity, at: bool = True) -> str:
    """``lagrange up to T = 100 (mine:rk4, step 1/100, double)``."""
    key = row.key
    details = ", ".join(part for part in (clip(row.program, 40), key.subject.asked, key.precision) if part)
    end = f" up to T = {short(key.horizon.removeprefix('-'))}" if at and key.horizon not in ("", "0") else ""
    return f"{_case(row)}{end} ({details})"


def _case(row: Identity) -> str:
    return clip(f"{row.key.case}/{row.key.direction}" if row.key.direction else row.key.case, 40)


def _on(rows: Sequence[Identity]) -> str:
    """`` on lagrange up to T = 100 (...)`` of one row; of several the first."""
    return f"{', first' if len(rows) > 1 else ''} on {_where(rows[0])}"


def _whose(rows: Sequence[Identity]) -> str:
    """`` of mine:rk4, mine:rk5``."""
    names = list(dict.fromkeys(clip(row.key.subject.name, 40) for row in rows))
    return f" of {', '.join(names[:3])}" + (" and others" if len(names) > 3 else "") if names else ""


def _orders(changes: Changes) -> Iterator[tuple[float, Sentence]]:
    """Change and sentence of the largest change of the observed order, for each integrator."""
    largest: dict[str, tuple[float, Sentence]] = {}
    for name, moved, sentence in chain(_orders_of_steps(changes), _orders_of_settings(changes)):
        if name not in largest or abs(moved) > abs(largest[name][0]):
            largest[name] = moved, sentence
    yield from sorted(largest.values(), key=lambda entry: entry[0])


_SHOW_ORDER = {OBSERVED_ORDER: "single steps", ORDER_OF_RUNS: "whole runs"}


def _orders_of_steps(changes: Changes) -> Iterator[tuple[str, float, Sentence]]:
    """Integrator, change and sentence for orders observed in single steps or whole runs."""
    for change, (order, shown_by) in product(changes.rows, _SHOW_ORDER.items()):
        before, after = (math.nan if m is None else float(m) for m in change.metrics(order.text))
        if abs(after - before) > 0:
            text = f"Order observed {before:g} → {after:g} in {shown_by} on {_where(change.identity, at=False)}."
            yield change.identity.key.subject.name, after - before, Sentence(text, frozenset({change.identity}))


def _orders_of_settings(changes: Changes) -> Iterator[tuple[str, float, Sentence]]:
    """Integrator, change and sentence for −Δ log error/Δ log steps between one setting and the next finer one."""
    changed: dict[_Curve, set[Identity]] = {}
    for row in (change.identity for change in changes.rows):
        changed.setdefault(_curve(row), set()).add(row)
    for key, rows in changed.items():
        _, name, precision = key
        for (steps, errors), (more_steps, new_errors) in pairwise(sorted(changes.points.get(key, []))):
            spans = [b - a for a, b in zip(steps, more_steps, strict=True)]
            if min(spans) >= _FINER:
                falls = [a - b for a, b in zip(errors, new_errors, strict=True)]
                before, after = (max(fall / span, 0.0) for fall, span in zip(falls, spans, strict=True))
                if abs(after - before) >= _ORDER_MOVED:
                    first = next(iter(rows))
                    span = f"{10 ** steps[0]:.0f} to {10 ** more_steps[0]:.0f} steps"
                    where = f"{_case(first)} from {span} ({clip(first.program, 40)}, {precision})"
                    text = f"Order observed {before:z.1f} → {after:z.1f} on {where}."
                    yield name, after - before, Sentence(text, frozenset(rows))


def _explained(changes: Changes) -> Iterator[Sentence]:
    """New explanations of large errors: for each integrator the one of most rows."""
    by_integrator: dict[str, dict[str, list[tuple[str, Identity]]]] = {}
    for change in changes.worst_first:
        new, old = (row.explained if row else msgspec.UNSET for row in (change.new, change.old))
        if new and (not old or old.kind != new.kind):
            kinds = by_integrator.setdefault(change.identity.key.subject.name, {})
            kinds.setdefault(new.kind, []).append((new.text, change.identity))
    for kinds in by_integrator.values():
        cases = max(kinds.values(), key=len)
        (text, first), others = cases[0], len(cases) - 1
        more = f" and {plural(others, 'other row')}" if others else ""
        where_seen = f" Seen on {_where(first)}{more}."
        room = _LONGEST - len(where_seen)
        while len(text) > room and ". " in text:
            text = text[: text.rindex(". ") + 1]
        text = text if len(text) <= room else clip(text, room - _CLIPPED)
        yield Sentence(text + where_seen, frozenset(row for _, row in cases))


def _whole_rows(rows: Sequence[Change], *verdicts: Verdict) -> Iterator[Sentence]:
    """One sentence, with the commonest reason, for all rows that failed, are incomparable, missing, or new."""
    by_fate: dict[str, list[tuple[str, Change]]] = {}
    for change in rows:
        if change.verdict in verdicts and not change.findings[0].metric:
            fate, reason = _fate(change)
            by_fate.setdefault(fate, []).append((reason, change))
    for fate, cases in by_fate.items():
        reason, _ = Counter(reason for reason, _ in cases).most_common(1)[0]
        cases.sort(key=lambda case: case[0] != reason)
        named = [change.identity for _, change in cases]
        whose, on = _whose(named), _on(named) if fate in _WITH_EXAMPLE else ""
        if len(cases) == 1:
            fate = fate.replace("are ", "is ").replace("stop ", "stops ")
        text = f"{plural(len(cases), 'row')}{whose} {fate}{on}"
        yield Sentence(f"{text}{': ' if reason else ''}{clip(reason, 160)}.", frozenset(named))


_WITH_EXAMPLE = ("failed", "stop earlier", "are worse", "are better")
"""Fates of rows for which the sentence names a row."""


def _fate(change: Change) -> tuple[str, str]:
    """The fate of a whole row, and the reason."""
    if change.verdict is Verdict.MISSING:
        return "are missing", ""
    if change.verdict is Verdict.NEW:
        return "are new", ""
    as_before = change.old is not None and change.new is not None and change.old.outcome == change.new.outcome
    if change.new is None or change.new.outcome == "success" or (as_before and change.verdict is Verdict.INCOMPARABLE):
        became = {Verdict.BETTER: "are better", Verdict.WORSE: "are worse"}
        return became.get(change.verdict, "cannot be compared"), change.findings[0].reason
    if change.new.outcome == UNSUPPORTED:
        return "are no longer supported", change.new.reference.reason
    if change.new.outcome == NOT_ASKED and change.verdict is Verdict.INCOMPARABLE:
        return "are not measured", _why(change.new)
    if change.old is None or change.old.outcome == "success":
        return "failed", _why(change.new)
    return ("stop earlier" if change.verdict is Verdict.WORSE else "failed in both reports"), _why(change.new)


def _digits_moved(rows: Sequence[Change], verdicts: set[Verdict]) -> Iterator[Sentence]:
    """Digits right: the largest change of each integrator, and the number of other rows that moved the same way."""
    sign = -1.0 if Verdict.BETTER in verdicts else 1.0
    moved = [c for c in rows if c.findings[0].metric and c.digits is not None and sign * c.lost >= _DIGITS_MOVED]
    for changes in _by_integrator(moved):
        worst = max(changes, key=lambda change: (sign * change.lost, change.identity.case))
        assert worst.digits is not None
        old, new = map(digits_text, worst.digits)
        others = len(changes) - 1
        more = f", {'fewer' if sign > 0 else 'more'} on {plural(others, 'other row')} too" if others else ""
        if worst.lost > _ENDS_AS_BEFORE and sign > 0 and all(_ends_as_before(change) for change in changes):
            more += "; the error of the last state is as before, as where dense output is wrong"
        yield Sentence(
            f"Digits right {old} → {new} on {_where(worst.identity)}{more}.", frozenset(c.identity for c in changes)
        )


def _steps_moved(rows: Sequence[Change], verdicts: set[Verdict]) -> Iterator[Sentence]:
    """Changes of steps at the same setting: the largest of each integrator."""
    moved = [change for change in rows if abs(change.growth_of_steps) > _STEPS_MOVED]
    for changes in _by_integrator(moved):
        largest = max(changes, key=lambda change: abs(change.growth_of_steps))
        steps = " → ".join(str(row.steps) for row in (largest.old, largest.new) if row)
        same = " at the same setting" if largest.old and largest.new and largest.old.flags == largest.new.flags else ""
        text = f"Steps {steps}{same} on {_where(largest.identity)}."
        yield Sentence(text, frozenset(change.identity for change in changes))


def _ends_as_before(change: Change) -> bool:
    """Whether of a computed row a drift grew, but not the error of the last state; False for files, whose steps are
    unknown.  An error of the pace, without drift, may decrease towards the end: near a saddle.
    """
    if change.old is None or change.old.key.subject.what != "computed":
        return False
    measured = [(change.decades(name), m.quantity) for name, m in change.old.metrics.items() if m.quantity]
    finals = [moved for moved, q in measured if q.name in _DIGITS and q.statistic == "final"]
    drifts = (moved for moved, q in measured if q.name == DRIFT and moved is not None)
    at_end = all(moved is not None and moved < _ENDS_AS_BEFORE for moved in finals)
    return bool(finals) and at_end and max(drifts, default=0.0) >= _ENDS_AS_BEFORE


def _laws_moved(rows: Sequence[Change], verdicts: set[Verdict]) -> Iterator[Sentence]:
    """Growth laws that changed: one sentence for each quantity and integrator, with the first motion."""
    rows_of: dict[tuple[str, str], list[Change]] = {}
    for change in rows:
        for finding in change.findings:
            laws = [law for row in (change.old, change.new) if row and (law := row.laws.get(finding.name))]
            if finding.of == "growth" and finding.verdict in verdicts and len(laws) == 2:
                moved = f"{_quantity(laws[0].quantity, finding.name)} {_law_moved(laws, finding.reason)}"
                rows_of.setdefault((change.identity.key.subject.name, moved), []).append(change)
    for (_, moved), changes in rows_of.items():
        also = f" and {plural(len(changes) - 1, 'other row')}" if len(changes) > 1 else ""
        text = f"The {moved} on {_where(changes[0].identity, at=False)}{also}."
        yield Sentence(text, frozenset(change.identity for change in changes))


def _law_moved(laws: Sequence[Law], reason: str) -> str:
    """``grows like t (was t^0.5)``; within a class the exponents and the reason."""
    old, new = (law.growth for law in laws)
    if old != new:
        return f"grows {_GROWS.get(new, f'like {new}')} (was {_GROWS.get(old, old)})"
    exponents = " → ".join(f"{law.exponent:.3g}" for law in laws if law.exponent is not None)
    return f"grows with exponent {exponents or '?'}: {reason}"


def _quantity(quantity: Quantity | None, name: str) -> str:
    """``error along the flow``, ``drift of the energy``; the key of an unknown quantity."""
    if quantity is None:
        return clip(_WORDS.get(name, name), 60)
    what, component = _WORDS.get(quantity.name, quantity.name.replace("_", " ")), integral_text(quantity.component)
    component = f"of {component}" if quantity.name == DRIFT else component
    return f"{what} {_COMPONENTS.get(quantity.component, component)}".strip()


def _others_moved(changes: Changes, rows: Sequence[Change], verdicts: set[Verdict]) -> Iterator[Sentence]:
    """Drifts, escape times, local errors, seconds: the largest change of each quantity and integrator."""
    curves = changes.by_curve()
    by_quantity: dict[tuple[str, str], list[tuple[float, Change, Finding]]] = {}
    for change in rows:
        for _, findings in folded(change):
            worst, quantity = findings[0], change.about(findings[0])
            if worst.verdict in verdicts and not _is_covered(change, worst, quantity):
                name = quantity.name if quantity else worst.name
                size = change.decades(worst.metric) or 0.0
                by_quantity.setdefault((change.identity.key.subject.name, name), []).append((abs(size), change, worst))
    for cases in sorted(by_quantity.values(), key=lambda cases: -max(size for size, _, _ in cases)):
        _, change, finding = max(cases, key=lambda case: case[0])
        what = _quantity(change.about(finding), finding.metric)
        values = f" {short(finding.baseline or '-')} → {short(finding.candidate or '-')}"
        if finding.of == "series":
            values = " at its samples"
        unchanged = abs(change.decades(finding.metric) or 0.0) < _LEAST_LOSS and finding.baseline != "0"
        reason = f", {finding.reason}" if finding.reason and unchanged else ""
        named = frozenset(c.identity for _, c, _ in cases)
        also = f"; also on {plural(len(named) - 1, 'other row')}" if len(named) > 1 else ""
        error = Verdict.WORSE in verdicts and (finding.of == "series" or change.decades(finding.metric) is not None)
        touched = {_curve(c.identity) for _, c, _ in cases} if error else set()
        coarser = {changes.coarser(curve, curves[curve]) for curve in touched} or {""}
        below = "" if "" in coarser else _LOWER_ORDER.format(min(coarser, key=len))
        yield Sentence(f"{what[0].upper()}{what[1:]}{values} on {_where(change.identity)}{reason}{also}{below}.", named)


def _is_covered(change: Change, finding: Finding, quantity: Quantity | None) -> bool:
    """Whether another sentence covers a finding: on whole rows, laws, orders, or digits right."""
    if not finding.metric or finding.of == "growth":
        return True
    if finding.candidate and finding.metric in {order.text for order in _SHOW_ORDER}:
        return True
    if change.digits is None or abs(change.lost) < _DIGITS_MOVED:
        return False
    return finding.of == "series" or (quantity is not None and quantity.name in _DIGITS)


def _by_integrator(changes: Sequence[Change]) -> Iterator[list[Change]]:
    def name(change: Change) -> str:
        return change.identity.key.subject.name

    for _, group in groupby(sorted(changes, key=name), name):
        yield list(group)
