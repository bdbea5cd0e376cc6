"""Bobylev-Steklov motions: both kinds, the separatrix, and the builder."""

import random
from fractions import Fraction

import pytest

from heavytop import HeavyTop, InputError, State
from heavytop.exact.cases.bobylev_steklov import BobylevSteklov
from heavytop.exact.closed_form import initial_xi
from rational_motions import bobylev_steklov_motion
from support.proofs import assert_attitude, assert_every_digit, assert_overlap, assert_solves, positive, rational

TINY = Fraction(1, 10**30)


def motion_from(p, x, gamma1, gamma2, moment=1, inertia=(Fraction(3, 2), Fraction(1))):
    i2, i3 = inertia
    top = HeavyTop((2 * i3, i2, i3), 1, (moment, 0, 0))
    return BobylevSteklov(top, State((p, 0, x), (gamma1, gamma2, i3 * p * x / Fraction(moment))))


def random_motion(seed):
    rng = random.Random(seed)
    moment, p = positive(rng) * rng.choice((1, -1)), rational(rng)
    return motion_from(p, rational(rng), rational(rng), rational(rng), moment, (positive(rng), positive(rng)))


@pytest.mark.parametrize("seed", range(10))
def test_the_builder_gives_unit_gamma(seed):
    rng = random.Random(seed)
    inertia = (positive(rng), positive(rng))
    motion = bobylev_steklov_motion(inertia, rational(rng) + 5, positive(rng), rational(rng), rational(rng))
    motion.start.require_unit_gamma()
    assert_solves(motion, rational(rng, size=30))


# C = 0 is |γ|² n1² = h²: I3 = n1 = 1, γ3 = p x, h = γ1 + x²/2; γ1² + γ2² + p² x² = (γ1 + x²/2)², and so
# γ2² = x² (γ1 + x²/4 − p²): x = 2, p = 1, γ1 = 1, γ2 = 2
@pytest.mark.parametrize("off", [0, TINY, -TINY])
@pytest.mark.parametrize("sign", [1, -1])
def test_on_the_separatrix_and_beside_it_every_digit_comes_out(off, sign):
    motion = motion_from(Fraction(1), Fraction(2 * sign), Fraction(1), 2 + off)
    assert_every_digit(motion, Fraction(1, 3), Fraction(-20), Fraction(500))


def test_beside_equilibria_every_digit_comes_out():
    # x = 0, γ = (±1, 0, 0) turns steadily about the vertical, stable or not; so does γ2 = 0, x² = 2B
    for gamma1, p, x in ((1, Fraction(1, 2), 0), (-1, Fraction(1, 2), 0), (1, 2, 0), (-1, 1, 1), (2, 1, 2)):
        for off in (Fraction(0), TINY, -TINY):
            motion = motion_from(Fraction(p), x + off, Fraction(gamma1), off)
            assert_solves(motion, Fraction(3), Fraction(200), Fraction(10**6))


def test_turning_points_are_starts_like_any_other():
    for x in (Fraction(1, 2), Fraction(-3)):
        assert_solves(motion_from(Fraction(2, 3), x, Fraction(4, 5), Fraction(0)), Fraction(5, 2))


def test_a_builder_without_a_centre_is_refused():
    with pytest.raises(InputError, match="a = 0"):
        bobylev_steklov_motion((Fraction(1), Fraction(1)), Fraction(0), Fraction(1), Fraction(1), Fraction(1))


# γ = (0, 0, ±1): axis 3 is vertical, the pole of its azimuth; γ2 = 0, γ1/γ3 = 2p/x: M ∥ γ at a turning point;
# the separatrix; equilibria; p = 0: a pendulum about axis 3; x = 0 throughout a cn motion's zero
@pytest.mark.parametrize(
    "data",
    [
        *((1, 1, 0, 0), (1, -1, 0, 0), (1, 1, 2, 0), (2, -1, 8, 0), (1, 2, 1, 2), (1, 2, 1, 2 + TINY), (1, 0, 1, 0)),
        *((1, 0, 1, TINY), (0, 1, 1, 1), (0, 0, 1, 0), (TINY, 1, 1, 1), (1, 0, 0, 1), (0, 2, 1, 0)),
    ],
)
def test_the_attitude_has_no_exceptional_state(data):
    motion = motion_from(*map(Fraction, data))
    assert_attitude(motion, Fraction(0), Fraction(1, 3), Fraction(-20), Fraction(300))
    assert_overlap(motion.attitude(Fraction(0), 200), initial_xi(motion.start.gamma))
