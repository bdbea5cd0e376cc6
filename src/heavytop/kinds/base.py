"""What a kind of measurement is unless it says otherwise."""

from __future__ import annotations

from heavytop.document import kind as reported
from heavytop.records import Row
from heavytop.suite import rows as run
from heavytop.suite.checkpoint import Saved
from heavytop.suite.rows import Task


class Kind(run.MeasuredKind, reported.ReportedKind):
    """A kind of measurement: run and reported as the classes above it say.

    A subclass names itself, gives its ``table`` and ``measure``, and what of the rest is not the usual.
    """

    def measure(self, task: Task, saved: Saved) -> Row:
        """Nothing: no plan asks for it."""
        raise NotImplementedError
