"""A report in the formats of tools that follow numbers over commits: Bencher, github-action-benchmark, asv, JUnit, CSV.

Every number is one of which smaller is better, so that one direction serves all: −digits right, log10 of a drift,
exponent of a growth law, seconds.  Logarithms, because 1e-997 is no double.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple
from xml.etree import ElementTree

from heavytop.measure.digits import digits_kept
from heavytop.measure.drift import DRIFT
from heavytop.records import Report, Row
from heavytop.report.kind import Kinds
from heavytop.report.names import row_name
from heavytop.report.parquet import COLUMNS, lines
from heavytop.report.printable import printable
from heavytop.report.text import failed, failure, short

DIGITS, LOG_DRIFT, EXPONENT, SECONDS = "minus-digits-right", "log10-drift", "growth-exponent", "seconds"
_UNITS = {DIGITS: "digits", LOG_DRIFT: "log10", EXPONENT: "power of t", SECONDS: "s"}


class Number(NamedTuple):
    """One exported number of a row: the measure and what of it, the value, and its 95 % interval where there is one."""

    row: Row
    measure: str
    of: str
    value: float
    interval: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Row and part: ``drift euler heyoka double: energy``."""
        part = f": {self.of}" if self.of else ""
        return printable(row_name(self.row.identity) + part)


def numbers(report: Report, kinds: Kinds) -> Iterator[Number]:
    """The numbers of every row that reached its horizon; a row that failed has none."""
    for row in report.rows:
        if failed(row, kinds):
            continue
        if (kept := digits_kept(row)) is not None:
            yield Number(row, DIGITS, "", -kept)
        for metric in row.metrics.values():
            quantity = metric.quantity
            if (
                quantity is not None
                and (quantity.name, quantity.statistic) == (DRIFT, "max")
                and metric.log10 is not None
            ):
                band = metric.band
                around = None if band is None else (metric.log10 - band, metric.log10 + band)
                yield Number(row, LOG_DRIFT, quantity.component, metric.log10, around)
        for name, law in row.laws.items():
            if law.exponent is not None:
                ends = None if law.low is None or law.high is None else (law.low, law.high)
                yield Number(row, EXPONENT, name, law.exponent, ends)
        for name, seconds in row.seconds.items():
            if name in ("run", "least"):
                yield Number(row, SECONDS, "", seconds)


def bencher(report: Report, kinds: Kinds) -> str:
    """Bencher Metric Format: a benchmark for each row and part, a measure for each kind of number."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for number in numbers(report, kinds):
        interval = dict(zip(("lower_value", "upper_value"), number.interval or (), strict=False))
        found.setdefault(number.name, {})[number.measure] = {"value": number.value} | interval
    return _json(found)


def github_action_benchmark(report: Report, kinds: Kinds) -> str:
    """The list that github-action-benchmark takes as ``customSmallerIsBetter``."""
    return _json(
        [
            {
                "name": f"{number.name} ({number.measure})",
                "unit": _UNITS[number.measure],
                "value": number.value,
            }
            | ({"range": f"± {(number.interval[1] - number.interval[0]) / 2:.3g}"} if number.interval else {})
            | {"extra": f"T = {short(number.row.horizon)}, {number.row.outcome}"}
            for number in numbers(report, kinds)
        ]
    )


def asv(report: Report, kinds: Kinds) -> dict[str, str]:
    """The files of a results folder of asv by their names: benchmarks.json, machine.json, and the numbers themselves
    under the commit that the report was made from.
    """
    found = list(numbers(report, kinds))
    about = report.environment
    commit = str(about.get("commit") or "unknown").removesuffix("-dirty")
    machine = {
        "machine": "heavytop",
        "os": str(about.get("system", "")),
        "arch": str(about.get("machine", "")),
        "cpu": printable(str(about.get("processor", ""))),
        "num_cpu": "",
        "ram": "",
    }
    benchmarks: dict[str, Any] = {
        _dotted(number): {
            "name": _dotted(number),
            "code": "",
            "type": "track",
            "unit": _UNITS[number.measure],
            "param_names": [],
            "params": [],
            "timeout": 60,
            "version": "1",
        }
        for number in found
    }
    results = {
        "commit_hash": commit,
        "env_name": "heavytop",
        "date": 0,
        "params": machine,
        "python": str(about.get("python", "")),
        "requirements": {},
        "env_vars": {},
        "result_columns": ["result", "params", "version"],
        "results": {_dotted(number): [[number.value], [], "1"] for number in found},
        "durations": {},
        "version": 2,
    }
    return {
        "benchmarks.json": _json(benchmarks | {"version": 2}),
        "heavytop/machine.json": _json(machine | {"version": 1}),
        f"heavytop/{commit[:8]}-heavytop.json": _json(results),
    }


def _dotted(number: Number) -> str:
    """A name of asv: dots part what it folds."""
    parts = (*row_name(number.row.identity).split(), number.measure, number.of)
    return ".".join(printable(part).replace(".", "_").replace(" ", "_") for part in parts if part)


def junit(report: Report, kinds: Kinds) -> str:
    """One test case for each row: one that did not reach its horizon is a failure; what was measured is its output."""
    bad = [row for row in report.rows if failed(row, kinds)]
    suite = ElementTree.Element(
        "testsuite",
        name=f"heavytop {printable(str(report.plan.get('name', '')))}",
        tests=str(len(report.rows)),
        failures=str(len(bad)),
        errors="0",
        skipped="0",
        time=f"{sum(row.seconds.get('run', 0.0) for row in report.rows):.3f}",
    )
    said: dict[int, list[str]] = {}
    for number in numbers(report, kinds):
        part = f" {number.of}" if number.of else ""
        said.setdefault(id(number.row), []).append(f"{number.measure}{part} = {number.value:.6g}")
    for row in report.rows:
        name = row_name(row.identity, with_kind=False)
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname=printable(row.key.kind),
            name=printable(name),
            time=f"{row.seconds.get('run', 0.0):.3f}",
        )
        if row in bad:
            ElementTree.SubElement(case, "failure", message=printable(failure(row).strip()), type=row.outcome)
        elif id(row) in said:
            ElementTree.SubElement(case, "system-out").text = "\n".join(said[id(row)])
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, "unicode") + "\n"


def table(report: Report, kinds: Kinds) -> str:
    """A line for each metric and law, with the columns of the Parquet table; names first."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(lines(report.rows))
    return file.getvalue()


def _json(document: Any) -> str:
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


TEXTS: Mapping[str, Callable[[Report, Kinds], str]] = {
    "bencher": bencher,
    "github-action-benchmark": github_action_benchmark,
    "junit": junit,
    "csv": table,
}
"""What is one file.  asv alone takes a folder."""
