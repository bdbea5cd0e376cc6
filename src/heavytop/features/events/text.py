"""Events as tables for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.display import printable
from heavytop.features.events.functions import Events, ReferenceEvents
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import six_digits
from heavytop.top.equations import NAMES


def events_text(sections: Sequence[Events | ReferenceEvents]) -> RenderableType:
    """Each function with its events: the time, the state, and whether the function rises."""
    parts: list[RenderableType] = []
    for section in sections:
        parts += [
            Text(),
            Text(f"Events {printable(section.function)}: {len(section)}, {section.guarantee}", style="bold"),
        ]
        if isinstance(section, Events) and section.outcome is not Outcome.SUCCESS:
            parts.append(Text(f"Searched to t = {six_digits(section.time_reached)} only: {section.outcome.message}."))
        if isinstance(section, Events):
            if discontinuities := section.discontinuity_text():
                parts.append(Text(f"{discontinuities[:1].upper()}{discontinuities[1:]}."))
            times, states = section.time_texts(), section.texts()
        else:
            times = [f"{ball.value} ± {ball.radius}" for ball in section.times]
            states = [[f"{ball.value} ± {ball.radius}" for ball in state] for state in section.states]
        for time, direction, state in zip(times, section.directions, states, strict=True):
            table = Table(box=None, show_header=False)
            table.add_row("t", Text(f"{time}, {'rising' if direction > 0 else 'falling'}", overflow="fold"))
            for name, value in zip(NAMES, state, strict=True):
                table.add_row(name, Text(value, overflow="fold"))
            parts.append(table)
    return Group(*parts)
