"""The physical pendulum: libration, rotation, separatrix, equilibria, about each axis."""

import random
from fractions import Fraction

import pytest

from heavytop.exact.cases.pendulum import Pendulum, PendulumGyrostat
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_every_digit, assert_solves, positive, rational, triple

TINY = Fraction(1, 10**30)


def pendulum(axis, rate, gamma, centre, inertia=(3, 2, Fraction(3, 2))):
    """About that axis, from the components of γ and r on the next two axes."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    omega, up, arm = [0, 0, 0], [0, 0, 0], [0, 0, 0]
    omega[axis], up[i], up[j], arm[i], arm[j] = rate, *gamma, *centre
    return Pendulum(HeavyTop(inertia, 2, arm), State(omega, up))


def random_motion(seed):
    rng = random.Random(seed)
    gamma, centre = (rational(rng), 1 + positive(rng)), (positive(rng), rational(rng))
    return pendulum(seed % 3, rational(rng, size=8), gamma, centre, triple(rng, positive))


def random_gyrostat(seed):
    plain, rng = random_motion(seed), random.Random(seed)
    rotor = [rational(rng, size=5) * (axis == seed % 3) for axis in range(3)]
    return PendulumGyrostat(HeavyTop(plain.top.inertia, plain.top.weight, plain.top.centre, rotor), plain.start)


# the separatrix is ½ I Ω² + n·γ = |n||γ|: n = (0, 2), γ = (3/5, −4/5) and I = 4/5 ask Ω² = 9
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("rate", [3, -3])
@pytest.mark.parametrize("off", [0, TINY, -TINY])
def test_on_the_separatrix_and_beside_it_every_digit_comes_out(axis, rate, off):
    motion = pendulum(axis, rate + off, (Fraction(3, 5), Fraction(-4, 5)), (0, 1), [Fraction(4, 5)] * 3)
    assert_every_digit(motion, Fraction(1, 3), Fraction(-20), Fraction(300))


@pytest.mark.parametrize("rate", [0, TINY, -TINY])
@pytest.mark.parametrize("gamma", [(0, 1), (0, -1), (TINY, 1), (-TINY, -1)])
def test_the_equilibria_and_their_neighbourhood(rate, gamma):
    motion = pendulum(1, rate, gamma, (0, 1))
    assert_solves(motion, Fraction(2), Fraction(50), Fraction(10**6))


def test_a_separatrix_with_irrational_length_is_found_exactly():
    # r = (1, 1), γ = (2, 2): n·γ = 8 = N, at the top; ½ I Ω² = 0 is the equilibrium, any other Ω rotates
    assert_solves(pendulum(0, TINY, (2, 2), (1, 1)), Fraction(30))
    assert_solves(pendulum(0, 0, (2, 2), (1, 1)), Fraction(30))
    # γ = (2, -2) is level: N = 8 again, and ½ I Ω² = 8 on the separatrix with I = 4, Ω = 2
    motion = pendulum(0, 2, (2, -2), (1, 1), (4, 3, 2))
    assert_solves(motion, Fraction(3), Fraction(1000))
