"""A report in the formats of tools that track numbers from commit to commit.

Smaller is better for every number: log10 of the relative error (digits right with a minus sign) and of the largest
drift of each first integral, none below the eps of its format; exponents of growth laws; seconds.  Rows without a
number (a row that failed, an error that is NaN) are left out: :data:`LOST` counts them.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple
from xml.etree import ElementTree

from heavytop.display import plural, printable
from heavytop.errors import quoted, refusal
from heavytop.measure.scalar import digits_right
from heavytop.records import UNRESOLVED_SECONDS, UNSUPPORTED, Quantity, Report, Row
from heavytop.report.compare.compare import Differences
from heavytop.report.compare.findings import folded, line, statistics
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.document import (
    Block,
    Card,
    Cell,
    Headline,
    In,
    Note,
    Table,
    Value,
    Word,
    cell_text,
    row_name,
)
from heavytop.report.document.kind import Kinds, document, headlines, kind_of
from heavytop.report.render import FORMATS
from heavytop.report.render.comparison import headline, metric_name, values
from heavytop.report.render.text import drifts, failed
from heavytop.report.store.parquet import COLUMNS, lines
from heavytop.version import version

LOST = "rows without a number"
_TOTAL = "heavytop"
_LARGEST = "error_max"
"""Metric exported for a row without digits right, such as one of a work-precision curve."""


class Measure(NamedTuple):
    """A number of a row; smaller is better.  low, high: its 95 % interval, where it has one."""

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None

    @property
    def slug(self) -> str:
        """The name in lower case, joined by hyphens."""
        return "-".join("".join(c if c.isalnum() else " " for c in self.name.lower()).split())


def measures(row: Row) -> Iterator[Measure]:
    """The numbers of a row."""
    if row.outcome != "success":
        return
    eps = (1 - row.bits) * math.log10(2) if row.bits else None
    if (right := digits_right(row)) is not None:
        yield Measure("log10 of the error", round(0.0 - right, 6), "decades")
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
        seconds = max(row.seconds.get("least", row.seconds["run"]), row.seconds.get(UNRESOLVED_SECONDS, 0.0))
        yield Measure("seconds", seconds, "s")


def export(report: Report, to: str, kinds: Kinds) -> str:
    """The text of the file in the format ``to``; raises InputError for an unknown format."""
    if to not in FORMATS:
        raise refusal("The format of an export", "known", quoted(to), f"Use {', '.join(FORMATS)}.")
    return str(resolve_name(FORMATS[to])(report, kinds))


def _named(report: Report, kinds: Kinds) -> Iterator[tuple[str, Row | None, list[Measure]]]:
    """Name, row and numbers of each row, then the number of rows without a number."""
    lost = 0
    for row in report.rows:
        quantities = list(measures(row))
        lost += _is_lost(row, kinds)
        yield printable(row_name(row.identity)), row, quantities
    yield _TOTAL, None, [Measure(LOST, float(lost), "rows")]


def _is_lost(row: Row, kinds: Kinds) -> bool:
    """Whether a row failed, or has a non-finite error in a kind that may not overflow."""
    overflowed = row.outcome == "success" and not row.finite and not kind_of(row, kinds).may_overflow
    return failed(row, kinds) or overflowed


def bencher(report: Report, kinds: Kinds) -> str:
    """Bencher Metric Format: benchmark -> measure -> value with its limits."""
    benchmarks: dict[str, dict[str, dict[str, float]]] = {}
    for name, _, numbers in _named(report, kinds):
        for number in numbers:
            limits = {"lower_value": number.low, "upper_value": number.high}
            entry = {"value": number.value} | {key: limit for key, limit in limits.items() if limit is not None}
            benchmarks.setdefault(name, {})[number.slug] = entry
    return _json(benchmarks)


def github_action_benchmark(report: Report, kinds: Kinds) -> str:
    """`customSmallerIsBetter` of github-action-benchmark: a list of name, unit, value."""
    entries = []
    for name, row, numbers in _named(report, kinds):
        for number in numbers:
            entry: dict[str, Any] = {"name": f"{name}: {number.name}", "unit": number.unit, "value": number.value}
            if number.low is not None and number.high is not None:
                entry["range"] = f"{number.low:.3f} to {number.high:.3f}"
            entries.append(entry | ({"extra": printable(row.against)} if row is not None else {}))
    return _json(entries)


def asv(report: Report, kinds: Kinds) -> str:
    """The results file of airspeed velocity, version 2: `results/MACHINE/COMMIT-ENVIRONMENT.json`."""
    environment = report.environment
    machine = {
        "machine": str(environment.get("machine", "unknown")),
        "os": str(environment.get("system", "unknown")),
        "cpu": str(environment.get("processor", "unknown")),
    }
    results = {}
    for name, row, numbers in _named(report, kinds):
        for number in numbers:
            results[f"{name}: {number.name}"] = [[number.value], [], version()]
        if row is not None and not numbers and _is_lost(row, kinds):
            results[f"{name}: log10 of the error"] = [[None], [], version()]
    return _json(
        {
            "version": 2,
            "commit_hash": str(environment.get("commit")).removesuffix("-dirty"),
            "env_name": "heavytop",
            "date": 0,
            "params": machine | {"python": str(environment.get("python", "unknown"))},
            "python": str(environment.get("python", "unknown")),
            "requirements": {name: str(text) for name, text in environment.get("packages", {}).items()},
            "env_vars": {},
            "result_columns": ["result", "params", "version"],
            "results": results,
            "durations": {},
        }
    )


def junit(report: Report, kinds: Kinds) -> str:
    """JUnit XML with one test case per row: failed rows are errors, unsupported ones are skipped."""
    bad = sum(_is_lost(row, kinds) for row in report.rows)
    suite = _suite("heavytop", len(report.rows), 0, bad, sum(row.outcome == UNSUPPORTED for row in report.rows))
    for row in report.rows:
        name = printable(row_name(row.identity, with_kind=False))
        seconds = f"{row.seconds.get('run', 0.0):.6f}"
        case = ElementTree.SubElement(suite, "testcase", classname=row.key.kind, name=name, time=seconds)
        if row.outcome == UNSUPPORTED:
            ElementTree.SubElement(case, "skipped", message=printable(row.against))
        elif _is_lost(row, kinds):
            ElementTree.SubElement(case, "error", message=printable(row.against), type=row.outcome)
        output = [kind_of(row, kinds).line(row)] if row.metrics else []
        output += [f"{number.name}: {number.value:.6g} {number.unit}" for number in measures(row)]
        if text := "\n".join(filter(None, output)):
            ElementTree.SubElement(case, "system-out").text = printable(text)
    return _xml(suite)


def _suite(name: str, tests: int, failures: int, errors: int, skipped: int) -> ElementTree.Element:
    counts = {"tests": tests, "failures": failures, "errors": errors, "skipped": skipped, "time": 0}
    return ElementTree.Element("testsuite", {"name": name} | {key: str(count) for key, count in counts.items()})


def _xml(suite: ElementTree.Element) -> str:
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, "unicode") + "\n"


def metrics_csv(report: Report, kinds: Kinds) -> str:
    """A line for each metric and growth law, with the columns of `--parquet`."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(lines(report.rows))
    return buffer.getvalue()


def _json(document: object) -> str:
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


# A comparison as JUnit XML: one test case per metric, for the test pages of CI systems.


_FAILURE = {Verdict.WORSE}
_ERROR = {Verdict.MISSING, Verdict.INCOMPARABLE}


def comparison_junit(result: Differences) -> str:
    """Worse is a failure; missing and incomparable are errors; everything else passes."""
    failures, errors = (sum(result.tally.get(verdict, 0) for verdict in bad) for bad in (_FAILURE, _ERROR))
    suite = _suite("heavytop compare", len(result.findings), failures, errors, 0)
    properties = ElementTree.SubElement(suite, "properties")
    for name, old, new in result.environment:
        ElementTree.SubElement(properties, "property", name=printable(name), value=printable(f"{old} -> {new}"))
    for finding in result.findings:
        where = f"{finding.row.key.kind}.{row_name(finding.row, with_kind=False)}"
        name = metric_name(finding)
        case = ElementTree.SubElement(suite, "testcase", classname=printable(where), name=printable(name), time="0")
        message = f"{finding.verdict.value}: {finding.baseline or '-'} -> {finding.candidate or '-'}; {finding.reason}"
        if finding.verdict in _FAILURE | _ERROR:
            kind = "failure" if finding.verdict in _FAILURE else "error"
            ElementTree.SubElement(case, kind, message=printable(message), type=finding.verdict.value)
        elif finding.verdict is not Verdict.SAME:
            ElementTree.SubElement(case, "system-out").text = printable(message)
    return _xml(suite)


# A comparison for a pull request: GitHub-flavoured Markdown, short.


_MOST, _MOST_METRICS = 50, 100
"""Most rows, and most quantities, of the tables."""
_COMMENT = 60_000
"""Most characters: forges limit comments to 65,536."""
_LONGEST = 120


def comparison_markdown(result: Differences, page: Path | None = None) -> str:
    """Verdict and findings, a line per row with the worst first, differences of the environments, the page.

    Where the text is too long for a comment, quantities and then rows are left out, but never the findings.
    """
    head = ["### heavytop: " + headline(result), "", *(f"- {escaped(sentence)}" for sentence in result.sentences), ""]
    rows, metrics = (_rows(result), _metrics(result)) if result.rows else ([], [])
    end = []
    if result.environment:
        changes = _table(("", "baseline", "candidate"), result.environment[:_MOST], words=3)
        end += ["<details><summary>Inputs or environments differ</summary>", "", *changes, "", "</details>", ""]
    if page is not None:
        # no link: the file is not beside the comment
        end += [f"Both on the same axes: {escaped_cell(page.name)}.", ""]
    texts = ("\n".join(lines) for lines in ([*head, *rows, *metrics, *end], [*head, *rows, *end], head))
    return next((text for text in texts if len(text) <= _COMMENT), "\n".join(head))


def _rows(result: Differences) -> list[str]:
    cells = ((c.verdict.value, row_name(c.identity), line(c)) for c in result.rows[:_MOST])
    more = ["", f"and {len(result.rows) - _MOST} more."] if len(result.rows) > _MOST else []
    return [*_table(("verdict", "row", "what changed"), cells, words=3), *more, ""]


def _metrics(result: Differences) -> list[str]:
    """Changes of each row, with largest, rms and last value of a quantity in one line; collapsed."""
    columns = ("verdict", "row", "quantity", "baseline", "candidate", "why")
    changes = ((change, *quantity) for change in result.rows[:_MOST] for quantity in folded(change))
    cells = (
        (c.verdict.value, row_name(c.identity), statistics(c, name, group), *values(group[0]), group[0].reason)
        for c, name, group in changes
    )
    changed = list(cells)
    more = ["", f"and {len(changed) - _MOST_METRICS} more."] if len(changed) > _MOST_METRICS else []
    head = "<details><summary>Every quantity that changed</summary>"
    return [head, "", *_table(columns, changed[:_MOST_METRICS], 3, left=True), *more, "", "</details>", ""]


def _table(columns: Sequence[str], rows: Iterable[Iterable[str]], words: int, left: bool = False) -> list[str]:
    """A table; its first ``words`` columns are text, the others are numbers.  left: the last column is text too."""
    last = len(columns) - 1
    rule = ["---" if index < words or (left and index == last) else "---:" for index in range(len(columns))]
    head, *lines = (list(map(escaped_cell, row)) for row in (columns, *rows))
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *lines)]


def escaped_cell(text: str) -> str:
    """Text in a cell of a table, truncated where it is long."""
    text = " ".join(printable(text).split())
    return escaped(text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…")


def escaped(text: str) -> str:
    """Text escaped for Markdown, without line breaks."""
    return re.sub(r"([\\`*_{}\[\]<>|#~@&])", r"\\\1", " ".join(printable(text).split()))


# The document of a report as JSON, for programs, and as Markdown, for pull requests.


def to_json(report: Report, kinds: Kinds) -> dict[str, object]:
    """The blocks of each kind, without charts: a cell is text, or an object with its type."""
    blocks = document(report, kinds, In.FULL)
    kinds_blocks = [{"kind": name, "blocks": [_block(block) for block in blocks]} for name, blocks in blocks.items()]
    return {"plan": report.plan, "measurements": len(report.rows), "kinds": kinds_blocks}


def _block(block: Block) -> dict[str, object]:
    name = {"block": type(block).__name__.lower()}
    match block:
        case Headline() | Note():
            return name | {"verdict": block.word and block.word.text, "text": block.text}
        case Table():
            rows = [[_cell(cell) for cell in row] for row in block.rows]
            return name | {
                "title": block.title,
                "notes": list(block.notes),
                "columns": list(block.columns),
                "rows": rows,
            }
        case Card():
            inside: list[Block] = [*block.lines, *([block.table] if block.table else [])]
            return name | {"title": block.title, "note": block.note, "blocks": [_block(block) for block in inside]}
    raise TypeError(block)


def _cell(cell: Cell) -> Any:
    match cell:
        case Value():
            metric = cell.metric
            parts = None if metric is None else (metric.value, metric.log10, metric.band, metric.kind)
            return parts and dict(zip(("value", "log10", "band", "kind"), parts, strict=True))
        case Word():
            return {"verdict": cell.text}
        case Quantity():
            return {"quantity": cell.text}
    return cell


def to_markdown(report: Report, kinds: Kinds) -> str:
    """GitHub-flavoured Markdown: the headlines, then the notes, tables and cards of each kind."""
    kinds_blocks = document(report, kinds, In.FULL)
    plan = f"### Plan {escaped(report.plan.get('name', '?'))}: {plural(len(report.rows), 'measurement')}"
    lines = [plan, "", *(f"- {_sentence(headline)}" for headline in headlines(kinds_blocks, kinds)), ""]
    for blocks in kinds_blocks.values():
        lines += [line for block in blocks if not isinstance(block, Headline) for line in _markdown(block)]
    return "\n".join(lines) + "\n"


def _sentence(block: Headline | Note) -> str:
    return (f"**{block.word.text}** " if block.word else "") + escaped(block.text)


def _markdown(block: Block) -> Iterator[str]:
    match block:
        case Note():
            yield from (_sentence(block), "")
        case Card():
            yield from (f"#### {escaped(block.title)}", "", *(f"- {_sentence(line)}" for line in block.lines), "")
            if block.table:
                yield from _markdown(block.table)
        case Table():
            if block.title:
                yield from (f"#### {escaped(block.title)}", "")
            yield from (line for note in block.notes for line in (escaped(note), ""))
            yield from _table(block.columns, (map(cell_text, row) for row in block.rows), block.words)
            yield ""
