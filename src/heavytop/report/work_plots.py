"""The section of a page about work and precision: seconds against error, one curve an integrator."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from heavytop.records import Row
from heavytop.report.section import MOST_PLOTS, Key, Section, Sources, clip, draw, left_out, scientific
from heavytop.report.svg import COLOURS, MARKERS, Picture, decades, finish, new_axes, spoken
from heavytop.report.text import short
from heavytop.report.work_precision import Line, leads, panels

_METRICS = (("error_max", "largest over the samples"), ("error_final", "at the end"))


def work_precision(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Seconds of a run against its error, on the way and at the end; a run that gave up is a cross, and no point."""
    rows = [(source, row) for source, report in sources for row in report.rows]
    if not rows:
        return None
    section = Section(
        "work-precision",
        "Work and precision",
        [
            "Seconds of a run, the fastest of several, against its error, largest component, compared with the known "
            "motion: the lower and the farther left, the better. A curve is one integrator over its tolerances or "
            "steps; the time to compile is apart, in the numbers. A cross on the right edge is a run that gave up "
            "before the end, at the time it took: it has no error. Charts and sentences have the fastest run, since "
            "other work on the machine only ever adds; “run” in the rows at the end of the page is the median. "
            "heyoka:constants has the numbers of the top compiled into its code; heyoka double and the peers are "
            "given them when they run.",
            *(_said(lead.text, source) for source, report in sources for lead in leads(report.rows)),
        ],
        columns=[
            "case",
            "integrator",
            "format",
            "error on the way",
            "at the end",
            "s",
            "compile (s)",
            "steps",
            "outcome",
        ],
        rows=[_numbers(source, row) for source, row in rows],
        across=2,
        place=50,
    )
    cases = list(dict.fromkeys(row.case for _, row in rows))
    left_out(section, len(cases) - MOST_PLOTS // 2, "case")
    keys: dict[str, Key] = {}
    short = {(source, lead.case): lead.short for source, report in sources for lead in leads(report.rows) if lead.short}
    for number, case in enumerate(cases[: MOST_PLOTS // 2]):
        for metric, when in _METRICS:
            lines = [(source, line) for source, report in sources for line in panels(report.rows, metric).get(case, ())]
            title = f"{clip(case, 40)}: time against error, {when}"
            known = [_said(short[source, case], source) for source, _ in sources if (source, case) in short]
            note = " ".join(known) if metric == "error_max" else ""
            section.pictures.append(_picture(section, lines, keys, title, f"work-{number}-{metric}", note))
    return section


def _said(text: str, source: str) -> str:
    return clip(f"{source.capitalize()}: {text}" if source else text, 400) + "."


def _key(keys: dict[str, Key], source: str, line: Line) -> Key:
    name = clip(line.label + (f", {source}" if source else ""), 50)
    return keys.setdefault(name, numbered(name, len(keys), source == "baseline"))


def numbered(label: str, place: int, old: bool = False) -> Key:
    """The key of the curve in that place: places that share a colour differ in the marker."""
    turn, colour = divmod(place, len(COLOURS))
    return Key(label, colour, MARKERS[(place + turn) % len(MARKERS)], old=old)


def _picture(
    section: Section, lines: Sequence[tuple[str, Line]], keys: dict[str, Key], title: str, name: str, note: str
) -> Picture:
    axes = new_axes("error (units of Ω and γ)", "time of a run (s)")
    decades(axes.xaxis)
    decades(axes.yaxis)
    heard = []
    for source, line in lines:
        key = section.key(_key(keys, source, line))
        points = sorted((point.log10, math.log10(point.seconds)) for point in line.points)
        if points:
            draw(axes, key, [x for x, _ in points], [y for _, y in points], 4.2, every=None)
            heard.append(f"{key.label}: {scientific(points[0][0])} in {scientific(points[0][1])} s.")
        failures = [math.log10(seconds) for seconds in line.failures if seconds > 0]
        if line.failures:
            edge = {"transform": axes.get_yaxis_transform(), "clip_on": False, "color": COLOURS[key.colour]}
            axes.plot([1.0] * len(failures), failures, "x", ms=6, mew=1.6, **edge)
            heard.append(f"{key.label}: gave up ({len(line.failures)}).")
    return finish(axes, title, spoken(heard, 24), name, note)


def _numbers(source: str, row: Row) -> list[str]:
    errors = (row.metrics.get(metric) for metric, _ in _METRICS)
    return [
        clip(row.case) + (f", {source}" if source else ""),
        clip(row.integrator, 50),
        clip(row.precision, 20),
        *(short(error.value) if error else "" for error in errors),
        *(f"{row.seconds[part]:.3g}" if part in row.seconds else "" for part in ("least", "compile")),
        str(row.steps),
        clip(row.outcome, 30),
    ]
