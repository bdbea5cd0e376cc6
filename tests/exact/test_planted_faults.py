"""The checks that prove the closed forms catch what is wrong."""

from fractions import Fraction

import pytest
from flint import arb

from heavytop.exact.cases.euler import Euler
from heavytop.exact.closed_form import Renamed
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import Changed, assert_attitude, assert_solves

GAMMA = (Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))
EULER = Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), GAMMA))


class WithoutOrientation(Renamed):
    """An odd renaming that forgets to turn Ω."""

    def _renamed(self, values):
        return [*(-w for w in super()._renamed(values)[:3]), *super()._renamed(values)[3:]]


@pytest.mark.parametrize("component", range(6))
def test_a_fault_in_the_thirty_fifth_digit_breaks_the_residual(component):
    """One component is multiplied by 1 + 10^-35: it is right to 35 digits."""

    def disturbed(values, _time):
        return [v * (1 + arb(10) ** -35 * (i == component)) for i, v in enumerate(values)]

    with pytest.raises(AssertionError):
        assert_solves(Changed(EULER, disturbed), Fraction(7, 3))


def test_a_renaming_of_the_wrong_orientation_is_caught():
    with pytest.raises(AssertionError):
        assert_solves(WithoutOrientation(EULER, (1, 0, 2)), Fraction(7, 3))


def test_an_attitude_that_turns_the_wrong_way_is_caught():
    class Backwards(Euler):
        def attitude(self, time, bits):
            return Euler(self.top, self.start).attitude(-time, bits)

    with pytest.raises(AssertionError):
        assert_attitude(Backwards(EULER.top, EULER.start), Fraction(1, 2))
