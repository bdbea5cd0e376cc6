"""Whether the rows of a report can be: what no run writes is refused, with the row and its field."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import isfinite
from pathlib import Path

import numpy

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import UNMEASURED, Law, Metric, Row
from heavytop.report.consistency import contradictions
from heavytop.report.kind import Kind, Kinds, kind_of
from heavytop.report.names import row_name
from heavytop.report.printable import printable

REMEDY = "Make it again with `heavytop run`."
_CLOSE = 1e-5
"""How far a log10 of six decimals may be from that of its value."""


def check_keys(file: Path, rows: Iterable[Row]) -> None:
    """Raises InputError where a row is there twice."""
    seen = set()
    for row in rows:
        if row.identity in seen:
            raise InputError(f"{file} holds the row {printable(row_name(row.identity))[:60]} twice.", REMEDY)
        seen.add(row.identity)


def check_rows(file: Path, rows: Sequence[Row], kinds: Kinds) -> None:
    """Raises InputError where a row cannot be, or contradicts itself, naming it and its field."""
    known: set[str] = set()
    for row in rows:
        # most rows reached the horizon of the row before
        if (
            row.horizon not in known
            or row.time_reached != row.horizon
            or row.outcome != "success"
            or kind_of(row, kinds).needed
            or row.laws
            or not row.bits
        ):
            _check_row(file, row, kind_of(row, kinds))
            known.add(row.horizon)
    metrics = [metric for row in rows for metric in row.metrics.values()]
    if doubtful := _doubtful(metrics):
        for row in rows:
            for name, metric in row.metrics.items():
                if id(metric) in doubtful:
                    _check_metric(f"{_where(file, row)}, {printable(name)[:60]}", metric, row.finite)
    _check_series(file, rows)
    for row in rows:
        for problem in contradictions(row, kind_of(row, kinds)):
            raise InputError(f"{_where(file, row)}, {printable(problem)[:260]}.", REMEDY)


def _check_series(file: Path, rows: Iterable[Row]) -> None:
    """Raises InputError where a series has not one value for each time, or a number that is none."""
    for row in rows:
        for name, series in row.series.items():
            if len(series.times) != len(series.values):
                raise InputError(f"{_where(file, row)}, {printable(name)[:60]}: not one value for each time.", REMEDY)
            for text in (*series.times, *series.values):
                if text not in WORDS["value"] and not _plain(text):
                    _number(f"{_where(file, row)}, {printable(name)[:60]}", text)


def _plain(text: str) -> bool:
    """Whether it is plainly a finite number, told without the cost of an exact one."""
    try:
        return isfinite(float(text))
    except ValueError:
        return False


def _doubtful(metrics: Sequence[Metric]) -> set[int]:
    """The ids of the metrics that are not plainly a number with its logarithm; told in a few strokes."""
    try:
        values = numpy.array(list(map(float, [metric.value for metric in metrics])))
    except ValueError:
        return set(map(id, metrics))
    given = numpy.array([metric.log10 for metric in metrics], dtype=float)
    with numpy.errstate(all="ignore"):
        # the logarithm of a negative number is none
        plain = abs(numpy.log10(values) - given) < _CLOSE / 2
    return set() if plain.all() else {id(metrics[index]) for index in numpy.flatnonzero(~plain).tolist()}


def _where(file: Path, row: Row) -> str:
    return f"{file}, row {printable(row.case)[:60]} ({printable(row.precision)[:60]})"


def _check_row(file: Path, row: Row, kind: Kind) -> None:
    where = _where(file, row)
    horizon, reached = (_number(f"{where}, {name}", getattr(row, name)) for name in ("horizon", "time_reached"))
    if row.outcome not in _OUTCOMES:
        raise InputError(f"{where}, outcome: {printable(row.outcome)[:60]!r} is none.", REMEDY)
    if not row.bits and row.precision != "exact":
        raise InputError(f"{where}, bits: a format without any.", REMEDY)
    if row.outcome == "success" and abs(reached) < abs(horizon):
        raise InputError(f"{where}: a success that reached only {row.time_reached} of {row.horizon}.", REMEDY)
    # a time is rounded to the format, the horizon need not be
    if reached * horizon < 0 or abs(reached) > abs(horizon) * (1 + Fraction(2, 2**row.bits)):
        raise InputError(f"{where}, time_reached: {row.time_reached} is beyond {row.horizon}.", REMEDY)
    lacking = [name for name in kind.needed if name not in row.metrics]
    if lacking and row.outcome not in UNMEASURED:
        raise InputError(f"{where}: a row of {kind.name} without {', '.join(lacking)}.", REMEDY)
    for name, law in row.laws.items():
        _check_law(f"{where}, growth {printable(name)[:60]}", law)


def _check_law(where: str, law: Law) -> None:
    for name in ("first", "last", "detects", "lost_at"):
        text = getattr(law, name)
        if text is not None and _number(f"{where}, {name}", text) < 0:
            raise InputError(f"{where}, {name}: {text} is negative.", REMEDY)


_OUTCOMES = {*(outcome.value for outcome in Outcome), *UNMEASURED}
WORDS = {
    "error": ("nan", "missing", UNRESOLVED),
    "duration": ("nan", "missing", "never"),
    "value": ("nan", "missing", "never", UNRESOLVED),
}
"""What may stand in the place of a number, for each kind of metric."""


def _check_metric(where: str, metric: Metric, finite: bool) -> None:
    if metric.bound is not None and _number(where, metric.bound) < 0:
        raise InputError(f"{where}: a negative bound {metric.bound}.", REMEDY)
    if metric.value in WORDS[metric.kind]:
        if metric.log10 is not None:
            raise InputError(f"{where}: {metric.value} with a logarithm.", REMEDY)
        if finite and metric.value == "nan":
            raise InputError(f"{where}: said to be finite, but holds a NaN.", REMEDY)
        return
    number = _number(where, metric.value)
    if number < 0 and metric.kind != "value":
        raise InputError(f"{where}: a negative {metric.kind} {metric.value}.", REMEDY)
    given, expected = metric.log10, log10(number)
    if (given is None) != (expected is None) or (
        given is not None and expected is not None and not abs(given - expected) < _CLOSE
    ):
        raise InputError(f"{where}: value {metric.value} and log10 {given} disagree.", REMEDY)


def _number(where: str, value: str) -> Fraction:
    try:
        return exact(value)
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", REMEDY) from None
