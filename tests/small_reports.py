"""Small reports to compare."""

from __future__ import annotations

import msgspec

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import SCHEMA, Metric, Report, Row


def error(value: str) -> Metric:
    return of_fraction(exact(value))


def row(**changes) -> Row:
    basis = Row(
        case="euler",
        system="heavy_top",
        integrator="heyoka",
        precision="double",
        bits=53,
        outcome="success",
        horizon="100",
        time_reached="100",
        steps=10,
        finite=True,
        metrics={"drift_energy_max": error("1e-12"), "break_away_time": of_fraction(exact("60"), "duration")},
        measure="drift",
        against="its own first integrals",
        flags={"tolerance": "2e-16"},
    )
    return msgspec.structs.replace(basis, **changes)


def report(*rows: Row) -> Report:
    return Report(SCHEMA, {"name": "test"}, {"packages": {"heyoka": "7"}}, list(rows))
