"""An integrator as the measurements call it: by its name, one motion or many, whatever it offers."""

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
from heavytop.precision import Array, decimal_text, exact
from heavytop.records import UNRESOLVED_SECONDS, Law, Metric, Quantity, Series
from heavytop.top.heavy_top import State

# The seconds that an integrator takes, and whether what one of another package says of its runs can be.
#
# One of another package is believed nothing that can be measured.  It is timed by the clock here, in calls from starts
# that lie units in the last place apart, so that no call repeats an earlier one; each of them must end where the run
# ends whose error is measured.


_REST = 0.002
"""Seconds of sleep before a run: it then starts on a fresh slice of the processor's time."""
TOO_LONG = 3.0
"""A run of so many seconds is timed once."""
_FURTHER = 10
"""Times the error of a run and what a change of its start in the last places makes, which the end of another may be
off."""
_KEPT = 5.0
"""Times as fast: calls that are so much quicker than those from starts further away were not computed."""
_LOOKS = 12
"""Calls from further away, of which every one must be slow."""
_ENOUGH_AS_QUICK = 3
"""So many of them are as quick as an equal call made then: on a busy machine both wait for the processor."""
_AFAR = 512
"""A start is far from those of the other calls that is off by this part of itself."""
_KEPT_SECONDS = 1e-3
"""Shorter calls are not looked at for that: a pause of the machine is as long."""
_ANGLE_OF_ORDER = 4
"""Radians of a step by which a method of order p hardly errs by less than its size: as many times p + 1, generously.
The remainder of the exponential's series of order p is (θ e/(p + 1))^(p + 1) about."""

Integrate = Callable[..., Trajectory]
"""(times, start): a run over the times, from another start where one is given."""
Figures = dict[str, float]


class Repeats(NamedTuple):
    """How often a run is timed: ``least`` times, or up to ``most`` until ``enough`` seconds have gone.

    slow: of a run that takes long.  band: whether the scatter of the runs is measured.
    """

    least: int
    most: int
    enough: float
    slow: int = 1
    band: bool = False


def timed(run: Callable[[int], Trajectory], how: Repeats) -> tuple[Figures, list[Trajectory]]:
    """Median seconds of several runs, and the runs; ``run`` is given their numbers, from 1 on.

    The band is half of the interval in decades that holds the middle 95 % of the runs.
    """
    began, runs = perf_counter(), [run(1)]
    least, most = (how.least, how.most) if runs[0].seconds["run"] < TOO_LONG else (how.slow, how.slow)
    while (
        runs[0].outcome is Outcome.SUCCESS
        and len(runs) < most
        and (len(runs) < least or perf_counter() - began < how.enough)
    ):
        sleep(_REST)
        runs.append(run(len(runs) + 1))
    spent = [run.seconds["run"] for run in runs]
    figures = {"run": median(spent), "least": min(spent), "repeats": float(len(spent))}
    figures |= next(({key: run.seconds[key]} for run in runs if (key := UNRESOLVED_SECONDS) in run.seconds), {})
    if how.band and len(spent) > 1 and min(spent) > 0:
        low, high = numpy.quantile(numpy.log10(spent), [0.025, 0.975])
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
    """Seconds of runs to the end alone of an integrator of another package, and such a run from the start itself.

    judged: the run over all times whose ``error`` was measured, None where it is not known.  how: as in :func:`timed`.
    Raises PeerFailed where equal calls differ, where calls are answered from memory, and where a run that is timed ends
    elsewhere than the one that is judged.
    """
    times = judged.times
    again = integrate(times)
    require_equal(name, judged, again)
    alone = integrate(times[-1:])
    how = how._replace(least=max(how.least, 2), most=max(how.most, 2))
    figures, runs = timed(lambda j: integrate(times[-1:], _nudged(problem, j)), how)
    most = _allowed(problem, judged, len(runs), error)
    for run, what in [
        (alone, "asked for its last time alone"),
        *((run, "from a start units in the last place away") for run in runs),
    ]:
        _require_near(name, run, judged, most, what, len(times))
    if len(runs) > 1:
        _require_computed(name, integrate, problem, runs)
    compiling = max(0.0, judged.seconds["run"] - again.seconds["run"]) + max(0.0, alone.seconds["run"] - figures["run"])
    return {"compile": compiling} | figures, alone


def _nudged(problem: Problem, count: int) -> State:
    """A start ``count`` units in the last place away, for which no run has been kept."""
    return _moved(problem, count * problem.precision.eps)


def _moved(problem: Problem, part: Fraction) -> State:
    """A start with Ω larger by a part of it, or γ where Ω is 0: where γ is parallel to M, it stays so."""
    start = problem.start if problem.given is None else problem.given[1]
    if not any(start.omega):
        return State(start.omega, [(1 + part) * value for value in start.gamma])
    return State([(1 + part) * value for value in start.omega], start.gamma)


def _allowed(problem: Problem, judged: Trajectory, count: int, error: Fraction | None) -> Fraction | None:
    """How far the last states of two runs may be apart, largest component; None where heyoka does not get there."""
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
    known = _distance(judged, ends[0]) if error is None else error
    return _FURTHER * (known + _distance(*ends) + problem.precision.eps)


def _distance(one: Trajectory, other: Trajectory) -> Fraction:
    """The distance of the last states, largest component."""
    return max(abs(exact(a) - exact(b)) for a, b in zip(one.states[-1], other.states[-1], strict=True))


def _require_near(name: str, run: Trajectory, judged: Trajectory, most: Fraction | None, what: str, count: int) -> None:
    if run.outcome is not Outcome.SUCCESS:
        raise PeerFailed(f"{name} ended as {run.outcome.value} {what}, and as success asked for {count} times")
    if most is not None and (off := _distance(run, judged)) > most:
        raise PeerFailed(
            f"{name}, {what}, ended {decimal_text(off, 2)} away from where it ended asked for {count} times, "
            f"which its error explains up to {decimal_text(most, 2)}: the seconds are those of another run"
        )


def _require_computed(name: str, integrate: Integrate, problem: Problem, runs: Sequence[Trajectory]) -> None:
    """Raises PeerFailed where a call is answered otherwise when it is made again, or much sooner than from afar."""
    times = runs[0].times
    equal = [integrate(times, _nudged(problem, 1)) for _ in range(2)]
    for run in equal:
        require_equal(name, runs[0], run)
    groups = (equal, "it was asked again"), (runs[1:], "it was asked from starts next to one that it knew")
    quick, what = min((max(run.seconds["run"] for run in group), what) for group, what in groups)
    afar, as_quick = math.inf, 0
    for step in range(1, _LOOKS + 1):  # a busy machine slows a call or two, not every one
        known, unknown = (
            _rested(integrate, times, start) for start in (_nudged(problem, 1), _moved(problem, Fraction(step, _AFAR)))
        )
        afar = min(afar, unknown)
        as_quick += unknown <= _KEPT * known
        if afar <= max(_KEPT_SECONDS, quick * _KEPT) or as_quick == _ENOUGH_AS_QUICK:
            return
    raise PeerFailed(
        f"{name} took {afar:.2g} s or more from starts that it did not know, and {quick:.2g} s or less when {what}: "
        "it keeps results between calls"
    )


def _rested(integrate: Integrate, times: Sequence[Fraction], start: State) -> float:
    """Seconds of a call behind a rest, after which a program has to be woken."""
    sleep(_REST)
    return float(integrate(times, start).seconds["run"])


def require_counts(name: str, run: Trajectory, control: tuple[str, Fraction] | None) -> None:
    """Raises PeerFailed where a run to its end cannot have taken as few steps as it says.

    A motion takes a step at least, and steps are no fewer than half of those that a step size asks for.
    """
    if NOT_COUNTED.items() <= run.flags.items():
        return
    span = abs(run.times[-1])
    start = run.problem.start.flat
    if not run.steps and any(tuple(map(exact, state))[:6] != start for state in run.states):
        raise PeerFailed(f"{name} counts its steps wrongly: it moved, and says that it took no step")
    if control is not None and control[0] == "step" and 0 < 2 * run.steps < span / control[1]:
        raise PeerFailed(
            f"{name} counts its steps wrongly: {run.steps} over {decimal_text(span, 6)}, where each is "
            f"{decimal_text(control[1], 3)}"
        )


def doubtful_counts(run: Trajectory, error: Fraction | None) -> str:
    """In a sentence, that its steps do not explain how small the ``error`` of a run is; "" where they do.

    One step of a method of order p is off by (θ/(4 (p + 1)))^(p + 1) of the state about, where the motion turns by θ in
    it.  That refutes no count: there are motions on which a method is exact, and steps that do not evaluate the field.
    """
    if NOT_COUNTED.items() <= run.flags.items() or not run.steps:
        return ""
    if run.evaluations is not None and run.evaluations < run.steps:
        return f"It counts {run.steps} steps, and {run.evaluations} evaluations of the field."
    if error is None or not run.order:
        return ""
    states = numpy.array([[float(exact(value)) for value in state] for state in (run.problem.start.flat, *run.states)])
    angle = _rate(run.problem, states) * float(abs(run.times[-1])) / run.steps
    least = min(1.0, angle / (_ANGLE_OF_ORDER * (run.order + 1))) ** (run.order + 1) * numpy.abs(states).max()
    if error >= exact(float(least)):
        return ""
    return (
        f"It counts {run.steps} steps of {angle:.2g} rad: of order {run.order} they would be off by {least:.1g}, and "
        f"it is off by {decimal_text(error, 2)}: it is exact on this motion, or takes more steps than it counts."
    )


def _rate(problem: Problem, states: Any) -> float:
    """The angular rate of the motion: the median over states of |y'|/|y| of Ω or of γ, whichever is faster."""
    p = problem.parameters
    plain = p.mapped(float)
    rates = numpy.array([problem.system.field(plain, state) for state in states], dtype=float)
    parts = [
        (numpy.linalg.norm(rates[:, i : i + 3], axis=1), numpy.linalg.norm(states[:, i : i + 3], axis=1))
        for i in (0, 3)
    ]
    return max(float(numpy.median(numpy.divide(a, b, out=numpy.zeros_like(a), where=b > 0))) for a, b in parts)


# An ensemble of motions: each scored as it goes by, then how their errors grow, and by what law.


_DIGITS = 6
_ACCUMULATES = {"along": 2, "across": 1, "omega": 2, "gamma": 2}
"""For each error: 1 where a fault a step adds up like n, 2 where it adds up like n²."""


class Ended(msgspec.Struct, frozen=True):
    """The record of one start whose motion has ended.

    values: by the key of each quantity, at the samples that it reached, as far as there is a truth; None where that is
    not finite.  The rest as in :class:`heavytop.integrate.trajectory.Trajectory`.
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
        """The record of a run that went to ``scorer``."""
        running = scorer.running()
        values = {q.text: [_finite(kept) for kept in run.kept.values()] for q, run in running.items()}
        lost = run.outcome is Outcome.SUCCESS and any(None in kept for kept in values.values())
        return cls(
            run.integrator,
            (Outcome.NON_FINITE if lost else run.outcome).value,
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
    """Compute those of the motions that are missing, all side by side; save after each.  options: the integrator's."""
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
    """The results of an ensemble: metrics, each a root mean square over the starts, series and their laws."""

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
    """How every drift grows, and every error where there is a reference.

    times: exact, shape (samples,), as they are asked for.  distance: of the centre of mass from the fixed point.
    """
    steps = sum(motion.steps for motion in motions) / len(motions)
    step = float(times[-1]) / steps if steps else 0.0
    results, moments = Growing({}, {}, {}), numpy.array([float(abs(time)) for time in times])

    def add(quantity: Quantity, sizes: Array, samples: int, accumulates: int, blur: Array | float = 0.0) -> None:
        """Take in a quantity.  sizes: of it in each motion, shape (starts,)."""
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
        # over the starts that reached the end, of the largest of their values
        results.metrics[RELATIVE] = _metric(values[numpy.isfinite(values).all(axis=1)].max(axis=1), True)
    return results


def _errors(
    starts: Sequence[State], motions: Sequence[Ended], distance: float
) -> Iterator[tuple[Quantity, Array, int]]:
    """The error of Ω and γ, of its parts, and of attitude and position where every motion has them: size in each
    motion, and how it accumulates.
    """
    omega = numpy.linalg.norm([[float(w) for w in start.omega] for start in starts], axis=1)
    one = numpy.ones(len(starts))
    state_sizes = numpy.hypot(omega, one)
    sizes = {"along": state_sizes, "across": state_sizes, "omega": omega, "gamma": one}
    for part, accumulates in _ACCUMULATES.items():
        yield Quantity(SOLUTION_ERROR, part), sizes[part], accumulates
    for quantity, size in ((ATTITUDE, one), (POSITION, distance * one)):
        if all(quantity.text in motion.values for motion in motions):
            yield quantity, size, 2


def _values(quantity: Quantity, samples: int, motions: Sequence[Ended]) -> Array:
    """Errors at the samples, shape (starts, samples); NaN where a motion did not come that far."""
    errors = numpy.full((len(motions), samples), numpy.nan)
    for row, motion in zip(errors, motions, strict=True):
        values = motion.values.get(quantity.text, [])
        row[: len(values)] = values
    return errors


def _add(growing: Growing, quantity: Quantity, ensemble: Ensemble, times: list[str]) -> None:
    """RMS over starts of the largest and of the final value, the RMS over time, and its law."""
    kept = ensemble.errors[ensemble.healthy]
    rms, name = ensemble.rms(), quantity.text
    texts = [_text(value, len(kept) > 0) for value in rms]
    growing.series[name] = Series(times, texts, quantity)
    for part, values in (("max", kept.max(axis=1)), ("final", kept[:, -1])):
        resolved = len(kept) > 0 and not (part == "final" and numpy.isnan(rms[-1]))
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
