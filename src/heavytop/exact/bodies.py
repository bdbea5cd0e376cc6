"""The motion of a body in its input axes: computed in principal axes, and rotated back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import log2
from typing import cast

from flint import arb

from heavytop.errors import OutOfReach, quoted, refusal
from heavytop.exact.catalogue import find, state_and_attitude
from heavytop.exact.closed_form import balls, starting_at
from heavytop.exact.enclosure.run import EFFORT, Validated
from heavytop.exact.flint.balls import relative_bits, whole_evaluation, working_precision
from heavytop.exact.resolved import Resolved, resolve
from heavytop.exact.solution import ExactSolution
from heavytop.precision import Vector
from heavytop.top.amplification import amplification
from heavytop.top.attitude import rotated
from heavytop.top.bodies import Body
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

Finder = Callable[[HeavyTop, State, System, float], ExactSolution]
_DATA_BITS = 256
_GUARD_BITS = 96
_ATTEMPTS = 4
_MOST_BITS = 1 << 15
_FOLLOWED_BITS = 512
"""An amplification beyond it is out of reach anyway, or nearly."""
Whole = Callable[[Fraction, int], Sequence[arb]]
Evaluate = Callable[[tuple[Resolved, ExactSolution], int], Sequence[arb]]


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """The exact motion of a body or a top in its input axes.

    body, start: the input, any attitude included.  system: of the motion.  finder: of the motion in principal axes.
    effort: of its enclosure, :class:`heavytop.exact.enclosure.run.Validated`.
    Its balls contain the true motion, also for irrational data.
    """

    body: Body | HeavyTop
    start: State
    system: System = HEAVY_TOP
    finder: Finder = find
    effort: float = EFFORT
    _made: dict[int, tuple[Resolved, ExactSolution]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def method(self) -> str:
        """The closed form or enclosure behind it."""
        return self.solution.method

    @property
    def source(self) -> str:
        """The publication of its formulas."""
        return self.solution.source

    @property
    def resolved(self) -> Resolved:
        """The motion in principal axes; irrational data to 256 bits."""
        return self._known(_DATA_BITS)[0]

    @property
    def solution(self) -> ExactSolution:
        """The motion in principal axes; with its uncertainty where the data are irrational."""
        return self._known(_DATA_BITS)[1]

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """(Ω, γ) at ``time`` in the input axes: six balls of ``bits`` bits.

        Raises OutOfReach where they cannot be proven.
        """
        return self._evaluated(time, bits, lambda known, working: known[1].state(time, working))

    def with_attitude(self, time: Fraction, bits: int) -> list[arb]:
        """Ω, γ and ξ at ``time`` in the input axes: nine balls.

        ξ starts at the first row of the input attitude, or at :func:`heavytop.top.attitude.perpendicular` of γ.
        Raises OutOfReach where it cannot be proven, InputError for |γ| ≠ 1 where no attitude was given.
        """
        return list(self.known_attitude(time, bits)[1](time, bits))

    def known_attitude(self, latest: Fraction, bits: int) -> tuple[str, Whole]:
        """The method of the attitude, and a function of (time, bits) that returns Ω, γ, ξ as :meth:`with_attitude`.

        It uses the closed form of the attitude where that yields ``bits`` bits at the time ``latest``.
        """
        known = self._known(_DATA_BITS)
        if known[0].uncertainty is not None:
            return self.method, lambda time, bits: self._evaluated(
                time, bits, lambda motion, working: cast(Validated, motion[1]).with_attitude(time, working)
            )
        method, inner = state_and_attitude(known[1], latest, bits, self.effort)
        if known[0].xi is not None:
            inner = starting_at(known[0].xi, known[1].start.gamma, inner)
        if not known[0].is_rotated:
            return method, inner
        return method, lambda time, bits: _turned(known, bits, lambda _known, working: inner(time, working))

    def _evaluated(self, time: Fraction, bits: int, evaluate: Evaluate) -> list[arb]:
        """The vectors of ``evaluate`` in the input axes, to ``bits`` bits."""
        known = self._known(_DATA_BITS)
        resolved = known[0]
        if resolved.uncertainty is None:
            return _turned(known, bits, evaluate)
        parameters = self.system.parameters(resolved.top, resolved.start)
        loss_bits = log2(max(1.0, amplification(self.system, parameters, resolved.start.flat, time)))
        data_bits = 64 * -(-(bits + _GUARD_BITS + int(2 * loss_bits)) // 64)
        try:
            return _turned(self._known(data_bits), bits, evaluate)
        except OutOfReach:
            if loss_bits > _FOLLOWED_BITS or 4 * data_bits > _MOST_BITS:
                raise
            return _turned(self._known(4 * data_bits), bits, evaluate)  # the amplification is an estimate

    def _known(self, bits: int) -> tuple[Resolved, ExactSolution]:
        if bits not in self._made:
            resolved = resolve(self.body, self.start, bits)
            if resolved.uncertainty is None:
                solution = self.finder(resolved.top, resolved.start, self.system, self.effort)
                if not hasattr(solution, "state"):
                    remedy = "Return what heavytop.exact.catalogue.find returns."
                    raise refusal("what finder returns", "an exact solution", quoted(solution), remedy)
            else:
                solution = Validated(
                    resolved.top,
                    resolved.start,
                    self.system,
                    xi=resolved.xi,
                    effort=self.effort,
                    method="validated: Taylor enclosure of irrational data",
                    uncertainty=resolved.uncertainty,
                )
            self._made.setdefault(bits, (resolved, solution))
        return self._made[bits]


def _turned(known: tuple[Resolved, ExactSolution], bits: int, evaluate: Evaluate) -> list[arb]:
    """The vectors of ``evaluate`` rotated to the input axes, to ``bits`` bits."""
    if not known[0].is_rotated:
        return list(evaluate(known, bits))
    working = bits + 4
    for _ in range(_ATTEMPTS):
        values = _given(known[0], evaluate(known, working), working + _GUARD_BITS)
        reached = min(map(relative_bits, values))
        if reached >= bits:
            return values
        working += bits - reached + 4
    raise OutOfReach(f"Only {reached} of {bits} bits could be proven in the axes given.", "Request fewer digits.")


@whole_evaluation
def _given(resolved: Resolved, values: Sequence[arb], bits: int) -> list[arb]:
    with working_precision(bits):
        return in_axes(resolved.axes, values)


def in_axes(axes: Sequence[Vector], values: Sequence[arb]) -> list[arb]:
    """A v of each three components, A by its rows."""
    parts = (values[begin : begin + 3] for begin in range(0, len(values), 3))
    return [part for vector in parts for part in rotated([balls(row) for row in axes], vector)]
