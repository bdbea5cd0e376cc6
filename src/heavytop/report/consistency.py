"""Whether the numbers of one row agree with one another.

Each rule holds for every row that a run writes.  A row that breaks one was edited, or written by a broken program.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.growth import NEAR, Interval, bent, nearest_class
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10, parse
from heavytop.records import Law, Metric, Quantity, Row, Series
from heavytop.report.kind import Kind
from heavytop.report.motion_data import impossible

CLOSE = 1e-5
"""Decades: how far two logarithms of the same number may be apart, for numbers have six digits at least."""
_SUCCESS = Outcome.SUCCESS.value
_NO_NUMBER = ("nan", "missing")

_HALF_WAY = 0.25 - NEAR
"""Half of an interval that holds one class and no other, wherever it is: what is known of an exponent without one."""


def contradictions(row: Row, kind: Kind) -> Iterator[str]:
    """What in a row of that kind contradicts something else in it, as ``FIELD: REASON``."""
    for name, metric in row.metrics.items():
        if metric.band is not None and not kind.carries_band(metric):
            yield f"{name}: a noise band where no run measures one"
    if row.laws:
        for name, law in row.laws.items():
            if reason := inconsistent(law):
                yield f"growth {name}: {reason}"
            if law.starts > row.starts > 1:
                yield f"growth {name}: a law of {law.starts} starts in a row of {row.starts}"
    if row.data is not None and (reason := impossible(row.data, row.starts)):
        yield f"data: {reason}"
    if row.outcome != _SUCCESS:
        return
    if row.against != row.reference.text:
        yield "against: its words are not what the row was compared with"
    yield from _reached(row)
    yield from _sizes(row.metrics)
    if row.series:
        yield from _series(row, kind)
    yield from kind.contradictions(row)


def _reached(row: Row) -> Iterator[str]:
    if row.time_reached != row.horizon and abs(exact(row.time_reached)) < abs(exact(row.horizon)):
        yield f"time_reached: a success that reached only {row.time_reached} of {row.horizon}"
    failed = row.metrics.get("starts_failed")
    if failed is not None and failed.value != "0":
        yield f"starts_failed: a success with {failed.value} starts that failed"
    with suppress(InputError):  # what is evaluated exactly has no format, and a law has several
        if parse(row.precision).bits != row.bits:
            yield f"bits: {row.bits} in {row.precision}"


def _sizes(metrics: Mapping[str, Metric]) -> Iterator[str]:
    """A root mean square and a last value are no larger than the largest."""
    for metric in metrics.values():
        quantity = metric.quantity
        if quantity is not None and metric.log10 is not None and quantity.statistic == "max":
            for part in ("rms", "final"):
                other = metrics.get(quantity.over(part).text)
                if other is not None and other.log10 is not None and other.log10 > metric.log10 + CLOSE:
                    yield f"{quantity.over(part).text}: larger than the largest"


def _series(row: Row, kind: Kind) -> Iterator[str]:
    for name, series in row.series.items():
        if 0 < row.samples < len(series.times):
            yield f"samples: {row.samples}, where {name} has {len(series.times)}"
        if len(series.times) != len(series.values):
            yield f"{name}: not one value for each time"
            continue
        if row.finite and any(value in _NO_NUMBER for value in series.values):
            yield f"finite: said to be finite, but {name} holds nan or missing"
        if series.quantity is not None and not kind.series_has_more(series.quantity):
            yield from _against_metrics(series.quantity, series, row)


def _against_metrics(quantity: Quantity, series: Series, row: Row) -> Iterator[str]:
    found = sizes(series)
    largest, last = (row.metrics.get(quantity.over(part).text) for part in ("max", "final"))
    if largest is not None and found and max(found) > bound(largest) + CLOSE:
        yield f"{quantity.text}: the series is larger than {quantity.over('max').text}"
    if last is not None and ended(series, row):
        yield from _last(quantity.over("final").text, series.values[-1], last)


def sizes(series: Series) -> list[float]:
    """log10 of the values of a series that are numbers, -1e9 for 0."""
    return [size for value in series.values if (size := size_of(value)) is not None]


def ended(series: Series, row: Row) -> bool:
    """Whether the last value of a series is that at the time which the row reached."""
    times = series.times[-1:]
    return times == [row.time_reached] or (bool(times) and exact(times[0]) == exact(row.time_reached))


def _last(name: str, value: str, metric: Metric) -> Iterator[str]:
    size = size_of(value)
    words = (value == UNRESOLVED) != (metric.value == UNRESOLVED)
    if words or (size is not None and abs(size - _floor(metric.log10)) > CLOSE):
        yield f"{name}: {metric.value}, where its series ends with {value}"


def _floor(size: float | None) -> float:
    return -1e9 if size is None else max(size, -1e9)


def size_of(value: str) -> float | None:
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


def bound(metric: Metric) -> float:
    """log10 of the most that a metric can be; infinite where it is not finite or missing."""
    if metric.log10 is not None:
        return metric.log10
    if metric.value == UNRESOLVED and metric.bound:
        return _floor(log10(exact(metric.bound))) + 0.01
    return -1e9 if metric.value == "0" else 1e9


def law_text(law: Law) -> str:
    """A growth law in a few words."""
    if law.exponent is None:
        return law.growth
    span = "" if law.low is None or law.high is None else f" [{law.low:.3g}, {law.high:.3g}]"
    return f"{law.growth}, exponent {law.exponent:.3g}{span}"


def inconsistent(law: Law) -> str:
    """Why a law contradicts itself: class, exponent, intervals and span; empty where it does not."""
    if (law.low is None) != (law.high is None) or (law.exponent is None and law.low is not None):
        return "half an interval, or one without its exponent"
    if law.first is not None and law.last is not None and exact(law.first) > exact(law.last):
        return f"a span from {law.first} to {law.last}"
    if law.exponent is None:
        return "" if law.bend is None else "a bend without an exponent"
    low, high = interval_of(law)
    bend = law.bend or (0.0, 0.0)
    if not all(map(math.isfinite, (law.exponent, low, high, *bend))):
        return "an exponent or an interval that is not finite"
    if not low <= law.exponent <= high or bend[0] > bend[1]:
        return f"an interval from {low:g} to {high:g} without its exponent {law.exponent:g}, or a bend that ends first"
    said = f"{law.growth} with the exponent {law.exponent:g} in [{low:g}, {high:g}]"
    if law.growth == "exponential":
        return "" if law.exponent > 0 and law.bend is None else said
    if law.low is None:
        low, high = low - _HALF_WAY, high + _HALF_WAY
    expected = "unresolved" if bent(bend) else nearest_class(law.exponent, low, high)
    return "" if law.growth == expected else said


def interval_of(law: Law) -> Interval:
    """That of the exponent; where it has none, the exponent alone."""
    assert law.exponent is not None
    return (law.exponent, law.exponent) if law.low is None or law.high is None else (law.low, law.high)
