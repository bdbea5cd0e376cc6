"""Hess' tops: random motions, small M·γ, pendulums, attitude, and what is refused."""

import random
from contextlib import suppress
from fractions import Fraction
from time import process_time

import pytest
from flint import acb, arb, arb_mat

from heavytop import HEAVY_TOP, HeavyTop, OutOfReach, State
from heavytop.errors import NotInClass
from heavytop.exact.cases.hess import Hess, HessPendulum
from heavytop.exact.cases.hess_transfer import MOST_SEGMENTS, Disc, Segment, System2, Transfer, plan
from heavytop.exact.catalogue import find
from heavytop.exact.flint.balls import ball, unit_of_time, working_precision
from heavytop.measure.reference import reference
from heavytop.precision import dot
from support.proofs import assert_narrow, assert_overlap, assert_solves, positive, rational

F = Fraction
TOP = HeavyTop((8, 6, 3), 1, (1, 0, 2))
SYSTEM = F(1, 3), F(1, 5), F(1, 2), F(3, 4), F(-1, 4)


def random_data(seed):
    """A top of the class with its centre anywhere, and a start; γ of any length."""
    rng = random.Random(seed)
    i1, i3, a, c = (positive(rng) for _ in range(4))
    a *= rng.choice((1, -1))
    share = (a / c) ** 2
    top = HeavyTop((i1, i1 * i3 * (1 + share) / (i1 * share + i3), i3), rng.choice((1, -2)), (a, 0, c))
    w1 = rational(rng) or F(1)
    gamma = rational(rng), rational(rng) or F(1), rational(rng)
    return top, [w1, rational(rng), -i1 * a * w1 / (i3 * c)], gamma


def random_hess(seed):
    top, omega, gamma = random_data(seed)
    return Hess(top, State(omega, gamma))


def random_pendulum(seed):
    top, omega, gamma = random_data(seed)
    (i1, i2, i3), (w1, _, w3) = top.inertia, omega
    omega[1] = -(i1 * w1 * gamma[0] + i3 * w3 * gamma[2]) / (i2 * gamma[1])
    return HessPendulum(top, State(omega, gamma))


@pytest.mark.slow
@pytest.mark.parametrize("spin", [F(1, 10), F(1, 1000), F(1, 10**6)])
def test_small_area_integrals_do_no_harm(spin):
    # at spin 0 the pendulum swings to and fro, and M vanishes at its turning points
    motion = Hess(TOP, State(("1/4", spin, "-1/3"), (0, 1, 0)))
    assert_solves(motion, F(7, 3))
    limit = HessPendulum(TOP, State(("1/4", 0, "-1/3"), (0, 1, 0)))
    for near, there in zip(motion.state(F(1), 170), limit.state(F(1), 170), strict=True):
        assert abs(near - there) < 20 * float(spin)


SWINGS, OVER = ("1/4", 0, "-1/3"), ("3/4", 0, -1)
STARTS = {
    "turning over": (TOP, State(OVER, (0, 1, 0))),
    "turning back": (TOP, State(("-3/4", 0, 1), (0, 1, 0))),
    "swinging": (TOP, State(SWINGS, (0, 1, 0))),
    "hanging at rest": (TOP, State((0, 0, 0), (0, 1, 0))),
    "from rest": (TOP, State((0, 0, 0), ("1/3", "-1/2", "1/5"))),
    "turning over, short gamma": (TOP, State(OVER, (0, "1/16", 0))),
}


def test_the_first_terms_left_out_lie_within_the_tail():
    with working_precision(200):
        system = System2(*map(ball, SYSTEM))
        disc = Disc.of(system, 0.0, 0.3)
        segment = Segment.of(system, disc)
    with working_precision(600):
        longer = Segment.of(system, disc)
        largest = segment.growth.upper(), (segment.growth * disc.widest).upper()
        for short, long, limit in zip(segment.parts, longer.parts, largest * 2, strict=True):
            for order, coefficient in enumerate(long.coeffs()[: 2 * len(short)]):
                assert abs(coefficient).upper() * arb(disc.radius) ** order <= limit
                if order < len(short):
                    assert short[order].overlaps(coefficient)


@pytest.mark.slow
def test_polynomials_of_bits_that_count_hold_those_of_all_bits():
    """Both ends of a segment, in 200 bits against 900; where κr is large too."""
    for system in (SYSTEM, (F(1, 3), F(1, 10**4), F(1, 2), F(1, 100), F(-1, 4)), (F(1), F(1), F(1), F(1), F(9))):
        with working_precision(900):
            fine = System2(*map(ball, system))
        with working_precision(200):
            for disc in plan(System2(*map(ball, system)))[-2:]:
                short = Segment.of(System2(*map(ball, system)), disc)
                with working_precision(900):
                    long = Segment.of(fine, disc)
                for end in (disc.left, disc.right):
                    given = short.at(arb(end)).entries()
                    with working_precision(900):
                        true = long.at(arb(end)).entries()
                    for ours, wanted in zip(given, true, strict=True):
                        assert ours.contains(wanted)
                        assert ours.rad() < arb(2) ** -188 * short.growth**2


def test_the_matrix_over_a_period_keeps_areas_and_undoes_itself():
    with working_precision(200):
        system = System2(*map(ball, SYSTEM))
        transfer = Transfer.of(system)
        for phase in (F(-3), F(0), F(1, 7), F(2), F(22, 7), F(5)):
            number = ball(phase)
            there = transfer.at(number, 3)
            assert abs(there.det() - 1) < arb("1e-50")
            shifted = transfer.at(number + 2 * arb.pi(), 2)
            assert all(abs(x) < arb("1e-50") for x in (there - shifted).entries())
            back = transfer.inverse(number) * transfer.at(number, 0) - arb_mat([[1, 0], [0, 1]])
            assert all(abs(x) < arb("1e-50") for x in back.entries())


def test_more_turns_than_a_word_counts():
    top = HeavyTop((1, F(2, 10**20 + 1), F(1, 10**20)), 1, (1, 0, 1))
    motion = Hess(top, State((1, 1, -(10**20)), (1, 1, 1)))
    assert_narrow(motion, F(7, 3))


@pytest.mark.parametrize("lift", [F(1, 10), F(1, 10**12), F(-1, 10**30)])
def test_heights_that_all_but_rest_are_levels_like_any_other(lift):
    # at lift 0 the cubic has a double root at s = −1: the spherical pendulum goes round level
    top = HeavyTop((1, 1, 1), 1, (0, 0, 1))
    with pytest.raises(NotInClass, match="rests at a double root"):
        Hess(top, State((1, 0, 0), (1, 0, -1)))
    motion = Hess(top, State((F(1) + lift, 0, 0), (F(1), 0, F(-1))))
    assert_solves(motion, F(7, 3))
    assert_narrow(motion, F(10**6))


def short_time(top, start):
    return F(1, 8) / F(2) ** unit_of_time(HEAVY_TOP.parameters(top, start), start.flat)


def assert_answered(top, start, digits=40):
    """Proven digits with the attitude, or a refusal in words, in little time; twice the bits agree."""
    time, begun = short_time(top, start), process_time()
    with suppress(OutOfReach):
        solution = find(top, start)
        reference(top, start, [time], digits, attitude=dot(start.gamma, start.gamma) == 1)
        assert_overlap(solution.state(time, 140), solution.state(time, 220))
    assert process_time() - begun < 10


@pytest.mark.slow
@pytest.mark.parametrize("power", [3, 60])
def test_area_integrals_next_to_nothing_are_proven_or_named(power):
    start = State(("1/4", F(1, 10**power), "-1/3"), (0, 1, 0))
    assert_answered(TOP, start)
    begun, found = process_time(), find(TOP, start)
    if power <= 3:
        assert_narrow(found, F(10**6))
    else:
        with pytest.raises(OutOfReach, match=r"Hess: .*(M·gamma is all but 0|degenerate)"):
            found.state(F(10**12), 140)
    assert process_time() - begun < 10


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 6, 2))
def test_moments_of_any_ratio_are_proven_or_refused_in_words(seed):
    rng = random.Random(seed)
    first, third, a, c = (positive(rng) * F(10) ** rng.choice((0, rng.randint(-100, 100))) for _ in range(4))
    share = (a / c) ** 2
    top = HeavyTop((first, first * third * (1 + share) / (first * share + third), third), 1, (a, 0, c))
    w1 = positive(rng)
    start = State((w1, rational(rng), -first * a * w1 / (third * c)), (F(2, 3), F(-1, 3), F(2, 3)))
    assert_answered(top, start)


@pytest.mark.slow
@pytest.mark.parametrize(("power", "side"), [(10, 1), (60, -1)])
def test_centres_all_but_at_rest_have_an_attitude_or_a_refusal_in_words(power, side):
    """M small, n·γ within ``small`` of its least or largest value; the pole of the azimuth all but meets the gap."""
    small = F(1, 10**power)
    # γ = (±n/|n| turned by about `small`), a rational unit vector; n along (3, 0, 4)
    top = HeavyTop((1, F(25 * 2, 9 + 32), 2), 1, (3, 0, 4))
    cosine, sine = (1 - small**2) / (1 + small**2), 2 * small / (1 + small**2)
    gamma = (side * F(3, 5) * cosine, side * sine, side * F(4, 5) * cosine)
    for w1, w2 in ((small, small), (F(1), small)):
        start = State((w1, w2, -F(3, 8) * w1), gamma)
        assert_answered(top, start)


@pytest.mark.slow
def test_what_the_plan_of_the_linear_system_counts():
    with working_precision(300):
        few, many = (System2(arb(1), arb(2) ** -k, arb(1), arb(2) ** (-k // 2) / 3, arb(1) / 5) for k in (4, 20))
        assert len(plan(few)) < len(plan(many)) < MOST_SEGMENTS
        for system in (few, many):
            for disc in plan(system):
                # no disc holds a zero, κr is within its limit, and κ is right on the circle
                of_q = 2 * (system.top / (2 * system.reach)).sqrt().asinh()
                for width in (system.width(), of_q):
                    assert abs(((acb(0, width) - disc.place) / 2).tan()) > disc.radius
                assert disc.radius < 1
                assert disc.radius * float(disc.steepness) <= 33
                for z in (acb(0, disc.radius), acb(-disc.radius), acb(disc.radius)):
                    for entry in system.entries(disc.place + 2 * z.atan()):
                        assert abs(2 * entry / (1 + z * z)) <= disc.steepness
        with pytest.raises(OutOfReach, match="more than 96 segments"):
            plan(System2(arb(1), arb(2) ** -400, arb(1), arb(2) ** -200, arb(1) / 5))
        with pytest.raises(OutOfReach, match="more than 96 segments"):
            plan(System2(arb(1), arb(1), arb(1), arb(1), arb(10) ** 9))
    with working_precision(40_000), pytest.raises(OutOfReach, match="too many at 40000 bits"):
        Transfer.of(few)
