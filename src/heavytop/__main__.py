"""``python -m heavytop`` and the ``heavytop`` command."""

import os
import signal
import sys

from heavytop.errors import ExitCode


def main() -> None:
    """Run the command line and leave with its exit code."""
    signal.signal(signal.SIGINT, _interrupted)
    from heavytop import extras
    from heavytop.cli import run_command_line

    extras.alone = True
    sys.exit(run_command_line())


def _interrupted(*_: object) -> None:
    """Exit at once: a KeyboardInterrupt while a library loads or compiles is lost, or becomes another error.

    `run` must save rows, and handles the signal itself.
    """
    if sys.stderr.isatty():
        os.write(2, b"\x1b[?25h\n")  # a progress bar had hidden the cursor
    os._exit(ExitCode.INTERRUPTED)


if __name__ == "__main__":
    main()
