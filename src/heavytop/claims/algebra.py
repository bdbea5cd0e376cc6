"""From an expression in the variable and the parameters to a quotient in a :class:`~heavytop.claims.rational.Tower`.

Exponentials, hyperbolic and circular functions of commensurable arguments become powers of one generator each, roots
become generators with a relation, what is left (inverse functions, logarithms) becomes a free generator.  Derivatives
are taken on the expression before.  Reduction to 0 is a proof; anything else proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from heavytop.claims.ideal import forces_zero
from heavytop.claims.rational import Quotient, Tower, Unprovable, used

_MAX_MULTIPLE = 64
_MAX_REFINEMENTS = 12
_HYPERBOLIC = (sympy.tanh, sympy.sech, sympy.sinh, sympy.cosh, sympy.coth, sympy.csch)


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What is known of the symbols.

    positive: symbols > 0.  greater: pairs (symbol, expression) with symbol > expression.
    variable: the symbol that moves.  variable_sign: its sign on the domain, 0 for both.
    relations: expressions that are 0.
    """

    variable: sympy.Symbol
    positive: tuple[sympy.Symbol, ...] = ()
    greater: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    variable_sign: int = 0
    relations: tuple[sympy.Expr, ...] = ()


class _Refine(Exception):
    """A base of exponentials has to be divided: start again."""


class Field:
    """The field that a set of expressions lives in.  Raises Unprovable for what it cannot carry."""

    def __init__(self, assumptions: Assumptions, expressions: Iterable[sympy.Expr]) -> None:
        self._assumptions = assumptions
        self._divisors: list[int] = []
        expressions = list(expressions)
        for _ in range(_MAX_REFINEMENTS):
            self._reset()
            try:
                for expression in expressions:
                    self.enter(expression)
            except _Refine:
                continue
            return
        raise Unprovable("The arguments of the exponentials have no common measure.")

    def _reset(self) -> None:
        self.tower = Tower()
        self._known: dict[Any, Quotient] = {}
        self._bases: list[tuple[str, Quotient, int]] = []
        self._expressions: dict[int, sympy.Expr] = {}
        a = self._assumptions
        for symbol in a.positive:
            self._add(symbol, constant=symbol != a.variable, sign=1)
        if a.variable not in self._known:
            self._add(a.variable, constant=False, sign=a.variable_sign)
        for symbol, bound in a.greater:
            excess = self.tower.add(f"{symbol} - ({bound})", constant=True, sign=1)
            floor = self.enter(bound)
            if floor.denominator == self.tower.one:
                index = used(self._known[symbol].numerator).pop() if symbol in self._known else self._add(symbol)
                self.tower.declare_form(index, floor.numerator + self.tower.gens[excess])

    def _add(self, meaning: sympy.Expr, *, constant: bool = True, sign: int = 0) -> int:
        index = self.tower.add(meaning, constant=constant, sign=sign)
        self._expressions[index] = meaning
        self._known[meaning] = self.tower.polynomial(self.tower.gens[index])
        return index

    def enter(self, expression: sympy.Expr) -> Quotient:
        """The expression in this field."""
        if expression not in self._known:
            self._known[expression] = self._enter(expression)
        return self._known[expression]

    def is_zero(self, expression: sympy.Expr) -> bool:
        """True only where the expression is proven to be 0 wherever it is defined on the domain."""
        try:
            numerator = self.enter(expression).numerator
            relations = [self.enter(relation).numerator for relation in self._assumptions.relations]
        except (_Refine, Unprovable):
            return False
        return not numerator or (bool(relations) and self._forced(relations, numerator))

    def _forced(self, relations: list[Any], numerator: Any) -> bool:
        """The relations and those of the roots force it to be 0, by itself or times what is positive."""
        for symbol in self._assumptions.positive:
            numerator = self.tower.times(numerator, self.enter(symbol).numerator)
        return forces_zero([*relations, *self.tower.relations()], numerator)

    def is_constant(self, value: Quotient) -> bool:
        """True where only generators that are constant in time are left."""
        return all(self.tower.generators[i].constant for i in used(value.numerator) | used(value.denominator))

    # --- expressions ------------------------------------------------------------------------------------------------

    def _enter(self, e: sympy.Expr) -> Quotient:
        tower = self.tower
        if e.is_Rational:
            return tower.number(Fraction(int(e.p), int(e.q)))
        if e.is_Symbol or e is sympy.pi:
            self._add(e, sign=1 if e is sympy.pi else 0)
            return self._known[e]
        if e.is_Add:
            return tower.sum(self.enter(part) for part in e.args)
        if e.is_Mul:
            return tower.product(self.enter(part) for part in e.args)
        if isinstance(e, sympy.exp):
            return self._exponential(self.enter(e.args[0]))
        if e.is_Pow:
            return self._power(e)
        if isinstance(e, _HYPERBOLIC):
            return self.enter(e.rewrite(sympy.exp))
        if isinstance(e, (sympy.sin, sympy.cos)):
            sine, cosine = self._circle(e.args[0])
            return sine if isinstance(e, sympy.sin) else cosine
        if isinstance(e, sympy.tan):
            return tower.divide(*self._circle(e.args[0]))
        if isinstance(e, sympy.Abs):
            return tower.absolute(self.enter(e.args[0]))
        if isinstance(e, sympy.sign):
            inside = self.enter(e.args[0])
            return tower.divide(tower.absolute(inside), inside)
        if isinstance(e, sympy.log):
            return self._logarithm(self.enter(e.args[0]))
        if e.is_Function:
            return self._opaque(e.func, [self.enter(part) for part in e.args])
        raise Unprovable(f"{type(e).__name__} has no place in the algebra.")

    def _power(self, e: sympy.Expr) -> Quotient:
        base, exponent = e.args
        if exponent.is_Integer and abs(int(exponent)) <= _MAX_MULTIPLE:
            return self.tower.power(self.enter(base), int(exponent))
        if exponent.is_Rational and exponent.q == 2 and abs(int(exponent.p)) <= _MAX_MULTIPLE:
            return self.tower.power(self.tower.root(self.enter(base)), int(exponent.p))
        raise Unprovable(f"The power {exponent} is no small multiple of 1/2.")

    def _multiple(self, kind: str, argument: Quotient, make: Callable[[Quotient, int], int]) -> tuple[int, int]:
        """(generator, n): the argument is n times the generator's base.

        make: adds the generator of a new base, which is the argument over as much as has turned out to be needed.
        """
        for position, (known_kind, base, index) in enumerate(self._bases):
            if kind == known_kind:
                ratio = self.tower.divide(argument, base)
                if not used(ratio.numerator) and ratio.denominator == self.tower.one:
                    value = ratio.numerator.leading_coefficient()
                    if value.q > 1:
                        self._divisors[position] *= int(value.q)
                        raise _Refine
                    if abs(value.p) > _MAX_MULTIPLE:
                        raise Unprovable(f"A multiple {value.p} of an argument.")
                    return index, int(value.p)
        if len(self._divisors) <= len(self._bases):
            self._divisors.append(1)
        divisor = self._divisors[len(self._bases)]
        if divisor > _MAX_MULTIPLE:
            raise Unprovable(f"A multiple {divisor} of an argument.")
        base = self.tower.product((argument, self.tower.number(Fraction(1, divisor))))
        self._bases.append((kind, base, make(base, divisor)))
        return self._bases[-1][2], divisor

    def _exponential(self, argument: Quotient) -> Quotient:
        if not argument.numerator:
            return self.tower.number(1)

        def make(base: Quotient, _divisor: int) -> int:
            meaning = sympy.exp(self.expression(base))
            index = self.tower.add(meaning, constant=self.is_constant(base), sign=1)
            self._expressions[index] = meaning
            self._declare_size(index, self.tower.sign(base))
            return index

        index, multiple = self._multiple("exp", argument, make)
        return self.tower.power(self.tower.polynomial(self.tower.gens[index]), multiple)

    def _declare_size(self, index: int, sign: int) -> None:
        """An exponential of known sign of the argument lies above or below 1."""
        if sign:
            excess = self.tower.add(f"excess over 1 of x{index}", constant=False, sign=1)
            self.tower.declare_form(index, self.tower.gens[excess] + 1)
            if sign < 0:
                self.tower.declare_below_one(index)

    def _circle(self, argument: sympy.Expr) -> tuple[Quotient, Quotient]:
        """(sin, cos) of an argument: sums by the addition theorem, multiples by powers of cos + i sin."""
        if argument.is_Add:
            sine, cosine = self.tower.number(0), self.tower.number(1)
            for part in argument.args:
                sine, cosine = self._turn((sine, cosine), self._circle(part))
            return sine, cosine
        value = self.enter(argument)
        if not value.numerator:
            return self.tower.number(0), self.tower.number(1)

        def make(base: Quotient, divisor: int) -> int:
            part = argument / divisor
            index = self._add(sympy.sin(part), constant=self.is_constant(base))
            square = 1 - self.tower.gens[index] ** 2
            self._expressions[self.tower.add_root(("cos", part), square, sign=0)] = sympy.cos(part)
            return index

        index, multiple = self._multiple("circle", value, make)
        sign = 1 if multiple > 0 else -1
        one = (
            self.tower.polynomial(self.tower.gens[index] * sign),
            self.tower.polynomial(self.tower.gens[index + 1]),
        )
        result = one
        for _ in range(abs(multiple) - 1):
            result = self._turn(result, one)
        return result

    def _turn(self, a: Sequence[Quotient], b: Sequence[Quotient]) -> tuple[Quotient, Quotient]:
        """(sin, cos) of a sum."""
        t = self.tower
        minus = t.number(-1)
        return (
            t.sum((t.product((a[0], b[1])), t.product((a[1], b[0])))),
            t.sum((t.product((a[1], b[1])), t.product((minus, a[0], b[0])))),
        )

    def _logarithm(self, inside: Quotient) -> Quotient:
        """ln of exponentials comes out as their arguments; the rest is a free generator."""
        t, rest, total = self.tower, inside, self.tower.number(0)
        for kind, base, index in self._bases:
            if kind == "exp":
                generator = t.gens[index]
                power = _multiplicity(inside.numerator, generator) - _multiplicity(inside.denominator, generator)
                total = t.sum((total, t.product((base, t.number(power)))))
                rest = t.product((rest, t.power(t.polynomial(generator), -power)))
        if rest == t.number(1):
            return total
        return t.sum((total, self._opaque(sympy.log, [rest])))

    def _opaque(self, function: Any, arguments: list[Quotient]) -> Quotient:
        """A free generator for a function of these arguments: the same arguments, the same generator."""
        key = (str(function), *(str((a.numerator, a.denominator)) for a in arguments))
        if key not in self._known:
            constant = all(self.is_constant(argument) for argument in arguments)
            index = self.tower.add(key, constant=constant)
            self._expressions[index] = function(*(self.expression(argument) for argument in arguments))
            self._known[key] = self.tower.polynomial(self.tower.gens[index])
        return self._known[key]

    # --- and back ---------------------------------------------------------------------------------------------------

    def expression(self, value: Quotient) -> sympy.Expr:
        """The quotient as an expression, in factors."""
        fraction = sympy.factor(_polynomial(value.numerator) / _polynomial(value.denominator))
        occurring = used(value.numerator) | used(value.denominator)
        return fraction.xreplace({_placeholder(index): self._meaning(index) for index in occurring})

    def _meaning(self, index: int) -> sympy.Expr:
        if index not in self._expressions:
            _, square = self.tower.generators[index].meaning
            self._expressions[index] = sympy.sqrt(self.expression(self.tower.polynomial(square)))
        return self._expressions[index]


def _placeholder(index: int) -> sympy.Symbol:
    return sympy.Symbol(f"x{index}", real=True)


def _polynomial(p: Any) -> sympy.Expr:
    """A polynomial over placeholders, so that nothing is expanded into what they stand for."""
    terms = []
    for monomial, coefficient in p.to_dict().items():
        powers = (_placeholder(index) ** int(power) for index, power in enumerate(monomial) if power)
        terms.append(sympy.Mul(sympy.Rational(int(coefficient.p), int(coefficient.q)), *powers))
    return sympy.Add(*terms)


def _multiplicity(p: Any, generator: Any) -> int:
    """How often a generator divides a polynomial."""
    count = 0
    while p:
        quotient, remainder = divmod(p, generator)
        if remainder:
            return count
        p, count = quotient, count + 1
    return count
