"""Standard output and standard error as the caller left them: closed, full, read by nobody, in any encoding."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterable
from typing import Any, TextIO

from heavytop import former_names
from heavytop.errors import HeavyTopError

READER_GONE = 141
"""The exit code of other tools whose reader went away: 128 + SIGPIPE."""
_LOSSY = {"strict": "replace", "surrogateescape": "replace"}
_own: TextIO | None = None
_CAUSES = {errno.EBADF: "it is closed"}


class OutputError(HeavyTopError):
    """Standard output that cannot be written: the result is lost, and nobody may take the exit code for a result."""


class ReaderGone(Exception):
    """The program that read standard output ended, as `head` does; no error, and no more output."""


class _Output(io.FileIO):
    """Standard output, whose failures are not mistaken for those of files, by us or by any library in between."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            raise ReaderGone from None
        except OSError as error:
            cause = _CAUSES.get(error.errno or 0, str(error.strerror))
            raise OutputError(f"Standard output cannot be written: {cause}.", "Send it where there is space.") from None


class _Messages(io.FileIO):
    """Standard error: what cannot be said is dropped, and changes nothing else."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def prepare() -> None:
    """Replace the streams of this process by those of this module, where they are its own and not a caller's."""
    # a file opened later must not get the number of a closed stream; from a null device opened the wrong way round
    # reading or writing fails as it would from the closed one
    for number, flags in ((0, os.O_WRONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, flags)
            if null != number:
                os.dup2(null, number)
                os.close(null)
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115
    if sys.stdout is sys.__stdout__:
        sys.stdout = _stream(_Output(1, "w", closefd=False), sys.stdout, "strict")
    if sys.stderr is sys.__stderr__:
        global _own
        _own = _stream(_Messages(os.dup(2), "w"), sys.stderr, "backslashreplace")
        sys.stderr = _stream(_Messages(2, "w", closefd=False), sys.stderr, "backslashreplace")


def _stream(raw: io.FileIO, before: Any, errors: str) -> io.TextIOWrapper:
    """Text into ``raw``, as ``before`` encoded it, but that a character which the encoding lacks is replaced."""
    encoding = "utf-8" if before is None else before.encoding
    errors = errors if before is None else before.errors
    if before is not None:
        before.flush()
    by_line = isinstance(raw, _Messages) or raw.isatty()
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, _LOSSY.get(errors, errors), line_buffering=by_line)


def drop_output() -> None:
    """Let what is still to be written go nowhere, so that the end of the process does not try once more."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)


def messages() -> TextIO:
    """Where the program itself speaks to people: standard error, also while a third-party integrator is silenced."""
    return _own or sys.stderr


def say(text: str) -> None:
    """A message for people."""
    print(f"heavytop: {text}", file=messages(), flush=True)


def say_former(names: Iterable[str]) -> None:
    """A line for each name among these that an integrator had before."""
    for name in sorted(set(names)):
        if text := former_names.notice(name):
            say(f"note: {text}")


def printable(document: str) -> str:
    """A JSON document in characters that standard output has: what its encoding lacks is escaped, and nothing lost."""
    try:
        document.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        import json

        return json.dumps(json.loads(document), indent=1)
    return document
