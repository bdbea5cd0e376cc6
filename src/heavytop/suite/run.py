"""Runs a plan: every row to disk as it is finished, what the rows of a kind come to together at the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from heavytop.records import Row
from heavytop.suite.checkpoint import Checkpoint
from heavytop.suite.kind import Kinds
from heavytop.suite.task import Task
from heavytop.suite.workers import rows

Progress = Callable[[Task], None]


def unheard(task: Task) -> None:
    """Progress that nobody follows."""


def run(
    tasks: Sequence[Task],
    kinds: Kinds,
    checkpoint: Checkpoint,
    progress: Progress,
    workers: int = 1,
    scheduler: str | None = None,
    begun: Progress = unheard,
    row_timeout: float | None = None,
) -> list[Row]:
    """Every row of the tasks into the checkpoint; returns only the rows drawn from them.

    Rows that the checkpoint holds are not measured again.  ``progress`` hears of each task as it is done, ``begun`` as
    it begins.  row_timeout: seconds of each row of a third-party integrator; None for limits by its other rows.
    """
    for index in checkpoint.offsets:
        progress(tasks[index])
    at_once = min(workers, len(tasks))
    done, saved = checkpoint.offsets, checkpoint.saved
    to_conclude: dict[int, Row] = {}
    for index, row in rows(tasks, kinds, at_once, scheduler, done, saved, begun, row_timeout):
        checkpoint.add(index, row)
        if kinds[row.key.kind].concludes:
            to_conclude[index] = row
        progress(tasks[index])
    concluded: list[Row] = []
    for kind in kinds.values():
        if kind.concludes:
            indices = [index for index, task in enumerate(tasks) if task.key.kind == kind.name]
            missing = [index for index in indices if index not in to_conclude]  # measured before it was resumed
            to_conclude |= zip(missing, checkpoint.rows(missing), strict=True)
            concluded += kind.conclude([to_conclude[index] for index in indices]) if indices else []
    return concluded
