"""The seconds that an integrator takes, and whether what one of another package says of its runs can be.

One of another package is believed nothing that can be measured.  It is timed by the clock here, in calls from starts
that lie units in the last place apart, so that no call repeats an earlier one; each of them must end where the run ends
whose error is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from statistics import median
from time import perf_counter, sleep
from typing import Any, NamedTuple

import numpy

from heavytop.errors import HeavyTopError, PeerFailed
from heavytop.integrate import taylor
from heavytop.integrate.peers.command import NOT_COUNTED
from heavytop.integrate.peers.contract import require_equal
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import decimal_text, exact
from heavytop.top.heavy_top import State

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
"""Of them so many that are as quick as an equal call made then: on a busy machine both wait for the processor."""
_AFAR = 512
"""A start is far from those of the other calls that is off by this part of itself."""
_KEPT_SECONDS = 1e-3
"""Shorter calls are not looked at for that: a pause of the machine is as long."""
_ANGLE_OF_ORDER = 4
"""Radians of a step by which a method of order p errs by no less than its size: as many times p + 1, generously.  The
remainder of the exponential's series of order p is (θ e/(p + 1))^(p + 1) about."""

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
    spent = [each.seconds["run"] for each in runs]
    figures = {"run": median(spent), "least": min(spent), "repeats": float(len(spent))}
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
    """A start with Ω and γ larger by a part of them: where γ is parallel to M, it stays so."""
    start = problem.start if problem.given is None else problem.given[1]
    return State([(1 + part) * value for value in start.omega], [(1 + part) * value for value in start.gamma])


def _allowed(problem: Problem, judged: Trajectory, count: int, error: Fraction | None) -> Fraction | None:
    """How far the last states of two runs may be apart, largest component; None where heyoka does not get there."""
    top, start = problem.given or (problem.top, problem.start)
    try:
        ends = [
            taylor.propagate(top, each, judged.times[-1:], problem.precision, system=problem.system)
            for each in (start, _nudged(problem, count))
        ]
    except HeavyTopError:
        return None
    if any(run.outcome is not Outcome.SUCCESS for run in ends):
        return None
    known = _distance(judged, ends[0]) if error is None else error
    return _FURTHER * (known + _distance(*ends) + problem.precision.eps)


def _distance(one: Trajectory, other: Trajectory) -> Fraction:
    """Of the last states, largest component."""
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


def require_counts(name: str, run: Trajectory, setting: tuple[str, Fraction] | None, error: Fraction | None) -> None:
    """Raises PeerFailed where a run to its end cannot have as few steps as it says, with the ``error`` that it has.

    Steps are no fewer than half of those that a step size asks for, and no more than the evaluations of the field.  One
    step of a method of order p is off by (θ/(4 (p + 1)))^(p + 1) of the state at least where the motion turns by θ in
    it; of a run that declares no order, 0, that is not asked, and of one without counts nothing is.
    """
    if NOT_COUNTED.items() <= run.flags.items():
        return
    if reason := next(_impossible_counts(run, setting, error), ""):
        raise PeerFailed(f"{name} counts its steps wrongly: {reason}")


def _impossible_counts(run: Trajectory, setting: tuple[str, Fraction] | None, error: Fraction | None) -> Iterator[str]:
    start, span = run.problem.start.flat, abs(run.times[-1])
    states = numpy.array([[float(exact(value)) for value in state] for state in (start, *run.states)])
    if not run.steps:
        if (states[1:] != states[0]).any():
            yield "it moved, and says that it took no step"
        return
    if run.evaluations is not None and run.evaluations < run.steps:
        yield f"{run.steps}, and {run.evaluations} evaluations of the field"
    if setting is not None and setting[0] == "step" and 2 * run.steps < span / setting[1]:
        yield f"{run.steps} over {decimal_text(span, 6)}, where each is {decimal_text(setting[1], 3)}"
    if error is None or not run.order:
        return
    angle = _rate(run.problem, states) * float(span) / run.steps
    least = min(1.0, angle / (_ANGLE_OF_ORDER * (run.order + 1))) ** (run.order + 1) * numpy.abs(states).max()
    if error < exact(float(least)):
        yield (
            f"{run.steps} of order {run.order} over {angle:.2g} rad each would be off by {least:.1g} or more, "
            f"and it is off by {decimal_text(error, 2)}"
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
