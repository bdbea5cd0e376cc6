"""Ensembles: SIMD lanes in double, threads in every format."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import compress
from queue import SimpleQueue
from threading import Event
from typing import Any

import numpy

from heavytop.errors import InputError, refusal
from heavytop.guard import processors
from heavytop.integrate.heyoka.engines import Compiled, compiled
from heavytop.integrate.heyoka.lanes import LaneIntegrator, Lanes, Work
from heavytop.integrate.heyoka.motions import integrate_to_samples, unit_of
from heavytop.integrate.trajectory import EnsembleObserver, Finished, Problem, Trajectory
from heavytop.precision import DOUBLE, OrderedRing, exact, number, require
from heavytop.top.heavy_top import check_times

_FARTHEST = 2**40
"""Units of time of its own to which a motion is followed one by one; a faster one fails at once in lanes."""


def propagate_ensemble(
    problems: Sequence[Problem],
    times: Sequence[OrderedRing],
    *,
    observer: EnsembleObserver | None = None,
    finished: Finished | None = None,
    threads: int | None = None,
    lanes: int = 8,
    step_limit: int | None = None,
    **options: Any,
) -> list[Trajectory]:
    """The motions of ``problems`` at ``times``, computed by heyoka, in the order of the problems.

    problems: all of one system and format, with an attitude all or none; their tops may differ.
    times: exact numbers of one sign, strictly monotone away from 0 (0 itself may come first).
    observer: called with (index of the problem, exact time, native state) in place of storing the states, by the
    calling thread; the times of each problem in order, the problems mixed.
    finished: called with (index of the problem, its motion) as each ends, by the same thread, after its samples.
    threads: None for one per processor that this process may use.
    lanes: motions side by side in a batch engine, in double; other formats, and motions in a unit of time of their own,
    have none, and give the bits of :func:`heavytop.integrate.heyoka.motions.propagate`.
    step_limit: for each motion; the times reached until then are returned.
    options: tolerance, high_accuracy, compact_mode as in :func:`heavytop.integrate.heyoka.engines.compiled`.

    Each motion has its own outcome; one that fails changes nothing in the others.  ``run`` of its seconds is its wall
    time, shared with others.

    Raises InputError for no problems, for problems of several kinds, for times out of order, for a format that the
    platform lacks, and for fewer than 1 thread or 2 lanes.
    """
    first, work = work_of(problems, times, step_limit, observer)
    if lanes < 2:
        raise refusal("lanes", "at least 2", lanes, "Use 2 lanes or more.")
    batch = first.precision == DOUBLE and work.moves
    span = abs(work.times[-1])
    one_by_one = [not batch or ((unit := unit_of(problem)) != 1 and unit * span < _FARTHEST) for problem in problems]
    parts: list[Iterator[Trajectory]] = []
    for run, singly, width in ((_in_lanes, False, lanes), (_one_by_one, True, None)):
        pending = deque(compress(work.pending, (alone == singly for alone in one_by_one)))
        part = replace(work, pending=pending, stop=Event())
        runs: list[Trajectory] = []
        if part.pending:
            tool = compiled(first.system, first.precision, attitude=first.xi is not None, lanes=width, **options)
            part.lanes = LaneIntegrator("heyoka:batch", tool.engine.order, tool.seconds, tool.flags)
            runs = in_threads(partial(run, part, tool), part, threads, width or 1, observer, finished)
        parts.append(iter(runs))
    return [next(parts[alone]) for alone in one_by_one]


def work_of(
    problems: Sequence[Problem], times: Sequence[Any], step_limit: int | None, observer: EnsembleObserver | None
) -> tuple[Problem, Work]:
    """The first problem and the work of an ensemble; raises InputError as :func:`propagate_ensemble`."""
    first = one_kind(problems)
    targets = [number(time, require(first.precision)) for time in check_times(times)]
    pending = deque(enumerate(problems))
    return first, Work(targets, [exact(t) for t in targets], step_limit, observer is not None, pending)


def in_threads(
    run: Callable[[], None],
    work: Work,
    threads: int | None,
    width: int,
    observer: EnsembleObserver | None,
    finished: Finished | None,
) -> list[Trajectory]:
    """The motions of ``work`` in the order of its problems, by threads that each call ``run``, or by this one.

    threads, observer, finished: as in :func:`propagate_ensemble`; the last two are called by this thread.
    width: problems that a thread runs side by side.
    """
    threads = processors() if threads is None else threads
    if threads < 1:
        raise refusal("threads", "at least 1", threads, "Use 1 thread or more.")
    threads = min(threads, -(-len(work.pending) // width))
    done: dict[int, Trajectory] = {}
    error_state = numpy.geterr()

    def receive(item: Any) -> None:
        if isinstance(item[1], Trajectory):
            done[item[0]] = item[1]
            if finished is not None:
                finished(*item)
        elif observer is not None:
            work.room.release()
            observer(*item)

    def receive_here(item: Any) -> None:
        with numpy.errstate(**error_state):  # the caller's, not that of the lanes
            receive(item)

    if threads == 1:
        work.send = receive_here
        run()
    else:
        _in_pool(run, work, threads, receive)
    return [done[index] for index in sorted(done)]


def _in_pool(run: Callable[[], None], work: Work, threads: int, receive: Callable[[Any], None]) -> None:
    inbox: SimpleQueue[Any] = SimpleQueue()
    work.send = inbox.put
    with ThreadPoolExecutor(threads) as pool:
        try:
            for _ in range(threads):
                pool.submit(run).add_done_callback(inbox.put)
            while threads:
                item = inbox.get()
                if isinstance(item, Future):
                    item.result()
                    threads -= 1
                else:
                    receive(item)
        finally:
            work.stop.set()


def _in_lanes(work: Work, tool: Compiled) -> None:
    """One thread of a batch ensemble."""
    with tool.borrowed() as mover, tool.borrowed() as sampler, numpy.errstate(all="ignore"):
        Lanes(work, mover, sampler).run()


def _one_by_one(work: Work, tool: Compiled) -> None:
    """One thread of scalar runs."""
    with tool.borrowed() as engine:
        while taken := work.take():
            index, problem = taken
            observer = partial(work.observe, index) if work.observed else None
            run = integrate_to_samples(tool, engine, problem, work.targets, work.step_limit, observer, work.check)
            work.finish(index, run)


def one_kind(problems: Sequence[Problem]) -> Problem:
    """The first problem; raises InputError unless all are of its kind."""
    if not problems:
        raise InputError("An ensemble needs at least one problem.", "Give one or more.")

    def kind(problem: Problem) -> str:
        attitude = "without" if problem.xi is None else "with"
        return f"{problem.system.name} in {problem.precision.name} {attitude} attitude"

    for index, problem in enumerate(problems):
        if kind(problem) != kind(problems[0]):
            raise InputError(f"Problem 0 is {kind(problems[0])}, problem {index} is {kind(problem)}.", "Separate them.")
    return problems[0]
