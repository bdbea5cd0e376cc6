"""Events as tables for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.display import printable
from heavytop.features.events.functions import Events, ReferenceEvents
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import decimal_text
from heavytop.top.equations import NAMES


def events_text(found: Sequence[Events | ReferenceEvents]) -> RenderableType:
    """Each function with its events: the time, the state, and whether the function rises."""
    parts: list[RenderableType] = []
    for each in found:
        parts += [Text(), Text(f"Events {printable(each.function)}: {len(each)}, {each.guarantee}", style="bold")]
        if isinstance(each, Events) and each.outcome is not Outcome.SUCCESS:
            parts.append(Text(f"Looked up to t = {decimal_text(each.time_reached, 6)} only: {each.outcome.message}."))
        if isinstance(each, Events):
            if discontinuities := each.discontinuity_text():
                parts.append(Text(f"{discontinuities[:1].upper()}{discontinuities[1:]}."))
            times, states = each.time_texts(), each.texts()
        else:
            times = [f"{ball.value} ± {ball.radius}" for ball in each.times]
            states = [[f"{ball.value} ± {ball.radius}" for ball in state] for state in each.states]
        for time, direction, state in zip(times, each.directions, states, strict=True):
            table = Table(box=None, show_header=False)
            table.add_row("t", Text(f"{time}, {'rising' if direction > 0 else 'falling'}", overflow="fold"))
            for name, value in zip(NAMES, state, strict=True):
                table.add_row(name, Text(value, overflow="fold"))
            parts.append(table)
    return Group(*parts)
