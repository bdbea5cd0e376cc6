"""One computed motion as a table for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.measure.motion import Motion
from heavytop.measure.reference import Reference
from heavytop.report.derivative_text import derivative_lines
from heavytop.report.printable import printable
from heavytop.report.text import short

_NAMES = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3", "ξ1", "ξ2", "ξ3", "φ", "θ", "ψ")


def motion_text(motion: Motion) -> RenderableType:
    """States, attitude where it was asked for, and the drift of the first integrals."""
    run = motion.trajectory
    precision = run.problem.precision
    head = f"{run.problem.system.name} in {precision.name} ({precision.bits} bits): {run.outcome.message}"
    if run.order:  # some peers tell neither
        head += f", {run.steps} steps of order {run.order}"
    parts: list[RenderableType] = [Text(head)]
    for index, time in enumerate(motion.to_json()["times"]):
        values = list(motion.states[index])
        if motion.attitude is not None and motion.angles is not None:
            values += [*motion.attitude[index], *motion.angles[index]]
        parts += [Text(), _at(time, values)]
    if not motion.complete:
        why = f" {run.integrator} says: {printable(run.flags['failure'])}" if "failure" in run.flags else ""
        parts += [Text(), Text(f"Reached t = {motion.to_json()['time_reached']} only.{why}", style="bold")]
    elif motion.drift:
        found = [(metric.quantity, metric) for metric in motion.drift.values()]
        worst = [(quantity.component, metric) for quantity, metric in found if quantity and quantity.statistic == "max"]
        drifts = ", ".join(f"{name} {short(metric.value, 2)}" for name, metric in worst)
        parts += [Text(), Text(f"Largest drift of the first integrals at these times: {drifts}")]
    if lost := run.amplification_text():
        parts += [Text(), Text(f"{lost[:1].upper()}{lost[1:]}.")]
    return Group(*parts)


def reference_text(found: Reference) -> RenderableType:
    """Proven states with the radius of each component."""
    parts: list[RenderableType] = [Text(f"{found.system}, {found.digits} digits; {found.method}")]
    if found.attitude_method not in (None, found.method):
        parts.append(Text(f"attitude: {found.attitude_method}"))
    for index, (time, state) in enumerate(zip(found.times, found.states, strict=True)):
        xi = found.attitude[index] if found.attitude else []
        parts += [Text(), _at(time, [f"{ball.value} ± {ball.radius}" for ball in (*state, *xi)])]
    if found.derivatives is not None:
        parts += derivative_lines(found.times, found.derivatives)
    return Group(*parts)


def _at(time: str, values: Sequence[str]) -> Table:
    """What is known at a time, a line a component; as many as there are values."""
    table = Table(box=None, show_header=False)
    for name, value in zip(("t", *_NAMES), (time, *values), strict=False):
        table.add_row(name, Text(value, overflow="fold"))
    return table
