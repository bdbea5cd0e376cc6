"""The plan of lanes is the field, exactly: products, sums and permutations over the rationals."""

from fractions import Fraction
from random import Random

import pytest

from heavytop.multiword.codegen.recurrence import coefficients, rates
from heavytop.multiword.problem import Scaled
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters
from support.helpers import random_parameters, vector


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda system: system.name)
def test_the_lanes_give_the_derivative_of_the_field_exactly(system) -> None:
    random = Random(15)
    for _ in range(50):
        p = random_parameters(random, system)
        y, z = [*vector(random), *vector(random)], list(vector(random))
        given = coefficients(system, p, attitude=True)
        assert rates(system, given, [*y, *z]) == [*system.field(p, y), *system.attitude(p, y, z)]


@pytest.mark.slow
@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda system: system.name)
@pytest.mark.parametrize("size", [-100, -3, 0, 40, 150])
def test_scaling_is_exact_and_brings_numbers_near_one(system, size: int) -> None:
    """y' in the units of the problem is that of the scaled one, whatever the units of time and of weight."""
    random = Random(size)
    unit = Fraction(10) ** size
    for _ in range(10):
        p = random_parameters(random, system, unit)
        y = tuple(v * unit for v in vector(random)) + vector(random) + vector(random)
        scaled = Scaled.of(system, p, y)
        assert scaled.back(scaled.state) == y
        derivative = [*system.field(p, y[:6]), *system.attitude(p, y[:6], y[6:])]
        assert max(map(abs, scaled.state)) <= 1
        flat = rates(system, scaled.coefficients, list(scaled.state))
        assert [r * size * scaled.rate for r, size in zip(flat, scaled.sizes, strict=True)] == derivative


@pytest.mark.parametrize("scale", [Fraction(10) ** -100, Fraction(10) ** -12, Fraction(1), Fraction(10) ** 30])
@pytest.mark.parametrize("moment", [Fraction(10) ** -100, Fraction(1), Fraction(10) ** 50])
def test_the_bound_of_a_free_top_follows_its_rate(scale: Fraction, moment: Fraction) -> None:
    """A bound far above |Ω| makes the steps of a run on a grid as many times shorter: it would never end."""
    inertia = (7 * moment, 15 * moment, 14 * moment)
    p = Parameters(inertia, (Fraction(0),) * 3, Fraction(0))
    state = (11 * scale, -2 * scale, 3 * scale, Fraction(0), Fraction(0), Fraction(1))
    omega = Scaled.of(HEAVY_TOP, p, state, bounded=True).state[:3]
    assert max(map(abs, omega)) > Fraction(1, 2)
