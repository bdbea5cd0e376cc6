"""A first integral or an invariant relation claimed in a file as statements."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy

from heavytop.claims.expression import Formula, parse
from heavytop.claims.from_file import ClaimFile, IntegralTable
from heavytop.claims.judge import Finding, judge, verdict_of
from heavytop.claims.statement import ALL, Flow, Formulas, Setting, Statement
from heavytop.claims.statements import SYSTEMS
from heavytop.claims.user_claim import STATE, TIME, Ground, lay_ground, needs_of, setting_of
from heavytop.precision import exact
from heavytop.top.equations import GYROSTAT, System


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
        flow = Flow(rate, frozenset(STATE), kept, self.kind == "relation")
        needs = needs_of([self.value, *self.where]) | self.ground.needs
        if system is GYROSTAT:
            needs |= self.ground.rotor_needs
        values = (self.value.expression, *(formula.expression for formula in self.where))
        text = "dF/dt = 0 along the motion"
        if self.kind == "relation":
            text += ", where F = 0"
        if self.where:
            text += ", where the conditions hold"
        domain = replace(ALL, points=(Fraction(0),))
        residual = rate(self.value.expression)
        return [Statement("dF/dt", 1, "smooth", domain, residual, text, Formulas(values, needs), flow)]

    def explain(self) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems that conserve it, by proof."""
        systems = [system for system in SYSTEMS if system is not GYROSTAT or self.ground.rotor is not None]
        proven = [s.name for s in systems if verdict_of(judge(self.statements(s), self.setting)) == "holds"]
        return [], tuple(proven)
