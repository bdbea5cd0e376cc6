"""The options of `propagate` and `reference` for events."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, NamedTuple

import typer

from heavytop.errors import InputError, options_named

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

    @options_named({"direction": "--event-direction"})
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

    @options_named({"until": "the last of --times"})
    def measure(self, top: Any, start: Any, until: Any, **settings: Any) -> Any:
        """The events of each function.  settings: of :func:`heavytop.events`."""
        from heavytop.features.events.api import events
        from heavytop.features.events.functions import Events
        from heavytop.features.events.text import events_text

        functions, direction = self.events or (), self.event_direction
        known = [events(top, start, until, function, direction, **settings) for function in functions]

        def entries() -> dict[str, Any]:
            return {"events": [each.to_json() if isinstance(each, Events) else each for each in known]}

        return entries, partial(events_text, known)
