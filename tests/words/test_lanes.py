"""The plan of lanes is the field, exactly: products, sums and permutations over the rationals."""

from fractions import Fraction
from random import Random

import pytest

from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters
from heavytop.words.lanes import GATHERED, LEFT, RIGHT, Coefficients, Sum, coefficients, turned
from heavytop.words.scaled import Scaled
from helpers import fraction, positive, vector


def side(y: list[Fraction], which: Sum) -> list[Fraction]:
    return [y[a] + sign * y[b] for a, b, sign in zip(which.first, which.second, which.sign, strict=True)]


def by_the_plan(system, given: Coefficients, state: list[Fraction]) -> list[Fraction]:
    """The derivative of (Ω, γ, ξ) out of the lane plan."""
    zero = Fraction(0)
    lanes = [[*state[:6], zero, zero], [zero, zero, zero, *state[6:], zero, zero]]
    right = side(lanes[0], RIGHT)
    found = []
    for y, (first, *linear) in zip(lanes, given.vectors, strict=True):
        products = [a * b for a, b in zip(side(y, LEFT), right, strict=True)]
        gathered = [sum(sign * products[lane] for lane, sign in column) for column in zip(*GATHERED, strict=True)]
        rates = [a * s for a, s in zip(first, gathered, strict=False)]
        for row, permutation in zip(linear, turned(system), strict=True):
            rates = [rate + b * y[lane] for rate, b, lane in zip(rates, row, permutation, strict=False)]
        found.append(rates)
    assert found[1][:3] == [zero] * 3
    return [*found[0], *found[1][3:6]]


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda system: system.name)
def test_the_lanes_give_the_derivative_of_the_field_exactly(system) -> None:
    random = Random(15)
    for _ in range(50):
        p = Parameters((positive(random), positive(random), positive(random)), vector(random), fraction(random))
        y, z = [*vector(random), *vector(random)], list(vector(random))
        given = coefficients(system, p, attitude=True)
        assert by_the_plan(system, given, [*y, *z]) == [*system.field(p, y), *system.attitude(p, y, z)]


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda system: system.name)
@pytest.mark.parametrize("size", [-100, -3, 0, 40, 150])
def test_scaling_is_exact_and_brings_numbers_near_one(system, size: int) -> None:
    """y' in the units of the problem is that of the scaled one, whatever the units of time and of weight."""
    random = Random(size)
    unit = Fraction(10) ** size
    for _ in range(10):
        weights = tuple(v * unit for v in vector(random))
        p = Parameters((positive(random), positive(random), positive(random)), weights, fraction(random) * unit)
        y = tuple(v * unit for v in vector(random)) + vector(random) + vector(random)
        scaled = Scaled.of(system, p, y)
        assert scaled.back(scaled.state) == y
        rates = [*system.field(p, y[:6]), *system.attitude(p, y[:6], y[6:])]
        assert max(map(abs, scaled.state)) <= 1
        flat = by_the_plan(system, scaled.coefficients, list(scaled.state))
        assert [r * size * scaled.rate for r, size in zip(flat, scaled.sizes, strict=True)] == rates
