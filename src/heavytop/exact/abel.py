"""Real Abel inversion: the phases of one or two variables at any time, from their integrals, proven.

Variables v_k that swing in gaps (:mod:`heavytop.exact.gaps`), with phases θ_k and integrals F_kj, j = 0 .. n − 1, move
along a straight line in

    G_j(θ) = Σ_k ε_k F_kj(θ_k),   ε_k = ±1.

G is one-to-one from R^n onto R^n: its Jacobian is ε1 ε2 (v2 − v1)/√(g1 g2) ≠ 0 for disjoint gaps, and it differs from
a linear map by periodic functions (Hadamard's theorem).  :meth:`Inversion.phases` takes whole turns off, and proves
what Newton's iteration found by Krawczyk's operator (Neumaier, Interval Methods for Systems of Equations, 5.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from heavytop.exact.balls import whole, working_precision
from heavytop.exact.flint_context import current_precision

_FLOAT_BITS = 46
_ITERATIONS, _SHORTEST, _SETTLED = 100, 1e-4, 1e-13
_REPEATED = 6


class Variable(Protocol):
    """A variable of an :class:`Inversion`: swinging (:class:`heavytop.exact.gaps.Gap`), or tending to a double root.

    turn: its phase grows by this and its integrals by ``column`` with every turn; for a variable that never returns,
    what its integrals grow by with every unit of the phase, at last.  periodic: which of both.  middle: of its gap.
    """

    turn: float
    periodic: bool
    middle: arb

    @property
    def column(self) -> list[arb]: ...

    def position(self, phase: Any) -> Any:
        """v at the phase, a number or series."""
        ...

    def density(self, v: Any) -> Any:
        """dF_0 by dphase, > 0."""
        ...

    def ends(self, phase: Any) -> tuple[Any, Any]:
        """√(v − lo) and √(hi − v), each with a sign that makes it analytic."""
        ...

    def bend(self, phase: Any) -> Any:
        """−dv/dphase over the product of :meth:`ends`."""
        ...

    def phase(self, v: arb, slope: arb) -> arb:
        """The phase where the variable is v and dv/dphase is ``slope``."""
        ...

    def integrals(self, phase: arb) -> list[arb]:
        """F_j at the phase."""
        ...

    def estimates(self, phase: float) -> NDArray[np.float64]:
        """F_j in floats."""
        ...


@dataclass(frozen=True, slots=True)
class Inversion:
    """G of one or two variables; signs: ε."""

    variables: tuple[Variable, ...]
    signs: tuple[int, ...]

    def values(self, phases: Sequence[arb]) -> list[arb]:
        """G."""
        shares = [v.integrals(phase) for v, phase in zip(self.variables, phases, strict=True)]
        return [
            sum((sign * part for sign, part in zip(self.signs, parts, strict=True)), arb(0))
            for parts in zip(*shares, strict=True)
        ]

    def slopes(self, phases: Sequence[arb]) -> arb_mat:
        """The Jacobian of G: a row for each j."""
        columns = []
        for variable, sign, phase in zip(self.variables, self.signs, phases, strict=True):
            v = variable.position(phase)
            columns.append([sign * variable.density(v)])
            for _ in self.variables[1:]:
                columns[-1].append(columns[-1][-1] * v)
        return arb_mat(columns).transpose()

    def _periods(self) -> arb_mat:
        """What G grows by with a turn of each phase (a unit, where it never returns), a column for each."""
        columns = [[sign * c for c in v.column] for v, sign in zip(self.variables, self.signs, strict=True)]
        return arb_mat(columns).transpose()

    def mean_rates(self, slopes: Sequence[arb]) -> list[arb]:
        """Turns of each phase a unit of time (units, where it never returns), where G grows by ``slopes``."""
        return self._periods().solve(arb_mat([[slope] for slope in slopes])).entries()

    def phases(self, target: Sequence[arb]) -> tuple[list[arb], list[int]]:
        """(θ in the first turns, whole turns n) with G(θ + 2πn) = target: balls that hold the only solution.

        Not finite where the working precision does not prove it.
        """
        count, periods = len(self.variables), self._periods()
        aim = arb_mat([[value] for value in target])
        lost = [arb("nan")] * count, [0] * count
        try:
            cells = periods.solve(aim).entries()
        except ZeroDivisionError:
            return lost
        turns = [whole(cell) if v.periodic else 0 for v, cell in zip(self.variables, cells, strict=True)]
        rest = aim - periods * arb_mat([[n] for n in turns])
        first = [float(c - n) * v.turn for v, c, n in zip(self.variables, cells, turns, strict=True)]
        if not all(cell.is_finite() for cell in cells):
            return lost
        try:
            with np.errstate(all="ignore"):
                estimated = self._estimated(first, rest)
            return self._refined(estimated, rest), turns
        except (ZeroDivisionError, np.linalg.LinAlgError):
            return lost

    def _estimated(self, phases: list[float], rest: arb_mat) -> list[float]:
        """Newton's iteration in floats, every step as short as it must be to come nearer."""
        aim, signs = np.array([float(r) for r in rest.entries()]), np.array(self.signs, float)

        def defect(at: NDArray[np.float64]) -> NDArray[np.float64]:
            total = -aim
            for sign, variable, phase in zip(signs, self.variables, at, strict=True):
                total = total + sign * variable.estimates(float(phase))
            return total

        now = np.array(phases)
        error = defect(now)
        for _ in range(_ITERATIONS):
            with working_precision(53):
                slopes = np.array(self.slopes([arb(float(x)) for x in now]).entries(), float).reshape(len(now), -1)
            step, share = np.linalg.solve(slopes, error), 1.0
            following = defect(now - step)
            while np.abs(following).sum() > np.abs(error).sum() and share > _SHORTEST:
                share /= 2
                following = defect(now - share * step)
            now, error = now - share * step, following
            if np.abs(share * step).max() < _SETTLED * (1 + np.abs(now).max()):
                break
        return [float(x) for x in now]

    def _refined(self, phases: list[float], rest: arb_mat) -> list[arb]:
        """Newton's iteration in balls at growing precision, and the proof at the last."""
        needed, precisions = current_precision() // 2 + 8, []
        while needed > _FLOAT_BITS:
            precisions.append(needed)
            needed = needed // 2 + 8
        near = [arb(x) for x in phases]
        for precision in reversed(precisions):
            with working_precision(precision):
                for _ in range(_REPEATED):
                    step = (self._inverse(near) * (arb_mat([[v] for v in self.values(near)]) - rest)).entries()
                    near = [(x - s).mid() for x, s in zip(near, step, strict=True)]
                    # the next one would be of the size of its square
                    if all(abs(s) < arb(2) ** (8 - precision // 2) for s in step):
                        break
        return self._proven(near, rest)

    def _inverse(self, phases: list[arb]) -> arb_mat:
        return self.slopes(phases).inv().mid()

    def _proven(self, near: list[arb], rest: arb_mat) -> list[arb]:
        """Krawczyk's image of a box around the phases, if it lies inside the box."""
        inverse = self._inverse(near)
        step = (inverse * (arb_mat([[v] for v in self.values(near)]) - rest)).entries()
        floor = arb(2) ** (-current_precision())
        for widening in (2, 16, 256):
            off = [arb(0, (widening * (abs(s).upper() + floor)).upper()) for s in step]
            box = [x + o for x, o in zip(near, off, strict=True)]
            spread = -(inverse * self.slopes(box))
            for i in range(len(near)):
                spread[i, i] += 1
            moved = (spread * arb_mat([[o] for o in off])).entries()
            image = [x - s + m for x, s, m in zip(near, step, moved, strict=True)]
            if all(wide.contains_interior(narrow) for wide, narrow in zip(box, image, strict=True)):
                return image
        return [arb("nan")] * len(near)
