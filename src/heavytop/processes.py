"""Child processes that do not import the caller's script, and that end with this process.

``multiprocessing`` imports the main script again in every child that it spawns, so a script without a main guard would
start over in each of them.  The children of this program need nothing of the script: what they run is imported by name.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from glob import glob
from multiprocessing import current_process, resource_tracker, spawn
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from threading import Lock, get_ident
from typing import Any
from uuid import uuid4

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


class _Child(SpawnProcess):
    """A spawned process that is told nothing of the caller's script.

    A daemon of multiprocessing, such as the worker of Dask, may start one: it ends with its parent, however that ends.

    mark: what its environment holds from the beginning, for :func:`kill_marked`; nothing where that is empty.
    own_path: whether :data:`SAFE_PATH` is set while it begins alone.
    """

    mark = ""
    own_path = False

    def run(self) -> None:
        """In the process: what it starts in turn finds modules as usual."""
        if self.own_path:
            os.environ.pop(SAFE_PATH, None)
        super().run()

    def start(self) -> None:
        config = current_process()._config  # type: ignore[attr-defined]
        daemon = config.pop("daemon", None)
        try:
            super().start()
        finally:
            if daemon is not None:
                config["daemon"] = daemon

    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # noqa: N802 - the hook of multiprocessing
        caller = get_ident()
        with _starting:
            prepare = spawn.get_preparation_data

            def without_script(name: str) -> dict[str, Any]:
                data: dict[str, Any] = dict(prepare(name))
                if get_ident() == caller:  # other threads may be starting processes of their own
                    for key in ("init_main_from_name", "init_main_from_path"):
                        data.pop(key, None)
                return data

            spawn.get_preparation_data = without_script
            process_obj.own_path = SAFE_PATH not in os.environ
            try:
                with _environment({SAFE_PATH: os.environ.get(SAFE_PATH, "1")}):
                    resource_tracker.ensure_running()  # which outlives the child, and so has no mark
                    with _environment({MARK: process_obj.mark} if process_obj.mark else {}):
                        return SpawnProcess._Popen(process_obj)
            finally:
                spawn.get_preparation_data = prepare


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """What is started meanwhile has these: a process shows the environment that it began with, forked ones too."""
    former = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in former.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class ChildContext(SpawnContext):
    """In the place of ``multiprocessing.get_context("spawn")``: spawned, as a forked child would share the state of
    heyoka's compiler and threads, and without the caller's script.

    mark: what the environment of its processes holds, for :func:`kill_marked`.
    """

    def __init__(self, mark: str = "") -> None:
        super().__init__()
        self._mark = mark
        with _starting, _environment({SAFE_PATH: os.environ.get(SAFE_PATH, "1")}):
            resource_tracker.ensure_running()  # the first lock of a pool would start it, from the working directory

    def Process(self, *arguments: Any, **options: Any) -> SpawnProcess:  # type: ignore[override]  # noqa: N802
        """A process that is not yet started."""
        child = _Child(*arguments, **options)
        child.mark = self._mark
        return child


def new_mark() -> str:
    """What no other process has in its environment."""
    return uuid4().hex


def lead_group() -> None:
    """In a new process: it leads a process group of its own."""
    os.setpgid(0, 0)


def how_it_ended(code: int) -> str:
    """``by SIGSEGV`` or ``with exit code 1``, of the exit code that Python gives of a process."""
    if code >= 0:
        return f"with exit code {code}"
    try:
        return f"by {signal.Signals(-code).name}"
    except ValueError:  # a signal of real time has no name
        return f"by signal {-code}"


class Guard:
    """A small process that kills its process group once this process has ended, however that came about.

    What is started with :attr:`environment` is killed too where it has left the group, as a program does that calls
    ``setsid`` or becomes a daemon: what a process starts inherits its environment.  That takes a Linux /proc; elsewhere
    the group alone is killed.

    group: the process group that it joins; a new one where that is 0.  mark: of :class:`ChildContext`; else a new one.
    """

    def __init__(self, group: int = 0, mark: str = "") -> None:
        self._mark = mark or new_mark()
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


def end_pool(pool: ProcessPoolExecutor, guard: Guard | None, mark: str) -> None:
    """Kills the processes of a pool, each the leader of a group, and whatever they started, however it left them.

    Only then its threads end: they wait for pipes that a forked process holds too.
    """
    for process in list((pool._processes or {}).values()):
        if process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
    if guard is not None:
        guard.end()
    kill_marked(mark)
    pool.shutdown(wait=True, cancel_futures=True)


def _marked(mark: str) -> list[int]:
    """The processes whose environment has this mark; none where the system does not show environments."""
    found, wanted = [], f"{MARK}={mark}".encode()
    for file in glob("/proc/[0-9]*/environ"):
        with suppress(OSError):  # it has ended, or is somebody else's; that of a zombie is empty
            if wanted in Path(file).read_bytes():
                found.append(int(file.split("/")[2]))
    return found
