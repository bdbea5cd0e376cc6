"""The defaults of a kind of measurement."""

from __future__ import annotations

import msgspec

from heavytop.features import FEATURES
from heavytop.harness import rows as run
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Task
from heavytop.integrate.trajectory import Outcome, Trajectory
from heavytop.measure.scorer import Scorer
from heavytop.records import Row
from heavytop.report.document import kind as reported


class Kind(run.MeasuredKind, reported.ReportedKind):
    """A kind of measurement, with the defaults of its two base classes.

    A subclass defines its ``name``, ``table`` and ``measure``, and overrides other defaults as needed.
    """

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of a task; a kind without this method is in no plan."""
        raise NotImplementedError


# Explanations of large errors of a third-party integrator, such as a wrong sign, an additional step, a shifted row.


FAR = 1e-2
"""Smaller errors, relative to max(1, |value|), are taken for errors of a method."""


def with_explanation(row: Row, task: Task, run: Trajectory, scorer: Scorer) -> Row:
    """The row with the first mistake that explains its states, if the integrator is a third-party one.

    Only for complete runs with a known error: each mistake is simulated with heyoka.
    """
    if task.integrator.own or run.outcome is not Outcome.SUCCESS or not len(run.states) or scorer.error is None:
        return row
    parts = [scorer.error.running[part].sums.maximum for part in ("omega", "gamma")]
    error = max((float(part) for part in parts if part.is_finite()), default=0.0)
    if error <= FAR:
        return row
    explanations = (feature.load(feature.explain)(task.given, run, error) for feature in FEATURES if feature.explain)
    explained = next((explanation for explanation in explanations if explanation is not None), msgspec.UNSET)
    return msgspec.structs.replace(row, explained=explained)
