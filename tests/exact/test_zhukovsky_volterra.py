"""The gyrostat of Zhukovsky and Volterra: random ones, limits, odd sizes, and the paper's gyrostat as its case."""

import random
from fractions import Fraction

import pytest

import heavytop as ht
from heavytop import HeavyTop, State
from heavytop.errors import LevelNotDone
from heavytop.exact.cases.zhukovsky_volterra import ZhukovskyVolterra
from support.proofs import positive, rational

F = Fraction
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
TOP = HeavyTop((3, 2, 1), 0, (0, 0, 0), ("1/2", "-1/3", "3/4"))


def random_motion(seed):
    """Any body, rotor and start; γ of any length."""
    rng = random.Random(seed)
    moments = sorted((positive(rng), positive(rng), positive(rng)))
    moments[2] = min(moments[2], (moments[0] + moments[1]) * F(15, 16))
    rng.shuffle(moments)
    top = HeavyTop(moments, 0, (0, 0, 0), [rational(rng, size=3) for _ in range(3)])
    start = State([rational(rng, size=3) for _ in range(3)], [rational(rng, size=2) for _ in range(3)])
    return ZhukovskyVolterra(top, start)


TINY = F(1, 10**20)


MOMENTUM = TOP.angular_momentum(START.omega)
GAMMAS = {"no azimuth, gamma is 0": (0, 0, 0), "along M": MOMENTUM, "across M": (MOMENTUM[1], -MOMENTUM[0], 0)}
LIMITS = [
    ((3, 2, 1), (0, 0, 0)),
    ((3, 2, 1), ("-1/10", 0, "9/10")),  # a permanent rotation: M = I Ω + k = 2 Ω
    *[(axes, ("1/2", "1/3", "1/5")) for axes in ((2, 2, 1), (1, 2, 2), (2, 1, 2), (2, 2 + TINY, 1))],
    *[((3, 2, 1), tuple(F(j == i, 2) for j in range(3))) for i in range(3)],
    ((2, 2, 1), (1, 0, 0)),
    ((2, 2 + TINY, 1), (0, 0, "1/5")),
    ((2, 2 + TINY, 2 - TINY), (1, 1, 1)),
    ((3, 2, 1), (TINY, TINY, 0)),
]
"""Moments that are equal, or nearly so; a rotor along each principal axis, or next to nothing."""
STARTS = {name: (TOP, State(START.omega, gamma)) for name, gamma in GAMMAS.items()}
STARTS |= {f"limit {n}": (HeavyTop(axes, 0, (0, 0, 0), rotor), START) for n, (axes, rotor) in enumerate(LIMITS)}


def test_a_separatrix_is_left_to_the_enclosure_and_without_rotor_to_eulers_closed_form():
    """M = (6, -4, 12) has the size and the energy of the unstable rotation M = (0, -14, 0)."""
    start = State(("2/3", -1, 3), START.gamma)
    with pytest.raises(LevelNotDone, match="aperiodic"):
        ZhukovskyVolterra(HeavyTop((9, 5, 4), 0, (0, 0, 0), (0, 1, 0)), start)
    assert ht.reference(HeavyTop((9, 5, 4), 0, (0, 0, 0), (0, 1, 0)), start, [20], 20).method.startswith("validated")
    free = ht.reference(HeavyTop((9, 5, 4), 0, (0, 0, 0), (0, 0, 0)), State((1, 2, 3), START.gamma), [10**6], 20)
    assert "Euler" in free.method


@pytest.mark.parametrize(("inertia", "rotor"), [((2, 2, 1), (0, 0, 1)), ((2, 2, 2), (1, 2, 3)), ((2, 2, 1), (0, 0, 0))])
def test_limits_are_refused_by_name_and_enclosed(inertia, rotor):
    top = HeavyTop(inertia, 0, (0, 0, 0), rotor)
    with pytest.raises(LevelNotDone, match="aperiodic, or the top symmetric"):
        ZhukovskyVolterra(top, START)
    assert ht.reference(top, START, [1], 20).states
