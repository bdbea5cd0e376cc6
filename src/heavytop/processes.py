"""Child processes that do not import the caller's script, and that end with this process.

``multiprocessing`` imports the main script again in every child that it spawns, so a script without a main guard would
start over in each of them.  The children of this program need nothing of the script: what they run is imported by name.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from glob import glob
from multiprocessing import current_process, resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Lock, Thread
from typing import Any, ParamSpec, TypeVar
from uuid import uuid4

from loky.backend import resource_tracker as loky_tracker
from loky.backend.context import LokyContext
from loky.backend.process import LokyProcess

P = ParamSpec("P")
T = TypeVar("T")

MARK = "HEAVYTOP_GUARD"
"""The variable of the environment by which a guard finds what left its process group."""
SAFE_PATH = "PYTHONSAFEPATH"
"""Python's own: a file such as random.py in the working directory is not taken for a module."""
_KILL_ALL = f"""read -r _
for file in $(grep -ls "{MARK}=$1" /proc/[0-9]*/environ); do
  process=${{file#/proc/}}
  kill -KILL "${{process%/environ}}"
done
kill -KILL 0"""
"""What the shell of a guard does once its input has ended."""
_ROUNDS = 20
"""How often what a process may just have started is looked for."""
_starting = Lock()


class _Child(LokyProcess):  # type: ignore[misc]  # loky has no types
    """A process that begins with :data:`SAFE_PATH`, and goes on without it where this process has none.

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
def _safe_path() -> Iterator[None]:
    """What is started meanwhile begins with :data:`SAFE_PATH`."""
    own = SAFE_PATH in os.environ
    os.environ.setdefault(SAFE_PATH, "1")
    try:
        yield
    finally:
        if not own:
            os.environ.pop(SAFE_PATH, None)


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
        with _starting, _safe_path():  # the first lock of a pool would start them, from the working directory
            resource_tracker.ensure_running()
            loky_tracker.ensure_running()

    def Process(self, *arguments: Any, **options: Any) -> _Child:  # noqa: N802 - the name in multiprocessing
        """A process that is not yet started."""
        marked = {MARK: self.mark} if self.mark else {}
        child = _Child(*arguments, **options, env={SAFE_PATH: os.environ.get(SAFE_PATH, "1"), **marked})
        child.parent = self._parent
        child.own_path = SAFE_PATH not in os.environ
        self._children.append(child)
        return child

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

    def terminate(self) -> None:
        """Asks its processes to end."""
        for child in self._children:
            if child.is_alive():
                child.terminate()


def _lead_group(initializer: Callable[..., object] | None, initargs: tuple[Any, ...]) -> None:
    os.setpgid(0, 0)
    if initializer is not None:
        initializer(*initargs)


class Guard:
    """A small process that kills its process group once this process has ended, however that came about.

    What is started with :attr:`environment` is killed too where it has left the group, as a program does that calls
    ``setsid`` or becomes a daemon: what a process starts inherits its environment.  That takes a Linux /proc; elsewhere
    the group alone is killed.

    group: the process group that it joins; a new one where that is 0.  mark: of :class:`ChildContext`; else a new one.
    """

    def __init__(self, group: int = 0, mark: str = "") -> None:
        self._mark = mark or uuid4().hex
        reading, self._lifeline = os.pipe()
        try:
            # what it reads ends with this process, which alone holds the other end
            self._shell = subprocess.Popen(
                ["/bin/sh", "-c", _KILL_ALL, "sh", self._mark],
                stdin=reading,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                process_group=group,
                # a guard inside what another guards is to do its work when that is killed
                env={name: value for name, value in os.environ.items() if name != MARK},
            )
        except BaseException:
            os.close(self._lifeline)
            raise
        finally:
            os.close(reading)
        self.group = group or self._shell.pid

    @property
    def environment(self) -> dict[str, str]:
        """The variable that marks a process, and all that it starts, as this guard's."""
        return {MARK: self._mark}

    def end(self) -> None:
        """Kills every process of the group, the guard too, and those that left it."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.group, signal.SIGKILL)
        kill_marked(self._mark)
        self._shell.wait()
        with suppress(OSError):
            os.close(self._lifeline)


def kill_marked(mark: str) -> None:
    """Kills every process that has this mark, also where it has left its group or lost its parent."""
    for _ in range(_ROUNDS):
        if not (left := _marked(mark)):
            break
        for process in left:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(process, signal.SIGKILL)


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


def _marked(mark: str) -> list[int]:
    """The processes whose environment has this mark; none where the system does not show environments."""
    found, wanted = [], f"{MARK}={mark}".encode()
    for file in glob("/proc/[0-9]*/environ"):
        with suppress(OSError):  # it has ended, or is somebody else's; that of a zombie is empty
            if wanted in Path(file).read_bytes():
                found.append(int(file.split("/")[2]))
    return found
