"""heyoka's Taylor method in the peers' call; its order follows from its tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import DOUBLE, Precision
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State


def heyoka(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    precision: Precision = DOUBLE,
    *,
    system: System = HEAVY_TOP,
    tolerance: Fraction | None = None,
) -> Trajectory:
    """heyoka in any format; tolerance None is the eps of the format."""
    return propagate(top, start, times, precision, system=system, tolerance=tolerance)
