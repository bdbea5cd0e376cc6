"""The library of claims in words, for people."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill, wrap
from typing import Protocol

from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.claims.entry import Entry
from heavytop.claims.verdicts import Judged

_WIDTH = 80
_HEADS = {"holds": "Proven", "refuted": "Refuted", "undecided": "Undecided"}
_STYLES = {"holds": "green", "refuted": "bold red", "undecided": "yellow"}


class Listed(Protocol):
    """Entries with their verdicts."""

    @property
    def entries(self) -> Sequence[Entry]: ...

    @property
    def verdicts(self) -> dict[str, Judged]: ...

    @property
    def changed(self) -> Sequence[str]: ...

    @property
    def undecided(self) -> Sequence[str]: ...


def claims_text(found: Listed) -> RenderableType:
    """The entries by verdict: id, title and source of each."""
    parts: list[RenderableType] = []
    for verdict, head in _HEADS.items():
        of_verdict = [entry for entry in found.entries if found.verdicts[entry.id].verdict == verdict]
        if of_verdict:
            parts += [Text(f"{head}: {len(of_verdict)}", style=_STYLES[verdict])]
            parts += [line for entry in of_verdict for line in _lines(entry)]
            parts.append(Text())
    return Group(*parts, Text("heavytop audit NAME shows the proof or the witness of one."))


def _lines(entry: Entry) -> list[Text]:
    source = f"{', '.join(entry.source.authors)} {entry.source.year}"
    return [Text(f"  {entry.id}"), *map(Text, _folded(f"{entry.title} ({source})", 4))]


def _folded(text: str, indent: int) -> list[str]:
    space = " " * indent
    return wrap(text, _WIDTH, initial_indent=space, subsequent_indent=space, break_long_words=False)


def unexpected_text(found: Listed) -> RenderableType:
    """How many verdicts are the expected ones, and each that is not."""
    off = [entry for entry in found.entries if entry.id in (*found.changed, *found.undecided)]
    total = f"{len(found.entries) - len(off)} of {len(found.entries)} verdicts are the expected ones."
    lines = [Text(total)]
    for entry in off:
        judged = found.verdicts[entry.id]
        said = f"{entry.id}: {judged.verdict}, expected: {entry.expects}" + f"; {judged.reason}" * bool(judged.reason)
        lines.append(Text(fill(said, _WIDTH, subsequent_indent="  "), style=_STYLES[judged.verdict]))
    seconds = sum(each.seconds for each in found.verdicts.values())
    return Group(*lines, Text(f"{seconds:.0f} s of audits."))
