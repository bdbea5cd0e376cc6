"""The statements of a claim, and their setting: assumptions and samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy

from heavytop.features.claims.algebra.conditions import ConditionKind, Need, is_exactly_zero
from heavytop.features.claims.algebra.fields import Assumptions, SolvedRelation

TIME = sympy.Symbol("t", real=True)
Point = dict[sympy.Symbol, Fraction]


@dataclass(frozen=True, slots=True)
class Domain:
    """The domain of a statement.

    label: ``all``, ``t<=0`` or ``t>0``.  sign: the sign of the variable there, 0 for both.
    points: exact values of the variable for witnesses.  note: the meaning of the label, if not time.
    facts: expressions that are > 0 on the domain by its definition.
    """

    label: str
    sign: int
    points: tuple[Fraction, ...]
    note: str = ""
    facts: tuple[sympy.Expr, ...] = ()


# the last are beyond a quarter of a period, on another branch of inverse functions
_BEFORE = (Fraction(-1, 2), Fraction(-7, 5), Fraction(-1, 9), Fraction(-17, 3))
_AFTER = (Fraction(1, 2), Fraction(7, 5), Fraction(1, 9), Fraction(9, 2))
ALL = Domain("all", 0, (*_BEFORE[:2], *_AFTER[:2], _AFTER[3], _BEFORE[3]))
BEFORE = Domain("t<=0", -1, _BEFORE)
AFTER = Domain("t>0", 1, _AFTER)


@dataclass(frozen=True, slots=True)
class Formulas:
    """The formulas that a statement rests on.

    values: must be real and continuous on the whole domain.  needs: of these.
    attitude: functions of the angles that must be continuous inside the domain.  angle_needs: of the angles.
    pole: the condition under which the angles are defined, where they are not on the whole domain.
    sampled: the needs at a sample; None for all, where these have no symbols for first integrals.
    subject: the values in words.
    """

    values: tuple[sympy.Expr, ...] = ()
    needs: frozenset[Need] = frozenset()
    attitude: tuple[sympy.Expr, ...] = ()
    angle_needs: frozenset[Need] = frozenset()
    pole: str = ""
    sampled: frozenset[Need] | None = None
    subject: str = "the formulas"


@dataclass(frozen=True, slots=True)
class Flow:
    """The flow under which a first integral or relation is claimed to be invariant.

    rate: the derivative along it.  kept: the relations that have to be invariant, with their texts.
    state: the variables.  is_relation: whether the statement is that a relation stays 0.
    always: expressions that are 0 at every state of a body, and so at a witness: |γ|² - 1.
    names: symbols in ``state`` that stand for a first integral, with its formula.
    """

    rate: Callable[[sympy.Expr], sympy.Expr]
    state: frozenset[sympy.Symbol]
    kept: tuple[tuple[str, sympy.Expr], ...] = ()
    is_relation: bool = False
    always: tuple[sympy.Expr, ...] = ()
    names: Mapping[sympy.Symbol, sympy.Expr] = field(default_factory=dict, hash=False)

    def keeps(self, e: sympy.Expr) -> bool:
        """Whether the variables in it are names of first integrals, at least one."""
        variables = e.free_symbols & self.state
        return bool(variables) and variables <= self.names.keys()


@dataclass(frozen=True, slots=True)
class Statement:
    """The statement that ``residual`` is 0: one component of an equation on one branch and domain.

    text: the equation.  formulas: that it rests on.  flow: of a first integral.
    """

    equation: str
    component: int
    branch: str
    domain: Domain
    residual: sympy.Expr
    text: str
    formulas: Formulas = Formulas()
    flow: Flow | None = None


@dataclass(frozen=True, slots=True)
class Setting(Assumptions):
    """The setting of a claim's statements: its assumptions, and samples for witnesses.

    samples: exact parameter sets.  parts: named expressions that a residual may be a multiple of, such as γ3.
    constants: named constant factors of such a multiple, such as k/2.
    bodies: needs of the parameters for a body with the moments of the claim to exist.
    solutions: of relations that can be solved; ``solved`` has those used in place of their relations.
    """

    samples: tuple[Mapping[sympy.Symbol, Fraction], ...] = ()
    parts: Mapping[str, tuple[tuple[str, sympy.Expr], ...]] = field(default_factory=dict)
    constants: tuple[tuple[str, sympy.Expr], ...] = ()
    bodies: tuple[Need, ...] = ()
    solutions: tuple[SolvedRelation, ...] = ()

    def with_solutions(self) -> Setting:
        """The setting with the solutions in place of their relations."""
        solved = {solution.relation for solution in self.solutions}
        relations = tuple(relation for relation in self.relations if relation not in solved)
        return replace(self, relations=relations, solutions=(), solved=self.solutions)

    def assumptions(
        self,
        sign: int,
        *,
        strict: bool = False,
        facts: tuple[sympy.Expr, ...] = (),
        weak: tuple[sympy.Expr, ...] = (),
    ) -> Assumptions:
        """The assumptions on a domain where the variable has this sign (strict: and is not 0)."""
        facts, weak = (*self.facts, *facts), (*self.weak, *weak)
        return replace(self, variable_sign=sign, strict=strict, facts=facts, weak=weak)

    @property
    def zeros(self) -> tuple[sympy.Expr, ...]:
        """Expressions that are 0 wherever the claim is made."""
        return (*self.relations, *(solution.symbol - solution.value for solution in self.solved))

    def sample_points(self, statement: Statement) -> Iterator[Point]:
        """Exact parameters of bodies, and points of the domain of ``statement``, that lie on all relations, proven."""
        for sample in self.samples:
            if not all(need.is_met(sample) for need in self.bodies):
                continue
            for point in statement.domain.points:
                sample_point = {self.variable: point, **sample}
                if not all(Need(ConditionKind.POSITIVE, fact).is_met(sample_point) for fact in statement.domain.facts):
                    continue
                if all(is_exactly_zero(relation, sample_point) for relation in self.zeros):
                    yield sample_point
