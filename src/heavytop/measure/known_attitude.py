"""The true motion of a rounded problem with its attitude, from the attitude vector that the problem begins with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from typing import Any

from flint import arb

from heavytop.errors import InputError, NotInClass, OutOfReach
from heavytop.exact.balls import ball, to_bits
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import of_rounded
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.truth import Evaluate, Known, Truth, clause, known_motion, truth
from heavytop.precision import time_text
from heavytop.top.heavy_top import Vector, cross, dot

Attitude = Callable[[Fraction, int], Sequence[Any]]
"""ξ at (time, bits): three balls."""


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
    enclosure = Validated(solution.top, solution.start, solution.system, xi=start)
    own: Attitude | None = getattr(solution, "attitude", None)
    found: list[Evaluate] = []
    if isinstance(solution, Validated):
        found.append(enclosure.state_and_attitude)
    else:
        if own is not None:
            found.append(_beside(solution, _turned(solution, own, start)))
        found.append(_beside(solution, enclosure.attitude))
    for each in found:
        try:
            each(horizon, bits)
        except (NotInClass, OutOfReach):
            continue
        return each
    return None


def _beside(solution: ExactSolution, xi: Attitude) -> Evaluate:
    return lambda time, bits: [*solution.state(time, bits), *xi(time, bits)]


def _turned(solution: ExactSolution, own: Attitude, xi: Vector) -> Attitude:
    """Any attitude of a motion, turned about γ by the constant angle with which it begins at ``xi``."""
    gamma = solution.start.gamma

    @cache
    def angle(working: int) -> tuple[arb, arb, arb]:
        began = own(Fraction(0), working)
        length = ball(dot(gamma, gamma)).sqrt()
        wanted = [ball(x) for x in xi]
        return dot(wanted, began), dot(wanted, cross([ball(g) / length for g in gamma], began)), length

    def evaluate(time: Fraction, working: int) -> list[arb]:
        cosine, sine, length = angle(working)
        along = own(time, working)
        eta = cross([g / length for g in solution.state(time, working)[3:]], along)
        return [cosine * x + sine * y for x, y in zip(along, eta, strict=True)]

    return lambda time, bits: to_bits(partial(evaluate, time), bits)
