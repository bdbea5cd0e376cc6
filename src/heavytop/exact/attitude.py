"""The attitude of any known motion: ξ, a unit vector fixed in space and ⟂ γ, in body components.

A motion's own attitude starts where its formula says.  Turned about γ by one constant angle it is the attitude that
starts at :func:`heavytop.exact.motion.initial_xi`, for ξ and η = γ × ξ/|γ| are both fixed in space.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from flint import arb

from heavytop.errors import NotInClass, OutOfReach
from heavytop.exact.balls import ball, to_bits
from heavytop.exact.motion import initial_xi
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.top.heavy_top import cross, dot

Attitude = Callable[[Fraction, int], Sequence[Any]]
"""ξ at (time, bits): three balls."""


def turned_to_start(solution: ExactSolution, own: Attitude, time: Fraction, bits: int) -> list[arb]:
    """ξ at ``time`` from any attitude ``own`` of the motion, so that ξ(0) is ``initial_xi`` of its γ.

    Three balls of ``bits`` bits.  Raises OutOfReach where they cannot be proven, InputError for γ = 0.
    """
    gamma = solution.start.gamma

    def evaluate(working: int) -> list[arb]:
        wanted, began = initial_xi(gamma), own(Fraction(0), working)
        length = ball(dot(gamma, gamma)).sqrt()
        cosine = dot(wanted, began)
        sine = dot(wanted, cross([ball(g) / length for g in gamma], began))
        xi = own(time, working)
        eta = cross([g / length for g in solution.state(time, working)[3:]], xi)
        return [cosine * x + sine * y for x, y in zip(xi, eta, strict=True)]

    return to_bits(evaluate, bits)


def attitude_of(solution: ExactSolution, latest: Fraction, bits: int) -> tuple[str, Attitude]:
    """How the attitude of ``solution`` is known, and ξ at (time, bits), from ``initial_xi`` of its γ.

    By the closed form where that gives so many bits at the time ``latest``, else by the validated enclosure of the same
    motion up to its reach.
    ξ raises OutOfReach where the bits cannot be proven, InputError for an enclosure of |γ| ≠ 1.
    """
    own: Attitude | None = getattr(solution, "attitude", None)
    if own is not None:
        attitude = partial(turned_to_start, solution, own)
        try:
            attitude(latest, bits)
        except (NotInClass, OutOfReach):
            pass
        else:
            return solution.method, attitude
    enclosure = Validated(solution.top, solution.start, solution.system)
    return enclosure.method, enclosure.attitude
