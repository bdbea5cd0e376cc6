"""The explanation of states that are far off: a sign, a step too many, a row too late."""

from __future__ import annotations

from heavytop.cases import Case
from heavytop.features.score.diagnose.diagnosis import diagnose
from heavytop.features.score.text import diagnosis_text
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import exact
from heavytop.records import Explained


def explanation(case: Case, run: Trajectory, error: float) -> Explained | None:
    """The first mistake that explains the states of a run that reached its end; None where none does.

    error: the largest of Ω and γ.
    """
    states = [tuple(map(exact, state[:6])) for state in run.states]
    diagnosis = diagnose(case.top, case.start, case.system, run.times, states, run.problem.precision, error)
    return Explained(diagnosis[0].kind, diagnosis_text(diagnosis[0], case.system.name)) if diagnosis else None
