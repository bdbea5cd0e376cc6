"""Lagrange's gyrostat: random ones, every naming of the axes, without weight, and what is refused."""

import random
from fractions import Fraction

import pytest

from heavytop.exact.cases.lagrange import LagrangeGyrostat
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_enclosed, assert_exact, positive, rational

F = Fraction


def random_motion(seed, weight=1):
    rng = random.Random(seed)
    moment = positive(rng)
    top = HeavyTop(
        (moment, moment, min(positive(rng), 2 * moment * F(15, 16))),
        weight,
        (0, 0, rational(rng, size=3)),
        (0, 0, rational(rng, size=3)),
    )
    start = State([rational(rng, size=3) for _ in range(3)], [rational(rng, size=2) for _ in range(3)])
    return LagrangeGyrostat(top, start)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "weight"), [(8, 0), (9, 0), (10, -2)])
def test_any_weight_solves_all_six_equations(seed, weight):
    motion = random_motion(seed, weight)
    assert_exact(motion, seed, attitude=True)
    assert_enclosed(motion)
