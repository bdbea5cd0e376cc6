"""Proofs of the statements of one claim, in shared fields, with every condition of each proof."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import wraps

import sympy
from flint import fmpq_mpoly

from heavytop.features.claims.algebra.arcs import Arcs
from heavytop.features.claims.algebra.conditions import (
    ConditionKind,
    Need,
    as_text,
    for_no_parameters,
    is_exactly_zero,
    is_never_zero,
    is_small_polynomial,
    on_conditions,
    parts_of,
    written,
)
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Field, Regularity
from heavytop.features.claims.algebra.ring import Quotient, Unprovable, used, where_provable
from heavytop.features.claims.algebra.signs import NUMBER_BITS, PLUS, value_of
from heavytop.features.claims.algebra.statement import Domain, Flow, Point, Setting, Statement
from heavytop.precision import shown

# The proof of one statement: an identity of the algebra, and the conditions under which it proves the statement.
#
# Continuous values that satisfy an equation off a set without interior satisfy it everywhere: so a zero of a
# denominator is removable where the values are continuous across it, and proofs on two halves of the time axis join.


_EVERYWHERE = "proven on the whole domain"
KEPT = "invariant under the flow: it holds at all times if it holds initially"
# rational, with |γ| = 1, on no surface of low degree with small coefficients
_SOME_STATE = {
    **dict(zip(("Omega1", "Omega2", "Omega3"), (Fraction(17, 13), Fraction(-29, 31), Fraction(37, 23)), strict=True)),
    **{f"gamma{axis}": Fraction(part, 136763) for axis, part in enumerate((98838, -61370, 71895), 1)},
}


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition of a proof: whether it is discharged, and how, or the obstacle.

    assumption: an assumption on the parameters that would discharge it; "" for none.
    """

    text: str
    discharged: bool
    reason: str
    assumption: str = ""


def _answered_once(question: Callable[[Region, fmpq_mpoly], bool]) -> Callable[[Region, fmpq_mpoly], bool]:
    """A question about a polynomial with its answers stored; within itself the answer to the same question is no."""

    @wraps(question)
    def answer(region: Region, p: fmpq_mpoly) -> bool:
        answers, key = region.answers.setdefault(question.__name__, {}), str(p)
        if key not in answers:
            answers[key] = False
            answers[key] = question(region, p)
        return answers[key]

    return answer


class Region:
    """A field over one part of the domain: where its polynomials vanish, and which needs hold."""

    def __init__(self, field: Field, setting: Setting, statement: Statement, sample_points: Sequence[Point]) -> None:
        self.field = field
        self._statement = statement
        self._setting = setting
        self._flow = statement.flow
        self.sample_points = [point for point in sample_points if self._holds(point)]
        self.answers: dict[str, dict[str, bool]] = {}
        self._divisors: dict[tuple[bool, str], bool] = {}
        self.regularity = Regularity(field, self.is_nowhere_zero)
        # polynomials that the flow keeps from 0 may divide the domain
        self.everywhere = Regularity(field) if statement.flow is not None else self.regularity
        self._arcs = Arcs(field, self.everywhere, self.sample_points, self.is_connected)

    def _holds(self, point: Point) -> bool:
        a = self.field.assumptions
        value = point[a.variable] * a.variable_sign
        return value > 0 or (value == 0 and not (a.strict and a.variable_sign))

    @where_provable(False)
    def vanishes(self, expression: sympy.Expr) -> bool:
        """0 by the algebra, by relations between inverse functions, or as a multiple of what is 0 at every state."""
        p = self.field.enter(expression).numerator
        zeros = (self.field.enter(zero).numerator for zero in self._always)
        return not (p and self._arcs.without(p)) or any(not divmod(p, zero)[1] for zero in zeros)

    def is_forced(self, expression: sympy.Expr, *, radical: bool) -> bool:
        """0 by the relations of the claim, as in :meth:`~heavytop.features.claims.algebra.fields.Field.is_forced`."""
        return self.field.is_forced(expression, radical=radical, simpler=self._arcs.without)

    def is_nowhere_zero(self, p: fmpq_mpoly) -> bool:
        """0 nowhere on the region; for a first integral, nowhere on the part that the flow preserves."""
        return self._is_never_zero(p) or self.is_kept(p)

    @_answered_once
    @where_provable(False)
    def is_kept(self, p: fmpq_mpoly) -> bool:
        """p' = c p along the flow, with p and c continuous, off a set without interior: p keeps its sign."""
        flow = self._flow
        if flow is None:
            return False
        expression = self._expression(p)
        if not expression.free_symbols & flow.state:
            return False
        rate = flow.rate(expression)
        field = Field(self.field.assumptions, [expression, rate])
        divisors = list(field.tower.divisors.values())
        value = field.enter(expression)
        cofactor = field.enter(rate) / value
        regularity = Regularity(field)
        if regularity.obstacle(cofactor) or regularity.obstacle(value):
            return False
        region = Region(field, self._setting, self._statement, self.sample_points)
        return all(map(region.is_zero_nowhere_dense, divisors))

    def leaves(self, rate: sympy.Expr) -> str:
        """The obstacle to a proof that a relation with this rate stays 0; "" for none.

        It does where its rate is a combination of the relations with factors that are continuous where these are 0.
        """
        try:
            field = Field(self.field.assumptions, [rate, *self.field.assumptions.relations])
        except Unprovable as error:
            return error.cause
        region = Region(field, self._setting, self._statement, self.sample_points)
        if not region.vanishes(rate) and not region.is_forced(rate, radical=False):
            return "its rate is not shown to be 0 there"
        divisor = next(region.divisors(forced=True), "")
        return divisor and f"its rate is divided by {divisor}, which may be 0 there"

    def _is_excluded(self, p: fmpq_mpoly) -> bool:
        """A need of the claim as written has the factor p, so p is not 0, and p keeps its sign."""
        for need in self._statement.formulas.needs:
            if need.kind is not ConditionKind.NONNEGATIVE:
                with suppress(Unprovable):
                    value = self.field.enter(need.expression)
                    if value.denominator == self.field.tower.one and not divmod(value.numerator, p)[1]:
                        return self.is_kept(p)
        return False

    @_answered_once
    def is_zero_nowhere_dense(self, p: fmpq_mpoly) -> bool:
        """0 on a set without interior at most."""
        return all(map(self._is_thin, self._factors(p)))

    def _is_thin(self, p: fmpq_mpoly) -> bool:
        tower, square = self.field.tower, self._square(p)
        if square is not None:
            return self.is_zero_nowhere_dense(square)
        if tower.signs.of(p).strict:
            return True
        if all(tower.generators[i].kind == "symbol" for i in used(p)):
            return self._flow is None or self._is_nonzero_at_some_state(p, self._flow)
        if not self.is_connected(used(p)) or self.everywhere.obstacle_of_generators(used(p), analytic=True):
            return False
        return any(self._is_nonzero_at(p, point) for point in self.sample_points)

    def is_connected(self, indices: set[int], fixed: Collection[sympy.Symbol] = ()) -> bool:
        """Linear inequalities bound a convex domain of the symbols in these generators, and of those related to them.

        fixed: symbols that do not move.
        """
        a = self.field.assumptions
        bounds = [bound for bound in a.bounds() if bound.free_symbols]
        zeros = [relation for relation in a.relations if relation not in self._always]
        near = set().union(*(self.field.meaning(index).free_symbols for index in indices)).difference(fixed)
        related = [e.free_symbols.difference(fixed) for e in (*bounds, *zeros, *self._always)]
        while more := set().union(*(symbols for symbols in related if symbols & near)) - near:
            near |= more
        restricted = set(a.nonzero).union(*(zero.free_symbols for zero in zeros))
        on_sphere = set().union(*(zero.free_symbols for zero in self._always))
        return not near & restricted and all(
            not bound.free_symbols & on_sphere
            and is_small_polynomial(bound)
            and sympy.Poly(bound, *bound.free_symbols.difference(fixed)).total_degree() <= 1
            for bound in bounds
            if bound.free_symbols & near
        )

    @where_provable(False)
    def _is_nonzero_at_some_state(self, p: fmpq_mpoly, flow: Flow) -> bool:
        """Not 0 at one state with |γ| = 1: then a polynomial is 0 on no open part of the sphere."""
        expression = self._expression(p).xreplace(dict(flow.names))
        others = (Fraction(2 * n + 7, 3 * n + 5) for n in range(len(expression.free_symbols)))
        values = {s: _SOME_STATE.get(str(s)) or next(others) for s in expression.free_symbols}
        return not evaluate(expression, values, NUMBER_BITS).contains(0)

    def _expression(self, p: fmpq_mpoly) -> sympy.Expr:
        return self.field.expression(self.field.tower.polynomial(p))

    def _is_nonzero_at(self, p: fmpq_mpoly, point: Point) -> bool:
        try:
            balls = {index: evaluate(self.field.meaning(index), point, NUMBER_BITS) for index in used(p)}
        except (KeyError, Unprovable):
            return False
        value = value_of(p, balls)
        return bool(value.is_finite() and not value.contains(0))

    # --- conditions -------------------------------------------------------------------------------------------------

    def discharge(self, need: Need) -> str:
        """The reason why the need is met on the whole region; "" where it is not shown to be."""
        if self.fails_everywhere(need):
            return ""
        on_relations = self._on_relations(need)
        reason = self._discharge(need) or (self._discharge(on_relations) if on_relations != need else "")
        return "" if reason == KEPT and not self.is_met_for_each(need) else reason

    def _on_relations(self, need: Need) -> Need:
        return replace(need, expression=on_conditions(need.expression, [*self._setting.relations, *self._always]))

    def is_met_for_each(self, need: Need) -> bool:
        """Whether an expression that must not be 0 is not 0 somewhere, for any values of the parameters."""
        if need.kind is not ConditionKind.NONZERO:
            return True
        try:
            value = self.field.enter(self._on_relations(need).expression)
        except Unprovable:
            return not need.expression.free_symbols & self._setting.parameters
        return bool(value.numerator) and all(map(self.is_for_no_parameters, self._factors(value.numerator)))

    def fails_everywhere(self, need: Need) -> str:
        """The constant value of its expression at every state of a body, where that does not meet it; else ""."""
        value = on_conditions(need.expression, self._always)
        if value.free_symbols or replace(need, expression=value).is_met({}) is not False:
            return ""
        return f"it is {value}" + (" where |gamma| = 1" if self._always else "")

    @property
    def _always(self) -> tuple[sympy.Expr, ...]:
        return () if self._flow is None else self._flow.always

    @where_provable("")
    def _discharge(self, need: Need) -> str:
        # a quotient is 0 only where its numerator is
        e = sympy.numer(need.expression) if need.kind is ConditionKind.NONZERO else need.expression
        if need.kind.is_met_by(self.field.sign(e)):
            return _EVERYWHERE
        value = self.field.enter(need.expression)
        factors = self._factors(value.numerator) if need.kind is ConditionKind.NONZERO and value.numerator else []
        is_nonzero = bool(factors) and all(map(self._is_never_zero, factors))
        if is_nonzero or need.kind.is_met_by(self.field.tower.sign(value)):
            return _EVERYWHERE
        return KEPT if self.keeps_sign(value, need.kind) else ""

    def keeps_sign(self, value: Quotient, kind: ConditionKind) -> bool:
        """Whether its numerator keeps its sign along the flow, and its denominator too unless the kind is NONZERO."""
        if self._flow is None or not value.numerator or not self.is_kept(value.numerator):
            return False
        return kind is ConditionKind.NONZERO or all(map(self.is_nowhere_zero, self._factors(value.denominator)))

    def _is_never_zero(self, p: fmpq_mpoly) -> bool:
        return self.field.tower.signs.of(p).strict or self.field.never_zero_on_relations(p)

    @where_provable(False)
    def is_removable(self, need: Need) -> bool:
        """Whether the need fails on a set without interior at most, for any values of the parameters."""
        if self._setting.relations:  # on them it may fail everywhere
            return False
        value = self.field.enter(need.expression)
        may_vanish = need.kind is ConditionKind.NONZERO or self.field.tower.sign(value).value > 0
        return may_vanish and bool(value.numerator) and all(map(self._is_thin_for_each, self._factors(value.numerator)))

    def _factors(self, p: fmpq_mpoly) -> list[fmpq_mpoly]:
        return [factor for factor, _ in self.field.tower.signs.factors(p)[1]]

    @_answered_once
    def _is_thin_for_each(self, p: fmpq_mpoly) -> bool:
        """0 on a set without interior at most, for any values of the parameters."""
        square = self._square(p)
        if square is not None:
            return all(map(self._is_thin_for_each, self._factors(square)))
        if self.field.tower.signs.of(p).strict:
            return True
        if not self.is_for_no_parameters(p):
            return False
        parameters = self._setting.parameters
        return self.is_zero_nowhere_dense(p) or (
            # analytic in the symbols that move, on a connected domain
            bool(self.field.symbols(p) & parameters)
            and self.is_connected(used(p), fixed=parameters)
            and not self.everywhere.obstacle_of_generators(used(p), analytic=True)
        )

    def _square(self, p: fmpq_mpoly) -> fmpq_mpoly | None:
        """The radicand of a polynomial that is a root; None for any other."""
        tower, index = self.field.tower, min(used(p))
        is_root = p == tower.gens[index] and tower.generators[index].kind == "root"
        return tower.squares[index] if is_root else None

    @where_provable(False)
    def is_for_no_parameters(self, p: fmpq_mpoly) -> bool:
        """True only where p is 0 on the whole region for no values of the parameters."""
        flow, domain, e = self._statement.flow, self._statement.domain, self._expression(p)
        if flow is not None:
            state = {symbol: sympy.Rational(_SOME_STATE[str(symbol)]) for symbol in flow.state - flow.names.keys()}
            at_rest = {symbol: value for symbol, value in state.items() if str(symbol).startswith("gamma")}
            points = [{**state, **dict.fromkeys(state.keys() - at_rest.keys(), sympy.S.Zero), **at_rest}, state]
            return for_no_parameters(e.xreplace(dict(flow.names)), self.field.assumptions, points, self._always)
        # bounds of the variable may hold parameters, and no point lies within all of them
        times = () if domain.facts else (0, *domain.points)
        points = [{self._setting.variable: sympy.Rational(time)} for time in times]
        return for_no_parameters(e, self.field.assumptions, points)

    def assumption_for(self, need: Need) -> str:
        """An assumption on parameters that would discharge it, or leave removable zeros; "" for none."""
        parameters = self._setting.parameters
        e = need.expression if need.expression.free_symbols <= parameters else sympy.Integer(1)
        if e is not need.expression and need.kind is ConditionKind.NONZERO:
            with suppress(Unprovable):
                factors = map(self._expression, self._factors(self.field.enter(need.expression).numerator))
                of_parameters = [factor for factor in factors if factor.free_symbols <= parameters]
                e = sympy.Mul(*(f for f in of_parameters if not is_never_zero(f, self.field.assumptions)))
        return written(f"{e} {'!=' if need.kind is ConditionKind.NONZERO else '>'} 0") if e.free_symbols else ""

    def obstacle(self, values: Sequence[sympy.Expr]) -> str:
        """The obstacle to a proof that the values are real and continuous on the whole region."""
        return next(filter(None, map(self._obstacle, values)), "")

    def _obstacle(self, value: sympy.Expr) -> str:
        """The obstacle of one value in the field, or else as written: its quotient may have other divisors."""
        try:
            obstacle = self.regularity.obstacle(self.field.enter(value))
        except Unprovable as error:
            return error.cause
        is_power = value.is_Pow and value.exp.is_Integer
        parts = value.args if value.is_Add or value.is_Mul else value.args[: int(is_power)]
        if (
            obstacle
            and parts
            and (not is_power or value.exp > 0 or self.discharge(Need(ConditionKind.NONZERO, value.base)))
        ):
            return self.obstacle(parts)
        return obstacle

    def divisors(self, *, forced: bool) -> Iterator[str]:
        """Divisors of the algebra that may be 0 on an open part of the region; forced: at any point of it."""
        for text, p in list(self.field.tower.divisors.items()):
            if (forced, text) not in self._divisors:
                self._divisors[forced, text] = (
                    all(self._is_never_zero(factor) or self._is_excluded(factor) for factor in self._factors(p))
                    if forced
                    else self.is_zero_nowhere_dense(p)
                )
            if not self._divisors[forced, text]:
                try:
                    yield str(self._expression(p))
                except Unprovable:
                    yield text


_CONTINUOUS = "{} are real and continuous on the whole domain"
_ATTITUDE = "the attitude is continuous inside the domain"
_SAMPLE = "every formula is defined and real at a sample in the domain"
_DIVISORS = "no divisor in the algebra vanishes"
_ALGEBRA = "the algebra can represent the formulas"
_REMOVABLE = "removable: {} are continuous across it"
_AT_THE_END = "proven inside the domain, removable in gamma at its end"


class Prover:
    """The fields and regions of a claim's statements, and their proofs."""

    def __init__(self, statements: Sequence[Statement], setting: Setting) -> None:
        self._statements = statements
        self._setting = setting
        self._fields: dict[tuple[object, ...], Field | None] = {}
        self._regions: dict[int, Region] = {}
        self._conditions: dict[object, tuple[Condition, ...]] = {}
        self._sample_points: dict[tuple[str, str], list[Point]] = {}
        self._met: dict[object, bool] = {}
        self._causes: dict[sympy.Expr, str] = {}

    # --- fields -----------------------------------------------------------------------------------------------------

    def field(self, statement: Statement, sign: int, *, strict: bool = False) -> Field | None:
        """The field of a statement with this sign of the variable; None where it is beyond the algebra."""
        key: tuple[object, ...] = (sign, strict, statement.branch, statement.domain.label + statement.domain.note)
        if key not in self._fields:
            branch, domain = statement.branch, statement.domain
            group = [s for s in self._statements if (s.branch, s.domain) == (branch, domain)]
            parts = [part for _, part in self._setting.parts.get(branch, ())]
            self._fields[key] = self._make(group, sign, strict, parts)
        if self._fields[key] is None:
            key = (*key, statement.residual)
            if key not in self._fields:
                self._fields[key] = self._make([statement], sign, strict, [])
        return self._fields[key]

    def _make(
        self, statements: Sequence[Statement], sign: int, strict: bool, parts: Iterable[sympy.Expr]
    ) -> Field | None:
        needs = self._kept_facts(statements[0])
        facts = (
            *statements[0].domain.facts,
            *(need.expression for need in needs if need.kind is ConditionKind.POSITIVE),
        )
        weak = tuple(need.expression for need in needs if need.kind is ConditionKind.NONNEGATIVE)
        assumptions = self._setting.assumptions(sign, strict=strict, facts=facts, weak=weak)
        expressions = dict.fromkeys([*(s.residual for s in statements), *parts])
        kept: set[sympy.Expr] = set()
        for statement in statements:
            f = statement.formulas
            expressions |= dict.fromkeys((*f.values, *f.attitude))
            expressions |= dict.fromkeys(need.expression for need in _sorted(f.needs | f.angle_needs))
            kept |= {e for e in (*f.values, *(need.expression for need in f.needs)) if _is_kept(e, statement)}
        for chosen in (expressions, [e for e in expressions if e not in kept]):
            try:
                return Field(assumptions, chosen)
            except Unprovable as error:
                self._causes |= dict.fromkeys((s.residual for s in statements), error.cause)
        return None

    def _kept_facts(self, statement: Statement) -> list[Need]:
        """Needs that a first integral is positive or >= 0 and that the flow preserves."""
        if statement.flow is None:
            return []
        needs = [need for need in _sorted(statement.formulas.needs) if need.kind is not ConditionKind.NONZERO]
        try:
            base = Field(self._setting.assumptions(0), [statement.residual, *(need.expression for need in needs)])
        except Unprovable:
            return []
        region = Region(base, self._setting, statement, [])
        values = {need: base.enter(need.expression) for need in needs if not region.fails_everywhere(need)}
        kept = [need for need, value in values.items() if region.keeps_sign(value, need.kind)]
        return [need for need in kept if base.tower.sign(values[need]) != PLUS]

    def _region(self, statement: Statement, sign: int, *, strict: bool) -> Region | None:
        field = self.field(statement, sign, strict=strict)
        if field is None:
            return None
        if id(field) not in self._regions:
            self._regions[id(field)] = Region(field, self._setting, statement, self.sample_points(statement))
        return self._regions[id(field)]

    def sample_points(self, statement: Statement) -> list[Point]:
        """Exact sample points in the domain, on all relations."""
        key = (statement.domain.label + statement.domain.note, str(statement.domain.points))
        if key not in self._sample_points:
            self._sample_points[key] = list(self._setting.sample_points(statement))
        return self._sample_points[key]

    # --- proofs -----------------------------------------------------------------------------------------------------

    def prove(self, statement: Statement) -> tuple[bool, tuple[Condition, ...]]:
        """(whether the residual is proven to be 0, the conditions under which that proves the statement)."""
        proven, divisors = self._identity(statement)
        sample = self._sample(statement)
        key = (statement.branch, statement.domain, statement.formulas, id(statement.flow))
        if key not in self._conditions:
            self._conditions[key] = tuple(self._conditions_of(statement))
        return proven, (*self._conditions[key], *divisors, sample)

    def _identity(self, statement: Statement) -> tuple[bool, list[Condition]]:
        """A proof in one field, or for ``all`` in one for each sign of the variable: together these are dense."""
        domain = statement.domain
        strict = bool(domain.sign)
        divisors = self._zero_in(self._region(statement, domain.sign, strict=strict), statement)
        if divisors is None and not domain.sign and not domain.note and statement.flow is None:
            halves = [self._zero_in(self._region(statement, sign, strict=True), statement) for sign in (-1, 1)]
            if halves[0] is not None and halves[1] is not None:
                divisors = [*halves[0], *halves[1]]
        if divisors is None:
            return False, []
        return True, [Condition(_DIVISORS, False, f"a divisor is {text}") for text in divisors]

    def _zero_in(self, region: Region | None, statement: Statement) -> list[str] | None:
        """The divisors that are obstacles to the proof; None without a proof."""
        if region is None:
            return None
        flow = statement.flow
        if region.vanishes(statement.residual):
            # on the relations a divisor may be 0 everywhere, though it is not elsewhere
            return list(region.divisors(forced=flow is not None and bool(self._setting.relations)))
        radical = flow is None or not flow.is_relation
        if region.is_forced(statement.residual, radical=radical):
            return list(region.divisors(forced=True))
        return None

    def _sample(self, statement: Statement) -> Condition:
        sample_points = self.sample_points(statement)
        if not sample_points:
            return Condition(_SAMPLE, False, self._why_no_sample(statement))
        if any(self.is_defined(statement, point) for point in sample_points):
            return Condition(_SAMPLE, True, "checked in ball arithmetic")
        return Condition(_SAMPLE, False, "at every sample in the domain a formula is undefined or not real")

    def _why_no_sample(self, statement: Statement) -> str:
        setting = self._setting
        if not (setting.samples and statement.domain.points):
            return "no exact state is known: give a start that is rational at the samples and moves, or states"
        if not any(all(need.is_met(sample) for need in setting.bodies) for sample in setting.samples):
            return "at every sample a principal moment exceeds the sum of the others: no body has such moments"
        region = self._region(statement, statement.domain.sign, strict=False)
        if region is not None and region.field.never_zero_on_relations():
            within = " within |gamma| = 1" if statement.flow is not None else ""
            return f"the relations exclude each other{within}: no motion lies on them"
        return _missed(statement, setting)

    def is_defined(self, statement: Statement, point: Point) -> bool:
        """Whether every formula and the residual is certainly defined and real at a point."""
        formulas = statement.formulas
        needs = formulas.needs | formulas.angle_needs if formulas.sampled is None else formulas.sampled
        key = needs, frozenset(point.items())
        if key not in self._met:
            self._met[key] = all(need.is_met(point) for need in needs)
        if not self._met[key]:
            return False
        # |u| has no derivative where u is 0
        if any(
            Need(ConditionKind.NONZERO, kink.args[0]).is_met(point) is not True
            for kink in parts_of([statement.residual])
            if isinstance(kink, sympy.sign)
        ):
            return False
        try:
            return bool(evaluate(statement.residual, point, NUMBER_BITS).is_finite())
        except Unprovable:
            return False

    def _conditions_of(self, statement: Statement) -> list[Condition]:
        domain, f = statement.domain, statement.formulas
        ends = domain.label in ("t<=0", "t>=0") and not domain.note  # 0 is an end that belongs to the domain
        everywhere = self._region(statement, domain.sign, strict=bool(domain.sign) and not ends)
        inner = self._region(statement, domain.sign, strict=True) if ends else everywhere
        if everywhere is None or inner is None:
            return [Condition(_ALGEBRA, False, self._causes[statement.residual])]
        # a function of first integrals alone is constant, continuous or not
        moving = [value for value in f.values if not _is_kept(value, statement)]
        obstacles = everywhere.obstacle(moving), inner.obstacle(f.attitude)
        continuous = bool(f.values) and not any(obstacles) and not everywhere.obstacle(f.values)
        conditions = []
        given = {need.expression for need in self._kept_facts(statement)}  # which the field takes as facts
        for need in _sorted(f.needs | f.angle_needs):
            reason = everywhere.discharge(need)
            if reason == _EVERYWHERE and need.expression in given:
                reason = KEPT
            if not reason and _is_kept(need.expression, statement) and everywhere.is_met_for_each(need):
                reason = KEPT
            if not reason and continuous:
                at_the_end = need not in f.needs and inner.discharge(need)
                reason = _AT_THE_END if at_the_end else _REMOVABLE.format(f.subject) if inner.is_removable(need) else ""
            missing = "" if reason else everywhere.assumption_for(need)
            unmet = f"{missing} is not assumed" if missing.endswith("!= 0") else "not shown"
            text = reason or everywhere.fails_everywhere(need) or unmet
            conditions.append(Condition(need.text, bool(reason), text, missing))
        texts = _CONTINUOUS.format(f.subject), _ATTITUDE
        for text, values, obstacle in zip(texts, (f.values, f.attitude), obstacles, strict=True):
            if values:
                conditions.append(Condition(text, not obstacle, obstacle or "by the rules of composition"))
        if f.pole:
            conditions.append(Condition(f.pole, continuous, "removable in gamma" if continuous else "not shown"))
        return [*conditions, *self._kept(statement, everywhere)]

    def _kept(self, statement: Statement, region: Region) -> Iterable[Condition]:
        """The side conditions are invariant: their rates are combinations of them."""
        for text, rate in statement.flow.kept if statement.flow is not None else ():
            obstacle = region.leaves(rate)
            reason = obstacle or "its rate is a combination of the conditions"
            yield Condition(f"{text} = 0 is invariant under the flow", not obstacle, reason)


def _missed(statement: Statement, setting: Setting) -> str:
    """The relation that the first sample misses, or the bounds of the variable that all points miss."""
    on_sphere = ", at a state with |gamma| = 1" if statement.flow is not None else ""
    for sample in setting.samples:
        point = {setting.variable: statement.domain.points[0], **sample}
        for zero in setting.zeros:
            if is_exactly_zero(zero, point) is False:
                parts = [f"{name} = {shown(value)}" for name, value in sample.items() if name in zero.free_symbols]
                where = f"where {', '.join(parts)}, {written(str(zero))} is not 0"
                return f"no sample lies on the relations{on_sphere}: {where}"
        if not setting.zeros and statement.domain.facts:
            points = ", ".join(map(shown, statement.domain.points))
            return f"no point tried lies where {statement.domain.label}: {setting.variable} = {points}"
    return f"no sample is proven to lie on the relations{on_sphere}"


def _is_kept(expression: sympy.Expr, statement: Statement) -> bool:
    return statement.flow is not None and statement.flow.keeps(expression)


def shortest(formula: sympy.Expr, setting: Setting, domain: Domain) -> sympy.Expr:
    """The formula as the algebra writes it, if that is shorter and proven to be equal up to removable gaps."""
    statement = Statement("", 0, "", domain, formula, "")
    try:
        field = Field(setting.assumptions(domain.sign, strict=domain.label == "t>0"), [formula])
        short = field.expression(field.enter(formula))
    except Unprovable:
        return formula
    region = Region(field, setting, statement, list(setting.sample_points(statement)))
    if sympy.count_ops(short) >= sympy.count_ops(formula) or next(region.divisors(forced=False), None) is not None:
        return formula
    return short


def _sorted(needs: Iterable[Need]) -> list[Need]:
    return sorted(needs, key=lambda need: (need.kind.value, as_text(need.expression), need.shown))
