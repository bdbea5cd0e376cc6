"""Explanation of a run that is far off: a sign, a step too many, a row too late."""

from __future__ import annotations

from heavytop.cases import Case
from heavytop.features.score.diagnose.diagnosis import diagnose
from heavytop.features.score.diagnose.readings import of_states
from heavytop.features.score.diagnose.samples import WITH_ATTITUDE
from heavytop.features.score.text import diagnosis_text
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import exact
from heavytop.records import Explained


def explanation(case: Case, run: Trajectory, error: float) -> Explained | None:
    """The first mistake that explains the states of a run that reached its end; None where none does.

    error: the largest of Ω and γ.
    """
    states = [tuple(map(exact, state)) for state in run.states]
    xi = run.problem.xi
    seen = of_states(case.top, case.start, run.times, states, xi) if case.system in WITH_ATTITUDE else None
    step = exact(run.flags["step"]) if "step" in run.flags else None
    about = case.top, case.start, case.system, run.times, [state[:6] for state in states], run.problem.precision
    diagnosis = diagnose(*about, error, seen=seen, step=step)
    return Explained(diagnosis[0].kind, diagnosis_text(diagnosis[0], case.system.name)) if diagnosis else None
