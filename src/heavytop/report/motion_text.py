"""One motion, computed or known, as tables for people."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.measure.motion import Motion
from heavytop.measure.reference import Reference
from heavytop.report.derivative_text import derivative_lines
from heavytop.report.motion_table import MotionTable
from heavytop.report.printable import printable, short


def motion_text(motion: Motion, table: MotionTable) -> RenderableType:
    """States, what was asked for beside them, and the drift of the first integrals."""
    run = motion.trajectory
    precision = run.problem.precision
    head = f"{run.problem.system.name} in {precision.name} ({precision.bits} bits): {run.outcome.message}"
    if run.order:  # some peers tell neither
        head += f", {run.steps} steps of order {run.order}"
    parts: list[RenderableType] = [Text(head), *_attitude_at_start(table)]
    parts += _at_each_time(table)
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
    return Group(*parts, *_undefined(table))


def reference_text(found: Reference, table: MotionTable) -> RenderableType:
    """Proven states, and what was asked for beside them, with the radius of each number."""
    parts: list[RenderableType] = [Text(f"{found.system}, {found.digits} digits; {found.method}")]
    if found.attitude_method not in (None, found.method):
        parts.append(Text(f"attitude: {found.attitude_method}"))
    parts += _attitude_at_start(table)
    derivatives = [] if found.derivatives is None else derivative_lines(found.times, found.derivatives)
    return Group(*parts, *_at_each_time(table), *_undefined(table), *derivatives)


def _attitude_at_start(table: MotionTable) -> list[RenderableType]:
    """ξ(0), where there is an attitude."""
    facts = dict(table.facts)
    return [Text(f"xi(0) = ({facts['xi']})")] if "xi" in facts else []


def _at_each_time(table: MotionTable) -> list[RenderableType]:
    """A table for each time, a line a number; digits that are too many for a line go on below each other."""
    parts: list[RenderableType] = []
    for time, line in zip(table.times, table.values, strict=True):
        lines = Table(box=None, show_header=False)
        lines.add_column(no_wrap=True)
        lines.add_column(overflow="fold")
        lines.add_column(no_wrap=True)
        lines.add_row("t", Text(time, overflow="fold"))
        for column, (value, radius) in zip(table.columns, line, strict=True):
            lines.add_row(column.label, Text(value, overflow="fold"), "" if radius is None else f"± {radius}")
        parts += [Text(), lines]
    return parts


def _undefined(table: MotionTable) -> list[RenderableType]:
    """What is said where Euler angles are not defined."""
    places = [
        time
        for time, line in zip(table.times, table.values, strict=True)
        for column, (value, _) in zip(table.columns, line, strict=True)
        if value == "nan" and column.label[:2] in ("a ", "c ")
    ]
    if not places:
        return []
    at = ", ".join(list(dict.fromkeys(places))[:6])
    return [Text(), Text(f"At t = {at} the first and the last Euler angle are not defined (gimbal lock).")]
