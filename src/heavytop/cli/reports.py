"""`compare`, `history`, `show` and `export`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, command, print_json, show_on_terminal, writing
from heavytop.cli.progress import counted
from heavytop.errors import InputError

_REPORT_SECONDS = 0.1
"""Expected of reading one."""


@command
def compare(
    baseline: Annotated[Path, typer.Argument(help="Report or its folder.")],
    candidate: Annotated[Path, typer.Argument(help="Report or its folder.")],
    policy: Annotated[Path | None, typer.Option(help="TOML file of what counts as the same, docs/compare.md.")] = None,
    floor: Annotated[str | None, typer.Option(help="Errors below FLOOR eps are all the same: 4.")] = None,
    loss: Annotated[str | None, typer.Option(help="Bits that an error may grow by: 2.")] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write what changed as Markdown.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write what changed as JUnit XML.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page that draws both on the same axes.")] = None,
    full: Annotated[bool, typer.Option("--full", help="Print every metric that changed.")] = False,
    json: Json = False,
) -> int:
    """Compare two reports; exit 1 if anything is worse.

    Else exit 3 if anything is missing or incomparable, else 0.
    """
    from heavytop.kinds import KINDS
    from heavytop.report import store
    from heavytop.report.compare import compare as compare_reports

    rules = _policy(policy, floor, loss)
    files: list[tuple[Path, str]] = []
    if html is not None:
        from heavytop.report.html import comparison_page

        old, new = _read([baseline, candidate], store.read)
        result = compare_reports(old, new, rules, KINDS)
        files.append((html, comparison_page(old, new, result, KINDS)))
    else:
        all_of_them = json or junit is not None
        before, after = _read([baseline, candidate], store.read_brief)
        result = compare_reports(before, after, rules, KINDS, list_same=all_of_them)
    if markdown is not None:
        from heavytop.report.markdown import comparison_markdown

        files.append((markdown, comparison_markdown(result, html)))
    if junit is not None:
        from heavytop.report.junit import comparison_junit

        files.append((junit, comparison_junit(result)))
    _write(files)
    if json:
        print_json(result.to_json())
    else:
        from heavytop.report.comparison_text import comparison

        show_on_terminal(comparison(result, full))
    return result.exit_code


@command
def history(
    reports: Annotated[list[Path], typer.Argument(help="Reports or their folders, the oldest first.")],
    metric: Annotated[str, typer.Option(help="Only metrics that match this pattern, changed or not.")] = "",
    case: Annotated[str, typer.Option(help="Only cases that match this pattern.")] = "*",
    policy: Annotated[Path | None, typer.Option(help="TOML file of what counts as a step.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with a small chart a metric.")] = None,
    json: Json = False,
) -> int:
    """Show metrics over reports, with every step marked."""
    from heavytop.kinds import KINDS
    from heavytop.report import history as over
    from heavytop.report import store
    from heavytop.report.policy import glob

    if len(reports) < 2:
        raise InputError("A history needs two reports or more.", "Give their folders, the oldest first.")
    rules, cases, metrics = _policy(policy, None, None), glob(case), glob(metric or "*")
    read = _read(reports, store.read_brief)
    tracks = over.history(read, rules, KINDS)
    tracks = [t for t in tracks if cases.fullmatch(t.row.case) and metrics.fullmatch(t.metric)]
    if not metric:
        tracks = [track for track in tracks if track.steps]
    names = [str(path) for path in reports]
    if html is not None:
        from heavytop.report.history_page import history_page

        _write([(html, history_page(names, read, tracks))])
    if json:
        print_json(over.history_json(names, tracks))
    else:
        show_on_terminal(over.history_text(names, tracks))
    return 0


def _read(paths: list[Path], reader: Callable[..., Any]) -> list[Any]:
    """What ``reader`` makes of each report."""
    from heavytop.kinds import KINDS

    found = []
    with counted("reading", len(paths), "reports", _REPORT_SECONDS) as advance:
        for path in paths:
            found.append(reader(path, KINDS))
            advance()
    return found


def _policy(file: Path | None, floor: str | None, loss: str | None) -> Any:
    """The policy of a file or the default one; the options count before either."""
    from heavytop.report.policy import Policy, adjusted, load

    return adjusted(Policy() if file is None else load(file), floor, loss)


def _write(files: list[tuple[Path, str]]) -> None:
    from heavytop.suite.files import replace_all

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
    from heavytop.kinds import KINDS
    from heavytop.report import parquet as tables
    from heavytop.report import store
    from heavytop.suite.files import whole

    if parquet is not None:
        tables.check_name(parquet)
    files = [path for path in (parquet, html, markdown) if path is not None]
    for place, path in enumerate(files):
        if path.resolve() in [other.resolve() for other in files[:place]]:
            raise InputError(f"{path} is named twice.", "Give each file a name of its own.")
    if not files:
        _print(report, full, json)
        return 0
    found = store.read(report, KINDS)
    with ExitStack() as stack:
        stack.enter_context(writing())
        if html is not None:
            from heavytop.report.html import report_page

            page = report_page(found, KINDS).encode()
            stack.enter_context(whole(html)).write(page)
        if markdown is not None:
            from heavytop.report.document_formats import to_markdown

            stack.enter_context(whole(markdown)).write(to_markdown(found, KINDS).encode())
        if parquet is not None:
            tables.write(parquet, found.rows, found.plan)
    for path in files:
        print(path)
    return 0


def _print(report: Path, full: bool, json: bool) -> None:
    """The summary of a report, in short, in full, or as JSON."""
    from heavytop.kinds import KINDS
    from heavytop.report import overview, store
    from heavytop.report.document_formats import to_json
    from heavytop.report.terminal import brief, summary

    if json:
        print_json(to_json(store.read(report, KINDS), KINDS))
        return
    if not full:
        found = store.read(report, KINDS)
        print(brief(found, found.rows, KINDS))
        print(f"\nEvery row: heavytop show {report} --full")
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
    to: Annotated[str, typer.Option(help="bencher, github-action-benchmark, asv, junit or csv.")],
    out: Annotated[Path | None, typer.Option(help="Write it there, not on standard output.")] = None,
) -> int:
    """Write a report in the format of another tool.

    Of each number smaller is better: log10 of error and drift, exponents of growth laws, seconds.
    """
    from heavytop.kinds import KINDS
    from heavytop.report import store
    from heavytop.report.export import export as exported

    text = exported(store.read(report, KINDS), to, KINDS)
    if out is None:
        print(text, end="")
    else:
        _write([(out, text)])
    return 0
