"""A ball as decimal text: the printed radius is the least of three digits that encloses ball and rounding."""

from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from random import Random

from flint import arb

from heavytop.exact.flint.balls import midpoint, radius, value_text, working_precision


def test_the_printed_radius_encloses_the_ball_and_no_smaller_one_does() -> None:
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
