"""Euler-Poinsot against its equations, and its separatrix."""

import random
from fractions import Fraction

import pytest

from heavytop.exact.cases.euler import Euler
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_every_digit, assert_solves, positive, triple

TINY = Fraction(1, 10**30)


def euler(inertia, omega, gamma=(Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))):
    return Euler(HeavyTop(inertia, 1, (0, 0, 0)), State(omega, gamma))


def random_motion(seed):
    rng = random.Random(seed)
    inertia, omega = list(triple(rng, positive)), list(triple(rng))
    if seed % 4 == 1:
        inertia[rng.randrange(3)] = inertia[rng.randrange(3)]
    if seed % 5 == 2:
        omega[rng.randrange(3)] = Fraction(0)
    if seed % 11 == 3:
        inertia = [inertia[0]] * 3
    return euler(inertia, omega, triple(rng))


# the separatrix L² = 2E I2 is I1 (I1 − I2) Ω1² = I3 (I2 − I3) Ω3²: for these moments 36 Ω1² = 4 Ω3², rational
SEPARATRIX_INERTIA = (9, 5, 1)


@pytest.mark.parametrize("off", [0, TINY, -TINY, Fraction(1, 10**12)])
@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, 1)])
def test_on_the_separatrix_and_beside_it_every_digit_comes_out(off, signs):
    omega = [sign * w for sign, w in zip(signs, (Fraction(1, 3), Fraction(2, 7), 1 + off), strict=True)]
    motion = euler(SEPARATRIX_INERTIA, omega)
    assert_every_digit(motion, Fraction(7, 3), Fraction(-40), Fraction(250))


@pytest.mark.parametrize(
    ("inertia", "omega"),
    [
        *((SEPARATRIX_INERTIA, omega) for omega in ((TINY, 1, 0), (0, 1, TINY), (TINY, 1, 3 * TINY), (TINY, 1, -TINY))),
        ((3, 2, 1), (1, TINY, 0)),
        ((3, 2, 1), (TINY, 0, 1)),
        ((2 + TINY, 2, 1), (1, 1, 1)),
        ((2, 1, 1 - TINY), (1, 1, 1)),
        ((2 + TINY, 2, 2 - TINY), (1, 2, 1)),
        ((2 + TINY, 2, 2), (1, 2, 1)),
    ],
)
def test_beside_a_saddle_a_steady_rotation_and_symmetry_every_digit_comes_out(inertia, omega):
    assert_solves(euler(inertia, omega), Fraction(3), Fraction(100), Fraction(10**6))


def test_a_body_at_rest_stays_at_rest():
    motion = euler((3, 2, 1), (0, 0, 0))
    assert [int(w.unique_fmpz()) for w in motion.state(Fraction(10**9), 100)[:3]] == [0, 0, 0]
    assert_solves(motion, Fraction(5))
