"""The exact algebra proves true identities, never a false one."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest
import sympy

from heavytop.claims.algebra.evaluate import evaluate
from heavytop.claims.algebra.fields import Assumptions, Field

T, A, B = sympy.Symbol("t", real=True), sympy.Symbol("a", positive=True), sympy.Symbol("b", positive=True)
TRUE = [
    sympy.tanh(T) ** 2 + sympy.sech(T) ** 2 - 1,
    sympy.sin(A * T) ** 2 + sympy.cos(A * T) ** 2 - 1,
    sympy.cos(3 * T) - 4 * sympy.cos(T) ** 3 + 3 * sympy.cos(T),
    sympy.sin(T / 3 + A) - sympy.sin(T / 3) * sympy.cos(A) - sympy.cos(T / 3) * sympy.sin(A),
    sympy.sqrt(A) * sympy.sqrt(B) - sympy.sqrt(A * B),
    sympy.sqrt(12) - 2 * sympy.sqrt(3),
    1 / (sympy.sqrt(2) - 1) - sympy.sqrt(2) - 1,
    sympy.cosh(T / 2) ** 2 - (sympy.cosh(T) + 1) / 2,
    sympy.log(sympy.exp(2 * T) * sympy.exp(A)) - 2 * T - A,
    sympy.sqrt(T**2) - sympy.Abs(T),
    sympy.sqrt(1 + sympy.sinh(T) ** 2) - sympy.cosh(T),
]


def field(expression: sympy.Expr, sign: int = 0) -> Field:
    return Field(Assumptions(T, (A, B), (), sign), [expression])


@pytest.mark.parametrize("identity", TRUE)
def test_a_true_identity_is_proven_and_a_disturbed_one_is_not(identity):
    assert field(identity).is_zero(identity)
    for disturbance in (sympy.Rational(1, 10**40), T * sympy.Rational(1, 10**40), A - B):
        assert not field(identity + disturbance).is_zero(identity + disturbance)


def test_the_root_of_a_square_takes_the_sign_of_the_domain():
    wrong = sympy.sqrt(sympy.tanh(A * T) ** 2) - sympy.tanh(A * T)
    assert field(wrong, 1).is_zero(wrong)
    assert not field(wrong, -1).is_zero(wrong)
    assert not field(wrong, 0).is_zero(wrong)


def test_what_is_proven_is_never_refuted_by_a_ball():
    draw = random.Random(7)
    for _ in range(60):
        parts = [draw.choice([sympy.exp(T), sympy.tanh(T), sympy.sqrt(A + T**2), sympy.sin(2 * T)]) for _ in range(3)]
        left = (parts[0] + parts[1]) * parts[2]
        expression = left - parts[0] * parts[2] - draw.choice([parts[1] * parts[2], parts[0] * parts[1]])
        value = evaluate(expression, {T: Fraction(2, 7), A: Fraction(5, 3), B: Fraction(1)}, 200)
        assert field(expression).is_zero(expression) == value.contains(0)
