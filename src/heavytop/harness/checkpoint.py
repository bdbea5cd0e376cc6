"""The files of a run while it goes on, so that `run --resume` measures nothing twice.

DIR/rows.jsonl: a first line that names plan and program, then one line a row, each with its checksum.  A line that a
kill cut short is measured again.  DIR/row-N.partial: the place of a long row in progress.  All is text; nothing is
ever unpickled.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO

import msgspec

from heavytop import records
from heavytop.errors import InputError
from heavytop.files import line, replace, verified
from heavytop.records import Report, Row

if TYPE_CHECKING:
    from filelock import FileLock

FILE = "rows.jsonl"
OURS = re.compile(r"rows\.jsonl|row-\d+\.partial|\.lock|\..*\.partial")
"""Names of what a run leaves behind when it is killed."""
EVERY = 10.0
"""Seconds between two places of a row in progress."""
_WAIT = 0.2
"""Seconds that a run waits for the lock: another may be removing its own just now."""
_SYNC_EVERY = 1.0
"""Seconds of finished rows that a power cut may cost.  A kill costs none."""


class Saved:
    """The place of one row in progress, in a file of its own; nowhere where ``path`` is None.

    A measurement asks :meth:`load` once, and where :meth:`due` says so hands plain text and integers to :meth:`save`.
    taken: whether something was loaded.
    """

    def __init__(self, path: Path | None = None, identity: str = "", every: float = EVERY) -> None:
        self.path = path
        self.identity = identity
        self.every = every
        self.taken = False
        self._last = monotonic()

    def forget(self) -> None:
        """Drop what was saved before: nothing is loaded any more, and the next save replaces it."""
        self.taken = False
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    def load(self) -> dict[str, Any] | None:
        """The content saved last by the same plan and program; None where absent.

        Its checksum is right, but not that of a secret: anything may stand in it.
        """
        if self.path is None or not self.path.exists():
            return None
        content = verified(self.path.read_bytes().removesuffix(b"\n"))
        if content is None:
            return None
        with suppress(msgspec.MsgspecError):
            identity, saved = msgspec.json.decode(content, type=tuple[str, dict[str, Any]])
            self.taken = identity == self.identity
            return saved if self.taken else None
        return None

    def due(self) -> bool:
        """Whether the last save is long enough ago.  No result depends on it."""
        return self.path is not None and monotonic() - self._last >= self.every

    def save(self, content: dict[str, Any]) -> None:
        """Keep this in the place of what was saved before."""
        assert self.path is not None
        replace(self.path, [line(msgspec.json.encode((self.identity, content)))])
        self._last = monotonic()


class Checkpoint:
    """The rows of one run directory, kept on disk; a lock lets only one run write there.

    identity: what must be the same for a run to go on.  check: called with the lock held, before anything is read; it
    raises InputError where the directory is not fit.
    """

    def __init__(
        self, directory: Path, identity: dict[str, str], check: Callable[[], None], every: float = EVERY
    ) -> None:
        self.directory = directory
        self.path = directory / FILE
        self.identity = identity
        self.check = check
        self.every = every
        self.offsets: dict[int, int] = {}
        self._digest = hashlib.sha256(msgspec.json.encode(identity)).hexdigest()
        self._file: BinaryIO
        self._reader: BinaryIO
        self._synced = 0.0

    def __enter__(self) -> Checkpoint:
        self._lock = locked(self.directory)
        with ExitStack() as cleanup_on_error:
            cleanup_on_error.callback(self._leave)
            self.check()
            for leftover in self.directory.glob(".*.partial"):
                leftover.unlink()
            if not self.path.exists():
                replace(self.path, [line(msgspec.json.encode(self.identity))])
            # unbuffered: a row is with the system when add returns, and a failed write leaves nothing to fail again
            self._file = cleanup_on_error.enter_context(self.path.open("r+b", buffering=0))
            self._reader = cleanup_on_error.enter_context(self.path.open("rb"))
            self._read()
            self._open = cleanup_on_error.pop_all()
        return self

    def _read(self) -> None:
        first = verified(self._reader.readline().removesuffix(b"\n"))
        if first is None:
            raise InputError(f"{self.path} is damaged in its first line.", "Give another --out.")
        try:
            there = msgspec.json.decode(first, type=dict[str, str])
            require_same(records.of_identity(there), self.identity, self.path)
        except msgspec.MsgspecError:
            raise InputError(f"{self.path} is damaged in its first line.", "Give another --out.") from None
        end = self._reader.tell()
        for whole in self._reader:
            content = verified(whole[:-1]) if whole.endswith(b"\n") else None
            if content is not None:
                with suppress(msgspec.MsgspecError):
                    index, _ = msgspec.json.decode(content, type=tuple[int, msgspec.Raw])
                    self.offsets[index] = end
            elif not whole.endswith(b"\n"):
                break
            end += len(whole)
        # what a kill cut short goes, so that the next line starts on its own
        self._file.truncate(end)
        self._file.seek(end)

    def saved(self, index: int) -> Saved:
        """Where the row of that index keeps its place."""
        return Saved(self._place(index), f"{self._digest} row {index}", self.every)

    def _place(self, index: int) -> Path:
        return self.directory / f"row-{index}.partial"

    def add(self, index: int, row: Row) -> None:
        """Keep a finished row.  Raises OSError where the disk takes it only in part; then it is measured again."""
        offset = self._file.tell()
        content = line(msgspec.json.encode((index, row)))
        view = memoryview(content)
        while view:
            view = view[self._file.write(view) :]
        if monotonic() - self._synced > _SYNC_EVERY:
            os.fsync(self._file.fileno())
            self._synced = monotonic()
        self.offsets[index] = offset
        self._place(index).unlink(missing_ok=True)

    def rows(self, indices: range | list[int]) -> Iterator[Row]:
        """The finished rows of those indices, one after the other from the disk."""
        for index in indices:
            self._reader.seek(self.offsets[index])
            content = verified(self._reader.readline().removesuffix(b"\n"))
            if content is None:
                raise InputError(f"{self.path} was changed while it was in use.", "Go on with --resume.")
            try:
                yield records.of_row(msgspec.json.decode(content, type=tuple[int, Row])[1])
            except msgspec.MsgspecError as error:
                raise InputError(f"Each line of {self.path} must be a row: {error}", "Give another --out.") from None

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or not (self.offsets or any(self.directory.glob("row-*.partial"))):
            self.path.unlink(missing_ok=True)
            for partial in self.directory.glob("row-*.partial"):
                partial.unlink(missing_ok=True)
        self._open.close()

    def _leave(self) -> None:
        name = self.directory / ".lock"
        try:
            # while the lock is held: whoever waits for this file finds that it is no longer the one
            name.unlink(missing_ok=True)
            self._lock.release()
        except PermissionError:  # Windows: not while it is open, and not where another run has it open
            self._lock.release()
            with suppress(OSError):
                name.unlink()
        with suppress(OSError):  # only an empty folder goes: nothing was finished, so nothing stays
            self.directory.rmdir()


def identity_of(report: Report) -> dict[str, str]:
    """Plan, program and machine of a report: with these the same its rows are the same."""
    surroundings = report.environment
    plan = {f"plan {key}": value for key, value in report.plan.items()}
    return plan | {
        **surroundings["packages"],
        **{f"integrator {name}": said for name, said in surroundings.get("integrators", {}).items()},
        **{key: str(surroundings[key]) for key in ("commit", "processor", "simd_width_double")},
    }


def require_same(there: dict[str, str], here: dict[str, str], where: Path) -> None:
    """Raises InputError that names each key in which two identities differ, with both values."""
    different = [key for key in (*there, *(here.keys() - there.keys())) if there.get(key) != here.get(key)]
    if different:
        raise InputError(
            f"{where} belongs to another run: "
            + ", ".join(f"{key} is {there.get(key)} there and {here.get(key)} now" for key in different)
            + ".",
            "Resume with the same plan, program and machine, or give another --out.",
        )


def locked(directory: Path) -> FileLock:
    """The lock of a directory, held; raises InputError where another process holds it."""
    from filelock import FileLock, Timeout

    # a process of several threads may end a run in another one than it began in
    lock = FileLock(directory / ".lock", thread_local=False)
    while True:
        directory.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=_WAIT, poll_interval=_WAIT / 10)
        except FileNotFoundError:
            continue  # the run before removed its folder just now
        except Timeout:
            raise InputError(f"Another run writes to {directory}.", "Wait for it, or give another --out.") from None
        return lock
