"""The proof of one statement: an identity of the algebra, and every condition under which it proves anything.

Continuous values that satisfy an equation off a set without interior satisfy it everywhere: so a zero of a
denominator is removable where the values are continuous across it, and two halves of the time axis join.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy
from flint import arb

from heavytop.claims.algebra import Field
from heavytop.claims.arcs import Arcs
from heavytop.claims.conditions import Kind, Need
from heavytop.claims.evaluate import evaluate
from heavytop.claims.rational import Quotient
from heavytop.claims.real_zeros import is_small_polynomial, on_conditions
from heavytop.claims.regularity import Regularity
from heavytop.claims.sign import NUMBER_BITS, Unprovable, used
from heavytop.claims.statement import Place, Setting, Statement
from heavytop.claims.structure import sign_of
from heavytop.exact.balls import working_precision

_EVERYWHERE = "proven all over the domain"
KEPT = "kept by the flow: where it is so at first, it stays so"


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition of a proof: whether it is discharged, and how, or what stands against it."""

    text: str
    discharged: bool
    reason: str


class Region:
    """A field over one part of the domain, with what is known to vanish nowhere or on no open set there."""

    def __init__(self, field: Field, setting: Setting, statement: Statement, places: Sequence[Place]) -> None:
        self.field = field
        self._setting = setting
        self._flow = statement.flow
        self.places = [place for place in places if self._holds(place)]
        self._thin: dict[str, bool] = {}
        self._divisors: dict[tuple[bool, str], bool] = {}
        self.regularity = Regularity(field, self.is_nowhere_zero)
        self._arcs = Arcs(self)

    def _holds(self, place: Place) -> bool:
        a = self.field.assumptions
        value = place[a.variable] * a.variable_sign
        return value > 0 or (value == 0 and not (a.strict and a.variable_sign))

    def vanishes(self, expression: sympy.Expr) -> bool:
        """0 by the algebra, and by what inverse functions add up to."""
        try:
            p = self.field.enter(expression).numerator
            return not p or not self._arcs.without(p)
        except Unprovable:
            return False

    def is_forced(self, expression: sympy.Expr, *, radical: bool) -> bool:
        """0 by the relations of the claim, as in :meth:`~heavytop.claims.algebra.Field.is_forced`."""
        return self.field.is_forced(expression, radical=radical, simpler=self._arcs.without)

    def is_nowhere_zero(self, p: Any) -> bool:
        """0 nowhere on the region (of a first integral: nowhere on the part that the flow keeps)."""
        return self.field.tower.signs.of(p).strict or self._is_apart(p) or self.is_kept(p)

    def _is_apart(self, p: Any) -> bool:
        return bool(self._setting.relations) and self.field.never_zero_on_relations(p)

    def is_kept(self, p: Any) -> bool:
        """p' = c p along the flow, with c continuous: p keeps its sign."""
        if self._flow is None:
            return False
        field = self.field
        try:
            expression = field.expression(Quotient(p, field.tower.one))
            if not expression.free_symbols & self._flow.state:
                return False
            rate = field.enter(self._flow.rate(expression))
            cofactor = field.tower.divide(rate, Quotient(p, field.tower.one))
        except Unprovable:
            return False
        strict = Regularity(field)
        return not strict.obstacle(cofactor)

    def is_zero_nowhere_dense(self, p: Any) -> bool:
        """0 on a set without interior at most."""
        key = str(p)
        if key not in self._thin:
            self._thin[key] = all(self._is_thin(factor) for factor, _ in self.field.tower.signs.factors(p)[1])
        return self._thin[key]

    def _is_thin(self, p: Any) -> bool:
        tower = self.field.tower
        index = next(iter(used(p)))
        if len(used(p)) == 1 and p == tower.gens[index] and tower.generators[index].kind == "root":
            return self.is_zero_nowhere_dense(tower.radicand(index))
        if all(tower.generators[i].kind == "symbol" for i in used(p)) or tower.signs.of(p).strict:
            return True
        if not self.is_connected(used(p)) or self.regularity.obstacle_of_generators(used(p), analytic=True):
            return False
        return any(self._is_nonzero_at(p, place) for place in self.places)

    def is_connected(self, indices: set[int]) -> bool:
        """Linear inequalities bound a convex domain of the symbols in these generators, and of those bound to them."""
        a = self.field.assumptions
        bounds = [bound for bound in a.bounds() if bound.free_symbols]
        near = set().union(*(self.field.meaning(index).free_symbols for index in indices))
        while more := set().union(*(e.free_symbols for e in (*bounds, *a.relations) if e.free_symbols & near)) - near:
            near |= more
        return not near & set(a.nonzero).union(*(relation.free_symbols for relation in a.relations)) and all(
            is_small_polynomial(bound) and sympy.Poly(bound).total_degree() <= 1
            for bound in bounds
            if bound.free_symbols & near
        )

    def _is_nonzero_at(self, p: Any, place: Place) -> bool:
        meanings = {index: self.field.meaning(index) for index in used(p)}
        try:
            balls = {index: evaluate(meaning, place, NUMBER_BITS) for index, meaning in meanings.items()}
        except (KeyError, Unprovable):
            return False
        with working_precision(NUMBER_BITS):
            total = arb(0)
            for monomial, coefficient in p.to_dict().items():
                term = arb(coefficient)
                for index in balls:
                    for _ in range(int(monomial[index])):
                        term *= balls[index]
                total += term
            return bool(total.is_finite() and not total.contains(0))

    # --- conditions -------------------------------------------------------------------------------------------------

    def discharge(self, need: Need) -> str:
        """How it is discharged all over the region; "" where it is not."""
        on_relations = on_conditions(need.expression, self._setting.relations)
        return self._discharge(need) or (
            self._discharge(replace(need, expression=on_relations)) if on_relations != need.expression else ""
        )

    def _discharge(self, need: Need) -> str:
        plain = sign_of(need.expression)
        if (
            plain.strict
            if need.kind is Kind.NONZERO
            else plain.value > 0 and (plain.strict or need.kind is Kind.NONNEGATIVE)
        ):
            return _EVERYWHERE
        try:
            value = self.field.enter(need.expression)
        except Unprovable:
            return ""
        sign = self.field.tower.sign(value)
        apart = need.kind is Kind.NONZERO and bool(value.numerator) and self._factors_nowhere_zero(value.numerator)
        if apart or need.kind.is_met_by(sign):
            return _EVERYWHERE
        if self._flow is not None and value.numerator and self.is_kept(value.numerator):
            return KEPT
        return ""

    def _factors_nowhere_zero(self, p: Any) -> bool:
        return all(
            self.field.tower.signs.of(f).strict or self._is_apart(f) for f, _ in self.field.tower.signs.factors(p)[1]
        )

    def is_removable(self, need: Need) -> bool:
        """It fails on a set without interior at most."""
        if self._setting.relations:  # on them it may fail all over
            return False
        try:
            value = self.field.enter(need.expression)
        except Unprovable:
            return False
        weak = need.kind is Kind.NONZERO or self.field.tower.sign(value).value > 0
        return weak and bool(value.numerator) and self.is_zero_nowhere_dense(value.numerator)

    def obstacle(self, values: Sequence[sympy.Expr]) -> str:
        """What stands against the values being real and continuous all over the region."""
        for value in values:
            try:
                found = self.regularity.obstacle(self.field.enter(value))
            except Unprovable as error:
                found = error.cause
            if found:
                return found
        return ""

    def divisors(self, *, forced: bool) -> Iterator[str]:
        """Divisors of the algebra that might be 0 on too much of the region; forced: on any of it."""
        for text, p in list(self.field.tower.divisors.items()):
            if (forced, text) not in self._divisors:
                self._divisors[forced, text] = (
                    self._divisor_is_never_zero(p) if forced else self.is_zero_nowhere_dense(p)
                )
            if not self._divisors[forced, text]:
                try:
                    yield str(self.field.expression(Quotient(p, self.field.tower.one)))
                except Unprovable:
                    yield text

    def _divisor_is_never_zero(self, p: Any) -> bool:
        return all(self.is_nowhere_zero(factor) for factor, _ in self.field.tower.signs.factors(p)[1])
