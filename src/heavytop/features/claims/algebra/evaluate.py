"""The value of an expression at exact parameters and an exact time, as a ball."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy
from flint import arb

from heavytop.exact.flint.balls import ball, whole_evaluation, working_precision
from heavytop.features.claims.algebra.elliptic import VALUES
from heavytop.features.claims.algebra.ring import Unprovable
from heavytop.features.claims.algebra.structure import Defined

_OF_ARB = (
    *("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
    *("sinh", "cosh", "tanh", "sech", "csch", "coth", "asinh", "acosh", "atanh"),
)
_FUNCTIONS: dict[str, Callable[..., arb]] = {
    **{name: getattr(arb, name) for name in _OF_ARB},
    "Abs": abs,
    "sign": arb.sgn,
    **VALUES,
}


@lru_cache(maxsize=32)
def _known_at(_values: frozenset[tuple[sympy.Symbol, Fraction]], _bits: int) -> dict[sympy.Expr, arb]:
    """The balls of expressions at one place: those of a claim have most of their parts in common."""
    return {}


@whole_evaluation
def evaluate(expression: sympy.Expr, values: Mapping[sympy.Symbol, Fraction], bits: int) -> arb:
    """The ball of ``expression`` where each symbol has its exact value; not finite where it is undefined there."""
    known = _known_at(frozenset(values.items()), bits)

    def visit(e: sympy.Expr) -> arb:
        if e not in known:
            known[e] = compute(e)
        return known[e]

    def compute(e: sympy.Expr) -> Any:
        if e.is_Rational:
            return ball(Fraction(e))
        if isinstance(e, Defined):
            return visit(e.meaning)
        if e.is_Symbol:
            value = values[e]
            return visit(value) if isinstance(value, sympy.Expr) else ball(value)
        if e is sympy.pi:
            return arb.pi()
        if e is sympy.E:
            return arb(1).exp()
        if e.is_Add:
            return sum((visit(part) for part in e.args), arb(0))
        if e.is_Mul:
            product = arb(1)
            for part in e.args:
                product *= visit(part)
            return product
        if e.is_Pow and not isinstance(e, sympy.exp):
            return _power(visit(e.args[0]), e.args[1])
        name = type(e).__name__
        if name not in _FUNCTIONS:
            raise Unprovable(f"{name} cannot be evaluated.")
        return _FUNCTIONS[name](*(visit(part) for part in e.args))

    with working_precision(bits):
        return visit(expression)


def _power(base: arb, exponent: sympy.Expr) -> arb:
    if exponent.is_Rational and exponent.q in (1, 2, 4):
        for _ in range(int(exponent.q) // 2):
            base = base.sqrt()
        power = _integer_power(base, abs(int(exponent.p)))
        return power if exponent.p > 0 else 1 / power
    raise Unprovable(f"A power must be a multiple of 1/4; got {exponent}.")


def _integer_power(base: arb, exponent: int) -> arb:
    """A power by squaring: python-flint's power of a ball with midpoint 0 is nan."""
    result, square = arb(1), base
    while exponent:
        if exponent & 1:
            result *= square
        exponent >>= 1
        if exponent:
            square *= square
    return result
