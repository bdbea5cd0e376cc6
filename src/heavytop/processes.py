"""Child processes that do not import the caller's script, and that end with this process.

``multiprocessing`` imports the main script again in every child that it spawns, so a script without a main guard would
start over in each of them.  The children of this program need nothing of the script: what they run is imported by name.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
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
"""Python's own: a file such as random.py in the working directory is not taken for a module."""
_POLL = 0.005
_LAST_SECONDS = 5.0
"""That a process has to end once it has closed its pipe."""
_starting = Lock()


class _Child(LokyProcess):  # type: ignore[misc]  # loky has no types
    """A process that is started with :data:`SAFE_PATH`, and runs without it where this process has none.

    It ends with its parent, however that ends, so that a daemon of multiprocessing may start one, such as the worker of
    Dask.

    parent: the end of a pipe whose other end the parent alone holds.
    """

    parent: Connection
    own_path = False

    def run(self) -> None:
        """In the process: what it starts in turn finds modules as usual."""
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
        """At once, where the system can; nothing where it has ended."""
        if self.pid is not None and self.exitcode is None:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(self.pid, getattr(signal, "SIGKILL", signal.SIGTERM))


@contextmanager
def _environment_of_trackers() -> Iterator[None]:
    """Lets processes started meanwhile begin with :data:`SAFE_PATH`, silent on what a signal left to clean up."""
    wanted = {SAFE_PATH: os.environ.get(SAFE_PATH, "1"), "PYTHONWARNINGS": "ignore"}
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _end_with(parent: Connection) -> None:
    parent.poll(None)  # nothing is ever sent: it has an end
    os._exit(1)


class ChildContext(LokyContext):  # type: ignore[misc]
    """In the place of ``multiprocessing.get_context("spawn")``: a forked child would share the state of heyoka's
    compiler and threads, a spawned one would import the caller's script.

    mark: what the environment of its processes holds, for :func:`kill_marked`; nothing where that is empty.
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
        """Python's own: that of loky needs more modules, which an integrator may have torn down."""
        return SimpleQueue(ctx=self)

    def Process(self, *arguments: Any, **options: Any) -> _Child:  # noqa: N802 - the name in multiprocessing
        """A process that is not yet started."""
        marked = {MARK: self.mark} if self.mark else {}
        child = _Child(*arguments, **options, env={SAFE_PATH: os.environ.get(SAFE_PATH, "1"), **marked})
        child.parent = self._parent
        child.own_path = SAFE_PATH not in os.environ
        self._children.append(child)
        return child

    @property
    def ending(self) -> str:
        """How its last process ended by itself; empty where the system does not say."""
        child = self._children[-1]
        if child.pid is None:
            return ""
        given_up = monotonic() + _LAST_SECONDS
        while child.exitcode is None and monotonic() < given_up:  # the thread of the pool may know first
            sleep(_POLL)
        return "" if child.exitcode is None else how_it_ended(child.exitcode)

    def kill(self) -> None:
        """Kills its processes."""
        for child in self._children:
            child.kill()

    def kill_groups(self) -> None:
        """Kills the process groups that its processes lead."""
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
    """A process for one call at a time, the leader of a process group; it ends with whatever it started.

    initializer: called in it first with ``initargs``, in its group.
    """

    def __init__(self, initializer: Callable[..., object] | None = None, initargs: tuple[Any, ...] = ()) -> None:
        self._context = ChildContext(uuid4().hex)
        self._pool = ProcessPoolExecutor(
            1, mp_context=self._context, initializer=_lead_group, initargs=(initializer, initargs)
        )
        self._guard: Guard | None = None

    def submit(self, call: Callable[P, T], *arguments: P.args, **options: P.kwargs) -> Future[T]:
        """The call, in the process.  Raises BrokenProcessPool where it died before."""
        return self._pool.submit(call, *arguments, **options)

    def guard(self, process: int) -> None:
        """The process, by its number, is there: from now on it ends with this one, however that ends."""
        with suppress(OSError):
            self._guard = Guard(process, self._context.mark)

    @property
    def ending(self) -> str:
        """How the process ended by itself; empty where the system does not say."""
        return self._context.ending

    def kill(self) -> None:
        """Kills the process; what it started lives until :meth:`end`."""
        self._context.kill()

    def end(self) -> None:
        """Kills the process and whatever it started, however that left it.

        Only then the threads of its pool end: they wait for pipes that a forked process holds too.
        """
        self._context.kill_groups()
        if self._guard is not None:
            self._guard.end()
        kill_marked(self._context.mark)
        self._pool.shutdown(wait=True, cancel_futures=True)
