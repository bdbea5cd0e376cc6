"""A cache of machine code on disk, shared by processes.

The name of a file is a hash of all that determines its code: the text of this package, the function that writes it and
its arguments, processor and compiler.  The file begins with the SHA-256 of its content; a file that is damaged, has
another name or belongs to another user is ignored, and a folder that cannot be written is not used.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from heavytop import top
from heavytop.errors import InputError
from heavytop.files import cache_folder, line, replace, verified
from heavytop.top.equations import System

_MOST_FILES = 100
"""The number of files kept; the oldest are deleted."""


def key_of(function: Any, arguments: tuple[Any, ...], processor: object) -> str:
    """The name of the file for the code of a function with these arguments."""
    values = [value.name if isinstance(value, System) else repr(value) for value in arguments]
    text = repr((_program(), function.__module__, function.__qualname__, values, processor))
    return hashlib.sha256(text.encode()).hexdigest()


def read(key: str) -> tuple[bytes, bytes] | None:
    """The code of a name and its note; None without a valid file."""
    try:
        with (cache_folder("multiword") / key).open("rb") as file:
            status = os.fstat(file.fileno())
            if not _is_own(status):
                return None
            first, code = file.readline(), file.read()
    except OSError:
        return None
    content = verified(first.removesuffix(b"\n"))
    if content is None:
        return None
    name, digest, beside = content.split(b" ", 2)
    return (code, beside) if (name.decode(), digest) == (key, _digest(code)) else None


def write(key: str, code: bytes, beside: bytes) -> None:
    """Store the code of a name if possible; beside: a note of one line."""
    with suppress(OSError, InputError):
        folder = cache_folder("multiword")
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        replace(folder / key, line(b" ".join([key.encode(), _digest(code), beside])) + code)
        for old in sorted(folder.iterdir(), key=lambda file: file.stat().st_mtime)[:-_MOST_FILES]:
            old.unlink(missing_ok=True)


def _is_own(status: os.stat_result) -> bool:
    """Whether a file belongs to the user and only the user may write to it."""
    if not hasattr(os, "getuid"):
        return True
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _digest(code: bytes) -> bytes:
    return hashlib.sha256(code).hexdigest().encode()


@cache
def _program() -> str:
    """The text of the package, of the equations that it reads, and the version of LLVM."""
    import llvmlite
    from llvmlite import binding

    digest = hashlib.sha256(repr((llvmlite.__version__, binding.llvm_version_info)).encode())
    for folder in (Path(__file__).parents[1], Path(top.__file__).parent):
        for file in sorted(folder.rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()
