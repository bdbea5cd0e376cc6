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
    """A kind of measurement: run and reported as the classes above it say.

    A subclass names itself, gives its ``table`` and ``measure``, and what of the rest is not the usual.
    """

    def measure(self, task: Task, saved: Saved) -> Row:
        """Nothing: no plan asks for it."""
        raise NotImplementedError


# What explains the states of a third-party integrator that are far off: a sign, a step too many, a row too late.


FAR = 1e-2
"""Smaller errors, relative to max(1, |value|), are those of a method."""


def with_explanation(row: Row, task: Task, run: Trajectory, scorer: Scorer) -> Row:
    """The row with the first mistake that explains its states, where the integrator is not heavytop's own.

    Only of runs that reached their end, and whose error is known: each mistake is tried with runs of heyoka.
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
