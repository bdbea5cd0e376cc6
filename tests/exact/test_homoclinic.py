"""The two homoclinic closed forms beside the contract: angles and attitude, the saddle, what is refused."""

from fractions import Fraction
from random import Random

import pytest

from heavytop.errors import NotInClass
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial, hyperbolic_angles
from heavytop.exact.flint.balls import FUNCTIONS, ball, working_precision
from heavytop.top.attitude import attitude_from_angles, gamma_from_angles, perpendicular
from support.helpers import positive
from support.proofs import assert_overlap

BOTH = [ErshkovPartial(Fraction(3, 4), Fraction(5), Fraction(2)), DeloneHomoclinic(Fraction(3, 4), Fraction(5))]
STARTS = {known.method: known for known in BOTH}


def random_delone(seed):
    rng = Random(seed)
    return DeloneHomoclinic(positive(rng), positive(rng))


def random_partial(seed):
    rng = Random(seed)
    i3 = positive(rng)
    return ErshkovPartial(positive(rng), i3 * (1 + positive(rng)), i3)


@pytest.mark.parametrize("known", BOTH)
def test_angles_and_attitude_agree_with_the_state_on_both_sides_of_the_pole(known) -> None:
    for time in (Fraction(-3), Fraction(-1, 7), Fraction(1, 9), Fraction(4)):
        state, (phi, theta, psi) = known.state(time, 150), known.angles(time, 150)
        with working_precision(150):
            gamma = gamma_from_angles(phi, theta, FUNCTIONS)
            xi = attitude_from_angles(phi, theta, psi, FUNCTIONS)
        assert_overlap(gamma, state[3:])
        assert_overlap(xi, known.attitude(time, 150))


def test_the_angles_of_the_partial_case_keep_their_digits_at_both_ends() -> None:
    with working_precision(100):
        phi, theta = hyperbolic_angles(ball(Fraction(-200)), FUNCTIONS)
        assert phi.rel_accuracy_bits() > 80
        assert (theta - ball(1).acos()).is_finite()


@pytest.mark.parametrize("data", [(0, 2, 1), (-1, 2, 1), (1, 1, 1), (1, 1, 2), (1, 2, 0)])
def test_data_outside_the_partial_case_are_refused(data) -> None:
    with pytest.raises(NotInClass):
        ErshkovPartial(*(Fraction(v) for v in data))


def test_the_default_attitude_of_a_start_at_the_pole_is_e1() -> None:
    assert perpendicular(DeloneHomoclinic(Fraction(1), Fraction(2)).start.gamma) == (1, 0, 0)
