"""How much of a noise band a comparison allows, and when a candidate is noisier by more than chance.

What is allowed comes from the baseline: a candidate must not excuse itself.  And a band is rounding noise or it is no
band: reruns that part by more than rounding makes of them (:mod:`heavytop.report.rounding_bound`) excuse nothing.

A band is itself an estimate from 16 runs, or from the starts of an ensemble.  Of bands of two such estimates one is
wider than the other by at most 4.2 (drift), 4.4 (growth) and 5.7 (homoclinic, where one random amplitude decides
everything) in 175,000 pairs: `benchmarks/false_alarms.py`.  Each kind's ``noise_factor`` is above that.
"""

from __future__ import annotations

import math

import msgspec

from heavytop.records import Metric, Row
from heavytop.report.kind import Kind
from heavytop.report.rounding_bound import RoundingBound

_BY_CHANCE = 1.4
"""One rerun in ten has a band wider by more than that: further, a candidate's own band is not allowed for."""
_LEAST = 0.05
"""Decades.  A band below this excuses nothing that the allowed loss does not; its own scatter is of no interest."""
_LEAST_LOST = 0.3
"""The same where the motion loses all digits before the end: its errors are as large as it is, and a rerun that comes
near the motion again by chance makes the band."""
STEP_CONTROL = 1.2
"""Decades.  A rounding may turn a step of a method with step control into another one, which moves its truncation error
by that at most; reruns that are no further apart are reproducible, whatever their size."""


def allowed_loss(old: Metric, new: Metric) -> float:
    """Half-width in decades of the 95 % interval of the ratio, for a change to the worse.

    Both bands in quadrature, that of the candidate no wider than 1.4 times that of the baseline.
    """
    band = old.band or 0.0
    return math.hypot(band, min(_BY_CHANCE * band, new.band or 0.0))


def allowed_gain(old: Metric, new: Metric) -> float:
    """The same for a change to the better, with both bands as they are."""
    return math.hypot(old.band or 0.0, new.band or 0.0)


def of_starts(metric: Metric, row: Row) -> Metric:
    """The metric with its band; over n starts no wider than ½ log10 n, by which one of them can raise a RMS."""
    widest = math.log10(row.starts) / 2
    if row.starts == 1 or metric.band is None or metric.band <= widest:
        return metric
    return msgspec.structs.replace(metric, band=widest)


def seldom_apart(band: float | None) -> bool:
    """Whether reruns with that band are so close together that nothing need be asked about them."""
    return band is None or math.sqrt(2) * band <= STEP_CONTROL


def irreproducible(metric: Metric, least: float, bound: RoundingBound | None) -> str:
    """Why the band of a metric is no rounding noise; "" where it is.

    least: log10 of what the error counts as at least.  bound: None for a band that does not come from reruns.
    """
    if bound is None or not metric.band or metric.log10 is None:
        return ""
    gap = math.sqrt(2) * metric.band
    if metric.kind == "duration":
        noise = bound.explains_times(metric.value, 10**gap - 1)
    else:
        noise = seldom_apart(metric.band) or bound.explains(metric.quantity, apart(max(metric.log10, least), gap))
    return "" if noise else f"not reproducible within rounding: {gap:.2g} decades between reruns"


def apart(size: float, gap: float) -> float:
    """log10 of 10^(size + gap) − 10^size."""
    return size + gap + math.log10(-math.expm1(-gap * math.log(10))) if gap > 0 else -math.inf


def reaches_further(old: Metric, new: Metric, least: tuple[float, float], loss: float) -> bool:
    """Whether value and band of the candidate together exceed those of the baseline: only then its noise matters.

    What the value itself has gained, the noise may take of it, up to the allowed loss.
    """
    if new.kind == "value":
        return True
    if new.kind == "duration":
        ends = [-math.inf if m.log10 is None else m.log10 - (m.band or 0.0) for m in (old, new)]
        return ends[1] < ends[0]
    before, after = (max(_size(m), floor) for m, floor in zip((old, new), least, strict=True))
    spared = min(loss, max(0.0, before - after))
    return after + (new.band or 0.0) > before + (old.band or 0.0) + spared


def noisier(kind: Kind, old: Metric, new: Metric, lost: bool = False) -> bool:
    """Whether the candidate's band is wider than the baseline's by more than chance.

    lost: whether the motion has no digit left before the end.
    """
    if old.band is None or new.band is None or new.band <= old.band:
        return False
    factor = kind.noise_factor or 1.0
    if not kind.noise_is_added(old):
        return new.band > factor * max(old.band, _LEAST_LOST if lost else _LEAST)
    # in decades such noise is as much wider as the number is smaller
    return _added(new) > _added(old) + math.log10(factor)


def _size(metric: Metric) -> float:
    return -math.inf if metric.log10 is None else metric.log10


def _added(metric: Metric) -> float:
    """log10 of how far the noise moves a number, in its own unit; -inf where there is none."""
    if metric.log10 is None:
        return -math.inf
    return math.log10(10 ** max(metric.band or 0.0, _LEAST / 10) - 1) + metric.log10
