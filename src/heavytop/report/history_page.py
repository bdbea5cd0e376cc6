"""A history as a page: one small chart a metric over the reports, every step beyond noise marked."""

from __future__ import annotations

from collections.abc import Sequence

from heavytop.report.history import MARK, Track
from heavytop.report.names import row_name
from heavytop.report.section import Key, Section, clip, draw, logarithm, scientific
from heavytop.report.store import AnyReport
from heavytop.report.svg import Picture, decades, finish, new_axes, quiet_style
from heavytop.report.text import short
from heavytop.report.verdicts import Verdict

MOST_PICTURES = 120
_VALUE = Key("value", 0, "o")
_STEPS = {
    Verdict.WORSE: Key("worse than the report before", 1, "^", line=False),
    Verdict.BETTER: Key("better", 2, "v", line=False),
    Verdict.INCOMPARABLE: Key("incomparable", 4, "D", line=False),
}


def history_page(names: Sequence[str], reports: Sequence[AnyReport], tracks: Sequence[Track]) -> str:
    """The page of ``tracks`` over ``reports``; the same input gives the same bytes.

    names: of the reports, the oldest first.  A metric without a positive number at two reports or more is in the table
    of its row alone; of more than 120 charts the first are drawn, those with steps before the others.
    """
    from heavytop.report.html import render

    with quiet_style():
        changed, unchanged = _sections(names, tracks)
    steps = [verdict for track in tracks for verdict, _ in track.steps.values()]
    return render(
        "history.html.j2",
        reports=[
            [str(number), clip(name), clip(str(report.plan.get("name", "?"))), *_made(report)]
            for number, (name, report) in enumerate(zip(names, reports, strict=True), 1)
        ],
        tally={verdict.value: steps.count(verdict) for verdict in Verdict if verdict in steps},
        count=len(tracks),
        changed=changed,
        unchanged=unchanged,
    )


def _made(report: AnyReport) -> tuple[str, str]:
    """Version of heavytop and commit of a report, as far as it says so."""
    version = report.environment.get("packages", {}).get("heavytop", "")
    return clip(str(version)), clip(str(report.environment.get("commit") or "")[:12])


def _sections(names: Sequence[str], tracks: Sequence[Track]) -> tuple[list[Section], list[Section]]:
    """One a row of the reports, in their order: those with a step, and those without."""
    found: tuple[list[Section], list[Section]] = [], []
    rows: dict[str, list[Track]] = {}
    for track in tracks:
        rows.setdefault(row_name(track.row), []).append(track)
    drawable = sorted((track for track in tracks if len(_points(track)) > 1), key=lambda track: not track.steps)
    drawn = {id(track) for track in drawable[:MOST_PICTURES]}
    for number, (name, own) in enumerate(rows.items()):
        section = Section(f"row-{number}", clip(name, 120), [])
        section.columns = ["metric", *(str(index) for index in range(1, len(names) + 1))]
        for track in own:
            if id(track) in drawn:
                section.pictures.append(_picture(section, track, len(names), f"h{number}-{len(section.pictures)}"))
            section.rows.append([clip(track.metric or "whole row"), *_cells(track)])
        missing = sum(len(_points(track)) > 1 for track in own) - len(section.pictures)
        if missing:
            section.notes.append(f"{missing} more in the table alone; --metric and --case choose which are drawn.")
        found[not any(track.steps for track in own)].append(section)
    return found


def _cells(track: Track) -> list[str]:
    """The values with few digits, each step with its mark and its verdict."""
    cells = [short(value or "–") for value in track.values]
    for number, (verdict, _) in track.steps.items():
        cells[number] += f" {MARK.get(verdict, '')} {verdict.value}"
    return cells


def _points(track: Track) -> dict[int, float]:
    """log10 |value| by the number of the report, where there is one; none for verdicts, which are 0 or 1."""
    if set(track.values) <= {"0", "1", None}:
        return {}
    logs = {number: logarithm(value) for number, value in enumerate(track.values)}
    return {number: value for number, value in logs.items() if value is not None}


def _picture(section: Section, track: Track, count: int, name: str) -> Picture:
    points = _points(track)
    axes = new_axes("report", "value", height=2.2)
    draw(axes, section.key(_VALUE), [number + 1 for number in points], list(points.values()), every=None)
    for number, (verdict, _) in sorted(track.steps.items()):
        key = _STEPS.get(verdict)
        if key and number in points:
            draw(axes, section.key(key), [number + 1], [points[number]], size=7)
    axes.set_xlim(0.7, count + 0.3)
    axes.xaxis.get_major_locator().set_params(integer=True)
    low, high = min(points.values()), max(points.values())
    pad = max(1.0, 0.15 * (high - low))
    axes.set_ylim(low - pad, high + pad)
    decades(axes.yaxis, 5)
    values = ", ".join(f"{number + 1}: {scientific(value)}" for number, value in points.items())
    reasons = [
        f"{verdict.value} at {number + 1}: {reason}" for number, (verdict, reason) in sorted(track.steps.items())
    ]
    title = clip(track.metric or "whole row")
    return finish(axes, title, f"{title} over the reports. {values}.", name, clip("; ".join(reasons), 200))
