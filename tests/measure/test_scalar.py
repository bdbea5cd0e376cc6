"""What of a ball is a number, and what is not resolved."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from heavytop.exact.flint.balls import ball, midpoint, radius, working_precision
from heavytop.measure.scalar import UNRESOLVED, larger, largest, metric, of_fraction, resolved, root, text, to_ball
from heavytop.measure.scorer import split


def around(middle: int, wide: int) -> arb:
    return arb((middle, -80), (wide, -80))


@pytest.mark.parametrize(("middle", "wide", "counts"), [
    (10, 1, True), (-10, 1, True), (10_000, 1000, True), (9_999, 1000, False), (-9_999, 1000, False), (0, 0, True),
    (0, 1, False),
])  # fmt: skip
def test_a_number_is_resolved_from_ten_times_its_radius_on(middle: int, wide: int, counts: bool) -> None:
    value = around(middle, wide)
    assert resolved(value) is counts
    assert (text(value) != UNRESOLVED) is counts
    found = metric(value)
    if counts:
        assert abs(Fraction(found.value) - midpoint(value)) <= abs(midpoint(value)) * Fraction(1, 10**7)
    else:
        assert found.bound is not None
        # the bound of what is not resolved holds the whole ball
        assert found.log10 is None
        assert Fraction(found.bound) >= abs(midpoint(value)) + radius(value)
        assert Fraction(found.bound) <= (abs(midpoint(value)) + radius(value)) * Fraction(101, 100)


def test_what_is_not_finite_is_no_number() -> None:
    for value in (arb("nan"), arb("inf"), arb(1, "inf")):
        assert not resolved(value)
        assert text(value) == "nan"
        assert metric(value).log10 is None
    assert metric(ball(-1).sqrt()).value == "nan"
    assert of_fraction(Fraction(1, 10**997)).log10 == -997
    assert not to_ball(np.longdouble("nan")).is_finite()
    assert not to_ball(float("inf")).is_finite()


def test_the_largest_ball_holds_the_largest_size() -> None:
    values = [around(-5, 1), around(3, 2), around(4, 0)]
    found = largest(values)
    for size in (6, 5):
        assert found.contains(around(size, 0))
    assert midpoint(found) - radius(found) > Fraction(399, 100) / 2**80


@pytest.mark.parametrize("apart", [Fraction(0), Fraction(1), Fraction(2), Fraction(3)])
def test_the_larger_of_two_balls_holds_both_maxima(apart: Fraction) -> None:
    one, other = arb(3, 1), arb(3 + int(apart), 1)
    with working_precision(64):
        for found in (larger(one, other), larger(other, one)):
            assert found.contains(other)
            # the smaller one does not widen it downwards
            assert midpoint(found) - radius(found) > 2 + apart - Fraction(1, 2**20)
        assert not larger(one, arb("nan")).is_finite()
        assert not larger(arb("nan"), one).is_finite()


def test_a_distance_is_split_into_orthogonal_parts() -> None:
    with working_precision(200):
        flow = [ball(Fraction(x)) for x in (3, 0, 4, 0, 0, 0)]
        delta = [ball(Fraction(x)) for x in (6, 5, 8, 0, 0, 12)]
        along, across = split(delta, flow)
        assert along.overlaps(arb(10))
        assert across.overlaps(arb(13))
        nowhere, whole = split(delta, [arb(0)] * 6)
        assert nowhere == 0
        assert (whole * whole).overlaps(arb(269))
        _, rest = split([v / 3 for v in flow], flow)
        assert rest.contains(0)
        assert root(arb(0, 1)).contains(0)
        assert root(arb(0, 1)).contains(1)
