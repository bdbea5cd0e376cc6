"""What a run says when it is over: at most 25 lines of 80 columns with its end; the rest is in `heavytop show`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import chain, islice
from math import inf
from textwrap import wrap

from heavytop.measure.digits import digits_kept, digits_text
from heavytop.records import UNMEASURED, Report, Row
from heavytop.report.kind import Kinds
from heavytop.report.printable import printable
from heavytop.report.section import clip, logarithm
from heavytop.report.text import failed, failure, unsupported

WIDTH = 80
LINES = 21
"""The command says in four more where the report is and what shows the rest."""
MOST_ROWS = 1000
"""More rows than these are counted, not listed."""
_CELL, _MOST_COLUMNS = 14, 4
_MOST_FAILURES = 3
_MOST_OF_ONE = 4
"""Lines of a failure."""
_FEWEST = 2


def brief(report: Report, rows: Iterable[Row], kinds: Kinds) -> str:
    """The lines for ``rows``, which may be a stream of any length: none is held but the first 1,000."""
    stream = iter(rows)
    first = list(islice(stream, MOST_ROWS + 1))
    failures: list[str] = []
    number = bad = 0

    def seen(given: Iterable[Row]) -> Iterable[Row]:
        nonlocal number, bad
        for row in given:
            number += 1
            if failed(row, kinds):
                bad += 1
                if len(failures) < _MOST_FAILURES:
                    failures.append(failure(row).strip())
            yield row

    if len(first) <= MOST_ROWS:
        held = list(seen(first))
        measured = [row for row in held if row.outcome not in UNMEASURED]
        parts = [kind.brief([row for row in measured if row.key.kind == name]) for name, kind in kinds.items()]
        parts += [wrapped(said)[:_MOST_OF_ONE] for said in [unsupported(held)] if said]
    else:
        parts = [_counted(seen(chain(first, stream)))]
    head = f"Plan {report.plan.get('name', '?')}: {number} measurements, "
    head += f"{bad} did not reach their horizon:" if bad else "all finished."
    if bad > len(failures):
        failures[-1:] = [f"and {bad - len(failures) + 1} more"]
    lines = [head, *(line for each in failures for line in wrapped(f"  {each}", "    ")[:_MOST_OF_ONE])]
    return "\n".join(_cut(printable(line)) for line in [*lines, *fitted(parts, LINES - len(lines))])


def _cut(line: str) -> str:
    """A number that is cut says so."""
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…"


def fitted(parts: Sequence[Sequence[str]], most: int) -> list[str]:
    """The lines of all parts; where they are more than ``most``, the longest parts are cut in the middle, which say by
    how much: the last line of a table is its finest setting.
    """
    sizes = [len(part) for part in parts]
    while sum(sizes) > most and max(sizes) > _FEWEST:
        sizes[sizes.index(max(sizes))] -= 1
    found: list[str] = []
    for part, size in zip(parts, sizes, strict=True):
        found += part if size == len(part) else _without_middle(part, size)
    return found[:most]


def _without_middle(part: Sequence[str], size: int) -> list[str]:
    """``size`` lines of a longer part, at least two: its first ones, how many are left out, and its last one."""
    last = size > _FEWEST
    left_out = len(part) - size + 1
    lines = f"  and {left_out} {'line' if left_out == 1 else 'lines'} more"
    return [*part[: size - 1 - last], lines, *(part[-1:] if last else [])]


def wrapped(text: str, indent: str = "  ") -> list[str]:
    """A sentence in lines of 80 columns, all but the first indented."""
    return wrap(text, WIDTH, subsequent_indent=indent, break_on_hyphens=False)


def named(rows: Sequence[Row]) -> Callable[[Row], str]:
    """What a row is called among these: its case, and its integrator where they have several."""
    several = len({row.key.subject.name for row in rows}) > 1
    return lambda row: f"{row.key.case}, {row.key.subject.name}" if several else row.key.case


def digits_lines(rows: Sequence[Row], title: str) -> list[str]:
    """Digits right at every sample, each with its time: a line a motion, a column a format, or an integrator where all
    are in one format.
    """
    known = [(row, kept) for row in rows if (kept := digits_kept(row)) is not None]
    formats = [name for _, name in sorted({(row.bits, row.precision) for row, _ in known})]
    names, columns = named([row for row, _ in known]), formats[:_MOST_COLUMNS]
    if len(formats) == 1:
        columns = list(dict.fromkeys(row.key.subject.name for row, _ in known))[:_MOST_COLUMNS]
    table: dict[str, dict[str, tuple[float, str]]] = {}
    for row, kept in known:
        name, column = names(row), row.precision
        if len(formats) == 1:
            name, column = row.key.case, row.key.subject.name
        lost = row.reference.until
        end = row.horizon if row.outcome == "success" else row.time_reached
        until = logarithm((lost or end).removeprefix("-"))
        cell = f"{digits_text(kept)} {'from' if lost else 'to'} {'0' if until is None else _until(until)}"
        cells = table.setdefault(name, {})
        # of two horizons the longer
        cells[column] = max(cells.get(column, (-inf, "")), (-inf if until is None else until, cell))
    if not table:
        return []
    wide = min(40, WIDTH - _CELL * len(columns))
    lines = [f"{title:{wide}}" + "".join(f"{clip(name, _CELL - 1):>{_CELL}}" for name in columns)]
    for name, cells in table.items():
        found = "".join(f"{cells[each][1] if each in cells else '-':>{_CELL}}" for each in columns)
        lines.append(f"  {clip(name, wide - 2):{wide - 2}}{found}")
    return lines


def _until(logarithm: float) -> str:
    """A time given by its logarithm: 50, 1e4, 2e6."""
    exponent = math.floor(logarithm + 1e-9)
    return f"{10**logarithm:.3g}" if exponent < 3 else f"{10 ** (logarithm - exponent):.2g}e{exponent}"


def _counted(rows: Iterable[Row]) -> list[str]:
    """How rows of each kind and format ended, and the fewest digits."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    fewest: dict[tuple[str, str], tuple[float, str]] = {}
    for row in rows:
        group = row.key.kind, row.precision
        counts.setdefault(group, Counter())[row.outcome] += 1
        if (kept := digits_kept(row)) is not None:
            fewest[group] = min(fewest.get(group, (inf, "")), (kept, row.case))
    lines = []
    for group, outcomes in counts.items():
        line = f"{' in '.join(group)}: " + ", ".join(f"{n} {outcome}" for outcome, n in sorted(outcomes.items()))
        if group in fewest:
            kept, case = fewest[group]
            line += f"; fewest digits right {digits_text(kept)} ({case})"
        lines += wrapped(line)
    return lines
