"""SUNDIALS' CVODE through scikit-sundae: Adams-Moulton of variable order up to 12, for problems that are not stiff.

CVODE prints why it aborts; :func:`heavytop.integrate.peers.contract.quiet` suppresses it, and the outcome reports it.
"""

from __future__ import annotations

from typing import Any

import numpy
from sksundae.cvode import CVODE

from heavytop.integrate.peers.double import Request, Solution, compiler, count, double_peer, fill, timed
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import OncePerArguments
from heavytop.top.equations import System

_MOST_STEPS = 10**8


@OncePerArguments
def _machine_code(system: System, width: int) -> Any:
    write = compiler()(fill(system, width))
    write(numpy.empty(width), 0.0, numpy.zeros(width), numpy.ones(count(system)))
    return write


def _solve(request: Request) -> Solution:
    write, seconds = timed(_machine_code, request.system, request.width)

    def rates(time: float, y: Any, result: Any) -> None:
        write(result, time, y, request.numbers)

    solver = CVODE(rates, method="Adams", rtol=request.control, atol=request.control, max_num_steps=_MOST_STEPS)
    if len(request.times) == 1:
        # two times are a span: CVODE gives every step in between
        run = solver.solve(numpy.array([0.0, *request.times]), request.start)
        states = run.y[-1:] if run.success else []
        return Solution(states, run.t[-1], len(run.t) - 1, run.nfev, seconds, Outcome.STEP_TOO_SMALL)
    # the states of CVODE.solve to the bit, which does not count the steps between more times
    run, end, steps, states = solver.init_step(0.0, request.start), request.times[-1], 0, list[Any]()
    for time in request.times:
        while abs(run.t) < abs(time) and run.success:
            before, run = run.t, solver.step(time, method="onestep", tstop=end)
            steps += run.t != before  # after a state within a step CVODE first returns to the end of that
        if not run.success:
            break
        states.append(solver.step(time, tstop=end).y)
    return Solution(states, run.t, int(steps), run.nfev, seconds, Outcome.STEP_TOO_SMALL)


cvode = double_peer("sundials:CVODE", 12, _solve, attitude=True)
