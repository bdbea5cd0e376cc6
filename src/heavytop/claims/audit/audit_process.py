"""The process in which the claim of a file is audited: :mod:`heavytop.claims.audit.guard` starts it."""

from __future__ import annotations

import signal
import sys

import msgspec

from heavytop.claims.audit.audit import audit_claim, find_claim
from heavytop.claims.audit.guard import Answer, limit_memory
from heavytop.errors import HeavyTopError
from heavytop.top.equations import system


def child() -> None:
    """The audit of ``sys.argv[2:]`` = path, system, seconds: a JSON document of :class:`Answer` on standard output."""
    path, system_name, seconds = sys.argv[2:]
    if hasattr(signal, "alarm"):
        signal.alarm(int(seconds))
    limit_memory()
    try:
        answer = Answer(report=audit_claim(find_claim(path), system(system_name) if system_name else None))
    except HeavyTopError as error:
        answer = Answer(error=(_printable(error.cause), error.remedy))
    except MemoryError:
        answer = Answer(memory=True)
    except RecursionError:
        answer = Answer(depth=True)
    sys.stdout.buffer.write(msgspec.json.encode(answer))


def _printable(text: str) -> str:
    """Text that JSON can carry: a path may hold bytes that are no characters."""
    return text.encode(errors="replace").decode()
