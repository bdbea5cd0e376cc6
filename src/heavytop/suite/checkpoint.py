"""Finished rows on disk while a run goes on, so that `run --resume` does not measure them again.

DIR/rows.jsonl: a first line that names plan and program, then one line a row, each written whole with its checksum.
A line that a kill cut short is measured again.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

import msgspec

from heavytop.errors import InputError
from heavytop.records import Row

FILE = "rows.jsonl"


class Checkpoint:
    """The rows of one run directory; a lock file lets only one run write there."""

    def __init__(self, directory: Path, identity: dict[str, str]) -> None:
        self.path = directory / FILE
        self.lock = directory / ".lock"
        self.identity = msgspec.json.encode(identity)
        self.done: dict[int, Row] = {}
        self._file: BinaryIO | None = None

    def __enter__(self) -> Checkpoint:
        import fcntl

        self._lock_file = self.lock.open("w")
        try:
            fcntl.flock(self._lock_file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock_file.close()
            raise InputError(
                f"Another run writes to {self.path.parent}.", "Wait for it, or give another --out."
            ) from None
        if self.path.exists():
            self._read()
        else:
            self.path.write_bytes(_line(self.identity))
        self._file = self.path.open("ab")
        return self

    def _read(self) -> None:
        lines = self.path.read_bytes().split(b"\n")
        first = _checked(lines[0])
        if first != self.identity:
            raise InputError(
                f"{self.path} belongs to another run: {(first or b'unreadable')[:200].decode(errors='replace')}, "
                f"this one is {self.identity.decode()}.",
                "Resume with the same plan and program version, or give another --out.",
            )
        kept = [lines[0]]
        for line in lines[1:]:
            content = _checked(line)
            if content is None:
                continue
            index, row = msgspec.json.decode(content, type=tuple[int, Row])
            self.done[index] = row
            kept.append(line)
        # drop what a kill cut short, so that the next line starts on its own
        replace(self.path, b"\n".join(kept) + b"\n")

    def add(self, index: int, row: Row) -> None:
        """Keep a finished row; it is on disk when this returns."""
        assert self._file is not None
        self.done[index] = row
        self._file.write(_line(msgspec.json.encode((index, row))))
        self._file.flush()
        os.fsync(self._file.fileno())

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
        if kind is None:
            self.path.unlink(missing_ok=True)
        if not self.done:
            self.path.unlink(missing_ok=True)
        self.lock.unlink(missing_ok=True)
        self._lock_file.close()
        with suppress(OSError):  # only an empty folder goes: nothing was finished, so nothing stays
            self.path.parent.rmdir()


def _line(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode() + b" " + content + b"\n"


def _checked(line: bytes) -> bytes | None:
    digest, _, content = line.partition(b" ")
    return content if hashlib.sha256(content).hexdigest().encode() == digest else None


def replace(path: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    temporary = path.with_name(f".{path.name}.partial")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(
            f"{path} cannot be written: {error.strerror}.", "Choose a writable --out with space."
        ) from None
