"""SciPy's ``solve_ivp``: DOP853 (Hairer, Nørsett, Wanner), LSODA (Petzold) and Radau IIA of order 5.

A relative tolerance below 100 eps is raised to that, as SciPy would do with a warning.
"""

from __future__ import annotations

from heavytop.integrate.peers.double import Request, Solution, Solve, double_peer, rates, timed
from heavytop.integrate.trajectory import Outcome

_FINEST = 100 * 2.0**-52


def _solver(method: str) -> Solve:
    def solve(request: Request) -> Solution:
        from scipy.integrate import solve_ivp

        field, seconds = timed(rates, request.system, request.width)
        dense, relative = len(request.times) > 1, max(request.control, _FINEST)
        in_force = "" if relative == request.control else f"relative {relative:.3g}, absolute {request.control:.3g}"
        try:
            run = solve_ivp(
                field,
                (0.0, request.times[-1]),
                request.start,
                method=method,
                args=(request.numbers,),
                rtol=relative,
                atol=request.control,
                dense_output=dense,
            )
        except ValueError as error:
            if "infs or NaNs" not in str(error):
                raise
            return Solution([], 0.0, 0, None, seconds, Outcome.NON_FINITE)  # Radau, whose matrices must be finite
        covered = request.times[abs(request.times) <= abs(run.t[-1])]
        states = run.sol(covered).T if dense else run.y.T[-1:] if run.success else []
        return Solution(states, run.t[-1], len(run.t) - 1, run.nfev, seconds, Outcome.STEP_TOO_SMALL, in_force)

    return solve


dop853 = double_peer("scipy:DOP853", 8, _solver("DOP853"), attitude=True)
lsoda = double_peer("scipy:LSODA", 12, _solver("LSODA"), attitude=True)
radau = double_peer("scipy:Radau", 5, _solver("Radau"), attitude=True)
