"""A first integral or an invariant relation claimed in a file as statements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy

from heavytop.claims.algebra import Assumptions, Field
from heavytop.claims.conditions import Need
from heavytop.claims.expression import Formula, parse
from heavytop.claims.from_file import ClaimFile, IntegralTable
from heavytop.claims.judge import Finding, Row, judge, verdict_of
from heavytop.claims.signs import Unprovable
from heavytop.claims.statement import ALL, Flow, Formulas, Setting, Statement
from heavytop.claims.structure import Names
from heavytop.claims.user_claim import STATE, TIME, Ground, lay_ground, needs_of, setting_of
from heavytop.precision import exact
from heavytop.top.equations import GYROSTAT, System

Rate = Callable[[sympy.Expr], sympy.Expr]


@dataclass(frozen=True)
class UserIntegral:
    """A first integral or an invariant relation claimed in a file."""

    content: ClaimFile
    ground: Ground = field(init=False)
    value: Formula = field(init=False)
    where: tuple[Formula, ...] = field(init=False)

    def __post_init__(self) -> None:
        ground = lay_ground(self.content, STATE)
        table = self._table
        object.__setattr__(self, "ground", ground)
        object.__setattr__(self, "value", parse(table.value, ground.names, "integral.value"))
        where = tuple(parse(text, ground.names, "integral.where") for text in table.where)
        object.__setattr__(self, "where", where)

    @property
    def _table(self) -> IntegralTable:
        assert self.content.integral is not None
        return self.content.integral

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.content.name

    @property
    def source(self) -> str:
        """As the file has it."""
        return self.content.source

    @property
    def kind(self) -> str:
        """integral or relation."""
        return self.content.kind

    @property
    def setting(self) -> Setting:
        """The file's assumptions; the samples are its parameters at each of its states."""
        base = setting_of(self.ground, TIME)
        states = [dict(zip(STATE, map(exact, values), strict=True)) for values in self._table.states]
        samples = tuple({**sample, **state} for sample in self.ground.samples for state in states)
        conditions = [formula.expression for formula in self.where]
        if self.kind == "relation":
            conditions.append(self.value.expression)
        return replace(base, samples=samples, relations=(*self.ground.relations, *conditions))

    def statements(self, system: System) -> list[Statement]:
        """dF/dt = 0 along the field of ``system``, on the conditions."""
        rates = system.field(self.ground.parameters(system), STATE)

        def rate(value: sympy.Expr) -> sympy.Expr:
            return sum((sympy.diff(value, x) * dx for x, dx in zip(STATE, rates, strict=True)), sympy.Integer(0))

        kept = tuple((str(formula.expression), rate(formula.expression)) for formula in self.where)
        needs = needs_of([self.value, *self.where]) | self.ground.needs
        if system is GYROSTAT:
            needs |= self.ground.rotor_needs
        text = "dF/dt = 0 along the motion"
        if self.kind == "relation":
            text += ", where F = 0"
        if self.where:
            text += ", where the conditions hold"
        value, named, names = self._with_names(rate, needs)
        flow = Flow(rate, frozenset((*STATE, *names)), kept, self.kind == "relation")
        values = (value, *(formula.expression for formula in self.where))
        domain = replace(ALL, points=(Fraction(0),))
        formulas = Formulas(values, named, sampled=needs)
        return [Statement("dF/dt", 1, "smooth", domain, rate(value), text, formulas, flow)]

    def _with_names(self, rate: Rate, needs: frozenset[Need]) -> tuple[sympy.Expr, frozenset[Need], list[sympy.Symbol]]:
        """(F, its needs, symbols): first integrals in F have got symbols, where nothing else of the state is left."""
        value = self.value.expression
        if self.kind == "relation":
            return value, needs, []
        assumptions = self.setting.assumptions(0)
        state = frozenset(STATE)
        names = Names(state, lambda e: _is_constant(rate(e), assumptions))
        named = names.put_into(value)
        if named.free_symbols & state:
            return value, needs, []
        renamed = frozenset(Need(need.kind, names.put_into(need.expression), need.text) for need in needs)
        return named, renamed, names.symbols

    def explain(self, about: System, rows: Sequence[Row]) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems that keep it, by proof."""
        found = {s.name: rows if s is about else judge(self.statements(s), self.setting) for s in self.ground.systems}
        return [], tuple(name for name, rows in found.items() if verdict_of(rows) == "holds")


def _is_constant(rate: sympy.Expr, assumptions: Assumptions) -> bool:
    """Whether a rate is proven to be 0 by an algebra that divides by nothing that may be 0."""
    try:
        field = Field(assumptions, [rate])
    except Unprovable:
        return False
    return field.is_zero(rate) and all(field.tower.signs.of(p).strict for p in field.tower.divisors.values())
