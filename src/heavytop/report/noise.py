"""How much of a noise band a comparison allows, and when a candidate is noisier by more than chance.

What is allowed comes from the baseline: a candidate must not excuse itself.

A band is itself an estimate from 16 runs, or from the starts of an ensemble.  Of bands of two such estimates one is
wider than the other by at most 4.2 (drift), 4.4 (growth) and 5.7 (homoclinic, where one random amplitude decides
everything) in 175,000 pairs: `benchmarks/false_alarms.py`.  Each kind's ``noise_factor`` is above that.
"""

from __future__ import annotations

import math

from heavytop.records import Metric
from heavytop.report.kind import Kind

_BY_CHANCE = 1.4
"""One rerun in ten has a band wider by more than that: further, a candidate's own band is not allowed for."""
_LEAST = 0.05
"""Decades.  A band below this excuses nothing that the allowed loss does not; its own scatter is of no interest."""


def allowed_loss(old: Metric, new: Metric) -> float:
    """Half-width in decades of the 95 % interval of the ratio, for a change to the worse.

    Both bands in quadrature, that of the candidate no wider than 1.4 times that of the baseline.
    """
    band = old.band or 0.0
    return math.hypot(band, min(_BY_CHANCE * band, new.band or 0.0))


def allowed_gain(old: Metric, new: Metric) -> float:
    """The same for a change to the better, with both bands as they are."""
    return math.hypot(old.band or 0.0, new.band or 0.0)


def noisier(kind: Kind, old: Metric, new: Metric) -> bool:
    """Whether the candidate's band is wider than the baseline's by more than chance."""
    if old.band is None or new.band is None or new.band <= old.band:
        return False
    factor = kind.noise_factor or 1.0
    if not kind.noise_is_added(old):
        return new.band > factor * max(old.band, _LEAST)
    # in decades such noise is as much wider as the number is smaller
    return _added(new) > _added(old) + math.log10(factor)


def _added(metric: Metric) -> float:
    """log10 of how far the noise moves a number, in its own unit; -inf where there is none."""
    if metric.log10 is None:
        return -math.inf
    return math.log10(10 ** max(metric.band or 0.0, _LEAST / 10) - 1) + metric.log10
