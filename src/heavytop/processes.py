"""Child processes that do not import the caller's script.

``multiprocessing`` imports the main script again in every child that it spawns, so a script without a main guard would
start over in each of them.  The children of this program need nothing of the script: what they run is imported by name.
"""

from __future__ import annotations

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
