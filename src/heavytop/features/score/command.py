"""`heavytop score`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.cli.app import (
    Json,
    absolute,
    cases,
    command,
    print_json,
    require_apart,
    show_on_terminal,
    writing,
)
from heavytop.cli.output import counted, say
from heavytop.errors import InputError
from heavytop.files import require_new, writable

if TYPE_CHECKING:
    from heavytop.records import Report

_STATE_SECONDS = 1e-3
"""Expected of comparing one state."""


@command
def score(
    trajectories: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRAJECTORY...", help="Files of trajectories (`heavytop docs score`); - is standard input."
        ),
    ],
    case: Annotated[
        str | None, typer.Option(help="Built-in case that gives top and start.", autocompletion=cases)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="New folder for a report with its row.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page about it to that file.")] = None,
    require: Annotated[str | None, typer.Option(help="Exit 1 if fewer digits are right, such as 9.5.")] = None,
    normalize: Annotated[
        bool,
        typer.Option("--normalize", help="Normalize quaternions, matrices and gamma."),
    ] = False,
    json: Json = False,
) -> int:
    """Say how many digits of your trajectory are right.

    Digits right at every sample, beside heyoka's in the same format; distance from the known motion; drift of the
    first integrals; what explains the error, where something does.  The file holds Ω and γ, or quaternions, matrices,
    Euler angles, positions, Ω in axes of space: `heavytop docs score`.  Takes a few seconds.

    Several files are scored in parallel, a line each; files that differ in their step alone give the order.

    Exit 0 where the trajectory reached its end, however few digits are right; 3 where it ended early.  With --require
    also 1 where fewer are right, and 3 where its time goes back or the digits are not known.
    """
    from heavytop.features.score.api import read_trajectory, scored
    from heavytop.files import replace_all

    if len(trajectories) > 1:
        return _several(trajectories, case, require, normalize, json, out or html)
    (trajectory,) = trajectories
    if out is not None:
        out = absolute(out)
        require_new(out)
    require_apart((html,), trajectory, out)
    page = None if html is None else absolute(html)
    motion, needed = read_trajectory(trajectory, case, require=require, normalize=normalize)
    for warning in motion.warnings():
        say(f"warning: {warning}")
    with counted("score", 2 * len(motion.times), "states of it and heyoka's", _STATE_SECONDS) as advance:
        score = scored(motion, needed, advance)
    if out is not None:
        _write_report(score.report(), out)
    if page is not None:
        with writing():
            replace_all([(page, score.to_html().encode())])
    if json:
        print_json(score.to_json())
        return score.exit_code
    from heavytop.features.score.text import requirement, score_text

    show_on_terminal(score_text(score.assessment))
    if html is not None:
        print(f"\nPage: {html}")
    if needed is not None:
        print(f"\n{requirement(score.row, needed, motion.cut)}")
    return score.exit_code


def _several(
    paths: list[Path], case: str | None, require: str | None, normalize: bool, json: bool, page: Path | None
) -> int:
    from dataclasses import asdict

    from heavytop.features.score.several import exit_code, orders, score_files, text

    if page is not None:
        raise InputError(f"--out and --html need a single trajectory; got {len(paths)}.", "Score each separately.")
    if Path("-") in paths:
        raise InputError("Standard input must be the only trajectory.", "Give files.")
    files = score_files(paths, case, require, normalize)
    if json:
        print_json({"files": [file.document for file in files], "orders": [asdict(order) for order in orders(files)]})
    else:
        print(text(files))
    return exit_code(files)


def _write_report(report: Report, out: Path) -> None:
    """The report that `compare` and `show` read."""
    from heavytop.report.store import store

    with writable(out, "Give a writable --out."):
        out.mkdir(parents=True, exist_ok=True)
        store.write(report, out)
