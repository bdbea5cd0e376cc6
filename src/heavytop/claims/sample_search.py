"""Exact states on the conditions of a claim, where its file gives none: by elimination and a small search.

A variable that occurs linearly is solved for, a polynomial in one variable gives its rational roots, and otherwise a
variable is given a value from a short list.  What is found is only proposed: whoever uses it proves that it lies on
the conditions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import islice

import sympy

# with points of the unit circle and sphere, such as (3/5, 4/5) and (2/3, 1/3, 2/3)
_VALUES = tuple(sympy.Rational(*pair) for pair in ((2, 3), (1, 3), (4, 5), (3, 5), (-1, 2), (2, 1), (1, 1), (0, 1)))
_SCALES = (1, -1, 1, -1, 20, -20)
_MOST_STEPS = 300
_MOST_FOUND = 24


def states_on(
    conditions: Sequence[sympy.Expr],
    variables: Sequence[sympy.Symbol],
    parameters: Mapping[sympy.Symbol, Fraction],
) -> Iterator[dict[sympy.Symbol, Fraction]]:
    """Rational values of ``variables`` where polynomial ``conditions`` are 0 at these parameters; none if not found."""
    numbers = {symbol: sympy.Rational(value.numerator, value.denominator) for symbol, value in parameters.items()}
    # divisors that are 0 there are refused where the state is checked
    equations = [sympy.numer(sympy.together(condition.subs(numbers, simultaneous=True))) for condition in conditions]
    if all(equation.is_polynomial(*variables) and equation.free_symbols <= set(variables) for equation in equations):
        yield from _Search(variables).states(equations)


class _Search:
    """Depth first, with an end to the number of steps."""

    def __init__(self, variables: Sequence[sympy.Symbol]) -> None:
        self._variables = tuple(variables)
        self._steps = 0

    def states(self, equations: Sequence[sympy.Expr]) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """What is found, up to a number."""
        yield from islice(self._solve([sympy.expand(equation) for equation in equations], {}, 0), _MOST_FOUND)

    def _solve(
        self, equations: list[sympy.Expr], known: dict[sympy.Symbol, sympy.Expr], depth: int
    ) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """Completions of ``known``: expressions of variables in those that are still free."""
        self._steps += 1
        equations = [equation for equation in equations if equation != 0]
        if self._steps > _MOST_STEPS or any(equation.is_number for equation in equations):
            return
        if not equations:
            yield from self._filled(known, depth)
            return
        solved = self._linear(equations)
        if solved is not None:
            yield from self._put(*solved, equations, known, depth)
            return
        shortest = min(equations, key=lambda equation: (len(equation.free_symbols), str(equation)))
        for factor, _ in sympy.factor_list(shortest)[1]:
            others = [factor, *(equation for equation in equations if equation is not shortest)]
            if factor != shortest and self._linear([factor]) is not None:
                yield from self._solve(others, known, depth)
                continue
            symbols = [x for x in self._variables if x in factor.free_symbols]
            if len(symbols) == 1:
                for value in sympy.Poly(factor, symbols[0]).ground_roots():
                    yield from self._put(symbols[0], value, others, known, depth)
                continue
            # what is left is to be as simple as can be: the variable of the highest power gets a value first
            x = max(symbols, key=lambda symbol: (sympy.degree(factor, symbol), str(symbol)))
            for index in range(len(_VALUES)):
                yield from self._put(x, _VALUES[(index + depth) % len(_VALUES)], others, known, depth + 1)

    def _linear(self, equations: Sequence[sympy.Expr]) -> tuple[sympy.Symbol, sympy.Expr] | None:
        """A variable that one of the equations gives as a polynomial in the others."""
        for equation in equations:
            for x in reversed(self._variables):
                if x in equation.free_symbols:
                    p = sympy.Poly(equation, x)
                    if p.degree() == 1 and p.nth(1).is_number:
                        return x, -p.nth(0) / p.nth(1)
        return None

    def _put(
        self,
        x: sympy.Symbol,
        value: sympy.Expr,
        equations: Sequence[sympy.Expr],
        known: Mapping[sympy.Symbol, sympy.Expr],
        depth: int,
    ) -> Iterator[dict[sympy.Symbol, Fraction]]:
        reduced = [sympy.expand(equation.subs(x, value)) for equation in equations]
        values = {symbol: expression.subs(x, value) for symbol, expression in known.items()}
        yield from self._solve(reduced, {**values, x: value}, depth)

    def _filled(self, known: Mapping[sympy.Symbol, sympy.Expr], depth: int) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """With values for what is free: of either sign, and of several sizes."""
        free = [x for x in self._variables if x not in known]
        for turn, scale in enumerate(_SCALES if free else _SCALES[:1]):
            values = {x: scale * _VALUES[(turn + i + depth) % (len(_VALUES) - 1)] for i, x in enumerate(free)}
            numbers = {
                x: known[x].subs(values, simultaneous=True) if x in known else values[x] for x in self._variables
            }
            if all(number.is_Rational for number in numbers.values()):
                yield {x: Fraction(int(number.p), int(number.q)) for x, number in numbers.items()}
