"""`score`, `compare` and `show`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, command, print_json, require_new, show_on_terminal
from heavytop.errors import InputError


@command
def score(
    trajectory: Annotated[Path, typer.Argument(help="A motion computed elsewhere: .json, .csv, or - to read it.")],
    out: Annotated[Path | None, typer.Option(help="New folder for a report with its row.")] = None,
    json: Json = False,
) -> int:
    """Score a motion computed elsewhere like our own: drift, distance from the known motion, digits kept."""
    from heavytop.suite.score import complete, digits_kept
    from heavytop.suite.score import score as scored
    from heavytop.suite.trajectory_file import read

    if out is not None:
        require_new(out)
    given = read(trajectory)
    row = scored(given)
    if out is not None:
        _write_report(row, given.sha256, out)
    if json:
        import msgspec

        print_json(msgspec.to_builtins(row) | {"digits_kept": digits_kept(row)})
    else:
        from heavytop.report.score_text import score_text

        show_on_terminal(score_text(row, digits_kept(row)))
    return 0 if complete(row) else 3


def _write_report(row: Any, sha256: str, out: Path) -> None:
    """A report with this row alone, which `compare` understands."""
    from heavytop.records import SCHEMA, Report
    from heavytop.report import store
    from heavytop.report.environment import environment

    plan = {"name": "score", "sha256": sha256}
    try:
        out.mkdir(parents=True, exist_ok=True)
        store.write(Report(SCHEMA, plan, environment(), [row]), out)
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error}.", "Choose a writable --out with space.") from None


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
    parquet: Annotated[Path | None, typer.Option(help="Write its rows to this file too.")] = None,
) -> int:
    """Print the summary of a report."""
    from heavytop.report import parquet as tables
    from heavytop.report import store, text

    if parquet is not None:
        tables.check_name(parquet)
    found = store.read(report)
    if parquet is not None:
        tables.write(parquet, found.rows, found.plan)
    show_on_terminal(text.summary(found))
    return 0
