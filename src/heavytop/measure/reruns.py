"""The rounding noise of one trajectory: its motion computed again with other roundings.

Rounding noise is free of scale: the reruns are in double, whatever the format of the run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from operator import mul

from msgspec.structs import replace as replace_struct

from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.measure.rounding_noise import RERUNS, bands, duration_band, factor
from heavytop.measure.scorer import Scorer
from heavytop.measure.truth import Truth, closed_form, uncertified
from heavytop.precision import DOUBLE, exact, number, round_to
from heavytop.records import Metric
from heavytop.top.equations import GYROSTAT, Parameters

_STEPS = 20_000
"""A longer run is rerun over about its first so many steps only."""
_STEPS_SINGLY = 2000
"""The same for an integrator that takes one motion at a time."""
_SAMPLES, _SAMPLES_OF_CHAOS = 32, 64
"""The second without a closed form: of a chaotic motion the last samples with a digit left decide the largest error."""
_BITS = 32
"""Bits of a top whose multiples by 1 + j/2^20 are exact in double: all its reruns then have one reference."""
_FLOOR = math.log10(float(DOUBLE.eps)) - 1

Metrics = dict[str, Metric]


@dataclass(frozen=True, slots=True)
class Reruns:
    """How a run is computed again: in double, from the exact data ``problem``, with the roundings of ``seed``."""

    problem: Problem
    integrator: ChosenIntegrator
    seed: int

    @property
    def possible(self) -> bool:
        """Whether the integrator can be given the same motion with other roundings."""
        return self.problem.system is not GYROSTAT or self.integrator.supports_ensemble

    def drift_bands(self, run: Trajectory, asked: Sequence[Fraction], metrics: Metrics, true: Truth | str) -> Metrics:
        """``metrics`` of a run with their bands; as they are where it failed, or cannot be computed again.

        asked: the times of the run.  true: what its states were compared with, or why with nothing.
        """
        if run.outcome is not Outcome.SUCCESS or not self.possible:
            return metrics
        most = _STEPS if self.integrator.supports_ensemble else _STEPS_SINGLY
        end = asked[-1] if run.steps <= most else asked[-1] * most / run.steps
        if not isinstance(true, str) and not true.covers(end):
            end = true.ends or end
        problem = _short(self.problem)
        samples = _SAMPLES if closed_form(problem) else _SAMPLES_OF_CHAOS
        times = [exact(number(time, DOUBLE)) for time in some_of(asked, end, samples)]
        truth: Truth | str = true if isinstance(true, str) else uncertified(problem, times)
        reruns = self._of(problem, times, lambda given: Scorer(given, truth))
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
        scorers = [scorer(given) for given in problems]
        self.integrator.propagate_many(problems, times, lambda i, time, state: scorers[i](time, state), threads=1)
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
    return duration_band([float(each) for each in escapes], time, time - gained)


def _short(problem: Problem) -> Problem:
    return replace(problem, parameters=_each(problem.parameters, lambda value: round_to(value, _BITS)))


def _each(p: Parameters, change: Callable[[Fraction], Fraction]) -> Parameters:
    """The parameters with every number changed that is proportional to a mass: λ of the gyrostat is none."""
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
    found = bands(reruns, _FLOOR, own)
    return {name: replace_struct(metric, band=found.get(name)) for name, metric in metrics.items()}
