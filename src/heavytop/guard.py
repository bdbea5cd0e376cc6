"""Guards, which kill all processes of a program or an integrator when this process ends or is done with it."""

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
"""The environment variable by which a guard finds processes that left its group."""
_KILL_ALL = f"""read -r _
for file in $(grep -ls "{MARK}=$1" /proc/[0-9]*/environ); do
  process=${{file#/proc/}}
  kill -KILL "${{process%/environ}}"
done
kill -KILL 0"""
"""The script of a guard's shell once its input has ended."""
_ROUNDS = 20
"""The number of searches for processes that may just have been started."""


def processors() -> int:
    """The number of processors that this process may use; of all processors if the platform does not tell."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def how_it_ended(code: int) -> str:
    """``by SIGSEGV`` or ``with exit code 1``, from the exit code of a process in Python."""
    if code >= 0:
        return f"with exit code {code}"
    try:
        return f"by {signal.Signals(-code).name}"
    except ValueError:  # a real-time signal has no name
        return f"by signal {-code}"


class Guard:
    """A small process that kills its process group once this process has ended, for whatever reason.

    Processes started with :attr:`environment`, which their children inherit, are killed even if they left the group, as
    daemons and programs that call ``setsid`` do.  This needs /proc of Linux; elsewhere only the group is killed.

    group: the process group that it joins; 0 for a new one.  mark: of :class:`ChildContext`; empty for a new one.
    """

    def __init__(self, group: int = 0, mark: str = "") -> None:
        self._mark = mark or uuid4().hex
        reading, self._lifeline = os.pipe()
        try:
            # its input ends with this process, which alone holds the other end
            self._shell = subprocess.Popen(
                ["/bin/sh", "-c", _KILL_ALL, "sh", self._mark],
                stdin=reading,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                process_group=group,
                # a guard in a guarded process must survive when that is killed
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
        """The variable that marks a process and its descendants as guarded by this one."""
        return {MARK: self._mark}

    def end(self) -> None:
        """Kill every process of the group, the guard too, and those that left it."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.group, signal.SIGKILL)
        kill_marked(self._mark)
        self._shell.wait()
        with suppress(OSError):
            os.close(self._lifeline)


def kill_marked(mark: str) -> None:
    """Kill every process with this mark, even if it has left its group or lost its parent."""
    for _ in range(_ROUNDS):
        if not (remaining := _marked(mark)):
            break
        for process in remaining:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(process, signal.SIGKILL)


def _marked(mark: str) -> list[int]:
    """The processes with this mark in their environment; empty if the system does not show environments."""
    processes, entry = [], f"{MARK}={mark}".encode()
    for file in glob("/proc/[0-9]*/environ"):
        with suppress(OSError):  # it has ended, or is somebody else's; that of a zombie is empty
            if entry in Path(file).read_bytes():
                processes.append(int(file.split("/")[2]))
    return processes


def stopwatch(process: int | None = None, *, with_children: bool = False) -> Callable[..., float]:
    """Start a clock; the function returned gives the seconds since then, minus those in which a process, or this
    thread, was ready to run without a processor (counted on Linux), and minus its argument.

    The result is at least the time that the process has computed.

    with_children: whether the waiting time of its child processes is subtracted too.
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
    """Seconds in which this thread was ready to run without a processor; 0 if the system does not count them."""
    return _scheduled("thread-self")[1]


def _scheduled(process: str) -> tuple[float, float]:
    """Seconds in which the first thread of a process ran, and was ready without a processor; 0 if not counted."""
    running, waiting = map(int, [*_read(f"/proc/{process}/schedstat").split(), "0", "0"][:2])
    return running / 1e9, waiting / 1e9


def _read(file: str) -> str:
    try:
        return Path(file).read_text("ascii")
    except OSError:  # the process is gone, or the system has no such file
        return ""
