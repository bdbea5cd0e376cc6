"""Tasks in worker processes, with a time limit for those of third-party integrators.

Every worker is one process that runs one task after another.  A task that exceeds its limit is killed with its process,
even where it is stuck in native code, and no other task is lost.  The process leads a process group, which is killed as
a whole: no child of an integrator survives it.
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
from itertools import islice
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
"""Seconds granted to every row, for a loaded machine."""
_COST_FACTOR = 10.0
"""Factor of the expected seconds, granted in addition."""
_MOST_OUT_OF_TIME = 2
"""Rows in which an integrator may run out of time before its other rows are skipped."""
_MOST_DEATHS = 3
_LOOKAHEAD = 64
"""Waiting tasks that are searched for one in the format of a worker."""


@dataclass(slots=True)
class _Record:
    """Per integrator: the largest ratio of seconds to cost; the part of the next limit; rows that ran out of time."""

    ratio: float = 1.0
    part: float = 1.0
    out_of_time: int = 0


@dataclass(slots=True)
class RowLimits:
    """Seconds that a row of a third-party integrator may take.

    30 s plus ten times the expected cost: that of heyoka for the same row, times the largest ratio, 1 or more, of
    seconds to cost among the integrator's finished rows.  After a row that ran out of time the next limit is halved;
    after two such rows the others are skipped.
    fixed: a limit for every row in place of this.
    """

    fixed: float | None = None
    _records: defaultdict[str, _Record] = field(default_factory=lambda: defaultdict(_Record))

    def seconds(self, task: Task, cost: float) -> float:
        """The limit of the next row."""
        if self.fixed is not None:
            return self.fixed
        record = self._records[task.key.subject.name]
        return record.part * (_BASE + _COST_FACTOR * cost * record.ratio)

    def finished(self, task: Task, cost: float, seconds: float) -> None:
        """Records a row that finished."""
        record = self._records[task.key.subject.name]
        record.part, record.ratio = 1.0, max(record.ratio, seconds / cost)

    def ran_out(self, task: Task) -> None:
        """Records a row that was stopped at its limit."""
        record = self._records[task.key.subject.name]
        record.part, record.out_of_time = 0.5, record.out_of_time + 1

    def not_asked(self, waiting: deque[int], tasks: Sequence[Task]) -> Iterator[tuple[int, Row]]:
        """Removes the waiting tasks of integrators that ran out of time twice, and yields their rows."""
        too_slow = {name for name, record in self._records.items() if record.out_of_time >= _MOST_OUT_OF_TIME}
        skipped = [index for index in waiting if too_slow and tasks[index].key.subject.name in too_slow]
        if skipped:
            remaining = [index for index in waiting if tasks[index].key.subject.name not in too_slow]
            waiting.clear()
            waiting.extend(remaining)
        for index in skipped:
            name = tasks[index].key.subject.name
            cause = f"{name} ran out of time in {_MOST_OUT_OF_TIME} other rows and was skipped"
            yield index, failed(tasks[index], cause, NotAsked)

    def took(self, task: Task, cost: float, row: Row, seconds: float) -> None:
        """Records the end of a row: finished, at its limit, or at the time limit of a request to a program."""
        timeout = task.source.seconds if isinstance(task.source, Command) else math.inf
        if row.outcome == OUT_OF_TIME or (row.outcome == FAILED and seconds >= timeout):
            self.ran_out(task)
        elif task.is_third_party and row.outcome != FAILED:
            self.finished(task, cost, seconds)


class _Worker:
    """A process that runs one task after another, started at its first task.

    It serves one third-party integrator at most, which may change the state of the process.

    pid_future: of its start; None once it has started.  index, row: of its task; None without one.
    seconds: since it began, without the time that its process and the program called by it waited for a processor.
    precision: of its last task.
    """

    def __init__(self, kinds: Kinds) -> None:
        self._kinds = kinds
        self._process: GuardedProcess | None = None
        self._third_party = ""
        self.pid_future: Future[int] | None = None
        self._pid: int | None = None
        self.index = 0
        self.row: Future[Row] | None = None
        self.precision = ""
        self.seconds = stopwatch()
        self.limit: float | None = None

    @property
    def left(self) -> float | None:
        """Seconds left to its task; None without a limit, or while the process is starting."""
        if self.limit is None or self._process is None or self.pid_future is not None:
            return None
        return self.limit - self.seconds()

    def submit(self, index: int, limit: float | None, kind: MeasuredKind, task: Task, saved: Saved) -> None:
        """Submits a task; its clock starts when the process has started."""
        third_party = task.key.subject.name if task.is_third_party else ""
        if self._third_party not in ("", third_party):
            self.end()
        self._third_party = third_party
        self.index, self.limit, self.seconds = index, limit, stopwatch(self._pid, with_children=True)
        if self._process is None:
            self._process = GuardedProcess(begin_worker, tuple(self._kinds.values()))
            self.pid_future = self._process.submit(os.getpid)
        try:
            self.row = self._process.submit(measure, kind, task, saved)
        except BrokenProcessPool:  # it died between two tasks
            self.end()
            self.submit(index, limit, kind, task, saved)

    @property
    def ending(self) -> str:
        """How its process died."""
        return "" if self._process is None else self._process.ending

    def greet(self) -> None:
        """Guards the process group of a process that has just started, and starts the clock."""
        if self._process is not None and self.pid_future is not None and self.pid_future.done():
            with suppress(BrokenProcessPool):  # the death of a process is handled with its row
                self._pid = self.pid_future.result()
                self._process.guard(self._pid)
            self.pid_future, self.seconds = None, stopwatch(self._pid, with_children=True)

    def end(self) -> None:
        """Kills the process and its children."""
        if self._process is not None:
            self._process.end()
        self._process = self.pid_future = self._pid = self.row = None
        self._third_party = ""


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
    """(index of the task, its row) as they finish, of the ``waiting`` tasks (:func:`in_order`).

    A task whose process died is run again, three times in all; then that of a third-party integrator is a failed row,
    any other raises HeavyTopError.
    """
    limits, deaths = RowLimits(row_timeout), Counter[int]()
    pool = [_Worker(kinds) for _ in range(max(workers, 1))]
    try:
        while waiting or any(worker.row for worker in pool):
            for worker in pool:
                if waiting and worker.row is None:
                    index = _next_task(worker, pool, waiting, tasks)
                    task = tasks[index]
                    limit = limits.seconds(task, costs[index]) if task.is_third_party else None
                    worker.submit(index, limit, kinds[task.key.kind], task, saved(index))
                    begun(task)
            _wait(pool)
            for worker in pool:
                worker.greet()
                if worker.row is None:
                    continue
                index = worker.index
                try:
                    row = _finished_row(worker, tasks[index], costs[index], limits)
                except BrokenProcessPool:
                    ending = worker.ending
                    worker.end()
                    deaths[index] += 1
                    if deaths[index] < _MOST_DEATHS:
                        waiting.appendleft(index)
                        continue
                    if not tasks[index].is_third_party:
                        raise died(tasks[index], deaths[index]) from None
                    row = ended_its_process(tasks[index], deaths[index], ending)
                if row is not None:
                    yield index, row
                    yield from limits.not_asked(waiting, tasks)
    finally:
        for worker in pool:
            worker.end()


def _next_task(worker: _Worker, pool: Sequence[_Worker], waiting: deque[int], tasks: Sequence[Task]) -> int:
    """The next task of a worker, removed from the waiting ones.

    Among the first of them one in the format of its last task, else in one that no other worker has: each process
    compiles for itself.
    """
    position = 0
    if not tasks[waiting[0]].is_third_party:
        others = {busy.precision for busy in pool if busy is not worker}
        formats = [tasks[index].key.precision for index in islice(waiting, _LOOKAHEAD)]
        position = min(range(len(formats)), key=lambda i: (formats[i] != worker.precision, formats[i] in others))
    index = waiting[position]
    del waiting[position]
    worker.precision = tasks[index].key.precision
    return index


def in_order(tasks: Sequence[Task], kinds: Kinds, done: Container[int]) -> tuple[dict[int, float], deque[int]]:
    """The cost of each task that is not done, and the order in which these tasks begin: long ones first.

    Before them those of third-party integrators, grouped by integrator, the quick ones first: the limits of the long
    ones depend on them.
    """
    costs = {index: kinds[task.key.kind].cost(task) for index, task in enumerate(tasks) if index not in done}
    integrators = list(dict.fromkeys(tasks[index].key.subject.name for index in costs if tasks[index].is_third_party))

    def order(index: int) -> tuple[int, float]:
        task = tasks[index]
        if not task.is_third_party:
            return len(integrators), -costs[index]
        return integrators.index(task.key.subject.name), costs[index]

    return costs, deque(sorted(costs, key=order))


@cache
def _reused_worker() -> _Worker:
    return _Worker({})


def in_limited_process(kind: MeasuredKind, task: Task, limit: float) -> tuple[Row, float]:
    """The row of a third-party integrator, measured in a child of this process within a limit, and its seconds.

    The child is reused for the next row; it ends with this process.  For one thread at a time.
    """
    worker, limits, ending = _reused_worker(), RowLimits(limit), ""
    for _ in range(_MOST_DEATHS):
        worker.submit(0, limit, kind, task, Saved())
        try:
            while (row := _finished_row(worker, task, 1.0, limits)) is None:
                _wait([worker])
                worker.greet()
            return row, worker.seconds()
        except BrokenProcessPool:
            ending = worker.ending
            worker.end()
    return ended_its_process(task, _MOST_DEATHS, ending), 0.0


def _wait(pool: Sequence[_Worker]) -> None:
    """Waits until a process has started, a row is done, or a limit is reached."""
    busy = [worker for worker in pool if worker.row]
    futures: list[Future[Any]] = [future for worker in busy for future in (worker.row, worker.pid_future) if future]
    left = [worker.left for worker in busy]
    wait(futures, min((max(seconds, 0.0) for seconds in left if seconds is not None), default=None), FIRST_COMPLETED)


def _finished_row(worker: _Worker, task: Task, cost: float, limits: RowLimits) -> Row | None:
    """The row of a worker's task, finished or stopped; None while it runs.  Raises BrokenProcessPool."""
    if (future := worker.row) is not None and future.done():
        name, error = task.key.subject.name, future.exception()
        if error is None:
            row = future.result()
        elif isinstance(error, KeyboardInterrupt):
            # children ignore SIGINT, so this was raised by the integrator
            row = failed(task, f"{name} raised KeyboardInterrupt")
        elif not task.is_third_party or isinstance(error, HeavyTopError | BrokenProcessPool):
            raise error
        else:  # it changed its surroundings, such as modules of this program
            row = failed(task, f"measuring {name} failed: {type(error).__name__}: {said(error)}")
            worker.end()
        limits.took(task, cost, row, worker.seconds())
        worker.row = None
        return row
    if worker.left is None or worker.left > 0:
        return None
    limit = worker.limit
    worker.end()
    limits.ran_out(task)
    return failed(task, f"{task.key.subject.name} was stopped after {limit:.3g} s", OutOfTime)
