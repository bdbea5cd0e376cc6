"""The checks that prove the closed forms catch what is wrong."""

from dataclasses import dataclass
from fractions import Fraction

import pytest
from flint import arb

from heavytop.exact.cases.euler import Euler
from heavytop.exact.closed_form import Renamed
from heavytop.exact.flint.balls import working_precision
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import assert_attitude, assert_solves

GAMMA = (Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))
EULER = Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), GAMMA))


@dataclass(frozen=True)
class Disturbed:
    """A motion with one component multiplied by 1 + 10^-35: right to 35 digits."""

    solution: Euler
    component: int

    top = property(lambda self: self.solution.top)
    start = property(lambda self: self.solution.start)
    system = property(lambda self: self.solution.system)

    def _disturb(self, values):
        values = list(values)
        with working_precision(400):
            values[self.component] = values[self.component] * (1 + arb(10) ** -35)
        return values

    def state(self, time, bits):
        return self._disturb(self.solution.state(time, bits))

    def series(self, time, length, bits):
        return self._disturb(self.solution.series(time, length, bits))


class WithoutOrientation(Renamed):
    """An odd renaming that forgets to turn Ω."""

    def _renamed(self, values):
        return [*(-w for w in super()._renamed(values)[:3]), *super()._renamed(values)[3:]]


@pytest.mark.parametrize("component", range(6))
def test_a_fault_in_the_thirty_fifth_digit_breaks_the_residual(component):
    with pytest.raises(AssertionError):
        assert_solves(Disturbed(EULER, component), Fraction(7, 3))


def test_a_renaming_of_the_wrong_orientation_is_caught():
    with pytest.raises(AssertionError):
        assert_solves(WithoutOrientation(EULER, (1, 0, 2)), Fraction(7, 3))


def test_an_attitude_that_turns_the_wrong_way_is_caught():
    class Backwards(Euler):
        def attitude(self, time, bits):
            return Euler(self.top, self.start).attitude(-time, bits)

    with pytest.raises(AssertionError):
        assert_attitude(Backwards(EULER.top, EULER.start), Fraction(1, 2))
