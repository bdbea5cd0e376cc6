"""A motion computed elsewhere, scored like our own."""

from __future__ import annotations

from fractions import Fraction

import msgspec

from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.digits import digits_kept
from heavytop.measure.drift import Drift
from heavytop.measure.known import known_motion
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import round_to
from heavytop.records import Row
from heavytop.suite.cases import Case
from heavytop.suite.measurements.computed import computed_row
from heavytop.suite.measurements.shared import time_text
from heavytop.suite.tables import log_spaced
from heavytop.suite.task import Task
from heavytop.suite.trajectory_file import Given
from heavytop.top.integrals import holding

__all__ = ["complete", "digits_kept", "score"]


def score(given: Given) -> Row:
    """The row of a trajectory: drift of every integral that holds, and distance from the known motion.

    The data are rounded to the trajectory's format first, as a run of that format would be given them.  States from
    the first that is not finite on are not scored; the outcome says so.
    """
    precision = given.precision
    problem = Problem.of(given.top, given.start, precision, given.system)
    count = next((i for i, state in enumerate(given.states) if state is None), len(given.states))
    times = [round_to(time, precision.bits) for time in given.times]
    keep = [times[i - 1] for i in log_spaced(len(times))]
    drift = Drift(problem, holding(given.top, given.start, given.system), keep)
    known = known_motion(problem, times[-1])
    error = None if isinstance(known, str) else SolutionError(problem, known.solution, keep)
    for time, state in zip(times[:count], given.states, strict=False):
        assert state is not None
        drift(time, state)
        if error is not None:
            error(time, state)
    metrics, series = drift.metrics(), drift.series(time_text)
    if error is None:
        against = f"its own first integrals; no reference: {known}"
    else:
        metrics, series = metrics | error.metrics(), series | error.series(time_text)
        against = known if isinstance(known, str) else known.text
    run = Trajectory(
        problem,
        given.integrator,
        tuple(times[:count]),
        tuple(given.states[:count]),
        given.outcome,
        times[count - 1] if count else Fraction(0),
        given.steps,
        0,
        flags=given.flags,
    )
    case = Case(given.name, "given", given.system, given.top, given.start)
    task = Task("score", given.name, case, precision.name, "", tuple(times), tuple(keep))
    row = computed_row(task, run, metrics, series, against)
    reached = time_text(run.time_reached)
    return msgspec.structs.replace(row, measured=f"given: {given.integrator}", order=None, time_reached=reached)


def complete(row: Row) -> bool:
    """Whether every state was finite and the run reached its end."""
    return row.outcome == Outcome.SUCCESS.value
