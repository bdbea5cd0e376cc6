"""Relations between inverse functions, such as 4 atan(1/5) − atan(1/239) = π/4, and between logarithms.

A relation with small integers is proposed from values at samples (lattice reduction) and then proven.  By exact algebra
the product of the unit vectors with these angles, rotated by minus the multiple of π, is real; so the sum less that
multiple is a multiple of π at each point.  It is 0 where the ranges of the functions bound it by π, or where it is less
than π at one point of a connected domain on which it is continuous, or where it is a number less than π.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from fractions import Fraction
from math import gcd, prod

import sympy
from flint import arb, fmpq_mpoly, fmpz_mat

from heavytop.exact.flint.balls import working_precision
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Field, Regularity
from heavytop.features.claims.algebra.functions import INVERSE, circle_of_sum
from heavytop.features.claims.algebra.ring import Unprovable, used
from heavytop.features.claims.algebra.signs import NUMBER_BITS
from heavytop.features.claims.algebra.statement import Point

_BITS = 192
_LARGEST = 128
_MOST_ARCS = 10
# of the degree of a product of vectors that are no numbers
_MOST_TURNS = 12
_SAMPLES = 3


@dataclass(eq=False)
class Arcs:
    """The relations between the inverse functions of a field over a region.

    everywhere: regularity on the whole region.  points: of the region.  is_connected: whether the domain of the symbols
    in these generators is.
    """

    _field: Field
    _everywhere: Regularity
    _points: Sequence[Point]
    _is_connected: Callable[[set[int]], bool]
    _known: int = 0
    _free: list[int] = dataclass_field(default_factory=list)
    _forms: dict[int, fmpq_mpoly] = dataclass_field(default_factory=dict)

    def without(self, p: fmpq_mpoly) -> fmpq_mpoly:
        """A polynomial equal to ``p`` on the whole region, in fewer inverse functions."""
        tower = self._field.tower
        self._look_for_more()
        for index in used(p) & self._forms.keys():
            p = tower.reduce(tower.signs.substituted(p, index, self._forms[index]))
        return p

    def _look_for_more(self) -> None:
        generators = self._field.tower.generators
        known, self._known = self._known, len(generators)
        for index in range(known, self._known):
            if generators[index].kind in (*INVERSE, "log") and len(self._free) < _MOST_ARCS:
                try:
                    form = self._form_of(index)
                except Unprovable:
                    form = None
                if form is None:
                    self._free.append(index)
                else:
                    self._forms[index] = form

    def _form_of(self, index: int) -> fmpq_mpoly | None:
        """A function as a combination of earlier ones of its kind, and of π for an arc; None without a relation."""
        tower = self._field.tower
        is_log = tower.generators[index].kind == "log"
        earlier = [arc for arc in self._free if (tower.generators[arc].kind == "log") is is_log]
        pi = [] if is_log else [*used(self._field.enter(sympy.pi).numerator)]
        factors = _integer_relation([self._values(arc) for arc in (*earlier, index, *pi)])
        if factors is None or not factors[len(earlier)]:
            return None
        weights = {arc: factor for arc, factor in zip((*earlier, index), factors, strict=False) if factor}
        if not (self._is_power_product_one(weights) if is_log else self._is_proven(weights, -factors[-1])):
            return None
        leading = weights.pop(index)
        weights |= dict.fromkeys(pi, factors[-1])
        total = sum((tower.gens[arc] * factor for arc, factor in weights.items()), tower.context.constant(0))
        return total / -leading

    def _is_power_product_one(self, weights: dict[int, int]) -> bool:
        """Whether the product of these powers of the arguments is 1."""
        tower = self._field.tower
        if sum(map(abs, weights.values())) > _MOST_TURNS:
            return False
        parts = (tower.generators[index].arguments[0] ** factor for index, factor in weights.items())
        return prod(parts, start=tower.number(1)) == tower.number(1)

    def _values(self, index: int) -> list[arb]:
        """The values of a generator at a few sample points of the region; of a number, the number."""
        field = self._field
        if index in field.tower.signs.numbers:
            return [field.tower.signs.numbers[index]] * _SAMPLES
        points = self._points[:_SAMPLES]
        if not points:
            raise Unprovable("The region has no sample point.")
        try:
            values = [evaluate(field.meaning(index), point, NUMBER_BITS) for point in points]
        except KeyError:
            raise Unprovable("No value at a sample point.") from None
        if not all(value.is_finite() for value in values):
            raise Unprovable("No value at a sample point.")
        return [values[i % len(values)] for i in range(_SAMPLES)]

    # --- proofs -------------------------------------------------------------------------------------------------------

    def _is_proven(self, weights: dict[int, int], turns: int) -> bool:
        """Whether Σ weight · arc = turns · π is proven on the whole region."""
        common = gcd(*weights.values())
        multiple = next(
            h for h in range(1, common + 1) if common % h == 0 and 12 % Fraction(h * turns, common).denominator == 0
        )
        weights = {arc: weight * multiple // common for arc, weight in weights.items()}
        angle = Fraction(multiple * turns, common)
        return self._is_multiple_of_pi(weights, angle) and (
            self._is_small_by_ranges(weights, angle) or self._is_small_somewhere(weights, angle)
        )

    def _is_multiple_of_pi(self, weights: dict[int, int], angle: Fraction) -> bool:
        """Whether Σ weight · arc − angle · π is a multiple of π at each point."""
        field = self._field
        tower = field.tower
        numbers = tower.signs.numbers.keys()
        if sum(abs(weight) for arc, weight in weights.items() if arc not in numbers) > _MOST_TURNS:
            return False
        total = field.transcendental.circle_of_turn(-angle)
        for arc, weight in weights.items():
            sine, cosine = field.transcendental.direction(arc)
            for _ in range(abs(weight)):
                total = circle_of_sum(total, (sine if weight > 0 else -sine, cosine))
        return not total[0].numerator

    def _is_small_by_ranges(self, weights: dict[int, int], angle: Fraction) -> bool:
        """|Σ weight · arc − angle · π| < π by the ranges of the functions."""
        low = high = -angle
        inside = False
        for arc, weight in weights.items():
            g = self._field.tower.generators[arc]
            ends = [weight * end for end in self._ends(arc)]
            low, high = low + min(ends), high + max(ends)
            inside = inside or (g.kind == "atan" and g.strict)
        size = max(-low, high)
        return size < 1 or (inside and size == 1)

    def _ends(self, index: int) -> tuple[Fraction, Fraction]:
        """A closed interval of the values of an inverse function, in units of π."""
        tower = self._field.tower
        g, half = tower.generators[index], Fraction(1, 2)
        if g.kind == "acos":
            sign = tower.sign(g.arguments[0]).value
            return half if sign < 0 else Fraction(0), half if sign > 0 else Fraction(1)
        size = Fraction(1) if g.kind == "atan2" else half
        return Fraction(0) if g.sign > 0 else -size, Fraction(0) if g.sign < 0 else size

    def _is_small_somewhere(self, weights: dict[int, int], angle: Fraction) -> bool:
        """|Σ weight · arc − angle · π| < π: of numbers, or at a point of a connected domain where it is continuous."""
        arcs = set(weights)
        if not arcs <= self._field.tower.signs.numbers.keys() and (
            not self._is_connected(arcs) or self._everywhere.obstacle_of_generators(arcs, analytic=False)
        ):
            return False
        values = {arc: self._values(arc)[0] for arc in weights}
        with working_precision(NUMBER_BITS):
            total = sum((values[arc] * weight for arc, weight in weights.items()), arb(0))
            return bool(abs(total - arb.pi() * angle.numerator / angle.denominator) < 3)


def _integer_relation(values: Sequence[Sequence[arb]]) -> list[int] | None:
    """Small integers with which the values add up to 0 in each component, within rounding; None without any."""
    with working_precision(NUMBER_BITS):
        matrix = [[(value.mid() * 2**_BITS).floor().unique_fmpz() for value in row] for row in values]
    if any(value is None for row in matrix for value in row):  # not finite, or too wide
        return None
    scaled = [[int(value) for value in row] for row in matrix]
    count = len(values)
    rows = [[int(i == j) for j in range(count)] + row for i, row in enumerate(scaled)]
    for short in fmpz_mat(rows).lll().tolist():
        factors = [int(value) for value in short[:count]]
        if any(factors) and max(map(abs, factors)) <= _LARGEST and all(abs(int(v)) < 2**16 for v in short[count:]):
            return factors
    return None
