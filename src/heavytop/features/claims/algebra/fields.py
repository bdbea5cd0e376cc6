"""Expressions in the variable and the parameters as quotients in a
:class:`~heavytop.features.claims.algebra.rational.Tower`.

Exponentials, hyperbolic and circular functions of commensurable arguments become powers of one generator each, roots
generators with a relation, other functions (inverse functions, logarithms) free generators.  Derivatives are those of
the expressions.  Reduction to 0 is a proof; any other result proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import prod
from typing import Any

import sympy
from flint import fmpq_mpoly

from heavytop.features.claims.algebra.elliptic import FREE, JACOBI, WEIERSTRASS
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.functions import INVERSE, Refine, Transcendental
from heavytop.features.claims.algebra.rational import Tower, forces_zero
from heavytop.features.claims.algebra.ring import (
    SLOTS,
    Generator,
    Quotient,
    Unprovable,
    as_fraction,
    used,
    where_provable,
)
from heavytop.features.claims.algebra.signs import NUMBER_BITS, PLUS, UNKNOWN, Sign, sum_of
from heavytop.features.claims.algebra.structure import Defined

_MAX_EXPONENT = 64
_MAX_REFINEMENTS = 12
_SPARE = 8
"""Generators that a proof may add to a field: 3 at most in the library."""
_HYPERBOLIC = ("tanh", "sech", "sinh", "cosh", "coth", "csch")


@dataclass(frozen=True, slots=True)
class SolvedRelation:
    """A solved relation between parameters: symbol = value holds at exactly the points where ``relation`` is 0.

    radicand: of a value ±√radicand; it is > 0.
    """

    symbol: sympy.Symbol
    value: sympy.Expr
    relation: sympy.Expr
    radicand: sympy.Expr | None = None


@dataclass(frozen=True, slots=True)
class Assumptions:
    """The assumptions on the symbols.

    positive: symbols > 0.  greater: pairs (symbol, expression) with symbol > expression.
    variable: the symbol that moves.  variable_sign: its sign on the domain, 0 for both; strict: it is not 0 there.
    relations: expressions that are 0.  facts: expressions that are > 0.  nonzero: symbols that are not 0.
    ranges: closed intervals of symbols.  weak: expressions that are >= 0.  solved: symbols that are eliminated, in this
    order.  parameters: symbols that are constant along every motion.
    """

    variable: sympy.Symbol
    positive: tuple[sympy.Symbol, ...] = ()
    greater: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    variable_sign: int = 0
    relations: tuple[sympy.Expr, ...] = ()
    strict: bool = False
    facts: tuple[sympy.Expr, ...] = ()
    nonzero: tuple[sympy.Symbol, ...] = ()
    ranges: tuple[tuple[sympy.Symbol, tuple[Fraction, Fraction]], ...] = ()
    weak: tuple[sympy.Expr, ...] = ()
    solved: tuple[SolvedRelation, ...] = ()
    parameters: frozenset[sympy.Symbol] = frozenset()

    def bounds(self) -> list[sympy.Expr]:
        """Expressions that are > 0 or >= 0, without the solved symbols."""
        solved = {solution.symbol for solution in self.solved}
        bounds = [*self.facts, *self.weak, *(symbol - bound for symbol, bound in self.greater)]
        bounds += solved.intersection(self.positive)
        for solution in self.solved:
            bounds = [bound.xreplace({solution.symbol: solution.value}) for bound in bounds]
        return bounds


class Field:
    """The field of a set of expressions.  Raises Unprovable for an expression beyond the algebra."""

    def __init__(self, assumptions: Assumptions, expressions: Iterable[sympy.Expr]) -> None:
        self.assumptions = assumptions
        self._divisors: list[int] = []
        self._complete = False
        expressions = list(expressions)
        few, many = SLOTS
        try:
            self._build(expressions, few)
        except Unprovable:
            if len(self.tower.generators) <= few - _SPARE:
                raise
        if len(self.tower.generators) > few - _SPARE:
            self._complete = False
            self._build(expressions, many)

    def _build(self, expressions: list[sympy.Expr], slots: int) -> None:
        for _ in range(_MAX_REFINEMENTS):
            try:
                self._reset(slots)
                for expression in expressions:
                    self.enter(expression)
            except Refine:
                continue
            self._complete = True
            return
        raise Unprovable("The arguments of the exponentials have no common measure.")

    def _reset(self, slots: int) -> None:
        self.tower = Tower(slots)
        self._known: dict[Any, Quotient] = {}
        self._roots: dict[int, sympy.Expr] = {}
        self.transcendental = Transcendental(self, self._divisors)
        a = self.assumptions
        solved = {solution.symbol for solution in a.solved}
        self._ranges = {symbol: ends for symbol, ends in a.ranges if symbol not in solved}
        for symbol in a.positive:
            if symbol != a.variable and symbol not in solved:
                self._add(symbol, sign=PLUS)
        if a.variable not in self._known:
            self._add(a.variable, constant=False, sign=Sign(a.variable_sign, a.strict))
        for symbol in a.nonzero:
            if symbol not in solved:
                self._add(symbol, sign=Sign(0, True))
        facts = [(fact, True) for fact in (*a.facts, *(symbol for symbol in a.positive if symbol in solved))]
        for symbol, bound in a.greater:
            if solved & {symbol, *bound.free_symbols}:
                facts.append((symbol - bound, True))
            else:
                self._declare_greater(symbol, bound)
        facts += [(fact, False) for fact in a.weak]
        for fact, strict in facts:
            if not fact.free_symbols & solved:
                self.tower.declare(self.enter(fact), strict=strict)
        # the last solution contains none of the symbols that are solved before it
        for solution in reversed(a.solved):
            if solution.radicand is not None:
                self.tower.declare(self.enter(solution.radicand))
            self._known[solution.symbol] = self.enter(solution.value)
        for fact, strict in facts:
            if fact.free_symbols & solved:
                self.tower.declare(self.enter(fact), strict=strict)
        self.tower.signs.declare_largest_terms()

    def _declare_greater(self, symbol: sympy.Symbol, bound: sympy.Expr) -> None:
        """Assumes symbol = bound + excess with a generator excess > 0."""
        lower = self.enter(bound)
        index = used(self.enter(symbol).numerator).pop()
        if lower.denominator == self.tower.one and self.tower.signs.can_have_form(index, lower.numerator):
            excess = self.tower.add(Generator(f"{symbol} - ({bound})", constant=True, sign=1, strict=True))
            self.tower.signs.declare_form(index, lower.numerator + self.tower.gens[excess])
        else:
            self.tower.declare(self.enter(symbol - bound))

    def _add(self, meaning: sympy.Expr, *, constant: bool = True, sign: Sign, kind: str = "symbol") -> int:
        index = self.tower.add(Generator(meaning, constant, *sign, kind))
        self._known[meaning] = self.tower.polynomial(self.tower.gens[index])
        if meaning in self._ranges:
            self.tower.signs.ranges[index] = self._ranges[meaning]
        return index

    def enter(self, expression: sympy.Expr) -> Quotient:
        """The expression in this field; raises Unprovable for an expression beyond the algebra."""
        if expression not in self._known:
            try:
                self._known[expression] = self._enter(expression)
            except Refine:
                if not self._complete:
                    raise
                raise Unprovable("An exponential or angle must be an integer multiple of one in the claim.") from None
        return self._known[expression]

    def is_zero(self, expression: sympy.Expr) -> bool:
        """True only where the expression is proven to be 0 off the zeros of the tower's divisors."""
        return self.vanishes(expression) or self.is_forced(expression, radical=True)

    @where_provable(False)
    def vanishes(self, expression: sympy.Expr) -> bool:
        """True only where the expression reduces to 0, without the relations of the claim."""
        return not bool(self.enter(expression).numerator)

    @where_provable(False)
    def is_forced(self, expression: sympy.Expr, *, radical: bool, simpler: Callable[[Any], Any] = lambda p: p) -> bool:
        """True only where the expression is a combination of the claim's relations with factors of this field.

        radical: or where a power of it is one, which proves that it is 0, but not that the flow keeps a relation.
        simpler: a simplification of its numerator.
        """
        return self._forces([], simpler(self.enter(expression).numerator), radical=radical)

    @where_provable(False)
    def never_zero_on_relations(self, *zeros: fmpq_mpoly) -> bool:
        """True only where the relations of the claim exclude that these polynomials are 0."""
        return self._forces(list(zeros), self.tower.one, radical=False)

    def _forces(self, zeros: list[fmpq_mpoly], p: fmpq_mpoly, *, radical: bool) -> bool:
        """Whether the relations of the claim and ``zeros`` force ``p``, factors that are never 0 divided out."""
        relations = [*(self.enter(relation).numerator for relation in self.assumptions.relations), *zeros]
        if not self.assumptions.relations:
            return False
        roots = self.tower.relations()
        if forces_zero([*relations, *roots], p, radical=radical):
            return True
        # a function of the state that stays positive along one motion may be 0 on another
        names = self.assumptions.parameters.union(self.assumptions.positive)
        never_zero = [q for q in self.tower.signs.never_zero(relations) if self.symbols(q) <= names]
        if never_zero and forces_zero([*relations, *roots], p, radical=radical, never_zero=never_zero):
            return True
        # by cases: a parameter of the relations is 0, or it is not
        indices = set().union(*(used(relation) for relation in relations if self._is_of_parameters(relation)))
        return any(
            forces_zero([*relations, *roots], p, radical=radical, never_zero=[*never_zero, self.tower.gens[index]])
            and forces_zero([*self._where_zero(relations, index), *roots], p, radical=radical, never_zero=never_zero)
            for index in sorted(indices)
            if not self.tower.generators[index].strict
        )

    def symbols(self, p: fmpq_mpoly) -> set[sympy.Symbol]:
        """The symbols in the generators of a polynomial."""
        return set().union(*(self.meaning(index).free_symbols for index in used(p)))

    def _is_of_parameters(self, p: fmpq_mpoly) -> bool:
        generators = self.tower.generators
        names = self.assumptions.parameters
        return all(generators[i].kind == "symbol" and generators[i].meaning in names for i in used(p))

    def _where_zero(self, relations: list[fmpq_mpoly], index: int) -> list[fmpq_mpoly]:
        """The relations where a parameter is 0; those between parameters square-free, without factors never 0."""
        signs, zero = self.tower.signs, self.tower.context.constant(0)
        zeros = [self.tower.gens[index]]
        for relation in relations:
            if self._is_of_parameters(relation):
                constant = self.tower.by_power(relation, index).get(0, zero)
                factors = (factor for factor, _ in constant.factor()[1] if not signs.of(factor).strict)
                relation = prod(factors, start=self.tower.one) if constant else zero
            zeros.append(relation)
        return [relation for relation in zeros if relation]

    @where_provable(UNKNOWN)
    def sign(self, e: sympy.Expr) -> Sign:
        """The sign of an expression where it is defined, part by part: its expansion hides squares."""
        sign = sum_of(map(self._sign_of_product, sympy.Add.make_args(e)))
        return sign if sign.value and sign.strict else sign.also(self.tower.sign(self.enter(e)))

    def _sign_of_product(self, e: sympy.Expr) -> Sign:
        sign, powers = PLUS, [factor.as_base_exp() for factor in sympy.Mul.make_args(e)]
        for base, exponent in powers:
            if exponent.is_even:
                sign = sign.times(Sign(1, bool(exponent < 0) or self.sign(base).strict))
        rest = sympy.Mul(*(base**exponent for base, exponent in powers if not exponent.is_even))
        return sign.times(self.tower.sign(self.enter(rest)))

    def is_constant(self, value: Quotient) -> bool:
        """Whether the quotient has only generators that are constant in time."""
        return all(self.tower.generators[i].constant for i in used(value.numerator) | used(value.denominator))

    # --- expressions ------------------------------------------------------------------------------------------------

    def _enter(self, e: sympy.Expr) -> Quotient:
        tower = self.tower
        if e.is_Rational:
            return tower.number(Fraction(e))
        if e is sympy.pi:
            index = self._add(e, sign=PLUS, kind="number")
            tower.signs.numbers[index] = evaluate(e, {}, NUMBER_BITS)
            tower.signs.pi = index
            return self._known[e]
        if isinstance(e, Defined):
            return self._definition(e)
        if e.is_Symbol:
            self._add(e, sign=UNKNOWN)
            return self._known[e]
        if e.is_Add:
            return sum(map(self.enter, e.args), tower.number(0))
        if e.is_Mul:
            return prod(map(self.enter, e.args), start=tower.number(1))
        if e is sympy.E or isinstance(e, sympy.exp):
            return self.transcendental.exponential(self.enter(sympy.log(e) if e is sympy.E else e.args[0]))
        if e.is_Pow:
            return self._power(e)
        if not e.args:
            raise Unprovable(f"{e} is not a number.")
        return self._function(type(e).__name__, [self.enter(part) for part in e.args])

    def _definition(self, e: Defined) -> Quotient:
        """The meaning of a definition; where that is too large, a free generator, whose value may be any."""
        try:
            return self.enter(e.meaning)
        except Unprovable:
            self._add(e, constant=self.assumptions.variable not in e.free_symbols, sign=UNKNOWN, kind="defined")
            return self._known[e]

    def _function(self, name: str, arguments: list[Quotient]) -> Quotient:
        tower, first = self.tower, arguments[0]
        if name in _HYPERBOLIC:
            return self.transcendental.hyperbolic(name, first)
        if name in ("sin", "cos", "tan"):
            sine, cosine = self.transcendental.circle(first)
            return sine if name == "sin" else cosine if name == "cos" else sine / cosine
        if name == "Abs":
            return tower.absolute(first)
        if name == "sign":
            return tower.absolute(first) / first
        if name == "log":
            return self.transcendental.logarithm(first)
        if name in WEIERSTRASS:
            return self.transcendental.weierstrass(name, (first, arguments[1], arguments[2]))
        if name in JACOBI:
            return self.transcendental.jacobi(name, first, arguments[1])
        if name in INVERSE or name in FREE:
            return self.transcendental.function(name, tuple(arguments))
        raise Unprovable(f"The algebra does not support {name}.")

    def _power(self, e: sympy.Expr) -> Quotient:
        base, exponent = e.args
        if exponent.is_Integer and abs(int(exponent)) <= _MAX_EXPONENT:
            return self.enter(base) ** int(exponent)
        if exponent.is_Rational and exponent.q in (2, 4) and abs(int(exponent.p)) <= _MAX_EXPONENT:
            root = self.tower.root(self.enter(base))
            return (root if exponent.q == 2 else self.tower.root(root)) ** int(exponent.p)
        raise Unprovable(f"A power must be a small multiple of 1/4; got {exponent}.")

    # --- back to expressions ----------------------------------------------------------------------------------------

    def expression(self, value: Quotient) -> sympy.Expr:
        """The quotient as a product of factors."""
        fraction = sympy.Mul(*_factors(value.numerator), *(1 / factor for factor in _factors(value.denominator)))
        occurring = used(value.numerator) | used(value.denominator)
        return fraction.xreplace({_placeholder(index): self.meaning(index) for index in occurring})

    def meaning(self, index: int) -> sympy.Expr:
        """The expression of a generator."""
        g = self.tower.generators[index]
        if g.kind != "root":
            return g.meaning
        if index not in self._roots:
            self._roots[index] = sympy.sqrt(self.expression(*g.arguments))
        return self._roots[index]


def _placeholder(index: int) -> sympy.Symbol:
    return sympy.Symbol(f"x{index}", real=True)


def _factors(p: fmpq_mpoly) -> Iterator[sympy.Expr]:
    """A number and powers of primitive factors, by FLINT: SymPy may take minutes.

    The leading coefficient of a factor, in SymPy's order, is positive.
    """
    if not p:
        yield sympy.Integer(0)
        return
    number, factors = p.factor()
    number = sympy.Rational(as_fraction(number))
    for factor, power in factors:
        content, part = sympy.Poly(_polynomial(factor), domain="QQ").primitive()
        if part.LC() < 0:
            content, part = -content, -part
        number *= content ** int(power)
        yield part.as_expr() ** int(power)
    yield number


def _polynomial(p: fmpq_mpoly) -> sympy.Expr:
    """A polynomial in placeholders, which are not expanded."""
    terms = []
    for monomial, coefficient in p.to_dict().items():
        powers = (_placeholder(index) ** int(power) for index, power in enumerate(monomial) if power)
        terms.append(sympy.Mul(sympy.Rational(as_fraction(coefficient)), *powers))
    return sympy.Add(*terms)


# Whether a quotient of a field is real and continuous, or analytic, on the whole domain: by the rules of composition.


_SHOWN = 100


class Regularity:
    """The continuity of quotients of ``field``.  is_nonzero: whether a polynomial is 0 nowhere on the domain."""

    def __init__(self, field: Field, is_nonzero: Callable[[Any], bool] | None = None) -> None:
        self._field = field
        self._is_nonzero = is_nonzero or (lambda p: field.tower.signs.of(p).strict)
        self._known: dict[tuple[int, bool], str] = {}

    def obstacle(self, value: Quotient, *, analytic: bool = False) -> str:
        """The obstacle to a proof that the value is real and continuous (analytic) on the domain; "" for none."""
        _, factors = self._field.tower.signs.factors(value.denominator)
        for factor, _ in factors:
            if not self._is_nonzero(factor):
                return f"{self._text(factor)} may be 0"
        return self.obstacle_of_generators(used(value.numerator) | used(value.denominator), analytic=analytic)

    def obstacle_of_generators(self, indices: set[int], *, analytic: bool) -> str:
        """The first obstacle in these generators."""
        for index in sorted(indices):
            if (index, analytic) not in self._known:
                self._known[index, analytic] = self._obstacle_of(index, analytic)
            if self._known[index, analytic]:
                return self._known[index, analytic]
        return ""

    def _obstacle_of(self, index: int, analytic: bool) -> str:
        tower = self._field.tower
        g = tower.generators[index]
        if index in tower.signs.numbers:
            return "" if tower.signs.numbers[index].is_finite() else f"{g.meaning} is not real"
        for argument in g.arguments:
            if obstacle := self.obstacle(argument, analytic=analytic):
                return obstacle
        if g.kind == "defined":
            return f"the definition of {g.meaning} is too large for the algebra"
        if g.kind in ("wp", "wpinverse", "wzeta"):
            return f"{g.meaning} has poles"
        if g.kind in ("root", "log"):
            return self._unless_positive(g.arguments[0], analytic or g.kind == "log")
        if g.kind in ("asin", "acos"):
            return self._unless_positive(1 - g.arguments[0] * g.arguments[0], analytic)
        if g.kind == "atan2":
            y, x = g.arguments
            off_the_cut = tower.sign(x) == PLUS or self._is_nonzero(y.numerator)
            return "" if off_the_cut else f"{g.meaning} may jump"
        return ""

    def _unless_positive(self, value: Quotient, strict: bool) -> str:
        sign = self._field.tower.sign(value)
        if sign.value > 0 and (sign.strict or not strict):
            return ""
        return f"{self._text(value.numerator, value.denominator)} {'>' if strict else '≥'} 0 is not shown"

    @where_provable("an intermediate value")
    def _text(self, numerator: fmpq_mpoly, denominator: Any = None) -> str:
        tower = self._field.tower
        quotient = Quotient(numerator, tower.one if denominator is None else denominator, tower)
        text = str(self._field.expression(quotient))
        return text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"
