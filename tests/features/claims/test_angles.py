"""Angles that are parts of pi, and inverse functions of one another: in their range, and beside it."""

from __future__ import annotations

import pytest

from support.claim_tables import rotation


def verdict(zero: str, assume: tuple[str, ...]) -> str:
    return rotation(f"1 + t*({zero})", assume, parameters={"a": ["1/2", "7/8"]}).verdict


TO_4, TO_1 = ("a > 0", "a < 4"), ("a > 0", "a < 1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("zero", "assume"),
    [
        ("2*cos(t - pi/3) - cos(t) - sqrt(3)*sin(t)", ()),
        ("sqrt(2)*sin(a*t + pi/4) - sin(a*t) - cos(a*t)", ()),
        ("2*cos(t + 5*pi/6) + sqrt(3)*cos(t) + sin(t)", ()),
        ("4*cos(t - pi/12) - (sqrt(6) + sqrt(2))*cos(t) - (sqrt(6) - sqrt(2))*sin(t)", ()),
        ("atan(a) + atan(1/a) - pi/2", ("a > 0",)),
        ("atan(-a) + atan(-1/a) + pi/2", ("a > 0",)),
        ("atan(1 + t^2) + atan(1/(1 + t^2)) - pi/2", ()),
        ("asin(a) + acos(a) - pi/2", TO_1),
        ("asin(a/4) + acos(a/4) - pi/2", TO_4),
        ("acos(tanh(t)) + acos(-tanh(t)) - pi", ()),
        ("acos(cos(a/4)) - a/4", TO_4),
        ("acos(cos(a/2)) - a/2", TO_4),
        ("asin(sin(a/4)) - a/4", TO_4),
        ("atan(tan(a/4)) - a/4", TO_4),
    ],
)
def test_in_its_range_it_holds(zero, assume):
    assert verdict(zero, assume) == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("zero", "assume"),
    [
        ("2*cos(t - pi/3) - cos(t) + sqrt(3)*sin(t)", ()),
        ("sqrt(2)*sin(a*t + pi/4) - sin(a*t) + cos(a*t)", ()),
        ("2*cos(t + 5*pi/6) - sqrt(3)*cos(t) + sin(t)", ()),
        ("atan(a) + atan(1/a) - pi/2", ()),
        ("atan(a) + atan(1/a) + pi/2", ("a > 0",)),
        ("asin(a) + acos(a) - pi/2", ("a > 0",)),
        ("asin(a) - acos(a) - pi/2", TO_1),
        ("acos(tanh(t)) - acos(-tanh(t))", ()),
        # true at the samples only
        ("acos(cos(a)) - a", TO_4),
        ("acos(cos(a)) - a", ("a < 3",)),
        ("asin(sin(a/2)) - a/2", TO_4),
        ("asin(sin(a)) - a", TO_4),
        ("atan(tan(a/2)) - a/2", TO_4),
        ("atan(tan(a)) - a", ("a < 1",)),
        ("acos(cos(t)) - t", ()),
        ("acos(sin(a)) - a", TO_1),
    ],
)
def test_beside_it_it_does_not(zero, assume):
    assert verdict(zero, assume) != "holds"
