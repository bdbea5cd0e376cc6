"""Tasks in processes of their own, each under a time limit where a third-party integrator runs in it.

Every worker is one process that takes one task after another, so that a task that does not end is ended with its
process, also where it is stuck in native code, and nothing but that task is lost.  The process leads a process group,
which ends as a whole: what an integrator started does not outlive it.
"""

from __future__ import annotations

import math
import os
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from itertools import islice, product
from typing import Any

from heavytop.errors import HeavyTopError, NotAsked, OutOfTime
from heavytop.guard import stopwatch
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Kinds, MeasuredKind, Task, begin_worker, died, ended_its_process, failed, measure
from heavytop.integrate.peers.command import Command
from heavytop.integrate.peers.contract import said
from heavytop.processes import GuardedProcess
from heavytop.records import FAILED, OUT_OF_TIME, Row

_BASE = 30.0
"""Seconds that every row may take, on a loaded machine too."""
_TIMES = 10.0
"""How many times as long as expected a row may take beside that."""
_LEAST = 10.0
"""Seconds of a row of an integrator that keeps running out of time."""
_MOST_OUT_OF_TIME = 2
"""Rows in which an integrator may run out of time before it is asked for no more of them."""
_MOST_DEATHS = 3
_LOOKED_AT = 64
"""Tasks that wait, among which one in the format of a worker is looked for."""
_AHEAD, _SHORT = 4, 0.25
"""Tasks of a worker, the one under way among them, where each takes fewer seconds than that; else one."""


@dataclass(slots=True)
class _Record:
    """Rows of one integrator: seconds over the expected cost, at most; how many just ran out of time, and in all."""

    ratio: float = 1.0
    lost: int = 0
    out_of_time: int = 0


@dataclass(slots=True)
class RowLimits:
    """Seconds that a row of a third-party integrator may take.

    30 s and ten times the expected cost: that of heyoka for the same row, times
    the largest ratio of seconds to cost among the integrator's finished rows, and at least that.  Each row in
    succession that ran out of time divides the next limit, by 2, 3, ..., down to 10 s; once two ran out no other is
    asked for.
    fixed: the limit of every row in the place of all that.
    """

    fixed: float | None = None
    _records: defaultdict[str, _Record] = field(default_factory=lambda: defaultdict(_Record))

    def seconds(self, task: Task, cost: float) -> float:
        """The limit of a row that begins now."""
        if self.fixed is not None:
            return self.fixed
        record = self._records[task.key.subject.name]
        return max((_BASE + _TIMES * cost * record.ratio) / (1 + record.lost), _LEAST)

    def finished(self, task: Task, cost: float, seconds: float) -> None:
        """A row ended by itself."""
        record = self._records[task.key.subject.name]
        record.lost, record.ratio = 0, max(record.ratio, seconds / cost)

    def ran_out(self, task: Task) -> None:
        """A row was stopped at its limit."""
        record = self._records[task.key.subject.name]
        record.lost, record.out_of_time = record.lost + 1, record.out_of_time + 1

    def not_asked(self, waiting: deque[int], tasks: Sequence[Task]) -> Iterator[tuple[int, Row]]:
        """Takes those out of the tasks that wait whose integrator has run out of time twice: their rows."""
        lost = {name for name, record in self._records.items() if record.out_of_time >= _MOST_OUT_OF_TIME}
        left = [index for index in waiting if lost and tasks[index].key.subject.name in lost]
        if left:
            others = [index for index in waiting if tasks[index].key.subject.name not in lost]
            waiting.clear()
            waiting.extend(others)
        for index in left:
            name = tasks[index].key.subject.name
            cause = f"{name} ran out of time in {_MOST_OUT_OF_TIME} other rows and was not asked again"
            yield index, failed(tasks[index], cause, NotAsked)

    def took(self, task: Task, cost: float, row: Row, seconds: float) -> None:
        """A row of any integrator ended, by itself, at its limit or at the time limit of a request to a program."""
        timeout = task.source.seconds if isinstance(task.source, Command) else math.inf
        if row.outcome == OUT_OF_TIME or (row.outcome == FAILED and seconds >= timeout):
            self.ran_out(task)
        elif task.is_third_party and row.outcome != FAILED:
            self.finished(task, cost, seconds)


class _Worker:
    """A process for one task after another, started when it is first used.

    It serves one third-party integrator at most, which may change whatever is around it.

    rows: of its tasks, with their indices; the first is under way.  seconds: for how long, without what its process and
    the program that this asks waited for a processor.  precision: of its last task.
    """

    def __init__(self, kinds: Kinds) -> None:
        self._kinds = kinds
        self._process: GuardedProcess | None = None
        self._guest = ""
        self._hello: Future[int] | None = None
        self._pid: int | None = None
        self.rows: deque[tuple[int, Future[Row]]] = deque()
        self.precision = ""
        self.seconds = stopwatch()
        self.limit: float | None = None

    @property
    def left(self) -> float | None:
        """Seconds until its task is to be ended; None for no limit, or where the process is not yet there."""
        if self.limit is None or self._process is None or self._hello is not None:
            return None
        return self.limit - self.seconds()

    def takes(self, task: Task, ahead: int, costs: Mapping[int, float]) -> bool:
        """Whether it may be given one more, with so many before it, which are short: no task waits for a long one."""
        if not self.rows:
            return True
        short = all(costs[index] < _SHORT for index, _ in self.rows)
        return short and self.limit is None and not task.is_third_party and len(self.rows) <= ahead

    def submit(self, index: int, limit: float | None, kind: MeasuredKind, task: Task, saved: Saved) -> None:
        """Begins a task, behind those that it has: its time runs from when the process is there."""
        guest = task.key.subject.name if task.is_third_party else ""
        if self._guest not in ("", guest):
            self.end()
        self._guest = guest
        if not self.rows:
            self.limit, self.seconds = limit, stopwatch(self._pid, with_children=True)
        if self._process is None:
            self._process = GuardedProcess(begin_worker, tuple(self._kinds.values()))
            self._hello = self._process.submit(os.getpid)
        try:
            self.rows.append((index, self._process.submit(measure, kind, task, saved)))
        except BrokenProcessPool as error:
            if self.rows:  # told with those before it
                lost: Future[Row] = Future()
                lost.set_exception(error)
                self.rows.append((index, lost))
            else:  # it died between two tasks
                self.end()
                self.submit(index, limit, kind, task, saved)

    def finish(self) -> None:
        """Its first task, unless it was ended with it, is done, and the next under way."""
        if self.rows:
            self.rows.popleft()
        self.seconds = stopwatch(self._pid, with_children=True)

    @property
    def ending(self) -> str:
        """How its process ended by itself."""
        return "" if self._process is None else self._process.ending

    def awaited(self) -> list[Future[Any]]:
        """The futures to wait for: the process, then its row."""
        return [future for _, future in [*self.rows][:1]] + ([] if self._hello is None else [self._hello])

    def greet(self) -> None:
        """Puts a guard into the group of a process that has just begun, and starts its clock."""
        if self._process is not None and self._hello is not None and self._hello.done():
            with suppress(BrokenProcessPool):  # a process that is gone is noticed with its row
                self._pid = self._hello.result()
                self._process.guard(self._pid)
            self._hello, self.seconds = None, stopwatch(self._pid, with_children=True)

    def end(self) -> None:
        """Kills the process and whatever it started."""
        if self._process is not None:
            self._process.end()
        self._process = self._hello = self._pid = None
        self.rows.clear()
        self._guest = ""


def in_processes(
    tasks: Sequence[Task],
    kinds: Kinds,
    costs: Mapping[int, float],
    waiting: deque[int],
    workers: int,
    saved: Callable[[int], Saved],
    begun: Callable[[Task], None],
    row_timeout: float | None,
) -> Iterator[tuple[int, Row]]:
    """(index of the task, its row) as they finish, of the tasks that wait (:func:`in_order`).

    A task whose process died is run again, three times in all; then it is a row that failed, or where the integrator is
    this program's, a HeavyTopError.
    """
    limits, deaths = RowLimits(row_timeout), Counter[int]()
    pool = [_Worker(kinds) for _ in range(max(workers, 1))]
    try:
        while waiting or any(worker.rows for worker in pool):
            for ahead, worker in product(range(_AHEAD), pool):
                if waiting and worker.takes(tasks[waiting[0]], ahead, costs):
                    index = _taken(worker, pool, waiting, tasks)
                    task = tasks[index]
                    limit = limits.seconds(task, costs[index]) if task.is_third_party else None
                    worker.submit(index, limit, kinds[task.key.kind], task, saved(index))
                    if len(worker.rows) == 1:
                        begun(task)
            _wait(pool)
            for worker in pool:
                worker.greet()
                if not worker.rows:
                    continue
                index, *behind = (row for row, _ in worker.rows)
                try:
                    row = _ended(worker, tasks[index], costs[index], limits)
                except BrokenProcessPool:
                    how = worker.ending
                    worker.end()
                    waiting.extendleft(reversed(behind))
                    deaths[index] += 1
                    if deaths[index] < _MOST_DEATHS:
                        waiting.appendleft(index)
                        continue
                    if not tasks[index].is_third_party:
                        raise died(tasks[index], deaths[index]) from None
                    row = ended_its_process(tasks[index], deaths[index], how)
                if row is not None:
                    if worker.rows:
                        begun(tasks[worker.rows[0][0]])
                    yield index, row
                    yield from limits.not_asked(waiting, tasks)
    finally:
        for worker in pool:
            worker.end()


def _taken(worker: _Worker, pool: Sequence[_Worker], waiting: deque[int], tasks: Sequence[Task]) -> int:
    """The task that a worker is given next, taken out of those that wait.

    Of the first of them one in the format of its last, else in that of no other worker: each compiles for itself.
    """
    chosen = 0
    if not tasks[waiting[0]].is_third_party:
        others = {busy.precision for busy in pool if busy is not worker}
        formats = [tasks[index].key.precision for index in islice(waiting, _LOOKED_AT)]
        chosen = min(range(len(formats)), key=lambda i: (formats[i] != worker.precision, formats[i] in others))
    index = waiting[chosen]
    del waiting[chosen]
    worker.precision = tasks[index].key.precision
    return index


def in_order(tasks: Sequence[Task], kinds: Kinds, done: Container[int]) -> tuple[dict[int, float], deque[int]]:
    """The cost of each task that is not done, and these tasks in the order in which they are to begin: long ones first.

    Those of third-party integrators come before them, one integrator after the other, and of each the quick ones before
    the long ones, whose limits rest on them.
    """
    costs = {index: kinds[task.key.kind].cost(task) for index, task in enumerate(tasks) if index not in done}
    guests = list(dict.fromkeys(tasks[index].key.subject.name for index in costs if tasks[index].is_third_party))

    def order(index: int) -> tuple[int, float]:
        task = tasks[index]
        third_party = task.is_third_party
        return (guests.index(task.key.subject.name), costs[index]) if third_party else (len(guests), -costs[index])

    return costs, deque(sorted(costs, key=order))


@cache
def _kept_worker() -> _Worker:
    return _Worker({})


def in_limited_process(kind: MeasuredKind, task: Task, limit: float) -> tuple[Row, float]:
    """The row of a third-party integrator, measured in a child of this process within a limit, and its seconds.

    The child is kept for the next row; it ends with this process.  For one thread at a time.
    """
    worker, limits, how = _kept_worker(), RowLimits(limit), ""
    for _ in range(_MOST_DEATHS):
        worker.submit(0, limit, kind, task, Saved())
        try:
            while (row := _ended(worker, task, 1.0, limits)) is None:
                _wait([worker])
                worker.greet()
            return row, worker.seconds()
        except BrokenProcessPool:
            how = worker.ending
            worker.end()
    return ended_its_process(task, _MOST_DEATHS, how), 0.0


def _wait(pool: Sequence[_Worker]) -> None:
    """Until a process is there, a row is done, or a limit is reached."""
    futures = [future for worker in pool if worker.rows for future in worker.awaited()]
    left = [worker.left for worker in pool if worker.rows]
    wait(futures, min((max(seconds, 0.0) for seconds in left if seconds is not None), default=None), FIRST_COMPLETED)


def _ended(worker: _Worker, task: Task, cost: float, limits: RowLimits) -> Row | None:
    """The row of a worker that has ended or had to be; None where it goes on.  Raises BrokenProcessPool."""
    _, future = worker.rows[0]
    if future.done():
        name, error = task.key.subject.name, future.exception()
        if error is None:
            row = future.result()
        elif isinstance(error, KeyboardInterrupt):
            # a child leaves interrupts to this process, so one that comes from there was raised by its integrator
            row = failed(task, f"{name} raised KeyboardInterrupt")
        elif not task.is_third_party or isinstance(error, HeavyTopError | BrokenProcessPool):
            raise error
        else:  # it changed what is around it, such as modules of this program
            row = failed(task, f"measuring {name} failed: {type(error).__name__}: {said(error)}")
            worker.end()
        limits.took(task, cost, row, worker.seconds())
        worker.finish()
        return row
    if worker.left is None or worker.left > 0:
        return None
    limit = worker.limit
    worker.end()
    limits.ran_out(task)
    return failed(task, f"{task.key.subject.name} was stopped after {limit:.3g} s", OutOfTime)
