"""Timed runs of integrators, checks of their seconds and counts, and ensembles with their growth laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from statistics import median
from time import perf_counter, sleep
from typing import Any, NamedTuple

import msgspec
import numpy
from flint import arb

from heavytop.errors import HeavyTopError, PeerFailed
from heavytop.integrate.heyoka import motions
from heavytop.integrate.peers.command import NOT_COUNTED
from heavytop.integrate.peers.contract import require_equal
from heavytop.integrate.registry import Integrator
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.attitude_error import ATTITUDE, POSITION
from heavytop.measure.growth import Ensemble, band, law, root_mean_square
from heavytop.measure.running import TimeText
from heavytop.measure.scalar import RELATIVE, UNRESOLVED, of_fraction
from heavytop.measure.scorer import SOLUTION_ERROR, Scorer
from heavytop.measure.truth import EnsembleReference
from heavytop.precision import Array, decimal_text, exact, six_digits, two_digits
from heavytop.records import UNRESOLVED_SECONDS, Law, Metric, Quantity, Series
from heavytop.top.heavy_top import State

# Seconds of an integrator, and plausibility of what a third-party integrator reports.
#
# Nothing that can be measured is taken from a third-party integrator.  Its calls are timed here, from starts that lie
# units in the last place apart, so that no call repeats an earlier one; each must end where the run ends whose error is
# measured.


_PAUSE = 0.002
"""Seconds of sleep before a run, which then starts with a new time slice of the processor."""
TOO_LONG = 3.0
"""A run that takes so many seconds is timed once."""
_MARGIN = 10
"""Two ends may differ by so many times the error of a run plus the effect of the last places of its start."""
_FASTER = 5.0
"""Calls that are so many times as fast as those from distant starts were not computed."""
_DISTANT_CALLS = 12
"""Calls from distant starts, each of which must be slow."""
_ENOUGH_AS_QUICK = 3
"""So many of these as quick as a repeated call acquit: on a busy machine both wait for the processor."""
_DISTANT = 512
"""Distant starts differ from those of the other calls by multiples of 1/512 of themselves."""
_CHECKED_SECONDS = 1e-3
"""Shorter calls are not checked: a pause of the machine is as long."""
_ANGLE_OF_ORDER = 4
"""A method of order p loses all digits in steps of about so many times p + 1 radians, a generous bound.
The remainder of the exponential's series of order p is about (θ e/(p + 1))^(p + 1)."""

Integrate = Callable[..., Trajectory]
"""(times, start): a run over the times; the start may be left out for that of the problem."""
Figures = dict[str, float]


class Repeats(NamedTuple):
    """Number of timed runs: ``least``, or up to ``most`` until ``enough`` seconds have passed.

    slow: the number of a slow run.  band: whether the scatter of the runs is measured.
    """

    least: int
    most: int
    enough: float
    slow: int = 1
    band: bool = False


def timed(run: Callable[[int], Trajectory], how: Repeats) -> tuple[Figures, list[Trajectory]]:
    """Median seconds of several runs, and the runs; ``run`` is called with 1, 2, ...

    The band is half of the central 95 % interval of the runs, in decades.
    """
    began, runs = perf_counter(), [run(1)]
    least, most = (how.least, how.most) if runs[0].seconds["run"] < TOO_LONG else (how.slow, how.slow)
    while (
        runs[0].outcome is Outcome.SUCCESS
        and len(runs) < most
        and (len(runs) < least or perf_counter() - began < how.enough)
    ):
        sleep(_PAUSE)
        runs.append(run(len(runs) + 1))
    seconds = [run.seconds["run"] for run in runs]
    figures = {"run": median(seconds), "least": min(seconds), "repeats": float(len(seconds))}
    figures |= next(({key: run.seconds[key]} for run in runs if (key := UNRESOLVED_SECONDS) in run.seconds), {})
    if how.band and len(seconds) > 1 and min(seconds) > 0:
        low, high = numpy.quantile(numpy.log10(seconds), [0.025, 0.975])
        figures["band"] = round(float(high - low) / 2, 4)
    return figures, runs


def tried(
    name: str,
    problem: Problem,
    integrate: Integrate,
    judged: Trajectory,
    error: Fraction | None,
    how: Repeats,
) -> tuple[Figures, Trajectory]:
    """Seconds of a third-party integrator to the last time alone, and such a run from the start itself.

    Runs over all times are timed where the run to the last time alone ends elsewhere than ``judged``: samples shorten
    the steps of a method that is set by a tolerance.
    judged: the run over all times.  error: of ``judged``, None if unknown.  how: as in :func:`timed`.
    Raises PeerFailed if equal calls differ, if results are kept between calls, and if a timed run ends elsewhere than
    ``judged``.
    """
    how = how._replace(least=max(how.least, 2), most=max(how.most, 2))
    times, allowed = judged.times, _tolerated(problem, judged, how.most, error)
    again = integrate(times)
    require_equal(name, judged, again)
    alone = integrate(times[-1:])
    _require_success(name, alone, "asked for its last time alone", len(times))
    kept = alone if allowed is None or _distance(alone, judged) <= allowed else again
    figures, runs = timed(lambda j: integrate(kept.times, _nudged(problem, j)), how)
    for run in runs:
        _require_near(name, run, judged, allowed, "from a start that differs in the last place", len(times))
    if len(runs) > 1:
        _require_computed(name, integrate, problem, runs)
    compiling = max(0.0, judged.seconds["run"] - again.seconds["run"]) + max(0.0, alone.seconds["run"] - figures["run"])
    return {"compile": compiling} | figures, kept


def _nudged(problem: Problem, count: int) -> State:
    """A start ``count`` units in the last place away, from which no result can have been kept."""
    return _moved(problem, count * problem.precision.eps)


def _moved(problem: Problem, part: Fraction) -> State:
    """A start with Ω scaled by 1 + ``part``, or γ if Ω is 0; if γ is parallel to M, it stays so."""
    start = problem.start if problem.given is None else problem.given[1]
    if not any(start.omega):
        return State(start.omega, [(1 + part) * value for value in start.gamma])
    return State([(1 + part) * value for value in start.omega], start.gamma)


def _tolerated(problem: Problem, judged: Trajectory, count: int, error: Fraction | None) -> Fraction | None:
    """The largest allowed distance of the last states of two runs; None if heyoka does not reach the end."""
    top, start = problem.given or (problem.top, problem.start)
    try:
        ends = [
            motions.propagate(top, nudged, judged.times[-1:], problem.precision, system=problem.system)
            for nudged in (start, _nudged(problem, count))
        ]
    except HeavyTopError:
        return None
    if any(run.outcome is not Outcome.SUCCESS for run in ends):
        return None
    error_of_run = _distance(judged, ends[0]) if error is None else error
    return _MARGIN * (error_of_run + _distance(*ends) + problem.precision.eps)


def _distance(first: Trajectory, second: Trajectory) -> Fraction:
    """The maximum norm of the difference of the last states."""
    return max(abs(exact(a) - exact(b)) for a, b in zip(first.states[-1], second.states[-1], strict=True))


def _require_success(name: str, run: Trajectory, what: str, count: int) -> None:
    if run.outcome is not Outcome.SUCCESS:
        raise PeerFailed(f"{name} ended as {run.outcome.value} {what}, and as success asked for {count} times")


def _require_near(name: str, run: Trajectory, judged: Trajectory, most: Fraction | None, what: str, count: int) -> None:
    _require_success(name, run, what, count)
    if most is not None and (off := _distance(run, judged)) > most:
        raise PeerFailed(
            f"{name}, {what}, ends {two_digits(off)} away from its run with {count} times, of which its error "
            f"explains up to {two_digits(most)}: the seconds are those of another run"
        )


def _require_computed(name: str, integrate: Integrate, problem: Problem, runs: Sequence[Trajectory]) -> None:
    """Raise PeerFailed if a repeated call differs, or is much faster than one from a distant start."""
    times = runs[0].times
    equal = [integrate(times, _nudged(problem, 1)) for _ in range(2)]
    for run in equal:
        require_equal(name, runs[0], run)
    groups = (equal, "it was asked again"), (runs[1:], "it was asked from starts next to one that it knew")
    quick, what = min((max(run.seconds["run"] for run in group), what) for group, what in groups)
    afar, as_quick = math.inf, 0
    for step in range(1, _DISTANT_CALLS + 1):  # a busy machine slows a call or two, not every one
        known, unknown = (
            _after_pause(integrate, times, start)
            for start in (_nudged(problem, 1), _moved(problem, Fraction(step, _DISTANT)))
        )
        afar = min(afar, unknown)
        as_quick += unknown <= _FASTER * known
        if afar <= max(_CHECKED_SECONDS, quick * _FASTER) or as_quick == _ENOUGH_AS_QUICK:
            return
    raise PeerFailed(
        f"{name} took {afar:.2g} s or more from starts that it did not know, and {quick:.2g} s or less when {what}: "
        "it keeps results between calls"
    )


def _after_pause(integrate: Integrate, times: Sequence[Fraction], start: State) -> float:
    """Seconds of a call after a pause, in which an idle program falls asleep."""
    sleep(_PAUSE)
    return float(integrate(times, start).seconds["run"])


def require_counts(name: str, run: Trajectory, control: tuple[str, Fraction] | None) -> None:
    """Raise PeerFailed if a run to its end cannot have taken as few steps as it reports.

    A motion takes at least one step, and with a step size at least half of the steps that the size implies.
    """
    if NOT_COUNTED.items() <= run.flags.items():
        return
    span = abs(run.times[-1])
    start = run.problem.start.flat
    if not run.steps and any(tuple(map(exact, state))[:6] != start for state in run.states):
        raise PeerFailed(f"{name} counts its steps wrongly: it moved, but reports 0 steps")
    if control is not None and control[0] == "step" and 0 < 2 * run.steps < span / control[1]:
        raise PeerFailed(
            f"{name} counts its steps wrongly: {run.steps} over {six_digits(span)}, where each is "
            f"{decimal_text(control[1], 3)}"
        )


def doubtful_counts(run: Trajectory, error: Fraction | None, coarse: Callable[[], Fraction | None]) -> str:
    """A sentence if the counts of a run do not explain how small its ``error`` is, else "".

    coarse: the error in steps twice as long, which shows whether the order is higher than declared; None if unknown.

    A step of a method of order p through an angle θ has a relative error of about (θ/(4 (p + 1)))^(p + 1).  This does
    not refute a count: the order may be declared too low, a method may be exact on a motion, and a step may need no
    evaluation of the field.
    """
    if NOT_COUNTED.items() <= run.flags.items() or not run.steps:
        return ""
    if run.evaluations is not None and run.evaluations < run.steps:
        return f"It counts {run.steps} steps, and {run.evaluations} evaluations of the field."
    if error is None or not run.order:
        return ""
    states = numpy.array([[float(exact(value)) for value in state] for state in (run.problem.start.flat, *run.states)])
    angle = _rate(run.problem, states) * float(abs(run.times[-1])) / run.steps
    bound = min(1.0, angle / (_ANGLE_OF_ORDER * (run.order + 1))) ** (run.order + 1) * numpy.abs(states).max()
    if error >= exact(float(bound)):
        return ""
    twice, cause = coarse(), "its order is higher than declared"
    if not (twice and error and twice > error * 2 ** (run.order + 1)):
        cause += ", it is exact on this motion, or it takes more steps than it counts"
    return (
        f"It counts {run.steps} steps of {angle:.2g} rad: of order {run.order} they would be off by more than "
        f"{bound:.1g}, and it is off by {two_digits(error)}: {cause}."
    )


def _rate(problem: Problem, states: Any) -> float:
    """The angular rate of the motion: the median over states of |y'|/|y|, the larger one of Ω and γ."""
    p = problem.parameters
    parameters = p.mapped(float)
    rates = numpy.array([problem.system.field(parameters, state) for state in states], dtype=float)
    parts = [
        (numpy.linalg.norm(rates[:, i : i + 3], axis=1), numpy.linalg.norm(states[:, i : i + 3], axis=1))
        for i in (0, 3)
    ]
    return max(float(numpy.median(numpy.divide(a, b, out=numpy.zeros_like(a), where=b > 0))) for a, b in parts)


# Ensembles: each motion is scored while it is computed, then growth laws are fitted to their errors.


_DIGITS = 6
_ACCUMULATES = {"along": 2, "across": 1, "omega": 2, "gamma": 2}
"""By error: 1 if a fault per step accumulates like n, 2 if like n²."""


class Ended(msgspec.Struct, frozen=True):
    """The record of a finished motion of an ensemble.

    values: by the key of each quantity, at the samples that it reached and the reference covers; None for a value that
    is not finite.  Other fields as in :class:`heavytop.integrate.trajectory.Trajectory`.
    """

    integrator: str
    outcome: str
    time_reached: str
    steps: int
    order: int
    compile: float
    flags: dict[str, str]
    values: dict[str, list[float | None]]

    @classmethod
    def of(cls, run: Trajectory, scorer: Scorer) -> Ended:
        """The record of a run whose states ``scorer`` has measured."""
        running = scorer.running()
        values = {q.text: [_finite(value) for value in run.kept.values()] for q, run in running.items()}
        non_finite = run.outcome is Outcome.SUCCESS and any(None in part for part in values.values())
        return cls(
            run.integrator,
            (Outcome.NON_FINITE if non_finite else run.outcome).value,
            str(run.time_reached),
            run.steps,
            run.order,
            run.seconds["compile"],
            run.flags,
            values,
        )


def _finite(value: arb) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def complete(
    motions: dict[int, Ended],
    problems: Sequence[Problem],
    times: Sequence[Fraction],
    scorers: Sequence[Scorer],
    save: Callable[[], None],
    integrator: Integrator,
    options: Mapping[str, Any],
) -> None:
    """Compute the missing motions as an ensemble; save after each.  options: of the integrator."""
    missing = [index for index in range(len(problems)) if index not in motions]

    def observe(index: int, time: Fraction, state: Any) -> None:
        scorers[missing[index]](time, state)

    def finished(index: int, run: Trajectory) -> None:
        motions[missing[index]] = Ended.of(run, scorers[missing[index]])
        save()

    if missing:
        todo = [problems[index] for index in missing]
        integrator.propagate_many(todo, times, observe, finished, **options)


@dataclass(slots=True)
class Growing:
    """The results of an ensemble: metrics and series, root mean squares over the starts, and growth laws."""

    metrics: dict[Quantity, Metric]
    series: dict[str, Series]
    laws: dict[str, Law]


def growing(
    starts: Sequence[State],
    times: Sequence[Fraction],
    motions: Sequence[Ended],
    scorers: Sequence[Scorer],
    reference: EnsembleReference,
    time_text: TimeText,
    distance: float = 0.0,
) -> Growing:
    """The growth of each drift, and of each error if there is a reference.

    times: exact, shape (samples,), as requested.  distance: of the centre of mass from the fixed point.
    """
    steps = sum(motion.steps for motion in motions) / len(motions)
    step = float(times[-1]) / steps if steps else 0.0
    results, moments = Growing({}, {}, {}), numpy.array([float(abs(time)) for time in times])

    def add(quantity: Quantity, sizes: Array, samples: int, accumulates: int, blur: Array | float = 0.0) -> None:
        """Add the results of a quantity.  sizes: its size in each motion, shape (starts,)."""
        values = _values(quantity, samples, motions)
        ensemble = Ensemble(moments[:samples], values, step, resolution=blur, accumulates=accumulates)
        if ensemble.healthy.any():
            ensemble = replace(ensemble, size=float(root_mean_square(sizes[ensemble.healthy])) or 1.0)
        _add(results, quantity, ensemble, list(map(time_text, times[:samples])))

    for quantity in scorers[0].drift.quantities():
        initial = numpy.array([float(scorer.drift.initial[quantity.component]) for scorer in scorers])
        add(quantity, initial, len(times), 1)
    if any(scorer.error for scorer in scorers) and reference.samples:
        blur = numpy.array(reference.blur)
        for quantity, sizes, accumulates in _errors(starts, motions, distance):
            add(quantity, sizes, reference.samples, accumulates, blur)
        values = _values(RELATIVE.over(""), reference.samples, motions)
        # RMS over the starts that reached the end, of the maximum of each
        results.metrics[RELATIVE] = _metric(values[numpy.isfinite(values).all(axis=1)].max(axis=1), True)
    return results


def _errors(
    starts: Sequence[State], motions: Sequence[Ended], distance: float
) -> Iterator[tuple[Quantity, Array, int]]:
    """(quantity, size in each motion, accumulation) of the errors of Ω, γ and the state, and of attitude and position
    if every motion has them.
    """
    omega = numpy.linalg.norm([[float(w) for w in start.omega] for start in starts], axis=1)
    ones = numpy.ones(len(starts))
    state_sizes = numpy.hypot(omega, ones)
    sizes = {"along": state_sizes, "across": state_sizes, "omega": omega, "gamma": ones}
    for part, accumulates in _ACCUMULATES.items():
        yield Quantity(SOLUTION_ERROR, part), sizes[part], accumulates
    for quantity, size in ((ATTITUDE, ones), (POSITION, distance * ones)):
        if all(quantity.text in motion.values for motion in motions):
            yield quantity, size, 2


def _values(quantity: Quantity, samples: int, motions: Sequence[Ended]) -> Array:
    """Errors at the samples, shape (starts, samples); NaN beyond the end of a motion."""
    errors = numpy.full((len(motions), samples), numpy.nan)
    for row, motion in zip(errors, motions, strict=True):
        values = motion.values.get(quantity.text, [])
        row[: len(values)] = values
    return errors


def _add(growing: Growing, quantity: Quantity, ensemble: Ensemble, times: list[str]) -> None:
    """Add the RMS over starts of the maximum and of the final value, the series of the RMS, and its law."""
    healthy = ensemble.errors[ensemble.healthy]
    rms, name = ensemble.rms(), quantity.text
    texts = [_text(value, len(healthy) > 0) for value in rms]
    growing.series[name] = Series(times, texts, quantity)
    for part, values in (("max", healthy.max(axis=1)), ("final", healthy[:, -1])):
        resolved = len(healthy) > 0 and not (part == "final" and numpy.isnan(rms[-1]))
        growing.metrics[quantity.over(part)] = _metric(values, resolved)
    growing.laws[name] = msgspec.structs.replace(law(ensemble), quantity=quantity)


def _text(value: float, measured: bool) -> str:
    if not numpy.isfinite(value):
        return UNRESOLVED if measured else "missing"
    return decimal_text(Fraction(float(value)), _DIGITS)


def _metric(values: Array, resolved: bool) -> Metric:
    if not len(values):
        return Metric("missing", None)
    value = float(root_mean_square(values))
    if not resolved:
        return Metric(UNRESOLVED, None, bound=decimal_text(Fraction(value), 3))
    metric = of_fraction(Fraction(value), words=decimal_text(Fraction(value), _DIGITS))
    return msgspec.structs.replace(metric, band=band(values))
