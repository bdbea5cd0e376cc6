"""What a row is called, for people."""

from __future__ import annotations

from heavytop.records import Identity
from heavytop.top.equations import HEAVY_TOP


def row_name(row: Identity, with_kind: bool = True) -> str:
    """Its kind, case, system where it is not the heavy top, subject and format."""
    system = "" if row.system == HEAVY_TOP.name else row.system
    parts = (row.key.kind if with_kind else "", row.case, system, row.integrator, row.precision)
    return " ".join(part for part in parts if part)
