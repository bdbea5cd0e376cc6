"""A report in the formats of tools that follow numbers from commit to commit.

Every number is such that smaller is better: log10 of the relative error (digits right with a minus sign) and of the
largest drift of each first integral, none below the eps of its format; exponents of growth laws; seconds.  What is not
a number in a report (a row that failed, an error that is NaN) is none here either: :data:`LOST` counts these.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree

from heavytop.errors import InputError, quoted
from heavytop.measure.digits import digits_kept
from heavytop.records import UNSUPPORTED, Report, Row
from heavytop.report.kind import Kinds, kind_of
from heavytop.report.names import row_name
from heavytop.report.parquet import COLUMNS, lines
from heavytop.report.printable import printable
from heavytop.report.text import drifts, failed
from heavytop.version import version

LOST = "rows without a number"
_TOTAL = "heavytop"
_LARGEST = "error_max"
"""Of a row that has no digits right: work against precision."""


class Measure(NamedTuple):
    """A number of a row; smaller is better.  low, high: its 95 % interval, where it has one."""

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None

    @property
    def slug(self) -> str:
        """Its name in lower case, joined by hyphens."""
        return "-".join("".join(c if c.isalnum() else " " for c in self.name.lower()).split())


def measures(row: Row) -> Iterator[Measure]:
    """The numbers of a row."""
    if row.outcome != "success":
        return
    eps = (1 - row.bits) * math.log10(2) if row.bits else None
    if (kept := digits_kept(row)) is not None:
        yield Measure("log10 of the error", -kept + 0.0, "decades")
    elif (metric := row.metrics.get(_LARGEST)) is not None and metric.log10 is not None:
        yield Measure("log10 of the error", metric.log10, "decades")
    for name, metric in drifts(row):
        size = metric.log10 if metric.log10 is not None else eps if metric.value == "0" else None
        if size is not None:
            yield Measure(f"log10 of the drift of {name}", size if eps is None else max(size, eps), "decades")
    for name, law in row.laws.items():
        if law.exponent is not None:
            yield Measure(f"exponent of {name}", law.exponent, "exponent", law.low, law.high)
    if "run" in row.seconds:
        yield Measure("seconds", row.seconds.get("least", row.seconds["run"]), "s")


def export(report: Report, to: str, kinds: Kinds) -> str:
    """The text of the file for that tool; raises InputError for another."""
    if to not in FORMATS:
        raise InputError(f"There is no export to {quoted(to)}.", f"Use {', '.join(FORMATS)}.")
    return FORMATS[to](report, kinds)


def _named(report: Report, kinds: Kinds) -> Iterator[tuple[str, Row | None, list[Measure]]]:
    """Each row's name and numbers, and the count of the rows that have none."""
    lost = 0
    for row in report.rows:
        found = list(measures(row))
        lost += _is_lost(row, kinds)
        yield printable(row_name(row.identity)), row, found
    yield _TOTAL, None, [Measure(LOST, float(lost), "rows")]


def _is_lost(row: Row, kinds: Kinds) -> bool:
    """Whether a row failed, or has an error that is not finite where none may overflow."""
    overflowed = row.outcome == "success" and not row.finite and not kind_of(row, kinds).may_overflow
    return failed(row, kinds) or overflowed


def _bencher(report: Report, kinds: Kinds) -> str:
    """Bencher Metric Format: benchmark -> measure -> value with its limits."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name, _, numbers in _named(report, kinds):
        for each in numbers:
            limits = {"lower_value": each.low, "upper_value": each.high}
            entry = {"value": each.value} | {key: limit for key, limit in limits.items() if limit is not None}
            found.setdefault(name, {})[each.slug] = entry
    return _json(found)


def _github(report: Report, kinds: Kinds) -> str:
    """`customSmallerIsBetter` of github-action-benchmark: a list of name, unit, value."""
    found = []
    for name, row, numbers in _named(report, kinds):
        for each in numbers:
            entry: dict[str, Any] = {"name": f"{name}: {each.name}", "unit": each.unit, "value": each.value}
            if each.low is not None and each.high is not None:
                entry["range"] = f"{each.low:.3f} to {each.high:.3f}"
            found.append(entry | ({"extra": printable(row.against)} if row is not None else {}))
    return _json(found)


def _asv(report: Report, kinds: Kinds) -> str:
    """The results file of airspeed velocity, version 2: `results/MACHINE/COMMIT-ENVIRONMENT.json`."""
    about = report.environment
    machine = {
        "machine": str(about.get("machine", "unknown")),
        "os": str(about.get("system", "unknown")),
        "cpu": str(about.get("processor", "unknown")),
    }
    results = {}
    for name, row, numbers in _named(report, kinds):
        for each in numbers:
            results[f"{name}: {each.name}"] = [[each.value], [], version()]
        if row is not None and not numbers and _is_lost(row, kinds):
            results[f"{name}: log10 of the error"] = [[None], [], version()]
    return _json(
        {
            "version": 2,
            "commit_hash": str(about.get("commit")).removesuffix("-dirty"),
            "env_name": "heavytop",
            "date": 0,
            "params": machine | {"python": str(about.get("python", "unknown"))},
            "python": str(about.get("python", "unknown")),
            "requirements": {name: str(text) for name, text in about.get("packages", {}).items()},
            "env_vars": {},
            "result_columns": ["result", "params", "version"],
            "results": results,
            "durations": {},
        }
    )


def _junit(report: Report, kinds: Kinds) -> str:
    """A test case a row: one that failed is an error, one that is not supported is skipped."""
    bad = sum(_is_lost(row, kinds) for row in report.rows)
    skipped = sum(row.outcome == UNSUPPORTED for row in report.rows)
    counts = {"tests": len(report.rows), "failures": 0, "errors": bad, "skipped": skipped, "time": 0}
    suite = ElementTree.Element("testsuite", {"name": "heavytop"} | {key: str(count) for key, count in counts.items()})
    for row in report.rows:
        name = printable(row_name(row.identity, with_kind=False))
        seconds = f"{row.seconds.get('run', 0.0):.6f}"
        case = ElementTree.SubElement(suite, "testcase", classname=row.key.kind, name=name, time=seconds)
        if row.outcome == UNSUPPORTED:
            ElementTree.SubElement(case, "skipped", message=printable(row.against))
        elif _is_lost(row, kinds):
            ElementTree.SubElement(case, "error", message=printable(row.against), type=row.outcome)
        if numbers := list(measures(row)):
            text = "\n".join(f"{each.name}: {each.value:.6g} {each.unit}" for each in numbers)
            ElementTree.SubElement(case, "system-out").text = printable(text)
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, "unicode") + "\n"


def _csv(report: Report, kinds: Kinds) -> str:
    """A line for each metric and growth law, with the columns of `--parquet`."""
    made = io.StringIO()
    writer = csv.writer(made, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(lines(report.rows))
    return made.getvalue()


def _json(document: Any) -> str:
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


FORMATS: dict[str, Callable[[Report, Kinds], str]] = {
    "bencher": _bencher,
    "github-action-benchmark": _github,
    "asv": _asv,
    "junit": _junit,
    "csv": _csv,
}
