"""The printed formulas: their relations to each other, to the stable forms, and their death in floating point."""

from fractions import Fraction
from random import Random

import numpy
import pytest

from heavytop.exact.flint.balls import FUNCTIONS, ball, working_precision
from heavytop.features.claims.claim_error import evaluation_error, exact_claim, first_failure
from heavytop.features.claims.library import ershkov
from heavytop.features.claims.library.ershkov import PartialCase
from heavytop.precision import DOUBLE, EXTENDED, QUAD, number, real
from support.helpers import positive

TWO, SIX = (PartialCase(Fraction(1), Fraction(ratio), Fraction(1)) for ratio in (2, 6))


def random_case(random: Random) -> PartialCase:
    i3 = positive(random)
    return PartialCase(positive(random), i3 * (1 + positive(random)), i3)


def test_printed_and_stable_forms_agree_for_t_below_0_and_on_the_smooth_branch_after() -> None:
    random = Random(1)
    for _ in range(20):
        case = random_case(random)
        for sign in (-1, 1):
            time = sign * positive(random) / 10 / case.solves.rate
            claim = exact_claim(case, time, "smooth", 160)
            for a, b in zip((*claim.omega, *claim.gamma), case.solves.state(time, 160), strict=True):
                assert a.overlaps(b)
            phi, theta, psi = case.solves.angles(time, 160)
            assert claim.psi.overlaps(psi)
            if sign < 0:
                assert claim.phi.overlaps(phi)
                assert claim.theta.overlaps(theta)


def test_on_the_printed_branch_omega_1_has_the_wrong_sign_after_0() -> None:
    smooth, printed = (exact_claim(SIX, Fraction(1, 3), branch) for branch in ("smooth", "printed"))
    assert printed.omega[0] > 0 > smooth.omega[0]
    assert printed.omega[0].overlaps(-smooth.omega[0])
    before = [exact_claim(SIX, Fraction(-1, 3), branch) for branch in ("smooth", "printed")]
    assert before[0].omega[0].overlaps(before[1].omega[0])


def test_psi_of_4_6_is_a_straight_line_and_its_printed_reading_has_a_kink_at_0() -> None:
    random = Random(2)
    for _ in range(10):
        case = random_case(random)
        slope = case.alpha * (case.i1 + case.i3) / (2 * case.i3)
        for time in (Fraction(-1, 5), Fraction(1, 7)):
            time = time / case.solves.rate
            assert exact_claim(case, time, "smooth").psi.contains(ball_at(slope * time))
        # with u = √Ω2 the logarithm changes its sign for t > 0, and with it k/2 in the slope
        bent = exact_claim(case, time, "printed").psi
        assert bent.contains(ball_at((slope + case.solves.rate) * time))


def ball_at(value: Fraction):
    with working_precision(400):
        return ball(value)


def test_the_two_printings_of_a_phi_and_theta_agree() -> None:
    case = PartialCase(Fraction(3, 2), Fraction(7), Fraction(2))
    with working_precision(200):
        c = ershkov.constants(ball(case.i1), ball(case.i3), ball(case.c1), FUNCTIONS)
        assert c.alpha.overlaps(ball(case.alpha))
        assert c.c0.overlaps(ball(case.i1 * case.alpha))
        assert ershkov.a_of_6_2(c.i1, c.i3, c.alpha, FUNCTIONS).overlaps(c.a)
        assert (c.a * c.alpha.sqrt()).overlaps(ball(case.solves.rate))
        u = ershkov.u(c.a, c.alpha, ball(Fraction(-1, 2)), FUNCTIONS)
        assert ershkov.phi(c, u, FUNCTIONS).overlaps(ershkov.phi_of_6_1(c.alpha, u, FUNCTIONS))
        assert ershkov.theta(c, u, FUNCTIONS).overlaps(ershkov.theta_of_6_1(c.alpha, u, FUNCTIONS))


@pytest.mark.parametrize("ratio", [2, 6])
def test_printed_psi_in_double_has_under_four_digits_at_36_and_none_from_38(ratio: int) -> None:
    case = {2: TWO, 6: SIX}[ratio]
    for sign in (-1, 1):
        times = {kt: sign * Fraction(kt) / case.solves.rate for kt in (36, 38, 60)}
        errors = [evaluation_error(case, time, DOUBLE, "printed").psi for time in times.values()]
        assert float(errors[0]) / float(abs(exact_claim(case, times[36], "printed").psi)) > 1e-4
        assert [error.is_finite() for error in errors] == [True, False, False]


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(237)], ids=lambda p: p.name)
def test_the_stable_forms_keep_full_precision_everywhere(precision) -> None:
    for kt in (-800, -100, -36, -1, Fraction(-1, 1000), Fraction(1, 1000), 1, 36, 100, 800):
        error = evaluation_error(SIX, Fraction(kt) / SIX.solves.rate, precision, "stable")
        scale = max(6, abs(float(kt)))
        for value in (error.omega, error.phi, error.theta, error.psi):
            assert float(value) <= 4 * float(precision.eps) * scale


def test_printed_formulas_overflow_in_double_at_709() -> None:
    for time, precision, is_finite in ((-709, DOUBLE, True), (-710, DOUBLE, False), (-710, EXTENDED, True)):
        assert evaluation_error(TWO, Fraction(time), precision, "printed").omega.is_finite() is is_finite


def test_6_1_divides_by_0_at_the_start() -> None:
    with numpy.errstate(divide="ignore"):
        u = number(Fraction(0), DOUBLE)
        assert numpy.isinf(1 / (u * u))
    assert not exact_claim(TWO, Fraction(0), "smooth").phi.is_finite()


def test_the_first_failure_is_the_time_from_which_on_nothing_is_finite() -> None:
    with working_precision(64):
        good, bad = ball(1), ball(-1).sqrt()
    times = [Fraction(t) for t in (1, 2, 3, 4)]
    assert first_failure(times, [good, bad, good, bad]) == 4
    assert first_failure(times, [good, bad, bad, bad]) == 2
    assert first_failure(times, [bad, bad, bad, good]) is None
