"""mpmath's Taylor integrator ``odefun``, in any number of bits."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import Precision, exact, number
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.times import check_times


def odefun(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
    tolerance: Fraction | None = None,
) -> Trajectory:
    """``mpmath.odefun`` at the precision's bits; states are heyoka's numbers of that format.

    tolerance: None for mpmath's own choice, the eps of the format.
    Forwards only: raises InputError for a negative time.
    """
    import mpmath

    grid = [exact(number(time, precision)) for time in check_times(times)]
    if grid[-1] < 0:
        raise InputError("mpmath.odefun integrates forwards only.", "Give positive times.")
    problem = Problem.of(top, start, precision, system)
    evaluations = 0
    began = perf_counter()
    # a context of this run's own: that of the module is one for all threads
    own = mpmath.ctx_mp.MPContext()
    own.prec = precision.bits

    def big(value: Fraction) -> Any:
        return own.mpf(value.numerator) / value.denominator

    def rates(_time: Any, y: Any) -> list[Any]:
        nonlocal evaluations
        evaluations += 1
        return list(system.field(p, y))

    given = problem.parameters
    p = Parameters([big(v) for v in given.inertia], [big(v) for v in given.moment], big(given.rotor))
    wanted = None if tolerance is None else big(tolerance)
    solve = own.odefun(rates, 0, [big(v) for v in problem.start.flat], tol=wanted)
    values = [[_exact(v) for v in solve(big(time))] for time in grid]
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


def _exact(value: Any) -> Fraction:
    sign, mantissa, exponent, _ = value._mpf_
    return (-1 if sign else 1) * int(mantissa) * Fraction(2) ** int(exponent)
