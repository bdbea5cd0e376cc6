"""Symmetric tops about axes of irrational direction: spherical tops, pendulums about any equatorial axis."""

import random
from fractions import Fraction
from time import process_time

import pytest

from heavytop.exact.cases.lagrange import SphericalGyrostat, SphericalTop
from heavytop.exact.cases.pendulum import Pendulum
from heavytop.exact.catalogue import find
from heavytop.precision import cross
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import (
    assert_attitude,
    assert_narrow,
    assert_overlap,
    assert_solves,
    positive,
    rational,
    triple,
)

F = Fraction
UNIT = (F(2, 3), F(-1, 3), F(2, 3))
FAR = F(10**6)
STARTS = {
    "sleeping": (HeavyTop((2, 2, 2), 1, (1, 2, 3)), State((3, 6, 9), (2, 4, 6))),
    "asymptotic": (HeavyTop((1, 1, 1), 1, (0, 0, 1)), State((0, 2, 0), (0, 0, -1))),
}
"""Degenerate cubics."""


def random_spherical(seed):
    rng = random.Random(seed)
    inertia = [positive(rng)] * 3
    return SphericalTop(HeavyTop(inertia, rng.choice((1, -2)), triple(rng)), State(triple(rng), triple(rng)))


def random_spherical_gyrostat(seed):
    """The rotor along the centre of mass, or anywhere without a weight."""
    plain, rng = random_spherical(seed), random.Random(seed)
    factor = rational(rng, size=3)
    rotor = [factor * c for c in plain.top.centre] if seed % 3 else triple(rng)
    return SphericalGyrostat(
        HeavyTop(plain.top.inertia, plain.top.weight if seed % 3 else 0, plain.top.centre, rotor), plain.start
    )


def random_spherical_pendulum(seed):
    return random_tilted(seed, spherical=True)


def random_tilted(seed, spherical=False):
    """A pendulum about an axis of the plane of the equal moments, or about any axis."""
    rng = random.Random(seed)
    i1, i3 = positive(rng), positive(rng)
    axis = (rational(rng), rational(rng) or F(1), rational(rng) if spherical else F(0))
    inertia = (i1, i1, i1) if spherical else (i1, i1, i3)
    centre, gamma = (cross(axis, triple(rng)) for _ in range(2))
    rate = rational(rng) if seed % 3 else F(0)
    return Pendulum(HeavyTop(inertia, 2, centre), State([rate * e for e in axis], gamma))


@pytest.mark.parametrize("spherical", [False, True])
def test_the_catalogue_finds_tilted_pendulums_that_solve_all_six_equations(spherical):
    motion = random_tilted(1, spherical)
    assert_solves(motion, F(7, 3))
    assert_attitude(motion, F(7, 3))
    assert isinstance(find(motion.top, motion.start), Pendulum)


@pytest.mark.parametrize("power", [-300, -100, -30, 30, 100, 300])
def test_directions_all_but_along_an_axis(power):
    size = F(10) ** power
    top = HeavyTop((2, 2, 2), 1, (1, size, 3))
    motion = SphericalTop(top, State(("1/5", "1/3", -2), UNIT))
    begun = process_time()
    assert_narrow(motion, F(7, 3), 40)
    assert_overlap(motion.state(F(1), 140), motion.state(F(1), 300))
    tilted = Pendulum(HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((1, size, 0), (0, 0, 1)))
    assert_narrow(tilted, F(7, 3), 40)
    assert process_time() - begun < 5


def test_the_axis_of_a_tilted_pendulum_is_any_in_the_plane_of_equal_moments():
    tilted = HeavyTop((2, 2, 1), 1, (4, -3, 1))
    assert Pendulum(tilted, State((3, 4, 0), (4, -3, 2))).axis == (F(3, 4), 1, 0)
