"""The reference of the command line as Markdown, from the program itself: its arguments, options, defaults and help."""

from __future__ import annotations

import re
from typing import Any

import typer

import heavytop.cli

_MARKUP = re.compile(r"([\\|<>*_\[\]])")


def markdown() -> str:
    """The options before a command, each command with what it takes, and the exit codes."""
    program = typer.main.get_command(heavytop.cli.app)
    context: Any = program.make_context("heavytop", [], resilient_parsing=True)
    parts = [
        _parameters(program.get_params(context), context),
        *(_command(name, context) for name in program.list_commands(context)),
    ]
    (codes,) = (text for text in str(heavytop.cli.__doc__).split("\n\n") if text.startswith("Exit codes"))
    return "\n\n".join([*parts, "## Exit codes", _escaped(codes.partition(": ")[2])]) + "\n"


def _command(name: str, above: Any) -> str:
    command = above.command.get_command(above, name)
    context = command.make_context(name, [], parent=above, resilient_parsing=True)
    usage = " ".join(["heavytop", name, *command.collect_usage_pieces(context)])
    said = [_escaped(paragraph) for paragraph in command.help.split("\n\n")]
    return "\n\n".join([f"## heavytop {name}", f"```text\n{usage}\n```", *said, _parameters(command.params, context)])


def _parameters(parameters: list[Any], context: Any) -> str:
    """A table of the arguments and options, with their defaults."""
    records = (parameter.get_help_record(context) for parameter in parameters)
    lines = ["| `" + names.replace("|", "\\|") + f"` | {_escaped(said)} |" for names, said in filter(None, records)]
    return "\n".join(["| | |", "|---|---|", *lines])


def _escaped(text: str) -> str:
    """Text that Markdown shows as it is, but for code between backquotes."""
    pieces = re.split(r"(`[^`]*`)", " ".join(text.split()))
    return "".join(piece if piece.startswith("`") else _MARKUP.sub(r"\\\1", piece) for piece in pieces)
