"""What the measurements share: the parts of a task, times in reports."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

from heavytop.claims.ershkov import Branch, PartialCase
from heavytop.errors import Contradiction, OutOfReach, PeerFailed
from heavytop.integrate import taylor
from heavytop.integrate.broken import FAULTS
from heavytop.integrate.trajectory import Problem
from heavytop.measure.luck import reroll
from heavytop.measure.scalar import of_fraction
from heavytop.precision import decimal_text, parse
from heavytop.records import CONTRADICTION, FAILED, OUT_OF_REACH, Kind, Metric, Row
from heavytop.suite.cases import Case
from heavytop.suite.task import Task
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State


def time_text(time: Fraction) -> str:
    """A time in reports: exact where 20 digits suffice, else 20 digits."""
    text = decimal_text(time, 20)
    if abs(time) >= 10**15:
        return text
    text = format(Decimal(text), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def time_metric(time: Fraction | None, kind: Kind) -> Metric:
    """A time as a metric; None is never."""
    return Metric("never", None, kind) if time is None else of_fraction(abs(time), kind, time_text(abs(time)))


def case_of(task: Task) -> Case:
    """The case of a task that has one, with the roundings of its seed."""
    assert task.case is not None
    return replace(task.case, top=reroll(task.case.top, task.seed)) if task.seed else task.case


def claim_of(task: Task) -> PartialCase:
    """The claim of a task about one."""
    claim = case_of(task).claim
    assert claim is not None
    return claim


def branch_of(task: Task) -> Branch:
    """The branch of the claim that a task is about."""
    return "printed" if task.form == "printed" else "smooth"


def integrator_of(task: Task) -> Any:
    """What has the `propagate` and `first_steps` of :mod:`heavytop.integrate.taylor`: that, or a broken one."""
    if task.integrator == "heyoka":
        return taylor
    return FAULTS[task.integrator]


def integrator_text(task: Task) -> str:
    """What is measured, as the row of a task names it."""
    if task.kind == "claim_model":
        return f"claim:{branch_of(task)}"
    if task.kind == "claim_evaluation":
        return f"formula:{task.form}"
    if task.kind == "audit":
        return "audit"
    return task.form if task.kind == "work_precision" else f"{task.integrator} {task.form}".rstrip()


def unmeasured(task: Task, reason: OutOfReach | Contradiction | PeerFailed) -> Row:
    """The row of a task that came to nothing: an outcome of its own, no metric, and why in the place of a reference."""
    system = task.form if task.case is None else HEAVY_TOP.name if task.kind == "claim_model" else task.case.system.name
    return Row(
        case=task.name,
        system=system,
        integrator=integrator_text(task),
        precision=task.precision or "exact",
        bits=parse(task.precision).bits if task.precision else 0,
        outcome={Contradiction: CONTRADICTION, PeerFailed: FAILED}.get(type(reason), OUT_OF_REACH),
        horizon=time_text(task.times[-1]) if task.times else "0",
        time_reached="0",
        steps=0,
        finite=False,
        metrics={},
        measure=task.kind,
        measured="nothing",
        against=f"nothing: {reason.cause}",
    )


def peer_failure(task: Task, cause: str) -> Row:
    """The row of work against precision whose integrator failed: ``cause``, and in which case at which setting."""
    setting = task.form.partition(" ")[2]
    return unmeasured(task, PeerFailed(f"{cause} in {task.name} {setting}"))


def input_rounding(top: HeavyTop, start: State, problem: Problem) -> Fraction:
    """The largest relative rounding of the data that the run was given: not charged to it, but said."""
    given = problem.system.parameters(top, start)
    pairs = zip(
        (*given.inertia, *given.moment, Fraction(given.rotor), *start.flat),
        (*problem.parameters.inertia, *problem.parameters.moment, problem.parameters.rotor, *problem.start.flat),
        strict=True,
    )
    return max(abs(b - a) / abs(a) if a else Fraction(0) for a, b in pairs)
