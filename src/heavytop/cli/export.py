"""`export`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.app import command, writing
from heavytop.errors import InputError


class Target(StrEnum):
    """The tools whose formats there are."""

    BENCHER = "bencher"
    GITHUB = "github-action-benchmark"
    ASV = "asv"
    JUNIT = "junit"
    CSV = "csv"


@command
def export(
    report: Annotated[Path, typer.Argument(help="Report or its folder.")],
    to: Annotated[Target, typer.Option(help="The tool that is to read it.")],
    out: Annotated[Path | None, typer.Option(help="File to write; for asv its results folder.")] = None,
) -> int:
    """Write a report in the format of another tool.

    For tools that follow numbers over commits.  Every number is one of which smaller is better: minus the digits
    right, log10 of a drift, exponents of growth laws, seconds.  Without --out it is printed.
    """
    from heavytop.kinds import KINDS
    from heavytop.report import exports, store
    from heavytop.suite.files import replace_all

    if to is Target.ASV and out is None:
        raise InputError("asv reads a folder of results.", "Give one: --out .asv/results")
    found = store.read(report, KINDS)
    if to is Target.ASV:
        assert out is not None
        files = [(out / name, text) for name, text in exports.asv(found, KINDS).items()]
    else:
        text = exports.TEXTS[to.value](found, KINDS)
        if out is None:
            print(text, end="")
            return 0
        files = [(out, text)]
    with writing():
        if to is Target.ASV:
            for path, _ in files:
                path.parent.mkdir(parents=True, exist_ok=True)
        replace_all([(path, text.encode()) for path, text in files])
    for path, _ in files:
        print(path)
    return 0
