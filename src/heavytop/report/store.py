"""Reports on disk: written whole, read with suspicion."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy

from heavytop.errors import InputError
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import exact, log10
from heavytop.records import SCHEMA, Bits, Law, Metric, Report, Row, Starts
from heavytop.suite.files import replace

FILE = "report.json"
DIGEST = "report.json.sha256"
_REMEDY = "Make it again with `heavytop run`."
_CHUNK = 100
"""Rows of a brief report that are checked at once: few, so that they are still in the cache when compared."""
_CLOSE = 1e-5
"""How far a log10 of six decimals may be from that of its value."""


def write(report: Report, directory: Path, rows: Iterable[Row] | None = None) -> Path:
    """DIRECTORY/report.json, a row a line, and beside it its SHA-256 in the format of ``sha256sum -c``.

    rows: in place of those of the report, where they are too many to hold; written one by one.
    """
    digest = replace(directory / FILE, _pieces(report, report.rows if rows is None else rows))
    replace(directory / DIGEST, [f"{digest}  {FILE}\n".encode()])
    return directory / FILE


def _pieces(report: Report, rows: Iterable[Row]) -> Iterator[bytes]:
    head = {"schema": report.schema, "plan": report.plan, "environment": report.environment}
    between = msgspec.json.encode(head)[:-1] + b',"rows":[\n'
    for row in rows:
        yield between + msgspec.json.encode(row)
        between = b",\n"
    yield (b"" if between == b",\n" else between) + b"\n]}\n"


class BriefRow(msgspec.Struct, gc=False):
    """What a comparison needs of a :class:`heavytop.records.Row`: no series, no words about it."""

    case: str
    system: str
    integrator: str
    precision: str
    bits: Bits
    outcome: str
    horizon: str
    time_reached: str
    steps: int
    finite: bool
    metrics: dict[str, Metric]
    measure: str = ""
    against: str = ""
    flags: dict[str, str] = {}
    starts: Starts = 1
    laws: dict[str, Law] = {}
    seconds: dict[str, float] = {}

    @property
    def key(self) -> tuple[str, ...]:
        """What makes a row the same row in another report."""
        return self.measure, self.case, self.system, self.integrator, self.precision


class Brief:
    """A report as a comparison needs it: its rows are read and checked each time that they are gone through, so that
    some hundred thousand of them fit into memory.
    """

    def __init__(self, file: Path, parts: _Parts) -> None:
        self.file = file
        self.plan = parts.plan
        self.environment = parts.environment
        self.rows = _Rows(file, parts.rows)


class _Parts(msgspec.Struct):
    schema: str
    plan: dict[str, str]
    environment: dict[str, Any]
    rows: list[msgspec.Raw]


class _Rows:
    """The rows of a brief report; raises InputError at one that is wrong."""

    def __init__(self, file: Path, rows: list[msgspec.Raw]) -> None:
        self._file = file
        self._rows = rows
        self._decode = msgspec.json.Decoder(BriefRow).decode

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, number: int) -> BriefRow:
        return self._decode(self._rows[number])

    def __iter__(self) -> Iterator[BriefRow]:
        seen: set[int] = set()
        for start in range(0, len(self._rows), _CHUNK):
            try:
                rows = [self._decode(row) for row in self._rows[start : start + _CHUNK]]
            except (msgspec.DecodeError, UnicodeDecodeError) as error:
                raise InputError(f"{self._file} is not a whole report: {error}.", _REMEDY) from None
            _check_rows(self._file, rows)
            hashes = {hash(row.key) for row in rows}
            if len(hashes) < len(rows) or hashes & seen:
                _check_keys(self._file, (self._decode(row) for row in self._rows))
            seen |= hashes
            yield from rows


_Kind = TypeVar("_Kind", Report, _Parts)


def read(path: Path) -> Report:
    """The report at ``path``, a file or a directory with a report.json.

    Raises InputError for a file that is missing, truncated, of another program or schema, edited since it was written
    (where its checksum lies beside it), or inconsistent in itself.
    """
    file, report = _read(path, Report)
    _check_keys(file, report.rows)
    _check_rows(file, report.rows)
    for row in report.rows:
        for name, series in row.series.items():
            if len(series.times) != len(series.values):
                raise InputError(f"{_where(file, row)}, {name[:60]}: not one value for each time.", _REMEDY)
    return report


def read_brief(path: Path) -> Brief:
    """The same for a comparison; what is wrong with a row is found as the rows are gone through."""
    return Brief(*_read(path, _Parts))


def _read(path: Path, kind: type[_Kind]) -> tuple[Path, _Kind]:
    file = path / FILE if path.is_dir() else path
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"There is no report at {file}: {error.strerror}.", _REMEDY) from None
    with ThreadPoolExecutor(1) as beside:
        digest = beside.submit(_check_digest, file, content)
        try:
            report = msgspec.json.decode(content, type=kind)
            problem = ""
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            problem = str(error)
        digest.result()
    if problem or report.schema != SCHEMA:
        with suppress(msgspec.DecodeError, UnicodeDecodeError):
            schema = msgspec.json.decode(content, type=_Schema).schema
            if schema != SCHEMA:
                raise InputError(f"{file} has the schema {schema[:60]!r}, not {SCHEMA!r}.", _REMEDY)
        raise InputError(f"{file} is not a whole report: {problem}.", _REMEDY)
    if not isinstance(report.environment.get("packages", {}), dict):
        raise InputError(f"{file} does not say which packages it was made with.", _REMEDY)
    return file, report


class _Schema(msgspec.Struct):
    schema: str


def _check_digest(file: Path, content: bytes) -> None:
    beside = file.with_name(file.name + ".sha256")
    if not beside.exists():
        return
    expected = beside.read_text("utf-8", errors="replace").split()
    if not expected or expected[0] != hashlib.sha256(content).hexdigest():
        raise InputError(f"{file} was changed since it was written: its checksum differs.", _REMEDY)


def _check_keys(file: Path, rows: Iterable[Row | BriefRow]) -> None:
    seen = set()
    for row in rows:
        if row.key in seen:
            raise InputError(f"{file} holds the row {' '.join(filter(None, row.key))} twice.", _REMEDY)
        seen.add(row.key)


def _check_rows(file: Path, rows: Sequence[Row] | Sequence[BriefRow]) -> None:
    known: set[str] = set()
    for row in rows:
        # most rows reached the horizon of the row before
        if row.horizon not in known or row.time_reached != row.horizon or row.measure in _NEEDED:
            _check_row(file, row)
            known.add(row.horizon)
    metrics = [metric for row in rows for metric in row.metrics.values()]
    if doubtful := _doubtful(metrics):
        for row in rows:
            for name, metric in row.metrics.items():
                if id(metric) in doubtful:
                    _check_metric(f"{_where(file, row)}, {name[:60]}", metric, row.finite)


def _doubtful(metrics: Sequence[Metric]) -> set[int]:
    """The ids of the metrics that are not plainly a number with its logarithm; told in a few strokes."""
    try:
        values = numpy.array(list(map(float, [metric.value for metric in metrics])))
    except ValueError:
        return set(map(id, metrics))
    given = numpy.array([metric.log10 for metric in metrics], dtype=float)
    with numpy.errstate(all="ignore"):
        plain = abs(numpy.log10(abs(values)) - given) < _CLOSE / 2
    return set() if plain.all() else {id(metrics[index]) for index in numpy.flatnonzero(~plain).tolist()}


def _where(file: Path, row: Row | BriefRow) -> str:
    return f"{file}, row {row.case[:60]} ({row.precision[:20]})"


def _check_row(file: Path, row: Row | BriefRow) -> None:
    where = _where(file, row)
    horizon, reached = (abs(_number(where, value)) for value in (row.horizon, row.time_reached))
    if row.outcome == "success" and reached < horizon:
        raise InputError(f"{where}: a success that reached only {row.time_reached} of {row.horizon}.", _REMEDY)
    lacking = [name for name in _NEEDED.get(row.measure, ()) if name not in row.metrics]
    if lacking and (row.metrics or row.outcome == "success"):
        raise InputError(f"{where}: a row of {row.measure} without {', '.join(lacking)}.", _REMEDY)


WORDS = {
    "error": ("nan", "missing", UNRESOLVED),
    "duration": ("nan", "missing", "never"),
    "value": ("nan", "missing", "never", UNRESOLVED),
}
"""What may stand in the place of a number, for each kind of metric."""
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


def _check_metric(where: str, metric: Metric, finite: bool) -> None:
    if metric.bound is not None:
        _number(where, metric.bound)
    if metric.value in WORDS[metric.kind]:
        if metric.log10 is not None:
            raise InputError(f"{where}: {metric.value} with a logarithm.", _REMEDY)
        if finite and metric.value == "nan":
            raise InputError(f"{where}: said to be finite, but holds a NaN.", _REMEDY)
        return
    given, expected = metric.log10, log10(_number(where, metric.value))
    if (given is None) != (expected is None) or (
        given is not None and expected is not None and not abs(given - expected) < _CLOSE
    ):
        raise InputError(f"{where}: value {metric.value} and log10 {given} disagree.", _REMEDY)


def _number(where: str, value: str) -> Fraction:
    try:
        return exact(value)
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", _REMEDY) from None
