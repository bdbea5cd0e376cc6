"""The true motion of a rounded problem with its attitude, from the attitude vector that the problem begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from flint import arb

from heavytop.errors import InputError, NotInClass, OutOfReach
from heavytop.exact.attitude import state_and_attitude
from heavytop.exact.balls import ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import of_rounded
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.truth import Evaluate, Known, Truth, clause, known_motion, truth
from heavytop.precision import time_text
from heavytop.top.angles import perpendicular
from heavytop.top.heavy_top import Vector, cross, dot

_SPARE_BITS = 8


def truth_with_attitude(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    """As :func:`heavytop.measure.truth.truth`, of nine balls a time: Ω, γ and ξ; ξ begins at that of the problem.

    Of a problem without ξ six balls, by that very function.
    """
    if problem.xi is None:
        return truth(problem, times, effort)
    known = known_motion(replace(problem, xi=None), max(times, key=abs))
    if isinstance(known, Known):
        nine = _nine(known.solution, problem, max(times, key=abs))
        if nine is not None:
            return Truth(known.against, nine)
    try:
        (found,) = of_rounded([problem], times, effort=effort)
    except (InputError, OutOfReach) as error:
        why = clause(error)
        return f"{known}; {why}" if isinstance(known, str) else why
    if found.ends == times[0]:
        return f"no digit of the format is left at t = {time_text(found.ends)}, the first sample"
    return Truth(found.against, found.state, found.ends)


def _nine(solution: ExactSolution, problem: Problem, horizon: Fraction) -> Evaluate | None:
    """Ω, γ and ξ of a known motion: ξ by its closed form where that reaches the horizon, else by the enclosure.

    None where neither does.
    """
    bits = problem.precision.bits + GUARD_BITS
    xi = problem.xi
    assert xi is not None
    start: Vector = (xi[0], xi[1], xi[2])
    whole: Evaluate
    if isinstance(solution, Validated):
        whole = Validated(solution.top, solution.start, solution.system, xi=start).with_attitude
    else:
        known = state_and_attitude(solution, horizon, bits)[1]
        whole = _turned(solution.start.gamma, start, lambda time, working: list(known(time, working)))
    try:
        whole(horizon, bits)
    except (NotInClass, OutOfReach):
        return None
    return whole


def _turned(gamma: Vector, xi: Vector, whole: Evaluate) -> Evaluate:
    """Ω, γ and ξ with the attitude turned about γ by the constant angle with which it begins at ``xi``; |γ| = 1."""
    began = perpendicular(gamma)
    cosine, sine = dot(xi, began), dot(xi, cross(gamma, began))

    @whole_evaluation
    def evaluate(time: Fraction, bits: int) -> list[arb]:
        known = list(whole(time, bits + _SPARE_BITS))
        with working_precision(bits + _SPARE_BITS):
            eta = cross(known[3:6], known[6:9])
            along = [ball(cosine) * x + ball(sine) * y for x, y in zip(known[6:9], eta, strict=True)]
        return [*known[:6], *along]

    return evaluate
