"""Reports on disk: written atomically, validated on reading."""

from __future__ import annotations

import gzip
import hashlib
import json
import platform
import re
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib import metadata
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec.structs import replace as replace_struct

from heavytop import records
from heavytop.errors import InputError, why
from heavytop.extras import import_heyoka
from heavytop.files import read_whole, replace, without_repeats
from heavytop.precision import available
from heavytop.records import SCHEMA, Report, Row, Seconds
from heavytop.report.document.kind import Kinds
from heavytop.report.store.checks import REMEDY, check_keys, check_rows, check_seconds
from heavytop.version import commit

FILE = "report.json"
DIGEST = "report.json.sha256"
UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
_NAME = 200
_SECONDS = b'"seconds":'
_decode_seconds = msgspec.json.Decoder(dict[str, Seconds]).decode
_CHUNK = 1 << 16
"""Bytes of a brief report whose rows are checked together: few enough to be in the cache when they are compared."""


def write(report: Report, directory: Path, rows: Iterable[Row] | None = None) -> Path:
    """Writes DIRECTORY/report.json, one row per line, and its SHA-256 in the format of ``sha256sum -c``.

    rows: in place of those of the report, where they do not fit into memory; written one by one.
    """
    digest = replace(directory / FILE, _pieces(report, report.rows if rows is None else rows))
    replace(directory / DIGEST, [f"{digest}  {FILE}\n".encode()])
    return directory / FILE


def _pieces(report: Report, rows: Iterable[Row]) -> Iterator[bytes]:
    head: dict[str, Any] = {"schema": report.schema, "plan": report.plan, "environment": report.environment}
    if report.beside is not None:
        head["beside"] = report.beside
    between = msgspec.json.encode(head)[:-1] + b',"rows":[\n'
    for row in rows:
        yield between + msgspec.json.encode(row)
        between = b",\n"
    yield (b"" if between == b",\n" else between) + b"\n]}\n"


class Brief:
    """A report for a comparison: its rows are decoded and checked on each iteration, so that some hundred thousand of
    them fit into memory.
    """

    def __init__(self, file: Path, parts: _Parts, kinds: Kinds) -> None:
        self.file = file
        self.plan = parts.plan
        self.environment = parts.environment
        self.rows = BriefRows(file, parts.rows, kinds)


class _Parts(msgspec.Struct, frozen=True):
    schema: str
    plan: dict[str, str]
    environment: dict[str, Any]
    rows: list[msgspec.Raw]


class BriefRows:
    """The rows of a brief report; raises InputError at an invalid one.

    twins: the rows of another brief report, iterated in step: a row that equals its twin but for its seconds is neither
    decoded nor checked again.  seen: hashes of the names of the rows iterated last.
    """

    def __init__(self, file: Path, rows: list[msgspec.Raw], kinds: Kinds) -> None:
        self._file = file
        self._kinds = kinds
        self._rows = rows
        self._decoder = msgspec.json.Decoder(Row)
        self._checked: dict[int, Row] = {}
        self.twins: BriefRows | None = None
        self.seen = set[int]()

    def at(self, places: slice) -> BriefRows:
        """The rows at consecutive places."""
        return BriefRows(self._file, self._rows[places], self._kinds)

    def _decode(self, row: msgspec.Raw) -> Row:
        return records.of_row(self._decoder.decode(row))

    def _twin(self, number: int) -> Row | None:
        """The row of that number as its twin with its own seconds; None where more differs."""
        twin = None if self.twins is None else self.twins._checked.get(number)
        if self.twins is None or twin is None:
            return None
        texts = [bytes(rows._rows[number]) for rows in (self.twins, self)]
        if not texts[1].startswith(texts[0][: len(texts[0]) // 2]):  # a cheap test that most other rows fail
            return None
        (*old_parts, old), (*new_parts, new) = map(_without_seconds, texts)
        if old_parts != new_parts:
            return None
        if new == old:
            return twin
        with suppress(*UNREADABLE):
            if _decode_seconds(old) == twin.seconds:
                return replace_struct(twin, seconds=_decode_seconds(new))
        return None

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, number: int) -> Row:
        return self._decode(self._rows[number])

    def __iter__(self) -> Iterator[Row]:
        seen = self.seen = set()
        repeated = False
        chunk = max(1, _CHUNK // len(bytes(self._rows[0]))) if self._rows else 1
        for start in range(0, len(self._rows), chunk):
            numbers = range(start, min(start + chunk, len(self._rows)))
            twins = {number: row for number in numbers if (row := self._twin(number)) is not None}
            rows: list[Row] = []
            try:
                rows.extend(twins.get(number) or self._decode(self._rows[number]) for number in numbers)
            except UNREADABLE as error:
                where = f"row {start + len(rows) + 1}: {error}"
                raise InputError(f"{self._file} is not a whole report: {where}.", REMEDY) from None
            check_rows(self._file, [row for n, row in zip(numbers, rows, strict=True) if n not in twins], self._kinds)
            check_seconds(self._file, twins.values(), self._kinds)
            self._checked = dict(zip(numbers, rows, strict=True))
            # the names of most rows differ; where they do not, the identities must
            hashes = {hash((r.measure, r.case, r.system, r.integrator, r.precision, r.horizon)) for r in rows}
            if not repeated and (len(hashes) < len(rows) or hashes & seen):
                repeated = True
                check_keys(self._file, (self._decode(row) for row in self._rows))
            seen |= hashes
            yield from rows


def _without_seconds(text: bytes) -> tuple[bytes, bytes, bytes]:
    """The text of a row before, after and in its seconds; all of it before them unless it has them exactly once."""
    head, _, after = text.partition(_SECONDS)
    seconds, end, tail = after.partition(b"}")
    return (text, b"", b"") if _SECONDS in tail or not end else (head, tail, seconds + end)


AnyReport = Report | Brief

_Content = TypeVar("_Content", Report, _Parts)


def read(path: Path, kinds: Kinds) -> Report:
    """The report at ``path``, a file or a directory with a report.json, or with a report.json.gz.

    Raises InputError for a file that is missing, truncated, of another program or schema, edited since it was written
    (where its checksum lies beside it), or inconsistent.
    """
    file, report = _read(path, Report)
    report = replace_struct(report, rows=[records.of_row(row) for row in report.rows])
    check_keys(file, report.rows)
    check_rows(file, report.rows, kinds)
    return report


def read_brief(path: Path, kinds: Kinds) -> Brief:
    """The report at ``path`` for a comparison; errors in a row are found on iteration."""
    return Brief(*_read(path, _Parts), kinds)


def full_report(report: AnyReport) -> Report:
    """The report with all of its rows."""
    if isinstance(report, Report):
        return report
    return Report(SCHEMA, report.plan, report.environment, list(report.rows))


def _read(path: Path, kind: type[_Content]) -> tuple[Path, _Content]:
    file = path
    try:
        file = path / FILE if path.is_dir() else path
        if file != path and not file.exists() and (compressed := path / f"{FILE}.gz").exists():
            file = compressed
        content = read_whole(file)
        if file.suffix == ".gz":
            content = gzip.decompress(content)
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reports = sorted(entry.parent.name for entry in file.parent.glob(f"*/{FILE}*"))
        remedy = (
            f"Name one of the reports in {str(file.parent)[:_NAME]}: {', '.join(dict.fromkeys(reports))}."
            if reports
            else REMEDY
        )
        raise InputError(f"{str(file)[:_NAME]} contains no report: {why(error)}.", remedy) from None
    if not content.lstrip().startswith(b"{"):
        remedy = f"`heavytop score {file}` reads a trajectory." if file.suffix == ".csv" else REMEDY
        raise InputError(f"{str(file)[:_NAME]} is not a whole report: it is not a JSON object.", remedy)
    unchanged = _has_its_digest(file, content)
    try:
        report = msgspec.json.decode(content, type=kind)
        problem = ""
    except UNREADABLE as error:
        problem = str(error)
    if problem or report.schema != SCHEMA:
        with suppress(*UNREADABLE):
            schema = msgspec.json.decode(content, type=_Schema).schema
            if schema != SCHEMA:
                raise InputError(f"{file} has the schema {schema[:60]!r}, not {SCHEMA!r}.", REMEDY)
        raise InputError(f"{file} is not a whole report: {problem}.", REMEDY)
    if not unchanged:
        _check_repeats(file, content)
    if not isinstance(report.environment.get("packages", {}), dict):
        raise InputError(f"{file} does not name the versions of its packages.", REMEDY)
    return file, replace_struct(report, plan=records.of_plan(report.plan))


class _Schema(msgspec.Struct):
    schema: str


def _check_repeats(file: Path, content: bytes) -> None:
    """Raises InputError where an object of the file repeats a key: the decoder silently takes the last."""
    try:
        json.loads(content, object_pairs_hook=without_repeats)
    except InputError as error:
        raise InputError(f"{file}: {error.cause}", REMEDY) from None
    except UNREADABLE as error:
        raise InputError(f"{file} is not a whole report: {error}.", REMEDY) from None


def _has_its_digest(file: Path, content: bytes) -> bool:
    """Whether the file has its checksum beside it; raises InputError where that differs."""
    checksum = file.with_name(file.name.removesuffix(".gz") + ".sha256")
    if not checksum.exists():
        return False
    expected = checksum.read_text("utf-8", errors="replace").split()
    if not expected or expected[0] != hashlib.sha256(content).hexdigest():
        raise InputError(f"{file} was changed since it was written: its checksum differs.", REMEDY)
    return True


# The environment block of a report: everything outside the plan that may change bits.


def environment() -> dict[str, Any]:
    """Versions, processor, formats; ``commit`` of the checkout or of the wheel, where one is known."""
    import flint

    from heavytop.harness.run import versions

    heyoka = import_heyoka()
    import numpy

    return {
        "packages": versions(),
        "flint": str(flint.__FLINT_VERSION__),
        "commit": commit(),
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        **_target(),
        "llvm": _llvm_version(),
        "simd_width_double": int(heyoka.recommended_simd_size()),
        "extended_bits": int(numpy.finfo(numpy.longdouble).nmant) + 1,
        "formats": {name: reason or "available" for name, reason in available().items()},
        "code_cache": "heyoka: none; multiword: by checksum, then a step that is known",
    }


def _target() -> dict[str, Any]:
    """The processor and its features that heyoka compiles for."""
    heyoka = import_heyoka()

    x = heyoka.make_vars("x")
    target = str(heyoka.cfunc([x], [x]).llvm_states[0])
    cpu = re.search(r"^Target CPU *: (.+)$", target, re.M)
    features = re.search(r"^Target features *: (.+)$", target, re.M)
    return {
        "cpu_target": cpu[1] if cpu else "unknown",
        "cpu_features": sorted(re.findall(r"\+([^,]+)", features[1])) if features else [],
    }


def _llvm_version() -> str:
    """The version of LLVM in heyoka's library, which exports it nowhere."""
    for file in metadata.files("heyoka") or ():
        if file.name.startswith("libheyoka"):
            with open(file.locate(), "rb") as library, mmap(library.fileno(), 0, access=ACCESS_READ) as content:
                at = content.find(b"LLVM_VERSION=")
                version = re.match(rb"LLVM_VERSION=([0-9.]+)", content[at : at + 40]) if at >= 0 else None
                return version[1].decode() if version else "unknown"
    return "unknown"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
