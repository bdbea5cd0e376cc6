"""`compare` and `show`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.app import Json, command, print_json, show_on_terminal
from heavytop.errors import InputError


@command
def compare(
    baseline: Annotated[Path, typer.Argument(help="Report or its folder.")],
    candidate: Annotated[Path, typer.Argument(help="Report or its folder.")],
    floor: Annotated[str, typer.Option(help="Errors below FLOOR eps are all the same.")] = "4",
    loss: Annotated[str, typer.Option(help="Bits that an error may grow by.")] = "2",
    json: Json = False,
) -> int:
    """Compare two reports: exit 1 if anything is worse, 3 if anything is missing or incomparable, else 0."""
    from heavytop.precision import exact
    from heavytop.report import store, text
    from heavytop.report.compare import Policy
    from heavytop.report.compare import compare as compare_reports

    policy = Policy(floor=exact(floor), loss=exact(loss))
    result = compare_reports(store.read(baseline), store.read(candidate), policy)
    if json:
        rows = [finding.to_json() for finding in result.findings]
        environment = [{"name": n, "baseline": a, "candidate": b} for n, a, b in result.environment]
        print_json({"verdict": result.verdict, "rows": rows, "environment": environment})
    else:
        show_on_terminal(text.comparison(result))
    return result.exit_code


@command
def show(
    report: Annotated[Path, typer.Argument(help="Report or its folder.")],
    html: Annotated[Path | None, typer.Option(help="Write the report as a page to that file instead.")] = None,
) -> int:
    """Print the summary of a report, or write it as one self-contained page."""
    from heavytop.report import store, text

    found = store.read(report)
    if html is None:
        show_on_terminal(text.summary(found))
        return 0
    from heavytop.report.html import write_report

    try:
        write_report(found, html)
    except InputError as error:
        raise InputError(error.cause, "Give a file in a writable folder with --html.") from None
    print(html)
    return 0
