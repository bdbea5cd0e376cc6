"""What must be true for a formula to be defined and real: collected as it is read, before anything is simplified."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any

import sympy
from flint import arb

from heavytop.claims.defined import at_values
from heavytop.claims.elliptic import NAMES
from heavytop.claims.evaluate import evaluate
from heavytop.claims.sign import Sign, Unprovable
from heavytop.claims.weierstrass import wpinverse

_LONGEST = 120
_BITS = 512


class Kind(Enum):
    """What is asked of an expression; the value is how it is written."""

    NONZERO = "{} ≠ 0"
    POSITIVE = "{} > 0"
    NONNEGATIVE = "{} ≥ 0"

    def is_met_by(self, sign: Sign) -> bool:
        """Whether an expression of that sign meets it."""
        if self is Kind.NONZERO:
            return sign.strict
        return sign.value > 0 and (sign.strict or self is Kind.NONNEGATIVE)


def written(text: str) -> str:
    """A formula as files have it: a power is ``^``."""
    return text.replace("**", "^")


@dataclass(frozen=True, slots=True)
class Need:
    """One condition on one expression.

    shown: how it is written where that is not the expression itself, such as |u| ≤ 1 for 1 − u² ≥ 0.
    """

    kind: Kind
    expression: sympy.Expr
    shown: str = ""

    @property
    def text(self) -> str:
        """The condition as people read it."""
        text = self.shown or self.kind.value.format(self.expression)
        return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"

    def is_met(self, values: Mapping[sympy.Symbol, Fraction]) -> bool | None:
        """True or False where that is certain at exact values of the symbols; None where a ball cannot tell."""
        try:
            ball = evaluate(self.expression, values, _BITS)
        except Unprovable:
            return None
        if not ball.is_finite():
            return None
        rational = self.expression.is_rational_function(*self.expression.free_symbols)
        if ball.is_zero() or (rational and ball.contains(0) and is_exactly_zero(self.expression, values)):
            return self.kind is Kind.NONNEGATIVE
        if self.kind is Kind.NONZERO:
            return True if not ball.contains(0) else None
        above = ball > 0 if self.kind is Kind.POSITIVE else ball >= 0
        below = ball <= 0 if self.kind is Kind.POSITIVE else ball < 0
        return True if above else False if below else None


def condition(function: str, arguments: tuple[sympy.Expr, ...]) -> frozenset[Need]:
    """What ``function`` needs of its arguments to be defined and real: ``/`` of a divisor, ``sqrt``, ``log``, ..."""
    u = arguments[0]
    if function == "/":
        needs = {Need(Kind.NONZERO, u)}
    elif function == "sqrt":
        needs = {Need(Kind.NONNEGATIVE, u)}
    elif function == "log":
        needs = {Need(Kind.POSITIVE, u)}
    elif function in ("asin", "acos"):
        needs = {Need(Kind.NONNEGATIVE, 1 - u**2, f"-1 ≤ {u} ≤ 1")}
    elif function in ("tan", "sec"):
        needs = {Need(Kind.NONZERO, sympy.cos(u))}
    elif function in ("coth", "csch"):
        needs = {Need(Kind.NONZERO, sympy.sinh(u))}
    elif function in ("wp", "wpprime"):
        text = f"{u} is no period of wp(u, {arguments[1]}, {arguments[2]})"
        needs = {Need(Kind.NONZERO, wpinverse(*arguments), text)}
    elif function in ("wp3", "wp3prime"):
        _, g2, g3 = arguments
        needs = {Need(Kind.POSITIVE, g2**3 - 27 * g3**2)}
    elif function in NAMES:
        m = arguments[1]
        needs = {Need(Kind.NONNEGATIVE, m), Need(Kind.NONNEGATIVE, 1 - m, f"{m} ≤ 1")}
    elif function == "atan2":
        needs = {Need(Kind.POSITIVE, u**2 + arguments[1] ** 2)}
    else:
        needs = set()
    return frozenset(need for need in needs if not _is_plain(need))


def _is_plain(need: Need) -> bool:
    """Numbers that meet it, as anyone can see."""
    e = need.expression
    return bool(e.is_Rational and (e > 0 or (e < 0 and need.kind is Kind.NONZERO)))


def conditions_of(expressions: Iterable[Any]) -> frozenset[Need]:
    """What sympy expressions need, as they stand: what has been simplified away is not seen."""
    found: set[Need] = set()
    for part in {node for e in expressions for node in sympy.preorder_traversal(e)}:
        if isinstance(part, sympy.exp):
            continue
        if part.is_Pow:
            base, exponent = part.args
            if exponent.is_Rational and exponent.q == 2:
                found |= condition("sqrt", (base,))
            if exponent.is_negative:
                found |= condition("/", (base,))
        elif part.is_Function:
            name = "/" if type(part).__name__ == "sign" else type(part).__name__
            found |= condition(name, part.args)
    return frozenset(found)


def is_exactly_zero(expression: sympy.Expr, values: Mapping[sympy.Symbol, Fraction]) -> bool | None:
    """Whether it is 0 at exact values: True and False are proofs, None is not decided.

    Polynomials are computed in fractions: what is off by 1e-200 is off.
    """
    from heavytop.claims.algebra import Assumptions, Field

    if not all(need.is_met(values) for need in conditions_of([expression])):
        return None
    exact = {symbol: sympy.Rational(value.numerator, value.denominator) for symbol, value in values.items()}
    try:
        value = at_values(expression, exact)
    except ValueError:
        # sympy cannot take the root of some numbers of hundreds of digits
        return None
    if value.is_Rational:
        return bool(value == 0)
    ball: arb = evaluate(expression, values, _BITS)
    if ball.is_finite() and not ball.contains(0):
        return False
    try:
        number = Field(Assumptions(sympy.Dummy("t", real=True)), [value])
    except Unprovable:
        return None
    return True if number.vanishes(value) else None
