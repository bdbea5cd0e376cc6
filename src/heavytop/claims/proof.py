"""The proof of one statement: an identity of the algebra, and every condition under which it proves anything.

Continuous values that satisfy an equation off a set without interior satisfy it everywhere: so a zero of a
denominator is removable where the values are continuous across it, and two halves of the time axis join.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
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
from heavytop.claims.statement import Flow, Place, Setting, Statement
from heavytop.claims.structure import sign_of
from heavytop.exact.balls import working_precision

_EVERYWHERE = "proven all over the domain"
KEPT = "kept by the flow: where it is so at first, it stays so"
# rational, with |γ| = 1, on no surface of low degree with small coefficients
_SOME_STATE = {
    **dict(zip(("Omega1", "Omega2", "Omega3"), (Fraction(17, 13), Fraction(-29, 31), Fraction(37, 23)), strict=True)),
    **{f"gamma{axis}": Fraction(part, 136763) for axis, part in enumerate((98838, -61370, 71895), 1)},
}


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition of a proof: whether it is discharged, and how, or what stands against it.

    positive: the formula that has to be > 0 for it, where it is one of the parameters alone.
    """

    text: str
    discharged: bool
    reason: str
    positive: str = ""


class Region:
    """A field over one part of the domain, with what is known to vanish nowhere or on no open set there."""

    def __init__(self, field: Field, setting: Setting, statement: Statement, places: Sequence[Place]) -> None:
        self.field = field
        self._statement = statement
        self._setting = setting
        self._flow = statement.flow
        self.places = [place for place in places if self._holds(place)]
        self._thin: dict[str, bool] = {}
        self._kept: dict[str, bool] = {}
        self._divisors: dict[tuple[bool, str], bool] = {}
        self._needs = statement.formulas.needs
        self.regularity = Regularity(field, self.is_nowhere_zero)
        # what is not 0 where the flow keeps it so may part the domain
        self.everywhere = Regularity(field) if statement.flow is not None else self.regularity
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
        """p' = c p along the flow, with p and c continuous, off a set without interior: p keeps its sign."""
        key = str(p)
        if key not in self._kept:
            self._kept[key] = False  # what is asked of p on the way to the answer about p
            self._kept[key] = self._flow is not None and self._is_kept(p, self._flow)
        return self._kept[key]

    def _is_kept(self, p: Any, flow: Flow) -> bool:
        try:
            expression = self.field.expression(Quotient(p, self.field.tower.one))
            if not expression.free_symbols & flow.state:
                return False
            rate = flow.rate(expression)
            field = Field(self.field.assumptions, [expression, rate])
            divisors = list(field.tower.divisors.values())
            value = field.enter(expression)
            cofactor = field.tower.divide(field.enter(rate), value)
        except Unprovable:
            return False
        regularity = Regularity(field)
        if regularity.obstacle(cofactor) or regularity.obstacle(value):
            return False
        own = Region(field, self._setting, self._statement, self.places)
        return all(own.is_zero_nowhere_dense(divisor) for divisor in divisors)

    def leaves(self, rate: sympy.Expr) -> str:
        """Why a relation with this rate may not stay 0; "" where it does.

        It does where its rate is a combination of the relations with factors that are continuous where these are 0.
        """
        try:
            field = Field(self.field.assumptions, [rate, *self.field.assumptions.relations])
        except Unprovable as error:
            return error.cause
        own = Region(field, self._setting, self._statement, self.places)
        if not own.vanishes(rate) and not own.is_forced(rate, radical=False):
            return "its rate is not shown to be 0 there"
        divisor = next(own.divisors(forced=True), "")
        return divisor and f"its rate is divided by {divisor}, which may be 0 there"

    def _is_excluded(self, p: Any) -> bool:
        """The claim is made where p is not 0, as it is written, and p keeps its sign."""
        one = self.field.tower.one
        for need in self._needs:
            if need.kind is not Kind.NONNEGATIVE:
                try:
                    value = self.field.enter(need.expression)
                except Unprovable:
                    continue
                if value.denominator == one and not divmod(value.numerator, p)[1]:
                    return self.is_kept(p)
        return False

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
        if tower.signs.of(p).strict:
            return True
        if all(tower.generators[i].kind == "symbol" for i in used(p)):
            return self._flow is None or self._is_nonzero_at_some_state(p, self._flow)
        if not self.is_connected(used(p)) or self.everywhere.obstacle_of_generators(used(p), analytic=True):
            return False
        return any(self._is_nonzero_at(p, place) for place in self.places)

    def is_connected(self, indices: set[int]) -> bool:
        """Linear inequalities bound a convex domain of the symbols in these generators, and of those bound to them."""
        a = self.field.assumptions
        bounds = [bound for bound in a.bounds() if bound.free_symbols]
        zeros = [relation for relation in a.relations if relation not in self._always]
        near = set().union(*(self.field.meaning(index).free_symbols for index in indices))
        bound_together = [e.free_symbols for e in (*bounds, *zeros, *self._always)]
        while more := set().union(*(symbols for symbols in bound_together if symbols & near)) - near:
            near |= more
        cut = set(a.nonzero).union(*(zero.free_symbols for zero in zeros))
        round_ = set().union(*(zero.free_symbols for zero in self._always))
        return not near & cut and all(
            not bound.free_symbols & round_ and is_small_polynomial(bound) and sympy.Poly(bound).total_degree() <= 1
            for bound in bounds
            if bound.free_symbols & near
        )

    def _is_nonzero_at_some_state(self, p: Any, flow: Flow) -> bool:
        """A polynomial that is not 0 all over |γ| = 1 is 0 on no open part of it."""
        try:
            expression = self.field.expression(Quotient(p, self.field.tower.one)).xreplace(dict(flow.names))
            values = {symbol: _SOME_STATE.get(str(symbol)) for symbol in expression.free_symbols}
            others = (Fraction(2 * n + 7, 3 * n + 5) for n in range(len(values)))
            return not evaluate(
                expression, {s: next(others) if v is None else v for s, v in values.items()}, NUMBER_BITS
            ).contains(0)
        except Unprovable:
            return False

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
        if self.fails_everywhere(need):
            return ""
        on_relations = on_conditions(need.expression, [*self._setting.relations, *self._always])
        return self._discharge(need) or (
            self._discharge(replace(need, expression=on_relations)) if on_relations != need.expression else ""
        )

    def fails_everywhere(self, need: Need) -> str:
        """What its expression is at every state of a body, where that does not meet it; else ""."""
        value = on_conditions(need.expression, self._always)
        if value.free_symbols or replace(need, expression=value).is_met({}) is not False:
            return ""
        return f"it is {value}" + (" where |gamma| = 1" if self._always else "")

    @property
    def _always(self) -> tuple[sympy.Expr, ...]:
        return () if self._flow is None else self._flow.always

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
        if self.keeps_sign(value, need.kind):
            return KEPT
        return ""

    def keeps_sign(self, value: Quotient, kind: Kind) -> bool:
        """Along the flow: its numerator does, and its denominator, unless only that it is not 0 is asked."""
        if self._flow is None or not value.numerator or not self.is_kept(value.numerator):
            return False
        below = self.field.tower.signs.factors(value.denominator)[1]
        return kind is Kind.NONZERO or all(self.is_nowhere_zero(factor) for factor, _ in below)

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
        tower = self.field.tower
        return all(
            tower.signs.of(factor).strict or self._is_apart(factor) or self._is_excluded(factor)
            for factor, _ in tower.signs.factors(p)[1]
        )
