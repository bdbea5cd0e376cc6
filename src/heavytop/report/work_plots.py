"""The section of a page about work and precision: seconds against error, one curve an integrator."""

from __future__ import annotations

import math
from collections.abc import Sequence

from heavytop.records import Report, Row
from heavytop.report.plots import MOST_PLOTS, Key, Section, Sources, clip, draw, left_out, logarithm, scientific
from heavytop.report.svg import COLOURS, MARKERS, Picture, decades, finish, new_axes, spoken
from heavytop.report.text import short

GOAL = "1e-10"
"""The error at which integrators are held against each other in words."""

Group = tuple[str, str]
"""A case and a horizon."""


def work_precision(sources: Sources) -> Section | None:
    """Seconds to reach the end against the error there; what failed is a cross, and no point."""
    groups: dict[Group, list[tuple[str, Row]]] = {}
    for source, report in sources:
        for row in report.rows:
            if row.measure == "work_precision":
                groups.setdefault((row.case, row.horizon), []).append((source, row))
    if not groups:
        return None
    section = Section(
        "work-precision",
        "Work and precision",
        [
            "Seconds of a run against its error at the end, largest component, held against the known motion: the "
            "lower and the farther left, the better. A curve is one integrator over its tolerances or steps; the time "
            "to compile is apart, in the numbers. A cross along the top is a run that did not reach the end.",
            *(sentence for source, report in sources for sentence in faster(report, source)),
        ],
        columns=["case", "integrator", "format", "T", "error", "seconds", "compile", "steps", "outcome"],
        across=2,
    )
    keys = _keys([(source, row) for members in groups.values() for source, row in members])
    for number, group in enumerate(list(groups)[:MOST_PLOTS]):
        section.pictures.append(_picture(section, group, groups[group], keys, f"work-{number}"))
    left_out(section, len(groups) - MOST_PLOTS, "case")
    return section


def _curve(source: str, row: Row) -> str:
    """The name of the curve that a row is a point of: the integrator without its setting, and its format."""
    form = "" if row.precision == "double" else f" in {row.precision}"
    return clip(row.integrator.partition(" ")[0] + form + (f", {source}" if source else ""), 50)


def _keys(members: Sequence[tuple[str, Row]]) -> dict[str, Key]:
    found: dict[str, Key] = {}
    for source, row in members:
        name, place = _curve(source, row), len(found)
        colour, turn = place % len(COLOURS), place // len(COLOURS)
        marker = MARKERS[(place + turn) % len(MARKERS)]
        found.setdefault(name, Key(name, colour, marker, old=source == "baseline"))
    return found


def _picture(
    section: Section, group: Group, members: Sequence[tuple[str, Row]], keys: dict[str, Key], name: str
) -> Picture:
    axes = new_axes("error at the end (units of Ω and γ)", "time of a run (s)")
    decades(axes.xaxis)
    decades(axes.yaxis)
    curves: dict[str, list[tuple[float, float]]] = {}
    failed: list[str] = []
    for source, row in members:
        curve, reached = _curve(source, row), _reached(row)
        if reached is None:
            failed.append(curve)
        else:
            curves.setdefault(curve, []).append(reached)
        error = row.metrics.get("error_final")
        section.rows.append(
            [
                clip(row.case),
                clip(row.integrator, 50),
                clip(row.precision, 20),
                short(row.horizon),
                short(error.value) if error else "",
                *(f"{row.seconds[part]:.3g}" if part in row.seconds else "" for part in ("run", "compile")),
                str(row.steps),
                clip(row.outcome, 30),
            ]
        )
    heard = []
    for curve, found in curves.items():
        found.sort()
        draw(axes, section.key(keys[curve]), [x for x, _ in found], [y for _, y in found], 4.2)
        heard.append(f"{curve}: from {scientific(found[0][0])} in {scientific(found[0][1])} s on.")
    for place, curve in enumerate(failed):
        key = section.key(keys[curve])
        top = {"transform": axes.transAxes, "clip_on": False, "color": COLOURS[key.colour]}
        axes.plot([0.03 + 0.03 * (place % 30)], [0.99], "x", ms=5, **top)
    heard += [f"{curve}: failed." for curve in dict.fromkeys(failed)]
    return finish(axes, f"{_name(group)}: seconds against error", spoken(heard), name)


def _reached(row: Row) -> tuple[float, float] | None:
    """Logarithms of error and seconds, where there are both."""
    error, seconds = row.metrics.get("error_final"), row.seconds.get("run", 0.0)
    if row.outcome != "success" or error is None or error.log10 is None or not seconds > 0:
        return None
    return error.log10, math.log10(seconds)


def faster(report: Report, source: str = "") -> list[str]:
    """A sentence a case: the fastest run of heyoka, and the fastest of any other, whose error is at most the goal."""
    goal = logarithm(GOAL) or 0.0
    best: dict[Group, dict[str, tuple[float, str]]] = {}
    for row in report.rows:
        reached = _reached(row) if row.measure == "work_precision" else None
        if reached is None or reached[0] > goal:
            continue
        side = "heyoka" if row.integrator.startswith("heyoka") else "peer"
        found = best.setdefault((row.case, row.horizon), {})
        found[side] = min(found.get(side, (math.inf, "")), (reached[1], _curve("", row)))
    return [_sentence(group, sides, source) for group, sides in best.items() if len(sides) == 2]


def _sentence(group: Group, sides: dict[str, tuple[float, str]], source: str) -> str:
    (ours, name), (theirs, peer) = sides["heyoka"], sides["peer"]
    where = f"{_name(group)}, {source}" if source else _name(group)
    return (
        f"{where}: an error of {GOAL} or less takes {name} {scientific(ours)} s and the fastest other, {peer}, "
        f"{scientific(theirs)} s, {10 ** (theirs - ours):.3g} times as long."
    )


def _name(group: Group) -> str:
    case, horizon = group
    return clip(case, 40) if "T=" in case else f"{clip(case, 40)}, |t| = {short(horizon.removeprefix('-'))}"
