"""Goryachev's, N. Kowalewski's and Chaplygin's motions, and the rational data near them."""

import random
from fractions import Fraction

import pytest
from flint import arb

from heavytop.errors import InputError, NotInClass
from heavytop.exact.cases.algebraic_starts import (
    chaplygin_curve,
    chaplygin_motion,
    goryachev_curve,
    goryachev_motion,
    kowalewski_curve,
    kowalewski_motion,
)
from heavytop.exact.cases.lagrange import polynomial
from heavytop.exact.cases.one_interval import IntervalCurve, gaps, quadratics
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint
from support.proofs import AsRounded, assert_algebraic_solves, assert_attitude

F = Fraction
# builder, B from and to, sign of the other number
FAMILIES = {
    "goryachev": (goryachev_motion, F(601, 1000), F(624, 1000), -1),
    "kowalewski": (kowalewski_motion, F(589, 1000), F(644, 1000), 1),
    "chaplygin": (chaplygin_motion, F(1501, 1000), F(1596, 1000), 1),
}


def random_motion(name, seed):
    """Any B of the range, any unit of time, any place in the gap, any signs."""
    build, low, high, side = FAMILIES[name]
    rng = random.Random(f"{name} {seed}")
    second = low + (high - low) * F(rng.randint(0, 64), 64)
    other = side * F(rng.randint(1, 40), rng.randint(1, 9))
    first, last = gaps(build(second, other).curve)[0]
    place = F(first) + (F(last) - F(first)) * F(rng.randint(1, 31), 32)
    return build(second, other, place, (rng.choice((1, -1)), rng.choice((1, -1))))


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", range(5))
def test_every_random_motion_solves_all_six_equations(name, seed):
    motion = random_motion(name, seed)
    for time in (F(0), F(7, 3), F(-(10**6))):
        assert_algebraic_solves(motion, time)
    assert_attitude(AsRounded(motion), F(7, 3))
    assert all(x.rad() < arb("1e-50") for x in motion.attitude(F(10**6), 180))


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_the_enclosure_of_rational_data_departs_by_their_rounding(name):
    motion = random_motion(name, 7)
    top, start = motion.rounded(220)
    assert sum(g * g for g in start.gamma) == 1
    off = [abs(midpoint(a) - b) for a, b in zip(motion.start(300), start.flat, strict=True)]
    assert max(off) <= F(1, 2**217) * max(1, *map(abs, start.flat))
    for time in (F(10), F(-10)):
        for a, b in zip(motion.state(time, 170), Validated(top, start).state(time, 170), strict=True):
            assert abs(a - b) < arb("1e-50")
    assert isinstance(find(top, start), Validated)


@pytest.mark.parametrize("second", [F(61, 100), F(3, 7), F(11, 5), F(5, 8) + F(1, 10**20)])
def test_the_identities_hold_exactly_for_all_moments(second):
    """Curve.of raises NotInClass where one of the six equations fails as an identity between polynomials."""
    for make in (goryachev_curve, kowalewski_curve, chaplygin_curve):
        curve = make(second, F(-3, 7))
        s, t, u = curve.heights
        norm = s * s + curve.second * t * t + curve.third * u * u
        assert norm.degree() == 0
        assert curve.gamma_square() == F(str(norm[0]))
    b2, b0, c2, c0 = quadratics(F(1), second, F(13, 10))
    assert IntervalCurve.of((F(1), second, F(13, 10)), polynomial(b0, F(0), b2), polynomial(c0, F(0), c2)).power == 1


@pytest.mark.parametrize("term", range(3))
def test_a_planted_fault_breaks_an_identity(term):
    right = goryachev_curve(F(61, 100), F(-1))
    for which in (0, 1):
        parts = [right.second, right.third]
        parts[which] = parts[which] + polynomial(*[F(0)] * term, F(1, 10**30))
        with pytest.raises(NotInClass, match="is not 0"):
            IntervalCurve.of(right.inertia, *parts)


def test_chaplygins_motion_starts_from_rest():
    start = chaplygin_motion(F(31, 20), F(1)).start(200)
    assert all(abs(w) < arb("1e-60") for w in start[:3])
    assert abs(start[3]) < arb("1e-60")


def test_what_is_not_real_is_refused_with_where_it_is():
    with pytest.raises(InputError, match="Real motions have it in"):
        goryachev_motion(F(61, 100), F(-1), F(2))
    with pytest.raises(InputError, match="No top has Goryachev's motion"):
        goryachev_motion(F(9, 16), F(-1))
    with pytest.raises(InputError, match="No top has Goryachev's motion"):
        goryachev_motion(F(1, 2), F(-1))
    with pytest.raises(InputError, match=r"is not real|No top"):
        kowalewski_motion(F(9, 10), F(1))
