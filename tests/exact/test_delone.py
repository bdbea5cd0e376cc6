"""The Delone class: any direction of r, the homoclinic motion as its limit, and its neighbourhood."""

import random
from fractions import Fraction

import pytest

from heavytop import HeavyTop, OutOfReach, State
from heavytop.exact.cases.delone import Delone, DeloneHomoclinic
from support.proofs import assert_attitude, assert_every_digit, assert_overlap, assert_solves, positive, rational

TINY = Fraction(1, 10**30)


def delone(omega, gamma3, moment, i3=Fraction(1)):
    """The start of the class with this Ω and γ3: γ1 + iγ2 = I3 (Ω1 + iΩ2)²/(n1 + i n2)."""
    (w1, w2, _), (n1, n2) = omega, moment
    real, imaginary, square = w1 * w1 - w2 * w2, 2 * w1 * w2, Fraction(n1 * n1 + n2 * n2)
    gamma = (i3 * (real * n1 + imaginary * n2) / square, i3 * (imaginary * n1 - real * n2) / square, gamma3)
    return Delone(HeavyTop((2 * i3, 2 * i3, i3), 1, (n1, n2, 0)), State(omega, gamma))


def random_motion(seed):
    rng = random.Random(seed)
    omega = [rational(rng) for _ in range(3)]
    if seed % 6 == 1:
        omega[rng.randrange(3)] = Fraction(0)
    return delone(omega, rational(rng), (rational(rng), positive(rng)), positive(rng))


@pytest.mark.parametrize("off", [0, TINY, -TINY])
def test_on_the_homoclinic_motion_and_beside_it_every_digit_comes_out(off):
    motion = delone((Fraction(0), Fraction(0), 2 + off), Fraction(1), (0, Fraction(1, 2)), Fraction(1, 2))
    assert_every_digit(motion, Fraction(1, 3), Fraction(-4), Fraction(60), Fraction(300))


def test_the_limit_of_the_class_is_the_homoclinic_form():
    special = DeloneHomoclinic(Fraction(3, 2), Fraction(5, 3))
    general = Delone(special.top, special.start)
    for time in (Fraction(-7, 3), Fraction(1, 5), Fraction(30)):
        assert_solves(special, time)
        assert_overlap(special.state(time, 200), general.state(time, 200))
    assert_attitude(special, Fraction(1, 3))


def test_beside_the_permanent_rotation_every_digit_comes_out():
    for off in (0, TINY, -TINY):
        motion = delone((Fraction(off), Fraction(1), Fraction(0)), Fraction(0), (0, Fraction(1, 2)), Fraction(1, 2))
        assert_solves(motion, Fraction(2), Fraction(40))


# turning points (Ω2 = 0, n on axis 1), M·γ = 0: (1, 0, −2) with γ = (1, 0, 1), no start at rest
@pytest.mark.parametrize(
    ("omega", "gamma3"),
    [((1, 0, 1), 3), ((-1, 0, 3), -1), ((1, 0, -2), 1), ((0, 1, 1), 0), ((1, 1, 0), 1), ((1, 0, 0), 1)],
)
def test_the_attitude_at_turning_points_poles_and_without_area(omega, gamma3):
    motion = delone(tuple(map(Fraction, omega)), Fraction(gamma3), (Fraction(1), Fraction(0)))
    assert_attitude(motion, Fraction(0), Fraction(7, 3), Fraction(-30))


# 2A, Ω3 along |g|, γ3, so that e = 0, γ along axis 3 among them; a double root of the cubic
@pytest.mark.parametrize(("omega", "gamma3"), [((1, 0, 2), 1), ((0, 0, 3), -2), ((1, 0, 1), 1)])
def test_a_level_without_azimuth_says_so(omega, gamma3):
    motion = delone(tuple(map(Fraction, omega)), Fraction(gamma3), (Fraction(1), Fraction(0)))
    with pytest.raises(OutOfReach, match="degenerate"):
        motion.attitude(Fraction(1), 100)
