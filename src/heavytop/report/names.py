"""What a row is called, for people."""

from __future__ import annotations

from collections.abc import Iterable

from heavytop.measure.integrator import HEYOKA
from heavytop.records import Identity, Report, Row
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


def variant(row: Row, sources: Iterable[tuple[str, Report]]) -> str:
    """The integrator and what is asked of it; "" for heyoka.  Many starts are named where single ones are too."""
    subject = row.key.subject
    name = "" if subject.name == HEYOKA else subject.name
    mixed = row.starts > 1 and any(other.starts == 1 for _, report in sources for other in report.rows)
    return " ".join(part for part in (name, subject.variant, "many starts" if mixed else "") if part)


def with_source(name: str, source: str) -> str:
    """A label with the report that it is of, where there are several."""
    return f"{name}, {source}" if source else name
