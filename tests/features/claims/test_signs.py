"""Signs and balls of the claims' algebra: true where they are told, against plain numbers."""

import math
import random
from fractions import Fraction

import pytest
import sympy

from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.rational import forces_zero
from heavytop.features.claims.algebra.signs import PLUS, UNKNOWN, Sign, sum_of
from support.claim_algebra import P, T, sign_of

X = sympy.Symbol("x", real=True)


def test_a_sum_of_numbers_of_unknown_sign_may_be_0_though_none_of_them_is():
    never_zero = Sign(0, True)
    for parts in ([never_zero], [never_zero, never_zero], [never_zero, PLUS], [PLUS, Sign(-1, False)]):
        assert sum_of(parts) == UNKNOWN
    assert sum_of([PLUS, Sign(1, False)]) == PLUS
    assert sum_of([Sign(-1, False), Sign(-1, True)]) == Sign(-1, True)


@pytest.mark.slow
def test_no_sign_that_is_told_is_false():
    draw = random.Random(11)
    atoms = [T, P, X, sympy.sin(T), sympy.cos(T), sympy.exp(T), sympy.sqrt(1 + T**2), sympy.Integer(1), sympy.sqrt(2)]
    told = 0
    for _ in range(60):
        terms = [draw.choice([-1, 1, 1, 3]) * draw.choice(atoms) ** draw.choice([1, 2, 2]) for _ in range(3)]
        expression = sympy.Add(*terms)
        at = sympy.lambdify((T, X, P), expression, "math")
        found = sign_of(expression)
        told += bool(found.value or found.strict)
        for _ in range(12):
            value = at(draw.gauss(0, 2), draw.gauss(0, 2), abs(draw.gauss(0, 1)) + 1e-3)
            assert not found.value or value * found.value > -1e-9 * (1 + abs(value)), expression
    assert told > 10


def test_a_power_of_a_ball_around_0_is_finite():
    for exponent in (2, 3, 7):
        value = evaluate((sympy.pi - sympy.pi / 3 * 3 + T) ** exponent, {T: Fraction(0)}, 64)
        assert value.is_finite()
        assert value.contains(0)
    assert evaluate(T**2, {T: Fraction(-3)}, 64) == 9
    assert math.isclose(float(evaluate(T**-3, {T: Fraction(2)}, 64)), 1 / 8)


def test_the_radical_is_asked_for_by_name():
    field = Field(Assumptions(T, ()), [T, X])
    t, x = (field.enter(symbol).numerator for symbol in (T, X))
    assert forces_zero([t * t], t, radical=True)
    assert not forces_zero([t * t], t, radical=False)
    assert not forces_zero([t * t], x, radical=True)
    assert forces_zero([t * t], t * t * x, radical=False)
