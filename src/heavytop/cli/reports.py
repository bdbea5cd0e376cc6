"""`compare`, `history`, `show` and `export`."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from shlex import quote
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop.cli.app import (
    Json,
    absolute,
    command,
    plans,
    print_json,
    require_apart,
    show_on_terminal,
    writing,
)
from heavytop.cli.output import Progress, counted, say, say_former
from heavytop.errors import ExitCode
from heavytop.report.render import FORMATS

if TYPE_CHECKING:
    from heavytop.api.reports import Comparison
    from heavytop.api.run_folder import FinishedRun, PlannedRun

_REPORT_SECONDS = 0.1
"""Expected seconds to read a report."""


@command
def compare(
    baseline: Annotated[Path, typer.Argument(help="Report or its folder.")],
    candidate: Annotated[Path, typer.Argument(help="Report or its folder.")],
    policy: Annotated[
        Path | None, typer.Option(help="TOML file of allowed differences: `heavytop docs compare`.")
    ] = None,
    floor: Annotated[str | None, typer.Option(help="Errors below FLOOR eps count as equal (4).")] = None,
    loss: Annotated[str | None, typer.Option(help="Bits by which errors may grow (2; 10 % for truncation).")] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write what changed as Markdown.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write what changed as JUnit XML.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page that draws both on the same axes.")] = None,
    full: Annotated[bool, typer.Option("--full", help="Print every metric that changed.")] = False,
    json: Json = False,
) -> int:
    """Compare two reports; exit 1 if anything is worse.

    Else exit 3 if anything is missing or incomparable, else 0.
    """
    from heavytop.api.reports import compared

    require_apart((html, markdown, junit), baseline, candidate, policy)
    with counted("comparing", 3, "parts", _REPORT_SECONDS) as advance:  # two reports that are read, and their rows
        result = compared(baseline, candidate, policy, floor, loss, json or junit is not None, advance)
    write_comparison(result, markdown, junit, html)
    if json:
        print_json(result.to_json())
    else:
        from heavytop.report.render.comparison import comparison

        show_on_terminal(comparison(result, full))
    return result.exit_code


def write_comparison(comparison: Comparison, markdown: Path | None, junit: Path | None, html: Path | None) -> None:
    """Write the requested files of a comparison, all of them or none."""
    files: list[tuple[Path, str]] = []
    if html is not None:
        files.append((html, comparison.to_html()))
    if markdown is not None:
        files.append((markdown, comparison.to_markdown(html)))
    if junit is not None:
        files.append((junit, comparison.to_junit()))
    _write(files)


@command
def history(
    reports: Annotated[list[Path], typer.Argument(help="Reports or their folders, the oldest first.")],
    metric: Annotated[str, typer.Option(help="Only metrics that match this pattern, changed or not.")] = "",
    case: Annotated[str, typer.Option(help="Only cases that match this pattern.")] = "*",
    policy: Annotated[Path | None, typer.Option(help="TOML file of allowed differences.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with a small chart per metric.")] = None,
    json: Json = False,
) -> int:
    """Show metrics over reports, with every step marked."""
    from heavytop.api.reports import read_history
    from heavytop.report.render.history import history_text

    require_apart((html,), *reports, policy)
    with counted("reading", len(reports), "reports", _REPORT_SECONDS) as advance:
        history_of_reports = read_history(reports, metric, case, policy, advance)
    if html is not None:
        _write([(html, history_of_reports.to_html())])
    if json:
        print_json(history_of_reports.to_json())
    else:
        show_on_terminal(history_text(history_of_reports.names, history_of_reports.tracks))
    return ExitCode.GOOD


def _write(files: list[tuple[Path, str]]) -> None:
    from heavytop.files import replace_all

    with writing():
        replace_all([(path, text.encode()) for path, text in files])


@command
def show(
    report: Annotated[Path, typer.Argument(help="Report or its folder.")],
    html: Annotated[Path | None, typer.Option(help="Write the report as a page to that file instead.")] = None,
    parquet: Annotated[Path | None, typer.Option(help="Write its rows to that file instead.")] = None,
    full: Annotated[bool, typer.Option("--full", help="Print every row and law.")] = False,
    markdown: Annotated[Path | None, typer.Option(help="Write what --full prints to that file instead.")] = None,
    json: Json = False,
) -> int:
    """Print the summary of a report, or write its page.

    The page is one self-contained file; --parquet writes the rows as a table instead.
    """
    from heavytop.api.reports import read_report
    from heavytop.files import atomic_write
    from heavytop.report.store import parquet as tables

    if parquet is not None:
        tables.check_name(parquet)
    files = [path for path in (parquet, html, markdown) if path is not None]
    require_apart(files, report)
    if full or json or not files:
        _print(report, full, json)
    if not files:
        return ExitCode.GOOD
    loaded = read_report(report)
    with ExitStack() as stack:
        stack.enter_context(writing())
        if html is not None:
            page = loaded.to_html().encode()
            stack.enter_context(atomic_write(html)).write(page)
        if markdown is not None:
            stack.enter_context(atomic_write(markdown)).write(loaded.to_markdown().encode())
        if parquet is not None:
            tables.write(parquet, loaded.rows, loaded.plan)
    for path in files if not (full or json) else ():
        print(path)
    return ExitCode.GOOD


def _print(report: Path, full: bool, json: bool) -> None:
    """Print the summary of a report, in short, in full, or as JSON."""
    from heavytop.features.kinds import KINDS
    from heavytop.report.render import text as overview
    from heavytop.report.render.export import to_json
    from heavytop.report.render.terminal import brief, summary
    from heavytop.report.store import store

    if json:
        print_json(to_json(store.read(report, KINDS), KINDS))
        return
    if not full:
        loaded = store.read(report, KINDS)
        print(brief(loaded, loaded.rows, KINDS))
        print(f"\nEvery row: heavytop show {quote(str(report))} --full")
        return
    streamed = store.read_brief(report, KINDS)
    if len(streamed.rows) > overview.MOST_LISTED:
        hint = "Every row is in report.json; --parquet FILE writes all as a table."
        show_on_terminal(overview.worst(streamed, streamed.rows, hint))
    else:
        show_on_terminal(summary(store.read(report, KINDS), KINDS))


@command
def export(
    report: Annotated[Path, typer.Argument(help="Report or its folder.")],
    to: Annotated[str, typer.Option(help=f"One of {', '.join(FORMATS)}.")],
    out: Annotated[Path | None, typer.Option(help="Write it there, not on standard output.")] = None,
) -> int:
    """Write a report in the format of another tool.

    Smaller is better for each number: log10 of error and drift, exponents of growth laws, seconds.
    """
    from heavytop.api.reports import read_report

    require_apart((out,), report)
    text = read_report(report).export(to)
    if out is None:
        print(text, end="")
    else:
        _write([(out, text)])
    return ExitCode.GOOD


# `run`.


@command
def run(
    plan: Annotated[
        str,
        typer.Option(
            help="smoke, default, growth, long, peers, gate, bodies, claims, selftest, engines, or a TOML file.",
            autocompletion=plans,
        ),
    ] = "default",
    integrator: Annotated[
        str, typer.Option(help="Measure it together with heyoka: a name, mine.toml, mine.py:solve.")
    ] = "",
    out: Annotated[
        Path | None, typer.Option(help="New folder DIR for the report; default: one in `heavytop-results`.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the run that --out holds.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; default: the number of processors.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on instead.")] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Write DIR/rows.parquet too.")] = False,
    seed: Annotated[
        int, typer.Option(help="0 to 1000; another seed: the same motions with other rounding errors.")
    ] = 0,
    row_timeout: Annotated[
        str | None, typer.Option(help="Time limit of a row of a third-party integrator.", metavar="SECONDS")
    ] = None,
    save_every: Annotated[float, typer.Option(help="Seconds between checkpoints of a long row.", min=0)] = 10.0,
) -> int:
    """Run a plan of measurements and write its report.

    It goes to DIR/report.json and DIR/report.html.  On two cores smoke, bodies and selftest take about 15 seconds,
    engines half a minute, default a minute, gate and claims two minutes, peers five, growth ten, long half an hour.
    """
    from heavytop.api.run_folder import PAGE, prepare
    from heavytop.harness.plan import former
    from heavytop.report.store.store import FILE as REPORT

    planned = prepare(
        plan,
        # an integrator may change the working directory
        None if out is None else absolute(out),
        resume=resume,
        workers=workers,
        scheduler=scheduler,
        seed=seed,
        integrator=integrator,
        save_every=save_every,
        with_parquet=parquet,
        row_timeout=row_timeout,
    )
    directory = planned.directory
    say_former({integrator} | former(plan))
    for warning in planned.warnings:
        say(f"warning: {warning}")
    if planned.is_finished:
        ended = planned.finished()
        print(ended.summary)
        print(f"\nReport: {directory / REPORT} (already finished)")
        return ExitCode.GOOD if ended.good else ExitCode.INCOMPLETE
    began = perf_counter()
    ended = measured(planned)
    print(ended.summary)
    page = directory / PAGE
    folder = quote(str(directory))
    print(f"\nMade in {perf_counter() - began:.0f} s. Every row: heavytop show {folder} --full")
    print(f"Report: {directory / REPORT}")
    print(f"Page:   {page if page.exists() else f'none for so many rows; `heavytop show {folder} --html FILE`'}")
    return ExitCode.GOOD if ended.good else ExitCode.INCOMPLETE


def measured(planned: PlannedRun) -> FinishedRun:
    """The finished run; an interrupted one prints what is kept, and exits."""
    from heavytop.features.kinds import KINDS
    from heavytop.harness.checkpoint import FILE as ROWS

    try:
        with _stopped_by_signals(), Progress(planned.tasks, KINDS, planned.workers) as advance:
            return planned.measure(advance, advance.begin)
    except KeyboardInterrupt as stop:
        folder = quote(str(planned.directory))
        kept = f"finished rows are kept: `heavytop run` with the same plan and --out {folder} --resume continues"
        say(f"interrupted; {kept if (planned.directory / ROWS).exists() else 'no row was finished'}")
        raise typer.Exit(ExitCode.TERMINATED if isinstance(stop, _Terminated) else ExitCode.INTERRUPTED) from None


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a run like Ctrl-C."""


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Turn SIGINT and SIGTERM into exceptions, so that finished rows are kept and reported."""

    def terminate(*_: object) -> None:
        raise _Terminated

    handlers: dict[signal.Signals, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: terminate}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
