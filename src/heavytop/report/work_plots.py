"""The section of a page about work and precision: seconds against error, one curve an integrator."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from heavytop.records import Row
from heavytop.report.printable import short
from heavytop.report.section import Answers, Keys, Section, Sources, clip, draw, left_out, scientific
from heavytop.report.svg import COLOURS, End, Picture, decades, finish, new_axes, room, spoken
from heavytop.report.work_precision import ERRORS, Lead, Line, leads, panels, seconds_text

MOST_CASES = 12
_LEADS = (
    "case",
    "error",
    "heyoka",
    "takes",
    "best of the others",
    "takes",
    "times as fast",
    "general code takes",
    "in lanes",
)


def work_precision(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Seconds of a run against its error; a run that gave up is a cross, and no point."""
    rows = [(source, row) for source, report in sources for row in report.rows]
    if not rows:
        return None
    found = [_lead_cells(lead, source) for source, report in sources for lead in leads(report.rows)]
    section = Section(
        "work-precision",
        "Work and precision",
        [
            "Seconds of a run, the fastest of several, since other work on the machine only ever adds, against its "
            "error, the largest of a component over the samples, compared with the known motion: the lower and the "
            "farther left, the better. A curve is one integrator over its tolerances or steps; the time to compile is "
            "apart, in the numbers. A cross on the right edge is a run that gave up before the end, at the time it "
            "took: it has no error. heyoka:constants has the numbers of the top compiled into its code; heyoka with "
            "general code, and the others, are given them when they run.",
        ],
        answers=Answers("Seconds that heyoka and the best of the others take for an error", _LEADS, found)
        if found
        else None,
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
    left_out(section, len(cases) - MOST_CASES, "case")
    keys = Keys()
    for number, case in enumerate(cases[:MOST_CASES]):
        lines = [(source, line) for source, report in sources for line in panels(report.rows).get(case, ())]
        section.pictures.append(_picture(lines, keys, f"{clip(case, 40)}: time against error", f"work-{number}"))
    return section


def _lead_cells(lead: Lead, source: str) -> list[str]:
    def said(seconds: float | None) -> str:
        return "not reached" if seconds is None else seconds_text(seconds)

    return [
        clip(lead.case, 40) + (f", {source}" if source else ""),
        f"1e{lead.log10:g}",
        clip(lead.name, 40),
        said(lead.ours),
        clip(lead.other, 40),
        said(lead.theirs) if lead.other else "",
        "" if lead.ratio is None else f"{lead.ratio:.1f}",
        "" if lead.general is None else said(lead.general[1]),
        "" if lead.lanes is None else seconds_text(lead.lanes),
    ]


def _picture(lines: Sequence[tuple[str, Line]], keys: Keys, title: str, name: str) -> Picture:
    names = [clip(line.label, 30) + (f", {source}" if source else "") for source, line in lines]
    height = max(3.4, 1 + 0.17 * len(lines))
    axes = new_axes("error (units of Ω and γ)", "time of a run (s)", height, room(names))
    decades(axes.xaxis)
    decades(axes.yaxis)
    heard, ends = [], []
    for (source, line), label in zip(lines, names, strict=True):
        key = keys.key(clip(line.label, 30), source)
        points = sorted((point.log10, math.log10(point.seconds)) for point in line.points)
        if points:
            draw(axes, key, [x for x, _ in points], [y for _, y in points], 4.2, every=None)
            heard.append(f"{key.label}: {scientific(points[0][0])} in {scientific(points[0][1])} s.")
        failures = [math.log10(seconds) for seconds in line.failures if seconds > 0]
        if line.failures:
            edge = {"transform": axes.get_yaxis_transform(), "clip_on": False, "color": COLOURS[key.colour]}
            axes.plot([1.0] * len(failures), failures, "x", ms=6, mew=1.6, **edge)
            heard.append(f"{key.label}: gave up ({len(line.failures)}).")
        if points or failures:
            x, y = points[-1] if points else (axes.get_xlim()[1], failures[-1])
            ends.append(End(label, COLOURS[key.colour], x, y))
    return finish(axes, title, spoken(heard, 24), name, ends=ends)


def _numbers(source: str, row: Row) -> list[str]:
    errors = (row.metrics.get(quantity.text) for quantity in ERRORS)
    return [
        clip(row.case) + (f", {source}" if source else ""),
        clip(row.integrator, 50),
        clip(row.precision, 20),
        *(short(error.value) if error else "" for error in errors),
        *(f"{row.seconds[part]:.3g}" if part in row.seconds else "" for part in ("least", "compile")),
        str(row.steps),
        clip(row.outcome, 30),
    ]
