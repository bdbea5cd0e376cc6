"""How far a run has come."""

from __future__ import annotations

from typing import Any


class Progress:
    """A bar with ETA on a terminal, nothing elsewhere; called with each finished task."""

    def __init__(self, tasks: Any, kinds: Any) -> None:
        from rich import progress
        from rich.console import Console

        columns = (
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.TimeElapsedColumn(),
            progress.TimeRemainingColumn(),
        )
        console = Console(stderr=True)
        self.bar = progress.Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self.kinds = kinds
        self.id = self.bar.add_task("starting", total=sum(map(self._cost, tasks)))

    def __enter__(self) -> Progress:
        self.bar.start()
        return self

    def __call__(self, task: Any) -> None:
        self.bar.update(self.id, advance=self._cost(task), description=task.label[:48])

    def _cost(self, task: Any) -> float:
        cost: float = self.kinds[task.key.kind].cost(task)
        return cost

    def __exit__(self, *_: object) -> None:
        self.bar.stop()
