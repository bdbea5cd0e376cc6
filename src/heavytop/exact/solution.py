"""The interface of exact motions, and exact conditions on body and start."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from flint import arb, arb_series

from heavytop.errors import NotInClass
from heavytop.precision import dot, shown
from heavytop.top.equations import HEAVY_TOP, System, kovalevskaya_xi
from heavytop.top.heavy_top import HeavyTop, State


class ExactSolution(Protocol):
    """A motion that can be evaluated at any time to any number of bits.

    method: the closed form or the enclosure behind it, for reports.  source: the publication of its formulas.
    """

    @property
    def method(self) -> str: ...

    @property
    def source(self) -> str: ...

    @property
    def system(self) -> System: ...

    @property
    def top(self) -> HeavyTop: ...

    @property
    def start(self) -> State: ...

    def __hash__(self) -> int: ...

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """Six balls (Ω1, Ω2, Ω3, γ1, γ2, γ3) at ``time``.

        Each has at least ``bits`` correct bits, relative to a value above 1 and absolute below it.
        Raises OutOfReach where that cannot be proven.
        """
        ...

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """Six power series in ε, the motion at ``time`` + ε up to ε^(length − 1).

        The closed form (or the enclosure) is evaluated with t + ε for t; substituted into the field they give the
        residual.  The coefficient of ε^0 has ``bits`` bits as :meth:`state`.
        """
        ...


# Exact conditions on body and start: rational quantities that do or do not vanish in a class of motions.
#
# A class of motions lists them once, as ``body`` and ``starts``.  Its constructor tests them, the catalogue finds the
# class by them (:mod:`heavytop.exact.catalogue`), and :func:`heavytop.exact.catalogue.table` lists them.


def vanish(values: Sequence[Fraction]) -> bool:
    """Whether all values are 0."""
    return not any(values)


def positive(values: Sequence[Fraction]) -> bool:
    """Whether all values are greater than 0."""
    return min(values) > 0


@dataclass(frozen=True, slots=True)
class ExactRelation:
    """A relation between exact data of a top and a start.

    text: the relation, ``I1 = I2 = 2 I3``.  names: of the tested quantities, ``I1 - I2, I1 - 2 I3``; one name may be
    that of a vector.  values: of these quantities.  test: the predicate that they satisfy.
    """

    text: str
    names: str
    values: Callable[[HeavyTop, State], Sequence[Fraction]]
    test: Callable[[Sequence[Fraction]], bool] = vanish

    def holds(self, top: HeavyTop, start: State) -> bool:
        """Whether the relation holds, exactly."""
        return self.test(self.values(top, start))

    def named_values(self, top: HeavyTop, start: State) -> str:
        """The tested quantities, with their values."""
        values, names = [shown(value) for value in self.values(top, start)], self.names.split(", ")
        if len(names) < len(values):
            values = [f"({', '.join(values)})"]
        return ", ".join(f"{name} = {value}" for name, value in zip(names, values, strict=True))


Conditions = tuple[ExactRelation, ...]


def hold(conditions: Iterable[ExactRelation], top: HeavyTop, start: State) -> bool:
    """Whether all conditions hold; stops at the first that does not."""
    return all(condition.holds(top, start) for condition in conditions)


def require(name: str, conditions: Iterable[ExactRelation], top: HeavyTop, start: State) -> None:
    """Raises NotInClass for the first condition that does not hold."""
    for condition in conditions:
        if not condition.holds(top, start):
            raise NotInClass(
                f"{name} needs {condition.text}, but {condition.named_values(top, start)}.",
                "Rename the axes if need be; `heavytop.reference` determines the class of a motion.",
            )


def apart(motion: ExactSolution, top: HeavyTop, start: State) -> list[Fraction]:
    """The differences of the numbers of a motion's top and start from these."""
    known, given = ((*t.inertia, t.weight, *t.centre, *s.flat) for t, s in ((motion.top, motion.start), (top, start)))
    return [a - b for a, b in zip(known, given, strict=True)]


def _hess(top: HeavyTop, _start: State) -> tuple[Fraction]:
    """P² times I1 (I2 − I3) a² − I3 (I1 − I2) c²."""
    (i1, i2, i3), (a, _, c) = top.inertia, top.moment
    return (i1 * (i2 - i3) * a * a - i3 * (i1 - i2) * c * c,)


def plane_top(ratio: int) -> Conditions:
    """The body of Kovalevskaya's class (2), or Goryachev and Chaplygin's (4)."""
    text, names = f"I1 = I2 = {ratio} I3", f"I1 - I2, I1 - {ratio} I3"
    equal = ExactRelation(text, names, lambda top, _: (_differ(top, 0, 1), top.inertia[0] - ratio * top.inertia[2]))
    return equal, ExactRelation("P c = 0", "P c", lambda top, _: top.moment[2:]), TORQUE


def equilibrium(system: System) -> ExactRelation:
    """The relation that all six rates of change are 0."""
    return ExactRelation(
        "Omega' = gamma' = 0",
        "their components",
        lambda top, start: system.field(system.parameters(top, start), start.flat),
    )


def _differ(top: HeavyTop, i: int, j: int) -> Fraction:
    return top.inertia[i] - top.inertia[j]


def _area(top: HeavyTop, start: State) -> tuple[Fraction]:
    return (Fraction(dot(top.angular_momentum(start.omega), start.gamma)),)


def _along(top: HeavyTop, start: State) -> tuple[Fraction]:
    return (Fraction(dot(top.angular_momentum(start.omega), top.moment)),)


def _xi(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    return kovalevskaya_xi(HEAVY_TOP.parameters(top, start), start.flat, (0, 1, 2))


TORQUE = ExactRelation("P r != 0", "P r", lambda top, _: top.moment, any)
NO_TORQUE = ExactRelation("P r = 0", "P r", lambda top, _: top.moment)
ON_AXIS_1 = ExactRelation("P b = P c = 0", "P b, P c", lambda top, _: top.moment[1:]), TORQUE
IN_PLANE_13 = ExactRelation("P b = 0", "P b", lambda top, _: top.moment[1:2])
MOMENTS_1_3 = ExactRelation("I1 != I3", "I1 - I3", lambda top, _: (_differ(top, 0, 2),), any)
OFF_AXES_13 = ExactRelation("P a != 0, P c != 0", "P a, P c", lambda top, _: (top.moment[0], top.moment[2]), all)
SPIN_UPWARDS = ExactRelation("Omega3 > 0", "Omega3", lambda _, start: start.omega[2:], positive)
HESS = ExactRelation("I1 (I2 - I3) a^2 = I3 (I1 - I2) c^2", "P^2 times the difference", _hess)
HESS_TOP = IN_PLANE_13, TORQUE, HESS
SYMMETRIC = (
    ExactRelation("I1 = I2", "I1 - I2", lambda top, _: (_differ(top, 0, 1),)),
    ExactRelation("P a = P b = 0", "P a, P b", lambda top, _: top.moment[:2]),
)
AXIAL_ROTOR = ExactRelation("k1 = k2 = 0", "k1, k2", lambda top, _: (top.rotor or (Fraction(0),) * 3)[:2])
SPHERICAL = ExactRelation("I1 = I2 = I3", "I1 - I2, I2 - I3", lambda top, _: (_differ(top, 0, 1), _differ(top, 1, 2)))
GAMMA = ExactRelation("gamma != 0", "gamma", lambda _, start: start.gamma, any)
LEVEL_MOMENTUM = ExactRelation("M·gamma = 0", "M·gamma", _area)
INCLINED_MOMENTUM = ExactRelation("M·gamma != 0", "M·gamma", _area, any)
ACROSS_CENTRE = ExactRelation("M·P r = 0", "M·P r", _along)
NOT_ACROSS_CENTRE = ExactRelation("M·P r != 0", "M·P r", _along, any)
XI = ExactRelation("xi = 0", "xi", _xi)
NOT_XI = ExactRelation("xi != 0", "xi", _xi, any)
