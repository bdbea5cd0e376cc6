"""diffrax's Dopri8 (Prince and Dormand, order 8) compiled by JAX for the processor, in double."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy

from heavytop.integrate.peers.double import Request, Solution, count, double_peer, reader, timed
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import OncePerArguments
from heavytop.top.equations import System

_LEAST_STEP = 2.0**-60  # of the whole time
_MOST_STEPS = 2**24


@OncePerArguments
def _compiled(system: System, width: int, samples: int) -> Callable[..., Any]:
    """The integration of states of ``width`` to ``samples`` times as machine code."""
    read = reader(system)

    def field(_time: Any, y: Any, n: Any) -> Any:
        return jnp.stack(system.with_attitude(read(n), y))

    def integrate(start: Any, times: Any, numbers: Any, tolerance: Any) -> Any:
        return diffrax.diffeqsolve(
            diffrax.ODETerm(field),
            diffrax.Dopri8(),
            0.0,
            times[-1],
            None,
            start,
            numbers,
            saveat=diffrax.SaveAt(ts=times),
            # every step is rejected where the field is not finite: without a smallest step it would never end
            stepsize_controller=diffrax.PIDController(
                rtol=tolerance, atol=tolerance, dtmin=_LEAST_STEP * abs(times[-1]), force_dtmin=False
            ),
            max_steps=_MOST_STEPS,
            throw=False,
        )

    shapes = [jax.ShapeDtypeStruct(shape, float) for shape in ((width,), (samples,), (count(system),), ())]
    return jax.jit(integrate).lower(*shapes).compile()


def _solve(request: Request) -> Solution:
    # for this thread and block alone: the user's jax settings stay
    with jax.enable_x64(True), jax.default_device(jax.devices("cpu")[0]):
        code, seconds = timed(_compiled, request.system, request.width, len(request.times))
        run = code(request.start, request.times, request.numbers, request.control)
        states = numpy.asarray(jax.block_until_ready(run.ys))
    # diffrax fills states that it did not reach with infinities
    unreached = numpy.isinf(states).all(axis=1)
    if run.result != diffrax.RESULTS.successful and unreached.any():
        states = states[: int(numpy.argmax(unreached))]
    limit = bool(run.result == diffrax.RESULTS.max_steps_reached)
    outcome = Outcome.STEP_LIMIT if limit else Outcome.STEP_TOO_SMALL
    return Solution(states, 0.0, int(run.stats["num_steps"]), None, seconds, outcome)


dopri8 = double_peer("diffrax:Dopri8", 8, _solve, attitude=True)
