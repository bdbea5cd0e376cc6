"""`score`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, absolute, cases, command, print_json, require_new, show_on_terminal, writing
from heavytop.cli.output import say
from heavytop.cli.progress import counted
from heavytop.errors import InputError

_STATE_SECONDS = 1e-3
"""Expected of comparing one state."""


@command
def score(
    trajectory: Annotated[Path, typer.Argument(help="A motion computed elsewhere: .json, .csv, or - to read it.")],
    case: Annotated[str | None, typer.Option(help="Built-in case of its top and start.", autocompletion=cases)] = None,
    out: Annotated[Path | None, typer.Option(help="New folder for a report with its row.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page about it to that file.")] = None,
    json: Json = False,
) -> int:
    """Say how many digits of your trajectory are right.

    Digits right at every sample, beside heyoka's in the same format; distance from the known motion; drift of the
    first integrals; what explains the error, where something does.  The file: docs/score.md.  Takes a few seconds.
    """
    from heavytop.suite.cases import case as case_named
    from heavytop.suite.score import assess, complete
    from heavytop.suite.trajectory_file import read

    if out is not None:
        out = absolute(out)
        require_new(out)
    given = read(trajectory, None if case is None else case_named(case))
    for warning in given.warnings():
        say(f"warning: {warning}")
    with counted("score", 2 * len(given.times), "states", _STATE_SECONDS) as advance:
        found = assess(given, advance)
    if out is not None:
        _write_report(found.row, given.sha256, out)
    if html is not None:
        _write_page(found, absolute(html))
    if json:
        from heavytop.report.score_text import to_json

        print_json(to_json(found))
    else:
        from heavytop.report.score_text import score_text

        show_on_terminal(score_text(found))
        if html is not None:
            print(f"\nPage: {html}")
    return 0 if complete(found.row) else 3


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


def _write_page(found: Any, path: Path) -> None:
    from heavytop.report.environment import environment
    from heavytop.report.score_page import score_page
    from heavytop.suite.files import replace

    with writing():
        replace(path, score_page(found, environment()).encode())
