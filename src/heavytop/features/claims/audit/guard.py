"""The audit of a file in a process of its own, with limits of time and memory.

The algebra of a usual claim takes seconds; that of a hostile or hopeless one may never end, and cannot be interrupted
from within.  The file is opened, read and parsed in that process too.
"""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from typing import TypeAlias

import msgspec

from heavytop.errors import ExitCode, HeavyTopError, InputError, quoted
from heavytop.features.claims.audit.judge import Audit
from heavytop.guard import how_it_ended

SECONDS = 20
"""Seconds of processor time: a claim is not refused because others use the machine."""
_WALL = 6
"""The limit by the clock is so many times as long."""
_BYTES = 3 << 30
# seconds after which the process ends itself, where no caller is left to stop it
_GRACE = 2
# the child imports nothing of the caller's script, which needs no main guard
_CHILD = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from heavytop.features.claims.audit.audit import child; child()"
)
_NO_MEMORY = b"Unable to allocate memory"
_TOO_LARGE = "Use fewer independent roots and exponentials, lower powers, or split the claim."


Answer: TypeAlias = Audit | tuple[str, str]
"""The answer of the child: a report, or the cause and remedy of an InputError."""


class AuditEnded(HeavyTopError):
    """The end of an audit's process without an answer."""

    exit_code = ExitCode.INCOMPLETE


def in_time(path: str, system_name: str, seconds: float = SECONDS) -> Audit:
    """The audit of the claim in a file; system_name: "" for the file's own.

    Raises InputError where it takes more than ``seconds`` of processor time, 3 GB or the stack, and AuditEnded where
    the process of the audit ends without an answer.
    """
    slow = InputError(f"{path}: the audit took more than {seconds:g} s and was stopped.", _TOO_LARGE)
    wall = seconds * _WALL
    limits = [str(math.ceil(seconds)), str(math.ceil(wall) + _GRACE)]
    command = [sys.executable, "-I", "-c", _CHILD, json.dumps(sys.path), path, system_name, *limits]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=wall, check=False)
    except subprocess.TimeoutExpired:
        raise slow from None
    except ValueError as error:
        raise InputError(f"{quoted(path)} cannot be read: {error}.", "Give the path of a claim in TOML.") from None
    except OSError as error:
        raise AuditEnded(f"{path}: the process of the audit cannot be started: {error.strerror}.") from None
    if done.returncode == -getattr(signal, "SIGXCPU", 0) < 0:
        raise slow
    try:
        answer: Answer = msgspec.json.decode(done.stdout, type=Answer)
    except msgspec.DecodeError:
        if _NO_MEMORY in done.stdout + done.stderr:  # FLINT ends the process
            raise no_memory(path) from None
        raise AuditEnded(f"{path}: the process of the audit {_end_of(done)}.", "Try again.") from None
    if isinstance(answer, Audit):
        return answer
    raise InputError(*answer)


def no_memory(path: str) -> InputError:
    """The error of an audit that takes too much memory."""
    return InputError(f"{path}: the audit took more than {_BYTES >> 30} GB and was stopped.", _TOO_LARGE)


def too_deep(path: str) -> InputError:
    """The error of an audit that exhausts the stack."""
    return InputError(f"{path}: the formulas are nested too deeply, and the audit was stopped.", _TOO_LARGE)


def _end_of(done: subprocess.CompletedProcess[bytes]) -> str:
    if done.returncode < 0:
        return f"was killed {how_it_ended(done.returncode)}"
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return f"ended without an answer, exit code {done.returncode}" + "".join(f": {line[:200]}" for line in last)


def limit_process(seconds: int) -> None:
    """Limits the memory and processor time of this process; Windows has no such limits."""
    try:
        import resource
    except ImportError:
        return
    for kind, limit in ((resource.RLIMIT_AS, _BYTES), (resource.RLIMIT_CPU, seconds)):
        hard = resource.getrlimit(kind)[1]
        most = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(kind, (most, hard if kind == resource.RLIMIT_CPU else most))
