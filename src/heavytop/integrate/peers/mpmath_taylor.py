"""mpmath's Taylor integrator ``odefun``, in any number of bits."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy

from heavytop.errors import InputError
from heavytop.integrate.peers.contract import with_tolerance
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import exact, number, rounded
from heavytop.top.heavy_top import check_times


@with_tolerance
def odefun(problem: Problem, times: Sequence[Fraction], tolerance: Fraction | None) -> Trajectory:
    """``mpmath.odefun`` at the precision's bits; states are heyoka's numbers of that format.

    tolerance: None for mpmath's own choice, the eps of the format.
    Forwards only: raises InputError for a negative time.
    """
    import mpmath

    precision, system = problem.precision, problem.system
    grid = [rounded(time, precision) for time in check_times(times)]
    if grid[-1] < 0:
        raise InputError("mpmath.odefun integrates only forward in time.", "Give positive times.")
    evaluations = 0
    began = perf_counter()
    # a new context, for that of the module is shared by all threads
    context = mpmath.ctx_mp.MPContext()
    context.prec = precision.bits

    def big(value: Fraction) -> Any:
        return context.mpf(value.numerator) / value.denominator

    def rates(_time: Any, y: Any) -> list[Any]:
        nonlocal evaluations
        evaluations += 1
        return list(system.with_attitude(p, y))

    p = problem.parameters.mapped(lambda value: big(Fraction(value)))
    mpf_tolerance = None if tolerance is None else big(tolerance)
    solve = context.odefun(rates, 0, [big(v) for v in (*problem.start.flat, *(problem.xi or ()))], tol=mpf_tolerance)
    values = [[exact(v) for v in solve(big(time))] for time in grid]
    seconds = perf_counter() - began
    states = tuple(numpy.array([number(v, precision) for v in row]) for row in values)
    return Trajectory(
        problem,
        "mpmath:odefun",
        tuple(grid),
        states,
        Outcome.SUCCESS,
        grid[-1],
        0,
        0,
        {"compile": 0.0, "run": seconds},
        {"tolerance": "eps" if tolerance is None else str(tolerance)},
        evaluations,
    )
