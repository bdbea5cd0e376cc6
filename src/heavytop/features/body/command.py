"""`body`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.app import Json, command, numbers, print_json
from heavytop.errors import ExitCode


@command
def body(
    file: Annotated[Path, typer.Argument(help="A URDF, MJCF or SDF file, USD, or TOML with a body.")],
    link: Annotated[str | None, typer.Option(help="Link or body, if the file has several.")] = None,
    pivot: Annotated[
        str | None, typer.Option(help="Fixed point x,y,z in the axes of the link; default: a ball joint, or 0,0,0.")
    ] = None,
    gravity: Annotated[
        str | None,
        typer.Option(help="Acceleration of gravity in the printed table; default: that of the file, or 9.81."),
    ] = None,
    json: Json = False,
) -> int:
    """Check the inertia tensor in a URDF, MJCF or SDF.

    Says whether a rigid body can have it, and if not, which mistake explains it.

    Exit 0 for a body, 1 where none has this tensor or it is implausible, 2 for a file that cannot be
    read.  Prints the body as a table for a plan.
    """
    from heavytop.features.body.document import assess
    from heavytop.precision import vector
    from heavytop.top.body_files import read_body

    where = None if pivot is None else vector(numbers(pivot), "pivot")
    assessment = assess(read_body(file, link), where, gravity)
    if json:
        print_json(assessment.document())
    else:
        print("\n".join(assessment.lines()))
    return ExitCode.GOOD if assessment.sound else ExitCode.FINDING
