"""Rounding noise of metrics, from reruns of a motion with other roundings.

A top whose inertia and weight are multiplied by a common factor has the same motions Ω(t), γ(t): the equations (1.1)
are homogeneous in them. Factors 1 + j/2^20 keep dyadic data dyadic, and every equality that defines a case, but change
each rounding of the run. They multiply integrals by less than 1.04, which is negligible against any band.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from operator import mul

import numpy
from msgspec.structs import replace as replace_struct

from heavytop.integrate.registry import Integrator
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.scorer import Scorer, flush_together
from heavytop.measure.truth import Truth, closed_form, uncertified
from heavytop.precision import DOUBLE, round_to, rounded
from heavytop.records import Metric
from heavytop.top.equations import GYROSTAT, Parameters
from heavytop.top.heavy_top import HeavyTop

RERUNS = 15
"""The number of reruns of a row."""
MOST_SEEDS = 1000
_BITS, FACTORS, _STRIDE = 20, 2**14, 10125
"""Factors are 1 + j/2^20 with j < 2^14; the odd stride makes those of one row differ in all their bits."""
_CENTRAL = 0.95


def factor(seed: int, rerun: int = 0) -> Fraction:
    """The factor of inertia and weight; 1 for seed 0 and rerun 0."""
    number = (seed * (RERUNS + 1) + rerun) * _STRIDE % FACTORS
    return 1 + Fraction(number, 2**_BITS)


def scaled(top: HeavyTop, by: Fraction) -> HeavyTop:
    """The top with the same motions and other roundings: inertia, weight and rotor times a :func:`factor`."""
    rotor = None if top.rotor is None else [by * k for k in top.rotor]
    mass = None if top.mass is None else by * top.mass
    return HeavyTop([by * moment for moment in top.inertia], by * top.weight, top.centre, rotor, mass)


def least(metrics: Mapping[str, Metric], metric: Metric) -> float:
    """log10 of the smallest size at which an error counts, -inf for most: a final value below its RMS is chance."""
    quantity = metric.quantity
    if quantity is None or quantity.statistic != "final":
        return -math.inf
    rms = metrics.get(quantity.over("rms").text)
    return -math.inf if rms is None or rms.log10 is None else rms.log10


def bands(runs: Sequence[Mapping[str, Metric]], floor: float, own: Mapping[str, Metric]) -> dict[str, float]:
    """The band of each error over runs that differ in their roundings alone: half its 95 % interval, in decades.

    floor: log10 below which errors are equal.  own: the metrics of the run that the bands belong to.  A metric of it
    counts if it is no larger than the others: it may be small by chance, but a large one must not widen its own band.
    Metrics that are non-finite or missing in some run have no band.
    """
    bands = {}
    for name in runs[0]:
        sizes = [_size(run, name) for run in runs]
        if any(map(math.isnan, sizes)) or any(run[name].kind != "error" for run in runs):
            continue
        if name in own and _size(own, name) <= max(sizes):
            sizes.append(_size(own, name))
        bands[name] = _spread([max(size, floor) for size in sizes])
    return bands


def duration_band(times: Sequence[float], own: float, expected: float) -> float:
    """The band in decades of a duration ``own`` > 0 with the additive noise of ``times``.

    expected: the equivalent of ``own`` among ``times``; it counts if it is not shorter than all of them.
    """
    family = [*times, expected] if expected >= min(times) else times
    return round(math.log10(1 + _spread(family) / own), 4)


def _size(run: Mapping[str, Metric], name: str) -> float:
    """log10 of an error; -inf for 0, NaN for a metric that is not a number."""
    metric = run.get(name)
    if metric is None or (metric.log10 is None and metric.value != "0"):
        return math.nan
    return max(-math.inf if metric.log10 is None else metric.log10, least(run, metric))


def _spread(values: Sequence[float]) -> float:
    """√½ of the 95 % quantile of pairwise distances: bands add in quadrature to the interval of a difference."""
    first, second = numpy.triu_indices(len(values), 1)
    gaps = numpy.abs(numpy.take(values, first) - numpy.take(values, second))
    return round(float(numpy.quantile(gaps, _CENTRAL)) / math.sqrt(2), 4)


# The rounding noise of one trajectory, from reruns.
#
# Rounding noise scales with eps: the reruns are in double for every format of the run.


_STEPS = 20_000
"""The largest number of steps of a rerun, approximately; a longer run is rerun in part."""
_STEPS_SINGLY = 2000
"""Steps of a rerun by an integrator that takes one motion at a time."""
_SAMPLES, _SAMPLES_OF_CHAOS = 32, 64
"""The second without a closed form: the largest error of a chaotic motion is that of its last significant samples."""
_FACTOR_BITS = 32
"""With data of so many bits, multiples by 1 + j/2^20 are exact in double: all reruns share one reference."""
_FLOOR = math.log10(float(DOUBLE.eps)) - 1

Metrics = dict[str, Metric]


@dataclass(frozen=True, slots=True)
class Reruns:
    """Reruns in double from the exact data ``problem``, with the roundings of ``seed``."""

    problem: Problem
    integrator: Integrator
    seed: int

    @property
    def possible(self) -> bool:
        """Whether the integrator accepts the motion with other roundings."""
        return self.problem.system is not GYROSTAT or bool(self.integrator.ensemble)

    def drift_bands(self, run: Trajectory, times: Sequence[Fraction], metrics: Metrics, true: Truth | str) -> Metrics:
        """``metrics`` of a run with their bands; unchanged if it failed, or reruns are not possible.

        times: of the run.  true: the reference of its states, or why it is missing.
        """
        if run.outcome is not Outcome.SUCCESS or not self.possible:
            return metrics
        step_limit = _STEPS if self.integrator.ensemble else _STEPS_SINGLY
        end = times[-1] if run.steps <= step_limit else times[-1] * step_limit / run.steps
        if not isinstance(true, str) and not true.covers(end):
            end = true.ends or end
        problem = _shortened(self.problem)
        samples = _SAMPLES if closed_form(problem) else _SAMPLES_OF_CHAOS
        rerun_times = [rounded(time, DOUBLE) for time in some_of(times, end, samples)]
        truth: Truth | str = true if isinstance(true, str) else uncertified(problem, rerun_times)
        reruns = self._rerun(problem, rerun_times, lambda problem: Scorer(problem, truth))
        return banded(run, metrics, [scorer.metrics() for scorer in reruns])

    def of(self, times: Sequence[Fraction], scorer: Callable[[Problem], Scorer]) -> list[Scorer]:
        """The scorers of the reruns."""
        return self._rerun(self.problem, times, scorer)

    def _rerun(self, problem: Problem, times: Sequence[Fraction], scorer: Callable[[Problem], Scorer]) -> list[Scorer]:
        """The scorers of the reruns of ``problem``."""
        p = problem.parameters
        problems = []
        for index in range(1, RERUNS + 1):
            scale = factor(self.seed, index)
            problems.append(replace(problem, parameters=_mapped_masses(p, partial(mul, scale))))
        scorers = [scorer(problem) for problem in problems]
        self.integrator.propagate_many(problems, times, lambda i, time, state: scorers[i](time, state), threads=1)
        flush_together(scorer.error for scorer in scorers if scorer.error is not None)
        return scorers


def some_of(times: Sequence[Fraction], end: Fraction, most: int) -> list[Fraction]:
    """At most ``most`` of ``times``, evenly distributed among those up to ``end``, with the last of them.

    Only times of the run are taken: between steps the error of an integrator may differ from that at their ends.
    If the first is beyond ``end``, all times are scaled to end there.
    """
    early = [time for time in times if abs(time) <= abs(end)] or [time * end / times[-1] for time in times]
    count = min(most, len(early))
    return [early[len(early) * i // count - 1] for i in range(1, count + 1)]


def escape_band(own: Fraction, escapes: Sequence[Fraction], rate: float, bits: int) -> float:
    """The band in decades of an escape time of a run with ``bits`` bits, from those of reruns in double.

    The rounding noise of an escape time is additive, some ln 2/rate in every format.
    """
    time, delay = float(own), (bits - DOUBLE.bits) * math.log(2) / rate
    return duration_band([float(escape) for escape in escapes], time, time - delay)


def _shortened(problem: Problem) -> Problem:
    return replace(problem, parameters=_mapped_masses(problem.parameters, lambda value: round_to(value, _FACTOR_BITS)))


def _mapped_masses(p: Parameters, change: Callable[[Fraction], Fraction]) -> Parameters:
    """The parameters with ``change`` applied to every number proportional to a mass: λ of the gyrostat stays."""
    inertia, moment = (tuple(map(change, part)) for part in (p.inertia, p.moment))
    rotor = tuple(map(change, p.rotor)) if isinstance(p.rotor, tuple) else p.rotor
    return p._replace(inertia=inertia, moment=moment, rotor=rotor)


def banded(run: Trajectory, metrics: Metrics, reruns: Sequence[Metrics]) -> Metrics:
    """The metrics with the bands of the reruns; the run itself counts in units of its eps."""
    coarser = math.log10(2) * (run.problem.precision.bits - DOUBLE.bits)
    in_eps = {
        name: metric if metric.log10 is None else replace_struct(metric, log10=metric.log10 + coarser)
        for name, metric in metrics.items()
    }
    widths = bands(reruns, _FLOOR, in_eps)
    return {name: replace_struct(metric, band=widths.get(name)) for name, metric in metrics.items()}
