"""A first integral or an invariant relation claimed in a file as statements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import islice

import sympy

from heavytop.claims.algebra import Assumptions, Field
from heavytop.claims.claim_file import IntegralTable
from heavytop.claims.conditions import Need, is_exactly_zero
from heavytop.claims.context import STATE, TIME, Context, FileClaim, needs_of, sample_number, setting_of
from heavytop.claims.defined import rate_along
from heavytop.claims.evaluate import evaluate
from heavytop.claims.expression import Formula, parse
from heavytop.claims.judge import Finding, Row, judge, verdict_of
from heavytop.claims.real_zeros import all_over, conditions_for_zero, on_conditions
from heavytop.claims.sample_search import states_on
from heavytop.claims.sign import Unprovable
from heavytop.claims.statement import ALL, Flow, Formulas, Place, Setting, Statement
from heavytop.claims.structure import Names
from heavytop.errors import InputError
from heavytop.precision import shown
from heavytop.top.equations import GYROSTAT, System

Rate = Callable[[sympy.Expr], sympy.Expr]
_STATES = (("1/2", "-2/3", "3/4", "2/3", "-1/3", "2/3"), ("1", "2", "-1", "3/5", "0", "4/5"))
# states of our own, where a file gives none
_ENOUGH = 3
_BITS = 192
# 0 at every state of a body: |γ|² - 1
_OFF_SPHERE = sum(x**2 for x in STATE[3:]) - 1


@dataclass(frozen=True)
class UserIntegral(FileClaim):
    """A first integral or an invariant relation claimed in a file."""

    value: Formula = field(init=False)
    where: tuple[Formula, ...] = field(init=False)

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """Ω and γ."""
        return tuple(STATE)

    def __post_init__(self) -> None:
        FileClaim.__post_init__(self)
        table = self._table
        object.__setattr__(self, "value", parse(table.value, self.context.names, "integral.value"))
        where = tuple(parse(text, self.context.names, "integral.where") for text in table.where)
        object.__setattr__(self, "where", where)
        _check_states(table)
        object.__setattr__(self, "context", self._with_constant_rotor())

    def _with_constant_rotor(self) -> Context:
        """The context; raises InputError unless the rotor is constant along the motion of the gyrostat."""
        rotor = self.context.rotor
        if rotor is None or not rotor.free_symbols & frozenset(STATE):
            return self.context
        change = self._rate(GYROSTAT)(rotor)
        try:
            is_constant = Field(setting_of(self.context, TIME).assumptions(0), [change]).vanishes(change)
        except Unprovable:
            is_constant = False
        return self.context.with_rotor(rotor, is_constant)

    @property
    def _table(self) -> IntegralTable:
        assert self.content.integral is not None
        return self.content.integral

    @cached_property
    def setting(self) -> Setting:
        """The file's assumptions; the samples are its parameters at each of the states."""
        base = setting_of(self.context, TIME)
        conditions = [part for formula in self._zero for part in conditions_for_zero(formula.expression)]
        samples = tuple({**row, **state} for row in self.context.samples for state in self._states(conditions, row))
        relations = (*base.relations, *conditions)
        return replace(base, samples=samples, relations=(*relations, _OFF_SPHERE) if relations else ())

    @property
    def _zero(self) -> tuple[Formula, ...]:
        """What is 0 where the claim is made."""
        return (*self.where, self.value) if self.kind == "relation" else self.where

    def _states(self, conditions: Sequence[sympy.Expr], parameters: Mapping[sympy.Symbol, Fraction]) -> list[Place]:
        """The states of the file; without them states of our own, on the conditions where such are found."""
        given = _numbers(self._table.states or _STATES)
        if self._table.states is not None:
            return given
        needs = needs_of([self.value, *self.where])

        def serves(state: Place) -> bool:
            place = {**parameters, **state}
            return all(is_exactly_zero(c, place) for c in conditions) and all(need.is_met(place) for need in needs)

        if any(serves(state) for state in given):
            return given
        found = [*islice(filter(serves, states_on([*conditions, _OFF_SPHERE], STATE, parameters)), _ENOUGH)]
        return found or given

    def statements(self, system: System) -> list[Statement]:
        """dF/dt = 0 along the field of ``system``, on the conditions."""
        rate = self._rate(system)
        needs = needs_of([self.value, *self.where]) | self.context.needs
        if system is GYROSTAT:
            needs |= self.context.rotor_needs
        text = "dF/dt = 0 along the motion"
        if self.kind == "relation":
            text += ", where F = 0"
        if self.where:
            text += ", where the conditions hold"
        value, named, names = self._with_names(rate, needs)
        is_relation = self.kind == "relation"
        flow = Flow(rate, frozenset((*STATE, *names)), self._kept(rate), is_relation, (_OFF_SPHERE,), names)
        # a condition in simpler words is the same set
        where = tuple(part for formula in self.where for part in conditions_for_zero(formula.expression))
        rotor = (self.context.rotor,) if system is GYROSTAT and self.context.rotor is not None else ()
        values = (*self._parts(value), *where, *rotor)
        domain = replace(ALL, points=(Fraction(0),))
        formulas = Formulas(values, named, sampled=needs)
        return [
            Statement("dF/dt", component, "smooth", domain, self._on_relations(rate(part)), text, formulas, flow)
            for component, part in enumerate(self._parts(value), 1)
        ]

    def _rate(self, system: System) -> Rate:
        """The derivative along the field of ``system``."""
        rates = system.rates(self.context.parameters(system), STATE)
        return rate_along(dict(zip(STATE, rates, strict=True)))

    def _parts(self, value: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """What has to be constant: F; or the parts of a relation that is no polynomial, as |L| has no rate at 0."""
        if self.kind != "relation" or value.is_polynomial(*STATE):
            return (value,)
        return conditions_for_zero(value) or (value,)

    def _kept(self, rate: Rate) -> tuple[tuple[str, sympy.Expr], ...]:
        """The side conditions with their rates; a relation has none of its own where it is as simple as can be."""
        simpler = {formula: conditions_for_zero(formula.expression) for formula in self._zero}
        return tuple(
            (str(formula.expression if len(parts) == 1 else part), self._on_relations(rate(part)))
            for formula, parts in simpler.items()
            for part in parts
            if formula in self.where or parts != (self.value.expression,)
        )

    def _on_relations(self, rate: sympy.Expr) -> sympy.Expr:
        return on_conditions(rate, (*self.setting.relations, _OFF_SPHERE))

    def _with_names(
        self, rate: Rate, needs: frozenset[Need]
    ) -> tuple[sympy.Expr, frozenset[Need], dict[sympy.Symbol, sympy.Expr]]:
        """(F, its needs, symbols): first integrals in F have got symbols, where nothing else of the state is left.

        F is written as it is where |γ| = 1.
        """
        if self.kind == "relation":
            return self.value.expression, needs, {}
        value = all_over(self.value.expression, [_OFF_SPHERE])
        assumptions = self.setting.assumptions(0)
        state = frozenset(STATE)
        names = Names(state, lambda e: _is_constant(rate(e), assumptions, self.setting.samples))
        named = names.put_into(value)
        if named.free_symbols & state:
            return value, needs, {}
        renamed = frozenset(
            Need(need.kind, names.put_into(all_over(need.expression, [_OFF_SPHERE])), need.text) for need in needs
        )
        return named, renamed, names.meanings

    def explain(self, about: System, rows: Sequence[Row]) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems that keep it, by proof."""
        found = {s.name: rows if s is about else judge(self.statements(s), self.setting) for s in self.context.systems}
        return [], tuple(name for name, rows in found.items() if verdict_of(rows) == "holds")


def _numbers(states: Sequence[Sequence[str]]) -> list[Place]:
    """The states of a file, exactly."""
    return [
        {symbol: sample_number(text, f"states: {symbol}") for symbol, text in zip(STATE, values, strict=True)}
        for values in states
    ]


def _check_states(table: IntegralTable) -> None:
    """Raises InputError for a state that no body has: off |γ| = 1."""
    for index, state in enumerate(_numbers(table.states or ()), 1):
        size = sum((state[symbol] ** 2 for symbol in STATE[3:]), Fraction(0))
        if size != 1:
            raise InputError(
                f"State {index} of [integral] has |gamma|^2 = {shown(size)}, not 1: gamma is a unit vector.",
                "Give rational components such as 3/5, 0, 4/5 or 2/3, -1/3, 2/3.",
            )


def _is_constant(
    rate: sympy.Expr, assumptions: Assumptions, samples: Sequence[Mapping[sympy.Symbol, Fraction]]
) -> bool:
    """Whether a rate is proven to be 0 by an algebra that divides by nothing that may be 0."""
    try:
        # what is not 0 at a sample need not be taken into the algebra
        balls = [evaluate(rate, {TIME: Fraction(0), **sample}, _BITS) for sample in samples[:1]]
        if any(ball.is_finite() and not ball.contains(0) for ball in balls):
            return False
        field = Field(assumptions, [rate])
    except Unprovable:
        return False
    return field.is_zero(rate) and all(field.tower.signs.of(p).strict for p in field.tower.divisors.values())
