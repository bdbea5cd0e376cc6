"""A reference where no proof is at hand: two runs at different precisions, trusted as far as they agree.

Labelled computed, not proven: the radius is the difference of the two runs, which no theorem bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import exact, real
from heavytop.records import Against
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

_MOST_STEPS = 10_000
"""Some minutes of work; absurd starts and times would take for ever."""


class ComputedReference:
    """States, and on request attitude vectors, at given times, from runs with ``bits`` and with 64 bits more.

    Raises OutOfReach if either run does not reach the last time in 10,000 steps.
    """

    def __init__(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        bits: int = 256,
        system: System = HEAVY_TOP,
        xi: tuple[Fraction, ...] | None = None,
    ) -> None:
        runs = [
            propagate(top, start, times, real(b), system=system, xi=xi, step_limit=_MOST_STEPS)
            for b in (bits, bits + 64)
        ]
        for run in runs:
            if run.outcome is not Outcome.SUCCESS:
                raise OutOfReach(
                    f"A reference run with {run.problem.precision.bits} bits {run.outcome.message}.",
                    "Ask for an earlier time.",
                )
        states = zip(times, *(run.states for run in runs), strict=True)
        self.balls: dict[Fraction, list[arb]] = {time: _around(coarse, fine, bits) for time, coarse, fine in states}
        worst = max(float(value.rad()) for values in self.balls.values() for value in values)
        self.against = Against("computed", f"heyoka at {bits} and {bits + 64} bits", f"{worst:.1e}")

    def state(self, time: Fraction) -> list[arb]:
        """Six balls, or nine with the attitude vector, at one of the times."""
        return self.balls[time]


@whole_evaluation
def _around(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[arb]:
    """The finer values, each with the difference (at least a rounding of the coarser) as its radius."""
    pairs = [(exact(a), exact(b)) for a, b in zip(coarse, fine, strict=True)]
    with working_precision(bits + 128):
        return [ball(b) + arb(0, ball(abs(b - a) + Fraction(2) ** -bits).abs_upper()) for a, b in pairs]
