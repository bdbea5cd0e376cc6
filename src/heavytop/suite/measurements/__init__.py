"""One task of a plan in, one row of the report out."""

from __future__ import annotations

from collections.abc import Callable

from heavytop.records import Row
from heavytop.suite.measurements import claimed, computed, work_precision
from heavytop.suite.task import Task

_MEASURES: dict[str, Callable[[Task], Row]] = {
    "audit": claimed.audit,
    "claim_model": claimed.claim_model,
    "claim_evaluation": claimed.claim_evaluation,
    "homoclinic": computed.homoclinic,
    "drift": computed.drift,
    "local_error": computed.local_error,
    "work_precision": work_precision.work_precision,
}


def measure(task: Task) -> Row:
    """The row of ``task``; a run that fails is a row with its outcome."""
    return _MEASURES[task.kind](task)
