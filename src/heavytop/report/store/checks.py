"""Validation of the rows of a report: those that no run writes are refused, with the row and its field."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

from heavytop.display import printable
from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.growth import NEAR, Interval, bent, nearest_class
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10, parse
from heavytop.records import UNMEASURED, Data, Law, Metric, Quantity, Row, Series
from heavytop.report.document.document import row_name
from heavytop.report.document.kind import Kinds, ReportedKind, kind_of

# Whether the rows of two reports belong to one motion: the exact data of the top and its start.


_VECTORS = ("inertia", "centre", "omega", "gamma", "rotor")


def other_data(old: Data | None, new: Data | None) -> str:
    """The first difference between the data of a candidate and of its baseline; empty where they are equal as numbers.

    An ensemble is compared by its top alone where the baseline lacks the start from which the random ones are drawn.
    """
    if old == new:
        return ""
    if old is None or new is None:
        return f"only the {'candidate' if old is None else 'baseline'} contains its top and start"
    of_top, of_start = ("inertia", "weight", "centre", "rotor"), ("omega", "gamma")
    for name in of_top + of_start if old.omega else of_top:
        before, after = (getattr(data, name) for data in (old, new))
        if before != after and _numbers(before) != _numbers(after):
            return f"different data: {name} {_text(before)} → {_text(after)}"
    return ""


def other_request(old: Row, new: Row) -> str:
    """The first difference between the requests of a candidate and of its baseline; empty without one.

    A baseline of a former version, whose rows have no request, is compared, except for a survey, whose data are its
    request.
    """
    if not old.request:
        return "the baseline does not identify the tops of its survey" if old.spread else ""
    before, after = old.request, new.request or {}
    for name in sorted(before.keys() | after.keys()):
        expected, requested = (part.get(name) or "none" for part in (before, after))
        if expected != requested and not after:
            return f"the candidate does not state its request; that of the baseline has {name} {expected[:60]}"
        if expected != requested:
            return f"different request: {name} {expected[:60]} → {requested[:60]}"
    return ""


@lru_cache(1 << 14)
def impossible(data: Data, starts: int) -> str:
    """The fault of data that no run with ``starts`` starts writes; empty without one."""
    for name in _VECTORS:
        count = len(getattr(data, name))
        if count != 3 and (count or name in _VECTORS[:2] or (starts == 1 and name != "rotor")):
            return f"{count} components of {name}"
    if bool(data.omega) != bool(data.gamma):
        return "an incomplete start"
    try:
        _numbers((data.weight, *data.centre, *data.omega, *data.gamma, *data.rotor))
        positive = min(_numbers(data.inertia)) > 0
    except InputError as error:
        return error.cause
    return "" if positive else "a moment of inertia that is not positive"


def _numbers(texts: str | tuple[str, ...]) -> list[Fraction]:
    return [exact(text) for text in ((texts,) if isinstance(texts, str) else texts)]


def _text(texts: str | tuple[str, ...]) -> str:
    return (texts if isinstance(texts, str) else ", ".join(texts) or "none")[:120]


# Consistency of the numbers of one row.
#
# Each rule holds for every row that a run writes.  A row that breaks one was edited, or written by a faulty program.


CLOSE = 1e-5
"""Decades by which two logarithms of one number may differ: numbers have at least six digits."""
_SUCCESS = Outcome.SUCCESS.value
_NOT_FINITE = frozenset(("nan", "missing"))
_NOT_NUMBERS = _NOT_FINITE | {UNRESOLVED, "never"}

_ASSUMED_HALF_WIDTH = 0.25 - NEAR
"""Half-width of an interval that contains one class and no other: assumed for an exponent without an interval."""


def contradictions(row: Row, kind: ReportedKind) -> Iterator[str]:
    """Contradictions within a row of that kind, as ``FIELD: REASON``."""
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
    if _bits(row.precision) not in (None, row.bits):
        yield f"bits: {row.bits} in {row.precision}"


@lru_cache
def _bits(precision: str) -> int | None:
    """The bits of a format; None for a row without one, or with several."""
    with suppress(InputError):
        return parse(precision).bits
    return None


def _sizes(metrics: Mapping[str, Metric]) -> Iterator[str]:
    """Contradictions of sizes: root mean square and last value are at most the largest value."""
    for metric in metrics.values():
        quantity = metric.quantity
        if quantity is not None and metric.log10 is not None and quantity.statistic == "max":
            for name in _keys(quantity)[1:]:
                statistic = metrics.get(name)
                if statistic is not None and statistic.log10 is not None and statistic.log10 > metric.log10 + CLOSE:
                    yield f"{name}: larger than the largest"


@lru_cache(1 << 12)
def _keys(quantity: Quantity) -> tuple[str, str, str]:
    """The keys of the largest value of a quantity, of its root mean square and of its last value."""
    largest, rms, last = (quantity.over(statistic).text for statistic in ("max", "rms", "final"))
    return largest, rms, last


def _series(row: Row, kind: ReportedKind) -> Iterator[str]:
    for name, series in row.series.items():
        if 0 < row.samples < len(series.times):
            yield f"samples: {row.samples}, where {name} has {len(series.times)}"
        if len(series.times) != len(series.values):
            yield f"{name}: not one value for each time"
            continue
        if row.finite and not _NOT_FINITE.isdisjoint(series.values):
            yield f"finite: said to be finite, but {name} holds nan or missing"
        if series.quantity is not None and not kind.series_has_more(series.quantity):
            yield from _metric_contradictions(series.quantity, series, row)


def _metric_contradictions(quantity: Quantity, series: Series, row: Row) -> Iterator[str]:
    of_largest, _, of_last = _keys(quantity)
    largest, last = row.metrics.get(of_largest), row.metrics.get(of_last)
    if largest is not None and (size := peak(series)) is not None and size > bound(largest) + CLOSE:
        yield f"{quantity.text}: the series is larger than {of_largest}"
    if last is not None and ended(series, row):
        yield from _last(of_last, series.values[-1], last)


def peak(series: Series) -> float | None:
    """log10 of the largest size among the values of a series, -1e9 for 0; None where none is a number."""
    return max(log_sizes(numbers_of(series)), default=None)


def numbers_of(series: Series) -> tuple[str, ...]:
    """The values of a series that are numbers."""
    return tuple(series.values if _NOT_NUMBERS.isdisjoint(series.values) else filter(is_number, series.values))


def ended(series: Series, row: Row) -> bool:
    """Whether a series ends at the time that the row reached."""
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
    return log_size(value) if is_number(value) else None


def is_number(value: str) -> bool:
    """Whether a value of a series is a number, not a word."""
    return value not in _NOT_NUMBERS


@lru_cache(1 << 8)
def log_sizes(texts: tuple[str, ...]) -> list[float]:
    """log10 |number| of each, -1e9 for 0; raises InputError for text that is not a number.

    Cached: several rules that check and compare a row need it of the same series.
    """
    joined = "".join(texts)
    if "_" in joined or not joined.isascii():  # Python accepts these, exact() does not
        return [_floor(log10(exact(text))) for text in texts]
    with suppress(ValueError):
        sizes = list(map(abs, map(float, texts)))
        if 1e-300 < min(sizes) <= sum(sizes) < 1e300:
            return list(map(math.log10, sizes))
    return list(map(log_size, texts))


def log_size(text: str) -> float:
    """log10 |number|, -1e9 for 0; in floating point where the number is in the range of double."""
    try:
        size = abs(float(text))
    except ValueError:
        size = 0.0
    return math.log10(size) if 1e-300 < size < 1e300 else -1e9 if text == "0" else _floor(log10(exact(text)))


def bound(metric: Metric) -> float:
    """log10 of the largest possible size of a metric; 1e9 where it is not finite or missing."""
    if metric.log10 is not None:
        return metric.log10
    if metric.value == UNRESOLVED and metric.bound:
        return _floor(metric.size) + 0.01
    return -1e9 if metric.value == "0" else 1e9


def law_text(law: Law) -> str:
    """A growth law in a few words."""
    if law.exponent is None:
        return law.growth
    span = "" if law.low is None or law.high is None else f" [{law.low:.3g}, {law.high:.3g}]"
    return f"{law.growth}, exponent {law.exponent:.3g}{span}"


@lru_cache(1 << 12)
def inconsistent(law: Law) -> str:
    """The contradiction within a law, of its class, exponent, intervals and span; empty without one."""
    if (law.low is None) != (law.high is None) or (law.exponent is None and law.low is not None):
        return "an incomplete interval, or one without an exponent"
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
    fault = f"{law.growth} with the exponent {law.exponent:g} in [{low:g}, {high:g}]"
    if law.growth == "exponential":
        return "" if law.exponent > 0 and law.bend is None else fault
    if law.low is None:
        low, high = low - _ASSUMED_HALF_WIDTH, high + _ASSUMED_HALF_WIDTH
    expected = "unresolved" if bent(bend) else nearest_class(law.exponent, low, high)
    return "" if law.growth == expected else fault


def interval_of(law: Law) -> Interval:
    """The interval of the exponent; without one the exponent alone."""
    assert law.exponent is not None
    return (law.exponent, law.exponent) if law.low is None or law.high is None else (law.low, law.high)


REMEDY = "Write it again with `heavytop run`, or for a trajectory with `heavytop score FILE --out FOLDER`."


def check_keys(file: Path | str, rows: Iterable[Row]) -> None:
    """Raises InputError for a repeated row."""
    identities = set()
    for row in rows:
        if row.identity in identities:
            raise InputError(f"{file} contains the row {printable(row_name(row.identity))[:60]} twice.", REMEDY)
        identities.add(row.identity)


def check_rows(file: Path, rows: Iterable[Row], kinds: Kinds) -> None:
    """Raises InputError for an impossible or contradictory row, with its name and field."""
    for row in rows:
        _refuse_first(file, row, _problems(row, kind_of(row, kinds)))


def check_seconds(file: Path, rows: Iterable[Row], kinds: Kinds) -> None:
    """Raises InputError where seconds contradict a row that is otherwise checked: only kinds have rules for them."""
    for row in rows:
        _refuse_first(file, row, kind_of(row, kinds).contradictions(row) if row.outcome == _SUCCESS else ())


def _refuse_first(file: Path, row: Row, problems: Iterable[str]) -> None:
    for problem in problems:
        where = f"{file}, row {printable(row.case)[:60]} ({printable(row.precision)[:60]})"
        raise InputError(f"{where}, {printable(problem)[:260].rstrip('.')}.", REMEDY)


def _problems(row: Row, kind: ReportedKind) -> Iterator[str]:
    """Faults of a row, as ``FIELD: REASON``; only the first counts, as later ones may follow from it."""
    yield from _of_fields(row, kind)
    for name, law in row.laws.items():
        yield from (f"growth {name[:60]}, {problem}" for problem in _of_law(law))
    for name, metric in row.metrics.items():
        if not _is_plain(metric):
            yield from (f"{name[:60]}: {problem}" for problem in _of_metric(metric, row.finite))
    for name, series in row.series.items():
        yield from (f"{name[:60]}: {problem}" for problem in _of_series(series))
    yield from contradictions(row, kind)


def _of_fields(row: Row, kind: ReportedKind) -> Iterator[str]:
    for name, time in (("horizon", row.horizon), ("time_reached", row.time_reached)):
        if cause := _cause(time):
            yield f"{name}: {cause}"
    if row.outcome not in _OUTCOMES:
        yield f"outcome: must be a known one; got {row.outcome[:60]!r}"
    if not row.bits and row.precision != "exact":
        yield "bits: missing"
    if row.time_reached != row.horizon:
        reached, horizon = exact(row.time_reached), exact(row.horizon)
        # the time is rounded to the format, the horizon is not always
        if reached * horizon < 0 or abs(reached) > abs(horizon) * (1 + Fraction(2, 2**row.bits)):
            yield f"time_reached: {row.time_reached} is beyond {row.horizon}"
    lacking = [name for name in kind.needed if name not in row.metrics]
    if lacking and row.outcome not in UNMEASURED:
        yield f"metrics: a row of {kind.name} without {', '.join(lacking)}"


def _of_law(law: Law) -> Iterator[str]:
    for name in ("first", "last", "detects", "lost_at"):
        text = getattr(law, name)
        if text is not None and (cause := _cause(text) or _negative(text)):
            yield f"{name}: {cause}"


_OUTCOMES = {*(outcome.value for outcome in Outcome), *UNMEASURED}
WORDS = {
    "error": ("nan", "missing", UNRESOLVED),
    "duration": ("nan", "missing", "never"),
    "value": ("nan", "missing", "never", UNRESOLVED),
}
"""Words in place of a number, for each kind of metric."""


def _of_metric(metric: Metric, finite: bool) -> Iterator[str]:
    if metric.bound is not None and (cause := _cause(metric.bound) or _negative(metric.bound)):
        yield f"its bound: {cause}"
    if metric.bound is not None and metric.value != UNRESOLVED:
        yield f"{metric.value} with a bound"
    if metric.value in WORDS[metric.kind]:
        if metric.log10 is not None:
            yield f"{metric.value} with a logarithm"
        if finite and metric.value == "nan":
            yield "said to be finite, but holds a NaN"
        return
    if cause := _cause(metric.value):
        yield cause
    if metric.kind != "value" and (negative := _negative(metric.value)):
        yield negative
    stated, expected = metric.log10, log10(exact(metric.value))
    if (stated is None) != (expected is None) or (
        stated is not None and expected is not None and not abs(stated - expected) < CLOSE
    ):
        yield f"value {metric.value} and log10 {stated} disagree"


def _of_series(series: Series) -> Iterator[str]:
    if len(series.times) != len(series.values):
        yield "not one value for each time"
    numbers = numbers_of(series)
    if series.quantity is not None:  # an error or a drift
        yield from (f"{number} is negative" for number in numbers if number.startswith("-"))
    try:
        log_sizes(numbers), log_sizes(tuple(series.times))
    except InputError:
        yield from filter(None, map(_cause, (*series.times, *numbers)))


@lru_cache(1 << 12)
def _cause(text: str) -> str:
    """The reason why a text is not a number; empty where it is one."""
    try:
        exact(text)
    except InputError as error:
        return error.cause
    return ""


def _negative(text: str) -> str:
    return f"{text} is negative" if exact(text) < 0 else ""


def _is_plain(metric: Metric) -> bool:
    """Whether a metric is a positive number in the range of double with its logarithm, as most are."""
    text, logarithm = metric.value, metric.log10
    if logarithm is None or metric.bound is not None or "_" in text or not text.isascii():
        return False
    try:
        return abs(math.log10(float(text)) - logarithm) < CLOSE / 2
    except ValueError:
        return False
