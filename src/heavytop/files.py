"""Files: reads and writes with the errors of the program, atomic writes, and lines with a checksum."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from heavytop.errors import InputError, quoted, why

_RESUMABLE = "Give a writable --out, or make space; finished rows are kept for --resume."


def without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of a JSON document, for ``object_pairs_hook``; raises InputError for a repeated key.

    JSON readers differ in which of the values they take.
    """
    table = dict(pairs)
    if len(table) < len(pairs):
        twice = next(key for key, count in Counter(key for key, _ in pairs).items() if count > 1)
        raise InputError(f"The key {quoted(twice)} occurs twice in one object.", "Give each key once.")
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


@contextmanager
def writable(path: Path, remedy: str = _RESUMABLE) -> Iterator[None]:
    """Report a failure to write ``path`` in this block as InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path} cannot be written: {why(error)}.", remedy) from None


@contextmanager
def readable(path: Path | str, remedy: str, *errors: type[Exception]) -> Iterator[None]:
    """Report a failure to read ``path`` in this block as InputError; errors: further ones than those of the system."""
    caught: tuple[type[Exception], ...] = (OSError, UnicodeError, *errors)
    try:
        yield
    except caught as error:
        remedy = "Save it as UTF-8." if isinstance(error, UnicodeDecodeError) else remedy
        raise InputError(f"{path} cannot be read: {why(error)}.", remedy) from None


def require_new(folder: Path, remedy: str = "Give a new folder with --out.") -> None:
    """Raise InputError for a file, and for a folder that is not empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} already exists and is not an empty folder.", remedy)


def cache_folder(name: str) -> Path:
    """The cache folder of this user; a path that cannot exist for a user without a home.

    A relative XDG_CACHE_HOME is ignored, as the XDG Base Directory Specification requires.
    """
    folders = (Path(os.environ.get(variable, "")) for variable in ("XDG_CACHE_HOME", "LOCALAPPDATA"))
    home = next(filter(Path.is_absolute, folders), None)
    with suppress(RuntimeError):
        return (home or Path.home() / ".cache") / "heavytop" / name
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
        with writable(path):
            with temporary.open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
