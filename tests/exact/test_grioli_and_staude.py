"""Motions in circular functions and constants: Grioli's precession, Staude's rotations."""

import random
from fractions import Fraction

import pytest
from flint import arb

from heavytop.errors import InputError, NotInClass
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.grioli import Grioli, grioli_motion
from heavytop.exact.cases.staude import (
    Staude,
    staude_directions,
    staude_motion,
    staude_rate,
    staude_rate_squared,
    staude_rotations,
    staude_stability,
)
from heavytop.exact.catalogue import find
from heavytop.precision import cross, dot
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_agrees, assert_attitude, assert_narrow, assert_solves, positive, rational, triple


def random_grioli(rng):
    between = lambda: Fraction(rng.randint(1, 19), 20)  # noqa: E731
    direction, shape = between(), between()
    while shape == direction:
        shape = between()
    return grioli_motion(direction, shape, rational(rng), positive(rng) * rng.choice((-1, 1)), positive(rng))


@pytest.mark.parametrize("seed", range(60))
def test_every_grioli_precession_solves_all_six_equations(seed):
    rng = random.Random(seed)
    motion = random_grioli(rng)
    motion.start.require_unit_gamma()
    assert_solves(motion, rational(rng, size=30))


def test_a_grioli_top_is_asymmetric_and_its_attitude_turns_with_it():
    motion = grioli_motion(Fraction(1, 3), Fraction(1, 4), Fraction(2, 7), Fraction(3, 2))
    assert len(set(motion.top.inertia)) == 3
    assert_attitude(motion, Fraction(5, 3))
    assert_narrow(motion, Fraction(10**9))
    assert_agrees(motion, Fraction(2))


def test_grioli_takes_any_length_of_gamma():
    motion = grioli_motion(Fraction(1, 3), Fraction(1, 4), Fraction(2, 7), Fraction(3, 2))
    top = HeavyTop(motion.top.inertia, Fraction(1, 7), motion.top.centre)
    assert_solves(Grioli(top, State(motion.start.omega, [7 * g for g in motion.start.gamma])), Fraction(3))


def test_what_is_not_grioli_is_refused_with_the_test_that_failed():
    motion = grioli_motion(Fraction(1, 3), Fraction(1, 4), Fraction(2, 7), Fraction(3, 2))
    omega, gamma = motion.start.omega, motion.start.gamma
    with pytest.raises(NotInClass, match=r"P b = 1\."):
        Grioli(HeavyTop((3, 2, 1), 1, (1, 1, 1)), motion.start)
    with pytest.raises(NotInClass, match="times the difference = -3"):
        Grioli(HeavyTop((3, 2, 1), 1, (1, 0, 2)), motion.start)
    with pytest.raises(NotInClass, match="difference of spin and precession"):
        Grioli(motion.top, State((omega[0], omega[1] + 1, omega[2]), gamma))
    with pytest.raises(NotInClass, match=r"gamma as it follows from Omega, but the difference = \(1/7, 0, 0\)"):
        Grioli(motion.top, State(omega, (gamma[0] + Fraction(1, 7), *gamma[1:])))
    with pytest.raises(InputError, match="No Grioli top"):
        grioli_motion(Fraction(1, 3), Fraction(1, 3), Fraction(0), Fraction(1))


@pytest.mark.parametrize("seed", range(50))
def test_every_permanent_rotation_solves_all_six_equations(seed):
    rng = random.Random(seed)
    motion = staude_motion(triple(rng, positive), triple(rng), rational(rng), rational(rng))
    assert_solves(motion, rational(rng, size=100))


@pytest.mark.parametrize("seed", range(4))
def test_every_permanent_rotation_of_a_gyrostat_solves_all_six_equations(seed):
    rng = random.Random(seed)
    data = triple(rng, positive), triple(rng), rational(rng), rational(rng)
    motion = staude_motion(*data, rotor=(positive(rng), rational(rng), rational(rng)))
    assert find(motion.top, motion.start, HEAVY_GYROSTAT).method == motion.method
    assert_solves(motion, Fraction(7, 3))
    assert_attitude(motion, Fraction(7, 3))


def test_staudes_condition_has_no_rotor():
    top = HeavyTop((3, 2, 1), 1, (1, 2, 3), (0, 0, 1))
    with pytest.raises(NotInClass, match="rotor"):
        staude_rotations(top)
    with pytest.raises(NotInClass, match="rotor"):
        staude_rate_squared(top, (1, 0, 0))


def test_the_attitude_of_a_permanent_rotation_turns_with_it():
    gamma = (Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))
    assert_attitude(staude_motion((3, 2, 1), gamma, Fraction(3, 2), Fraction(1, 2)), Fraction(2, 7))
    assert_attitude(staude_motion((3, 2, 1), gamma, Fraction(0), Fraction(1, 2)), Fraction(2, 7))


@pytest.mark.parametrize("centre", [(1, 2, 3), (1, 0, 2), (0, 1, 0), ("1/2", "1/3", "1/5")])
def test_every_direction_found_lies_on_the_cone(centre):
    top = HeavyTop((3, 2, 1), 1, centre)
    directions = list(staude_directions(top, 6))
    assert len(directions) > 10
    for gamma in directions:
        assert dot(top.moment, cross(top.angular_momentum(gamma), gamma)) == 0


def test_the_search_finds_rotations_that_are_exact_equilibria():
    # γ × (P r − ω² I γ) = 0 for γ = (3/5, 4/5, 0), ω = 1: (0, 4/5, 0) − (3/5, 8/5, 0) = −γ
    top = HeavyTop((1, 2, 4), 1, (0, Fraction(4, 5), 0))
    found = staude_rotations(top, 5)
    assert State((Fraction(3, 5), Fraction(4, 5), 0), (Fraction(3, 5), Fraction(4, 5), 0)) in found
    for start in found:
        start.require_unit_gamma()
        Staude(top, start)


def test_an_irrational_rate_comes_as_a_ball():
    top = HeavyTop((3, 2, 1), 1, (1, 2, 3))
    gamma = next(g for g in staude_directions(top, 3) if all(g) and staude_or_none(top, g))
    square = staude_rate_squared(top, gamma)
    assert abs(staude_rate(top, gamma, 300) ** 2 - arb(square.numerator) / square.denominator).abs_upper() < arb(
        "1e-14"
    )
    rate = staude_rate(top, gamma, 300)
    assert rate.rad() < arb("1e-80")


def staude_or_none(top, gamma):
    try:
        return staude_rate_squared(top, gamma)
    except NotInClass:
        return None


def test_what_cannot_turn_steadily_is_refused_with_the_reason():
    top = HeavyTop((3, 2, 1), 1, (1, 2, 3))
    with pytest.raises(NotInClass, match="P r·"):
        staude_rate_squared(top, (Fraction(1), Fraction(1), Fraction(2)))
    with pytest.raises(NotInClass, match="not along this principal axis"):
        staude_rate_squared(top, (Fraction(1), Fraction(0), Fraction(0)))
    with pytest.raises(InputError, match="zero vector"):
        staude_rate_squared(top, (Fraction(0), Fraction(0), Fraction(0)))
    assert staude_rate_squared(HeavyTop((3, 2, 1), 1, (0, 0, 1)), (Fraction(0), Fraction(0), Fraction(1))) is None
    with pytest.raises(NotInClass, match=r"Omega' = gamma' = 0, but their components = \("):
        Staude(top, State((1, 0, 0), (1, 0, 0)))


def test_the_sleeping_top_is_stable_where_it_turns_fast_enough() -> None:
    """Ω3² > 4 P c I1/I3² (Lagrange)."""
    top = HeavyTop((2, 2, 1), 3, (0, 0, 1))
    upright = (0, 0, 1)
    assert staude_stability(Staude(top, State((0, 0, Fraction(49, 10)), upright))) == "spectrally stable"
    assert staude_stability(Staude(top, State((0, 0, Fraction(48, 10)), upright))) == "unstable"


def test_a_free_top_turns_stably_about_its_largest_and_smallest_moment_only() -> None:
    for axis, verdict in ((0, "spectrally stable"), (1, "unstable"), (2, "spectrally stable")):
        unit = [Fraction(int(i == axis)) for i in range(3)]
        # weight along the axis, too small to matter: P r = 0 leaves gamma's own rotation, which first order counts
        motion = Staude(HeavyTop((3, 2, 1), Fraction(1, 1000), unit), State([2 * u for u in unit], unit))
        assert staude_stability(motion) == verdict


def test_the_saddle_of_the_paper_s_gyrostat_is_unstable_and_the_hanging_top_is_not() -> None:
    """MATH: exponents ±k/2 of the gyrostat at Ω = (0, α, 0); ρ < 2 a saddle-centre of the heavy top."""
    known = ErshkovPartial(Fraction(1), Fraction(6), Fraction(1))
    saddle = State((0, 1, 0), (0, 1, 0))
    assert staude_stability(Staude(known.top, saddle, GYROSTAT)) == "unstable"
    assert staude_stability(Staude(known.top, saddle)) == "unstable"
    hanging = Staude(HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, Fraction(1, 2)), (0, 0, -1)))
    assert staude_stability(hanging) == "spectrally stable"
