"""Motions in circular functions and constants: Grioli's precession, Staude's rotations."""

import random
from fractions import Fraction

import pytest

from heavytop import HEAVY_GYROSTAT, HeavyTop, InputError, State
from heavytop.errors import NotInClass
from heavytop.exact.cases.grioli import Grioli
from heavytop.exact.cases.staude import Staude
from heavytop.exact.catalogue import find
from rational_motions import grioli_motion, staude_motion
from support.proofs import assert_attitude, assert_solves, positive, rational, triple

GRIOLI = grioli_motion(Fraction(1, 3), Fraction(1, 4), Fraction(2, 7), Fraction(3, 2))


UNIT = (Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))
LEVEL = Fraction(3, 5), Fraction(4, 5), Fraction(0)
STARTS = {
    "grioli": GRIOLI,
    "gamma of length 7": Grioli(
        HeavyTop(GRIOLI.top.inertia, Fraction(1, 7), GRIOLI.top.centre),
        State(GRIOLI.start.omega, [7 * g for g in GRIOLI.start.gamma]),
    ),
    **{f"staude at {rate}": staude_motion((3, 2, 1), UNIT, Fraction(rate), Fraction(1, 2)) for rate in ("3/2", 0)},
    # γ × (P r − ω² I γ) = 0 for γ = (3/5, 4/5, 0), ω = 1: (0, 4/5, 0) − (3/5, 8/5, 0) = −γ
    "found by the field alone": Staude(HeavyTop((1, 2, 4), 1, (0, Fraction(4, 5), 0)), State(LEVEL, LEVEL)),
}


def random_grioli(seed):
    rng = random.Random(seed)
    between = lambda: Fraction(rng.randint(1, 19), 20)  # noqa: E731
    direction, shape = between(), between()
    while shape == direction:
        shape = between()
    return grioli_motion(direction, shape, rational(rng), positive(rng) * rng.choice((-1, 1)), positive(rng))


def random_staude(seed):
    rng = random.Random(seed)
    return staude_motion(triple(rng, positive), triple(rng), rational(rng), rational(rng))


def test_a_grioli_top_is_asymmetric():
    assert len(set(GRIOLI.top.inertia)) == 3


def test_what_is_not_grioli_is_refused_with_the_test_that_failed():
    omega, gamma = GRIOLI.start.omega, GRIOLI.start.gamma
    with pytest.raises(NotInClass, match=r"P b = 1\."):
        Grioli(HeavyTop((3, 2, 1), 1, (1, 1, 1)), GRIOLI.start)
    with pytest.raises(NotInClass, match="times the difference = -3"):
        Grioli(HeavyTop((3, 2, 1), 1, (1, 0, 2)), GRIOLI.start)
    with pytest.raises(NotInClass, match="difference of spin and precession"):
        Grioli(GRIOLI.top, State((omega[0], omega[1] + 1, omega[2]), gamma))
    with pytest.raises(NotInClass, match=r"gamma as it follows from Omega, but the difference = \(1/7, 0, 0\)"):
        Grioli(GRIOLI.top, State(omega, (gamma[0] + Fraction(1, 7), *gamma[1:])))
    with pytest.raises(InputError, match="No Grioli top"):
        grioli_motion(Fraction(1, 3), Fraction(1, 3), Fraction(0), Fraction(1))


@pytest.mark.parametrize("seed", range(4))
def test_every_permanent_rotation_of_a_gyrostat_solves_all_six_equations(seed):
    rng = random.Random(seed)
    data = triple(rng, positive), triple(rng), rational(rng), rational(rng)
    motion = staude_motion(*data, rotor=(positive(rng), rational(rng), rational(rng)))
    assert find(motion.top, motion.start, HEAVY_GYROSTAT).method == motion.method
    assert_solves(motion, Fraction(7, 3))
    assert_attitude(motion, Fraction(7, 3))
