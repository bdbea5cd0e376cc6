"""Integrators that a user might pick instead of heyoka, behind the same call.  Each is imported only when used."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from time import perf_counter
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE, Precision, exact, number
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State


def scipy_dop853(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    precision: Precision = DOUBLE,
    *,
    system: System = HEAVY_TOP,
    tolerance: float = 1e-13,
) -> Trajectory:
    """SciPy's DOP853 in double, relative and absolute ``tolerance``.  Raises InputError for any other precision."""
    import numpy
    from scipy.integrate import solve_ivp

    if precision != DOUBLE:
        raise InputError(f"SciPy has no {precision.name}.", "Use double.")
    problem = Problem.of(top, start, precision, system)
    given = problem.parameters
    p = Parameters([float(v) for v in given.inertia], [float(v) for v in given.moment], float(given.rotor))
    grid = [float(number(time, precision)) for time in times]
    began = perf_counter()
    run = solve_ivp(
        lambda _, y: system.field(p, y),
        (0.0, grid[-1]),
        [float(v) for v in problem.start.flat],
        method="DOP853",
        t_eval=grid,
        rtol=tolerance,
        atol=tolerance,
    )
    states = tuple(numpy.array(state) for state in run.y.T if numpy.isfinite(state).all())
    complete = run.status == 0 and len(states) == len(grid)
    reached = tuple(exact(time) for time in grid[: len(states)])
    return Trajectory(
        problem,
        "scipy:DOP853",
        reached,
        states,
        Outcome.SUCCESS if complete else Outcome.NON_FINITE,
        reached[-1] if reached else Fraction(0),
        len(run.t),
        8,
        {"compile": 0.0, "run": perf_counter() - began},
        {"tolerance": repr(tolerance)},
    )


def mpmath_odefun(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
) -> Trajectory:
    """mpmath's Taylor integrator ``odefun`` at the precision's bits; states are heyoka's numbers of that format.

    Forwards only: raises InputError for a time that is not positive.
    """
    import mpmath
    import numpy

    if any(time <= 0 for time in times):
        raise InputError("mpmath.odefun integrates forwards only.", "Give positive times.")
    problem = Problem.of(top, start, precision, system)
    began = perf_counter()
    with mpmath.workprec(precision.bits):

        def big(value: Fraction) -> Any:
            return mpmath.mpf(value.numerator) / value.denominator

        given = problem.parameters
        p = Parameters([big(v) for v in given.inertia], [big(v) for v in given.moment], big(given.rotor))
        solve = mpmath.odefun(lambda _, y: list(system.field(p, y)), 0, [big(v) for v in problem.start.flat])
        grid = [exact(number(time, precision)) for time in times]
        values = [[_exact(v) for v in solve(big(time))] for time in grid]
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
        {"compile": 0.0, "run": perf_counter() - began},
        {"tolerance": "eps"},
    )


def _exact(value: Any) -> Fraction:
    sign, mantissa, exponent, _ = value._mpf_
    return (-1 if sign else 1) * int(mantissa) * Fraction(2) ** int(exponent)
