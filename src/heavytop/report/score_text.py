"""The score of one trajectory, for people."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.measure.digits import digits_kept, digits_text
from heavytop.records import Row
from heavytop.report.text import short

_PARTS = {"omega": "Ω", "gamma": "γ", "along": "along the flow", "across": "across the flow"}


def score_text(row: Row) -> RenderableType:
    """Digits kept, distance from the known motion, drift of every first integral."""
    head = f"{row.case}: {row.integrator}, {row.system} in {row.precision} ({row.bits} bits): {row.outcome}"
    if row.outcome != "success":
        head += f", scored up to t = {row.time_reached} of {row.horizon}"
    digits = digits_kept(row)
    kept = (
        "unknown: no reference" if digits is None else f"{digits_text(digits)} (at the worst of {row.samples} samples)"
    )
    table = Table(box=None, header_style="dim")
    for index, column in enumerate(("", f"largest over {row.samples} samples", "rms", "final")):
        table.add_column(column, justify="right" if index else "left")
    names = {f"solution_error_{key}": f"error, {label}" for key, label in _PARTS.items()}
    names |= {name[:-4]: f"drift, {name[6:-4]}" for name in row.metrics if name[:6] == "drift_" and name[-4:] == "_max"}
    for name, label in names.items():
        if f"{name}_max" in row.metrics:
            table.add_row(
                label, *(Text(short(row.metrics[f"{name}_{part}"].value)) for part in ("max", "rms", "final"))
            )
    return Group(Text(head), Text(f"Digits kept: {kept}"), Text(), table, Text(), Text(f"Held against {row.against}"))
