"""Small reports to compare, and what their comparison says."""

from __future__ import annotations

from typing import Any

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.compare.noise import Policy
from support import report_helpers
from support.report_helpers import error
from support.reports import compare, replace

__all__ = ["all_judged", "error", "judged", "report", "row", "verdicts"]


def row(**changes) -> Row:
    """A run of 100 time units in double, with an error and a duration, without series and laws."""
    basis = report_helpers.row(
        horizon="100",
        time_reached="100",
        steps=10,
        metrics={"drift_energy_max": error("1e-12"), "break_away_time": of_fraction(exact("60"), "duration")},
        measured="",
        against="its own first integrals",
        series={},
        laws={},
        seconds={},
    )
    return replace(basis, **changes)


def report(*rows: Row) -> Report:
    return Report(SCHEMA, {"name": "test"}, {"packages": {"heyoka": "7"}}, list(rows))


def judged(old: Row, new: Row, **policy: Any) -> tuple[str, str]:
    """The verdict on the second of two rows, and the reasons of what changed."""
    result = compare(report(old), report(new), Policy(**policy))
    return result.verdict, "; ".join(finding.reason for finding in result.changed)


def verdicts(old: Row, new: Row, policy: Policy | None = None, **options: Any) -> dict[str, str]:
    """The verdict on each metric, law and series of the second of two rows."""
    found = compare(report(old), report(new), policy or Policy(**options)).findings
    return {finding.metric: finding.verdict.value for finding in found}


def all_judged(old: Row, *news: Row, **policy: Any) -> list[str]:
    """The verdicts on rows, each compared with the same one."""
    return [judged(old, new, **policy)[0] for new in news]
