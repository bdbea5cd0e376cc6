"""Steklov's motions: random ones, turning points, nearly equal moments, odd sizes, and what is refused."""

import random
from fractions import Fraction

import pytest

from heavytop.errors import InputError, NotInClass
from heavytop.exact.cases.one_interval import Steklov, quadratics
from heavytop.top.heavy_top import HeavyTop, State
from rational_motions import steklov_motion
from support.proofs import assert_narrow, assert_solves, positive

F = Fraction


def random_motion(seed):
    """Moments of any order and a start of any signs, γ upwards or downwards."""
    rng = random.Random(seed)
    while True:
        data = positive(rng), positive(rng, 2), positive(rng, 2), positive(rng) * rng.choice((1, -1))
        try:
            return steklov_motion(*data, rng.choice((1, -1)), positive(rng))
        except InputError:
            continue


def turning(second, ratio, rate):
    """A start with Ω2 = 0: A Ω1² = (A − 2C) Ω3², A = 1, C = (1 − s²)/2."""
    third = (1 - ratio**2) / 2
    b2, b0, c2, c0 = quadratics(F(1), second, third)
    p, r = ratio * rate, rate
    height = -b2 * p * p / b0
    kappa = (second - third) / 2
    up = height - (p * p + second * (b2 * p * p) + third * (c2 * p * p)) / 2
    side = r * ((1 - third) * p + kappa * second * 2 * b2 * p)
    assert c0 * height + c2 * p * p == r * r
    return HeavyTop((1, second, third), 1, (1, 0, 0)), State((p, 0, r), (up, 0, side))


STARTS = {
    f"turning point {n}": Steklov(*turning(F(second), F(ratio), F(rate)))
    for n, (second, ratio, rate) in enumerate((("1/5", "1/3", 2), ("2/3", "1/2", -1), ("3/10", "2/3", "1/2")))
}


@pytest.mark.parametrize("distance", [F(1, 10), F(1, 1000)])
def test_nearly_equal_moments_do_no_harm(distance):
    # I3 = ½ (I1 + s² (I1 − 2 I2)) with I2 = I3 + distance
    ratio = F(1, 2)
    second = (1 + ratio**2 + 2 * distance) / (2 + 2 * ratio**2)
    motion = steklov_motion(F(1), second, ratio, F(2))
    assert motion.top.inertia[1] - motion.top.inertia[2] == distance
    assert_solves(motion, F(7, 3))
    assert_narrow(motion, F(10**6))


def test_moments_of_no_such_top_are_refused():
    with pytest.raises(InputError, match="No Steklov top has moments"):
        steklov_motion(F(1), F(1, 2), F(1), F(1))


@pytest.mark.parametrize("distance", [F(1, 10**12), F(1, 10**30), F(1, 10**400)])
def test_moments_too_nearly_equal_are_left_to_the_enclosure(distance):
    ratio = F(1, 2)
    with pytest.raises(NotInClass, match="nearly satisfy an equality"):
        steklov_motion(F(1), (1 + ratio**2 + 2 * distance) / (2 + 2 * ratio**2), ratio, F(2))
