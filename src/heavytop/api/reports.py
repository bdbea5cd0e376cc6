"""Runs of plans, their reports and comparisons, from Python."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heavytop import arguments, records
from heavytop.api.run_folder import prepare
from heavytop.arguments import Number
from heavytop.display import Tabular, TitledTable, plural, printable
from heavytop.errors import InputError, meant, quoted, refusal
from heavytop.features.kinds import KINDS
from heavytop.measure.scalar import digits_kept
from heavytop.precision import as_integer, ordered
from heavytop.report.compare import compare as comparing
from heavytop.report.compare import noise as policies
from heavytop.report.document.document import clip, row_name, short
from heavytop.report.render import export as exports
from heavytop.report.render import history as over
from heavytop.report.render.comparison import headline, metric_name, values
from heavytop.report.render.text import drifts, failed
from heavytop.report.store import store
from heavytop.report.store.checks import check_keys
from heavytop.report.store.parquet import COLUMNS, lines

if TYPE_CHECKING:
    import pandas

PathLike = str | os.PathLike[str]


class Report(Tabular, records.Report, frozen=True):
    """A run of a plan: ``schema``, ``plan``, ``environment`` and ``rows``, in the plan's order."""

    @property
    def verdict(self) -> str:
        """``complete``, or ``incomplete`` if a row failed."""
        return "incomplete" if any(failed(row, KINDS) for row in self.rows) else "complete"

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a table, one line per metric and growth law, with the columns of `--parquet`.

        Raises InputError if pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise InputError("A table needs pandas.", "Install it with: pip install pandas") from None
        return pandas.DataFrame(list(lines(self.rows)), columns=list(COLUMNS))

    def export(self, to: str) -> str:
        """The text of a file for another tool: ``to`` is a name that `heavytop export --help` lists, such as junit.

        Smaller numbers are better: log10 of error and drift, exponents of growth laws, seconds.  Raises
        InputError for another tool.
        """
        return exports.export(self, arguments.text(to, "to"), KINDS)

    def to_html(self) -> str:
        """The page of `show --html`: one self-contained file."""
        from heavytop.report.render.page import report_page

        return report_page(self, KINDS)

    def to_json(self) -> dict[str, Any]:
        """The document of `show --json`."""
        return exports.to_json(self, KINDS)

    def to_markdown(self) -> str:
        """The text of `show --markdown`."""
        return exports.to_markdown(self, KINDS)

    def _table(self) -> TitledTable:
        count = sum(failed(row, KINDS) for row in self.rows)
        title = f"Report of plan {self.plan.get('name', '')}: {plural(len(self.rows), 'row')}, {self.verdict}"
        if count:
            title += f" ({count} failed)"
        body = []
        for row in self.rows:
            right = digits_kept(row)
            metrics = [metric for _, metric in drifts(row)]
            worst = max(metrics, key=lambda m: m.log10 or -1e9).value if metrics else ""
            cells = (row_name(row.identity), row.outcome, "" if right is None else f"{max(right, 0):.1f}", short(worst))
            body.append(list(map(printable, cells)))
        return TitledTable(printable(title), ("row", "outcome", "digits right", "largest drift"), body)


@dataclass(frozen=True, slots=True, repr=False)
class Comparison(Tabular, comparing.Differences):
    """Two reports compared: ``verdict`` (same, better, worse, incomparable), ``changed``, ``tally``, ``to_json()``.

    reports: the baseline and the candidate.
    """

    reports: tuple[store.AnyReport, store.AnyReport] = field(kw_only=True, compare=False)

    def to_html(self) -> str:
        """The page of `compare --html`, with both reports on the same axes."""
        from heavytop.report.render.page import comparison_page

        old, new = (store.full_report(report) for report in self.reports)
        return comparison_page(old, new, self, KINDS)

    def to_junit(self) -> str:
        """The document of `compare --junit`: one test case per metric."""
        return exports.comparison_junit(self)

    def to_markdown(self, page: PathLike | None = None) -> str:
        """The text of `compare --markdown`: the findings, then a line for each row that changed.

        page: the file of :meth:`to_html`, for a link at the end.
        """
        return exports.comparison_markdown(self, None if page is None else arguments.path(page, "page"))

    def _table(self) -> TitledTable:
        body = [
            list(map(printable, (row_name(f.row), metric_name(f), f.verdict.value, *values(f), f.reason)))
            for f in self.changed
        ]
        notes = [printable(f"{name}: {old} -> {new}") for name, old, new in self.environment]
        notes += [printable(motion.sentence) for motion in self.motions if motion.sentence]
        return TitledTable(headline(self), ("row", "metric", "verdict", "baseline", "candidate", "why"), body, notes)


@dataclass(frozen=True, repr=False)
class History(Tabular):
    """Metrics over reports: ``names`` of the reports, the oldest first, and ``tracks``, one per metric of a row.

    A track has ``row``, ``metric``, ``values`` (one per report, None if missing) and ``steps``: by the index of a
    report the verdict, other than same, on the change from the one before it, with the reason.
    """

    names: list[str]
    tracks: list[over.Track]
    reports: list[store.AnyReport]

    def to_html(self) -> str:
        """The page of `history --html`: a small chart per metric."""
        return over.history_page(self.names, self.reports, self.tracks)

    def to_json(self) -> dict[str, Any]:
        """The document of `history --json`."""
        return over.history_json(self.names, self.tracks)

    def _table(self) -> TitledTable:
        heads = ("row", "metric", *(str(number) for number in range(1, len(self.names) + 1)))
        notes = [printable(f"{number}  {name}") for number, name in enumerate(self.names, 1)]
        title = f"{plural(len(self.tracks), 'metric')} over {len(self.names)} reports"
        return TitledTable(title, heads, [list(map(printable, over.cells(track))) for track in self.tracks], notes)


def run(
    plan: PathLike = "default",
    out: PathLike | None = None,
    *,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    seed: int = 0,
    integrator: str | Callable[..., Any] | None = None,
    parquet: bool = False,
    row_timeout: Number | None = None,
) -> Report:
    """Run a plan of measurements, write its report and page, and return the report.

    Arguments:
        plan: one of `harness.BUILT_IN`, such as default, or the path of a TOML file (`heavytop docs plans`).
        out: a new folder; None for a new one under heavytop-results.
        resume: continue the run in ``out``.
        workers: local processes; None for as many as there are processors.  No main guard is needed.
        scheduler: the address of a Dask scheduler to run on instead.
        integrator: measured in addition to heyoka: a name such as ``mine:name``, a file (``mine.toml``,
            ``./mine.py:solve``), or a callable as :func:`heavytop.integrate.peers.double.double_peer` makes or takes
            it.  It runs in a process of its own.
        seed: of the roundings of the same motions: 0 to 1000.
        parquet: write rows.parquet too.
        row_timeout: seconds that a row of a third-party integrator may take; None for the plan's, or limits by its
            other rows (`heavytop docs gate`).

    Returns:
        A :class:`Report`.  A motion that failed is a row with its outcome, not an exception.

    Raises:
        InputError: for an impossible plan, a folder with other content or not writable, and contradictory options.
    """
    planned = prepare(
        str(arguments.path(plan, "plan")),
        None if out is None else arguments.path(out, "out"),
        resume=bool(arguments.flag(resume, "resume")),
        workers=workers,
        scheduler=None if scheduler is None else arguments.text(scheduler, "scheduler"),
        seed=as_integer(seed, "seed"),
        integrator=_integrator(integrator),
        with_parquet=bool(arguments.flag(parquet, "parquet")),
        row_timeout=row_timeout,
    )
    for warning in planned.warnings:
        warnings.warn(warning, stacklevel=2)
    if planned.is_finished:
        planned.finished()
    else:
        planned.measure()
    return read_report(planned.directory)


def _integrator(integrator: str | Callable[..., Any] | None) -> str | Callable[..., Any]:
    if integrator is None:
        return ""
    return integrator if callable(integrator) else arguments.text(integrator, "integrator")


def read_report(path: PathLike) -> Report:
    """A report from disk.

    Arguments:
        path: the folder of a run, or its report.json.

    Returns:
        A :class:`Report`.

    Raises:
        InputError: for a file that is missing, truncated, of another program or schema, modified, or inconsistent.
    """
    report = store.read(arguments.path(path, "path"), KINDS)
    return Report(report.schema, report.plan, report.environment, report.rows, report.beside)


def compare(
    baseline: records.Report | PathLike,
    candidate: records.Report | PathLike,
    *,
    policy: PathLike | None = None,
    floor: Number | None = None,
    loss: Number | None = None,
) -> Comparison:
    """Compare two reports, row by row and metric by metric.

    Arguments:
        baseline, candidate: reports, or their folders or files; for these the motions of surveys are joined.
        policy: a TOML file of what counts as the same (`heavytop docs compare`).
        floor: errors below ``floor`` eps count as equal.
        loss: bits by which an error may grow; by default 2, and 10 % for truncation errors.

    Returns:
        A :class:`Comparison`; ``verdict`` is "worse" if anything is, else "incomparable" if anything is missing or
        cannot be compared, else "better" or "same".

    Raises:
        InputError: for an invalid report or policy, and if there is nothing to compare.
    """
    return compared(baseline, candidate, policy, floor, loss)


def compared(
    baseline: records.Report | PathLike,
    candidate: records.Report | PathLike,
    policy: PathLike | None,
    floor: Number | None,
    loss: Number | None,
    list_same: bool = True,
    read: Callable[[], None] = lambda: None,
) -> Comparison:
    """Compare like :func:`compare`.  list_same: False to count unchanged metrics.  read: called after each report."""
    rules = policies.Policy() if policy is None else policies.load(arguments.path(policy, "policy"))
    rules = policies.adjusted(rules, arguments.limit(floor, "floor"), arguments.limit(loss, "loss"))
    with ThreadPoolExecutor(2) as pool:
        old, new = pool.map(_report, (baseline, candidate), ("baseline", "candidate"), repeat(read))
    folders = None
    if not isinstance(baseline, records.Report) and not isinstance(candidate, records.Report):
        folders = _folder(arguments.path(baseline, "baseline")), _folder(arguments.path(candidate, "candidate"))
    comparison = comparing.compare(old, new, rules, KINDS, list_same=list_same, folders=folders)
    return Comparison(
        **{field.name: getattr(comparison, field.name) for field in fields(comparison) if field.init},
        reports=(old, new),
    )


def _folder(report: Path) -> Path:
    """The folder of a report, from the folder or its file."""
    return report if report.is_dir() else report.parent


def history(
    reports: Sequence[records.Report | PathLike],
    *,
    metric: str = "",
    case: str = "*",
    policy: PathLike | None = None,
) -> History:
    """Metrics over reports, with every step from one to the next.

    Arguments:
        reports: two or more reports, or their folders or files, the oldest first.
        metric: a pattern such as ``drift_*``; empty for all metrics that changed.
        case: a pattern for the cases.
        policy: a TOML file of what counts as a step (`heavytop docs compare`).

    Returns:
        A :class:`History`.

    Raises:
        InputError: for fewer than two reports, an invalid report or policy, and a pattern that matches nothing.
    """
    return read_history(reports, metric, case, policy, lambda: None)


def read_history(reports: Any, metric: str, case: str, policy: PathLike | None, read: Callable[[], None]) -> History:
    """Make a history like :func:`history`; ``read`` is called after each report."""
    folders = ordered(reports, "reports", "Give a list of reports or of their folders, the oldest first.")
    if len(folders) < 2:
        raise InputError("A history needs at least two reports.", "Give their folders, the oldest first.")
    rules = policies.Policy() if policy is None else policies.load(arguments.path(policy, "policy"))
    cases, metrics = policies.glob(arguments.text(case, "case")), policies.glob(arguments.text(metric, "metric") or "*")
    names, report = [], []
    for number, source in enumerate(folders, 1):
        ready = isinstance(source, records.Report)
        names.append(f"report {number}" if ready else str(arguments.path(source, "reports")))
        report.append(_report(source, "reports", read))
    tracks = over.history(report, rules, KINDS)
    matching = [t for t in tracks if cases.fullmatch(t.row.case) and metrics.fullmatch(t.metric)]
    if not matching:
        _require_match(cases, "case", case, {row.case for source in report for row in source.rows})
        of_cases = {track.metric for track in tracks if cases.fullmatch(track.row.case)}
        _require_match(metrics, "metric", metric, of_cases | {"seconds run", "seconds least"})
    return History(names, [track for track in matching if metric or track.steps], report)


def _require_match(pattern: re.Pattern[str], what: str, text: str, known: set[str]) -> None:
    """Raise InputError if none of the known names matches; ``""`` is that of a whole row."""
    if not any(map(pattern.fullmatch, known)):
        listed = clip(", ".join(sorted(known - {""})), 300)
        raise InputError(
            f"No {what} of the reports matches {quoted(text)}.", f"{meant(text, known)}They have {listed}."
        )


def _report(source: Any, what: str, read: Callable[[], None]) -> store.AnyReport:
    """A report, or that of a path, whose rows are read lazily; ``read`` is called afterwards."""
    if not isinstance(source, records.Report | str | os.PathLike):
        raise refusal(what, "a report", quoted(source), "Give a Report, or the path of one.")
    if isinstance(source, records.Report):
        check_keys(what, source.rows)
        report: store.AnyReport = source
    else:
        report = store.read_brief(arguments.path(source, what), KINDS)
    read()
    return report
