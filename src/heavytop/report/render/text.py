"""Sentences and tables of a report for a terminal, printed by rich."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from heavytop.display import plural, printable
from heavytop.measure.scalar import digits_kept, digits_text
from heavytop.measure.scorer import DRIFT
from heavytop.records import FAILED, NOT_ASKED, OUT_OF_TIME, UNMEASURED, UNSUPPORTED, Metric, Row
from heavytop.report.document.document import Cell, Value, Word, cell_text, computed_by, short
from heavytop.report.document.kind import Kinds, kind_of

if TYPE_CHECKING:
    from heavytop.report.store.store import AnyReport


def largest_over(rows: Iterable[Row]) -> str:
    """``largest over N samples``; a range where the numbers of samples differ."""
    counts = sorted({row.samples for row in rows if row.samples})
    if not counts:
        return "largest over the samples"
    return f"largest over {counts[0]}{f' to {counts[-1]}' if len(counts) > 1 else ''} samples"


DIGITS = "Digits right: −log10 of the largest |error|/max(1, |true value|) of a component of Ω or γ."
NOISE_BAND = "± is the rounding noise in decades: half its 95 % interval; none: below 0.01 or not measured."
COMPUTED = "lost a–b: all digits, between t = a and b; this and *: reference computed."


def failed(row: Row, kinds: Kinds) -> bool:
    """Whether a measurement failed; for some kinds an aborted run is a result.

    A request that the integrator declares unsupported is not a failure.
    """
    if row.outcome == UNSUPPORTED:
        return False
    return row.outcome in UNMEASURED or (row.outcome != "success" and not kind_of(row, kinds).may_end_early)


def unsupported(rows: Iterable[Row]) -> str:
    """Requests that integrators declare unsupported, in one line; empty without such a row."""
    matching = [row for row in rows if row.outcome == UNSUPPORTED]
    reasons = dict.fromkeys((row.reference.reason or "").removesuffix(".") for row in matching)
    return f"Not supported, and not measured: {plural(len(matching), 'row')}; {'; '.join(reasons)}." if matching else ""


def failure(row: Row) -> str:
    """How a failed measurement ended, and why."""
    if row.outcome in (FAILED, OUT_OF_TIME, NOT_ASKED):
        return f"  {row.key.kind}: {row.reference.reason} in {row.precision}"
    if row.outcome in UNMEASURED:
        return f"  {row.key.kind} of {row.case}, {row.integrator} in {row.precision}: {row.outcome}, {row.against}"
    reached, horizon = short(row.time_reached), short(row.horizon)
    return f"  {row.case} in {row.precision}: {row.outcome} at t = {reached} of {horizon}"


def head(report: AnyReport, rows: int) -> Text:
    """The plan, the number of measurements, and the versions of packages."""
    packages = report.environment.get("packages", {})
    versions = ", ".join(f"{n} {packages[n]}" for n in ("heavytop", "heyoka", "numpy", "python-flint") if n in packages)
    return Text(printable(f"Plan {report.plan.get('name', '?')}: {plural(rows, 'measurement')} ({versions})"))


WORD_STYLES = {"refuted": "bold red", "holds": "bold green"}
"""Colours of verdicts; others are yellow."""


def title(text: str) -> Text:
    """The first line of a section."""
    return Text(text, style="bold")


@dataclass(slots=True)
class Lines:
    """A table without rules, as wide as the console; where its words do not fit side by side, a block for each row
    below the name of the first column: the first cell, and then every other one after the name of its column.  No word
    is broken.

    words: the number of leading columns of text; the others are numbers.  left: the last column is text too.
    head: the heading of the first column.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[Cell | Text]]
    words: int = 1
    left: bool = False
    head: str = ""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """A table, or blocks."""
        first, *others = map(printable, self.columns)
        columns = [printable(self.head) or first, *others]
        rows = [[_styled(cell) for cell in row] for row in self.rows]
        cells = [columns, *([cell.plain for cell in row] for row in rows)]
        indices = range(len(columns))
        widths = [max(cell_len(word) for row in cells for word in _nobreak(row[i]).split(" ")) for i in indices]
        wides = [max(cell_len(row[index]) for row in cells) for index in indices]
        edge = not self.head
        room = options.max_width - sum(wide + 2 for wide in wides[1:]) - 2 * edge
        if sum(widths) + 2 * len(widths) > options.max_width or (self.head and room < widths[0]):
            yield from ([Text(columns[0], style="" if self.head else "dim")] if columns[0] else [])
            yield from _blocks(columns, rows, options.max_width)
            return
        if widths[0] + 2 <= room < wides[0]:
            wides[0] = room
        # the widest column is narrowed, down to its longest word
        while sum(wides) + 2 * (len(wides) - 1 + edge) > options.max_width:
            wides[max(range(len(wides)), key=lambda index: (wides[index] > widths[index], wides[index]))] -= 1
        table = Table(box=None, pad_edge=edge, header_style="dim")
        for index, (column, wide) in enumerate(zip(columns, wides, strict=True)):
            words = index < self.words or (self.left and index == len(columns) - 1)
            table.add_column(Text(column), justify="left" if words else "right", width=wide)
        indent = "  " if widths[0] + 2 <= wides[0] else ""  # of continued lines
        for row in rows:
            table.add_row(_wrapped_cell(row[0], wides[0], indent), *map(_wrapped_cell, row[1:], wides[1:]))
        yield table


def _nobreak(text: str) -> str:
    """The text with no-break spaces beside ±, and inside parts separated by two spaces."""
    return re.sub(r"(?<! ) (?! )" if "  " in text else r" (?=±)|(?<=±) ", "\u00a0", text)


def _wrapped_cell(cell: Text, width: int, indent: str = "") -> Text:
    """The cell wrapped into lines of at most that width."""
    if cell_len(cell.plain) <= width:
        return cell
    return Text("\n".join(wrapped(_nobreak(cell.plain), indent, "", width)).replace("\u00a0", " "), style=cell.style)


def _styled(cell: Cell | Text) -> Text:
    if isinstance(cell, Text):
        return cell
    style = WORD_STYLES.get(cell.text, "bold yellow") if isinstance(cell, Word) else ""
    return Text(printable(cell_text(cell)), style=style)


def _blocks(columns: Sequence[str], rows: Iterable[Sequence[Text]], width: int) -> Iterator[Text]:
    for first, *others in rows:
        yield first
        pairs = zip(columns[1:], others, strict=True)
        named_cells = ";  ".join(
            f"{column} {_nobreak(cell.plain)}".strip() for column, cell in pairs if cell.plain.strip()
        )
        yield from (Text(line.replace("\u00a0", " ")) for line in wrapped(named_cells, "    ", "    ", width - 4))


def wrapped(text: str, indent: str = "  ", first: str = "", width: int = 80) -> list[str]:
    """A sentence in lines of at most ``width`` columns, all but the first indented; no word is broken."""
    return wrap(text, width, initial_indent=first, subsequent_indent=indent, **_WHOLE_WORDS)


_WHOLE_WORDS: Any = {"break_long_words": False, "break_on_hyphens": False}


def both(lines: Iterable[tuple[Row, Sequence[Cell]]]) -> list[list[Cell]]:
    """The cells of each row after its case; equal lines forward and backward are one, without direction."""
    groups: dict[tuple[str, ...], tuple[list[Row], Sequence[Cell]]] = {}
    for row, cells in lines:
        same = row.key.case, computed_by(row), *map(cell_text, cells)
        groups.setdefault(same, ([], cells))[0].append(row)
    return [
        [(rows[0].key.case if len(rows) > 1 else rows[0].case) + computed_by(rows[0]), *cells]
        for rows, cells in groups.values()
    ]


def drifts(row: Row) -> list[tuple[str, Metric]]:
    """The largest drift of each first integral."""
    quantities = [(metric.quantity, metric) for metric in row.metrics.values() if metric.quantity]
    return [(q.component, metric) for q, metric in quantities if (q.name, q.statistic) == (DRIFT, "max")]


# The summary of a report with very many rows.


class Tally:
    """Counts of outcomes, and the fewest digits right with their case, by measure and format."""

    def __init__(self) -> None:
        self.ended: dict[tuple[str, str], Counter[str]] = {}
        self.fewest: dict[tuple[str, str], tuple[float, str]] = {}

    def take(self, row: Row) -> tuple[str, str]:
        """Count a row; returns its measure and format."""
        group = row.key.kind, row.precision
        self.ended.setdefault(group, Counter())[row.outcome] += 1
        if (kept := digits_kept(row)) is not None:
            self.fewest[group] = min(self.fewest.get(group, (inf, "")), (kept, row.case))
        return group

    def outcomes(self, group: tuple[str, str]) -> str:
        """``drift in double: 3 failed, 5 success``."""
        counts = ", ".join(f"{number} {outcome}" for outcome, number in sorted(self.ended[group].items()))
        return f"{' in '.join(filter(None, group))}: {counts}"


MOST_LISTED = 5000
"""Most rows that `show` lists; more are summarized."""


def worst(report: AnyReport, rows: Iterable[Row], hint: str) -> RenderableType:
    """The largest error of each metric with its rounding noise, the fewest digits right, and the number of rows with
    each outcome, by measure and format; then the hint.
    """
    tally = Tally()
    largest: dict[tuple[str, str], dict[str, tuple[float, Metric, str]]] = {}
    words: dict[tuple[str, str, str], Counter[str]] = {}
    for row in rows:
        group = tally.take(row)
        metrics = largest.setdefault(group, {})
        for name, metric in row.metrics.items():
            if metric.kind != "error":
                continue
            if metric.log10 is None and metric.value != "0":
                words.setdefault((*group, name), Counter())[metric.value] += 1
            size = inf if metric.value == "nan" else -inf if metric.log10 is None else metric.log10
            if name not in metrics or size > metrics[name][0]:
                metrics[name] = size, metric, row.case
    parts: list[RenderableType] = [head(report, sum(counts.total() for counts in tally.ended.values()))]
    for group, metrics in largest.items():
        parts += [Text(), title(f"{tally.outcomes(group)}; the largest errors over their samples")]
        lines: list[list[Cell]] = [
            [
                name,
                Value(metric, noise=True),
                case,
                ", ".join(f"{n} {word}" for word, n in words.get((*group, name), {}).items()),
            ]
            for name, (_, metric, case) in metrics.items()
        ]
        if group in tally.fewest:
            kept, case = tally.fewest[group]
            lines.append(["digits right, fewest", digits_text(kept), case, ""])
        parts.append(Lines(["metric", "largest", "in", "not available"], lines))
    return Group(*parts, Text(), Text(hint))


def all_good(rows: Iterable[Row], kinds: Kinds) -> bool:
    """Whether no row has :func:`failed`."""
    return not any(failed(row, kinds) for row in rows)
