"""Statements of one claim, proven or not: their fields are shared, and every condition of a proof is listed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import sympy

from heavytop.claims.algebra import Field
from heavytop.claims.conditions import Kind, Need, is_exactly_zero, written
from heavytop.claims.evaluate import evaluate
from heavytop.claims.proof import KEPT, Condition, Region
from heavytop.claims.sign import NUMBER_BITS, PLUS, Unprovable
from heavytop.claims.statement import Domain, Place, Setting, Statement
from heavytop.precision import shown

_CONTINUOUS = "the formulas are real and continuous all over the domain"
_ATTITUDE = "the attitude of the angles is continuous inside the domain"
_SAMPLE = "every formula is defined and real at a sample in the domain"
_DIVISORS = "the algebra divides by nothing that is 0"
_ALGEBRA = "the algebra can carry the formulas"
_REMOVABLE = "removable: the formulas are continuous across it"
_AT_THE_END = "proven inside the domain, removable in gamma at its end"
Key = tuple[int | bool | str, ...]


class Prover:
    """The statements of a claim with the fields in which they are proven."""

    def __init__(self, statements: Sequence[Statement], setting: Setting) -> None:
        self._statements = statements
        self._setting = setting
        self._fields: dict[Key, Field | None] = {}
        self._regions: dict[int, Region] = {}
        self._conditions: dict[object, tuple[Condition, ...]] = {}
        self._places: dict[tuple[str, str], list[Place]] = {}

    # --- fields -----------------------------------------------------------------------------------------------------

    def field(self, statement: Statement, sign: int, *, strict: bool = False) -> Field | None:
        """The field for this statement with this sign of the variable; None where the algebra cannot carry it."""
        key: Key = (sign, strict, statement.branch, statement.domain.label + statement.domain.note)
        if key not in self._fields:
            alike = [
                other
                for other in self._statements
                if (other.branch, other.domain) == (statement.branch, statement.domain)
            ]
            parts = [part for _, part in self._setting.parts.get(statement.branch, ())]
            self._fields[key] = self._make(alike, sign, strict, parts)
        if self._fields[key] is None:
            alone: Key = (*key, _text(statement.residual))
            if alone not in self._fields:
                self._fields[alone] = self._make([statement], sign, strict, [])
            return self._fields[alone]
        return self._fields[key]

    def _make(
        self, statements: Sequence[Statement], sign: int, strict: bool, parts: Iterable[sympy.Expr]
    ) -> Field | None:
        needs = self._kept_facts(statements[0])
        facts = (*statements[0].domain.facts, *(need.expression for need in needs if need.kind is Kind.POSITIVE))
        weak = tuple(need.expression for need in needs if need.kind is Kind.NONNEGATIVE)
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
            except Unprovable:
                continue
        return None

    def _kept_facts(self, statement: Statement) -> list[Need]:
        """Of a first integral: what has to be positive or 0 for it to be real, and stays so under the flow."""
        if statement.flow is None:
            return []
        needs = [need for need in _sorted(statement.formulas.needs) if need.kind is not Kind.NONZERO]
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
            self._regions[id(field)] = Region(field, self._setting, statement, self.places(statement))
        return self._regions[id(field)]

    def places(self, statement: Statement) -> list[Place]:
        """Exact places in the domain, on all relations."""
        key = (statement.domain.label + statement.domain.note, str(statement.domain.points))
        if key not in self._places:
            self._places[key] = list(self._setting.places(statement))
        return self._places[key]

    # --- proofs -----------------------------------------------------------------------------------------------------

    def prove(self, statement: Statement) -> tuple[bool, tuple[Condition, ...]]:
        """(whether the residual is proven to be 0, the conditions under which that proves the statement)."""
        proven, divisors = self._identity(statement)
        sample = self._sample(statement)
        return proven, (*self._conditions_of(statement), *divisors, sample)

    def _identity(self, statement: Statement) -> tuple[bool, list[Condition]]:
        """By one field, or for ``all`` by one for either sign of the variable: together they are dense in it."""
        domain = statement.domain
        strict = bool(domain.sign)
        divisors = self._zero_in(self._region(statement, domain.sign, strict=strict), statement)
        if divisors is None and not domain.sign and not domain.note and statement.flow is None:
            halves = [self._zero_in(self._region(statement, sign, strict=True), statement) for sign in (-1, 1)]
            if halves[0] is not None and halves[1] is not None:
                divisors = [*halves[0], *halves[1]]
        if divisors is None:
            return False, []
        return True, [Condition(_DIVISORS, False, f"it divides by {text}") for text in divisors]

    def _zero_in(self, region: Region | None, statement: Statement) -> list[str] | None:
        """The divisors that stand against the proof; None where there is no proof."""
        if region is None:
            return None
        flow = statement.flow
        if region.vanishes(statement.residual) or (
            flow is not None and any(region.field.vanishes_on(statement.residual, zero) for zero in flow.always)
        ):
            # where the relations are 0 a divisor may be so too, however thin the set of its zeros is elsewhere
            return list(region.divisors(forced=flow is not None and bool(self._setting.relations)))
        radical = flow is None or not flow.is_relation
        if region.is_forced(statement.residual, radical=radical):
            return list(region.divisors(forced=True))
        return None

    def _sample(self, statement: Statement) -> Condition:
        places = self.places(statement)
        if not places:
            return Condition(_SAMPLE, False, self._why_no_place(statement))
        if any(self.is_defined(statement, place) for place in places):
            return Condition(_SAMPLE, True, "checked in balls")
        return Condition(_SAMPLE, False, "at no sample in the domain is every formula defined and real")

    def _why_no_place(self, statement: Statement) -> str:
        setting = self._setting
        if not any(all(need.is_met(sample) for need in setting.bodies) for sample in setting.samples):
            return "at no sample is each principal moment at most the sum of the others: no body has such moments"
        region = self._region(statement, statement.domain.sign, strict=False)
        if region is not None and region.field.relations_exclude_each_other():
            within = " within |gamma| = 1" if statement.flow is not None else ""
            return f"the relations exclude each other{within}: no motion lies on them"
        return _missed(statement, setting)

    def is_defined(self, statement: Statement, place: Place) -> bool:
        """Whether every formula and the residual is certainly defined and real at a place."""
        formulas = statement.formulas
        if not all(need.is_met(place) for need in formulas.sampled or formulas.needs | formulas.angle_needs):
            return False
        # a derivative of |u| is none where u is 0
        if any(
            Need(Kind.NONZERO, kink.args[0]).is_met(place) is not True for kink in statement.residual.atoms(sympy.sign)
        ):
            return False
        try:
            return bool(evaluate(statement.residual, place, NUMBER_BITS).is_finite())
        except Unprovable:
            return False

    def _conditions_of(self, statement: Statement) -> tuple[Condition, ...]:
        key = (statement.branch, statement.domain, statement.formulas, id(statement.flow))
        if key not in self._conditions:
            self._conditions[key] = tuple(self._make_conditions(statement))
        return self._conditions[key]

    def _make_conditions(self, statement: Statement) -> list[Condition]:
        domain, f = statement.domain, statement.formulas
        ends = domain.holds_its_end
        whole = self._region(statement, domain.sign, strict=bool(domain.sign) and not ends)
        inner = self._region(statement, domain.sign, strict=True) if ends else whole
        if whole is None or inner is None:
            return [Condition(_ALGEBRA, False, "the formulas are too large, or hold what it does not know")]
        # a function of first integrals alone is as constant as they are, continuous or not
        moving = [value for value in f.values if not _is_kept(value, statement)]
        against = whole.obstacle(moving), inner.obstacle(f.attitude)
        continuous = bool(f.values) and not any(against) and not whole.obstacle(f.values)
        found = {
            need: whole.discharge(need) or (KEPT if _is_kept(need.expression, statement) else "")
            for need in _sorted(f.needs | f.angle_needs)
        }
        for need, how in found.items():
            if not how and need not in f.needs and inner.discharge(need) and continuous:
                found[need] = _AT_THE_END
            elif not how and continuous and inner.is_removable(need):
                found[need] = _REMOVABLE
        conditions = [
            Condition(need.text, bool(how), how or whole.fails_everywhere(need) or "not shown", self._bound(need))
            for need, how in found.items()
        ]
        for text, values, obstacle in ((_CONTINUOUS, f.values, against[0]), (_ATTITUDE, f.attitude, against[1])):
            if values:
                conditions.append(Condition(text, not obstacle, obstacle or "by the rules of composition"))
        if f.pole:
            conditions.append(Condition(f.pole, continuous, "removable in gamma" if continuous else "not shown"))
        return [*conditions, *self._kept(statement, whole)]

    def _bound(self, need: Need) -> str:
        """The formula that has to be > 0 for the condition, where it is one of the parameters alone; "" for others."""
        names = {str(symbol) for symbol in need.expression.free_symbols}
        moving = {str(self._setting.variable), *(f"{name}{axis}" for name in ("Omega", "gamma") for axis in (1, 2, 3))}
        return written(str(need.expression)) if names and not names & moving else ""

    def _kept(self, statement: Statement, region: Region) -> Iterable[Condition]:
        """The side conditions are invariant: their rates are combinations of them."""
        for text, rate in statement.flow.kept if statement.flow is not None else ():
            against = region.leaves(rate)
            reason = against or "its rate is a combination of the conditions"
            yield Condition(f"{text} = 0 is kept by the flow", not against, reason)


def _missed(statement: Statement, setting: Setting) -> str:
    """Which relation the first sample of a body misses, or bounds of the variable all points; for whom wrote them."""
    on_sphere = ", at a state with |gamma| = 1" if statement.flow is not None else ""
    for sample in setting.samples:
        place = {setting.variable: statement.domain.points[0], **sample}
        for zero in setting.zeros:
            if is_exactly_zero(zero, place) is False:
                used = ", ".join(
                    f"{name} = {shown(value)}" for name, value in sample.items() if name in zero.free_symbols
                )
                where = f"where {used}, {written(str(zero))} is not 0"
                return f"no sample lies on the relations{on_sphere}: {where}"
        if not setting.zeros and statement.domain.facts:
            points = ", ".join(map(str, statement.domain.points))
            return f"no point tried lies where {statement.domain.label}: {setting.variable} = {points}"
    return f"no sample is proven to lie on the relations{on_sphere}"


def _is_kept(expression: sympy.Expr, statement: Statement) -> bool:
    return statement.flow is not None and statement.flow.keeps(expression)


def shortest(formula: sympy.Expr, setting: Setting, domain: Domain) -> sympy.Expr:
    """The formula as the algebra writes it, if that is shorter and proven to be equal, but for removable gaps."""
    statement = Statement("", 0, "", domain, formula, "")
    try:
        field = Field(setting.assumptions(domain.sign, strict=domain.label == "t>0"), [formula])
        short = field.expression(field.enter(formula))
    except Unprovable:
        return formula
    region = Region(field, setting, statement, list(setting.places(statement)))
    if sympy.count_ops(short) >= sympy.count_ops(formula) or next(region.divisors(forced=False), None) is not None:
        return formula
    return short


def _sorted(needs: Iterable[Need]) -> list[Need]:
    return sorted(needs, key=lambda need: (need.kind.value, _text(need.expression)))


@lru_cache(maxsize=10_000)
def _text(expression: sympy.Expr) -> str:
    """As SymPy writes it, which takes it a millisecond."""
    return str(expression)
