"""Child processes that do not import the caller's script, and that end with this process.

``multiprocessing`` imports the main script again in every child that it spawns, so a script without a main guard would
start over in each of them.  The children of this program need nothing of the script: what they run is imported by name.
"""

from __future__ import annotations

import os
import signal
import subprocess
from contextlib import suppress
from multiprocessing import spawn
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Lock, get_ident
from typing import Any

_starting = Lock()


class _Child(SpawnProcess):
    """A spawned process that is told nothing of the caller's script."""

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
            try:
                return SpawnProcess._Popen(process_obj)
            finally:
                spawn.get_preparation_data = prepare


class ChildContext(SpawnContext):
    """In the place of ``multiprocessing.get_context("spawn")``: spawned, as a forked child would share the state of
    heyoka's compiler and threads, and without the caller's script.
    """

    Process = _Child


class Guard:
    """A small process that kills its process group once this process has ended, however that came about.

    group: the process group that it joins; a new one where that is 0.
    """

    def __init__(self, group: int = 0) -> None:
        reading, self._lifeline = os.pipe()
        try:
            # what it reads ends with this process, which alone holds the other end
            self._shell = subprocess.Popen(
                ["/bin/sh", "-c", "read -r _; kill -KILL 0"],
                stdin=reading,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                process_group=group,
            )
        except BaseException:
            os.close(self._lifeline)
            raise
        finally:
            os.close(reading)
        self.group = group or self._shell.pid

    def end(self) -> None:
        """Kills every process of the group, the guard too."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.group, signal.SIGKILL)
        self._shell.wait()
        with suppress(OSError):
            os.close(self._lifeline)
