"""Metrics over several reports, with the steps between one and the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.errors import InputError
from heavytop.precision import exact
from heavytop.report.compare import compare
from heavytop.report.comparison_text import row_name
from heavytop.report.laws import law_text
from heavytop.report.policy import Policy
from heavytop.report.printable import printable
from heavytop.report.section import clip
from heavytop.report.store import AnyReport
from heavytop.report.svg import document, quiet_style
from heavytop.report.text import short
from heavytop.report.verdicts import Verdict

MARK = {
    Verdict.WORSE: "▲",
    Verdict.BETTER: "▼",
    Verdict.INCOMPARABLE: "≠",
    Verdict.MISSING: "✗",
    Verdict.NEW: "+",
}
_LEGEND = "▲ worse than before  ▼ better  ≠ incomparable  ✗ missing  + new"
_MOST_LINES = 12


class Track(msgspec.Struct, frozen=True):
    """One metric of one row.  values: one a report, None where it has none.  steps: the verdict that each change from
    one report to the next has, by the number of the later report, the same left out; with the reason.
    """

    key: tuple[str, ...]
    metric: str
    values: list[str | None]
    steps: dict[int, tuple[Verdict, str]]


def history(reports: Sequence[AnyReport], policy: Policy) -> list[Track]:
    """The tracks of every row and metric, in the order in which they first come up."""
    tracks: dict[tuple[tuple[str, ...], str], Track] = {}

    def track(key: tuple[str, ...], metric: str) -> Track:
        return tracks.setdefault((key, metric), Track(key, metric, [None] * len(reports), {}))

    outcomes: list[dict[tuple[str, ...], str]] = [{} for _ in reports]
    for number, report in enumerate(reports):
        for row in report.rows:
            outcomes[number][row.key] = row.outcome
            for name, metric in row.metrics.items():
                track(row.key, name).values[number] = metric.value
            for name, law in row.laws.items():
                track(row.key, f"growth {name}").values[number] = law_text(law)
    for number in range(1, len(reports)):
        for finding in compare(reports[number - 1], reports[number], policy).changed:
            found = track(finding.key, finding.metric)
            found.steps[number] = finding.verdict, finding.reason
            if not finding.metric:
                found.values[:] = [outcome.get(finding.key) for outcome in outcomes]
            elif finding.metric.startswith("seconds "):
                found.values[number - 1], found.values[number] = finding.baseline, finding.candidate
    return list(tracks.values())


def history_json(names: Sequence[str], tracks: Sequence[Track]) -> dict[str, Any]:
    """The document of `history --json`."""
    return {
        "reports": list(names),
        "tracks": [
            {
                **dict(zip(("measure", "case", "system", "integrator", "precision"), track.key, strict=True)),
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
    table = Table(box=None, header_style="dim")
    for column in ("row", "metric"):
        table.add_column(column, overflow="fold")
    for number in range(1, len(names) + 1):
        table.add_column(str(number), justify="right", overflow="fold")
    for track in tracks:
        cells = [
            f"{short(value or '-')} {MARK[track.steps[n][0]] if n in track.steps else ' '}"
            for n, value in enumerate(track.values)
        ]
        cells = [row_name(track.key), track.metric or "whole row", *cells]
        table.add_row(*(Text(printable(cell)) for cell in cells))
    return Group(*heads, Text(_LEGEND, style="dim"), Text(), table)


def history_svg(names: Sequence[str], tracks: Sequence[Track]) -> str:
    """The tracks over the reports as a picture, errors on a logarithmic axis; raises InputError for more than 12."""
    drawn = [track for track in tracks if any(_height(value) is not None for value in track.values)]
    if not 1 <= len(drawn) <= _MOST_LINES:
        raise InputError(
            f"{len(drawn)} metrics cannot be drawn into one picture.",
            f"Choose 1 to {_MOST_LINES} of them with --metric and --case.",
        )
    from matplotlib.figure import Figure

    with quiet_style():
        figure = Figure(figsize=(8, 4.5), layout="constrained")
        axes = figure.subplots()
        for track in drawn:
            heights = [_height(value) for value in track.values]
            points = [float("nan") if height is None else height for height in heights]
            label = clip(f"{track.key[1]} {track.metric}")
            (line,) = axes.plot(range(1, len(names) + 1), points, marker="o", label=label)
            steps = [number for number in track.steps if heights[number] is not None]
            axes.plot(
                [number + 1 for number in steps], [points[n] for n in steps], "D", markersize=11, fillstyle="none",
                color=line.get_color(),
            )  # fmt: skip
        axes.set_yscale("log")
        axes.set_xticks(range(1, len(names) + 1), [printable(name[-24:]) for name in names], rotation=20, ha="right")
        axes.set_ylabel("value, in the units of the metric")
        axes.set_title("Diamonds mark steps beyond noise", fontsize="medium")
        axes.legend(fontsize="small")
        return document(figure)


def _height(value: str | None) -> float | None:
    """A value on a logarithmic axis; None for 0, for words and for what a float cannot hold."""
    try:
        number = abs(float(exact(value or "")))
    except (InputError, OverflowError):
        return None
    return number or None
