"""What Kovalevskaya's and Goryachev-Chaplygin's tops share: their tops, and two separated variables on a straight line.

Both have I1 = I2, their centre of mass in that plane and two variables whose integrals G_0, G_1 of
:mod:`heavytop.exact.abel` grow linearly with time.  One of the two may rest (:mod:`heavytop.exact.resting`); then one
integral of the other is left, and grows linearly too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

from flint import arb, arb_series

from heavytop.errors import LevelNotDone, OutOfReach
from heavytop.exact.abel import Inversion, Variable
from heavytop.exact.asymptotic import Approach
from heavytop.exact.balls import Undecided, working_precision
from heavytop.exact.flint_context import current_length
from heavytop.exact.gaps import Gap, Roots
from heavytop.exact.resting import Beside, Rest

REMEDY = "The validated enclosure holds for every motion."
_DECISIONS, _RIGHT = (64, 256, 1024, 4096), 10


def decide(
    test: Callable[[], object], name: str = "The level is degenerate but for less than about 1e-300", least: int = 64
) -> None:
    """``test`` at the first working precision that suffices for it, ``least`` bits or more.

    Raises LevelNotDone where none does, and where the test raises OutOfReach.
    """
    for bits in _DECISIONS:
        if bits < least:
            continue
        with working_precision(bits):
            try:
                test()
            except Undecided:
                continue
            except OutOfReach as error:
                raise LevelNotDone(f"{name}: {error.cause}", REMEDY) from error
        return
    raise LevelNotDone(f"{name}: {_DECISIONS[-1]} bits do not tell them apart.", REMEDY)


def refuse(name: str, apart: arb, of: str) -> NoReturn:
    """Raises LevelNotDone with the distance, Undecided where the working precision does not tell it."""
    if apart.rel_accuracy_bits() < _RIGHT:
        raise Undecided
    raise LevelNotDone(f"{name} but for {apart.str(2, radius=False)}, the distance of {of}.", REMEDY)


def variable_between(low: arb, high: arb, double: tuple[bool, bool], rest: Roots, most: int) -> Variable:
    """The gap between two simple roots, or the way from a simple one to a double one and back.

    double: whether the lower and the upper one are.  Raises Undecided where the working precision does not part them,
    OutOfReach for Fourier series of more than ``most`` terms.
    """
    if not low < high:
        raise Undecided
    if double[0]:
        return Approach(high, low, rest, most=most)
    return Approach(low, high, rest, most=most) if double[1] else Gap(low, high, rest, most=most)


@dataclass(frozen=True, slots=True)
class Line:
    """Two variables, and what of their integrals grows linearly: from ``origin`` at the rates ``slopes``.

    moving: the numbers of those that do not rest.
    """

    variables: tuple[Variable, ...]
    moving: tuple[int, ...]
    inversion: Inversion
    origin: tuple[arb, ...]
    slopes: tuple[arb, ...]

    @classmethod
    def of(
        cls, variables: tuple[Variable, ...], signs: tuple[int, int], slopes: tuple[int, int], phases: Sequence[arb]
    ) -> Line:
        """From the phases at t = 0; signs: ε, slopes: of G_0 and G_1."""
        moving = tuple(k for k in (0, 1) if not isinstance(variables[k], Rest))
        inversion, rates = Inversion(variables, signs), tuple(map(arb, slopes))
        for k in (0, 1):
            if k not in moving:
                # of ε_o (G_1 − e G_0), one number
                place, other = variables[k].middle, 1 - k
                inversion = Inversion((Beside(variables[other], place),), (1,))
                rates = (signs[other] * (slopes[1] - place * slopes[0]),)
        origin = inversion.values([phases[k] for k in moving])
        return cls(variables, moving, inversion, tuple(origin), rates)

    def phases(self, time: arb) -> tuple[list[arb], list[int]]:
        """The phases in the first turns, 0 for a variable at rest, and whole turns.

        Raises Undecided where the working precision does not prove them.
        """
        target = [value + slope * time for value, slope in zip(self.origin, self.slopes, strict=True)]
        found, counts = self.inversion.phases(target)
        if not all(phase.is_finite() for phase in found):
            raise Undecided
        phases, turns = [arb(0)] * 2, [0] * 2
        for k, phase, count in zip(self.moving, found, counts, strict=True):
            phases[k], turns[k] = phase, count
        return phases, turns

    def mean_rates(self) -> list[arb]:
        """:meth:`Inversion.mean_rates` of the variables that move."""
        return self.inversion.mean_rates(self.slopes)

    def series(self, phases: Sequence[arb], rates: Callable[[Any, Any], Sequence[Any]]) -> list[Any]:
        """The phases as power series in t, from their differential equations: rates of both at (v1, v2)."""
        moving = [arb_series([phase], prec=current_length()) for phase in phases]
        for _ in range(current_length() - 1):
            v1, v2 = (variable.position(x) for variable, x in zip(self.variables, moving, strict=True))
            moving = [phase + rate.integral() for phase, rate in zip(phases, rates(v1, v2), strict=True)]
        return moving
