"""`score`."""

from __future__ import annotations

import sys
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
    for warning in given.warnings():
        print(f"heavytop: warning: {warning}", file=sys.stderr)
    row = scored(given)
    if out is not None:
        _write_report(row, given.sha256, out)
    if json:
        import msgspec

        print_json(msgspec.to_builtins(row) | {"digits_kept": digits_kept(row)})
    else:
        from heavytop.report.score_text import score_text

        show_on_terminal(score_text(row))
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
