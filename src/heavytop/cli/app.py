"""Shared parts of the commands: the application, printing, exact numbers in options."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from heavytop.cli.output import printable
from heavytop.errors import ImpossibleBody, InputError, quoted

app = typer.Typer(
    help="Measure how wrong computed and claimed motions of a heavy top are, against references that are proven.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


SHELLS = ("bash", "zsh", "fish")


def _version(requested: bool) -> None:
    if requested:
        from heavytop.version import commit, version

        commit_text = commit()
        print(f"heavytop {version()}" + (f" (commit {commit_text})" if commit_text else ""))
        raise typer.Exit


def _completion(shell: str | None) -> None:
    if shell is not None:
        if shell not in SHELLS:
            raise InputError(f"shell must have completion; got {quoted(shell)}.", f"Use {', '.join(SHELLS)}.")
        from typer import completion

        print(
            completion.get_completion_script(  # type: ignore[attr-defined]
                prog_name="heavytop", complete_var="_HEAVYTOP_COMPLETE", shell=shell
            )
        )
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show version and commit, and exit.")
    ] = False,
    completion: Annotated[
        str | None,
        typer.Option(callback=_completion, is_eager=True, metavar="SHELL", help="Print completion: bash, zsh or fish."),
    ] = None,
) -> None:
    """Options before a command."""


Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


def plans(begun: str) -> list[str]:
    """Plans whose names begin with this text, for completion."""
    from heavytop.harness import BUILT_IN

    return [name for name in BUILT_IN if name.startswith(begun)]


def cases(begun: str) -> list[str]:
    """Cases whose names begin with this text, for completion."""
    from heavytop.cases import CASES

    return [name for name in CASES if name.startswith(begun)]


class _Command(TyperCommand):
    """A command whose help shows the type of the entries of a list of files."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        for parameter in self.params:
            if parameter.nargs == -1:
                parameter.display_type = lambda ctx: "<path>..."  # type: ignore[attr-defined]


def command(function: Callable[..., int]) -> Callable[..., None]:
    """A command that exits with the code returned by ``function``."""

    @wraps(function)
    def with_exit_code(*args: Any, **options: Any) -> None:
        from heavytop.cli.output import told_when_slow

        with told_when_slow(name), warnings.catch_warnings():
            warnings.simplefilter("ignore", ImpossibleBody)  # the command prints it itself
            code = function(*args, **options)
        raise typer.Exit(code)

    name = function.__name__.rstrip("_").replace("_", "-")
    return app.command(name=name, cls=_Command)(with_exit_code)


def show_on_terminal(renderable: Any) -> None:
    """Print text or a rich table, with the width of the terminal or COLUMNS, or 160 columns into a file."""
    from rich.console import Console

    console = Console(
        highlight=False, soft_wrap=False, width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 160
    )
    console.print(renderable)


def print_json(document: Any) -> None:
    """Print one JSON document."""
    import json

    import msgspec

    try:
        text = msgspec.json.format(msgspec.json.encode(document), indent=1).decode()
    except UnicodeEncodeError:  # a file name that is not valid text
        text = json.dumps(msgspec.to_builtins(document), indent=1)
    print(printable(text))


def require_apart(files: Iterable[Path | None], *read: Path | None) -> None:
    """Raise InputError if an output is given twice, or is an input, or of the report in a folder that is one."""
    written = [path for path in files if path is not None]
    sources = [path / name for path in read if path and written for name in ("", "report.json", "report.json.sha256")]
    used = {absolute(source).resolve() for source in sources if not source.is_dir()}
    for path in written:
        target = absolute(path).resolve()
        if target in used:
            raise InputError(f"{path} is named twice.", "Give each file its own name.")
        used.add(target)


def absolute(path: Path) -> Path:
    """The absolute path, independent of later changes of the working directory; raises InputError if that is gone."""
    try:
        return path.absolute()
    except OSError:
        raise InputError(f"{path} is relative to a folder that no longer exists.", "Change folder.") from None


@contextmanager
def writing() -> Iterator[None]:
    """Give the error of a file that cannot be written the remedy of a command that writes one file."""
    try:
        yield
    except InputError as error:
        raise InputError(error.cause, "Give a file in a writable folder.") from None


def numbers(text: str) -> list[str]:
    """The parts of ``a,b,c`` as text."""
    return [part.strip() for part in text.split(",")]
