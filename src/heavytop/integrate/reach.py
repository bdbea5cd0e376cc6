"""Which runs are tried at all: those of no more steps than anyone waits for, whatever the units of the data."""

from __future__ import annotations

import math
from fractions import Fraction

from heavytop.errors import OutOfReach
from heavytop.integrate.trajectory import Problem
from heavytop.precision import decimal_text, log10
from heavytop.top.rates import square_of_rate

MOST_STEPS = 10**12
"""In double a step takes a microsecond: these take days."""
_FAR_BELOW = 1e11


def expected_steps(problem: Problem, end: Fraction, step: Fraction | None = None) -> int:
    """How many steps a run to the time ``end`` takes, within a factor of ten; 0 for a motion that rests.

    The time over the step: over the fixed ``step`` of the method, else over the time in which the motion changes.
    """
    p, start = problem.parameters, problem.start.flat
    if not any(problem.system.field(p, start)):
        return 0
    square = end**2 * (square_of_rate(problem.system, p, start) if step is None else 1 / step**2)
    return math.isqrt(square.numerator // square.denominator)


def _is_near(problem: Problem, end: Fraction) -> bool:
    """True only where the end is in reach by far; in doubles."""
    try:
        p, start, span = problem.parameters.mapped(float), tuple(map(float, problem.start.flat)), float(end)
        return bool(span * span * square_of_rate(problem.system, p, start) < _FAR_BELOW**2)
    except (OverflowError, ZeroDivisionError):
        return False


def require_reach(problem: Problem, end: Fraction, step_limit: int | None = None, step: Fraction | None = None) -> None:
    """Raises OutOfReach where a run to the time ``end`` takes more than :data:`MOST_STEPS` :func:`expected_steps`.

    A run that ``step_limit`` ends early is in reach.
    """
    if (step_limit is not None and step_limit <= MOST_STEPS) or (step is None and _is_near(problem, end)):
        return
    steps = expected_steps(problem, end, step)
    if steps > MOST_STEPS:
        raise OutOfReach(
            f"A run to t = {decimal_text(end, 6)} takes some 1e{math.floor(log10(Fraction(steps)) or 0.0)} steps.",
            f"Up to {MOST_STEPS:.0e} are tried: ask for an earlier time, or for a proven state, which needs no steps "
            "where there is a closed form (`heavytop reference`).",
        )
