"""Whether the numbers of one row agree with one another.

Each rule holds for every row that a run writes.  A row that breaks one was edited, or written by a broken program.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10, parse
from heavytop.records import Metric, Row, Series
from heavytop.report.laws import inconsistent
from heavytop.report.noise import carries_band

if TYPE_CHECKING:
    from heavytop.report.store import BriefRow

CLOSE = 1e-5
"""Decades: how far two logarithms of the same number may be apart, for numbers have six digits at least."""
_SUCCESS = Outcome.SUCCESS.value
_NO_NUMBER = ("nan", "missing")


def contradictions(row: Row | BriefRow) -> Iterator[str]:
    """What in a row contradicts something else in it, as ``FIELD: REASON``."""
    yield from _bands(row)
    if row.laws:
        for name, law in row.laws.items():
            if reason := inconsistent(law):
                yield f"growth {name}: {reason}"
    if row.outcome != _SUCCESS:
        return
    yield from _reached(row)
    yield from _sizes(row.metrics)
    if row.series:
        yield from _series(row)
    if row.measure == "break_away_law":
        yield from _slope(row.metrics)
    elif row.measure == "claim_evaluation":
        yield from _failures(row)


def _bands(row: Row | BriefRow) -> Iterator[str]:
    for name, metric in row.metrics.items():
        if metric.band is not None and not carries_band(row.measure, name, metric.kind):
            yield f"{name}: a noise band where no run measures one"


def _reached(row: Row | BriefRow) -> Iterator[str]:
    if row.time_reached != row.horizon and abs(exact(row.time_reached)) < abs(exact(row.horizon)):
        yield f"time_reached: a success that reached only {row.time_reached} of {row.horizon}"
    failed = row.metrics.get("starts_failed")
    if failed is not None and failed.value != "0":
        yield f"starts_failed: a success with {failed.value} starts that failed"
    formats = [bits for name in row.precision.split(",") if (bits := _bits(name))]
    if formats and max(formats) != row.bits:
        yield f"bits: {row.bits} in {row.precision}"
    away = row.metrics.get("break_away_time")
    if away is not None and away.log10 is not None and abs(exact(away.value)) > abs(exact(row.horizon)):
        yield f"break_away_time: {away.value} is beyond the horizon {row.horizon}"


def _bits(name: str) -> int:
    try:
        return parse(name).bits
    except InputError:
        return 0


def _sizes(metrics: Mapping[str, Metric]) -> Iterator[str]:
    """A root mean square and a last value are no larger than the largest."""
    for name, metric in metrics.items():
        if metric.log10 is None or not name.endswith("_max"):
            continue
        for part in ("_rms", "_final"):
            other = metrics.get(name[:-4] + part)
            if other is not None and other.log10 is not None and other.log10 > metric.log10 + CLOSE:
                yield f"{name[:-4]}{part}: larger than the largest"


def _series(row: Row | BriefRow) -> Iterator[str]:
    for name, series in row.series.items():
        if 0 < row.samples < len(series.times):
            yield f"samples: {row.samples}, where {name} has {len(series.times)}"
        if len(series.times) != len(series.values):
            yield f"{name}: not one value for each time"
            continue
        if row.finite and any(value in _NO_NUMBER for value in series.values):
            yield f"finite: said to be finite, but {name} holds what is no number"
        # near a saddle, errors are taken early, and the series goes on
        if row.measure == "homoclinic" and not name.startswith("drift_"):
            continue
        yield from _against_metrics(name, series, row)
    if row.measure == "work_precision":
        yield from _work(row)


def _against_metrics(name: str, series: Series, row: Row | BriefRow) -> Iterator[str]:
    sizes = [size for value in series.values if (size := _size(value)) is not None]
    largest, last = (row.metrics.get(f"{name}{part}") for part in ("_max", "_final"))
    if largest is not None and sizes and max(sizes) > _bound(largest) + CLOSE:
        yield f"{name}: the series is larger than {name}_max"
    if last is not None and _ended(series, row):
        yield from _last(f"{name}_final", series.values[-1], last)


def _ended(series: Series, row: Row | BriefRow) -> bool:
    times = series.times[-1:]
    return times == [row.time_reached] or (bool(times) and exact(times[0]) == exact(row.time_reached))


def _last(name: str, value: str, metric: Metric) -> Iterator[str]:
    size = _size(value)
    words = (value == UNRESOLVED) != (metric.value == UNRESOLVED)
    if words or (size is not None and abs(size - _floor(metric.log10)) > CLOSE):
        yield f"{name}: {metric.value}, where its series ends with {value}"


def _floor(size: float | None) -> float:
    return -1e9 if size is None else max(size, -1e9)


def _size(value: str) -> float | None:
    """log10 of a value of a series, -1e9 for 0; None for a word."""
    if value in (*_NO_NUMBER, UNRESOLVED, "never"):
        return None
    return log_size(value)


def log_size(text: str) -> float:
    """log10 |number|, -1e9 for 0; told without the cost of an exact one where a float holds it."""
    try:
        size = abs(float(text))
    except ValueError:
        size = 0.0
    return math.log10(size) if 1e-300 < size < 1e300 else _floor(log10(exact(text)))


def _bound(metric: Metric) -> float:
    """log10 of the most that a metric can be; infinite where it is no number."""
    if metric.log10 is not None:
        return metric.log10
    if metric.value == UNRESOLVED and metric.bound:
        return _floor(log10(exact(metric.bound))) + 0.01
    return -1e9 if metric.value == "0" else 1e9


def _work(row: Row | BriefRow) -> Iterator[str]:
    """The errors of a row of work against precision are the largest of Ω and γ."""
    both = [row.series[name] for name in ("solution_error_omega", "solution_error_gamma") if name in row.series]
    largest, last = (row.metrics.get(name) for name in ("error_max", "error_final"))
    if len(both) < 2 or largest is None:
        return
    sizes = [size for series in both for value in series.values if (size := _size(value)) is not None]
    if sizes and max(sizes) > _bound(largest) + CLOSE:
        yield "error_max: smaller than its series"
    if largest.log10 is not None and last is not None and last.log10 is not None and last.log10 > largest.log10 + CLOSE:
        yield "error_final: larger than the largest"
    ends = [_size(series.values[-1]) for series in both if series.values]
    ended = all(_ended(series, row) for series in both)
    known = [size for size in ends if size is not None]
    if last is None or last.log10 is None or not ended or len(known) < len(both):
        return
    if abs(max(known) - last.log10) > CLOSE:
        yield "error_final: not the last value of its series"


def _slope(metrics: Mapping[str, Metric]) -> Iterator[str]:
    names = ("break_away_slope", "break_away_slope_expected", "break_away_slope_off_by")
    found = [metrics[name].value for name in names if name in metrics]
    if len(found) < len(names):
        return
    try:
        slope, expected, off = map(exact, found)
    except InputError:
        return
    if expected == 0 or abs(abs(slope / expected - 1) - off) > CLOSE / 100:
        yield f"{names[2]}: {found[2]}, where the slope is {found[0]} and {found[1]} is expected"


def _failures(row: Row | BriefRow) -> Iterator[str]:
    """A series of a formula holds every sample: those that are not finite are counted, and the last begin somewhere."""
    start = "claim_evaluation_error_"
    for name, series in row.series.items():
        quantity = name.removeprefix(start)
        count = row.metrics.get(f"claim_evaluation_{quantity}_samples_not_finite")
        since = row.metrics.get(f"claim_evaluation_{quantity}_not_finite_from")
        worst = row.metrics.get(f"{name}_max_finite")
        lost = sum(value == "nan" for value in series.values)
        if count is not None and count.value != str(lost):
            yield f"claim_evaluation_{quantity}_samples_not_finite: {count.value}, where the series has {lost}"
        if since is not None and series.values and (since.value == "never") == (series.values[-1] == "nan"):
            yield f"claim_evaluation_{quantity}_not_finite_from: {since.value}, where the series says otherwise"
        sizes = [size for value in series.values if (size := _size(value)) is not None]
        if worst is not None and worst.log10 is not None and sizes and abs(max(sizes) - worst.log10) > CLOSE:
            yield f"{name}_max_finite: not the largest of its series"
