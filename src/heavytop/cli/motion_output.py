"""One motion on the terminal, as JSON, CSV or LaTeX: the same numbers, with what makes them citable."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heavytop.cli.app import print_json, show_on_terminal, writing
from heavytop.cli.output import say
from heavytop.errors import InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.report.motion_table import MotionTable

_SCREEN = Path("-")
_LATEX = "--latex"


def with_file_of_latex(arguments: list[str]) -> list[str]:
    """The arguments of the command line, with ``-`` for standard output behind a ``--latex`` without a file."""
    found: list[str] = []
    for argument in arguments:
        if found[-1:] == [_LATEX] and argument.startswith("--"):
            found.append(str(_SCREEN))
        found.append(argument)
    return [*found, str(_SCREEN)] if found[-1:] == [_LATEX] else found


def made_by() -> tuple[str, str]:
    """The command as it was typed, and the version and commit of the program."""
    from heavytop.version import commit, version

    made_from = commit()
    return shlex.join(["heavytop", *sys.argv[1:]]), version() + (f" (commit {made_from})" if made_from else "")


def require_one_output(csv: Path | None, latex: Path | None, json: bool) -> None:
    """Raises InputError where standard output would get two documents, or one file two."""
    asked = (("--csv", csv == _SCREEN), (_LATEX, latex == _SCREEN), ("--json", json))
    on_screen = [name for name, wanted in asked if wanted]
    if len(on_screen) > 1:
        raise InputError(f"{' and '.join(on_screen)} both print on standard output.", "Give a file for one of them.")
    if csv is not None and csv == latex != _SCREEN:
        raise InputError(f"{csv} is asked for as CSV and as LaTeX.", "Give two files.")


def write_motion(
    document: Callable[[], dict[str, Any]],
    make_table: Callable[[], MotionTable],
    text: Callable[[MotionTable], RenderableType],
    csv: Path | None,
    latex: Path | None,
    json: bool,
) -> None:
    """Write the files asked for, and one document on standard output: JSON, CSV, LaTeX or the table.

    Raises InputError for a file that cannot be written.
    """
    table = None if json and csv is None and latex is None else make_table()
    screen = None
    for path, make in ((csv, "csv"), (latex, "latex")):
        if path is None or table is None:
            continue
        content = getattr(table, make)()
        if path == _SCREEN:
            screen = content
        else:
            _write(path, content)
            say(f"wrote {path}")
    if json:
        command, version = made_by()
        print_json({**document(), "command": command, "version": version})
    elif screen is not None:
        print(screen, end="")
    elif table is not None:
        show_on_terminal(text(table))


def _write(path: Path, content: str) -> None:
    with writing():
        try:
            path.write_text(content, encoding="utf-8")
        except (OSError, ValueError) as error:
            raise InputError(f"{path} cannot be written: {error}.") from None
