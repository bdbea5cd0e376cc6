"""Metrics over several reports, with the steps between one and the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.records import Identity
from heavytop.report.compare import compare
from heavytop.report.consistency import law_text
from heavytop.report.kind import Kinds
from heavytop.report.names import row_name
from heavytop.report.policy import Policy
from heavytop.report.printable import printable, short
from heavytop.report.store import AnyReport
from heavytop.report.text import table
from heavytop.report.verdicts import Verdict

MARK = {
    Verdict.WORSE: "▲",
    Verdict.BETTER: "▼",
    Verdict.INCOMPARABLE: "≠",
    Verdict.MISSING: "✗",
    Verdict.NEW: "+",
}
_LEGEND = "▲ worse than before  ▼ better  ≠ incomparable  ✗ missing  + new"


class Track(msgspec.Struct, frozen=True):
    """One metric of one row.  values: one a report, None where it has none.  steps: the verdict that each change from
    one report to the next has, by the number of the later report, the same left out; with the reason.
    """

    row: Identity
    metric: str
    values: list[str | None]
    steps: dict[int, tuple[Verdict, str]]


def history(reports: Sequence[AnyReport], policy: Policy, kinds: Kinds) -> list[Track]:
    """The tracks of every row and metric, in the order in which they first come up."""
    tracks: dict[tuple[Identity, str], Track] = {}

    def track(row: Identity, metric: str) -> Track:
        return tracks.setdefault((row, metric), Track(row, metric, [None] * len(reports), {}))

    outcomes: list[dict[Identity, str]] = [{} for _ in reports]
    for number, report in enumerate(reports):
        for row in report.rows:
            outcomes[number][row.identity] = row.outcome
            for name, metric in row.metrics.items():
                track(row.identity, name).values[number] = metric.value
            for name, law in row.laws.items():
                track(row.identity, f"growth {name}").values[number] = law_text(law)
    for number in range(1, len(reports)):
        for finding in compare(reports[number - 1], reports[number], policy, kinds).changed:
            found = track(finding.row, finding.metric)
            found.steps[number] = finding.verdict, finding.reason
            if not finding.metric:
                found.values[:] = [outcome.get(finding.row) for outcome in outcomes]
            elif finding.timing:
                found.values[number - 1], found.values[number] = finding.baseline, finding.candidate
    return list(tracks.values())


def history_json(names: Sequence[str], tracks: Sequence[Track]) -> dict[str, Any]:
    """The document of `history --json`."""
    return {
        "reports": list(names),
        "tracks": [
            {
                **track.row.named,
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
    """A table with one column a report, steps marked."""
    heads = [Text(printable(f"{number}  {name}")) for number, name in enumerate(names, 1)]
    if not tracks:
        return Group(
            *heads,
            Text("\nNothing changed, or nothing matches. --metric '*' shows what did not change too.", style="bold"),
        )
    numbers = [str(number) for number in range(1, len(names) + 1)]
    shown = table(["row", "metric", *numbers], map(_cells, tracks), words=2)
    return Group(*heads, Text(_LEGEND, style="dim"), Text(), shown)


def _cells(track: Track) -> list[str]:
    marks = [MARK[track.steps[number][0]] if number in track.steps else " " for number in range(len(track.values))]
    values = [f"{short(value or '-')} {mark}" for value, mark in zip(track.values, marks, strict=True)]
    return [row_name(track.row), track.metric or "whole row", *values]
