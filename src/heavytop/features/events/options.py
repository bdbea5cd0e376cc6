"""The options of `propagate` and `reference` for events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from heavytop.errors import InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

Functions = Annotated[
    list[str] | None,
    typer.Option(
        "--events",
        metavar="FUNCTION",
        help="Also the times, up to the last, at which a function such as omega1 changes sign.",
    ),
]
Direction = Annotated[
    int, typer.Option("--event-direction", help="1: where it rises with time; -1: where it falls; 0: both.")
]


class EventOptions(NamedTuple):
    """See :class:`heavytop.cli.motions.MotionOptions`."""

    events: Functions = None
    event_direction: Direction = 0

    def require(self) -> str:
        """Raises InputError for an invalid function or direction."""
        from heavytop.features.events.api import require_direction
        from heavytop.features.events.functions import event_function

        require_direction(self.event_direction)
        if self.event_direction and not self.events:
            raise InputError("--event-direction was given without --events.", "Give --events FUNCTION too.")
        for text in self.events or ():
            event_function(text)
        return "events" if self.events else ""

    def measure(self, top: Any, start: Any, until: Any, **settings: Any) -> MotionEvents:
        """The events of each function.  settings: of :func:`heavytop.events`."""
        from heavytop.features.events.api import events

        functions, direction = self.events or (), self.event_direction
        return MotionEvents([events(top, start, until, function, direction, **settings) for function in functions])


@dataclass(frozen=True, slots=True)
class MotionEvents:
    """The events of each function, on a motion that is shown with them."""

    events: list[Any]

    def to_json(self) -> dict[str, Any]:
        """Entries of the document of the motion."""
        return {"events": [event.to_json() if hasattr(event, "to_json") else event for event in self.events]}

    def text(self) -> RenderableType:
        """A table for each event."""
        from heavytop.features.events.text import events_text

        return events_text(self.events)
