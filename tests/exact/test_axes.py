"""Renaming of the axes, even and odd, proven by the residual in the renamed equations."""

from fractions import Fraction

import pytest

from heavytop.errors import NotInClass
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.euler import Euler
from heavytop.exact.closed_form import ALL, Renamed, inverse, renamed_state, renamed_top
from heavytop.top.attitude import perpendicular
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State
from rational_motions import bobylev_steklov_motion, grioli_motion
from support.proofs import assert_attitude, assert_solves

UNIT = (Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))
STEKLOV = bobylev_steklov_motion(
    (Fraction(3, 2), Fraction(1)), Fraction(1), Fraction(1, 2), Fraction(1, 3), Fraction(2)
)
EULER = Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), UNIT))


@pytest.mark.parametrize("axes", ALL)
def test_a_renamed_motion_solves_the_equations_of_the_renamed_top(axes):
    for solution in (STEKLOV, EULER, grioli_motion(Fraction(1, 3), Fraction(1, 4), Fraction(2, 7), Fraction(3, 2))):
        renamed = Renamed(solution, axes)
        assert renamed.top == renamed_top(solution.top, axes)
        assert_solves(renamed, Fraction(7, 3))


@pytest.mark.parametrize("axes", ALL)
def test_renaming_back_gives_the_same_top_and_start(axes):
    top, start = renamed_top(STEKLOV.top, axes), renamed_state(STEKLOV.start, axes)
    assert renamed_top(top, inverse(axes)) == STEKLOV.top
    assert renamed_state(start, inverse(axes)) == STEKLOV.start


@pytest.mark.parametrize("axes", ALL)
def test_the_attitude_starts_at_the_usual_place_and_turns_with_the_renamed_body(axes):
    renamed = Renamed(EULER, axes)
    for value, wanted in zip(renamed.attitude(Fraction(0), 100), perpendicular(renamed.start.gamma), strict=True):
        assert abs(float(value) - float(wanted)) < 1e-14
    assert_attitude(renamed, Fraction(1, 2))


def test_an_odd_renaming_that_keeps_the_rotor_solves_the_gyrostat():
    renamed = Renamed(partial_case(), (2, 1, 0))
    assert_solves(renamed, Fraction(4, 3))
    rotor = GYROSTAT.parameters(renamed.top, renamed.start).rotor
    assert rotor == -GYROSTAT.parameters(renamed.solution.top, renamed.solution.start).rotor


def test_a_motion_without_attitude_says_so():
    with pytest.raises(NotInClass, match="has no attitude"):
        Renamed(_StateAlone(), (1, 2, 0)).attitude(Fraction(1), 50)


class _StateAlone:
    """A solution of which no attitude is known."""

    method, top, start, system = "state alone", STEKLOV.top, STEKLOV.start, STEKLOV.system
    state, series = STEKLOV.state, STEKLOV.series


def partial_case():
    return ErshkovPartial(Fraction(1), Fraction(2), Fraction(1))
