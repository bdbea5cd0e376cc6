"""Balls as text, and the promise of bits: each radius is an upper bound, each ball as narrow as it was asked to be."""

from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from random import Random

import pytest
from flint import arb, arb_series

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import (
    ball,
    ball_from,
    ball_text,
    midpoint,
    radius,
    radius_text,
    relative_bits,
    to_bits,
    value_text,
    working_precision,
)


def test_the_printed_radius_is_the_least_of_three_digits_that_encloses_the_ball_and_the_rounding() -> None:
    random = Random(7)
    with working_precision(400):
        balls = [
            arb(
                arb((random.randint(-(2**200), 2**200), random.randint(-400, 200))),
                arb((random.randint(0, 2**29), random.randint(-500, 20))),
            )
            for _ in range(300)
        ]
        balls += [arb(0), arb(1), arb(0, 1), arb((1, 3000)), arb((-1, -3000))]
        for ball in balls:
            for digits in (1, 16, 51):
                value, wide = map(Fraction, value_text(ball, digits))
                needed = radius(ball) + abs(value - midpoint(ball))
                assert needed <= wide
                least = Context(3, ROUND_CEILING).divide(Decimal(needed.numerator), Decimal(needed.denominator))
                assert wide == Fraction(least)
                size = abs(midpoint(ball))
                if size <= radius(ball):
                    assert value == 0
                else:
                    assert abs(value - midpoint(ball)) <= size * Fraction(5, 10**digits)


@pytest.mark.parametrize("value", [Fraction(1, 3), Fraction(10**40 + 1, 10**40), Fraction(2, 7) / 10**500])
def test_a_radius_as_text_is_rounded_up(value: Fraction) -> None:
    assert value <= Fraction(radius_text(value)) <= value * Fraction(102, 100)


def test_a_ball_comes_back_from_its_text_unchanged() -> None:
    rng = Random(2)
    for _ in range(100):
        value = arb((rng.getrandbits(90) - 2**89, rng.randint(-200, 200)), (rng.getrandbits(30), rng.randint(-400, 20)))
        again = ball_from(ball_text(value))
        assert (midpoint(again), radius(again)) == (midpoint(value), radius(value))


@pytest.mark.parametrize("size", [Fraction(1, 10**20), Fraction(3, 7), Fraction(12345), Fraction(10) ** 30])
@pytest.mark.parametrize("lost", [0, 50, 3000, 32_000])
def test_bits_are_given_however_many_cancel(size: Fraction, lost: int) -> None:
    """(2^lost + √2 size) − 2^lost loses bits: relative above 1, absolute below."""

    def evaluate(_working: int) -> list[arb]:
        large = arb(2) ** lost
        return [(large + arb(2).sqrt() * ball(size)) - large]

    (value,) = to_bits(evaluate, 100)
    assert relative_bits(value) >= 100
    with working_precision(400):
        true = arb(2).sqrt() * ball(size)
    assert value.overlaps(true)
    assert radius(value) <= Fraction(1, 2**100) * max(1, size * 2)


def test_bits_beyond_reach_are_refused_with_what_was_reached() -> None:
    with pytest.raises(OutOfReach, match="Only 5 of 100 bits"):
        to_bits(lambda _: [arb(1, 1 / 64)], 100)
    with pytest.raises(OutOfReach, match="Only 0 of 100 bits"):
        to_bits(lambda _: [arb("nan")], 100)


def test_a_series_whose_divisor_may_vanish_needs_more_bits_and_no_other_fault_is_hidden() -> None:
    def evaluate(working: int) -> list[arb]:
        small = (arb(2).sqrt() + arb(2) ** -900) - arb(2).sqrt()
        return [(1 / arb_series([small * arb(2) ** 900, 1], prec=2))[0]]

    (value,) = to_bits(evaluate, 60, length=2)
    assert value.contains(1)

    def faulty(_working: int) -> list[arb]:
        raise ValueError("something else")

    with pytest.raises(ValueError, match="something else"):
        to_bits(faulty, 60)


def test_values_next_to_nothing_stay_inside_their_balls() -> None:
    """e^−t at t = 10^6 has a midpoint of a million bits: a ball around 0 stands for it."""
    with working_precision(100):
        tiny = (-arb(10**6)).exp()
    (value,) = to_bits(lambda _: [tiny], 60)
    assert value.contains(tiny)
    assert 0 < radius(value) <= Fraction(1, 2**60)
    assert midpoint(value) == 0
