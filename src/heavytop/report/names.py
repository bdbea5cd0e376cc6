"""What a row is called, for people."""

from __future__ import annotations

from heavytop.measure.integrator import HEYOKA
from heavytop.records import Identity, Row
from heavytop.top.equations import HEAVY_TOP


def computed_by(row: Row) -> str:
    """`` NAME`` of the integrator, "" for heyoka and for what is not computed: behind the case in tables."""
    subject = row.key.subject
    return f" {subject.name}" if subject.what == "computed" and subject.name != HEYOKA else ""


def row_name(row: Identity, with_kind: bool = True) -> str:
    """Its kind, case, system where it is not the heavy top, subject and format."""
    system = "" if row.system == HEAVY_TOP.name else row.system
    parts = (row.key.kind if with_kind else "", row.case, system, row.integrator, row.precision)
    return " ".join(part for part in parts if part)
