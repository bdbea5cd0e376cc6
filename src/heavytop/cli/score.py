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
    require: Annotated[str | None, typer.Option(help="Exit 1 where fewer digits are right: 9.5.")] = None,
    normalize: Annotated[
        bool,
        typer.Option("--normalize", help="Take quaternions, matrices and gamma of any length."),
    ] = False,
    json: Json = False,
) -> int:
    """Say how many digits of your trajectory are right.

    Digits right at every sample, beside heyoka's in the same format; distance from the known motion; drift of the
    first integrals; what explains the error, where something does.  The file holds Ω and γ, or quaternions, matrices,
    Euler angles, positions, Ω in axes of space: docs/score.md.  Takes a few seconds.
    """
    from heavytop.suite.cases import case as case_named
    from heavytop.suite.score import assess, passed, required
    from heavytop.suite.trajectory_file import read

    if out is not None:
        out = absolute(out)
        require_new(out)
    needed = None if require is None else required(require)
    given = read(trajectory, None if case is None else case_named(case), normalize)
    for warning in given.warnings():
        say(f"warning: {warning}")
    with counted("score", 2 * len(given.times), "states", _STATE_SECONDS) as advance:
        found = assess(given, advance)
    if out is not None or html is not None:
        _write(found, given.sha256, out, None if html is None else absolute(html))
    if json:
        from heavytop.report.score_text import to_json

        print_json(to_json(found) if needed is None else to_json(found) | {"passed": passed(found.row, needed)})
    else:
        from heavytop.report.score_text import requirement, score_text

        show_on_terminal(score_text(found))
        if html is not None:
            print(f"\nPage: {html}")
    good = passed(found.row, needed)
    if needed is not None and not json:
        print(f"\n{requirement(found.row, needed)}")
    return 3 if good is None else 0 if good else 1


def _write(found: Any, sha256: str, out: Path | None, html: Path | None) -> None:
    """The report that `compare` and `show` read, and its page."""
    from heavytop.kinds import KINDS
    from heavytop.report import store
    from heavytop.report.environment import environment
    from heavytop.report.html import write_report
    from heavytop.report.score_page import score_report

    report = score_report(found, environment(), sha256)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
            store.write(report, out)
        except OSError as error:
            raise InputError(f"{out} cannot be written: {error}.", "Choose a writable --out with space.") from None
    if html is not None:
        with writing():
            write_report(report, html, KINDS)
