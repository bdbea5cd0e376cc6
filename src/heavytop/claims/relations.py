"""Relations between the parameters of a claim, solved for a parameter: a³ = 1 is a = 1, a² + b² = 1 is b = √(1 − a²).

A relation is solved only where the solution holds at exactly the same real points: factors that the assumptions keep
from 0 are left out, what is linear in a parameter is divided by a coefficient that is never 0, and a root takes the
sign that the parameter is known to have.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Any

import sympy

from heavytop.claims.algebra import Assumptions, Field, Solution
from heavytop.claims.sign import Unprovable, used

_MAX_DEGREE = 12


def solve_relations(
    relations: Collection[sympy.Expr], known: Assumptions, parameters: Collection[sympy.Symbol]
) -> tuple[Solution, ...]:
    """Solutions of those relations that can be solved for one of the ``parameters``, each using those before it."""
    solutions: list[Solution] = []
    for relation in relations:
        if relation.free_symbols <= set(parameters):
            try:
                found = _solve(relation, replace(known, solved=tuple(solutions)), parameters)
            except Unprovable:
                continue
            if found is not None:
                solutions.append(found)
    return tuple(solutions)


def _solve(relation: sympy.Expr, known: Assumptions, parameters: Collection[sympy.Symbol]) -> Solution | None:
    field = Field(known, [relation])
    factors = _factors_with_zeros(field, field.enter(relation).numerator)
    if len(factors) != 1:
        return None
    solutions = list(_solutions(field, factors[0], relation, parameters))
    # what needs no root first, and of these the shortest
    return min(solutions, key=lambda s: (s.radicand is not None, sympy.count_ops(s.value)), default=None)


def _factors_with_zeros(field: Field, p: Any) -> list[Any]:
    """The factors of ``p`` that may be 0, but for those that are 0 at points where another is."""
    signs = field.tower.signs
    factors = [factor for factor, _ in signs.factors(p)[1] if not signs.of(factor).strict]
    isolated = [factor for factor in factors if _is_zero_at_origin_alone(factor)]
    others = [factor for factor in factors if factor not in isolated]
    # a factor that is 0 at the origin alone adds nothing to one that is 0 there
    return [*others, *(factor for factor in isolated if not any(_is_zero_there(other, factor) for other in others))]


def _is_zero_there(p: Any, form: Any) -> bool:
    """``p`` is 0 where the generators of ``form`` are."""
    indices = used(form)
    return all(any(monomial[index] for index in indices) for monomial in p.to_dict())


def _is_zero_at_origin_alone(p: Any) -> bool:
    """A form in two generators that is irreducible and has no real direction in which it is 0."""
    indices = sorted(used(p))
    terms = p.to_dict()
    degrees = {sum(map(int, monomial)) for monomial in terms}
    if len(indices) != 2 or len(degrees) != 1 or max(degrees) > _MAX_DEGREE:
        return False
    z = sympy.Symbol("z")
    line = sympy.Poly(sum(sympy.Rational(int(c.p), int(c.q)) * z ** int(m[indices[0]]) for m, c in terms.items()), z)
    return bool(line.degree() == degrees.pop() and line.eval(0) != 0 and line.count_roots() == 0)


def _solutions(field: Field, p: Any, relation: sympy.Expr, parameters: Collection[sympy.Symbol]) -> Iterator[Solution]:
    """The solutions of p = 0 for each of the parameters in it."""
    tower = field.tower
    zero = tower.context.constant(0)
    for index in sorted(used(p), reverse=True):
        symbol = tower.generators[index].meaning
        if tower.generators[index].kind != "symbol" or symbol not in parameters or _occurs_inside(field, index, p):
            continue
        parts = tower.by_power(p, index)
        leading = parts[max(parts)]
        if not tower.signs.of(leading).strict:
            continue
        if max(parts) == 1:
            yield Solution(symbol, field.expression(tower.quotient(-parts.get(0, zero), leading)), relation)
        elif parts.keys() == {0, 2}:
            sign = tower.signs.of(tower.gens[index])
            if sign.value and sign.strict:
                square = field.expression(tower.quotient(-parts[0], leading))
                yield Solution(symbol, sign.value * sympy.sqrt(square, evaluate=False), relation, square)


def _occurs_inside(field: Field, index: int, p: Any) -> bool:
    """Whether a root or a function in ``p`` holds the generator."""
    generators = [field.tower.generators[i] for i in used(p)]
    inner = [
        part for g in generators for argument in g.arguments for part in (argument.numerator, argument.denominator)
    ]
    return any(index in used(part) or _occurs_inside(field, index, part) for part in inner)
