"""The section of a page about surveys: distributions, a map of the digits right, the worst motions with pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy
from msgspec import UnsetType

from heavytop.errors import HeavyTopError
from heavytop.integrate.heyoka.motions import propagate
from heavytop.precision import DOUBLE, exact
from heavytop.records import CellMap, Row, Spread, Worst
from heavytop.report.document.document import Keys, Section, Sources, clip, draw, left_out, short
from heavytop.report.document.svg import COLOURS, Picture, decades, finish, new_axes, spoken
from heavytop.top.equations import system
from heavytop.top.heavy_top import HeavyTop, State

_NAMES = {
    "error_max": "largest error",
    "error_omega": "error of Ω",
    "error_gamma": "error of γ",
    "error_scaled": "error in eps T^1.5",
    "drift_gamma_squared": "drift of |γ|²",
    "drift_area": "drift of M·γ",
    "drift_energy": "drift of the energy",
    "drift_further": "drift of further integrals",
}
_MOST_MAPS = 4
_SHADES = 16
_IN_A_ROW = 5
_POINTS, _LONGEST = 240, 20
_AXES = (numpy.array([1.0, -1.0, 0.0]) / 2**0.5, numpy.array([-1.0, -1.0, 2.0]) / 6**0.5)
"""Right and up on the unit sphere seen from (1, 1, 1)."""


def survey_charts(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Distributions, all surveys overlaid; of each of the first some a map and the worst motions."""
    rows = [(source, row) for source, report in sources for row in report.rows if isinstance(row.spread, Spread)]
    if not rows:
        return None
    drawn = " and ".join(dict.fromkeys(short(min(row.horizon, str(_LONGEST), key=exact)) for _, row in rows))
    section = Section(
        "surveys",
        "Surveys of many motions",
        [
            "Distributions show the fraction of motions in each quarter of a decade. In the map, a stronger colour "
            "means fewer digits right (the median) and white means no motion. The worst motions are drawn as paths "
            f"of the vertical γ on the unit sphere in body axes, seen from (1, 1, 1), up to t = {drawn}; dashed on "
            "the far side.",
        ],
        columns=["sweep", "motion", "outcome", "error", "digits right", "inertia", "P", "r", "Ω", "γ", "command"],
        across=2,
        place=5,
    )
    keys = Keys()
    names = list(dict.fromkeys(name for _, row in rows for name in _spread(row).histograms if name in _NAMES))
    for name in names:
        section.pictures.append(_distribution(section, rows, keys, name))
    for number, (source, row) in enumerate(rows[:_MOST_MAPS]):
        label = _label(source, row)
        if (cells := _spread(row).map) is not None:
            section.pictures.append(_map(cells, label, row.bits * math.log10(2), f"survey-map-{number}"))
        if isinstance(row.worst, tuple) and row.worst:
            section.pictures.append(_paths(row, row.worst, label, f"survey-worst-{number}"))
    left_out(section, len(rows) - _MOST_MAPS, "map")
    section.rows = [
        _cells(_label(source, row), motion)
        for source, row in rows
        if isinstance(row.worst, tuple)
        for motion in row.worst
    ]
    return section


def _spread(row: Row) -> Spread:
    assert not isinstance(row.spread, UnsetType)
    return row.spread


def _label(source: str, row: Row) -> str:
    tolerance = row.key.subject.tolerance
    label = f"{clip(row.case, 20)}, {clip(row.integrator, 30)} {clip(row.precision, 20)}"
    label += f" at {clip(tolerance, 12)}" if tolerance else ""
    return f"{label}, {source}" if source else label


def _distribution(section: Section, rows: Sequence[tuple[str, Row]], keys: Keys, name: str) -> Picture:
    axes = new_axes(_NAMES[name], "fraction of the motions")
    decades(axes.xaxis)
    alternative = []
    for source, row in rows:
        histogram = _spread(row).histograms.get(name)
        if histogram is None:
            continue
        key = section.key(keys.key(_label("", row), source))
        part = numpy.array([0, *histogram.counts, 0]) / sum(histogram.counts)
        middles = histogram.first + histogram.width * (numpy.arange(len(part)) - 0.5)
        draw(axes, key, middles, part)
        alternative.append(f"{key.label}: most at 10^{middles[int(part.argmax())]:z.1f}.")
    axes.set_ylim(bottom=0)
    return finish(axes, f"Distribution: {_NAMES[name]}", spoken(alternative), f"survey-{name.replace('_', '-')}")


def _map(cells: CellMap, label: str, digits: float, name: str) -> Picture:
    """Digits right over two data; above it the colours of the fewest to the most."""
    from matplotlib.patches import Rectangle

    x, y = (name.replace("omega", "Ω").replace("gamma", "γ") for name in (cells.x, cells.y))
    axes = new_axes(x, y, 3.4)
    known = [value for row in cells.digits_lost for value in row if value is not None]
    low, high = min(known), max(known)

    def paint(x: float, y: float, width: float, height: float, lost: float, **options: Any) -> None:
        dark = 0.2 + 0.8 * (lost - low) / (high - low or 1.0)
        patch = Rectangle((x, y), width, height, linewidth=0, facecolor=COLOURS[0], **options)
        patch.set_alpha(round(dark, 2))
        axes.add_artist(patch)

    for row, bottom, top in zip(cells.digits_lost, cells.y_edges, cells.y_edges[1:], strict=False):
        for value, left, right in zip(row, cells.x_edges, cells.x_edges[1:], strict=False):
            if value is not None:
                paint(left, bottom, right - left, top - bottom, value)
    axes.set_xlim(cells.x_edges[0], cells.x_edges[-1])
    axes.locator_params(axis="x", nbins=6)
    axes.set_ylim(cells.y_edges[0], cells.y_edges[-1])
    for step in range(_SHADES):
        lost = high + (low - high) * step / (_SHADES - 1)
        paint(0.3 + 0.4 * step / _SHADES, 1.005, 0.4 / _SHADES, 0.03, lost, transform=axes.transAxes, clip_on=False)
    for position, lost, side in ((0.28, high, "right"), (0.72, low, "left")):
        axes.text(position, 1.005, f"{digits - lost:.1f}", transform=axes.transAxes, ha=side, size=7)
    caption = f"From {digits - high:.1f} digits right, the strongest colour, to {digits - low:.1f}, the faintest."
    return finish(axes, f"Digits right over {x} and {y}: {label}", caption, name, caption)


def _paths(row: Row, worst: Sequence[Worst], label: str, name: str) -> Picture:
    """A sphere each, five in a row, with its index in the sweep below it."""
    axes = new_axes("", "", 0.8 + 0.75 * -(-len(worst) // _IN_A_ROW))
    angles = numpy.linspace(0, 2 * numpy.pi, 73)
    for index, motion in enumerate(worst):
        x, y = 2.5 * (index % _IN_A_ROW), -2.9 * (index // _IN_A_ROW)
        axes.plot(x + numpy.cos(angles), y + numpy.sin(angles), color=COLOURS[5], lw=0.5)
        axes.text(x, y - 1.45, str(motion.index), ha="center", size=7)
        gamma = _gamma(row, motion)
        if gamma is None:
            continue
        across, up = (gamma @ axis for axis in _AXES)
        behind = gamma.sum(axis=1) < 0
        for hidden in (False, True):
            shown = [numpy.where(behind == hidden, part, numpy.nan) for part in (x + across, y + up)]
            axes.plot(*shown, color=COLOURS[0], lw=0.8, alpha=0.45 if hidden else 1, ls="--" if hidden else "-")
        axes.plot(x + across[0], y + up[0], "o", ms=2.5, color=COLOURS[1])
    axes.set_xlim(-1.2, 2.5 * _IN_A_ROW - 1.3)
    axes.set_ylim(-2.9 * ((len(worst) - 1) // _IN_A_ROW) - 1.8, 1.2)
    axes.set_aspect("equal")
    axes.set_axis_off()
    caption = "The worst first, by their index in the sweep; a dot is where γ begins."
    return finish(axes, f"The worst {len(worst)} motions: {label}", caption, name, caption)


def _gamma(row: Row, motion: Worst) -> Any:
    """The vertical at many times, (times, 3), by heyoka in double; None where that fails."""
    horizon = min(exact(row.horizon), exact(_LONGEST))
    times = [horizon * k / _POINTS for k in range(_POINTS + 1)]
    data = motion.data
    try:
        top = HeavyTop(data.inertia, data.weight, data.centre, data.rotor or None)
        run = propagate(top, State(data.omega, data.gamma), times, DOUBLE, system=system(row.system))
    except HeavyTopError:
        return None
    states = numpy.array(run.states, float).reshape(-1, 6)
    return states[:, 3:] if len(states) and numpy.isfinite(states).all() else None


def _cells(label: str, motion: Worst) -> list[str]:
    data = motion.data
    vectors = (data.inertia, (data.weight,), data.centre, data.omega, data.gamma)
    right = "" if motion.digits_right is None else f"{motion.digits_right:.2f}"
    texts = [clip(", ".join(vector), 120) for vector in vectors]
    return [
        label,
        clip(motion.case, 30),
        clip(motion.outcome, 20),
        short(motion.error),
        right,
        *texts,
        clip(motion.command, 900),
    ]
