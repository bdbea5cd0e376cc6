"""The sections of a page about a claim: its error split in three, and the break-away from its saddle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from heavytop.precision import exact
from heavytop.records import Report, Series
from heavytop.report.section import (
    DASHED,
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
from heavytop.report.svg import COLOURS, MARKERS, decades, finish, new_axes, spoken
from heavytop.report.text import short


def claim_error(sources: Sources) -> Section | None:
    """The error of a claim split in three: its model, its formulas in floating point, and an integrator's."""
    bases = dict.fromkeys(
        row.case for _, report in sources for row in report.rows if row.measure == "claim_model" and row.series
    )
    # one direction of time is enough to draw
    bases = dict.fromkeys(case for case in bases if not case.endswith("/backward") or _forward(case) not in bases)
    if not bases:
        return None
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
            "Crosses along the top mark times at which floating point gives no number; an error of exactly 0 has no "
            "place on these axes.",
        ],
        columns=["case", "error", "quantity", "|t| = 1", "largest drawn", "no number from |t|"],
        across=2,
    )
    names = list(bases)[: MOST_PLOTS // 2]
    left_out(section, len(bases) - len(names), "case")
    for number, case in enumerate(names):
        for quantity, title, unit in (("omega", "Ω", "1/time unit"), ("attitude", "attitude and of ψ", "rad")):
            axes = new_axes(TIME, f"error of {title} ({unit})")
            decades(axes.xaxis)
            decades(axes.yaxis)
            heard: list[str] = []
            for source, report in sources:
                for key, series, scale, symbol in _claim_parts(report, case, quantity, source):
                    heard += _claim_curve(axes, section, section.key(key), series, scale, case, symbol)
            title = f"{clip(case.removesuffix('/forward'), 40)}: error of {title}"
            if heard:
                box = axes.dataLim
                if math.isfinite(box.y0):
                    axes.set_ylim(max(box.y0 - 1, _LOWEST), max(box.y1, _LOWEST) + 1)
                section.pictures.append(finish(axes, title, spoken(heard), f"claim-{number}-{quantity}"))
    return section


_LARGEST = 150.0
_LOWEST = -26
"""No smaller error of a formula in floating point is drawn: where Ω itself tends to 0, so does its error."""


def _forward(case: str) -> str:
    return case.removesuffix("/backward") + "/forward"


def _claim_parts(report: Report, case: str, quantity: str, source: str) -> Iterator[tuple[Key, Series, float, str]]:
    """The curves of one case: label, series, what a unit of its times is in |t|, and what it is an error of.

    quantity: omega or attitude; of formulas in floating point the part of the attitude is ψ.
    """
    rows = [row for row in report.rows if row.case == case]
    bits = min((row.bits for row in rows if row.measure == "claim_evaluation"), default=53)
    old, suffix = source == "baseline", f", {source}" if source else ""
    for row in rows:
        name = "psi" if quantity == "attitude" and row.measure == "claim_evaluation" else quantity
        symbol = {"omega": "Ω", "psi": "ψ"}.get(name, name)
        prefix = "integration_error" if row.measure == "homoclinic" else f"{row.measure}_error"
        series = row.series.get(f"{prefix}_{name}")
        if series is None or not series.times:
            continue
        if row.measure == "claim_model" and row.integrator == "claim:smooth":
            yield Key(f"model{suffix}", 1, "s", "", old), series, 1.0, symbol
        elif row.measure == "claim_evaluation" and row.bits == bits:
            form = row.integrator.partition(":")[2]
            ends = [logarithm(end) for end in (row.horizon, series.times[-1])]
            scale = 10 ** ((ends[0] or 0.0) - (ends[1] or 0.0))
            colour, marker = (3, "D") if form == "printed" else (2, "^")
            label = f"evaluation, {clip(form, 20)} form, {clip(row.precision, 20)}{suffix}"
            yield Key(label, colour, marker, "", old), series, scale, symbol
        elif row.measure == "homoclinic" and row.bits == bits:
            label = f"integration, {clip(row.integrator, 20)}, {clip(row.precision, 20)}{suffix}"
            yield Key(label, 0, "o", "", old), series, 1.0, symbol


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
    largest = scientific(max(y)) if y else "no number"
    section.rows.append(
        [
            clip(case.removesuffix("/forward"), 40),
            key.label,
            symbol,
            "" if at_one is None else scientific(at_one),
            largest,
            scientific(lost[0]) if lost else "",
        ]
    )
    tail = f", no number from |t| = {scientific(lost[0])}" if lost else ""
    return [f"{key.label}: largest sample {largest}{tail}."]


def break_away(sources: Sources) -> Section | None:
    """Break-away time against the bits of the format, with the law of the saddle."""
    found: dict[tuple[str, str], dict[int, Fraction]] = {}
    slopes: dict[tuple[str, str], tuple[str, str]] = {}
    for source, report in sources:
        for row in report.rows:
            if row.measure == "homoclinic" and row.outcome == "success":
                metric = row.metrics.get("break_away_time")
                if metric is not None and metric.log10 is not None and metric.log10 < _LARGEST:
                    found.setdefault((row.case, source), {})[row.bits] = exact(metric.value)
            elif row.measure == "break_away_law":
                values = [row.metrics[f"break_away_slope{end}"].value for end in ("", "_expected")]
                slopes[row.case, source] = (values[0], values[1])
    if not found:
        return None
    section = Section(
        "break-away",
        "Break-away against bits",
        [
            "A homoclinic motion tends to a saddle, which multiplies every rounding error by e^(rate·|t|). No "
            "integrator stays on it: more digits buy time in proportion. Dashed: the law, ln 2 / rate time units per "
            "bit, through the mean of the points."
        ],
        columns=["case", "break-away |t| per format", "slope (time per bit)", "ln 2 / rate"],
    )
    axes = new_axes("format (bits)", "break-away |t| (time units of the data)", 3.0)
    merged = _both_directions(found)
    left_out(section, len(merged) - len(COLOURS) * max(1, len(sources)), "case")
    heard, bases = [], list(dict.fromkeys(name for name, _, _ in merged))[: len(COLOURS)]
    for name, case, source in merged:
        if name not in bases:
            continue
        old, place = source == "baseline", bases.index(name)
        label = f"{clip(name, 40)}, {source}" if source else clip(name, 40)
        key = section.key(Key(label, place, MARKERS[place], "", old, False))
        pairs = sorted(found[case, source].items())
        bits, times = [float(b) for b, _ in pairs], [float(t) for _, t in pairs]
        draw(axes, key, bits, times, 5.5)
        measured, expected = slopes.get((case, source), ("", ""))
        if logarithm(expected) is not None and not old:
            slope, middle = float(exact(expected)), (sum(bits) / len(bits), sum(times) / len(times))
            axes.plot(
                bits, [middle[1] + slope * (b - middle[0]) for b in bits], color=COLOURS[place], lw=1.2, ls=DASHED
            )
        listed = ", ".join(f"{t:g} at {b:g}" for b, t in zip(bits, times, strict=True))
        heard.append(f"{label}: {listed} bits.")
        section.rows.append([label, listed, short(measured), short(expected)])
    if slopes:
        section.key(Key("law, ln 2 / rate per bit", 5, "", "6 3"))
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    section.pictures.append(finish(axes, "Break-away time against bits", spoken(heard), "break-away"))
    return section


def _both_directions(found: dict[tuple[str, str], dict[int, Fraction]]) -> list[tuple[str, str, str]]:
    """(name, case, source): a case that breaks away at the same times forward and backward is named once."""
    result = []
    for (case, source), times in found.items():
        base, slash, direction = case.rpartition("/")
        other = found.get((f"{base}/{'backward' if direction == 'forward' else 'forward'}", source))
        if slash and other == times:
            if direction == "forward":
                result.append((base, case, source))
        else:
            result.append((case, case, source))
    return result
