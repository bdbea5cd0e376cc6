"""One task measured, in whatever process: its row, and how a process begins that measures such."""

from __future__ import annotations

import gc
import os
import signal
from multiprocessing import parent_process
from threading import Thread

import msgspec

from heavytop.errors import Contradiction, HeavyTopError, InputError, OutOfReach, PeerFailed, Unsupported
from heavytop.integrate.peers.command import begin_row
from heavytop.integrate.trajectory import OtherFlags
from heavytop.records import Row
from heavytop.suite.checkpoint import Saved
from heavytop.suite.kind import Kind
from heavytop.suite.rows import data_of, failed, unmeasured
from heavytop.suite.task import Task

RESUME = "Finished rows are kept: run again with --resume"


def measure(kind: Kind, task: Task, saved: Saved) -> Row:
    """The row of ``task``, also where it cannot be known; raises InputError with its name for impossible data."""
    begin_row()
    try:
        task.require_reach()
        return msgspec.structs.replace(_taken_up(kind, task, saved), data=data_of(task.case))
    except PeerFailed as error:
        return failed(task, error.cause)
    except Unsupported as error:
        return unmeasured(task, error)
    except (OutOfReach, Contradiction) as error:
        return unmeasured(task, error)
    except InputError as error:
        raise InputError(f"{task.label}: {error.cause}", error.remedy) from None


def _taken_up(kind: Kind, task: Task, saved: Saved) -> Row:
    """The row, from its saved place on where that is a place of it: else it is measured from the beginning."""
    try:
        return kind.measure(task, saved)
    except (OtherFlags, OutOfReach, Contradiction, PeerFailed, Unsupported):
        raise
    except Exception:
        if not saved.taken:
            raise
    saved.forget()
    return kind.measure(task, saved)


def ended_its_process(task: Task, times: int) -> Row:
    """The failed row of a task whose third-party integrator ended its process."""
    return failed(task, f"{task.key.subject.name} ended its process {times} times")


def begin_worker(*_kinds: Kind) -> None:
    """In a new process, which leaves interrupts to its parent.

    With the kinds all that measures was imported.  None of it is garbage ever: it is not looked at again.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_the_parent, daemon=True).start()
    gc.freeze()


def _end_with_the_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def died(task: Task, times: int) -> HeavyTopError:
    """That a task of this program ended its process each time."""
    return HeavyTopError(
        f"A worker process died {times} times during {task.label}.", f"{RESUME}, perhaps with fewer --workers."
    )
