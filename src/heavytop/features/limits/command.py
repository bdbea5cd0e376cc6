"""`heavytop power`."""

from __future__ import annotations

from typing import Annotated

import typer

from heavytop.cli.app import Json, cases, command, numbers, print_json
from heavytop.cli.output import counted
from heavytop.errors import ExitCode, InputError


@command
def power(
    until: Annotated[str, typer.Option(help="Time at which the test ends.")],
    tolerance: Annotated[str, typer.Option(help="Largest error that passes: absolute below 1, relative above.")],
    case: Annotated[str | None, typer.Option(help="A case of `heavytop list`.", autocompletion=cases)] = None,
    file: Annotated[str | None, typer.Option(help="File of a robot in place of --case, with --omega.")] = None,
    link: Annotated[str | None, typer.Option(help="Link in the file.")] = None,
    gravity: Annotated[str, typer.Option(help="With --file: the acceleration of gravity.")] = "9.81",
    omega: Annotated[str | None, typer.Option(help="With --file: angular velocity x,y,z at t = 0.")] = None,
    quaternion: Annotated[str, typer.Option(help="With --file: attitude w,x,y,z at t = 0.")] = "1,0,0,0",
    step: Annotated[str | None, typer.Option(help="Time between samples; default: --until/100.")] = None,
    planted: Annotated[str, typer.Option(help="Names of faults, or all.")] = "all",
    integrator: Annotated[str, typer.Option(help="Integrator of the correct run.")] = "heyoka",
    control: Annotated[str | None, typer.Option(help="Tolerance or step of the correct run.")] = None,
    json: Json = False,
) -> int:
    """Say how long a regression test must be.

    For each planted fault: the time from which a test with this tolerance detects it, and the widest tolerance that
    does by --until.  Exit 0 where a right run passes and every fault is detected, else 1.
    """
    from heavytop.cases import case as case_named
    from heavytop.features.limits.power import expected_seconds
    from heavytop.features.limits.power import power as power_of
    from heavytop.top.bodies import motion_of

    if (case is None) == (file is None):
        raise InputError("Exactly one of --case and --file must be given.", "`heavytop list` shows the cases.")
    if case is not None:
        if (link, gravity, omega, quaternion) != (None, "9.81", None, "1,0,0,0"):
            raise InputError(
                "A case defines its start and gravity.",
                "Give --link, --gravity, --omega and --quaternion with --file.",
            )
        known = case_named(case)
        top, start, system = known.body or known.top, known.given_start or known.start, known.system.name
    else:
        data = {"file": file, "link": link, "gravity": gravity, "omega": omega and numbers(omega)}
        top, start = motion_of(data | {"quaternion": numbers(quaternion)})
        system = None
    with counted("power", 1, "tests", expected_seconds(top, start, until, system)) as advance:
        test = power_of(
            top, start, until, tolerance, step, planted, integrator=integrator, control=control, system=system
        )
        advance()
    if json:
        print_json(test.to_json())
    else:
        print(test)
    return ExitCode.GOOD if test.detects_all else ExitCode.FINDING
