"""The options of `propagate` and `reference` for events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Annotated, Any

import typer

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


def computed(
    top: Any,
    start: Any,
    functions: Sequence[Any],
    direction: int,
    until: Fraction,
    form: Any,
    integrator: str,
    system: Any,
    max_steps: int | None,
    reach: Callable[[float], Any],
) -> list[Any]:
    """The events of the computed motion, of each function."""
    if not functions:
        return []
    from heavytop.api.events import computed_events

    def reached(time: Fraction) -> None:
        reach(float(time / until))

    settings = form, integrator, system, None, max_steps, None, reached
    return [computed_events(top, start, until, function, direction, *settings) for function in functions]


def known_ones(
    top: Any,
    start: Any,
    functions: Sequence[Any],
    direction: int,
    until: Fraction,
    digits: int,
    system: Any,
    reach: Callable[[float], Any],
) -> list[Any]:
    """The proven events, of each function."""
    if not functions:
        return []
    from heavytop.api.events import known_events

    def reached(time: Fraction) -> None:
        reach(float(time / until))

    return [
        known_events(top, start, until, function, direction, digits, system, None, reached) for function in functions
    ]


def with_events(
    document: Callable[[], dict[str, Any]], table: Any, text: Callable[[Any], Any], found: Sequence[Any]
) -> tuple[Callable[[], dict[str, Any]], Any, Callable[[Any], Any]]:
    """The document, the table and the text of a motion, with the events behind, where any were asked for."""
    if not found:
        return document, table, text

    def text_with_events(shown: Any) -> Any:
        from rich.console import Group

        from heavytop.report.events_text import events_text

        return Group(text(shown), events_text(found))

    def document_with_events() -> dict[str, Any]:
        return {**document(), "events": [each.to_json() if hasattr(each, "to_json") else each for each in found]}

    return document_with_events, table, text_with_events
