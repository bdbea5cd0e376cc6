"""Metrics over several reports, with the steps between one and the next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import msgspec
from msgspec.structs import replace
from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.display import printable
from heavytop.records import Identity
from heavytop.report.compare.compare import compare
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.document import Key, Section, clip, draw, logarithm, numbered, row_name, scientific, short
from heavytop.report.document.kind import Kinds
from heavytop.report.document.svg import COLOURS, End, Picture, decades, finish, new_axes, quiet_style, room, spoken
from heavytop.report.render.text import Lines
from heavytop.report.store.checks import law_text
from heavytop.report.store.store import AnyReport

MARK = {
    Verdict.WORSE: "▲",
    Verdict.BETTER: "▼",
    Verdict.INCOMPARABLE: "≠",
    Verdict.MISSING: "✗",
    Verdict.NEW: "+",
}
_LEGEND = "▲ worse than before  ▼ better  ≠ incomparable  ✗ missing  + new"


class Track(msgspec.Struct, frozen=True):
    """One metric of one row.  values: one per report, None where it has none.  steps: verdict and reason of each change
    from one report to the next, by the number of the later report.
    """

    row: Identity
    metric: str
    values: list[str | None]
    steps: dict[int, tuple[Verdict, str]]


def history(reports: Sequence[AnyReport], policy: Policy, kinds: Kinds) -> list[Track]:
    """The tracks of every row and metric, in order of first appearance."""
    tracks: dict[tuple[Identity, str], Track] = {}

    def track(row: Identity, metric: str) -> Track:
        return tracks.setdefault((row, metric), Track(row, metric, [None] * len(reports), {}))

    outcomes: list[dict[Identity, str]] = [{} for _ in reports]
    versions: dict[Identity, list[str]] = {}
    for number, report in enumerate(reports):
        for row in report.rows:
            outcomes[number][row.identity] = row.outcome
            if version := row.key.subject.version:
                versions.setdefault(row.identity, [""] * len(reports))[number] = version
            for name, metric in row.metrics.items():
                track(row.identity, name).values[number] = metric.value
            for name, law in row.laws.items():
                track(row.identity, f"growth {name}").values[number] = law_text(law)
    for number in range(1, len(reports)):
        for finding in compare(reports[number - 1], reports[number], policy, kinds).changed:
            identity = finding.row._replace(versions=())
            tracked = track(identity, finding.metric)
            tracked.steps[number] = finding.verdict, finding.reason
            if not finding.metric:
                tracked.values[:] = [outcome.get(identity) for outcome in outcomes]
            elif finding.timing:
                tracked.values[number - 1], tracked.values[number] = finding.baseline, finding.candidate
    return [replace(t, row=t.row._replace(versions=tuple(versions.get(t.row, ())))) for t in tracks.values()]


def history_json(names: Sequence[str], tracks: Sequence[Track]) -> dict[str, object]:
    """The document of `history --json`."""
    return {
        "reports": list(names),
        "tracks": [
            {
                **track.row.named,
                **({"versions": track.row.versions} if track.row.versions else {}),
                "metric": track.metric,
                "values": track.values,
                "steps": [
                    {"report": number, "verdict": verdict.value, "reason": reason}
                    for number, (verdict, reason) in sorted(track.steps.items())
                ],
            }
            for track in tracks
        ],
    }


def history_text(names: Sequence[str], tracks: Sequence[Track]) -> RenderableType:
    """A table with one column per report, steps marked."""
    heads = [Text(printable(f"{number}  {name}")) for number, name in enumerate(names, 1)]
    if not tracks:
        return Group(*heads, Text("\nNothing changed. --metric '*' shows what did not change too.", style="bold"))
    numbers = [str(number) for number in range(1, len(names) + 1)]
    shown = Lines(["row", "metric", *numbers], list(map(cells, tracks)), words=2)
    return Group(*heads, Text(_LEGEND, style="dim"), Text(), shown)


def cells(track: Track) -> list[str]:
    """A line of the table: row, metric, and the value and mark of each report."""
    marks = [MARK[track.steps[number][0]] if number in track.steps else " " for number in range(len(track.values))]
    values = [f"{short(value or '-')} {mark}" for value, mark in zip(track.values, marks, strict=True)]
    return [_row(track), track.metric or "whole row", *values]


def _row(track: Track) -> str:
    """The name of the row, with the versions of its program."""
    return f"{row_name(track.row)} {' → '.join(dict.fromkeys(filter(None, track.row.versions)))}".rstrip()


# A history as a page: for each row a chart over the reports, with every step beyond noise marked.


MOST_PICTURES, MOST_CURVES = 120, 6
_STEPS = {
    Verdict.WORSE: Key("worse than the report before", 5, "^", line=False),
    Verdict.BETTER: Key("better", 5, "v", line=False),
    Verdict.INCOMPARABLE: Key("incomparable", 5, "D", line=False),
}
_NAME = 12
"""Most characters of a report's name on an axis."""


def history_page(names: Sequence[str], reports: Sequence[AnyReport], tracks: Sequence[Track]) -> str:
    """The page of ``tracks`` over ``reports``; the same input gives the same bytes.

    names: of the reports, the oldest first.  A metric with fewer than two positive numbers is only in the table of its
    row; at most six metrics of a row are drawn, and at most 120 rows, those with steps first.
    """
    from heavytop.report.render.page import render

    with quiet_style():
        changed, unchanged = _sections(_ticks(names, reports), tracks)
    steps = [verdict for track in tracks for verdict, _ in track.steps.values()]
    return render(
        "history.html.j2",
        reports=[
            [str(number), clip(name), clip(str(report.plan.get("name", "?"))), *_version_and_commit(report)]
            for number, (name, report) in enumerate(zip(names, reports, strict=True), 1)
        ],
        tally={verdict.value: steps.count(verdict) for verdict in Verdict if verdict in steps},
        count=len(tracks),
        changed=changed,
        unchanged=unchanged,
    )


def _version_and_commit(report: AnyReport) -> tuple[str, str]:
    """Version of heavytop and commit of a report; "" where unknown."""
    version = report.environment.get("packages", {}).get("heavytop", "")
    return clip(str(version)), clip(str(report.environment.get("commit") or "")[:12])


def _ticks(names: Sequence[str], reports: Sequence[AnyReport]) -> list[str]:
    """Label of each report on the axis: heavytop's version, the name of its folder, or its number, the first of these
    by which all differ.
    """
    versions = [_version_and_commit(report)[0] for report in reports]
    if all(versions) and len(set(versions)) == len(versions):
        return [clip(version, _NAME) for version in versions]
    folders = [clip(PurePath(name).name or name, _NAME) for name in names]
    return folders if len(set(folders)) == len(folders) else [str(number) for number in range(1, len(names) + 1)]


def _sections(ticks: Sequence[str], tracks: Sequence[Track]) -> tuple[list[Section], list[Section]]:
    """A section for each row of the reports, in their order: those with a step, and those without."""
    parts: tuple[list[Section], list[Section]] = [], []
    rows: dict[str, list[Track]] = {}
    for track in tracks:
        rows.setdefault(_row(track), []).append(track)
    drawn = sorted(rows, key=lambda name: not any(track.steps for track in rows[name]))[:MOST_PICTURES]
    for number, (name, members) in enumerate(rows.items()):
        section = Section(f"row-{number}", clip(name, 120), [])
        section.columns = ["metric", *(str(index) for index in range(1, len(ticks) + 1))]
        section.rows = [[clip(track.metric or "whole row"), *_page_cells(track)] for track in members]
        drawable = sorted(
            (track for track in members if len(_points(track)) > 1),
            key=lambda track: (not track.steps, track.metric.endswith(("_rms", "_final"))),
        )
        if drawable and name in drawn:
            section.pictures.append(_picture(section, drawable[:MOST_CURVES], ticks, f"h{number}"))
        undrawn = len(drawable) - (MOST_CURVES if section.pictures else 0)
        if undrawn > 0:
            section.notes.append(f"{undrawn} more in the table alone; --metric and --case choose which are drawn.")
        parts[not any(track.steps for track in members)].append(section)
    return parts


def _page_cells(track: Track) -> list[str]:
    """The values with few digits, each step with its mark and its verdict."""
    cells = [short(value or "–") for value in track.values]
    for number, (verdict, _) in track.steps.items():
        cells[number] += f" {MARK.get(verdict, '')} {verdict.value}"
    return cells


def _points(track: Track) -> dict[int, float]:
    """log10 |value| by the number of the report, where it exists; none for verdicts, which are 0 or 1."""
    if set(track.values) <= {"0", "1", None}:
        return {}
    logs = {number: logarithm(value) for number, value in enumerate(track.values)}
    return {number: value for number, value in logs.items() if value is not None}


_REASONS = 2
"""Most steps explained below a picture; the table marks all."""


def _picture(section: Section, tracks: Sequence[Track], ticks: Sequence[str], name: str) -> Picture:
    """The metrics of one row over the reports, each named at its end, their steps marked."""
    labels = [clip(track.metric or "whole row", 30) for track in tracks]
    axes = new_axes("report", "value", 2.4 + 0.17 * len(tracks), room(labels))
    alternative: list[str] = []
    reasons: list[str] = []
    ends: list[End] = []
    heights: list[float] = []
    for index, (track, label) in enumerate(zip(tracks, labels, strict=True)):
        points, key = _points(track), numbered(label, index)
        draw(axes, key, [number + 1 for number in points], list(points.values()), every=None)
        for number, (verdict, reason) in sorted(track.steps.items()):
            mark = _STEPS.get(verdict)
            if mark and number in points:
                draw(axes, section.key(mark), [number + 1], [points[number]], size=7)
            reasons.append(clip(f"{label} {verdict.value} at {number + 1}: {reason}", 100))
        last = max(points)
        ends.append(End(label, COLOURS[key.colour], last + 1, points[last]))
        values = ", ".join(f"{number + 1}: {scientific(value)}" for number, value in points.items())
        alternative.append(f"{label} over the reports: {values}.")
        heights += points.values()
    axes.set_xlim(0.7, len(ticks) + 0.3)
    shown = range(0, len(ticks), -(-len(ticks) // 6))
    axes.set_xticks([number + 1 for number in shown], [printable(ticks[number]) for number in shown])
    pad = max(1.0, 0.15 * (max(heights) - min(heights)))
    axes.set_ylim(min(heights) - pad, max(heights) + pad)
    decades(axes.yaxis, 5)
    more = f"; and {len(reasons) - _REASONS} more" if len(reasons) > _REASONS else ""
    return finish(axes, section.title, spoken(alternative), name, "; ".join(reasons[:_REASONS]) + more, ends)
