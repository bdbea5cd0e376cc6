"""`audit`, `claims` and `figures`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, absolute, command, print_json, show_on_terminal
from heavytop.cli.output import counted, followed, waiting
from heavytop.errors import ExitCode, InputError
from heavytop.files import require_new, writable

_AUDIT_SECONDS, _FIGURE_SECONDS, _ENTRY_SECONDS = 6.0, 1.0, 1.0
"""Expected durations of an audit, of each figure, and of each entry of the library."""


@command
def audit(
    claim: Annotated[
        str, typer.Argument(help="ershkov-general, ershkov-partial, a name of `heavytop claims`, or a TOML file.")
    ] = "",
    system: Annotated[
        str | None, typer.Option(help="heavy_top, gyrostat or heavy_gyrostat; default: that of the file.")
    ] = None,
    branch: Annotated[str | None, typer.Option(help="Only that branch: smooth or printed.")] = None,
    library: Annotated[bool, typer.Option("--library", help="Audit all of `heavytop claims`: three minutes.")] = False,
    json: Json = False,
) -> int:
    """Prove or refute a claimed motion, by equation.

    Exit 0 if all equations hold, 1 if one is refuted, 3 if none is refuted but one is undecided.  Takes 2 to 7
    seconds.  With --library: 0 if every verdict is the expected one, 1 if one is not, 3 if one is undecided.
    """
    from heavytop.features.claims.audit.audit import PAPER, only_branch, require_branch
    from heavytop.features.claims.audit.audit import audit as audit_named
    from heavytop.features.claims.audit.guard import SECONDS

    if library or not claim:
        if not library:
            raise InputError("No claim was given.", "Give a name of `heavytop claims`, a TOML file, or --library.")
        if claim or system is not None or branch is not None:
            raise InputError("--library audits every claim.", "Leave out the claim, --system and --branch.")
        return _library(json)
    if branch is not None:
        require_branch(branch)
    if claim in PAPER:
        with followed(f"audit of {claim}", "equations", _AUDIT_SECONDS) as progress:
            report = audit_named(claim, system, progress)
    else:
        with waiting(f"audit of {claim}", SECONDS):
            report = audit_named(claim, system)
    if branch is not None:
        report = only_branch(report, branch)
    if json:
        print_json(report.to_json())
    else:
        from heavytop.features.claims.text import audit_text

        show_on_terminal(audit_text(report))
    return report.exit_code


def _library(json: bool) -> int:
    listed = _listed(None, anew=True)
    if json:
        print_json(listed.to_json())
    else:
        from heavytop.features.claims.text import unexpected_text

        show_on_terminal(unexpected_text(listed))
    return ExitCode(listed.exit_code)


@command
def claims(
    tag: Annotated[str | None, typer.Option(help="Only claims with that tag, such as a class or a system.")] = None,
    json: Json = False,
) -> int:
    """List published claims and usual misprints, by verdict.

    Proven or refuted by `heavytop audit NAME`; each verdict that is not cached takes a second.
    """
    listed = _listed(tag, anew=False)
    if json:
        print_json(listed.to_json())
    else:
        from heavytop.features.claims.text import claims_text

        show_on_terminal(claims_text(listed))
    return ExitCode.GOOD


def _listed(tag: str | None, anew: bool) -> Any:
    from heavytop.features.claims.api import claim_library
    from heavytop.features.claims.library.entry import library, require_tag

    chosen = None if tag is None else require_tag(tag)
    count = sum(chosen in (None, *entry.tags) for entry in library().values())
    with counted("audits", count, "claims", _ENTRY_SECONDS) as advance:
        return claim_library(tag, anew=anew, done=advance)


@command
def figures(
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")],
    report: Annotated[Path | None, typer.Option(help="Draw every picture of its page instead, as SVG and PDF.")] = None,
) -> int:
    """Draw Figs 2-8 of Ershkov's paper, and the true motion.

    The true motion beside the claim, all as SVG and PNG.  Takes about 10 seconds.
    """
    out = absolute(out)
    require_new(out)
    with writable(out, "Give a writable --out."):
        for file in _drawn(out, report):
            print(file)
    return ExitCode.GOOD


def _drawn(out: Path, report: Path | None) -> list[Path]:
    if report is None:
        from heavytop.features.claims.figures import FIGURES, draw_figures

        with counted("figures", len(FIGURES), "figures", _FIGURE_SECONDS) as advance:
            return draw_figures(out, advance)
    from heavytop.features.kinds import KINDS
    from heavytop.report.render.plots import draw_report
    from heavytop.report.store import store

    return draw_report(store.read(report, KINDS), out, KINDS)
