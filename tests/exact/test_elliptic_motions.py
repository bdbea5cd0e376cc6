"""Gyrostat, Lagrange and his gyrostat: the equations at random data and every edge, long times, and enclosures."""

import random
from dataclasses import replace
from fractions import Fraction
from functools import partial

import pytest

from heavytop import HeavyTop, InputError, State
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.cases.lagrange import Lagrange, LagrangeGyrostat
from heavytop.exact.elliptic.weierstrass import DegenerateLattice, Lattice
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.precision import dot
from heavytop.top.attitude import perpendicular
from support.proofs import assert_overlap, positive, rational, triple

F = Fraction
TINY = F(1, 10**30)
BITS_50, NARROW = 167, F(1, 10**50)
POLE, BELOW, SIDE = (0, 0, 1), (0, 0, -1), (F(3, 5), 0, F(4, 5))


def random_gyrostat(seed):
    rng = random.Random(seed)
    top = HeavyTop((positive(rng), positive(rng), positive(rng)), 1, (0, rational(rng), 0))
    return Gyrostat(top, State(triple(rng), triple(rng)), rational(rng))


def paper_gyrostat(seed):
    """(2.2)-(2.4): γ = M/|M| with a rational |M|."""
    rng = random.Random(seed)
    inertia = tuple(positive(rng) for _ in range(3))
    u, v, size = rational(rng), rational(rng), positive(rng)
    norm = 1 + u * u + v * v
    gamma = (2 * u / norm, 2 * v / norm, 1 - 2 / norm)
    top = HeavyTop(inertia, positive(rng), (0, rational(rng), 0))
    return Gyrostat.of(top, State([size * g / i for g, i in zip(gamma, inertia, strict=True)], gamma))


def random_lagrange(seed):
    rng = random.Random(seed)
    i1 = positive(rng)
    return Lagrange(HeavyTop((i1, i1, positive(rng)), 1, (0, 0, rational(rng))), State(triple(rng), triple(rng)))


def random_lagrange_gyrostat(seed):
    rng = random.Random(seed)
    moment = positive(rng)
    inertia = moment, moment, min(positive(rng), 2 * moment * F(15, 16))
    along = (0, 0, rational(rng, size=3)), (0, 0, rational(rng, size=3))
    start = State(triple(rng, partial(rational, size=3)), triple(rng, partial(rational, size=2)))
    return LagrangeGyrostat(HeavyTop(inertia, (1, 0, -2)[seed % 3], *along), start)


def lagrange(omega, gamma, i3=1, centre=1):
    return Lagrange(HeavyTop((2, 2, i3), 1, (0, 0, centre)), State(omega, gamma))


def gyrostat(inertia, omega, gamma=SIDE, rotor=F(1, 3)):
    return Gyrostat(HeavyTop(inertia, 1, (0, 1, 0)), State(omega, gamma), F(rotor))


PARTIAL = ErshkovPartial(F(1), F(6), F(1))


def near_partial(off):
    first, second, third = PARTIAL.start.omega
    return Gyrostat(PARTIAL.top, State((first + off, second, third), PARTIAL.start.gamma), PARTIAL.rate / 2)


STARTS = {
    "sleeping": lagrange((0, 0, 4), POLE),
    "sleeping, unstable": lagrange((0, 0, 1), POLE),
    "sleeping, near": lagrange((TINY, 0, 1), POLE),
    "hanging": lagrange((0, 0, 1), BELOW),
    "through the upper pole": lagrange((1, 0, 2), POLE),
    "through the lower pole": lagrange((1, 2, 2), BELOW),
    "spherical pendulum": lagrange((F(1, 3), 1, 0), SIDE),
    "plane pendulum": lagrange((0, 1, 0), SIDE),
    "pendulum from rest": lagrange((0, 0, 0), SIDE),
    "cusp": lagrange((0, 0, 3), SIDE),
    "loop": lagrange((F(-1, 2), 0, 3), SIDE),
    "pendulum separatrix": Lagrange(HeavyTop((1, 1, 1), 1, POLE), State((2, 0, 0), BELOW)),
    "inside the separatrix": Lagrange(HeavyTop((1, 1, 1), 1, POLE), State((2 - TINY, 0, 0), BELOW)),
    "outside the separatrix": Lagrange(HeavyTop((1, 1, 1), 1, POLE), State((2 + TINY, 0, 0), BELOW)),
    "asymptotic to sleeping": lagrange((0, 0, 2), POLE),
    # I3 Ω3 ψ' = n + I1 ψ'² γ3 with ψ' = 1: a double root of the cubic
    "steady precession": lagrange((F(3, 5), 0, F(13, 5)), SIDE),
    "no weight": lagrange((1, 0, 1), SIDE, centre=0),
    "sphere": lagrange((1, F(1, 2), 1), SIDE, i3=2, centre=0),
    "no azimuth, gamma is 0": lagrange((1, 0, 1), (0, 0, 0)),
    "homoclinic": near_partial(F(0)),
    "homoclinic, gamma not along M": Gyrostat(PARTIAL.top, State(PARTIAL.start.omega, SIDE), PARTIAL.rate / 2),
    "near homoclinic above": near_partial(TINY),
    "near homoclinic below": near_partial(-TINY),
    "I1 = I2": gyrostat((2, 2, 1), (1, 2, 3)),
    "I1 = I3": gyrostat((2, 3, 2), (1, 2, 3)),
    "I2 = I3": gyrostat((3, 1, 1), (1, 2, 3)),
    "gyrostat sphere": gyrostat((2, 2, 2), (1, 2, 3)),
    "no rotor": gyrostat((3, 2, 1), (1, 2, 3), rotor=0),
    "free separatrix": gyrostat((9, 8, 4), (4, 3, 3), rotor=0),
    "no rotor, symmetric": gyrostat((2, 2, 1), (1, 2, 3), rotor=0),
    "permanent": gyrostat((3, 2, 1), (0, 2, 0)),
    "permanent off the axis": gyrostat((3, 2, 1), (1, F(-2, 1), 0), rotor=-1),
    "gyrostat at rest": gyrostat((3, 2, 1), (0, 0, 0)),
    "zero of M1 and M3": gyrostat((3, 2, 1), (0, 2, 1)),
}


@pytest.mark.parametrize("name", list(STARTS))
@pytest.mark.parametrize("time", [F(10**6), F(10**9) + F(1, 3)])
def test_the_digits_asked_for_come_out_at_large_times(name, time):
    motion = STARTS[name]
    state = motion.state(time, BITS_50)
    more = motion.state(time, 260)
    assert_overlap(state, more, NARROW)
    with working_precision(400):
        gamma, expected = state[3:], dot(motion.start.gamma, motion.start.gamma)
        assert dot(gamma, gamma).contains(ball(expected))
        momentum = motion.top.angular_momentum(motion.start.omega)
        moved = [m * ball(i) for m, i in zip(state[:3], motion.top.inertia, strict=True)]
        assert dot(moved, gamma).contains(ball(dot(momentum, motion.start.gamma)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("family", [random_gyrostat, random_lagrange])
def test_the_attitude_stands_on_a_gamma_of_any_length(family, seed):
    motion, time = family(500 + seed), F(2 + seed, 3)
    direction = paper_gyrostat(seed).start.gamma
    moved = replace(motion, start=State(motion.start.omega, [3 * g for g in direction]))
    rotor = moved.rotor if family is random_gyrostat else None
    enclosed = Validated(moved.top, moved.start, moved.system, rotor=rotor, xi=perpendicular(direction))
    assert_overlap(moved.attitude(time, 200), enclosed.attitude(time, 200), NARROW)


def test_exact_separatrices_have_no_lattice_and_their_neighbours_have():
    for name, kind in (
        ("homoclinic", DegenerateLattice),
        ("near homoclinic above", Lattice),
        ("near homoclinic below", Lattice),
        ("pendulum separatrix", DegenerateLattice),
        ("inside the separatrix", Lattice),
        ("asymptotic to sleeping", DegenerateLattice),
        ("steady precession", DegenerateLattice),
        ("free separatrix", DegenerateLattice),
    ):
        assert isinstance(STARTS[name].quartic().lattice(), kind), name


def test_starts_outside_the_class_say_which_test_failed():
    with pytest.raises(InputError, match="parallel"):
        Gyrostat.of(HeavyTop((3, 2, 1), 1, (0, 1, 0)), State((1, 2, 3), SIDE))
