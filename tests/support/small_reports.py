"""Small reports to compare."""

from __future__ import annotations

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import SCHEMA, Report, Row
from support import report_helpers
from support.report_helpers import error
from support.reports import replace

__all__ = ["error", "report", "row"]


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
