"""Many motions in many words: eight in lanes where double-double serves, threads on top."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.ensemble import Finished, Observer, in_threads, one_kind, processors
from heavytop.integrate.lanes import Work
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.integrate.words import follow
from heavytop.integrate.words_engines import DoubleDouble, compiled_lanes, floats, wanted_tolerance
from heavytop.integrate.words_lanes import WordsLanes
from heavytop.precision import exact, number, require
from heavytop.top.times import check_times
from heavytop.words.vector import LANES


def propagate_words_ensemble(
    problems: Sequence[Problem],
    times: Sequence[Any],
    *,
    observer: Observer | None = None,
    finished: Finished | None = None,
    threads: int | None = None,
    step_limit: int | None = None,
    tolerance: Fraction | None = None,
) -> list[Trajectory]:
    """The motions of ``problems`` at ``times``, computed in many words, in the order of the problems.

    Where double-double serves the format and the tolerance, eight go side by side, unless they carry an attitude; else
    each by itself, to the bits of :func:`heavytop.integrate.words.propagate_words`.  No bit of a motion depends on the
    others.  The arguments: as in :func:`heavytop.integrate.ensemble.propagate_ensemble`; tolerance: as in
    :func:`heavytop.integrate.words.propagate_words`.

    Raises InputError for no problems, for problems of several kinds, for times out of order, for fewer than 1 thread,
    and what that raises.
    """
    first = one_kind(problems)
    require(first.precision)
    targets = [number(time, first.precision) for time in check_times(times)]
    threads = processors() if threads is None else threads
    if threads < 1:
        raise InputError(f"{threads} threads make no ensemble.", "Use 1 thread or more.")
    arithmetic = floats(wanted_tolerance(first.precision, tolerance))
    work = Work(
        None, targets, [exact(t) for t in targets], step_limit, observer is not None, deque(enumerate(problems))
    )
    moves = targets[-1] != 0 and (step_limit is None or step_limit > 0)
    if arithmetic is not None and first.xi is None and moves:
        seconds = compiled_lanes(first.system)
        in_lanes = partial(_in_lanes, work, arithmetic, tolerance, seconds)
        return in_threads(in_lanes, work, min(threads, -(-len(problems) // LANES)), observer, finished)
    one_by_one = partial(_one_by_one, work, tolerance)
    return in_threads(one_by_one, work, min(threads, len(problems)), observer, finished)


def _in_lanes(work: Work, arithmetic: DoubleDouble, tolerance: Fraction | None, seconds: float) -> None:
    """One thread of lanes, and afterwards those that need another arithmetic."""
    others: deque[tuple[int, Problem]] = deque()
    WordsLanes(work, arithmetic, tolerance, seconds, others).run()
    while others:
        _alone(work, tolerance, *others.popleft())


def _one_by_one(work: Work, tolerance: Fraction | None) -> None:
    """One thread of single runs."""
    while taken := work.take():
        _alone(work, tolerance, *taken)


def _alone(work: Work, tolerance: Fraction | None, index: int, problem: Problem) -> None:
    observer = partial(work.observe, index) if work.observed else None
    work.finish(index, follow(problem, work.targets, tolerance, work.step_limit, observer, work.check))
