"""The claim as a motion of the heavy top: how wrong, against truths that do not come from it."""

from fractions import Fraction

import pytest
from flint import arb

from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.flint.balls import ball, midpoint, radius, working_precision
from heavytop.features.claims.claim_error import CLAIM_XI, claim_attitude, exact_claim, model_error
from heavytop.features.claims.kinds.claim_model import true_motion
from heavytop.features.claims.library.ershkov import PartialCase
from heavytop.integrate.trajectory import Problem
from heavytop.measure.truth import compute

TWO = PartialCase(Fraction(1), Fraction(2), Fraction(1))
SIX = PartialCase(Fraction(1), Fraction(6), Fraction(1))


@pytest.mark.parametrize(
    ("case", "time", "expected"),
    [
        *((TWO, *pair) for pair in (("0.1", "0.0024912"), ("1", "0.173905"), ("2", "0.220605"))),
        *((SIX, *pair) for pair in (("0.1", "0.181054"), ("1", "2.920776"))),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_error_in_omega_is_the_published_one_in_both_directions(case, time, expected, sign) -> None:
    time = sign * Fraction(time)
    truth, _ = true_motion(case, [time])
    off = model_error(case, time, truth).omega
    assert abs(float(off) - float(expected)) < 0.5 * 10 ** -len(expected.partition(".")[2])


def test_the_error_in_gamma_starts_like_half_k_t() -> None:
    for case in (TWO, SIX):
        time = Fraction(1, 1000)
        truth, _ = true_motion(case, [time])
        error = model_error(case, time, truth)
        assert float(error.gamma) == pytest.approx(float(case.solves.rate) / 2000, rel=1e-2)
        assert float(error.omega) < 10 * float(case.solves.rate) ** 2 / 10**6


@pytest.mark.slow
def test_the_computed_truth_and_the_closed_form_agree_where_there_are_both() -> None:
    times = [Fraction(1, 2), Fraction(3)]
    delone = DeloneHomoclinic(TWO.alpha, TWO.i1)
    given = [lambda precision: Problem.of(delone.top, delone.start, precision, xi=CLAIM_XI)]
    (reference,) = compute(given, times, 256)
    truth, against = true_motion(TWO, times)
    assert against.how == "proven"
    for time in times:
        with working_precision(200):
            for a, b in zip(truth(time), reference.state(time), strict=True):
                assert abs(a - b) < ball(Fraction(1, 10**40))


def test_claim_and_truth_start_from_the_same_attitude() -> None:
    with working_precision(160):
        for value, exact in zip(claim_attitude(TWO, Fraction(0), "smooth"), CLAIM_XI, strict=True):
            assert value.overlaps(ball(exact))
    tiny = Fraction(-1, 10**6)
    truth, _ = true_motion(TWO, [tiny])
    assert float(model_error(TWO, tiny, truth).attitude) < 2e-6


def test_angles_are_compared_modulo_a_turn() -> None:
    truth, _ = true_motion(TWO, [Fraction(5)])
    error = model_error(TWO, Fraction(5), truth)
    for angle in (error.phi, error.theta, error.psi):
        assert abs(float(angle)) <= float(arb.pi()) + 1e-9


def test_the_exact_claim_is_a_narrow_ball_far_out() -> None:
    claim = exact_claim(SIX, Fraction(-150), "printed", 100)
    assert all(radius(v) < Fraction(1, 2**99) * max(1, abs(midpoint(v))) for v in (*claim.omega, claim.psi))
