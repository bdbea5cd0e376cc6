"""Laws drawn from several rows of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy

from heavytop.integrate.trajectory import Outcome
from heavytop.measure.scalar import of_fraction
from heavytop.records import Metric, Row


def break_away_law(rows: Sequence[Row], rates: dict[str, float]) -> list[Row]:
    """For each homoclinic case with two formats or more: how the break-away time grows with the bits.

    Least squares over the formats; expected slope ln 2/rate, for the errors of p-bit arithmetic leave the saddle
    like 2^-p e^(rate t).
    """
    found: dict[str, list[Row]] = {}
    for row in rows:
        done = row.measure == "homoclinic" and row.outcome == Outcome.SUCCESS.value
        if done and row.metrics["break_away_time"].log10 is not None:
            found.setdefault(row.case, []).append(row)
    laws = []
    for case, members in found.items():
        if len(members) < 2:
            continue
        bits = [float(row.bits) for row in members]
        times = [float(Fraction(row.metrics["break_away_time"].value)) for row in members]
        slope = float(numpy.polyfit(bits, times, 1)[0])
        expected = float(numpy.log(2)) / rates[case]
        bands = [row.metrics["break_away_time"].band or 0.0 for row in members]
        luck = [time * (10**band - 1) for time, band in zip(times, bands, strict=True)]
        weights = numpy.subtract(bits, numpy.mean(bits)) / (len(bits) * numpy.var(bits))
        off = float(numpy.linalg.norm(weights * luck))
        laws.append(_law_row(case, members, Fraction(slope), Fraction(expected), off))
    return laws


def _law_row(case: str, members: Sequence[Row], slope: Fraction, expected: Fraction, luck: float) -> Row:
    """luck: by how much rounding luck moves the slope, through the break-away times."""
    off_by = abs(slope / expected - 1)
    return Row(
        case=case,
        system=members[0].system,
        integrator=members[0].integrator,
        precision=",".join(row.precision for row in members),
        bits=max(row.bits for row in members),
        outcome=Outcome.SUCCESS.value,
        horizon=max((row.horizon for row in members), key=lambda t: abs(Fraction(t))),
        time_reached=max((row.time_reached for row in members), key=lambda t: abs(Fraction(t))),
        steps=sum(row.steps for row in members),
        finite=True,
        metrics={
            "break_away_slope": _with_band(of_fraction(slope, "value"), luck / float(slope)),
            "break_away_slope_expected": of_fraction(expected, "value"),
            "break_away_slope_off_by": _with_band(of_fraction(off_by), luck / float(expected * off_by or 1)),
        },
        measure="break_away_law",
        measured="time units of break-away gained per bit, least squares over the formats",
        against="ln 2 / rate of the saddle",
    )


def _with_band(metric: Metric, relative: float) -> Metric:
    metric.band = round(math.log10(1 + abs(relative)), 4)
    return metric
