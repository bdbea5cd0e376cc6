"""A guard kills what a program or an integrator started, once this process has ended or is done with it."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from glob import glob
from pathlib import Path
from time import perf_counter
from uuid import uuid4

MARK = "HEAVYTOP_GUARD"
"""The variable of the environment by which a guard finds what left its process group."""
_KILL_ALL = f"""read -r _
for file in $(grep -ls "{MARK}=$1" /proc/[0-9]*/environ); do
  process=${{file#/proc/}}
  kill -KILL "${{process%/environ}}"
done
kill -KILL 0"""
"""The script of a guard's shell once its input has ended."""
_ROUNDS = 20
"""How often what a process may just have started is looked for."""


def processors() -> int:
    """How many processors this process may use, where the platform tells; else how many there are."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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


def _marked(mark: str) -> list[int]:
    """The processes whose environment has this mark; none where the system does not show environments."""
    processes, wanted = [], f"{MARK}={mark}".encode()
    for file in glob("/proc/[0-9]*/environ"):
        with suppress(OSError):  # it has ended, or is somebody else's; that of a zombie is empty
            if wanted in Path(file).read_bytes():
                processes.append(int(file.split("/")[2]))
    return processes


def stopwatch(process: int | None = None, *, with_children: bool = False) -> Callable[..., float]:
    """Starts a clock: the seconds since then, less those that a process, or this thread, was ready to run and had no
    processor, as far as the system counts them, which Linux does, and less seconds that are given.

    What the process computed remains at least.

    with_children: less those of the processes that it started, too, for which it waits.
    """

    def counted() -> tuple[float, float]:
        children = _read(f"/proc/{process}/task/{process}/children") if with_children else ""
        threads = [_scheduled(name) for name in [str(process or "thread-self"), *children.split()]]
        return max(running for running, _ in threads), sum(waiting for _, waiting in threads)

    computed, waited, began = *counted(), perf_counter()

    def seconds(late: float = 0.0) -> float:
        wall, (computing, waiting) = perf_counter() - began, counted()
        charged = wall - max(waiting - waited, 0.0) - late
        return max(charged, min(computing - computed, wall))

    return seconds


def waited_for_processor() -> float:
    """Seconds for which this thread was ready to run and had no processor; 0 where nobody counts them."""
    return _scheduled("thread-self")[1]


def _scheduled(process: str) -> tuple[float, float]:
    """Seconds for which a process, or its first thread, ran, and was ready and had no processor; 0 if not counted."""
    running, waiting = map(int, [*_read(f"/proc/{process}/schedstat").split(), "0", "0"][:2])
    return running / 1e9, waiting / 1e9


def _read(file: str) -> str:
    try:
        return Path(file).read_text("ascii")
    except OSError:  # the process is gone, or the system has no such file
        return ""
