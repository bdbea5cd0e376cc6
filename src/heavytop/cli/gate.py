"""`gate`."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from shlex import join, quote
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.cli.app import Json, absolute, command, print_json, require_apart, show_on_terminal
from heavytop.cli.output import say, say_former
from heavytop.cli.reports import measured, write_comparison
from heavytop.errors import ExitCode, InputError

if TYPE_CHECKING:
    from heavytop.api.reports import Comparison
    from heavytop.api.run_folder import FinishedRun


@command
def gate(
    plan: Annotated[str, typer.Option(help="A TOML file, or a name of `heavytop list` such as gate.")] = "gate.toml",
    integrator: Annotated[str, typer.Option(help="As for `run`: a name, mine.toml, mine.py:solve.")] = "",
    baseline: Annotated[Path, typer.Option(help="Folder of the trusted report.")] = Path(".heavytop/baseline"),
    policy: Annotated[Path | None, typer.Option(help="As for `compare`; policy.toml beside the plan if any.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the new report; an earlier one is replaced.")] = Path(
        ".heavytop/new"
    ),
    bless: Annotated[bool, typer.Option("--bless", help="Make the new report the baseline.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; default: the number of processors.")] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write what changed as Markdown.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write what changed as JUnit XML.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page that draws both on the same axes.")] = None,
    json: Json = False,
) -> int:
    """Measure, and compare with the baseline.

    Exit codes are those of `compare`.  --bless makes the new report the baseline, and prints the text of a commit
    message with the old and the new numbers; it ends with 0, or with 3 where a measurement failed.
    """
    from heavytop.api.gate import clear, policy_of, require_baseline
    from heavytop.api.reports import compared
    from heavytop.api.run_folder import prepare
    from heavytop.harness.plan import former
    from heavytop.report.compare.noise import load
    from heavytop.report.render.comparison import comparison
    from heavytop.report.store.store import DIGEST

    trusted, fresh, rules = absolute(baseline), absolute(out), policy_of(plan, policy)
    if fresh.resolve() == trusted.resolve():
        raise InputError(f"{out} is named twice.", "Give different folders for the new report and the baseline.")
    code = Path(integrator.partition(":")[0]) if integrator else None
    require_apart((markdown, junit, html), baseline, out, rules, Path(plan), code)
    _require_usable((markdown, junit, html), baseline, fresh)
    if rules is not None:
        load(rules)
    command_line = join(["heavytop", *sys.argv[1:], "--bless"])

    def make_room(folder: Path) -> None:
        if not bless:
            require_baseline(trusted, command_line)
        clear(folder)

    planned = prepare(plan, fresh, integrator=integrator, workers=workers, clear=make_room)
    say_former({integrator} | former(plan))
    for warning in planned.warnings:
        say(f"warning: {warning}")
    if not bless and not (trusted / DIGEST).exists():
        say(f"warning: {baseline} has no {DIGEST}: edits of it are not noticed. --bless writes one.")
    ended = measured(planned)
    try:
        differences = compared(trusted, fresh, rules, None, None, json or junit is not None)
    except InputError as error:
        if not bless:
            raise
        if trusted.exists():
            say(f"nothing to compare with: {error.cause}")
        return _bless(ended, None, (trusted, baseline), (fresh, out), json)
    write_comparison(differences, markdown, junit, html)
    if bless:
        return _bless(ended, differences, (trusted, baseline), (fresh, out), json)
    if json:
        print_json(differences.to_json())
    else:
        print(f"{ended.summary}\n")
        by_rules = f" --policy {quote(str(rules))}" if rules else ""
        show = f"heavytop compare {quote(str(baseline))} {quote(str(out))}{by_rules} --full"
        show_on_terminal(comparison(differences, for_full=show))
    return differences.exit_code


def _require_usable(files: Iterable[Path | None], baseline: Path, fresh: Path) -> None:
    """Refuse, before minutes of measuring, files without a folder and a file as baseline."""
    for file in filter(None, files):
        if not absolute(file).parent.is_dir() and fresh not in absolute(file).parents:
            raise InputError(f"{file} cannot be written: its folder does not exist.", "Give a file in another folder.")
    if absolute(baseline).is_file():
        raise InputError(f"{baseline} is a file.", "Give a folder as --baseline.")


def _bless(
    ended: FinishedRun, differences: Comparison | None, trusted: tuple[Path, Path], fresh: tuple[Path, Path], json: bool
) -> int:
    """Move the baseline and print how to commit it.  trusted, fresh: the folders, absolute and as typed."""
    from heavytop.api.gate import MESSAGE, bless

    message = bless(fresh[0], trusted[0], ended.summary, differences)
    if json:
        document = {"verdict": "new"} if differences is None else differences.to_json()
        print_json(document | {"message": message})
    else:
        commit = f"git add {quote(str(trusted[1]))} && git commit -F {quote(str(fresh[1] / MESSAGE))}"
        print(f"{message}\nThe baseline {'is made' if differences is None else 'has moved'}: {commit}")
    return ExitCode.GOOD if ended.good else ExitCode.INCOMPLETE
