"""``python -m heavytop`` and the ``heavytop`` command."""

import sys


def main() -> None:
    """Run the command line and leave with its exit code."""
    from heavytop.cli import run_command_line

    sys.exit(run_command_line())


if __name__ == "__main__":
    main()
