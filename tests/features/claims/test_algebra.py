"""The exact algebra proves true identities, never a false one."""

import random
from contextlib import suppress
from fractions import Fraction
from itertools import permutations

import pytest
import sympy

from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.ring import Unprovable

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


def test_a_full_field_takes_no_further_function_for_one_that_it_holds():
    full, entered = field(T), {}
    for argument in [sympy.Symbol(f"a{n}", real=True) * T for n in range(40)] * 2:
        with suppress(Unprovable):
            entered[argument] = str(full.enter(sympy.sin(argument)))
    assert len(set(entered.values())) == len(entered) < 40


def test_the_root_of_a_square_takes_the_sign_of_the_domain():
    wrong = sympy.sqrt(sympy.tanh(A * T) ** 2) - sympy.tanh(A * T)
    assert field(wrong, 1).is_zero(wrong)
    assert not field(wrong, -1).is_zero(wrong)
    assert not field(wrong, 0).is_zero(wrong)


@pytest.mark.slow
def test_what_is_proven_is_never_refuted_by_a_ball():
    draw = random.Random(7)
    for _ in range(60):
        parts = [draw.choice([sympy.exp(T), sympy.tanh(T), sympy.sqrt(A + T**2), sympy.sin(2 * T)]) for _ in range(3)]
        left = (parts[0] + parts[1]) * parts[2]
        expression = left - parts[0] * parts[2] - draw.choice([parts[1] * parts[2], parts[0] * parts[1]])
        value = evaluate(expression, {T: Fraction(2, 7), A: Fraction(5, 3), B: Fraction(1)}, 200)
        assert field(expression).is_zero(expression) == value.contains(0)


@pytest.mark.slow
def test_expressions_are_in_the_factors_that_sympy_finds():
    rng = random.Random(12)
    symbols = sympy.symbols("p q r s", real=True)
    for _ in range(12):
        parts = [
            sympy.Add(*(rng.randint(-3, 3) * x ** rng.randint(0, 2) for x in symbols[1:])) + symbols[0]
            for _ in range(4)
        ]
        number = sympy.Rational(rng.randint(-9, 9), rng.randint(1, 9))
        above, below = number * parts[0] ** rng.randint(1, 3) * parts[1], parts[2] * parts[3] ** rng.randint(1, 2)
        field = Field(Assumptions(T, parameters=frozenset(symbols)), [above / below])
        found = field.expression(field.enter(above / below))
        assert sympy.expand(found * below - above) == 0 or sympy.cancel(found - above / below) == 0
        known = sympy.factor(sympy.cancel(above / below))
        ours, theirs = ([sympy.factor_list(part)[1] for part in sympy.fraction(each)] for each in (found, known))
        assert ours == theirs
        assert len(found.args) == len(known.args)


@pytest.mark.slow
def test_an_expression_of_many_terms_needs_no_factors_of_sympy(monkeypatch):
    """SymPy finds them by lucky draws: of 74 terms in a tenth of a second, and now and then in minutes."""
    monkeypatch.setattr(sympy, "factor", None)
    symbols = sympy.symbols("p q r s u v", real=True)
    wide = sympy.Add(*(k * x**2 * y for k, (x, y) in enumerate(permutations(symbols, 2), 1))) + 1
    given = (wide - symbols[0]) * (wide + symbols[1]) / (1 + symbols[2] ** 2)
    field = Field(Assumptions(T, parameters=frozenset(symbols)), [given])
    found = field.expression(field.enter(given))
    assert [found.count(factor) for factor in (wide - symbols[0], wide + symbols[1])] == [1, 1]
