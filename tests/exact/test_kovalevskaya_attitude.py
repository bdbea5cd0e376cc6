"""The attitude of Kovalevskaya's top: the vector whose azimuth is an Abel integral, every level, any time."""

import random
from fractions import Fraction
from itertools import cycle

import pytest
from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.cases.kovalevskaya import Kovalevskaya, along_gamma, level_vector
from heavytop.exact.cases.kovalevskaya_theta import KovalevskayaLevel, start_of
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.precision import cross, dot
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_attitude, assert_meets, attitude_of, positive, rational, triple

F = Fraction
UP, TILTED, OTHER = (F(0), F(0), F(1)), (F(2, 7), F(3, 7), F(6, 7)), (F(2, 3), F(2, 3), F(1, 3))
STARTS = {
    "generic": ((F(1, 3), F(4, 5), F(-7, 10)), TILTED),
    "at rest": ((0, 0, 0), TILTED),
    "no area": ((F(1, 2), F(-1, 2), 0), OTHER),
    "q = 0": ((F(1, 2), 0, 1), TILTED),
    "double root outside": ((F(1, 2), F(1, 3), 5), UP),
    "asymptotic": ((-1, F(1, 4), F(1, 4)), UP),
    "asymptotic, tilted": ((F(1, 3), F(1, 6), 1), OTHER),
}


def motion_from(omega, gamma, moment=(F(1), F(0)), i3=F(1)):
    return Kovalevskaya(HeavyTop((2 * i3, 2 * i3, i3), 1, (*moment, 0)), State(omega, gamma))


@pytest.mark.parametrize("seed", range(3))
def test_the_vector_is_level_and_its_azimuth_turns_as_the_integrals_say(seed):
    rng = random.Random(seed)
    top = HeavyTop((2, 2, 1), 1, (positive(rng), rational(rng), 0))
    level = KovalevskayaLevel.of(top, State(triple(rng), triple(rng)))
    with working_precision(300, 3):
        motion = [x * 1 for x in start_of(level).motion]
        vector = level_vector(level, motion)
        gamma, size = motion[3:], ball(level.gamma_square).sqrt()
        assert dot(vector, gamma)[0].contains(0)
        square = dot(vector, vector)[0]
        # c² (−4q² (e − w1)(e − w2)), exactly, by the level alone
        found = ball(level.separated(level.double()) / level.moment_square)
        assert square.overlaps(found)
        assert (square - found).abs_upper() < abs(found) * arb("1e-70")
        apart = ball(level.double() ** 2 - level.fourth)
        wanted = along_gamma(level) / 2 * (1 + 4 * motion[1][0] ** 2 * apart / found)
        # in space v' is that in the body + Ω × v
        rates = [x.derivative()[0] for x in vector]
        moved = [a + b[0] for a, b in zip(rates, cross(motion[:3], vector), strict=True)]
        across = cross([g[0] / size for g in gamma], [v[0] for v in vector])
        assert (dot(moved, across) / square - wanted).contains(0)
        assert abs(dot(moved, across) / square - wanted).upper() < arb("1e-60")


@pytest.mark.slow
@pytest.mark.parametrize("name", STARTS)
def test_the_enclosure_holds_the_attitude(name):
    assert_meets(motion_from(*STARTS[name]), (F(0), F(3, 2), F(-6)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_random_tops_with_the_centre_anywhere(seed):
    rng = random.Random(seed)
    moment = positive(rng) * rng.choice((1, -1)), rational(rng)
    gamma = rng.sample(TILTED, 3)
    assert_meets(motion_from(triple(rng), gamma, moment, positive(rng)), (F(2),))


@pytest.mark.slow
def test_many_turns_are_counted():
    assert_meets(motion_from(*STARTS["generic"]), (F(30),), 140)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "time"), list(zip(STARTS, cycle((F(10**6), F(-(10**12)))))))
def test_at_any_time_the_attitude_turns_with_the_body(name, time):
    assert_attitude(motion_from(*STARTS[name]), time)


def test_with_a_variable_at_rest_the_attitude_is_the_enclosures():
    motion = motion_from((0, F(-4, 3), 0), UP)
    with pytest.raises(OutOfReach, match="at rest"):
        motion.attitude(F(1), 100)
    assert "validated" in attitude_of(motion, F(2), 170)[0]
    assert_meets(motion, (F(2),))


@pytest.mark.parametrize("area", [F(1, 100), F(1, 10**30)])
def test_near_to_no_area_the_attitude_holds_or_is_the_enclosures(area):
    # the pole of the azimuth then lies beside a turning point
    motion = motion_from((F(1, 4) + area, F(1, 3), F(1, 5)), (F(4, 5), F(-3, 5), 0))
    assert_meets(motion, (F(2),))
