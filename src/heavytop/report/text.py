"""A report in words and tables, for people.  Works on records alone; returns what rich can print."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from textwrap import wrap
from typing import Any

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from heavytop.errors import InputError
from heavytop.measure.digits import digits_kept, digits_text
from heavytop.measure.drift import DRIFT
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.precision import decimal_text, exact
from heavytop.records import FAILED, OUT_OF_TIME, UNMEASURED, UNSUPPORTED, Metric, Report, Row
from heavytop.report.kind import Kinds, kind_of
from heavytop.report.names import computed_by
from heavytop.report.printable import printable
from heavytop.report.store import AnyReport


def short(value: str, digits: int = 3) -> str:
    """A metric's text with few digits; words stay as they are."""
    try:
        number = exact(value)
    except InputError:
        return value
    if number == 0:
        return "0"
    if Fraction(1, 1000) <= abs(number) < 10**5:
        return f"{float(number):.{digits + 2}g}"
    text = f"{Decimal(decimal_text(number, digits)):.{digits - 1}E}"
    mantissa, _, exponent = text.partition("E")
    if exact(text) == number:  # a time such as 10^6 has no more digits
        mantissa = mantissa.rstrip("0").removesuffix(".")
    return f"{mantissa}e{int(exponent)}"


def with_noise(metric: Metric | None, digits: int = 3) -> str:
    """The value of a metric and, where it was measured, the half-width of its rounding noise in decades."""
    if metric is None:
        return "-"
    return short(metric.value, digits) + (f" ± {metric.band:.2f}" if metric.band else "")


def largest_over(rows: Iterable[Row]) -> str:
    """``largest over N samples``, with the least and the most where rows have different numbers of them."""
    counts = sorted({row.samples for row in rows if row.samples})
    if not counts:
        return "largest over the samples"
    return f"largest over {counts[0]}{f' to {counts[-1]}' if len(counts) > 1 else ''} samples"


DIGITS = "Digits right: −log10 of the largest |error|/max(1, |true value|) of a component of Ω or γ."
NOISE = "± is the rounding noise in decades: half the interval that holds 95 % of it."


def summary(report: Report, kinds: Kinds) -> RenderableType:
    """What every kind of measurement says of its rows, then what did not reach its horizon."""
    measured: dict[str, list[Row]] = {}
    for row in report.rows:
        if row.outcome not in UNMEASURED:
            measured.setdefault(row.key.kind, []).append(row)
    parts: list[RenderableType] = [head(report, len(report.rows))]
    for name, kind in kinds.items():
        if rows := measured.pop(name, None):
            parts += [Text(), *kind.summary(rows)]
    for name, rows in measured.items():
        said = f"Measure {name or 'without a name'}: {len(rows)} rows, which the page lists (--html FILE)"
        parts += [Text(), Text(printable(said))]
    if said := unsupported(report.rows):
        parts += [Text(), Text(printable(said))]
    if failures := [row for row in report.rows if failed(row, kinds)]:
        parts += [Text(), Text("Runs that did not reach their horizon", style="bold red")]
        parts += [Text(printable(failure(row))) for row in failures]
    return Group(*parts)


def failed(row: Row, kinds: Kinds) -> bool:
    """Whether a run did not reach its horizon; that one gives up may be what its rows are there to show.

    What an integrator declares that it cannot do is no failure.
    """
    if row.outcome == UNSUPPORTED:
        return False
    return row.outcome in UNMEASURED or (row.outcome != "success" and not kind_of(row, kinds).may_give_up)


def unsupported(rows: Iterable[Row]) -> str:
    """What integrators declare that they cannot do, in one line; empty where there is no such row."""
    lacking = [row for row in rows if row.outcome == UNSUPPORTED]
    why = dict.fromkeys((row.reference.reason or "").removesuffix(".") for row in lacking)
    count = f"{len(lacking)} row{'s' if len(lacking) > 1 else ''}"
    return f"Not supported, and not measured: {count}; {'; '.join(why)}." if lacking else ""


def failure(row: Row) -> str:
    """A run that did not reach its horizon, and why."""
    if row.outcome in (FAILED, OUT_OF_TIME):
        return f"  {row.reference.reason} in {row.precision}"
    if row.outcome in UNMEASURED:
        return f"  {row.key.kind} of {row.case}, {row.integrator} in {row.precision}: {row.outcome}, {row.against}"
    return f"  {row.case} in {row.precision}: {row.outcome} at t = {row.time_reached} of {row.horizon}"


def head(report: AnyReport, rows: int) -> Text:
    """The plan, how many measurements, and with which versions."""
    packages = report.environment.get("packages", {})
    versions = ", ".join(f"{n} {packages[n]}" for n in ("heavytop", "heyoka", "numpy", "python-flint") if n in packages)
    return Text(printable(f"Plan {report.plan.get('name', '?')}: {rows} measurements ({versions})"))


def title(text: str) -> Text:
    """The first line of a section."""
    return Text(text, style="bold")


@dataclass(slots=True)
class Lines:
    """A table without lines, as wide as where it is printed; where its words do not fit beside each other, a block for
    each row: its first cell, and then every other one behind the name of its column.  No word is broken.

    words: how many first columns are words; the others are numbers.  left: the last column is words too.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[Text]]
    words: int = 1
    left: bool = False

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """A table, or blocks."""
        cells = [[Text(column) for column in self.columns], *self.rows]
        widths = [max(cell_len(word) for row in cells for word in [*row[i].plain.split(" "), ""]) for i in self._all]
        if sum(widths) + 2 * len(widths) > options.max_width:
            yield from self._blocks(options.max_width)
            return
        made = Table(box=None, pad_edge=True, header_style="dim")
        for index, (column, width) in enumerate(zip(self.columns, widths, strict=True)):
            wide = max(row[index].cell_len for row in cells)
            made.add_column(
                Text(column),
                justify="left" if self._is_words(index) else "right",
                no_wrap=wide == width,
                min_width=width,
            )
        for row in self.rows:
            made.add_row(*row)
        yield made

    @property
    def _all(self) -> range:
        return range(len(self.columns))

    def _is_words(self, index: int) -> bool:
        return index < self.words or (self.left and index == len(self.columns) - 1)

    def _blocks(self, width: int) -> Iterator[Text]:
        for first, *rest in self.rows:
            yield first
            pairs = zip(self.columns[1:], rest, strict=True)
            said = ";  ".join(f"{column} {cell.plain}".strip() for column, cell in pairs if cell.plain.strip())
            yield from map(Text, wrap(said, width - 4, initial_indent="    ", subsequent_indent="    ", **_WHOLE_WORDS))


_WHOLE_WORDS: Any = {"break_long_words": False, "break_on_hyphens": False}


def table(columns: Sequence[str], rows: Iterable[Sequence[str | Text]], words: int = 1, left: bool = False) -> Lines:
    """A table without lines; its first ``words`` columns are words, the others are numbers; ``left``: not the last."""
    cells = [[cell if isinstance(cell, Text) else Text(printable(cell)) for cell in row] for row in rows]
    return Lines([printable(column) for column in columns], cells, words, left)


def both(lines: Iterable[tuple[Row, Sequence[str]]]) -> list[list[str]]:
    """The cells of each row behind its case; what is the same forward and backward once, and then without direction."""
    found: dict[tuple[str, ...], list[Row]] = {}
    for row, cells in lines:
        found.setdefault((row.key.case, computed_by(row), *cells), []).append(row)
    return [[(case if len(rows) > 1 else rows[0].case) + name, *cells] for (case, name, *cells), rows in found.items()]


def motions(rows: Sequence[Row]) -> Lines:
    """Digits right, distance from the true motion and drift of every integral, a line a row."""
    lines = []
    for row in rows:
        cells = "  ".join(f"{name} {with_noise(metric, 2)}" for name, metric in drifts(row))
        errors = (row.metric(SOLUTION_ERROR, part, "max") for part in ("along", "across"))
        error, across = ("no reference" if each is None else with_noise(each, 2) for each in errors)
        kept = digits_kept(row)
        digits = "-" if kept is None else digits_text(kept)
        if row.reference.until:
            digits += f" from {row.reference.until}"
        lines.append(
            [
                row.case + computed_by(row),
                row.precision,
                row.horizon,
                str(row.steps),
                row.outcome,
                digits,
                error,
                across,
                cells,
            ]
        )
    columns = [
        "case",
        "format",
        "T",
        "steps",
        "outcome",
        "digits right",
        "error along",
        "across",
        "drift of each integral",
    ]
    return table(columns, lines, left=True)


def drifts(row: Row) -> list[tuple[str, Metric]]:
    """The largest drift of each first integral."""
    found = [(metric.quantity, metric) for metric in row.metrics.values() if metric.quantity]
    return [(q.component, metric) for q, metric in found if (q.name, q.statistic) == (DRIFT, "max")]
