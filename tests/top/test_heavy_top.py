"""Tops and starts: exact, validated, and clear about what is wrong."""

from fractions import Fraction
from random import Random

import pytest

from heavytop import GYROSTAT, HeavyTop, InputError, State
from heavytop.precision import dot
from heavytop.top.heavy_top import require_physical
from support.helpers import unit_vector, vector


def test_moments_that_no_body_has_are_a_warning_only() -> None:
    assert HeavyTop((1, 1, 3), 1, (0, 0, 1)).warnings() == [
        "I3 = 3 exceeds the sum 2 of the other two: no rigid body has such moments."
    ]
    assert HeavyTop((1, 1, 2), 1, (0, 0, 1)).warnings() == []
    assert HeavyTop(("3.0000000000000005", 2, 1), 1, (0, 0, 1)).warnings() == [
        "I1 = 3.0000000000000005 exceeds the sum 3 of the other two: no rigid body has such moments."
    ]


def test_gamma_off_the_sphere_is_refused_and_says_by_how_much() -> None:
    with pytest.raises(InputError, match=r"\|gamma\|\^2 - 1 = -0.01") as error:
        State((0, 0, 1), ("0.3", "0.3", "0.9")).require_unit_gamma()
    assert "--normalize" in error.value.remedy
    with pytest.raises(InputError, match=r"= 3\."):
        State((0, 0, 1), (0, 0, 2)).require_unit_gamma()


def test_normalized_gamma_is_exactly_of_unit_length_and_within_1e_30() -> None:
    random = Random(5)
    for scale in (Fraction(1), Fraction(10) ** 140, Fraction(1, 10**140)):
        for _ in range(20):
            given = tuple(scale * g for g in vector(random))
            moved = State((0, 0, 0), given).normalized().require_unit_gamma().gamma
            # the distance from the true direction: |g × m|² <= |g|² 1e-60
            square = dot(given, given)
            along = dot(given, moved)
            assert along > 0
            assert square - along**2 <= square * Fraction(1, 10**60)
    assert State((0, 0, 0), (0, 0, -5)).normalized().gamma == (0, 0, -1)
    with pytest.raises(InputError, match="must not be zero"):
        State((0, 0, 0), (0, 0, 0)).normalized()


def test_the_gyrostat_says_why_it_refuses_a_start() -> None:
    top = HeavyTop((2, 3, 4), 1, (0, 1, 0))
    with pytest.raises(InputError, match=r"M·gamma != 0"):
        GYROSTAT.parameters(top, State((1, 0, 0), (0, 1, 0)))
    with pytest.raises(InputError, match="parallel to M"):
        GYROSTAT.parameters(top, State((1, 1, 1), (0, 1, 0)))
    with pytest.raises(InputError, match="a = 1"):
        GYROSTAT.parameters(HeavyTop((2, 3, 4), 1, (1, 1, 0)), State((0, 1, 0), (0, 1, 0)))
    random = Random(6)
    gamma = unit_vector(random)
    start = State([7 * g / i for g, i in zip(gamma, top.inertia, strict=True)], gamma)
    assert GYROSTAT.parameters(top, start).rotor == Fraction(1, 7)


def test_numbers_beyond_every_float_are_refused_and_shown_short() -> None:
    body, start = HeavyTop((1, 1, 1), 1, (0, 0, 1)), State((1, 0, 0), (0, 0, 1))
    require_physical(body, start)
    for top, state in (
        (HeavyTop(("1e5000", 1, 1), 1, (0, 0, 1)), start),
        (HeavyTop((1, 1, "1e-5000"), 1, (0, 0, 1)), start),
        (HeavyTop((1, 1, 1), "-1e5000", (0, 0, 1)), start),
        (body, State(("1e151", 0, 0), (0, 0, 1))),
    ):
        with pytest.raises(InputError, match="is too large") as error:
            require_physical(top, state)
        assert len(str(error.value)) < 200
    assert all(len(warning) < 200 for warning in HeavyTop(("1e5000", 1, 1), 1, (0, 0, 1)).warnings())
    with pytest.raises(InputError, match="must be positive") as error:
        HeavyTop(("-1e5000", 1, 1), 1, (0, 0, 1))
    assert len(str(error.value)) < 200
