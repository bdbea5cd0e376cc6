"""How far rounding noise alone moves a metric: the same motion computed again with other roundings.

Inertia and weight times a common factor are another top with the same motions Ω(t), γ(t): the equations (1.1) are
homogeneous in them. With 1 + j/2^20 for the factor, dyadic data stay dyadic and every equality that defines a case
stays, but each rounding on the way is another one. Integrals are multiplied by less than 1.04, which no band notices.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy

from heavytop.records import Metric
from heavytop.top.heavy_top import HeavyTop

RERUNS = 15
"""Runs with other roundings, beside the row's own."""
MOST_SEEDS = 1000
_BITS, FACTORS, _STRIDE = 20, 2**14, 10125
"""Factors are 1 + j/2^20 with j < 2^14, an odd stride apart so that those of one row differ in all their bits."""
_CENTRAL = 0.95


def factor(seed: int, rerun: int = 0) -> Fraction:
    """What inertia and weight are multiplied by; 1 for seed 0 and rerun 0."""
    number = (seed * (RERUNS + 1) + rerun) * _STRIDE % FACTORS
    return 1 + Fraction(number, 2**_BITS)


def scaled(top: HeavyTop, by: Fraction) -> HeavyTop:
    """The top with the same motions and other roundings: inertia, weight and rotor times a :func:`factor`."""
    rotor = None if top.rotor is None else [by * k for k in top.rotor]
    return HeavyTop([by * moment for moment in top.inertia], by * top.weight, top.centre, rotor)


def least(metrics: Mapping[str, Metric], metric: Metric) -> float:
    """log10 of what an error counts as at least, -inf for most: a last value below the RMS of its row is chance."""
    quantity = metric.quantity
    if quantity is None or quantity.statistic != "final":
        return -math.inf
    rms = metrics.get(quantity.over("rms").text)
    return -math.inf if rms is None or rms.log10 is None else rms.log10


def bands(runs: Sequence[Mapping[str, Metric]], floor: float, own: Mapping[str, Metric]) -> dict[str, float]:
    """The band of each error over runs that differ in their roundings alone: half its 95 % interval, in decades.

    floor: log10 below which all errors are the same.  own: the run that the bands are for.  It counts where it came out
    no larger than the others: chance may have made it small, but must not excuse what went wrong.
    Metrics that are not finite or missing in some run have no band.
    """
    found = {}
    for name in runs[0]:
        sizes = [_size(run, name) for run in runs]
        if any(map(math.isnan, sizes)) or any(run[name].kind != "error" for run in runs):
            continue
        if name in own and _size(own, name) <= max(sizes):
            sizes.append(_size(own, name))
        found[name] = _spread([max(size, floor) for size in sizes])
    return found


def duration_band(times: Sequence[float], own: float, expected: float) -> float:
    """The band in decades of a duration ``own`` > 0 that noise moves as it moves ``times``, by addition.

    expected: what the duration would be among those; it counts where it is no shorter than they are.
    """
    family = [*times, expected] if expected >= min(times) else times
    return round(math.log10(1 + _spread(family) / own), 4)


def _size(run: Mapping[str, Metric], name: str) -> float:
    """log10 of an error; -inf for 0, NaN for the words."""
    metric = run.get(name)
    if metric is None or (metric.log10 is None and metric.value != "0"):
        return math.nan
    return max(-math.inf if metric.log10 is None else metric.log10, least(run, metric))


def _spread(values: Sequence[float]) -> float:
    """√½ of the 95 % quantile of the distance of two values, so that two bands in quadrature are the interval of the
    difference.
    """
    first, second = numpy.triu_indices(len(values), 1)
    gaps = numpy.abs(numpy.take(values, first) - numpy.take(values, second))
    return round(float(numpy.quantile(gaps, _CENTRAL)) / math.sqrt(2), 4)
