"""Distributions of the quantities of many motions, and the digits lost over two of their data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy

from heavytop.records import CellMap, Histogram
from heavytop.suite.survey.table import DATA

WIDTH = 0.25
"""Of a bin, in decades."""
_CELLS = 24
_MOST_BINS = 2000
_FIRST = ("omega", "gamma", "inertia", "moment", "rotor")


def histogram(values: Any) -> Histogram | None:
    """Of the values above 0; None without any."""
    positive = values[values > 0]
    if not len(positive):
        return None
    bins = numpy.floor(numpy.log10(positive) / WIDTH).astype(int)
    bins = numpy.maximum(bins, bins.max() - _MOST_BINS + 1)
    counts = numpy.bincount(bins - bins.min())
    return Histogram(float(bins.min() * WIDTH), WIDTH, tuple(counts.tolist()))


def two_of(columns: Mapping[str, Any]) -> tuple[str, ...]:
    """The first two data that are not the same in all motions, Ω before γ before the top."""
    ordered = sorted(DATA, key=lambda name: (_FIRST.index(name[:-1]), name))
    return tuple(name for name in ordered if len(numpy.unique(columns[name])) > 1)[:2]


def cell_map(x: tuple[str, Any], y: tuple[str, Any], lost: Any) -> CellMap | None:
    """Medians over at most 24 by 24 cells; cells of single values where there are no more of them.  NaN is left out."""
    kept = numpy.isfinite(lost) & numpy.isfinite(x[1]) & numpy.isfinite(y[1])
    if not kept.any():
        return None
    edges = [_edges(values[kept]) for _, values in (x, y)]
    across, up = (
        numpy.clip(numpy.searchsorted(e, v[kept], "right") - 1, 0, len(e) - 2)
        for e, (_, v) in zip(edges, (x, y), strict=True)
    )
    width, height = (len(e) - 1 for e in edges)
    cell = up * width + across
    order = numpy.lexsort((lost[kept], cell))
    found: list[float | None] = [None] * (width * height)
    counts = numpy.bincount(cell, minlength=width * height)
    ends = numpy.cumsum(counts)
    ordered = lost[kept][order]
    for place in numpy.flatnonzero(counts).tolist():
        found[place] = round(float(ordered[ends[place] - 1 - counts[place] // 2]), 3)
    rows = tuple(tuple(found[k * width : (k + 1) * width]) for k in range(height))
    return CellMap(x[0], y[0], tuple(edges[0].tolist()), tuple(edges[1].tolist()), rows)


def _edges(values: Any) -> Any:
    single = numpy.unique(values)
    if len(single) > _CELLS:
        return numpy.linspace(single[0], single[-1], _CELLS + 1)
    middle = (single[1:] + single[:-1]) / 2
    room = (single[1] - single[0]) / 2 if len(single) > 1 else math.ulp(1.0) + abs(single[0]) / 2
    last = (single[-1] - single[-2]) / 2 if len(single) > 1 else room
    return numpy.array([single[0] - room, *middle, single[-1] + last])
