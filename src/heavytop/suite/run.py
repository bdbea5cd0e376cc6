"""Runs a plan and gathers its rows in the plan's order."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from heavytop.records import Row
from heavytop.suite.checkpoint import Checkpoint
from heavytop.suite.task import Task
from heavytop.suite.workers import rows

Progress = Callable[[Task], None]


def run(
    tasks: Sequence[Task],
    checkpoint: Checkpoint,
    progress: Progress,
    workers: int = 1,
    scheduler: str | None = None,
) -> list[Row]:
    """The rows of all tasks, in order, then the laws drawn from them.

    Rows that the checkpoint holds are not measured again.  ``progress`` hears of each task as it is done.
    """
    for index in checkpoint.done:
        progress(tasks[index])
    for index, row in rows(tasks, workers, scheduler, checkpoint.done):
        checkpoint.add(index, row)
        progress(tasks[index])
    measured = [checkpoint.done[index] for index in range(len(tasks))]
    if any(row.measure == "homoclinic" for row in measured):
        from heavytop.suite.measurements.laws import break_away_law

        rates = {task.name: task.case.rate for task in tasks if task.case and task.kind == "homoclinic"}
        measured += break_away_law(measured, rates)
    return measured
