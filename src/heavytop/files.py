"""Atomic writes of files, and lines with a checksum."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from heavytop.errors import InputError, quoted


def without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of a JSON document, for ``object_pairs_hook``; raises InputError for a repeated key.

    JSON readers differ in which of the values they take.
    """
    table = dict(pairs)
    if len(table) < len(pairs):
        twice = next(key for key, count in Counter(key for key, _ in pairs).items() if count > 1)
        raise InputError(f"The key {quoted(twice)} stands twice in one object.", "Give each key once.")
    return table


def read_whole(path: Path) -> bytes:
    """The content of a file.

    Raises OSError, also for a device such as /dev/zero, which has no end, and for a pipe, which may have no writer.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError("it is a device or a pipe, not a file")
    return path.read_bytes()


def line(content: bytes) -> bytes:
    """``content``, which contains no line break, after its SHA-256."""
    return hashlib.sha256(content).hexdigest().encode() + b" " + content + b"\n"


def verified(signed: bytes) -> bytes | None:
    """The content of a line without line break; None if its checksum is wrong."""
    digest, _, content = signed.partition(b" ")
    return content if hashlib.sha256(content).hexdigest().encode() == digest else None


def replace(path: Path, content: bytes | Iterable[bytes]) -> str:
    """Write a file atomically, from one piece or several; returns its SHA-256.

    Raises InputError if it cannot be written; then no partial file remains.
    """
    digest = hashlib.sha256()
    with atomic_write(path) as file:
        for piece in [content] if isinstance(content, bytes) else content:
            file.write(piece)
            digest.update(piece)
    return digest.hexdigest()


def replace_all(contents: Sequence[tuple[Path, bytes]]) -> None:
    """Write several files, all of them or none; raises InputError if one cannot be written."""
    with ExitStack() as stack:
        for path, content in contents:
            file = stack.enter_context(atomic_write(path))
            file.write(content)
            # a full disk is detected before the first file gets its name
            file.flush()
            os.fsync(file.fileno())


def cache_folder(name: str) -> Path:
    """The cache folder of this user; a path that cannot exist for a user without a home."""
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    with suppress(RuntimeError):
        return (Path(home) if home else Path.home() / ".cache") / "heavytop" / name
    return Path(os.devnull) / "none"


@contextmanager
def atomic_write(path: Path) -> Iterator[BinaryIO]:
    """A file that is renamed to ``path`` once it is complete; no partial file remains after a failure.

    Raises InputError if it cannot be written.
    """
    if path.exists() and not path.is_file():
        what = "folder" if path.is_dir() else "device or a pipe"
        raise InputError(f"{path} cannot be written: it is a {what}.", "Give the name of a file.")
    temporary = path.parent / f".{path.name}.{os.getpid()}.partial"
    try:
        with temporary.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written: {error.strerror}.",
            "Make space, or give another --out; what a run finished is kept for --resume.",
        ) from None
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
