"""Renaming of the principal axes, once for all cases.

With Q a permutation of the axes and d = det Q = ±1, Q (u × v) = d Qu × Qv.  So if (Ω, γ) solves the equations of
the top (I, r), then

    Ω~ = d QΩ,   γ~ = Qγ    solve those of the top (QI, Qr):
    M~' = d QM' = QM × QΩ + P Qγ × Qr = M~ × Ω~ + P γ~ × r~,    γ~' = d Qγ × QΩ = γ~ × Ω~

without a reversal of the time.  Likewise the gyrostat, where Q keeps axis 2 and λ = P b/(M·γ) goes to d λ, and the
heavy gyrostat, whose k goes to d Qk as M does.  A vector fixed in space goes to its image under Q.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import permutations
from typing import Any

from flint import arb, arb_series

from heavytop.errors import NotInClass, OutOfReach
from heavytop.exact.attitude import turned_to_start
from heavytop.exact.closed_form import series_length
from heavytop.exact.solution import ExactSolution
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State

Axes = tuple[int, int, int]
CYCLIC: tuple[Axes, ...] = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
ALL: tuple[Axes, ...] = tuple((i, j, k) for i, j, k in permutations(range(3)))


def orientation(axes: Axes) -> int:
    """det Q: +1 for an even renaming, −1 for an odd one."""
    return 1 if axes in CYCLIC else -1


def inverse(axes: Axes) -> Axes:
    """The renaming that undoes this one."""
    i, j, k = (axes.index(axis) for axis in range(3))
    return i, j, k


def permuted(vector: Sequence[Any], axes: Axes) -> tuple[Any, Any, Any]:
    """Qv: component number ``axes[k]`` of v comes to place k."""
    return vector[axes[0]], vector[axes[1]], vector[axes[2]]


def renamed_top(top: HeavyTop, axes: Axes) -> HeavyTop:
    """The same top with its axis ``axes[k]`` called k."""
    d = orientation(axes)
    rotor = None if top.rotor is None else [d * k for k in permuted(top.rotor, axes)]
    return HeavyTop(permuted(top.inertia, axes), top.weight, permuted(top.centre, axes), rotor)


def renamed_state(state: State, axes: Axes) -> State:
    """(d QΩ, Qγ)."""
    d = orientation(axes)
    return State([d * w for w in permuted(state.omega, axes)], permuted(state.gamma, axes))


@dataclass(frozen=True, slots=True)
class Renamed:
    """A motion of the top whose axis k is axis ``axes[k]`` of the solution's top."""

    solution: ExactSolution
    axes: Axes
    top: HeavyTop = field(init=False)
    start: State = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "top", renamed_top(self.solution.top, self.axes))
        object.__setattr__(self, "start", renamed_state(self.solution.start, self.axes))

    @property
    def method(self) -> str:
        """The solution's own, and the names its axes have here."""
        there = inverse(self.axes)
        return f"{self.solution.method}, axes {there[0] + 1}{there[1] + 1}{there[2] + 1}"

    @property
    def system(self) -> System:
        """That of the solution."""
        return self.solution.system

    def _renamed(self, values: Sequence[Any]) -> list[Any]:
        omega: tuple[Any, ...] = permuted(values[:3], self.axes)
        if orientation(self.axes) < 0:
            # a ball is negated exactly: the minus sign would round it to FLINT's precision of the moment
            omega = tuple(w.neg(exact=True) if isinstance(w, arb) else -w for w in omega)
        return [*omega, *permuted(values[3:6], self.axes)]

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""
        return self._renamed(self.solution.state(time, bits))

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""
        with series_length(length):
            return self._renamed(self.solution.series(time, length, bits))

    def second_state(self, time: Fraction, bits: int) -> list[arb]:
        """The state by the solution's second closed form.  Raises OutOfReach where it has none."""
        second = getattr(self.solution, "second_state", None)
        if second is None:
            raise OutOfReach("There is one closed form of this motion only.", "Certify it by the enclosure.")
        return self._renamed(second(time, bits))

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, starting where :func:`heavytop.exact.motion.initial_xi` says in the new names.

        Raises NotInClass where the solution has no attitude.
        """
        return turned_to_start(self, self.own_attitude, time, bits)

    def own_attitude(self, time: Fraction, bits: int) -> Sequence[arb]:
        """ξ in the new names, starting where the solution's does.  Raises NotInClass where it has no attitude."""
        attitude = getattr(self.solution, "attitude", None)
        if attitude is None:
            raise NotInClass(f"{self.method} has no attitude in closed form.", "Integrate the attitude along with it.")
        return permuted(attitude(time, bits), self.axes)
