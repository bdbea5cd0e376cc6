"""Goryachev's motions, G = 0 and M·γ = 0: from rest, through rest, tending to it; states, attitude and refusals."""

import random
from contextlib import suppress
from fractions import Fraction
from time import process_time

import pytest

from heavytop.errors import NotInClass, OutOfReach
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplygin
from heavytop.exact.cases.goryachev_chaplygin_rest import GoryachevChaplyginRest
from heavytop.exact.enclosure.run import Validated
from heavytop.measure.reference import reference
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_meets, assert_narrow, assert_overlap, assert_solves, positive, rational, triple

F = Fraction
TOP = HeavyTop((4, 4, 1), 1, (1, 0, 0))
UNIT = (F(2, 3), F(-1, 3), F(2, 3))
FAR = F(10**6)


def from_rest(seed):
    """The centre anywhere in the plane of the equal moments, γ of any length."""
    rng = random.Random(seed)
    i3 = positive(rng)
    top = HeavyTop((4 * i3, 4 * i3, i3), rng.choice((1, -2)), (rational(rng), rational(rng) or F(1), 0))
    g1, g2, g3 = triple(rng)
    return GoryachevChaplyginRest(top, State((0, 0, 0), (g1, g2, g3 or F(1, 3))))


def moving(seed):
    """A start with G = 0 that moves, and comes to rest."""
    rng = random.Random(seed)
    while True:
        p, q, r, g1 = rational(rng) or F(1), rational(rng) or F(1), rational(rng), rational(rng)
        g3 = r * (p * p + q * q) / p
        start = State((p, q, r), (g1, (-r * g3 / 4 - p * g1) / q, g3))
        try:
            return GoryachevChaplyginRest(TOP, start)
        except NotInClass:
            continue


# h = a: 4 s² + 4 s γ1 = (p γ1/q)²
TENDING = [State((3, 4, 0), (200, -150, 0)), State((-3, 4, 0), (F(-200, 9), F(-50, 3), 0))]


@pytest.mark.parametrize("start", TENDING)
def test_motions_that_tend_to_rest_are_elementary(start):
    motion = GoryachevChaplyginRest(TOP, start)
    enclosure = Validated(TOP, start)
    for time in (F(1, 3), F(-1)):
        assert_solves(motion, time)
        assert_overlap(motion.state(time, 170), enclosure.state(time, 170))
    for time in (FAR, -FAR):
        assert_narrow(motion, time)
        assert motion.state(time, 170)[3].overlaps(motion.state(3 * time, 170)[3])
    with pytest.raises(OutOfReach, match="h = a"):
        motion.attitude(F(1), 100)
    assert reference(TOP, start, [1], 20).method.startswith("closed form: Goryachev")


def test_an_attitude_beyond_reach_is_refused_with_what_its_closed_form_lacks():
    top, start = HeavyTop(TOP.inertia, 250 * TOP.weight, TOP.centre), State((3, 4, 0), (F(4, 5), F(-3, 5), 0))
    assert "h = a" in reference(top, start, [F(1, 3)], 10, attitude=True).attitude_method
    with pytest.raises(OutOfReach, match=r"at t = 1e\+06\. The azimuth of M is not known for h = a\."):
        reference(top, start, [10**6], 10, attitude=True)


@pytest.mark.slow
def test_the_enclosure_holds_the_attitude_over_several_rests():
    """The body rests again every 4 K(m)/√a, some 7 units of time."""
    motion = GoryachevChaplyginRest(TOP, State((0, 0, 0), UNIT))
    assert_meets(motion, (F(3), F(8), F(-12)))


@pytest.mark.parametrize("power", [1, 3, 10, 100, 300])
def test_directions_all_but_level_upright_or_hanging(power):
    small = F(1, 10**power)
    for gamma in ((small, F(3, 5), F(4, 5)), (F(3, 5), small, 1), (F(3, 5), 1, small), (1, small, small)):
        begun = process_time()
        motion = GoryachevChaplyginRest(TOP, State((0, 0, 0), gamma))
        assert_narrow(motion, F(7, 3), 40)
        assert_overlap(motion.state(FAR, 140), motion.state(FAR, 300))
        with suppress(OutOfReach):
            motion.attitude(F(7, 3), 140)
        assert process_time() - begun < 5


def test_fifty_digits_at_a_million_are_quick():
    motion = GoryachevChaplyginRest(TOP, State((0, 0, 0), UNIT))
    motion.attitude(FAR, 175)
    begun = process_time()
    for step in range(20):
        motion.state(FAR + step, 175)
    assert process_time() - begun < 1


@pytest.mark.parametrize("start", [State((0, 0, 0), UNIT), moving(1).start, *TENDING])
def test_the_general_class_refuses_these_levels(start):
    with pytest.raises(NotInClass, match="both separated variables"):
        GoryachevChaplygin(TOP, start)
