"""The options of `propagate` and `reference` for events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Annotated, Any

import typer

from heavytop.cli.app import show_on_terminal
from heavytop.errors import InputError

Events = Annotated[
    list[str] | None,
    typer.Option("--events", help="Also the times, up to the last, at which omega1=0 or the like changes sign."),
]
EventDirection = Annotated[
    int, typer.Option("--event-direction", help="1: where it rises with time; -1: where it falls; 0: both.")
]


def requested(texts: Sequence[str] | None, direction: int, until: Fraction) -> list[Any]:
    """The functions asked for, read before anything is computed; raises InputError for what is none."""
    from heavytop.event_times.functions import event_function

    if direction not in (-1, 0, 1):
        raise InputError(f"--event-direction {direction} is none.", "Give 1 (rising), -1 (falling) or 0 (both).")
    if texts and until == 0:
        raise InputError("There is no time for an event up to t = 0.", "Give a later time with --times.")
    return [event_function(text) for text in texts or ()]


def located(functions: Sequence[Any], locate: Callable[[Any], Any]) -> list[Any]:
    """What ``locate`` finds of each."""
    return [locate(function) for function in functions]


def show_events(found: Sequence[Any]) -> None:
    """Print the events, where any were asked for."""
    if found:
        from heavytop.report.events_text import events_text

        show_on_terminal(events_text(found))
