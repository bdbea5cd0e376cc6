"""Child processes that do not import the caller's script, and end with this process.

``multiprocessing`` imports the main script in every spawned child, so a script without a main guard would run again in
each.  The children of this program do not need the script: they import their functions by name.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import current_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.queues import SimpleQueue
from threading import Lock, Thread
from time import monotonic, sleep
from typing import Any, ParamSpec, TypeVar
from uuid import uuid4

from loky.backend import resource_tracker as loky_tracker
from loky.backend.context import LokyContext
from loky.backend.process import LokyProcess

from heavytop.guard import MARK, Guard, how_it_ended, kill_marked

P = ParamSpec("P")
T = TypeVar("T")

SAFE_PATH = "PYTHONSAFEPATH"
"""Variable of Python: a file such as random.py in the working directory does not shadow a module."""
_POLL = 0.005
_LAST_SECONDS = 5.0
"""Seconds that a process has to end after it has closed its pipe."""
_starting = Lock()


class _Child(LokyProcess):  # type: ignore[misc]  # loky has no types
    """A process that is started with :data:`SAFE_PATH`, which is removed in it unless this process has it.

    It ends with its parent, for whatever reason that ends, so that daemons of multiprocessing, such as workers of Dask,
    may start one.

    parent: an end of a pipe whose other end is open in the parent alone.
    """

    parent: Connection
    own_path = False

    def run(self) -> None:
        """Run in the process; its own child processes find modules as usual."""
        Thread(target=_end_with, args=(self.parent,), daemon=True).start()
        if self.own_path:
            os.environ.pop(SAFE_PATH, None)
        super().run()

    def start(self) -> None:
        with _starting:
            here = current_process()
            daemon, here.daemon = here.daemon, False
            try:
                super().start()
            finally:
                here.daemon = daemon

    def kill(self) -> None:
        """Kill the process unless it has ended."""
        if self.pid is not None and self.exitcode is None:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(self.pid, getattr(signal, "SIGKILL", signal.SIGTERM))


@contextmanager
def _environment_of_trackers() -> Iterator[None]:
    """Start processes with :data:`SAFE_PATH`, and without warnings of resources that a signal has left."""
    variables = {SAFE_PATH: os.environ.get(SAFE_PATH, "1"), "PYTHONWARNINGS": "ignore"}
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _end_with(parent: Connection) -> None:
    parent.poll(None)  # returns at the end of the pipe: nothing is sent
    os._exit(1)


class ChildContext(LokyContext):  # type: ignore[misc]
    """A replacement of ``multiprocessing.get_context("spawn")``: a forked child would share the state of heyoka's
    compiler and threads, a spawned one would import the caller's script.

    mark: in the environment of its processes, for :func:`kill_marked`; empty for none.
    """

    def __init__(self, mark: str = "") -> None:
        super().__init__()
        self.mark = mark
        self._parent, self._lifeline = multiprocessing.Pipe(duplex=False)
        self._children: list[_Child] = []
        with (
            _starting,
            _environment_of_trackers(),
        ):  # the first lock of a pool would start them, from the working directory
            if os.name == "posix":
                resource_tracker.ensure_running()
            loky_tracker.ensure_running()

    def SimpleQueue(self) -> SimpleQueue[Any]:  # noqa: N802
        """The queue of Python: that of loky needs more modules, which an integrator may have broken."""
        return SimpleQueue(ctx=self)

    def Process(self, *arguments: Any, **options: Any) -> _Child:  # noqa: N802 - the name in multiprocessing
        """A new process, not yet started."""
        marked = {MARK: self.mark} if self.mark else {}
        child = _Child(*arguments, **options, env={SAFE_PATH: os.environ.get(SAFE_PATH, "1"), **marked})
        child.parent = self._parent
        child.own_path = SAFE_PATH not in os.environ
        self._children.append(child)
        return child

    @property
    def ending(self) -> str:
        """The way in which the last process ended by itself; empty if unknown."""
        child = self._children[-1]
        if child.pid is None:
            return ""
        deadline = monotonic() + _LAST_SECONDS
        while child.exitcode is None and monotonic() < deadline:  # the thread of the pool may notice it first
            sleep(_POLL)
        return "" if child.exitcode is None else how_it_ended(child.exitcode)

    def kill(self) -> None:
        """Kill its processes."""
        for child in self._children:
            child.kill()

    def kill_groups(self) -> None:
        """Kill the process groups of its processes."""
        for child in self._children:
            if child.pid is not None:
                with suppress(ProcessLookupError, PermissionError):
                    os.killpg(child.pid, signal.SIGKILL)
        self.kill()


def _lead_group(initializer: Callable[..., object] | None, initargs: tuple[Any, ...]) -> None:
    os.setpgid(0, 0)
    if initializer is not None:
        initializer(*initargs)


class GuardedProcess:
    """A process for one call at a time, the leader of a process group; it ends with all its descendants.

    initializer: called first in the process with ``initargs``, in its group.
    """

    def __init__(self, initializer: Callable[..., object] | None = None, initargs: tuple[Any, ...] = ()) -> None:
        self._context = ChildContext(uuid4().hex)
        self._pool = ProcessPoolExecutor(
            1, mp_context=self._context, initializer=_lead_group, initargs=(initializer, initargs)
        )
        self._guard: Guard | None = None

    def submit(self, call: Callable[P, T], *arguments: P.args, **options: P.kwargs) -> Future[T]:
        """Run a call in the process; raises BrokenProcessPool if the process has died."""
        return self._pool.submit(call, *arguments, **options)

    def guard(self, process: int) -> None:
        """Make the process, given by its id, end with this one, for whatever reason that ends."""
        with suppress(OSError):
            self._guard = Guard(process, self._context.mark)

    @property
    def ending(self) -> str:
        """The way in which the process ended by itself; empty if unknown."""
        return self._context.ending

    def kill(self) -> None:
        """Kill the process; its descendants live until :meth:`end`."""
        self._context.kill()

    def end(self) -> None:
        """Kill the process and all its descendants.

        Only then do the threads of its pool end: they wait for pipes that forked processes hold open too.
        """
        self._context.kill_groups()
        if self._guard is not None:
            self._guard.end()
        kill_marked(self._context.mark)
        self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def forked(work: Callable[[], T]) -> Iterator[Callable[[], T | None] | None]:
    """Calls ``work`` in a copy of this process, which ends with the block, or with its work where this process is
    killed; the function waits for the result, which is None where ``work`` raises.  None in place of the function on
    other systems than Linux, and where there is no process to be had.  Other threads must hold no lock that ``work``
    needs.
    """
    if sys.platform != "linux":
        yield None
        return
    readable, writable = os.pipe()
    try:
        with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # of idle threads of libraries
            child = os.fork()
    except OSError:
        os.close(readable)
        os.close(writable)
        yield None
        return
    if not child:
        gc.disable()
        with suppress(BaseException), open(writable, "wb") as pipe:
            pipe.write(pickle.dumps(work()))
        os._exit(0)  # without the exit handlers of its parent
    os.close(writable)
    try:
        with open(readable, "rb") as pipe:
            yield lambda: pickle.loads(content) if (content := pipe.read()) else None
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
