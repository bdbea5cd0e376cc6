"""The error of a motion at each of its samples, and the drift of its integrals there, as decimal logarithms."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from heavytop.exact.balls import ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Problem
from heavytop.measure.digits import relative_error
from heavytop.measure.drift import parameter_balls
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.solution_error import split
from heavytop.precision import log10

Logs = list[float | None]
"""log10 of a quantity at each sample; None where it is 0."""


@whole_evaluation
def sample_errors(
    problem: Problem, states: Sequence[Sequence[Fraction]], known: Sequence[Sequence[Fraction]]
) -> dict[str, Logs]:
    """The error of each state, by ``relative`` (of the largest component), ``along`` and ``across`` the flow.

    states, known: exact numbers, six each, at the same times.
    """
    found: dict[str, Logs] = {"relative": [], "along": [], "across": []}
    # as many bits as tell a state of the format from one that is right to as many digits again
    bits = 2 * problem.precision.bits + GUARD_BITS
    parameters = parameter_balls(problem, bits)
    with working_precision(bits):
        for state, true in zip(states, known, strict=True):
            truth = [ball(value) for value in true]
            delta = [ball(value - other) for value, other in zip(state, true, strict=True)]
            along, across = split(delta, problem.system.field(parameters, truth))
            values = {"relative": relative_error(delta, truth), "along": along, "across": across}
            for name, value in values.items():
                found[name].append(_log10(value))
    return found


def _log10(value: Any) -> float | None:
    """Of the middle of a ball; None where it may be 0."""
    from heavytop.exact.balls import midpoint, radius

    middle = midpoint(value)
    return None if middle <= radius(value) else log10(middle)


def sample_drifts(problem: Problem, states: Sequence[Sequence[Fraction]]) -> dict[str, Logs]:
    """|I(y(t)) − I(y(0))| at each state, of every first integral that holds for the exact start."""
    start = problem.start.flat
    found: dict[str, Logs] = {}
    for integral in problem.integrals():
        at_start = integral.value(problem.parameters, start)
        found[integral.name] = [log10(integral.value(problem.parameters, state) - at_start) for state in states]
    return found
