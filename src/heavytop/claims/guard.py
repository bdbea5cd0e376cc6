"""The audit of a file in a process of its own, with an end to its time and memory.

The algebra of an honest claim takes seconds; that of a hostile or hopeless one can take forever, and cannot be
interrupted from within.
"""

from __future__ import annotations

import multiprocessing
from multiprocessing.connection import Connection

from heavytop.claims.judge import AuditReport
from heavytop.errors import HeavyTopError, InputError

SECONDS = 20
_BYTES = 3 << 30


def in_time(path: str, system_name: str, seconds: float = SECONDS) -> AuditReport:
    """The audit of the claim in a file; raises InputError where it takes longer than ``seconds`` or 3 GB."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(theirs, path, system_name), daemon=True)
    process.start()
    theirs.close()
    try:
        found = ours.recv() if ours.poll(seconds) else None
    except EOFError:
        found = None
    finally:
        process.kill()
        process.join()
        ours.close()
    if isinstance(found, AuditReport):
        return found
    if found is not None:
        raise InputError(*found)
    raise InputError(
        f"{path}: the audit took more than {seconds:g} s or {_BYTES >> 30} GB and was stopped.",
        "Use fewer independent roots and exponentials, lower powers, or split the claim.",
    )


def _work(connection: Connection, path: str, system_name: str) -> None:
    _limit_memory()
    from heavytop.claims.audit import audit_claim, find_claim
    from heavytop.top.equations import system

    try:
        connection.send(audit_claim(find_claim(path), system(system_name)))
    except HeavyTopError as error:
        connection.send((error.cause, error.remedy))


def _limit_memory() -> None:
    """Where the platform can: Windows has no such limit."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
