"""Renaming of the axes, and back.  What renamed motions solve: `test_catalogue.py` and `test_every_naming.py`."""

from fractions import Fraction

import pytest

from heavytop.errors import NotInClass
from heavytop.exact.closed_form import ALL, Renamed, inverse, renamed_state, renamed_top
from rational_motions import bobylev_steklov_motion

STEKLOV = bobylev_steklov_motion(
    (Fraction(3, 2), Fraction(1)), Fraction(1), Fraction(1, 2), Fraction(1, 3), Fraction(2)
)


@pytest.mark.parametrize("axes", ALL)
def test_renaming_back_gives_the_same_top_and_start(axes):
    top, start = renamed_top(STEKLOV.top, axes), renamed_state(STEKLOV.start, axes)
    assert renamed_top(top, inverse(axes)) == STEKLOV.top
    assert renamed_state(start, inverse(axes)) == STEKLOV.start


def test_a_motion_without_attitude_says_so():
    with pytest.raises(NotInClass, match="has no attitude"):
        Renamed(_StateAlone(), (1, 2, 0)).attitude(Fraction(1), 50)


class _StateAlone:
    """A solution of which no attitude is known."""

    method, top, start, system = "state alone", STEKLOV.top, STEKLOV.start, STEKLOV.system
    state, series = STEKLOV.state, STEKLOV.series
