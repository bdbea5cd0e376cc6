"""The audit of a file in a process of its own, with an end to its time and memory.

The algebra of an honest claim takes seconds; that of a hostile or hopeless one can take forever, and cannot be
interrupted from within.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import msgspec

from heavytop.claims.judge import Audit
from heavytop.errors import HeavyTopError, InputError

SECONDS = 20
_BYTES = 3 << 30
# the program of the child: it imports nothing of the caller's script, so that this needs no main guard there
_CHILD = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from heavytop.claims.guard import child; child()"
_TOO_LARGE = "Use fewer independent roots and exponentials, lower powers, or split the claim."


class AuditEnded(HeavyTopError):
    """The process of an audit ended without an answer: says how."""

    exit_code = 3


class Answer(msgspec.Struct, frozen=True):
    """What the child says: a report, or (cause, remedy) of an error, or that its memory was used up."""

    report: Audit | None = None
    error: tuple[str, str] | None = None
    memory: bool = False


def in_time(path: str, system_name: str, seconds: float = SECONDS) -> Audit:
    """The audit of the claim in a file; raises InputError where it takes longer than ``seconds`` or 3 GB.

    Raises AuditEnded with what happened where the process of the audit ends without an answer.
    """
    command = [sys.executable, "-I", "-c", _CHILD, json.dumps(sys.path), path, system_name]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        raise InputError(f"{path}: the audit took more than {seconds:g} s and was stopped.", _TOO_LARGE) from None
    try:
        answer = msgspec.json.decode(done.stdout, type=Answer)
    except msgspec.DecodeError:
        raise AuditEnded(f"{path}: the process of the audit {_end_of(done)}.", "Try again.") from None
    if answer.report is not None:
        return answer.report
    if answer.error is not None:
        raise InputError(*answer.error)
    raise InputError(f"{path}: the audit took more than {_BYTES >> 30} GB and was stopped.", _TOO_LARGE)


def _end_of(done: subprocess.CompletedProcess[bytes]) -> str:
    """How a process that gave no answer ended."""
    if done.returncode < 0:
        try:
            name = signal.Signals(-done.returncode).name
        except ValueError:
            name = f"signal {-done.returncode}"
        return f"was killed by {name}"
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return f"ended without an answer, exit code {done.returncode}" + "".join(f": {line[:200]}" for line in last)


def child() -> None:
    """The audit of ``sys.argv[2:]`` = path, system: one JSON document of :class:`Answer` on standard output."""
    _limit_memory()
    from heavytop.claims.audit import audit_claim, find_claim
    from heavytop.top.equations import system

    path, system_name = sys.argv[2:]
    try:
        answer = Answer(report=audit_claim(find_claim(path), system(system_name)))
    except HeavyTopError as error:
        answer = Answer(error=(error.cause, error.remedy))
    except MemoryError:
        answer = Answer(memory=True)
    sys.stdout.buffer.write(msgspec.json.encode(answer))


def _limit_memory() -> None:
    """Where the platform can: Windows has no such limit."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
