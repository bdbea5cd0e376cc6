"""One computed motion as a table for people."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.measure.motion import Motion
from heavytop.measure.reference import Reference
from heavytop.report.text import short


def motion_text(motion: Motion) -> RenderableType:
    """States, attitude where it was asked for, and the drift of the first integrals."""
    run = motion.trajectory
    precision = run.problem.precision
    head = (
        f"{run.problem.system.name} in {precision.name} ({precision.bits} bits): {run.outcome.message}, "
        f"{run.steps} steps of order {run.order}"
    )
    columns = {"Ω1": 0, "Ω2": 1, "Ω3": 2, "γ1": 3, "γ2": 4, "γ3": 5}
    parts: list[RenderableType] = [Text(head)]
    for index, time in enumerate(motion.to_json()["times"]):
        table = Table(box=None, show_header=False)
        table.add_row("t", Text(time))
        for name, column in columns.items():
            table.add_row(name, Text(motion.states[index][column]))
        if motion.attitude is not None and motion.angles is not None:
            for name, value in zip(("ξ1", "ξ2", "ξ3"), motion.attitude[index], strict=True):
                table.add_row(name, Text(value))
            for name, value in zip(("φ", "θ", "ψ"), motion.angles[index], strict=True):
                table.add_row(name, Text(value))
        parts += [Text(), table]
    if not motion.complete:
        parts += [Text(), Text(f"Reached t = {motion.to_json()['time_reached']} only.", style="bold")]
    elif motion.drift:
        found = [(metric.quantity, metric) for metric in motion.drift.values()]
        worst = [(quantity.component, metric) for quantity, metric in found if quantity and quantity.statistic == "max"]
        drifts = ", ".join(f"{name} {short(metric.value, 2)}" for name, metric in worst)
        parts += [Text(), Text(f"Largest drift of the first integrals at these times: {drifts}")]
    return Group(*parts)


def reference_text(found: Reference) -> RenderableType:
    """Proven states with the radius of each component."""
    parts: list[RenderableType] = [Text(f"{found.system}, {found.digits} digits; {found.method}")]
    if found.attitude_method not in (None, found.method):
        parts.append(Text(f"attitude: {found.attitude_method}"))
    for index, (time, state) in enumerate(zip(found.times, found.states, strict=True)):
        table = Table(box=None, show_header=False)
        table.add_row("t", Text(time))
        xi = found.attitude[index] if found.attitude else []
        for name, ball in zip(("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3", "ξ1", "ξ2", "ξ3"), [*state, *xi], strict=False):
            table.add_row(name, Text(f"{ball.value} ± {ball.radius}", overflow="fold"))
        parts += [Text(), table]
    return Group(*parts)
