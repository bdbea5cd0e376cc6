"""The noise of a row of one trajectory: its motion computed again with other roundings (heavytop.measure.luck).

Rounding luck is free of scale: the reruns are in double, whatever the format of the row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any, Protocol

import msgspec
from flint import arb

from heavytop.exact.balls import working_precision
from heavytop.integrate.broken import FAULTS
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.drift import Drift
from heavytop.measure.known import closed_form
from heavytop.measure.luck import RERUNS, bands, duration_band, factor
from heavytop.measure.scalar import to_ball
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import DOUBLE, EXTENDED, QUAD, available, exact, number, parse, real, round_to
from heavytop.records import Metric
from heavytop.suite.task import Task
from heavytop.top.integrals import holding

_STEPS = 500_000
"""A longer run is rerun over about its first so many steps only."""
_STEPS_SINGLY = 2000
"""The same for a planted fault, some of which take their steps one by one."""
_SAMPLES = 64
_BITS = 32
"""Bits of a top whose multiples by 1 + j/2^20 are exact in double: all its reruns then have one reference."""
_FLOOR = math.log10(float(DOUBLE.eps)) - 1

Metrics = dict[str, Metric]


class Watch(Protocol):
    """What measures a motion as it goes by."""

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None: ...

    def metrics(self) -> Metrics: ...


class Remembered:
    """A known motion that works out each state once: state(time, bits) as in heavytop.exact.solution."""

    def __init__(self, state: Callable[[Fraction, int], list[arb]]) -> None:
        self.state = cache(state)


def drift_bands(task: Task, run: Trajectory, metrics: Metrics) -> Metrics:
    """``metrics`` of a drift row with their bands, from reruns of its integrator; as they are where it failed."""
    assert task.case is not None
    if run.outcome is not Outcome.SUCCESS:
        return metrics
    case, horizon = task.case, task.times[-1]
    most = _STEPS if task.integrator == "heyoka" else _STEPS_SINGLY
    end = horizon if run.steps <= most else horizon * most / run.steps
    times = [exact(number(end * i / _SAMPLES, DOUBLE)) for i in range(1, _SAMPLES + 1)]
    problem = _short(Problem.of(case.top, case.start, DOUBLE, case.system))
    integrals = holding(case.top, case.start, case.system)
    truth = _truth(problem, times) if any(name.startswith("solution_error") for name in metrics) else None
    reruns = _reruns(problem, task, times, lambda given: _Watched(given, integrals, truth))
    return _banded(task, metrics, reruns)


def homoclinic_bands(task: Task, run: Trajectory, metrics: Metrics, watch: Callable[[Problem], Watch]) -> Metrics:
    """``metrics`` of a homoclinic row with their bands.

    The luck of a break-away time is added to it, some ln 2/rate in every format.
    """
    assert task.case is not None
    if run.outcome is not Outcome.SUCCESS:
        return metrics
    case = task.case
    end = (1.1 * DOUBLE.bits * math.log(2) + 4) / case.rate
    times = [time for time in task.times[3::4] if float(abs(time)) <= end]
    reruns = _reruns(Problem.of(case.top, case.start, DOUBLE, case.system), task, times, watch)
    banded = _banded(task, metrics, reruns)
    own = banded["break_away_time"]
    ends = [float(exact(rerun["break_away_time"].value)) for rerun in reruns if rerun["break_away_time"].log10]
    if own.log10 is not None and len(ends) == len(reruns):
        time, gained = float(exact(own.value)), (run.problem.precision.bits - DOUBLE.bits) * math.log(2) / case.rate
        own.band = duration_band(ends, time, time - gained)
    return banded


def _reruns(
    problem: Problem, task: Task, times: Sequence[Fraction], watch: Callable[[Problem], Watch]
) -> list[Metrics]:
    """The same motion with other roundings; the metrics of each run."""
    p = problem.parameters
    problems = []
    for index in range(1, RERUNS + 1):
        scale = factor(task.seed, index)
        inertia, moment = (tuple(scale * value for value in part) for part in (p.inertia, p.moment))
        problems.append(replace(problem, parameters=p._replace(inertia=inertia, moment=moment)))
    watches = [watch(given) for given in problems]
    if task.integrator == "heyoka":
        propagate_ensemble(problems, times, observer=lambda i, time, state: watches[i](time, state), threads=1)
    else:
        for given, each in zip(problems, watches, strict=True):
            FAULTS[task.integrator].propagate(given.top, given.start, times, DOUBLE, system=given.system, observer=each)
    return [watch.metrics() for watch in watches]


def _short(problem: Problem) -> Problem:
    p = problem.parameters
    inertia, moment = (tuple(round_to(value, _BITS) for value in part) for part in (p.inertia, p.moment))
    return replace(problem, parameters=p._replace(inertia=inertia, moment=moment))


def _truth(problem: Problem, times: Sequence[Fraction]) -> Remembered:
    """The closed form, or a run in a wider format: truth enough for a band."""
    if (known := closed_form(problem)) is not None:
        return Remembered(known.state)
    wider = next(p for p in (EXTENDED, QUAD, real(QUAD.bits)) if not available()[p.family])
    (run,) = propagate_ensemble([replace(problem, precision=wider)], times)
    states = dict(zip(run.times, run.states, strict=True))

    def state(time: Fraction, bits: int) -> list[arb]:
        with working_precision(bits):
            return [to_ball(value) for value in states[time]]

    return Remembered(state)


class _Watched:
    def __init__(self, problem: Problem, integrals: Sequence[Any], truth: Any) -> None:
        self._parts: list[Any] = [Drift(problem, integrals)]
        if truth is not None:
            self._parts.append(SolutionError(problem, truth))

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        for part in self._parts:
            part(time, state)

    def metrics(self) -> Metrics:
        return {name: metric for part in self._parts for name, metric in part.metrics().items()}


def _banded(task: Task, metrics: Metrics, reruns: list[Metrics]) -> Metrics:
    """The metrics with the bands of the reruns, the row's own run beside them in units of its eps."""
    coarser = math.log10(2) * (parse(task.precision).bits - DOUBLE.bits)
    own = {
        name: metric if metric.log10 is None else msgspec.structs.replace(metric, log10=metric.log10 + coarser)
        for name, metric in metrics.items()
    }
    found = bands(reruns, _FLOOR, own)
    return {name: msgspec.structs.replace(metric, band=found.get(name)) for name, metric in metrics.items()}
