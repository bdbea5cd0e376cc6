"""The command line.  Only this package prints; each command is a few lines that call the others.

Exit codes, :class:`heavytop.errors.ExitCode`: 0 good, 1 a finding, 2 usage, bad input, or an output that cannot be
written, 3 incomplete, undecided, incomparable or out of reach, 130 interrupted, 141 nobody reads the output any more,
143 terminated.
"""

from __future__ import annotations

import os
import sys
from copy import copy

from heavytop.cli import docs, gate, integrators, motions, output, reports  # noqa: F401  # each adds its commands
from heavytop.cli.app import app
from heavytop.cli.motions import with_file_of_latex
from heavytop.errors import ExitCode, HeavyTopError
from heavytop.features import FEATURES

_ORDER = (
    *("run", "gate", "compare", "history", "show", "export"),
    *("propagate", "reference", "score", "audit", "claims", "figures", "body"),
    *("selftest", "check-integrator", "new", "hunt", "list", "docs"),
)
"""The commands in the order of ``heavytop --help``; others come last."""
for feature in FEATURES:
    for commands in feature.commands:
        feature.load(commands)
app.registered_commands.sort(key=lambda command: (*_ORDER, command.name).index(command.name))

_COMPLETE = "_HEAVYTOP_COMPLETE"
"""Set by the scripts of `heavytop --completion SHELL`."""


_NO_MEMORY = "Not enough memory.\n  Request less at once, or use a machine with more."


def run_command_line() -> int:
    """Run the command in sys.argv; returns or exits with its code.  Errors are printed as cause and remedy."""
    if _COMPLETE in os.environ:
        from typer import completion

        completion.completion_init()  # type: ignore[attr-defined]
    output.prepare()
    try:
        code = _run()
        sys.stdout.flush()
    except output.ReaderGone:
        output.drop_output()
        return ExitCode.READER_GONE
    except HeavyTopError as error:
        return _failed(str(error), error.exit_code)
    except MemoryError:
        return _failed(_NO_MEMORY)
    except ImportError as error:  # a library that finds no memory while it is loaded
        if "bad_alloc" not in str(error) and "allocate memory" not in str(error):
            raise
        return _failed(_NO_MEMORY)
    except OSError as error:
        return _failed(f"{error}\n  The surroundings of the program do not allow what it needs.")
    return code


def _run() -> int:
    """The exit code of the command; other exceptions propagate."""
    arguments = with_file_of_latex(sys.argv[1:])
    only_this = copy(app)  # options of the other commands take a tenth of a second to make
    named = [command for command in app.registered_commands if [command.name] == arguments[:1]]
    only_this.registered_commands = named or app.registered_commands
    try:
        only_this(args=arguments, prog_name="heavytop")
    except SystemExit as ended:
        return (
            ended.code if isinstance(ended.code, int) else ExitCode.GOOD if ended.code is None else ExitCode.BAD_INPUT
        )
    return ExitCode.GOOD


def _failed(message: str, code: int = ExitCode.BAD_INPUT) -> int:
    """Print the error; flush standard output if possible."""
    output.say(message)
    try:
        sys.stdout.flush()
    except (output.OutputError, output.ReaderGone):
        output.drop_output()
    return code
