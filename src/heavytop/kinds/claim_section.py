"""The section of a page about a claim: its error split in three."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from heavytop.kinds.claim_tasks import EVALUATION_ERROR, INTEGRATION_ERROR, MODEL_ERROR
from heavytop.records import Direction, Row, Series
from heavytop.report.section import (
    MOST_PLOTS,
    TIME,
    Key,
    Section,
    Sources,
    clip,
    draw,
    left_out,
    logarithm,
    points,
    scientific,
)
from heavytop.report.svg import COLOURS, decades, finish, new_axes, spoken


def claim_error(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """The error of a claim split in three: its model, its formulas in floating point, and an integrator's."""
    directions: dict[str, list[Direction]] = {}
    for _, report in sources:
        for row in report.rows:
            if _series(row, MODEL_ERROR) or _series(row, EVALUATION_ERROR):
                directions.setdefault(row.key.case, []).append(row.key.direction)
    if not directions:
        return None
    # one direction of time is enough to draw
    bases = [(case, "forward" if "forward" in found else found[0]) for case, found in directions.items()]
    section = Section(
        "claim-error",
        "Where the claim’s error comes from",
        [
            "Three errors that are easily taken for one another. Model: the formulas, exactly evaluated, against the "
            "true motion of the heavy top from the same data. Evaluation: the formulas in floating point against the "
            "same formulas exactly evaluated. Integration: an integrator on the motion that the formulas do solve, "
            "against that motion.",
            "The model’s error of the attitude is the angle between the two attitudes: both motions start at the pole "
            "γ = e3, where φ and ψ are undefined and their differences say nothing. Beside it the error of the formula "
            "for ψ, which turns the attitude by as much.",
            "Crosses along the top mark times at which floating point gives NaN or an infinity; an error of exactly 0 "
            "has no place on these axes.",
        ],
        columns=["case", "error", "quantity", "|t| = 1", "largest drawn", "not finite from |t|"],
        across=2,
        place=20,
    )
    left_out(section, len(bases) - MOST_PLOTS // 2, "case")
    for number, (case, direction) in enumerate(bases[: MOST_PLOTS // 2]):
        called = case if direction == "forward" else f"{case}/{direction}"
        for quantity, title, unit in (("omega", "Ω", "1/time unit"), ("attitude", "attitude and of ψ", "rad")):
            axes = new_axes(TIME, f"error of {title} ({unit})")
            decades(axes.xaxis)
            decades(axes.yaxis)
            heard: list[str] = []
            for source, report in sources:
                rows = [row for row in report.rows if (row.key.case, row.key.direction) == (case, direction)]
                for key, series, scale, symbol in _claim_parts(rows, quantity, source):
                    heard += _claim_curve(axes, section, section.key(key), series, scale, called, symbol)
            title = f"{clip(called, 40)}: error of {title}"
            if heard:
                box = axes.dataLim
                if math.isfinite(box.y0):
                    axes.set_ylim(max(box.y0 - 1, _LOWEST), max(box.y1, _LOWEST) + 1)
                section.pictures.append(finish(axes, title, spoken(heard), f"claim-{number}-{quantity}"))
    return section


_LOWEST = -26
"""No smaller error of a formula in floating point is drawn: where Ω itself tends to 0, so does its error."""


def _series(row: Row, name: str) -> dict[str, Series]:
    """The series of a row that are of the quantity of that name, by their components."""
    found = [(series.quantity, series) for series in row.series.values() if series.quantity and series.times]
    return {quantity.component: series for quantity, series in found if quantity.name == name}


def _claim_parts(rows: Sequence[Row], quantity: str, source: str) -> Iterator[tuple[Key, Series, float, str]]:
    """The curves of one case: label, series, what a unit of its times is in |t|, and what it is an error of.

    quantity: omega or attitude; of formulas in floating point the part of the attitude is ψ.
    """
    bits = min((row.bits for row in rows if _series(row, EVALUATION_ERROR)), default=53)
    old, suffix = source == "baseline", f", {source}" if source else ""
    in_format = "psi" if quantity == "attitude" else quantity
    for row in rows:
        subject, precision = row.key.subject, clip(row.precision, 20)
        if subject.branch == "smooth" and (found := _series(row, MODEL_ERROR).get(quantity)):
            yield Key(f"model{suffix}", 1, "s", "", old), found, 1.0, _symbol(quantity)
        if row.bits == bits and (found := _series(row, EVALUATION_ERROR).get(in_format)):
            ends = [logarithm(end) for end in (row.horizon, found.times[-1])]
            scale = 10 ** ((ends[0] or 0.0) - (ends[1] or 0.0))
            colour, marker = (3, "D") if subject.form == "printed" else (2, "^")
            label = f"evaluation, {clip(subject.form, 20)} form, {precision}{suffix}"
            yield Key(label, colour, marker, "", old), found, scale, _symbol(in_format)
        if row.bits == bits and (found := _series(row, INTEGRATION_ERROR).get(quantity)):
            label = f"integration, {clip(row.integrator, 20)}, {precision}{suffix}"
            yield Key(label, 0, "o", "", old), found, 1.0, _symbol(quantity)


def _symbol(quantity: str) -> str:
    return {"omega": "Ω", "psi": "ψ"}.get(quantity, quantity)


def _claim_curve(
    axes: Any, section: Section, key: Key, series: Series, scale: float, case: str, symbol: str
) -> list[str]:
    x, y = points(series, 0.0, scale)
    dead = [logarithm(t) for t, v in zip(series.times, series.values, strict=False) if v == "nan"]
    lost = sorted(t + math.log10(scale) for t in dead if t is not None)
    if lost:
        colour = COLOURS[key.colour]
        axes.plot(
            lost, [0.99] * len(lost), "x", transform=axes.get_xaxis_transform(), color=colour, ms=4, clip_on=False
        )
    if x:
        draw(axes, key, x, y)
    at_one = next((v for t, v in zip(x, y, strict=True) if abs(t) < 1e-6), None)
    largest = scientific(max(y)) if y else "none finite"
    section.rows.append(
        [
            clip(case, 40),
            key.label,
            symbol,
            "" if at_one is None else scientific(at_one),
            largest,
            scientific(lost[0]) if lost else "",
        ]
    )
    tail = f", not finite from |t| = {scientific(lost[0])}" if lost else ""
    return [f"{key.label}: largest sample {largest}{tail}."]
