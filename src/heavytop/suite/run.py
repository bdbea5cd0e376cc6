"""Runs a plan: every row to disk as it is finished, the laws drawn from them at the end."""

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
    """Every row of the tasks into the checkpoint; returns only the laws drawn from them.

    Rows that the checkpoint holds are not measured again.  ``progress`` hears of each task as it is done.
    """
    for index in checkpoint.offsets:
        progress(tasks[index])
    for index, row in rows(tasks, min(workers, len(tasks)), scheduler, checkpoint.offsets, checkpoint.saved):
        checkpoint.add(index, row)
        progress(tasks[index])
    homoclinic = [index for index, task in enumerate(tasks) if task.kind == "homoclinic"]
    if not homoclinic:
        return []
    from heavytop.suite.measurements.laws import break_away_law

    rates = {tasks[index].name: case.rate for index in homoclinic if (case := tasks[index].case)}
    return break_away_law(list(checkpoint.rows(homoclinic)), rates)
