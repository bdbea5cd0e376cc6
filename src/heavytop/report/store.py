"""Reports on disk: written whole, read with suspicion."""

from __future__ import annotations

import hashlib
from fractions import Fraction
from pathlib import Path

import msgspec

from heavytop.errors import InputError
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import SCHEMA, Metric, Report, Row
from heavytop.suite.checkpoint import replace

FILE = "report.json"
DIGEST = "report.json.sha256"
_REMEDY = "Make it again with `heavytop run`."


def write(report: Report, directory: Path) -> Path:
    """DIRECTORY/report.json, and beside it its SHA-256 in the format of ``sha256sum -c``."""
    content = msgspec.json.format(msgspec.json.encode(report), indent=1) + b"\n"
    replace(directory / DIGEST, f"{hashlib.sha256(content).hexdigest()}  {FILE}\n".encode())
    replace(directory / FILE, content)
    return directory / FILE


def read(path: Path) -> Report:
    """The report at ``path``, a file or a directory with a report.json.

    Raises InputError for a file that is missing, truncated, of another program or schema, edited since it was written
    (where its checksum lies beside it), or inconsistent in itself.
    """
    file = path / FILE if path.is_dir() else path
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"There is no report at {file}: {error.strerror}.", _REMEDY) from None
    _check_digest(file, content)
    try:
        schema = msgspec.json.decode(content, type=_Schema).schema
        if schema != SCHEMA:
            raise InputError(f"{file} has the schema {schema[:60]!r}, not {SCHEMA!r}.", _REMEDY)
        report = msgspec.json.decode(content, type=Report)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{file} is not a whole report: {error}.", _REMEDY) from None
    keys = set()
    for row in report.rows:
        _check_row(file, row)
        if row.key in keys:
            raise InputError(f"{file} holds the row {' '.join(filter(None, row.key))} twice.", _REMEDY)
        keys.add(row.key)
    return report


class _Schema(msgspec.Struct):
    schema: str


def _check_digest(file: Path, content: bytes) -> None:
    beside = file.with_name(file.name + ".sha256")
    if not beside.exists():
        return
    expected = beside.read_text("utf-8", errors="replace").split()
    if not expected or expected[0] != hashlib.sha256(content).hexdigest():
        raise InputError(f"{file} was changed since it was written: its checksum differs.", _REMEDY)


def _check_row(file: Path, row: Row) -> None:
    where = f"{file}, row {row.case[:60]} ({row.precision[:20]})"
    horizon, reached = (_number(where, value) for value in (row.horizon, row.time_reached))
    if row.outcome == "success" and abs(reached) < abs(horizon):
        raise InputError(f"{where}: a success that reached only {row.time_reached} of {row.horizon}.", _REMEDY)
    if not 0 <= row.bits <= _MOST_BITS:
        raise InputError(f"{where}: {row.bits} bits are no format.", _REMEDY)
    lacking = [name for name in _NEEDED.get(row.measure, ()) if name not in row.metrics]
    if lacking:
        raise InputError(f"{where}: a row of {row.measure} without {', '.join(lacking)}.", _REMEDY)
    for name, metric in row.metrics.items():
        _check_metric(f"{where}, {name[:60]}", metric)
    if row.finite and any(metric.value == "nan" for metric in row.metrics.values()):
        raise InputError(f"{where}: said to be finite, but holds a NaN.", _REMEDY)


WORDS = {
    "error": ("nan", "missing", UNRESOLVED),
    "duration": ("nan", "missing", "never"),
    "value": ("nan", "missing", "never", UNRESOLVED),
}
"""What may stand in the place of a number, for each kind of metric."""
_MOST_BITS = 100_000
_QUANTITIES = ("omega", "theta", "psi")
_NEEDED = {
    "homoclinic": ("break_away_time",),
    "claim_model": ("claim_parts_by_1_percent_at",),
    "claim_evaluation": (
        *(f"claim_evaluation_error_{name}_max_finite" for name in _QUANTITIES),
        *(f"claim_evaluation_{name}_not_finite_from" for name in _QUANTITIES),
    ),
    "break_away_law": ("break_away_slope", "break_away_slope_expected", "break_away_slope_off_by"),
}
"""Metrics that a summary of such a row cannot do without."""


def _check_metric(where: str, metric: Metric) -> None:
    if metric.bound is not None:
        _number(where, metric.bound)
    if metric.value in WORDS[metric.kind]:
        if metric.log10 is not None:
            raise InputError(f"{where}: {metric.value} with a logarithm.", _REMEDY)
        return
    value = abs(_number(where, metric.value))
    expected = log10(value)
    given = metric.log10
    if (given is None) != (expected is None) or (
        given is not None and expected is not None and not abs(given - expected) < 1e-5
    ):
        raise InputError(f"{where}: value {metric.value} and log10 {given} disagree.", _REMEDY)


def _number(where: str, value: str) -> Fraction:
    try:
        return exact(value)
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", _REMEDY) from None
