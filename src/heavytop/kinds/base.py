"""What a kind of measurement is unless it says otherwise."""

from __future__ import annotations

from collections.abc import Sequence

from heavytop.records import Row
from heavytop.report import kind as reported
from heavytop.suite.checkpoint import Saved
from heavytop.suite.kind import Table
from heavytop.suite.task import Task


class Kind(reported.Kind):
    """A kind of measurement: run as :class:`heavytop.suite.kind.Kind` says, reported as the class above it says.

    A subclass names itself, gives its ``table`` and ``measure``, and what of the rest is not the usual.
    """

    table: type[Table] | None = None
    concludes: bool = False

    def cost(self, task: Task) -> float:
        """Seconds it may take: those of one run of heyoka, and a second."""
        return 1.0 + task.run_seconds

    def measure(self, task: Task, saved: Saved) -> Row:
        """Nothing: no plan asks for it."""
        raise NotImplementedError

    def conclude(self, rows: Sequence[Row]) -> list[Row]:
        """Nothing."""
        return []
