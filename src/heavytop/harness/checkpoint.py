"""Checkpoint files of a run in progress, so that `run --resume` measures nothing twice.

DIR/rows.jsonl: a first line that names plan and program, then one line per row, each with its checksum.  The row of a
truncated line is measured again.  DIR/row-N.partial: the resume point of a long row in progress.  All is text; nothing
is ever unpickled.
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
"""Names of the files that a killed run leaves behind."""
EVERY = 10.0
"""Seconds between two resume points of a row in progress."""
_WAIT = 0.2
"""Seconds that a run waits for the lock: another run may be about to release it."""
_SYNC_EVERY = 1.0
"""Seconds of finished rows that a power failure may lose.  A kill loses none."""


class Saved:
    """The resume point of one row in progress, in a file of its own; without ``path`` nothing is saved.

    A measurement calls :meth:`load` once, and where :meth:`due` holds passes plain text and integers to :meth:`save`.
    taken: whether a resume point was loaded.
    """

    def __init__(self, path: Path | None = None, identity: str = "", every: float = EVERY) -> None:
        self.path = path
        self.identity = identity
        self.every = every
        self.taken = False
        self._last = monotonic()

    def forget(self) -> None:
        """Delete the resume point, so that the row is measured from the beginning."""
        self.taken = False
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    def load(self) -> dict[str, Any] | None:
        """The content last saved by the same plan and program; None where absent.

        The checksum detects damage, not forgery: the content is untrusted.
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
        """Whether the last save was at least ``every`` seconds ago.  No result depends on it."""
        return self.path is not None and monotonic() - self._last >= self.every

    def save(self, content: dict[str, Any]) -> None:
        """Replace the saved content."""
        assert self.path is not None
        replace(self.path, [line(msgspec.json.encode((self.identity, content)))])
        self._last = monotonic()


class Checkpoint:
    """The rows of one run directory, stored on disk; a lock lets only one run write there.

    identity: must be equal for a run to be resumed.  check: called with the lock held, before anything is read; raises
    InputError for an unsuitable directory.
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
            cleanup_on_error.callback(self._unlock)
            self.check()
            for leftover in self.directory.glob(".*.partial"):
                leftover.unlink()
            if not self.path.exists() or not self.path.stat().st_size:
                replace(self.path, [line(msgspec.json.encode(self.identity))])
            # unbuffered: the system has the row when add returns, and a failed write leaves no buffer that fails again
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
            stored = msgspec.json.decode(first, type=dict[str, str])
            require_same(records.of_identity(stored), self.identity, self.path)
        except msgspec.MsgspecError:
            raise InputError(f"{self.path} is damaged in its first line.", "Give another --out.") from None
        end = self._reader.tell()
        for entry in self._reader:
            content = verified(entry[:-1]) if entry.endswith(b"\n") else None
            if content is not None:
                with suppress(msgspec.MsgspecError):
                    index, _ = msgspec.json.decode(content, type=tuple[int, msgspec.Raw])
                    self.offsets[index] = end
            elif not entry.endswith(b"\n"):
                break
            end += len(entry)
        # a truncated last line is removed, so that the next row starts a line
        self._file.truncate(end)
        self._file.seek(end)

    def saved(self, index: int) -> Saved:
        """The resume point of the row of that index."""
        return Saved(self._partial_file(index), f"{self._digest} row {index}", self.every)

    def _partial_file(self, index: int) -> Path:
        return self.directory / f"row-{index}.partial"

    def add(self, index: int, row: Row) -> None:
        """Append a finished row.  Raises OSError where it is written only in part; then it is measured again."""
        offset = self._file.tell()
        content = line(msgspec.json.encode((index, row)))
        view = memoryview(content)
        while view:
            view = view[self._file.write(view) :]
        if monotonic() - self._synced > _SYNC_EVERY:
            os.fsync(self._file.fileno())
            self._synced = monotonic()
        self.offsets[index] = offset
        self._partial_file(index).unlink(missing_ok=True)

    def rows(self, indices: range | list[int]) -> Iterator[Row]:
        """The finished rows of those indices, read from the disk one at a time."""
        for index in indices:
            self._reader.seek(self.offsets[index])
            content = verified(self._reader.readline().removesuffix(b"\n"))
            if content is None:
                raise InputError(f"{self.path} was changed while it was in use.", "Continue with --resume.")
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

    def _unlock(self) -> None:
        with suppress(OSError):  # while it is held: a process that waits for this file notices that it was replaced
            (self.directory / ".lock").unlink()
        self._lock.release()
        with suppress(OSError):  # only an empty folder is removed
            self.directory.rmdir()


def identity_of(report: Report) -> dict[str, str]:
    """Plan, program and machine of a report, which determine its rows."""
    environment = report.environment
    plan = {f"plan {key}": value for key, value in report.plan.items()}
    return plan | {
        **environment["packages"],
        **{f"integrator {name}": version for name, version in environment.get("integrators", {}).items()},
        **{key: str(environment[key]) for key in ("commit", "processor", "simd_width_double")},
    }


def require_same(stored: dict[str, str], current: dict[str, str], file: Path) -> None:
    """Raises InputError with each key in which two identities differ, and both values."""
    different = [key for key in (*stored, *(current.keys() - stored.keys())) if stored.get(key) != current.get(key)]
    if different:
        raise InputError(
            f"{file} belongs to another run: "
            + ", ".join(f"{key} is {stored.get(key)} there and {current.get(key)} now" for key in different)
            + ".",
            "Resume with the same plan, program and machine, or give another --out.",
        )


def locked(directory: Path) -> FileLock:
    """The acquired lock of a directory; raises InputError where another process holds it."""
    from filelock import FileLock, Timeout

    # a run may end in another thread than it began in
    lock = FileLock(directory / ".lock", thread_local=False)
    while True:
        directory.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=_WAIT, poll_interval=_WAIT / 10)
        except FileNotFoundError:
            continue  # the previous run has just removed its folder
        except Timeout:
            raise InputError(f"Another run writes to {directory}.", "Wait for it, or give another --out.") from None
        return lock
