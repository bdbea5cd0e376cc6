"""Many short motions of one system at the same times, as arrays: heyoka's lanes, one call for eight motions.

The states are those of :func:`heavytop.integrate.ensemble.propagate_ensemble`, bit for bit: heyoka's dense output is
the polynomial of its step, and a step that is cut short evaluates the same one.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import heyoka
import numpy

from heavytop.integrate.engines import compiled
from heavytop.precision import DOUBLE
from heavytop.top.equations import System

LANES = 8
_REACHED = heyoka.taylor_outcome.time_limit


def states_on_a_grid(
    system: System, parameters: Any, starts: Any, times: Sequence[Fraction], **options: Any
) -> tuple[Any, Any, Any]:
    """States (motions, samples, 6), steps (motions,) and which of the motions they are good for.

    parameters: (motions, k), doubles that enter the field.  starts: (motions, 6).  times: doubles, increasing from
    above 0.  options: tolerance.  A motion is not good where it, or one of the seven beside it, did anything but get
    there in steps that move its time.
    """
    tool = compiled(system, DOUBLE, lanes=LANES, **options)
    count, ends = len(starts), numpy.array([0.0, *map(float, times)])
    grid = numpy.repeat(ends[:, None], LANES, axis=1)
    least = numpy.spacing(ends[-1])
    states = numpy.full((count, len(times), 6), numpy.nan)
    steps, good = numpy.zeros(count, int), numpy.zeros(count, bool)
    with tool.lent() as engine, numpy.errstate(all="ignore"):
        for first in range(0, count, LANES):
            places = numpy.minimum(numpy.arange(first, first + LANES), count - 1)
            engine.set_time(0.0)
            engine.pars[:] = parameters[places].T
            engine.state[:] = starts[places].T
            found = engine.propagate_grid(grid)
            results = engine.propagate_res
            moved = all(each[0] == _REACHED and 2 * each[1] > least for each in results)
            states[places] = (found[1] if isinstance(found, tuple) else found)[1:].transpose(2, 0, 1)
            steps[places] = [each[3] for each in results]
            good[places] = moved and numpy.isfinite(states[places]).all()
    return states, steps, good
