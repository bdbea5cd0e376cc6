"""The sentences that open a page: what the rows of a kind of measurement come to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from heavytop.measure.digits import digits_kept, digits_of, digits_text
from heavytop.measure.drift import DRIFT
from heavytop.measure.integrator import HEYOKA
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.precision import exact
from heavytop.records import Law, Quantity, Row
from heavytop.report.section import clip
from heavytop.report.text import short
from heavytop.report.work_precision import leads

_ALONG = Quantity(SOLUTION_ERROR, "along")
_HOW = {"exponential": "exponentially", "bounded": "within a bound", "unresolved": "by no law that is resolved"}


def digits_headline(rows: Sequence[Row]) -> tuple[str, str] | None:
    """The fewest digits left at the longest horizon; of an integrator of others at the longest that heyoka has too."""
    finished = [row for row in rows if row.outcome == "success"]
    known = [(row, kept) for row in finished if (kept := digits_kept(row)) is not None]
    at_least = "" if known else "at least "
    known = known or [(row, kept) for row in finished if (kept := _at_least(row)) is not None]
    ours = {_place(row): kept for row, kept in known if row.key.subject.name == HEYOKA}
    both = [each for each in known if each[0].key.subject.name != HEYOKA and _place(each[0]) in ours]
    chosen = both or known
    if not chosen:
        return None
    last = max(abs(exact(row.horizon)) for row, _ in chosen)
    row, kept = min((each for each in chosen if abs(exact(each[0].horizon)) == last), key=lambda each: each[1])
    said = f"{clip(row.key.subject.name, 40)} has {at_least}{digits_text(kept)} of {digits_of(row.bits)} digits left"
    said += f" at T = {short(row.horizon)} ({clip(row.case, 40)} in {clip(row.precision, 20)})"
    return "", said + (f", {HEYOKA} {digits_text(ours[_place(row)])}." if both else ".")


def _at_least(row: Row) -> float | None:
    """Digits kept that the absolute error of Ω and γ proves, for it is no smaller than the relative one."""
    errors = [row.metric(SOLUTION_ERROR, part, "max") for part in ("omega", "gamma")]
    sizes = [error.log10 for error in errors if error is not None and error.log10 is not None]
    return -max(sizes) if len(sizes) == len(errors) else None


def _place(row: Row) -> tuple[str, int, str]:
    return row.case, row.bits, row.horizon


def fastest(rows: Sequence[Row]) -> tuple[str, str] | None:
    """Who is fastest at 1e-10 and by how much, over the motions on which heyoka and a peer reach it."""
    found = [(lead, ratio) for lead in leads(rows) if lead.log10 == -10 and (ratio := lead.ratio) is not None]
    if not found:
        return None
    won = [(lead, ratio) for lead, ratio in found if ratio >= 1]
    if len(won) * 2 >= len(found):
        names = Counter(lead.name for lead, _ in won)
        ratios, others = [ratio for _, ratio in won], Counter(lead.peer for lead, _ in won)
    else:
        won = [(lead, 1 / ratio) for lead, ratio in found if ratio < 1]
        names = Counter(lead.peer for lead, _ in won)
        ratios, others = [ratio for _, ratio in won], Counter(lead.name for lead, _ in won)
    where = f"{len(won)} of {len(found)} motions" if len(won) < len(found) else f"all {len(found)} motions"
    where = clip(found[0][0].case, 40) if len(found) == 1 else where
    low, high = (f"{pick(ratios):.1f}" for pick in (min, max))
    times = low if low == high else f"{low} to {high}"
    (name, _), (other, _) = names.most_common(1)[0], others.most_common(1)[0]
    return "", f"{clip(name, 40)} is the fastest at error 1e-10 on {where}: {times} times as fast as {clip(other, 40)}."


def laws_headline(rows: Sequence[Row]) -> tuple[str, str] | None:
    """Which laws the healthy runs follow, and how many of the planted faults have another law than these."""
    healthy = [row for row in rows if not row.key.subject.variant]
    parts = [_followed(healthy, drifts=True), _followed(healthy, drifts=False)]
    said = "; ".join(part for part in parts if part)
    faults = [row for row in rows if row.key.subject.bias]
    told = sum(_told(row, healthy) for row in faults)
    if faults:
        count = "All" if told == len(faults) else f"{told} of"
        said = f"{count} {len(faults)} planted faults are told. {said}"
    return ("", f"{said}.") if said else None


def _followed(rows: Sequence[Row], drifts: bool) -> str:
    """``errors along the flow grow like t^1.5 (4 of 5 ensembles)``."""
    laws = Counter(growth for row in rows for growth in {law.growth for law in _laws(row, drifts)})
    of = sum(bool(_laws(row, drifts)) for row in rows)
    if not laws:
        return ""
    parts = [
        _HOW.get(name, f"like {name}") + (f" ({n} of {of} ensembles)" if of > 1 else "")
        for name, n in laws.most_common()
    ]
    return ("First integrals drift " if drifts else "errors along the flow grow ") + ", ".join(parts)


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
