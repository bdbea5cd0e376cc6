"""The command line.  Only this room prints; each command is a few lines that join the other rooms.

Exit codes: 0 good, 1 a finding, 2 usage or bad input, 3 incomplete, undecided or incomparable, 130 interrupted,
143 terminated.
"""

# ruff: noqa: I001
from __future__ import annotations

import os
import sys

from heavytop.cli.app import app
from heavytop.errors import HeavyTopError

# the commands, in the order of `heavytop --help`
from heavytop.cli import run, reports, motions, score, claims, selftest, integrators, listing  # noqa: F401


_COMPLETE = "_HEAVYTOP_COMPLETE"
"""Set by the scripts of `heavytop --completion SHELL`."""


def run_command_line() -> int:
    """Run the command in sys.argv; returns or exits with its code.  Errors are printed as cause and remedy."""
    if _COMPLETE in os.environ:
        from typer import completion

        completion.completion_init()  # type: ignore[attr-defined]
    try:
        app(prog_name="heavytop")
    except HeavyTopError as error:
        print(f"heavytop: {error}", file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0
