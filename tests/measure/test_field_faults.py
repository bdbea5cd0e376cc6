"""A fault of the right-hand side is named from single steps: the term, and the number that it is multiplied by."""

from fractions import Fraction
from functools import cache

import numpy
import pytest

from heavytop.cases import CASES
from heavytop.features.local_error.field_faults import field_fault
from heavytop.features.local_error.measurement import Call
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE

pytestmark = pytest.mark.slow
CASE = CASES["generic"]
INERTIA, MOMENT = ([float(value) for value in part] for part in (CASE.top.inertia, CASE.top.moment))
TERMS = ["I2 Ω2 Ω3/I1", "I3 Ω2 Ω3/I1", "n3 γ2/I1", "n2 γ3/I1", "I3 Ω1 Ω3/I2", "I1 Ω1 Ω3/I2", "n1 γ3/I2", "n3 γ1/I2"]
TERMS += ["I1 Ω1 Ω2/I3", "I2 Ω1 Ω2/I3", "n2 γ1/I3", "n1 γ2/I3"]
TERMS += ["Ω3 γ2", "Ω2 γ3", "Ω1 γ3", "Ω3 γ1", "Ω2 γ1", "Ω1 γ2"]
OWNERS = [*("Ω1'",) * 4, *("Ω2'",) * 4, *("Ω3'",) * 4, *("γ1'",) * 2, *("γ2'",) * 2, *("γ3'",) * 2]


def field(y: numpy.ndarray, factors: numpy.ndarray, inertia=INERTIA, moment=MOMENT) -> numpy.ndarray:
    """Written by hand, as a program of others would: the terms in the order of TERMS."""
    (i1, i2, i3), (n1, n2, n3), (a, b, c, d, e, g) = inertia, moment, y
    terms = [i2 * b * c / i1, -i3 * b * c / i1, n3 * e / i1, -n2 * g / i1]
    terms += [i3 * a * c / i2, -i1 * a * c / i2, n1 * g / i2, -n3 * d / i2]
    terms += [i1 * a * b / i3, -i2 * a * b / i3, n2 * d / i3, -n1 * e / i3]
    terms += [c * e, -b * g, a * g, -c * d, b * d, -a * e]
    values = factors * numpy.array(terms)
    return numpy.array([*values[:12].reshape(3, 4).sum(axis=1), *values[12:].reshape(3, 2).sum(axis=1)])


def step(f, y: numpy.ndarray, h: float, order: int) -> numpy.ndarray:
    if order == 1:
        return y + h * f(y)
    if order == 2:
        return y + h * f(y + h / 2 * f(y))
    k1 = f(y)
    k2 = f(y + h / 2 * k1)
    k3 = f(y + h / 2 * k2)
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(y + h * k3))


PROBLEM = Problem.of(CASE.top, CASE.start, DOUBLE, CASE.system)


@cache
def states() -> list[numpy.ndarray]:
    """Of the true motion, every quarter of a unit of time."""
    right, found = numpy.ones(len(TERMS)), [numpy.array([float(value) for value in PROBLEM.start.flat])]
    for _ in range(15):
        y = found[-1]
        for _ in range(25):
            y = step(lambda z: field(z, right), y, 0.01, 4)
        found.append(y)
    return found


def said(order: int = 4, size: float = 0.01, **fault) -> str:
    factors, problem, calls = fault.pop("factors", numpy.ones(len(TERMS))), PROBLEM, []
    for y in states():
        ends = {n: step(lambda z: field(z, factors, **fault), y, n * size, order) for n in (1, 2, 4)}
        calls.append(Call(y, Fraction(size), ends[1], {n: ends[n] for n in (2, 4)}))
    found = field_fault(problem, calls, order)
    return found.text if found else ""


CHANGES = [(place, (1.00001, 0.0, -1.0)[place % 3]) for place in range(0, len(TERMS), 2)]


@pytest.mark.parametrize(("place", "factor"), CHANGES)
def test_every_term_of_the_field_is_named(place: int, factor: float) -> None:
    factors = numpy.ones(len(TERMS))
    factors[place] = factor
    became = {0.0: "is left out", -1.0: "has the opposite sign"}.get(factor, f"is {factor} times what it should be")
    text = said(factors=factors)
    assert text.count(", or ") <= 2  # two terms of one monomial are one function
    assert f"the term {TERMS[place]} of {OWNERS[place]} {became}" in text


@pytest.mark.parametrize("axis", range(3))
def test_a_moment_of_inertia_and_a_component_of_the_centre_are_named(axis: int) -> None:
    for name, numbers in (("inertia", INERTIA), ("moment", MOMENT)):
        wrong = [value * (1.00001 if i == axis else 1) for i, value in enumerate(numbers)]
        letter = "I" if name == "inertia" else "r"
        assert f"field: {letter}{axis + 1} is 1.00001 times what it should be" in said(**{name: wrong})


def test_a_factor_of_all_terms_is_named() -> None:
    assert "the weight P is 1.001 times what it should be" in said(moment=[1.001 * value for value in MOMENT])
    near_one = said(moment=[(1 + 3e-8) * value for value in MOMENT])
    assert "the weight P is 1 + 3e-8 times what it should be" in near_one
    assert "the length of each step is 1.001 times" in said(factors=numpy.full(len(TERMS), 1.001))
    assert "γ' is 1.001 times" in said(factors=numpy.array([1.0] * 12 + [1.001] * 6))


@pytest.mark.parametrize(("order", "size"), [(1, 0.01), (2, 0.1), (4, 0.04)])
def test_a_right_method_of_any_order_has_no_fault(order: int, size: float) -> None:
    assert said(order, size) == ""


def test_below_the_error_of_the_method_nothing_is_named_and_two_faults_are_not_one() -> None:
    factors = numpy.ones(len(TERMS))
    factors[2] = 1.00001
    assert said(2, factors=factors)
    assert said(1, factors=factors) == ""
    factors[13] = 0.9999
    assert said(4, factors=factors) == ""
