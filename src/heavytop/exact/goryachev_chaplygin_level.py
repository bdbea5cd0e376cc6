"""The exact level of a Goryachev-Chaplygin or Sretensky start, the roots of its curve, and u1, u2 there.

Notation as in :mod:`heavytop.exact.goryachev_chaplygin_abel`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import acb, arb, fmpq_poly

from heavytop.exact.balls import Undecided, ball, midpoint
from heavytop.exact.reduced import Reduced, polynomial
from heavytop.top.equations import Parameters
from heavytop.top.integrals import sretensky


class Level(Reduced):
    """The exact level of a start."""

    __slots__ = ()

    @property
    def energy(self) -> Fraction:
        """h, the energy less λ²/2."""
        w1, w2, w3 = self.omega
        return 2 * (w1 * w1 + w2 * w2) + (w3 * w3 - self.rotor * self.rotor) / 2 + self.along(self.gamma)

    @property
    def axial_momentum(self) -> Fraction:
        """ρ = r + λ."""
        return self.omega[2] + self.rotor

    @property
    def third(self) -> Fraction:
        """G, Sretensky's integral: without a rotor Goryachev and Chaplygin's."""
        one = Parameters((4, 4, 1), (*self.moment, 0), (0, 0, self.rotor))
        return Fraction(sretensky(one, (*self.omega, *self.gamma), (0, 1, 2)))

    def sextic(self) -> fmpq_poly:
        """f."""
        zero, square = Fraction(0), self.moment_square * self.gamma_square
        cubic = polynomial(-4 * self.third, -2 * self.energy, -2 * self.rotor, Fraction(1))
        return polynomial(zero, zero, 4 * square) - cubic * cubic

    def separated(self) -> fmpq_poly:
        """u² − ρ u − 4s, with the roots u1, u2."""
        w1, w2, _ = self.omega
        return polynomial(-4 * (w1 * w1 + w2 * w2), -self.axial_momentum, Fraction(1))

    def resting(self) -> Fraction | None:
        """The double root of f where u1 or u2 rests; 0 where both rest, None where none does."""
        sextic = self.sextic()
        common = self.separated().gcd(sextic.gcd(sextic.derivative()))
        if common.degree() != 1:
            return Fraction(0) if common.degree() == 2 else None
        root = -common[0] / common[1]
        return Fraction(int(root.p), int(root.q))


@dataclass(frozen=True, slots=True)
class Root:
    """A root of f: how often it is one of au − X, and of au + X."""

    value: acb
    counts: tuple[int, int]

    @property
    def multiplicity(self) -> int:
        """As a root of f."""
        return sum(self.counts)


def roots(level: Level) -> list[Root]:
    """The roots of f at the working precision; raises Undecided where it does not tell their factor."""
    h, constant, a = ball(level.energy), 4 * ball(level.third), size_of(level)
    rotor = ball(level.rotor)
    found: list[Root] = []
    pairs: Any = level.sextic().complex_roots()
    for value, many in pairs:
        if value.is_zero():
            found.append(Root(acb(value), (many // 2, many - many // 2)))
            continue
        cubics = [value * (value * (value - 2 * rotor) - 2 * (h + side * a)) - constant for side in (1, -1)]
        of = [cubic.contains(0) for cubic in cubics]
        if sum(of) != 1:
            raise Undecided
        found.append(Root(acb(value), (many * of[0], many * of[1])))
    return found


def size_of(level: Level) -> arb:
    """a = c|γ|."""
    return ball(level.moment_square * level.gamma_square).sqrt()


def separated_start(level: Level) -> tuple[arb, arb]:
    """u1, u2 at t = 0; of the two the one that cancels comes from the product."""
    (w1, w2, _), axial = level.omega, level.axial_momentum
    square = w1 * w1 + w2 * w2
    larger = (abs(ball(axial)) + ball(axial * axial + 16 * square).sqrt()) / 2
    smaller = 4 * ball(square) / larger
    return (larger, -smaller) if axial >= 0 else (smaller, -larger)


def gap_ends(level: Level, curve: Sequence[Root], places: Sequence[arb]) -> list[tuple[int, int]]:
    """Between which two real roots u1 and u2 move; the same root twice for a variable that rests there for ever.

    Raises Undecided where the balls do not tell.
    """
    resting = _resting(level, curve)
    real = sorted((i for i, root in enumerate(curve) if root.value.imag.is_zero()), key=lambda i: _place(curve[i]))
    if any(curve[low].value.overlaps(curve[high].value) for low, high in pairwise(real)):
        raise Undecided
    allowed, inside = [], False
    for low, high in pairwise([i for i in real if i not in resting.values()]):
        inside ^= curve[low].multiplicity % 2 == 1
        if inside:
            allowed.append((low, high))
    found = []
    for k, u in enumerate(places):
        possible = [ends for ends in allowed if not (u < curve[ends[0]].value.real or u > curve[ends[1]].value.real)]
        if k in resting:
            possible = [(resting[k], resting[k])]
        if len(possible) != 1:
            raise Undecided
        found += possible
    return found


def _resting(level: Level, curve: Sequence[Root]) -> dict[int, int]:
    """The variable that rests at a double root, if one does, and the number of that root."""
    place = level.resting()
    if place is None:
        return {}
    found = [i for i, root in enumerate(curve) if root.multiplicity > 1 and root.value.overlaps(acb(ball(place)))]
    if len(found) != 1:
        raise Undecided
    return {0 if place > 0 else 1: found[0]}


def _place(root: Root) -> Fraction:
    return midpoint(root.value.real)
