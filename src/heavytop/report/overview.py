"""The summary of a report with more rows than anybody reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from math import inf

from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.measure.digits import digits_kept, digits_text
from heavytop.records import Metric, Row
from heavytop.report.document import Cell, Value
from heavytop.report.kind import Kinds
from heavytop.report.store import AnyReport
from heavytop.report.text import failed, head, table, title

MOST_LISTED = 5000
"""More rows than these nobody reads: `show` sums them up too."""


def worst(report: AnyReport, rows: Iterable[Row], hint: str) -> RenderableType:
    """The largest error of each metric with its rounding noise, the fewest digits right, and how many rows ended how,
    by measure and format; then the hint.
    """
    counts: dict[tuple[str, str], Counter[str]] = {}
    largest: dict[tuple[str, str], dict[str, tuple[float, Metric, str]]] = {}
    fewest: dict[tuple[str, str], tuple[float, str]] = {}
    words: dict[tuple[str, str, str], Counter[str]] = {}
    for row in rows:
        group = row.key.kind, row.precision
        counts.setdefault(group, Counter())[row.outcome] += 1
        found = largest.setdefault(group, {})
        if (kept := digits_kept(row)) is not None:
            fewest[group] = min(fewest.get(group, (inf, "")), (kept, row.case))
        for name, metric in row.metrics.items():
            if metric.kind != "error":
                continue
            if metric.log10 is None and metric.value != "0":
                words.setdefault((*group, name), Counter())[metric.value] += 1
            size = inf if metric.value == "nan" else -inf if metric.log10 is None else metric.log10
            if name not in found or size > found[name][0]:
                found[name] = size, metric, row.case
    parts: list[RenderableType] = [head(report, sum(count.total() for count in counts.values()))]
    for group, found in largest.items():
        outcomes = ", ".join(f"{number} {outcome}" for outcome, number in sorted(counts[group].items()))
        parts += [
            Text(),
            title(f"{' in '.join(filter(None, group))}: {outcomes}; the largest errors over their samples"),
        ]
        lines: list[list[Cell]] = [
            [
                name,
                Value(metric, noise=True),
                case,
                ", ".join(f"{n} {word}" for word, n in words.get((*group, name), {}).items()),
            ]
            for name, (_, metric, case) in found.items()
        ]
        if group in fewest:
            lines.append(["digits right, fewest", digits_text(fewest[group][0]), fewest[group][1], ""])
        parts.append(table(["metric", "largest", "in", "not available"], lines))
    return Group(*parts, Text(), Text(hint))


def all_good(rows: Iterable[Row], kinds: Kinds) -> bool:
    """Whether no row has :func:`failed`."""
    return not any(failed(row, kinds) for row in rows)
