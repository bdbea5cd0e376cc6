"""`heavytop hunt`."""

from __future__ import annotations

from typing import Annotated

import typer

from heavytop.cli.app import Json, command, print_json
from heavytop.errors import ExitCode


@command
def hunt(
    integrator: Annotated[str, typer.Option(help="A name of `heavytop list`, mine.toml or mine.py:solve.")] = "heyoka",
    precision: Annotated[str, typer.Option(help="Number format.")] = "double",
    horizon: Annotated[str, typer.Option(help="Time up to which errors count; negative: backwards.")] = "100",
    budget: Annotated[
        str, typer.Option(help="Number of motions, or seconds such as 60s (at least 64 motions).")
    ] = "5000",
    family: Annotated[str, typer.Option(help="any, euler, lagrange, kovalevskaya or heavy_gyrostat.")] = "any",
    against: Annotated[
        str | None, typer.Option(help="Search for the largest ratio to the error of this integrator.")
    ] = None,
    limit: Annotated[
        str | None, typer.Option(help="Report errors above LIMIT eps T^1.5; with --against, above that ratio.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 1,
    json: Json = False,
) -> int:
    """Search for the motion on which an integrator fails.

    Bodies and starts are drawn at random, then varied towards larger errors.  A finding is a run that fails, or an
    error two decades beyond what the integrator's own law and the motion's amplification explain; it is reduced to the
    simplest data that still show it, and proven.  5000 motions of heyoka take three minutes.  Exit code 1 if anything
    is found, else 0.
    """
    from heavytop.cli.output import say_former
    from heavytop.features.hunt.api import hunt as search

    say_former([integrator])
    hunted = search(integrator, precision, horizon, budget, family, against, limit, seed)  # type: ignore[arg-type]
    if json:
        print_json(hunted.document())
    else:
        print(hunted)
    return ExitCode.FINDING if hunted.found else ExitCode.GOOD
