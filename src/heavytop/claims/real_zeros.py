"""Conditions that are 0, over the real numbers: simpler conditions that hold together at exactly the same points.

exp(L) − 1, atan(L), |L| and L³ are 0 only where L is; a sum of squares only where each of them is.  A function with
further zeros, such as sin(L), is left as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import comb, prod

import sympy

from heavytop.claims.structure import sign_of

_ONLY_ZERO = {
    # f(u) = value at one real u alone
    "exp": (1, 0),
    "cosh": (1, 0),
    "sech": (1, 0),
    "sinh": (0, 0),
    "tanh": (0, 0),
    "atan": (0, 0),
    "asin": (0, 0),
    "Abs": (0, 0),
    "acos": (0, 1),
    "log": (0, 1),
}
_ANALYTIC = (sympy.sin, sympy.cos, sympy.exp, sympy.sinh, sympy.cosh, sympy.tanh, sympy.sech, sympy.atan, sympy.log)
# a polynomial of more terms is left as it is
_MOST_TERMS = 1_000
_MOST_PRODUCTS = 16


def conditions_for_zero(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """Expressions that are all 0 exactly where ``e`` is, as far as ``e`` is defined and real."""
    if e.is_Mul:
        return _of_product(e.args)
    if e.is_Pow and e.args[1].is_Rational and e.args[1] > 0:
        base, exponent = e.args
        if exponent.is_Integer or (exponent.q == 2 and sign_of(base).value > 0):
            return conditions_for_zero(base)
    inside = _inside(e)
    if inside is not None:
        return conditions_for_zero(inside)
    return _of_sum(e) if e.is_Add else (e,)


def _of_product(factors: Sequence[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    """Without the factors that are 0 nowhere; what they need to be defined is asked elsewhere."""
    left = [conditions_for_zero(factor) for factor in factors if not sign_of(factor).strict]
    if len(left) == 1:
        return left[0]
    # (u = v = 0) or (w = x = 0) is u w = u x = v w = v x = 0
    if prod(map(len, left)) > _MOST_PRODUCTS:
        return (sympy.Mul(*factors),)
    return tuple(sympy.Mul(*parts) for parts in product(*left))


def _inside(e: sympy.Expr) -> sympy.Expr | None:
    """u − u0 where ``e`` is c + k f(u), with numbers c and k, and 0 at u = u0 alone: √u = 2 where u = 4."""
    constant, rest = e.as_coeff_Add()
    factor, function = rest.as_coeff_Mul()
    root = function.is_Pow and function.args[1] == sympy.Rational(1, 2)
    if root and constant.is_Rational and factor.is_Rational and -constant / factor > 0:
        return function.args[0] - (constant / factor) ** 2
    name = "exp" if isinstance(function, sympy.exp) else type(function).__name__
    if name not in _ONLY_ZERO or not constant.is_Rational or not factor.is_Rational:
        return None
    value, where = _ONLY_ZERO[name]
    return function.args[0] - where if -constant == factor * value else None


def _of_sum(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    signs = [sign_of(part) for part in e.args]
    if abs(sum(sign.value for sign in signs)) == len(signs):
        return (e,) if any(sign.strict for sign in signs) else _of_all(e.args)
    if not is_small_polynomial(e):
        return (e,)
    factors = sympy.factor_list(e)[1]
    if len(factors) > 1 or factors[0][1] > 1:
        return _of_product([factor for factor, _ in factors])
    squares = _as_squares(e)
    return _of_all(squares) if squares else (e,)


def _of_all(parts: Iterable[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    return tuple(dict.fromkeys(condition for part in parts for condition in conditions_for_zero(part)))


def _as_squares(e: sympy.Expr) -> list[sympy.Expr]:
    """The u of a polynomial that is ± a sum of c u² with c > 0, by completing squares; [] where that fails."""
    squares, sign, rest = [], 0, sympy.expand(e)
    while rest != 0:
        for x in sorted((symbol for symbol in rest.free_symbols if not symbol.is_positive), key=str):
            p = sympy.Poly(rest, x)
            leading = sign_of(p.nth(2))
            known = all(symbol.is_positive for symbol in p.nth(2).free_symbols)
            if p.degree() == 2 and known and leading.strict and leading.value in ({sign} if sign else {1, -1}):
                break
        else:
            return []
        sign, linear = leading.value, p.nth(1)
        squares.append(2 * p.nth(2) * x + linear)
        rest = sympy.expand(sympy.cancel(p.nth(0) - linear**2 / (4 * p.nth(2))))
    return squares if len(squares) > 1 else []


def on_conditions(e: sympy.Expr, conditions: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` where the conditions are 0: a polynomial, or the arguments of analytic functions, reduced by them."""
    divisors = [condition for condition in conditions if condition.free_symbols and is_small_polynomial(condition)]
    if not divisors:
        return e
    shorter: dict[sympy.Expr, sympy.Expr] = {}
    for node in e.atoms(*_ANALYTIC):
        value = node.func(_rest(node.args[0], divisors))
        if not value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I):
            shorter[node] = value
    return _rest(e.xreplace(shorter), divisors)


def all_over(e: sympy.Expr, zeros: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` as it is where the polynomials ``zeros`` are 0: every polynomial in it is reduced by them."""
    if not e.args or is_small_polynomial(e):
        return _rest(e, zeros)
    value = e.func(*(all_over(part, zeros) for part in e.args))
    return e if value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I) else value


def _rest(e: sympy.Expr, divisors: Sequence[sympy.Expr]) -> sympy.Expr:
    """What division leaves, if that is shorter."""
    if not e.free_symbols or not is_small_polynomial(e):
        return e
    rest = sympy.reduced(e, divisors)[1]
    return rest if rest.is_number or sympy.count_ops(rest) < sympy.count_ops(e) else e


def is_small_polynomial(e: sympy.Expr) -> bool:
    """Whether it is a polynomial that can be expanded in no time."""
    return bool(e.is_polynomial(*e.free_symbols)) and _terms(e) <= _MOST_TERMS


def _terms(e: sympy.Expr) -> int:
    """A bound on the terms of its expansion."""
    if e.is_Add:
        return sum(map(_terms, e.args))
    if e.is_Mul:
        return prod(map(_terms, e.args))
    if e.is_Pow and e.args[1].is_Integer and e.args[1] > 0:
        return comb(_terms(e.args[0]) + int(e.args[1]) - 1, int(e.args[1]))
    return 1
