"""One task of a plan in, one row of the report out."""

from __future__ import annotations

from collections.abc import Callable

from heavytop.records import Row
from heavytop.suite.checkpoint import Saved
from heavytop.suite.measurements import claimed, computed, ensembles, work_precision
from heavytop.suite.task import Task

_MEASURES: dict[str, Callable[[Task], Row]] = {
    "audit": claimed.audit,
    "claim_model": claimed.claim_model,
    "claim_evaluation": claimed.claim_evaluation,
    "homoclinic": computed.homoclinic,
    "local_error": computed.local_error,
    "work_precision": work_precision.work_precision,
}
_LONG: dict[str, Callable[[Task, Saved], Row]] = {
    "drift": computed.drift,
    "growth": ensembles.growth,
}
"""Measurements that keep their place on the way."""


def measure(task: Task, saved: Saved | None = None) -> Row:
    """The row of ``task``; a run that fails is a row with its outcome.

    saved: the place of an earlier, interrupted measurement of this row, and where this one keeps its own.
    """
    if task.kind in _LONG:
        return _LONG[task.kind](task, saved or Saved())
    return _MEASURES[task.kind](task)
