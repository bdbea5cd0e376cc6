"""Angles that are parts of pi, and inverse functions of one another: in their range, and beside it."""

import pytest

from support.claim_tables import rotation


def verdict(zero: str, assume: tuple[str, ...]) -> str:
    return rotation(f"1 + t*({zero})", assume, parameters={"a": ["1/2", "7/8"]}).verdict


TO_4, TO_1 = ("a > 0", "a < 4"), ("a > 0", "a < 1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("zero", "assume", "holds"),
    [
        ("2*cos(t - pi/3) - cos(t) - sqrt(3)*sin(t)", (), True),
        ("sqrt(2)*sin(a*t + pi/4) - sin(a*t) - cos(a*t)", (), True),
        ("2*cos(t + 5*pi/6) + sqrt(3)*cos(t) + sin(t)", (), True),
        ("4*cos(t - pi/12) - (sqrt(6) + sqrt(2))*cos(t) - (sqrt(6) - sqrt(2))*sin(t)", (), True),
        ("atan(a) + atan(1/a) - pi/2", ("a > 0",), True),
        ("atan(-a) + atan(-1/a) + pi/2", ("a > 0",), True),
        ("atan(1 + t^2) + atan(1/(1 + t^2)) - pi/2", (), True),
        ("asin(a) + acos(a) - pi/2", TO_1, True),
        ("asin(a/4) + acos(a/4) - pi/2", TO_4, True),
        ("acos(tanh(t)) + acos(-tanh(t)) - pi", (), True),
        ("acos(cos(a/4)) - a/4", TO_4, True),
        ("acos(cos(a/2)) - a/2", TO_4, True),
        ("asin(sin(a/4)) - a/4", TO_4, True),
        ("atan(tan(a/4)) - a/4", TO_4, True),
        ("2*cos(t - pi/3) - cos(t) + sqrt(3)*sin(t)", (), False),
        ("sqrt(2)*sin(a*t + pi/4) - sin(a*t) + cos(a*t)", (), False),
        ("2*cos(t + 5*pi/6) - sqrt(3)*cos(t) + sin(t)", (), False),
        ("atan(a) + atan(1/a) - pi/2", (), False),
        ("atan(a) + atan(1/a) + pi/2", ("a > 0",), False),
        ("asin(a) + acos(a) - pi/2", ("a > 0",), False),
        ("asin(a) - acos(a) - pi/2", TO_1, False),
        ("acos(tanh(t)) - acos(-tanh(t))", (), False),
        # true at the samples only
        ("acos(cos(a)) - a", TO_4, False),
        ("acos(cos(a)) - a", ("a < 3",), False),
        ("asin(sin(a/2)) - a/2", TO_4, False),
        ("asin(sin(a)) - a", TO_4, False),
        ("atan(tan(a/2)) - a/2", TO_4, False),
        ("atan(tan(a)) - a", ("a < 1",), False),
        ("acos(cos(t)) - t", (), False),
        ("acos(sin(a)) - a", TO_1, False),
    ],
)
def test_it_holds_in_its_range_and_not_beside_it(zero, assume, holds):
    assert (verdict(zero, assume) == "holds") is holds
