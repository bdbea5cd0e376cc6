"""The attitude of any known motion: ξ, a unit vector fixed in space and ⟂ γ, in body components.

A motion's own attitude starts where its formula says.  Turned about γ by one constant angle it is the attitude that
starts at :func:`heavytop.exact.motion.initial_xi`, for ξ and η = γ × ξ/|γ| are both fixed in space.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.errors import NotInClass, OutOfReach
from heavytop.exact.balls import ball, to_bits
from heavytop.exact.motion import initial_xi
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.top.heavy_top import cross, dot

Attitude = Callable[[Fraction, int], Sequence[Any]]
"""ξ at (time, bits): three balls; or Ω, γ, ξ: nine."""
_KEPT = 8
"""Working precisions whose turn at the start is remembered."""


@dataclass(frozen=True, slots=True)
class Turned:
    """Ω, γ and ξ of a motion from any attitude ``own`` of it, turned so that ξ(0) is ``initial_xi`` of its γ.

    Called with (time, bits): nine balls of ``bits`` bits, Ω and γ of the same evaluation as ξ.
    Raises OutOfReach where they cannot be proven, InputError for γ = 0.
    """

    solution: ExactSolution
    own: Attitude
    _turns: dict[int, tuple[arb, arb, arb]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __call__(self, time: Fraction, bits: int) -> list[arb]:
        def evaluate(working: int) -> list[arb]:
            cosine, sine, length = self._turn(working)
            state, xi = self.solution.state(time, working), self.own(time, working)
            eta = cross([g / length for g in state[3:]], xi)
            return [*state, *(cosine * x + sine * y for x, y in zip(xi, eta, strict=True))]

        return to_bits(evaluate, bits)

    def _turn(self, working: int) -> tuple[arb, arb, arb]:
        """Cosine and sine of the turn from the own ξ(0), and |γ|: the same at every time."""
        found = self._turns.get(working)
        if found is None:
            gamma = self.solution.start.gamma
            wanted, began = initial_xi(gamma), self.own(Fraction(0), working)
            length = ball(dot(gamma, gamma)).sqrt()
            across = cross([ball(g) / length for g in gamma], began)
            turn = dot(wanted, began), dot(wanted, across), length
            if len(self._turns) >= _KEPT:
                self._turns.clear()
            self._turns[working] = turn
            return turn
        return found


def turned_to_start(solution: ExactSolution, own: Attitude, time: Fraction, bits: int) -> list[arb]:
    """ξ of :class:`Turned` at ``time``: three balls of ``bits`` bits."""
    return Turned(solution, own)(time, bits)[6:]


def state_and_attitude(solution: ExactSolution, latest: Fraction, bits: int) -> tuple[str, Attitude]:
    """How the attitude of ``solution`` is known, and Ω, γ, ξ at (time, bits), ξ from ``initial_xi`` of its γ.

    By the closed form where that gives so many bits at the time ``latest``, else by the validated enclosure of the same
    motion up to its reach; the state of a motion that has a closed form is always of it.
    It raises OutOfReach where the bits cannot be proven, InputError for an enclosure of |γ| ≠ 1.
    """
    if isinstance(solution, Validated):
        return solution.method, solution.with_attitude
    own: Attitude | None = getattr(solution, "own_attitude", getattr(solution, "attitude", None))
    if own is not None:
        whole = Turned(solution, own)
        try:
            whole(latest, bits)
        except (NotInClass, OutOfReach):
            pass
        else:
            return solution.method, whole
    enclosure = Validated(solution.top, solution.start, solution.system)
    return enclosure.method, lambda time, bits: [*solution.state(time, bits), *enclosure.attitude(time, bits)]


def attitude_of(solution: ExactSolution, latest: Fraction, bits: int) -> tuple[str, Attitude]:
    """How the attitude of ``solution`` is known, and ξ alone of :func:`state_and_attitude`."""
    method, whole = state_and_attitude(solution, latest, bits)
    return method, lambda time, bits: whole(time, bits)[6:]
