"""Pictures of work against precision, and of the laws by which errors of different methods grow."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from heavytop.errors import InputError
from heavytop.records import Row, RowKey
from heavytop.report.method_growth import QUANTITIES, alike, growth_axes, keyed
from heavytop.report.section import TIME, clip
from heavytop.report.svg import COLOURS, document, plain, quiet_style
from heavytop.report.work_plots import numbered
from heavytop.report.work_precision import Line, leads, panels

_CROSS: dict[str, Any] = {"linestyle": "", "marker": "x", "markersize": 9, "markeredgewidth": 2}


def draw_work_precision(rows: Sequence[Row], directory: Path) -> list[Path]:
    """The files written into ``directory``: work-precision and growth, as SVG and as PNG.

    rows: of work against precision; raises InputError for none.
    """
    figures = {"work-precision": work_precision_figure(rows), "growth": growth_figure(rows)}
    if figures["work-precision"] is None:
        raise InputError("The report has no row of work against precision.", "`heavytop run --plan peers` makes them.")
    directory.mkdir(parents=True, exist_ok=True)
    files = []
    for name, figure in figures.items():
        if figure is not None:
            files += [directory / f"{name}.svg", directory / f"{name}.png"]
            files[-2].write_text(document(figure), "utf-8")
            figure.savefig(files[-1], dpi=110, metadata={"Software": "heavytop"})
    return files


def looks(lines: Sequence[Line]) -> dict[str, dict[str, Any]]:
    """Colour and marker for each label, the same in every panel and on the page."""
    keys = [numbered(label, place) for place, label in enumerate(dict.fromkeys(line.label for line in lines))]
    return {key.label: {"color": COLOURS[key.colour], "marker": key.marker, "linewidth": 1.4} for key in keys}


def work_precision_axes(axes: Any, lines: Sequence[Line], styles: dict[str, dict[str, Any]] | None = None) -> None:
    """Draw seconds against error on ``axes``; a run that gave up is a cross on the right edge, at the time it took."""
    styles = looks(lines) if styles is None else styles
    for line in lines:
        style = styles[line.label]
        points = sorted(line.points, key=lambda point: point.log10)
        errors = [10**point.log10 for point in points]
        axes.plot(errors, [point.seconds for point in points], markersize=4, label=plain(line.label), **style)
        if line.failures:
            edge = axes.get_yaxis_transform()
            cross = _CROSS | {"color": style["color"], "clip_on": False}
            axes.plot([1.0] * len(line.failures), line.failures, transform=edge, **cross)
    if not any(line.points for line in lines):  # no run reached the end, or no error is known: nothing sets a span
        axes.set(xlim=(1e-16, 1.0))
        if not any(line.failures for line in lines):
            axes.set(ylim=(1e-3, 1.0))
    axes.set(xscale="log", yscale="log", xlabel="largest error of a component over the samples", ylabel="seconds")
    axes.grid(True, color="#dddddd")
    axes.spines[["top", "right"]].set_visible(False)


def work_precision_figure(rows: Sequence[Row], metric: str = "error_max") -> Any:
    """A matplotlib figure: one panel a case, with the lead of heyoka in its title; None without such rows."""
    cases = panels(rows, metric)
    if not cases:
        return None
    lead = {each.case: each for each in leads(rows)}
    keys = {row.case: row.key for row in rows}
    styles = looks([line for lines in cases.values() for line in lines])
    height = -(-len(cases) // 2)
    figure = _figure(11, 4.4 * height + 1.2)
    grid = figure.subplots(height, 2, squeeze=False).ravel()
    labels: dict[str, Any] = {}
    for axes, (case, lines) in zip(grid, cases.items(), strict=False):
        work_precision_axes(axes, lines, styles)
        found = lead.get(case)
        title = plain(_up_to(keys[case]))
        if found is not None and found.short:
            title += f"\n{plain(found.short)}"
        axes.set_title(title, fontsize=10)
        handles, names = axes.get_legend_handles_labels()
        labels |= dict(zip(names, handles, strict=True))
    for axes in grid[len(cases) :]:
        axes.set_visible(False)
    if any(line.failures for lines in cases.values() for line in lines):
        labels["× gave up before the end"] = grid[0].plot([], [], color=COLOURS[-1], **_CROSS)[0]
    figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def growth_figure(rows: Sequence[Row]) -> Any:
    """Energy drift and phase error over time of three methods at about the same accuracy; None without such rows."""
    chosen = keyed(alike(rows))
    if not chosen:
        return None
    with quiet_style():
        figure = _figure(11, 4.6)
        for axes, (name, title, unit, power) in zip(figure.subplots(1, 2), QUANTITIES, strict=True):
            for key, _, found, _ in growth_axes(axes, chosen, name, power):
                label = f"{key.label}: {found.text}" if found else key.label
                axes.plot([], [], marker=key.marker, color=COLOURS[key.colour], label=label)
            axes.set(title=title, xlabel=TIME, ylabel=unit)
            axes.legend(fontsize=8, frameon=False)
        figure.suptitle(clip(_up_to(chosen[0][1].key)), fontsize=10)
    return figure


def _up_to(key: RowKey) -> str:
    return f"{key.case}, up to t = {key.horizon}"


def _figure(width: float, height: float) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
