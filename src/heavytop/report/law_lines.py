"""The laws by which drift and error grow, in the few lines at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from heavytop.measure.drift import DRIFT
from heavytop.measure.integrator import HEYOKA, MULTIWORD
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.records import Quantity, Row, Series
from heavytop.report.document import Block, In, Note, Table
from heavytop.report.printable import short
from heavytop.report.section import points
from heavytop.report.verdicts import size

_OWN = (HEYOKA, MULTIWORD)
_MEANS = {
    "t^0.5": "less than rounding noise that adds up",
    "t": "a frequency that is off by a constant, by truncation or a wrong coefficient",
    "t^1.5": "rounding noise alone, the least there is",
    "t^2": "every step errs in the same way and a first integral drifts; a smaller step or tolerance helps",
    "exponential": "the motion amplifies every error",
}
"""Laws of the error along the flow."""
_WIDTHS = {"integrals": 16, "along": 12, "across": 12}
"""What is summed up, and the characters there are for it."""
_COLUMNS = "", "integrals", "error along", "across"
_FAR = 2.0
"""Decades."""


def laws_in_short(rows: Sequence[Row]) -> list[Block]:
    """The laws, those of all first integrals as one; formats and motions with the same laws together.  Then what those
    of third-party integrators mean.

    Those of a variant, such as a planted fault, stand together for all motions.
    """
    united: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        united.setdefault(_united(row), []).append(row)
    formats: dict[tuple[str, str, str, tuple[str, ...]], list[str]] = {}
    for row in rows:
        name = "" if row.key.subject.name == HEYOKA else row.key.subject.name
        what = (name, row.key.subject.variant, row.key.case, _growths(united[_united(row)]))
        formats.setdefault(what, []).append(row.precision)
    cases: dict[tuple[str, ...], list[str]] = {}
    for (name, variant, case, growths), precisions in formats.items():
        runs = " ".join(part for part in (name, ", ".join(precisions), variant) if part)
        cases.setdefault((runs, *growths), []).append(case)
    cells = [[f"{runs}: {', '.join(motions)}", *said] for (runs, *said), motions in cases.items()]
    found: list[Block] = [Table("Grows like", _COLUMNS, cells, words=len(_COLUMNS), shown=In.SHORT)]
    others = [row for row in rows if row.key.subject.name not in _OWN]
    ours = {(row.key.case, row.precision): row for row in rows if row.key.subject.name == HEYOKA}
    said = (_meaning(row) + _larger(row, ours.get((row.key.case, row.precision), row)) for row in others)
    return [*found, *(Note(sentence, shown=In.SHORT) for sentence in said)]


def _united(row: Row) -> tuple[str, ...]:
    """Equal for the rows whose laws are said as one: those of a variant, else a row alone."""
    subject = row.key.subject
    return subject.name, subject.variant, row.precision, "" if subject.variant else row.key.case


def _growths(rows: Sequence[Row]) -> tuple[str, ...]:
    """The classes of the laws of the first integrals, along and across the flow; of what is exactly 0 none."""
    laws: dict[str, dict[str, None]] = {}
    for law in (law for row in rows for law in row.laws.values()):
        quantity = law.quantity or Quantity("")
        what = "integrals" if quantity.name == DRIFT else quantity.component
        if what in _WIDTHS and (law.growth, law.exponent) != ("bounded", None):
            laws.setdefault(what, {})[law.growth] = None
    return tuple(_either(laws.get(what, {}), width) for what, width in _WIDTHS.items())


def _meaning(row: Row) -> str:
    """What the law of an integrator of others says about it."""
    name = Quantity(SOLUTION_ERROR, "along").text
    law = row.laws.get(name)
    growth = "unresolved" if law is None else law.growth
    grows = {
        "unresolved": f"follows no single law{_lately(row.series.get(name))}",
        "bounded": "is bounded",
        "exponential": "grows exponentially",
    }.get(growth, f"grows like {growth}")
    means = f": {_MEANS[growth]}" if growth in _MEANS else ""
    return f"{row.key.case}: the error of {row.key.subject.name} along the flow {grows}{means}."


def _larger(row: Row, ours: Row) -> str:
    """What no law shows: an error that is far larger than heyoka's of the same motion; "" where it is not."""
    error, known = (each.metric(SOLUTION_ERROR, "along", "final") for each in (row, ours))
    if error is None or known is None or size(error) - size(known) < _FAR:
        return ""
    return f" At the end it is {short(error.value)}, heyoka's {short(known.value)}."


def _lately(series: Series | None) -> str:
    """By which power an error grew over the last decade of t; "" where that is not known."""
    known = {} if series is None else dict(zip(*points(series), strict=True))
    if not known or max(known) - min(known) < 1:
        return ""
    end = max(known)
    begin = min(known, key=lambda time: abs(end - 1 - time))
    return f", over the last decade of t like t^{(known[end] - known[begin]) / (end - begin):.1f}"


def _either(growths: Iterable[str], width: int) -> str:
    """The laws of several quantities: by name where there is room."""
    found = list(growths)
    return " or ".join(found) or "-" if len(" or ".join(found)) <= width else f"{len(found)} laws"
