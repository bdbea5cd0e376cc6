"""A motion computed elsewhere, scored like our own."""

from __future__ import annotations

from fractions import Fraction

import msgspec

from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.digits import digits_kept
from heavytop.measure.known import known_motion
from heavytop.measure.scorer import Scorer
from heavytop.precision import round_to
from heavytop.records import Row, RowKey, Subject
from heavytop.suite.cases import Case
from heavytop.suite.rows import computed_row, time_text
from heavytop.suite.sampling import log_spaced
from heavytop.suite.task import Task
from heavytop.suite.trajectory_file import Given

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
    scorer = Scorer(problem, known_motion(problem, times[-1]), keep)
    for time, state in zip(times[:count], given.states, strict=False):
        assert state is not None
        scorer(time, state)
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
    subject = Subject("given", given.integrator)
    key = RowKey("score", given.name, given.system.name, subject, precision.name, horizon=time_text(times[-1]))
    task = Task(key, given.name, given.integrator, case, tuple(times), tuple(keep))
    row = computed_row(task, run, scorer.metrics(), scorer.series(time_text), scorer.against)
    reached = time_text(run.time_reached)
    return msgspec.structs.replace(row, measured=f"given: {given.integrator}", order=None, time_reached=reached)


def complete(row: Row) -> bool:
    """Whether every state was finite and the run reached its end."""
    return row.outcome == Outcome.SUCCESS.value
