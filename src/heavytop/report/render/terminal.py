"""A report on a terminal: in full, and as the summary at the end of a run, at most 25 lines of 80 columns."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from itertools import chain, islice

from msgspec.structs import replace
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.text import Text

from heavytop.display import plural, printable
from heavytop.measure.scalar import digits_text
from heavytop.measure.scorer import DRIFT, SOLUTION_ERROR
from heavytop.records import HEYOKA, MULTIWORD, UNMEASURED, UNSUPPORTED, Quantity, Report, Row, Series
from heavytop.report.compare.verdicts import size
from heavytop.report.document.document import Block, Card, Chart, Headline, In, Note, Table, Word, points, short
from heavytop.report.document.kind import Kinds, document, headlines
from heavytop.report.render.text import WORD_STYLES, Lines, Tally, failed, failure, head, title, unsupported, wrapped

WIDTH = 80
LINES = 21
"""The command prints four more: where the report is, and the commands that show all."""
MOST_ROWS = 1000
"""Most rows listed; more are only counted."""
_MOST_FAILURES = 3
_MOST_OF_ONE = 4
"""Most lines of one failure."""
_FEWEST = 2


_STYLES = {"soft": "dim", "big": "bold"}
"""Styles of lines."""


def summary(report: Report, kinds: Kinds) -> RenderableType:
    """The summary of the rows of every kind, then the failed rows."""
    blocks_by_kind = document(report, kinds, In.FULL)
    parts: list[RenderableType] = [head(report, len(report.rows))]
    parts += [_Sentence(headline.text, headline.word) for headline in headlines(blocks_by_kind, kinds)]
    for blocks in blocks_by_kind.values():
        parts += [Text(), *_shown([block for block in blocks if not isinstance(block, Headline)])]
    others = Counter(row.key.kind for row in report.rows if row.outcome not in UNMEASURED and row.key.kind not in kinds)
    unlisted = [
        f"Measure {name or 'without a name'}: {count} rows; the page lists them (--html FILE)"
        for name, count in others.items()
    ]
    for sentence in filter(None, [*unlisted, unsupported(report.rows)]):
        parts += [Text(), Text(printable(sentence))]
    if failures := [row for row in report.rows if failed(row, kinds)]:
        parts += [Text(), Text("Failed measurements", style="bold red")]
        parts += [Text(printable(failure(row))) for row in failures]
    return Group(*parts)


class _Sentence:
    """A sentence wrapped to the console, its verdict in colour; all lines but the first are indented more."""

    def __init__(self, text: str, word: Word | None = None, style: str = "", indent: str = "") -> None:
        self._text, self._word, self._style, self._indent = text, word, style, indent

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        word = "" if self._word is None else self._word.text
        sentence = printable(f"{word}: {self._text}" if word else self._text)
        lines = wrapped(sentence, self._indent + "  ", self._indent, options.max_width)
        for number, line in enumerate(lines):
            shown_line = Text(line, style=_STYLES.get(self._style, ""))
            if word and not number:
                begin = len(self._indent)
                shown_line.stylize(WORD_STYLES.get(word, "bold yellow"), begin, begin + len(word))
            yield shown_line


def _shown(blocks: Iterable[Block], brief: bool = False) -> Iterator[RenderableType]:
    """The blocks of one kind; in a brief summary the title of a table heads its first column."""
    indent = "" if brief else "  "
    for number, block in enumerate(blocks):
        if isinstance(block, Table | Card) and number and not brief:
            yield Text()
        match block:
            case Note() | Headline():
                yield _Sentence(block.text, block.word, getattr(block, "style", ""), indent)
            case Card():
                yield title(block.title)
                yield from (_Sentence(line.text, line.word, line.style, indent) for line in block.lines)
            case Table():
                if block.title and not brief:
                    yield title(block.title)
                yield from (_Sentence(note, indent=indent) for note in block.notes)
                yield Lines(block.columns, block.rows, block.words, block.left, block.title if brief else "")
            case Chart():
                pass


def _lines(parts: Iterable[RenderableType]) -> list[str]:
    """The lines on a terminal of 80 columns, without colours."""
    console = Console(width=WIDTH, file=StringIO(), color_system=None, force_terminal=False, legacy_windows=False)
    console.print(Group(*parts), highlight=False, markup=False)
    assert isinstance(console.file, StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def brief(report: Report, rows: Iterable[Row], kinds: Kinds) -> str:
    """The summary of ``rows``, a stream of any length of which at most the first 1,000 are held."""
    stream = iter(rows)
    first = list(islice(stream, MOST_ROWS + 1))
    failures: list[str] = []
    answers: list[Block] = []
    number = bad = aborted = lacking = 0

    def counted(rows: Iterable[Row]) -> Iterable[Row]:
        nonlocal number, bad, aborted, lacking
        for row in rows:
            number += 1
            if failed(row, kinds):
                bad += 1
                if len(failures) < _MOST_FAILURES:
                    failures.append(failure(row).strip())
            elif row.outcome == UNSUPPORTED:
                lacking += 1
            elif row.outcome != "success":
                aborted += 1
            yield row

    if len(first) <= MOST_ROWS:
        held = list(counted(first))
        blocks, full = (document(replace(report, rows=held), kinds, shown) for shown in (In.SHORT, In.FULL))
        answers += headlines(blocks, kinds) or headlines(full, kinds)[:1]
        others = ([block for block in blocks if block not in answers] for blocks in blocks.values())
        parts = [_lines(_shown(blocks, brief=True)) for blocks in (answers, *others)]
        parts += [wrapped(sentence)[:_MOST_OF_ONE] for sentence in [unsupported(held)] if sentence]
    else:
        parts = [_counted(counted(chain(first, stream)))]
    head = f"Plan {report.plan.get('name', '?')}: {plural(number, 'measurement')}, "
    ended = f"{number - lacking} finished, {lacking} not supported." if lacking else "all finished."
    head += f"{bad} failed:" if bad else f"{aborted} aborted." if aborted else ended
    if bad > len(failures):
        failures[-1:] = [f"and {bad - len(failures) + 1} more"]
    lines = [head, *(line for failure in failures for line in wrapped(f"  {failure}", "    ")[:_MOST_OF_ONE])]
    if answers and not bad:  # the results come first, unless something failed
        parts.insert(1, [lines.pop()])
    shown = map(printable, [*lines, *fitted(parts, LINES - len(lines))])
    return "\n".join(line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…" for line in shown)


def fitted(parts: Sequence[Sequence[str]], most: int) -> list[str]:
    """The lines of all parts; where there are more than ``most``, the longest parts lose lines in the middle, which
    they count: the last line of a table is its finest setting.
    """
    sizes = [len(part) for part in parts]
    while sum(sizes) > most and max(sizes) > _FEWEST:
        sizes[sizes.index(max(sizes))] -= 1
    words: list[str] = []
    for part, length in zip(parts, sizes, strict=True):
        words += part if length == len(part) else _without_middle(part, length)
    return words[:most]


def _without_middle(part: Sequence[str], size: int) -> list[str]:
    """``size`` lines of a longer part, at least two: its first ones, the number left out, and its last one."""
    last = size > _FEWEST
    left_out = len(part) - size + 1
    lines = f"  and {left_out} {'line' if left_out == 1 else 'lines'} more"
    return [*part[: size - 1 - last], lines, *(part[-1:] if last else [])]


def _counted(rows: Iterable[Row]) -> list[str]:
    """The outcomes of the rows of each kind and format, and the fewest digits."""
    tally = Tally()
    for row in rows:
        tally.take(row)
    lines = []
    for group in tally.ended:
        line = tally.outcomes(group)
        if group in tally.fewest:
            kept, case = tally.fewest[group]
            line += f"; fewest digits right {digits_text(kept)} ({case})"
        lines += wrapped(line)
    return lines


# Growth laws of drift and error, for the summary at the end of a run.


_BUILT_IN = (HEYOKA, MULTIWORD)
_MEANS = {
    "t^0.5": "less than accumulated rounding noise",
    "t": "a constant frequency error, from truncation or a wrong coefficient",
    "t^1.5": "rounding noise alone, the smallest possible",
    "t^2": "every step has the same error and a first integral drifts; a smaller step or tolerance helps",
    "exponential": "the motion amplifies every error",
}
"""Laws of the error along the flow."""
_WIDTHS = {"integrals": 16, "along": 12, "across": 12}
"""Columns of the summary, and their widths in characters."""
_COLUMNS = "", "integrals", "error along", "across"
_FAR_LARGER = 2.0
"""Decades."""


def laws_in_short(rows: Sequence[Row]) -> list[Block]:
    """The laws, with all first integrals in one column; formats and motions with equal laws share a line.  Then the
    meaning of those of third-party integrators.

    The laws of a variant, such as a planted fault, are united for all motions.
    """
    united: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        united.setdefault(_law_group(row), []).append(row)
    formats: dict[tuple[str, str, str, tuple[str, ...]], list[str]] = {}
    for row in rows:
        name = "" if row.key.subject.name == HEYOKA else row.key.subject.name
        key = (name, row.key.subject.variant, row.key.case, _growths(united[_law_group(row)]))
        formats.setdefault(key, []).append(row.precision)
    cases: dict[tuple[str, ...], list[str]] = {}
    for (name, variant, case, growths), precisions in formats.items():
        runs = " ".join(part for part in (name, ", ".join(precisions), variant) if part)
        cases.setdefault((runs, *growths), []).append(case)
    cells = [[f"{runs}: {', '.join(motions)}", *meanings] for (runs, *meanings), motions in cases.items()]
    blocks: list[Block] = [Table("Grows like", _COLUMNS, cells, words=len(_COLUMNS), shown=In.SHORT)]
    others = [row for row in rows if row.key.subject.name not in _BUILT_IN]
    ours = {(row.key.case, row.precision): row for row in rows if row.key.subject.name == HEYOKA}
    meanings = (_meaning(row) + _larger(row, ours.get((row.key.case, row.precision), row)) for row in others)
    return [*blocks, *(Note(sentence, shown=In.SHORT) for sentence in meanings)]


def _law_group(row: Row) -> tuple[str, ...]:
    """The group of rows whose laws are united: all of a variant, else one row."""
    subject = row.key.subject
    return subject.name, subject.variant, row.precision, "" if subject.variant else row.key.case


def _growths(rows: Sequence[Row]) -> tuple[str, ...]:
    """The classes of the laws of the first integrals, along and across the flow; what is exactly 0 has none."""
    laws: dict[str, dict[str, None]] = {}
    for law in (law for row in rows for law in row.laws.values()):
        quantity = law.quantity or Quantity("")
        column = "integrals" if quantity.name == DRIFT else quantity.component
        if column in _WIDTHS and (law.growth, law.exponent) != ("bounded", None):
            laws.setdefault(column, {})[law.growth] = None
    return tuple(_law_names(laws.get(column, {}), width) for column, width in _WIDTHS.items())


def _meaning(row: Row) -> str:
    """The meaning of the law of a third-party integrator."""
    name = Quantity(SOLUTION_ERROR, "along").text
    law = row.laws.get(name)
    growth = "unresolved" if law is None else law.growth
    fitted = law is not None and law.exponent is not None
    no_law = "follows no single law" if fitted else "shows no law over three decades of t"
    grows = {
        "unresolved": f"{no_law}{_recent_power(row.series.get(name))}",
        "bounded": "is bounded",
        "exponential": "grows exponentially",
    }.get(growth, f"grows like {growth}")
    means = f": {_MEANS[growth]}" if growth in _MEANS else ""
    return f"{row.key.case}: the error of {row.key.subject.name} along the flow {grows}{means}."


def _larger(row: Row, ours: Row) -> str:
    """A remark on an error far larger than heyoka's on the same motion; "" where it is not."""
    error, heyoka_error = (row.metric(SOLUTION_ERROR, "along", "final") for row in (row, ours))
    if error is None or heyoka_error is None or size(error) - size(heyoka_error) < _FAR_LARGER:
        return ""
    return f" At the end it is {short(error.value)}, heyoka's {short(heyoka_error.value)}."


def _recent_power(series: Series | None) -> str:
    """The power by which an error grew over the last decade of t; "" where it is unknown."""
    curve = {} if series is None else dict(zip(*points(series), strict=True))
    if not curve or max(curve) - min(curve) < 1:
        return ""
    end = max(curve)
    begin = min(curve, key=lambda time: abs(end - 1 - time))
    return f"; over the last decade it is like t^{(curve[end] - curve[begin]) / (end - begin):z.1f}"


def _law_names(growths: Iterable[str], width: int) -> str:
    """The laws of several quantities: their names where these fit, else their number."""
    words = list(growths)
    return " or ".join(words) or "-" if len(" or ".join(words)) <= width else f"{len(words)} laws"
