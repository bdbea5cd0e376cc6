"""Kovalevskaya motions: random ones, turning points and q = 0, degenerate levels, and what is refused."""

import random
from fractions import Fraction

import pytest
from flint import acb, acb_series, arb

from heavytop.errors import NotInClass
from heavytop.exact.cases.kovalevskaya import AbelMotion, Kovalevskaya, _fourth_root
from heavytop.exact.cases.kovalevskaya_theta import ORDERS, KovalevskayaLevel, ThetaMotion, start_of
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import Undecided, ball, midpoint, series_length, working_precision
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_overlap, assert_solves, positive, rational, triple

F = Fraction
UP = (F(0), F(0), F(1))
TILTED = (F(2, 7), F(3, 7), F(6, 7))
OTHER = (F(2, 3), F(2, 3), F(1, 3))
TINY = F(1, 10**30)


def motion_from(moment, omega, gamma, i3=F(1)):
    return Kovalevskaya(HeavyTop((2 * i3, 2 * i3, i3), 1, (*moment, 0)), State(omega, gamma))


def tilted(exponent):
    """γ beside axis 3, where every start is on a degenerate level, at a distance of about 10^-exponent."""
    t = F(1, 10**exponent)
    return 2 * t / (1 + t * t), 0, (1 - t * t) / (1 + t * t)


def motion_level(motion):
    return KovalevskayaLevel.of(motion.top, motion.start)


def scale(motion, level):
    """What w is multiplied by from the units of one level to those of another: w goes like the square of the rate."""
    return (motion_level(motion).rate / level.rate) ** 2


def random_motion(seed):
    """The centre anywhere in the plane, |γ| not 1."""
    rng = random.Random(seed)
    moment = positive(rng) * rng.choice((1, -1)), rational(rng)
    return motion_from(moment, triple(rng), triple(rng), positive(rng))


NEAR = {"outside": (2, F(1, 3), F(1, 2)), "asymptotic": (-1, F(1, 4), F(1, 4)), "both": (F(1, 2), F(1, 3), 1)}
ALONG_1, LEVEL = (F(1), F(0)), (F(3, 5), F(4, 5), 0)
STARTS = {
    name: ((F(1), F(1, 3)), omega, gamma)
    for name, (omega, gamma) in {
        "q = 0": ((F(1, 2), 0, 1), TILTED),  # w1 infinite
        "p = q = 0": ((0, 0, 1), TILTED),
        "nearly q = 0": ((F(1, 2), TINY, 1), TILTED),
        "r = γ3 = 0": ((F(1, 2), F(1, 3), 0), LEVEL),  # both variables at turning points
        "nearly r = γ3 = 0": ((F(1, 2), F(1, 3), TINY), (F(3, 5), F(4, 5), TINY)),
        "q = r = γ3 = 0": ((F(-1, 2), 0, 0), LEVEL),
        "p = r = γ2 = 0": ((0, F(-1, 2), 0), (F(3, 5), 0, F(4, 5))),
        "at rest": ((0, 0, 0), TILTED),  # w1 infinite and w2 at a turning point
    }.items()
} | {
    name: (ALONG_1, omega, gamma)
    for name, (omega, gamma) in {
        "double root outside": ((F(1, 2), F(1, 3), 5), UP),
        "another outside": ((2, F(1, 3), F(1, 2)), UP),
        "nearly outside": ((2, F(1, 3), F(1, 2)), tilted(200)),
        "outside, tilted": ((F(-7, 6), -1, F(5, 3)), OTHER),
        "asymptotic": ((-1, F(1, 4), F(1, 4)), UP),
        "asymptotic, tilted": ((F(1, 3), F(1, 6), 1), OTHER),
        "asymptotic, third": ((-1, F(5, 6), F(-1, 3)), OTHER),
        "no azimuth, w2 at rest": ((F(-7, 6), F(-5, 6), -1), OTHER),
        "no azimuth, w2 at rest, level": ((F(-1, 2), 0, F(-4, 3)), (F(3, 5), 0, F(4, 5))),
        "no azimuth, w1 at rest": ((F(-7, 6), F(5, 6), F(-1, 6)), OTHER),
        "no azimuth, w1 at rest, up": ((0, F(-4, 3), 0), UP),
        **{f"near a degenerate level, {name}, 1e-{n}": (NEAR[name], tilted(n)) for name in NEAR for n in (1, 3)},
    }.items()
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_starts_of_few_small_numbers_are_solved_or_named(seed):
    # zeros and equal numbers make special levels and turning points of all kinds
    rng = random.Random(seed)
    few = (F(0), F(0), F(1), F(-1), F(1, 2), F(-1, 2), F(3, 5), F(4, 5))
    omega, gamma = triple(rng, lambda random: random.choice(few)), triple(rng, lambda random: random.choice(few))
    motion, refused = None, ""
    try:
        motion = motion_from((F(1), rng.choice(few)), omega, gamma)
    except NotInClass as error:
        refused = error.cause
    if motion is not None:
        assert_solves(motion, F(7, 3))
    else:
        assert any(word in refused for word in ("gamma != 0", "Delone", "degenerate"))


@pytest.mark.slow
@pytest.mark.parametrize(("level", "exponent"), [("asymptotic", 8), ("both", 4), ("both", 7)])
def test_nearer_theta_functions_take_over(level, exponent):
    motion = motion_from(ALONG_1, NEAR[level], tilted(exponent))
    assert_solves(motion, F(7, 3))
    assert any(isinstance(form, ThetaMotion) for form in motion.made.values())
    assert_overlap(motion.state(F(2), 100), Validated(motion.top, motion.start).state(F(2), 100))


@pytest.mark.parametrize("level", ["asymptotic", "both"])
def test_nearer_still_the_motion_is_refused_with_the_distance(level):
    with pytest.raises(NotInClass, match=r"to within .*e-12, the distance"):
        motion_from(ALONG_1, NEAR[level], tilted(12))
    with pytest.raises(NotInClass, match=r"to within .*e-200, the distance"):
        motion_from(ALONG_1, NEAR[level], tilted(200))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_theta_functions_and_abel_inversion_meet(seed):
    motion = random_motion(seed)
    level = KovalevskayaLevel.of(motion.top, motion.start)
    with working_precision(256):
        forms = AbelMotion.of(level, 1 << 17), ThetaMotion.of(level)
        for time in (F(0), F(1), F(-1000), F(10**9)):
            one, two = (form.at(time, 1) for form in forms)
            assert_overlap(one, two)
            assert max(abs(a - b).upper() for a, b in zip(one, two, strict=True)) < arb("1e-45")


@pytest.mark.slow
@pytest.mark.parametrize("omega", [(0, 0, 0), (F(1, 2), 0, 1)])
def test_theta_functions_and_abel_inversion_meet_where_q_vanishes(omega):
    motion = motion_from(ALONG_1, omega, TILTED)
    with working_precision(320):
        theta = ThetaMotion.of(KovalevskayaLevel.of(motion.top, motion.start))
        for time in (F(0), F(7, 3)):
            assert_overlap(theta.at(time, 1), motion.state(time, 200))
        rows = theta.at(F(7, 3), 3)
    series = motion.series(F(7, 3), 3, 200)
    with working_precision(320):
        assert all(a[n].overlaps(b[n]) for a, b in zip(rows, series, strict=True) for n in range(3))


def test_the_exponent_of_an_asymptotic_motion_is_that_of_its_enclosure():
    motion = motion_from(ALONG_1, (-1, F(1, 4), F(1, 4)), UP)
    exponent, enclosure = float(motion.exponent(60)), Validated(motion.top, motion.start)
    logarithms = []
    for time in (F(8), F(24)):
        state = [midpoint(value) for value in enclosure.state(time, 100)]
        level = KovalevskayaLevel.of(motion.top, State(state[:3], state[3:]))
        with working_precision(200):
            start = start_of(level)
            # w - e is as the square of the distance, one of the two variables takes part
            gaps = [abs(start.above(k, ball(motion_level(motion).double() * scale(motion, level)))) for k in (0, 1)]
            logarithms.append(float(min(gaps, key=float).log()))
    assert (logarithms[0] - logarithms[1]) / 32 == pytest.approx(exponent, rel=0.1)
    with pytest.raises(NotInClass, match="not asymptotic"):
        random_motion(1).exponent(60)


def test_a_factor_is_told_only_where_one_alone_is_possible():
    with working_precision(128), series_length(ORDERS):
        right = acb_series([arb(0, 1), acb(2, 1), 3])
        for unit in (acb(1), acb(0, 1), acb(-1), acb(0, -1)):
            assert _fourth_root(right * unit, right) == unit
        both, none = acb_series([acb(arb(0, 3), arb(0, 3))]), acb_series([2])
        for left in (both, none):
            with pytest.raises(Undecided):
                _fourth_root(left, acb_series([1]))
