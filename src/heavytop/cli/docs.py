"""`heavytop docs`."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from heavytop.cli.app import command, show_on_terminal
from heavytop.errors import ExitCode


def _begun(text: str) -> list[str]:
    from heavytop.api.pages import topics

    return [name for name in topics() if name.startswith(text)]


@command
def docs(
    topic: Annotated[
        str | None, typer.Argument(help="The name of a page; without it, the topics.", autocompletion=_begun)
    ] = None,
) -> int:
    """Print a page of the documentation, or its topics.

    On a terminal the page is laid out; elsewhere it is Markdown.  Formulas are plain text.
    """
    from heavytop.api.pages import page, topics

    if topic is None:
        titles = topics()
        width = max(map(len, titles))
        for name, title in titles.items():
            print(f"{name:{width}}  {title}")
    elif sys.stdout.isatty():
        from heavytop.cli.markdown import Page

        show_on_terminal(Page(page(topic)))
    else:
        print(page(topic), end="")
    return ExitCode.GOOD
