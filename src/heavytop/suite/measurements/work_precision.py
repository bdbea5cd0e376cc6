"""Seconds against error: one integrator at one tolerance, over a horizon, held against the known motion."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache, lru_cache
from statistics import median
from time import perf_counter, sleep
from typing import Any

import msgspec

from heavytop.errors import PeerFailed
from heavytop.exact.solution import ExactSolution
from heavytop.integrate import peers
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.known import Known, known_motion
from heavytop.measure.scalar import metric, of_fraction
from heavytop.measure.scorer import Scorer
from heavytop.precision import exact, number, parse
from heavytop.records import Metric, Row
from heavytop.suite.measurements.computed import computed_row
from heavytop.suite.measurements.shared import case_of, peer_failure, time_text
from heavytop.suite.task import Task
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import State

_ENOUGH_SECONDS = 0.3
_RUNS = range(3, 101)
_REST = 0.002
"""Seconds of sleep before a run: it then starts on a fresh slice of the processor's time."""
_TOO_LONG = 3.0
"""A run of so many seconds is timed once."""
MISSING = Metric("missing", None)


def work_precision(task: Task) -> Row:
    """error_final and error_max (largest component, at the end and over the samples), return_error, and drift.

    seconds: ``run`` is the median and ``least`` the fastest of ``repeats`` runs to the end alone; ``compile`` is apart.
    Where the integrator fails, the row says how, and holds nothing else.
    """
    try:
        return _measured(task)
    except PeerFailed as error:
        return peer_failure(task, error.cause)


def _measured(task: Task) -> Row:
    case, precision = case_of(task), parse(task.precision)
    name, setting = _setting(task.form)
    problem = Problem.of(case.top, case.start, precision, case.system)
    # found before the runs: looking through the installed packages empties the caches of the processor
    peer = peers.ready(name, setting)

    def integrate(times: Any, start: State = case.start) -> Trajectory:
        top = case.top if start is case.start else problem.top
        return peer(top, start, times, precision, system=case.system)

    seconds, alone = _timed(lambda: integrate(task.times[-1:]))
    sampled = integrate(task.times)
    metrics, series, against = _held(task, problem, sampled)
    done = alone.outcome is Outcome.SUCCESS and sampled.outcome is Outcome.SUCCESS
    if case.system is HEAVY_TOP:
        metrics["return_error"] = _returned(problem, alone, integrate) if done else MISSING
    if not done:
        metrics["error_final"] = MISSING
    run = replace(alone, times=sampled.times, states=sampled.states, seconds=seconds)
    if not done and alone.outcome is Outcome.SUCCESS:
        run = replace(run, outcome=sampled.outcome, time_reached=sampled.time_reached)
    row = computed_row(task, run, metrics, series, against)
    return msgspec.structs.replace(row, integrator=task.form, evaluations=run.evaluations)


def _setting(form: str) -> tuple[str, tuple[str, Fraction] | None]:
    """The integrator of a form such as ``scipy:DOP853 tolerance=1e-9``, and its setting."""
    name, _, rest = form.partition(" ")
    knob, _, text = rest.partition("=")
    return name, None if text == "eps" else (knob, exact(text))


def _timed(integrate: Any) -> tuple[dict[str, float], Trajectory]:
    """Median seconds of several runs after one to warm up, and one of the runs."""
    run: Trajectory = integrate()
    compile_seconds = run.seconds["compile"]
    began, spent = perf_counter(), [run.seconds["run"]]
    if spent[0] < _TOO_LONG and run.outcome is Outcome.SUCCESS:
        spent = []
        while len(spent) < _RUNS[-1] and (len(spent) < _RUNS[0] or perf_counter() - began < _ENOUGH_SECONDS):
            sleep(_REST)
            run = integrate()
            spent.append(run.seconds["run"])
    figures = {"compile": compile_seconds, "run": median(spent), "least": min(spent), "repeats": float(len(spent))}
    return figures, run


def _held(task: Task, problem: Problem, run: Trajectory) -> tuple[dict[str, Metric], Any, str]:
    keep = [exact(number(time, problem.precision)) for time in task.keep]
    horizon = exact(number(task.times[-1], problem.precision))
    scorer = Scorer(problem, horizon, keep, _known(problem, horizon))
    for time, state in zip(run.times, run.states, strict=True):
        scorer(time, state)
    metrics = {key: value for key, value in scorer.drift.metrics().items() if key.endswith("_max")}
    if scorer.error is not None and run.times:
        both = [scorer.error.running[part] for part in ("omega", "gamma")]
        metrics["error_final"] = metric(both[0].final.max(both[1].final))
        metrics["error_max"] = metric(both[0].maximum.max(both[1].maximum))
    elif scorer.error is not None:
        metrics["error_max"] = MISSING
    return metrics, scorer.series(time_text), scorer.against


def _returned(problem: Problem, run: Trajectory, integrate: Any) -> Metric:
    """How far from the start the way back ends, largest component.

    The way back is the way on from (−Ω, γ): the heavy top is reversible, (Ω, γ, t) -> (−Ω, γ, −t).
    """
    end = [exact(value) for value in run.states[-1]]
    back = integrate([run.times[-1]], State([-value for value in end[:3]], end[3:]))
    if back.outcome is not Outcome.SUCCESS:
        return MISSING
    signs = (-1, -1, -1, 1, 1, 1)
    pairs = zip(signs, back.states[-1], problem.start.flat, strict=True)
    return of_fraction(max(abs(sign * exact(value) - start) for sign, value, start in pairs))


class _Remembered:
    """A known motion whose states are worked out once for all integrators that are held against it."""

    def __init__(self, solution: ExactSolution) -> None:
        self.solution = solution
        self.state = cache(solution.state)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.solution, name)


@lru_cache(maxsize=8)
def _known(problem: Problem, horizon: Fraction) -> Known | str:
    found = known_motion(problem, horizon)
    return found if isinstance(found, str) else replace(found, solution=_Remembered(found.solution))
