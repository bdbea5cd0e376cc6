"""Where tasks run: in this process, in local processes, or on a Dask cluster.  The rows are the same."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context

from heavytop.errors import HeavyTopError, InputError
from heavytop.records import Row
from heavytop.suite.task import Task


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _measure(task: Task) -> Row:
    from heavytop.suite.measurements import measure

    return measure(task)


@contextmanager
def executor(workers: int, scheduler: str | None) -> Iterator[Executor]:
    """Something to submit to: ``workers`` local processes, or the Dask cluster at ``scheduler``.

    Raises InputError where the extra `cluster` is not installed or no scheduler answers.
    """
    if scheduler is None:
        # spawned, not forked: a forked child would share the state of heyoka's compiler and threads
        with ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=_leave_interrupts_to_the_parent
        ) as pool:
            try:
                yield pool
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for process in list((pool._processes or {}).values()):
                    process.terminate()
                raise
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask.", "Install it with: pip install 'heavytop[cluster]'") from None
    try:
        client = Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(f"No scheduler answers at {scheduler}: {error}.", "Start one: `dask scheduler`.") from None
    with client, client.get_executor(pure=False) as pool:
        yield pool


def rows(tasks: Sequence[Task], workers: int, scheduler: str | None) -> Iterator[tuple[int, Row]]:
    """(index of the task, its row) as they finish, long ones started first."""
    order = sorted(range(len(tasks)), key=lambda i: -tasks[i].cost)
    if workers <= 1 and scheduler is None:
        for index in order:
            yield index, _measure(tasks[index])
        return
    with executor(workers, scheduler) as pool:
        futures: dict[Future[Row], int] = {pool.submit(_measure, tasks[index]): index for index in order}
        for future in as_completed(futures):
            try:
                yield futures[future], future.result()
            except BrokenProcessPool:
                raise HeavyTopError(
                    f"A worker process died during {tasks[futures[future]].label}.",
                    "Finished rows are kept: run again with --resume, perhaps with fewer --workers.",
                ) from None
