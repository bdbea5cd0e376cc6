"""Goryachev-Chaplygin motions: random ones, turning points, multiple roots, and what is refused."""

import random
from fractions import Fraction

import pytest

from heavytop.errors import NotInClass
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplygin
from heavytop.measure.reference import reference
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_narrow, assert_solves, positive, rational

F = Fraction
UP = (F(0), F(0), F(1))


def motion_from(moment, omega, gamma, i3=F(1)):
    return GoryachevChaplygin(HeavyTop((4 * i3, 4 * i3, i3), 1, (*moment, 0)), State(omega, gamma))


def random_motion(seed):
    """The centre anywhere in the plane, |γ| not 1, M·γ = 0."""
    rng = random.Random(seed)
    g1, g2, g3 = rational(rng), rational(rng), positive(rng)
    w1, w2 = rational(rng), rational(rng)
    moment = positive(rng) * rng.choice((1, -1)), rational(rng)
    return motion_from(moment, (w1, w2, -4 * (w1 * g1 + w2 * g2) / g3), (g1, g2, g3), positive(rng))


ALONG_1 = (F(1), F(0))
STARTS = {
    "turning point": (ALONG_1, ("3/4", "1/2", 0), UP),
    "both at turning points": (ALONG_1, ("3/4", 0, 0), UP),  # y1 = y2 = 0
    "nearly so": (ALONG_1, ("3/4", F(1, 10**30), 0), UP),
    "level, up": (ALONG_1, (1, 0, 3), (0, 1, 0)),
    "level, down": (ALONG_1, (1, 0, -3), (0, 1, 0)),
    "any": (ALONG_1, ("1/2", 0, "-1/2"), ("1/4", "1/3", 1)),
    "no azimuth, asymptotic": (ALONG_1, (F(-8, 5), 4, F(-24, 5)), (F(-3, 5), 0, F(4, 5))),
    "no azimuth, another": (ALONG_1, (F(81, 230), F(13, 23), F(-216, 115)), (F(4, 5), 0, F(3, 5))),
    "no azimuth, a third": (ALONG_1, (F(486, 793), F(24, 61), F(810, 793)), (F(-5, 13), 0, F(12, 13))),
    **{
        f"one variable at rest, {s}": (ALONG_1, (F(-18, 13) * s, 0, F(-30, 13) * s), (F(-5, 13), 0, F(12, 13)))
        for s in (1, -1)
    },
    # G = 0: u = 0 is a root of both factors
    **{f"double root outside, {n}": (ALONG_1, (0, n, 0), (F(4, 5), 0, F(3, 5))) for n in (-3, -1, 2, F(3, 2))},
}


@pytest.mark.parametrize("power", [11, 20, 40, 120])
def test_levels_too_near_to_one_that_is_not_done_are_left_to_the_enclosure(power):
    step, top = F(1, 10**power), HeavyTop((4, 4, 1), 1, (1, 0, 0))
    # beside G = 0 with u = 0 between the gaps, and beside an asymptotic motion
    beside = State((F(4, 15), F(-1, 5), -step), (F(3, 5), F(4, 5), 0))
    asymptotic = State((step, F(1, 4), -3 * step), (F(3, 5), 0, F(4, 5)))
    for start in (beside, asymptotic):
        with pytest.raises(NotInClass, match=r"degenerate to within [1-9].*, the distance"):
            GoryachevChaplygin(top, start)
        assert reference(top, start, [1, -3], 20).method.startswith("validated")


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [1, 2, 3])
def test_near_a_degenerate_level_every_digit_comes_out(exponent):
    spin = F(1, 10**exponent)
    motion = motion_from(ALONG_1, (0, F(1, 4), spin), (F(3, 5), -spin * F(4, 5), F(4, 5)))
    assert_solves(motion, F(7, 3))
    assert_narrow(motion, F(10**6))
