"""What rows come to: the headlines of kinds of measurement, and the tables that several kinds share."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence

from heavytop.measure.digits import digits_kept, digits_of, digits_text
from heavytop.measure.drift import DRIFT
from heavytop.measure.integrator import HEYOKA, MULTIWORD
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.precision import exact
from heavytop.records import Law, Quantity, Row
from heavytop.report.document import Cell, Headline, In, Table, Value
from heavytop.report.names import computed_by
from heavytop.report.printable import short
from heavytop.report.section import clip, logarithm, scientific
from heavytop.report.text import drifts
from heavytop.report.work_precision import leads, panels, seconds_text

_ALONG = Quantity(SOLUTION_ERROR, "along")
_HOW = {"exponential": "exponentially", "bounded": "within a bound", "unresolved": "by no law that is resolved"}


def digits_headline(rows: Sequence[Row]) -> Headline | None:
    """The fewest digits left at the longest horizon: of an integrator of others beside heyoka's, else of heyoka beside
    those of multiword.  A motion whose truth ends before, for the format has no digit left, counts where there is no
    other.
    """
    finished = [row for row in rows if row.outcome == "success"]
    known = [(row, kept) for row in finished if (kept := digits_kept(row)) is not None]
    at_least = "" if known else "at least "
    known = known or [(row, kept) for row in finished if (kept := _at_least(row)) is not None]
    known = [each for each in known if not each[0].reference.until] or known
    theirs = [each for each in known if each[0].key.subject.name not in (HEYOKA, MULTIWORD)]
    ours = [each for each in known if each[0].key.subject.name == HEYOKA]
    beside = HEYOKA if theirs else MULTIWORD
    second = {_place(row): kept for row, kept in known if row.key.subject.name == beside}
    own = theirs or ours or known
    chosen = [each for each in own if theirs and _place(each[0]) in second] or own
    if not chosen:
        return None
    last = max(abs(exact(row.horizon)) for row, _ in chosen)
    row, kept = min((each for each in chosen if abs(exact(each[0].horizon)) == last), key=lambda each: each[1])
    said = f"{clip(row.key.subject.name, 40)} has {at_least}{digits_text(kept)} of {digits_of(row.bits)} digits left"
    said += f" at T = {short(row.horizon)} ({clip(row.case, 40)} in {clip(row.precision, 20)})"
    other = second.get(_place(row))
    return Headline(said + ("." if other is None else f", {beside} {digits_text(other)}."))


def _at_least(row: Row) -> float | None:
    """Digits right that the absolute error of Ω and γ proves, for it is no smaller than the relative one."""
    errors = [row.metric(SOLUTION_ERROR, part, "max") for part in ("omega", "gamma")]
    sizes = [error.log10 for error in errors if error is not None and error.log10 is not None]
    return -max(sizes) if len(sizes) == len(errors) else None


def _place(row: Row) -> tuple[str, int, str]:
    return row.case, row.bits, row.horizon


def named(rows: Sequence[Row]) -> Callable[[Row], str]:
    """What a row is called among these: its case, and its integrator where they have several."""
    several = len({row.key.subject.name for row in rows}) > 1
    return lambda row: f"{row.key.case}, {row.key.subject.name}" if several else row.key.case


def in_columns(title: str, cell: Callable[[Row], str], rows: Sequence[Row]) -> list[Table]:
    """A line a motion, a column a format, or an integrator where all are in one format, for a short summary; of two
    rows in one place the later.  No table without rows.
    """
    names, one_format = named(rows), len({row.precision for row in rows}) == 1
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        name, column = (row.key.case, row.key.subject.name) if one_format else (names(row), row.precision)
        lines.setdefault(name, {})[column] = cell(row)
    if not lines:
        return []
    in_order = sorted(rows, key=lambda row: (0, "") if one_format else (row.bits, row.precision))
    columns = list(dict.fromkeys(row.key.subject.name if one_format else row.precision for row in in_order))
    cells = [[found.get(column, "-") for column in columns] for found in lines.values()]
    columns = [clip(column, 13) for column in columns]
    room = 78 - sum(2 + max(map(len, column)) for column in zip(columns, *cells, strict=True))
    named_cells = [[clip(name, min(max(room, 16), 39)), *found] for name, found in zip(lines, cells, strict=True)]
    return [Table(title, ["", *columns], named_cells, shown=In.SHORT)]


def digits_columns(rows: Sequence[Row]) -> list[Table]:
    """Digits right at every sample, each with its time; of two horizons the longer."""
    known: dict[tuple[str, str, str], Row] = {}
    for row in rows:
        place = row.key.case, row.key.subject.name, row.precision
        if digits_kept(row) is not None and (place not in known or _end(row) >= _end(known[place])):
            known[place] = row
    return in_columns("Digits right, to |t|", _digits_until, list(known.values()))


def _until(row: Row) -> str:
    return (row.reference.until or (row.horizon if row.outcome == "success" else row.time_reached)).removeprefix("-")


def _end(row: Row) -> float:
    found = logarithm(_until(row))
    return -math.inf if found is None else found


def _digits_until(row: Row) -> str:
    kept, end = digits_kept(row), _end(row)
    assert kept is not None
    exponent = math.floor(end + 1e-9) if math.isfinite(end) else 0
    time = f"{10**end:.3g}" if exponent < 3 else f"{10 ** (end - exponent):.2g}e{exponent}"
    return f"{digits_text(kept)} {'from' if row.reference.until else 'to'} {time}"


def motions(title: str, rows: Sequence[Row], notes: Sequence[str]) -> Table:
    """Digits right, distance from the true motion and drift of every integral, a line a row."""
    columns = ["case", "format", "T", "steps", "outcome", "digits right", "error along", "across"]
    columns.append("drift of each integral")
    return Table(title, columns, [_motion(row) for row in rows], notes, left=True)


def _motion(row: Row) -> list[Cell]:
    errors = (row.metric(SOLUTION_ERROR, part, "max") for part in ("along", "across"))
    kept = digits_kept(row)
    digits = "-" if kept is None else digits_text(kept)
    return [
        row.case + computed_by(row),
        row.precision,
        row.horizon,
        str(row.steps),
        row.outcome,
        digits + (f" from {row.reference.until}" if row.reference.until else ""),
        *("no reference" if error is None else Value(error, 2, noise=True) for error in errors),
        "  ".join(f"{name} {Value(metric, 2, noise=True)}" for name, metric in drifts(row)),
    ]


def fastest(rows: Sequence[Row]) -> Headline | None:
    """Who is fastest at 1e-10 and by how much, over the motions on which heyoka and another reach it; else the least
    error of all.
    """
    found = [(lead, ratio) for lead in leads(rows) if lead.log10 == -10 and (ratio := lead.ratio) is not None]
    if not found:
        return _least_error(rows)
    ends = [(lead.name, lead.other) if ratio >= 1 else (lead.other, lead.name) for lead, ratio in found]
    (first, count), *rest = Counter(winner for winner, _ in ends).most_common()
    ratios = [max(ratio, 1 / ratio) for (winner, _), (_, ratio) in zip(ends, found, strict=True) if winner == first]
    behind = {other for winner, other in ends if winner == first}
    where = f"{count} of {len(found)} motions" if rest else f"all {len(found)} motions"
    where = clip(found[0][0].case, 40) if len(found) == 1 else where
    low, high = (f"{ratio:.0f}" if ratio >= 100 else f"{ratio:.1f}" for ratio in (min(ratios), max(ratios)))
    times = low if low == high else f"{low} to {high}"
    other = clip(behind.pop(), 40) if len(behind) == 1 else "the next"
    said = f"{clip(first, 40)} is the fastest at error 1e-10 on {where}: {times} times as fast as {other}"
    return Headline("; ".join([said, *(f"{clip(name, 40)} on {n}" for name, n in rest)]) + ".")


def _least_error(rows: Sequence[Row]) -> Headline | None:
    best = [(line.best, case, line.label) for case, lines in panels(rows).items() for line in lines if line.best]
    if not best:
        return None
    point, case, label = min(best, key=lambda each: each[0].log10)
    said = f"The least error is {scientific(point.log10)}: {clip(label, 40)} on {clip(case, 40)}"
    return Headline(f"{said}, in {seconds_text(point.seconds)}.")


def laws_headline(rows: Sequence[Row]) -> Headline | None:
    """The laws that most of the healthy runs follow, of integrators of others where there are any, and how many of the
    planted faults have another law than these.
    """
    theirs = [row for row in rows if row.key.subject.name not in (HEYOKA, MULTIWORD)]
    healthy = theirs or [row for row in rows if not row.key.subject.variant] or rows
    parts = [_followed(healthy, drifts=False), _followed(healthy, drifts=True)]
    said = ", ".join(part for part in parts if part)
    faults = [row for row in rows if row.key.subject.bias]
    told = sum(_told(row, healthy) for row in faults)
    if faults and said:
        said += f"; {told} of {len(faults)} planted faults show another law"
    return Headline(f"{said[0].upper()}{said[1:]}.") if said else None


def _followed(rows: Sequence[Row], drifts: bool) -> str:
    """``errors along the flow grow like t^1.5 (4 of 5 ensembles)``, and what a third of them or more do besides."""
    laws = Counter(growth for row in rows for growth in {law.growth for law in _laws(row, drifts)})
    of = sum(bool(_laws(row, drifts)) for row in rows)
    if not laws:
        return ""
    most, *next_to_it = laws.most_common(2)
    both = [most, *(each for each in next_to_it if 3 * each[1] >= of > 1)]
    # regular motions before those that amplify every error
    (growth, count), *others = sorted(both, key=lambda each: each[0] == "exponential")
    law = _HOW.get(growth, f"like {growth}") + (f" ({count} of {of} ensembles)" if of > 1 else "")
    law += "".join(f" or {_HOW.get(other, f'like {other}')} ({times})" for other, times in others)
    name = rows[0].key.subject.name
    whose = "" if name in (HEYOKA, MULTIWORD) else f" of {clip(name, 40)}"
    return f"first integrals drift {law}" if drifts else f"errors{whose} along the flow grow {law}"


def _laws(row: Row, drifts: bool) -> list[Law]:
    """Of the error along the flow, or of the first integrals; what is exactly 0 has none."""
    found = [(law, law.quantity) for law in row.laws.values() if law.exponent is not None or law.growth != "bounded"]
    if drifts:
        return [law for law, quantity in found if quantity and quantity.name == DRIFT]
    return [law for law, quantity in found if quantity == _ALONG]


def _told(row: Row, healthy: Sequence[Row]) -> bool:
    """Whether a law of the faulty ensemble is another than the healthy one of the same motion."""
    same = [each for each in healthy if (each.case, each.precision) == (row.case, row.precision)]
    expected = {law.growth for each in same for law in _laws(each, drifts=False)}
    return any(law.growth not in {*expected, "unresolved"} for law in _laws(row, drifts=False)) if expected else False
