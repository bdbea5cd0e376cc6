"""Runs of a plan: each finished row is written to disk; conclusions from all rows of a kind follow at the end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from threading import Lock
from time import monotonic
from typing import Any, TypeVar

from heavytop.errors import HeavyTopError, InputError
from heavytop.extras import require_extra
from heavytop.harness.checkpoint import Checkpoint, Saved
from heavytop.harness.limited import RowLimits, in_limited_process, in_order, in_processes
from heavytop.harness.rows import RESUME, Kinds, MeasuredKind, Task, ended_its_process, measure
from heavytop.records import Row

# Where tasks run: in this process, in local processes, or on a Dask cluster.  The rows are the same.
#
# On a cluster at most four tasks per worker are submitted at a time, so that memory does not grow with the length of a
# plan; here a worker has one.  A worker is a process, whatever the number of its threads.


_AHEAD = 4
_ANSWER = 10.0
"""Seconds within which a Dask scheduler must answer."""
_PATIENCE = 30
"""Seconds without any worker after which a cluster is abandoned."""
_SAME = "Install the same versions on every machine."
_one_task = Lock()
"""A Dask worker with several threads measures one task at a time: a second one would distort the timings, and a
third-party integrator need not be thread-safe.  Ensembles start their own threads."""
_PACKAGES = ("heavytop", "heyoka", "numpy", "mpmath", "gmpy2", "python-flint", "msgspec")

Versions = dict[str, str]
T = TypeVar("T")
Timed = tuple[Row, float]
"""A row and its seconds."""


@cache
def versions() -> Versions:
    """The versions of this program and of every package that rows depend on."""
    return {name: metadata.version(name) for name in _PACKAGES}


def rows(
    tasks: Sequence[Task],
    kinds: Kinds,
    workers: int,
    scheduler: str | None,
    done: Container[int] = (),
    saved: Callable[[int], Saved] | None = None,
    begun: Callable[[Task], None] = lambda task: None,
    row_timeout: float | None = None,
) -> Iterator[tuple[int, Row]]:
    """(index of the task, its row) as they finish, long ones started first; without those in ``done``.

    saved: from the index of a task to the resume point of its row; None without resume points, as on a cluster, which
    may share no disk with this machine.

    begun: called with a task that begins; on a cluster and with several workers, with one in progress.
    row_timeout: seconds of each row of a third-party integrator; None for limits by its other rows.

    Several workers are processes, and so is one where a task has a third-party integrator
    (:mod:`heavytop.harness.limited`); on a cluster only that task runs in a child of the worker, under the same limit.

    A task whose worker died is run again, three times in all; that of a third-party integrator is then a failed row.
    Raises HeavyTopError with the name of a task that killed its worker each time, and where a cluster was lost;
    InputError where the extra `cluster` is not installed, no scheduler answers, or a worker has other versions.
    """
    costs, waiting = in_order(tasks, kinds, done)
    saved = saved or (lambda index: Saved())
    if scheduler is not None:
        yield from _on_cluster(tasks, kinds, costs, waiting, scheduler, begun, row_timeout)
    elif waiting and (workers > 1 or tasks[waiting[0]].is_third_party):
        yield from in_processes(tasks, kinds, costs, waiting, workers, saved, begun, row_timeout)
    else:
        for index in waiting:
            begun(tasks[index])
            yield index, measure(kinds[tasks[index].key.kind], tasks[index], saved(index))


def _on_cluster(
    tasks: Sequence[Task],
    kinds: Kinds,
    costs: Mapping[int, float],
    waiting: deque[int],
    scheduler: str,
    begun: Callable[[Task], None],
    row_timeout: float | None,
) -> Iterator[tuple[int, Row]]:
    limits = RowLimits(row_timeout)
    with _client(scheduler) as client:
        from distributed import KilledWorker

        pool = client.get_executor(pure=False)
        expected = versions()

        def submit(index: int) -> Future[Timed]:
            task = tasks[index]
            limit = limits.seconds(task, costs[index]) if task.is_third_party else None
            future: Future[Timed] = pool.submit(_measure_as, expected, kinds[task.key.kind], task, limit)
            return future

        def at_once() -> int:
            return _AHEAD * len(client.nthreads())

        try:
            for index, future in _windowed(waiting, submit, at_once, lambda i: begun(tasks[i])):
                try:
                    row, seconds = future.result()
                except KilledWorker as error:
                    if tasks[index].is_third_party:
                        yield index, ended_its_process(tasks[index], error.allowed_failures + 1)
                        continue
                    raise HeavyTopError(
                        f"{error.allowed_failures + 1} workers died during {tasks[index].label}.", f"{RESUME}."
                    ) from None
                except RuntimeError as error:
                    if "deserialization" in str(error):
                        raise InputError(f"The scheduler {scheduler} has no such heavytop.", _SAME) from None
                    raise
                limits.took(tasks[index], costs[index], row, seconds)
                yield index, row
                yield from limits.not_asked(waiting, tasks)
        except (CancelledError, OSError):
            raise HeavyTopError(f"The scheduler {scheduler} was lost.", f"{RESUME}.") from None


def _windowed(
    queue: deque[int],
    submit: Callable[[int], Future[T]],
    at_once: Callable[[], int],
    begun: Callable[[int], None],
) -> Iterator[tuple[int, Future[T]]]:
    """Indices as they finish, with up to ``at_once()`` tasks in progress; it is 0 where there are no workers.

    begun: called with the task longest in progress, whenever that changes.
    """
    reported, in_progress = None, dict[Future[T], int]()
    while queue or in_progress:
        limit = at_once()
        for _ in range(min(len(queue), max(limit, 1) - len(in_progress))):
            future = submit(queue[0])
            in_progress[future] = queue.popleft()
        longest = next(iter(in_progress.values()))
        if longest != reported:
            begun(reported := longest)
        finished = wait(in_progress, timeout=_PATIENCE, return_when=FIRST_COMPLETED).done
        if not finished and limit == 0:
            raise HeavyTopError("The cluster has lost all its workers.", f"Start some with heavytop.  {RESUME}.")
        for future in finished:
            yield in_progress[future], future
            del in_progress[future]


def _measure_as(expected: Versions, kind: MeasuredKind, task: Task, limit: float | None) -> Timed:
    """The row of ``task`` and its seconds, at most ``limit`` where there is one.

    Raises InputError unless the versions here are those expected.
    """
    here = versions()
    different = [
        f"{name} {here[name]} instead of {expected[name]}" for name in expected if here[name] != expected[name]
    ]
    if different:
        raise InputError(f"A worker has {', '.join(different)}.", _SAME)
    with _one_task:
        if limit is not None:
            return in_limited_process(kind, task, limit)
        began = monotonic()
        return measure(kind, task, Saved()), monotonic() - began


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    require_extra("cluster")
    import dask

    # the errors raised here report each failure once
    dask.config.set({"logging": {"distributed": "critical", "distributed.client": "critical"}})
    from distributed import Client

    try:
        client = Client(scheduler, timeout=_ANSWER)
    except (OSError, ValueError) as error:
        raise InputError(f"No scheduler answers at {scheduler}: {error}.", "Start one: `dask scheduler`.") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError:
            raise InputError(
                f"No worker has joined {scheduler}.", f"Start one: `dask worker {scheduler} --nthreads 1`."
            ) from None
        yield client


Progress = Callable[[Task], None]


def unheard(task: Task) -> None:
    """Ignores progress."""


def run(
    tasks: Sequence[Task],
    kinds: Kinds,
    checkpoint: Checkpoint,
    progress: Progress,
    workers: int = 1,
    scheduler: str | None = None,
    begun: Progress = unheard,
    row_timeout: float | None = None,
) -> list[Row]:
    """Writes every row of the tasks into the checkpoint; returns only the rows concluded from them.

    Rows in the checkpoint are not measured again.  ``progress`` is called with each task when it is done, ``begun``
    when it begins.  row_timeout: seconds of each row of a third-party integrator; None for limits by its other rows.
    """
    for index in checkpoint.offsets:
        progress(tasks[index])
    at_once = min(workers, len(tasks))
    done, saved = checkpoint.offsets, checkpoint.saved
    to_conclude: dict[int, Row] = {}
    for index, row in rows(tasks, kinds, at_once, scheduler, done, saved, begun, row_timeout):
        checkpoint.add(index, row)
        if kinds[row.key.kind].concludes:
            to_conclude[index] = row
        progress(tasks[index])
    concluded: list[Row] = []
    for kind in kinds.values():
        if kind.concludes:
            indices = [index for index, task in enumerate(tasks) if task.key.kind == kind.name]
            missing = [index for index in indices if index not in to_conclude]  # measured before the run was resumed
            to_conclude |= zip(missing, checkpoint.rows(missing), strict=True)
            concluded += kind.conclude([to_conclude[index] for index in indices]) if indices else []
    return concluded
