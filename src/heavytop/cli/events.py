"""The options of `propagate` and `reference` for events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Annotated, Any

import typer

Events = Annotated[
    list[str] | None,
    typer.Option("--events", help="Also the times, up to the last, at which omega1=0 or the like changes sign."),
]
EventDirection = Annotated[
    int, typer.Option("--event-direction", help="1: where it rises with time; -1: where it falls; 0: both.")
]


def requested(texts: Sequence[str] | None, direction: int) -> list[str]:
    """The functions asked for, read before anything is computed; raises InputError for what is none."""
    from heavytop.api.events import require_direction
    from heavytop.event_times.functions import event_function

    require_direction(direction)
    for text in texts or ():
        event_function(text)
    return list(texts or ())


def farthest(times: Sequence[str]) -> Fraction:
    """The time farthest from 0."""
    from heavytop.precision import exact

    return max(map(exact, times), key=abs)


def of_motion(
    functions: Sequence[str],
    direction: int,
    top: Any,
    start: Any,
    times: Sequence[str],
    system: str | None,
    reached: Callable[[Fraction], None],
    settings: dict[str, Any],
) -> list[Any]:
    """The events of each function up to the time farthest from 0; settings: of :func:`heavytop.api.events.events`."""
    if not functions:
        return []
    from heavytop.api.events import events

    until = farthest(times)
    return [
        events(top, start, until, function, direction, system=system, reached=reached, **settings)
        for function in functions
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
