"""How far rounding noise alone moves a metric: the same motion computed again with other roundings.

Inertia and weight times a common factor are another top with the same motions Ω(t), γ(t): the equations (1.1) are
homogeneous in them. With 1 + j/2^20 for the factor, dyadic data stay dyadic and every equality that defines a case
stays, but each rounding on the way is another one. Integrals are multiplied by less than 1.04, which no band notices.
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
from heavytop.precision import DOUBLE, exact, number, round_to
from heavytop.records import Metric
from heavytop.top.equations import GYROSTAT, Parameters
from heavytop.top.heavy_top import HeavyTop

RERUNS = 15
"""Runs with other roundings, beside the row's own."""
MOST_SEEDS = 1000
_BITS, FACTORS, _STRIDE = 20, 2**14, 10125
"""Factors are 1 + j/2^20 with j < 2^14, an odd stride apart so that those of one row differ in all their bits."""
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


# The rounding noise of one trajectory: its motion computed again with other roundings.
#
# Rounding noise is free of scale: the reruns are in double, whatever the format of the run.


_STEPS = 20_000
"""A longer run is rerun over about its first so many steps only."""
_STEPS_SINGLY = 2000
"""Steps of a rerun by an integrator that takes one motion at a time."""
_SAMPLES, _SAMPLES_OF_CHAOS = 32, 64
"""The second without a closed form: of a chaotic motion the last samples with a digit left decide the largest error."""
_FACTOR_BITS = 32
"""Bits of a top whose multiples by 1 + j/2^20 are exact in double: all its reruns then have one reference."""
_FLOOR = math.log10(float(DOUBLE.eps)) - 1

Metrics = dict[str, Metric]


@dataclass(frozen=True, slots=True)
class Reruns:
    """How a run is computed again: in double, from the exact data ``problem``, with the roundings of ``seed``."""

    problem: Problem
    integrator: Integrator
    seed: int

    @property
    def possible(self) -> bool:
        """Whether the integrator can be given the same motion with other roundings."""
        return self.problem.system is not GYROSTAT or bool(self.integrator.ensemble)

    def drift_bands(self, run: Trajectory, asked: Sequence[Fraction], metrics: Metrics, true: Truth | str) -> Metrics:
        """``metrics`` of a run with their bands; as they are where it failed, or cannot be computed again.

        asked: the times of the run.  true: what its states were compared with, or why with nothing.
        """
        if run.outcome is not Outcome.SUCCESS or not self.possible:
            return metrics
        most = _STEPS if self.integrator.ensemble else _STEPS_SINGLY
        end = asked[-1] if run.steps <= most else asked[-1] * most / run.steps
        if not isinstance(true, str) and not true.covers(end):
            end = true.ends or end
        problem = _short(self.problem)
        samples = _SAMPLES if closed_form(problem) else _SAMPLES_OF_CHAOS
        times = [exact(number(time, DOUBLE)) for time in some_of(asked, end, samples)]
        truth: Truth | str = true if isinstance(true, str) else uncertified(problem, times)
        reruns = self._of(problem, times, lambda problem: Scorer(problem, truth))
        return banded(run, metrics, [scorer.metrics() for scorer in reruns])

    def of(self, times: Sequence[Fraction], scorer: Callable[[Problem], Scorer]) -> list[Scorer]:
        """The scorers of the reruns."""
        return self._of(self.problem, times, scorer)

    def _of(self, problem: Problem, times: Sequence[Fraction], scorer: Callable[[Problem], Scorer]) -> list[Scorer]:
        """The scorers of the same motion with other roundings."""
        p = problem.parameters
        problems = []
        for index in range(1, RERUNS + 1):
            scale = factor(self.seed, index)
            problems.append(replace(problem, parameters=_each(p, partial(mul, scale))))
        scorers = [scorer(problem) for problem in problems]
        self.integrator.propagate_many(problems, times, lambda i, time, state: scorers[i](time, state), threads=1)
        flush_together(scorer.error for scorer in scorers if scorer.error is not None)
        return scorers


def some_of(times: Sequence[Fraction], end: Fraction, most: int) -> list[Fraction]:
    """At most so many of ``times``, evenly through those up to ``end``, with the last of them.

    The run's own times and no others: between its steps an integrator may have another error than at their ends.
    Where the first of them is beyond ``end``, as many times as there are in the same proportions.
    """
    early = [time for time in times if abs(time) <= abs(end)] or [time * end / times[-1] for time in times]
    count = min(most, len(early))
    return [early[len(early) * i // count - 1] for i in range(1, count + 1)]


def escape_band(own: Fraction, escapes: Sequence[Fraction], rate: float, bits: int) -> float:
    """The band in decades of an escape time of a run with ``bits`` bits, from those of reruns in double.

    The rounding noise of an escape time is added to it, some ln 2/rate in every format.
    """
    time, gained = float(own), (bits - DOUBLE.bits) * math.log(2) / rate
    return duration_band([float(escape) for escape in escapes], time, time - gained)


def _short(problem: Problem) -> Problem:
    return replace(problem, parameters=_each(problem.parameters, lambda value: round_to(value, _FACTOR_BITS)))


def _each(p: Parameters, change: Callable[[Fraction], Fraction]) -> Parameters:
    """The parameters with every number changed that is proportional to a mass: λ of the gyrostat stays."""
    inertia, moment = (tuple(map(change, part)) for part in (p.inertia, p.moment))
    rotor = tuple(map(change, p.rotor)) if isinstance(p.rotor, tuple) else p.rotor
    return p._replace(inertia=inertia, moment=moment, rotor=rotor)


def banded(run: Trajectory, metrics: Metrics, reruns: Sequence[Metrics]) -> Metrics:
    """The metrics with the bands of the reruns, the run itself beside them in units of its eps."""
    coarser = math.log10(2) * (run.problem.precision.bits - DOUBLE.bits)
    own = {
        name: metric if metric.log10 is None else replace_struct(metric, log10=metric.log10 + coarser)
        for name, metric in metrics.items()
    }
    widths = bands(reruns, _FLOOR, own)
    return {name: replace_struct(metric, band=widths.get(name)) for name, metric in metrics.items()}
