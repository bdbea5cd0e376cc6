"""CyRK: Runge-Kutta methods in C++ with the field as machine code: DOP853, and Verner's pair of order 8."""

from __future__ import annotations

from typing import Any

import numpy
from CyRK import cyjit, nbsolve2_ivp

from heavytop.integrate.peers.double import Request, Solution, Solve, count, double_peer, fill, timed
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import OncePerArguments
from heavytop.top.equations import System


@OncePerArguments
def _machine_code(system: System, width: int) -> Any:
    return cyjit(fill(system, width))


@OncePerArguments
def _warm(system: System, width: int, method: str) -> None:
    """Compile what the first call would compile."""
    _call(Request(system, numpy.zeros(width), numpy.ones(1), numpy.ones(count(system)), 1e-3), method).free()


def _call(request: Request, method: str) -> Any:
    return nbsolve2_ivp(
        _machine_code(request.system, request.width).address,
        (0.0, float(request.times[-1])),
        request.start,
        method,
        request.times,
        args=request.numbers,
        rtol=request.control,
        atol=request.control,
    )


def _solver(method: str) -> Solve:
    def solve(request: Request) -> Solution:
        _, seconds = timed(_warm, request.system, request.width, method)
        run = _call(request, method)
        try:
            states = run.y.T.copy()
            return Solution(
                states, run.t[-1] if len(states) else 0.0, run.steps_taken, None, seconds, Outcome.STEP_TOO_SMALL
            )
        finally:
            run.free()

    return solve


dop853 = double_peer("cyrk:DOP853", 8, _solver("DOP853"), attitude=True)
vern8 = double_peer("cyrk:Vern8", 8, _solver("Vern8"), attitude=True)
