"""`audit` and `figures`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.app import Json, absolute, command, print_json, require_new, show_on_terminal
from heavytop.cli.progress import counted, followed, waiting
from heavytop.errors import InputError

_AUDIT_SECONDS, _FIGURE_SECONDS = 6.0, 1.0
"""Expected, for the time left: of an audit, and of each figure."""


@command
def audit(
    claim: Annotated[str, typer.Argument(help="ershkov-general, ershkov-partial, or a TOML file.")],
    system: Annotated[
        str | None, typer.Option(help="heavy_top, gyrostat or heavy_gyrostat; without it that of the file.")
    ] = None,
    branch: Annotated[str | None, typer.Option(help="smooth or printed: that branch alone.")] = None,
    json: Json = False,
) -> int:
    """Prove or refute a claimed motion, by equation.

    Exit 0 if all equations hold, 1 if one is refuted, 3 if none is refuted but one is undecided.  Takes 5 to 20
    seconds.
    """
    from heavytop.claims.audit import PAPER, only_branch
    from heavytop.claims.audit import audit as audit_named
    from heavytop.claims.guard import SECONDS

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
        from heavytop.report.audit_text import audit_text

        show_on_terminal(audit_text(report))
    return report.exit_code


@command
def figures(
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")],
    report: Annotated[Path | None, typer.Option(help="Draw every picture of its page instead, as SVG and PDF.")] = None,
) -> int:
    """Draw Figs 2-8 of the paper, and the true motion.

    The true motion beside the claim, all as SVG and PNG.  Takes about 10 seconds.
    """
    out = absolute(out)
    require_new(out)
    try:
        for file in _drawn(out, report):
            print(file)
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error}.", "Choose a writable --out with space.") from None
    return 0


def _drawn(out: Path, report: Path | None) -> list[Path]:
    if report is None:
        from heavytop.measure.curves import FIGURES, drawings
        from heavytop.report.figures import draw_figures

        with counted("figures", FIGURES, "figures", _FIGURE_SECONDS) as advance:
            return draw_figures(drawings(), out, advance)
    from heavytop.kinds import KINDS
    from heavytop.report import store
    from heavytop.report.pictures import draw_report

    return draw_report(store.read(report, KINDS), out, KINDS)
