"""Zeros of several factors at one time: undecided by name; polynomials are short near them, and as narrow as before."""

import random
from fractions import Fraction

import pytest
from flint import arb, arb_poly

import heavytop as ht
from heavytop.exact.flint.balls import ball, radius, working_precision
from heavytop.features.events.proven import _WIDE, _Near, _Piece

TOP, START = ht.HeavyTop((2, 3, 1), 1, (0, 0, 1)), ht.State((1, 0, 0), (0, "3/5", "4/5"))
"""A pendulum, which passes its lowest point, γ = (0, 0, −1), at t = 1.8143…"""


@pytest.mark.slow
@pytest.mark.parametrize("factors", [2, 4])
def test_factors_that_vanish_at_one_time_are_undecided_there(factors: int) -> None:
    """They have no common factor as polynomials; of one, the zero is found."""
    found = ht.events(TOP, START, 3, "gamma2", digits=10)
    (time,) = found.times_numpy()
    product = "*".join(f"(gamma2 + {i}*(1 + gamma3))" for i in range(factors))
    with pytest.raises(ht.OutOfReach, match=rf"Near t = {time:.8f}.* changes sign or only touches zero"):
        ht.events(TOP, START, 3, product, digits=10)


@pytest.mark.parametrize("seed", range(5))
def test_the_short_polynomials_of_a_part_enclose_the_long_ones_and_are_as_narrow(seed: int) -> None:
    source, bits, degree = random.Random(seed), 200, 300
    with working_precision(bits):

        def drawn() -> arb_poly:
            values = [ball(Fraction(source.randint(-(2**60), 2**60), 2**60)) / (1 + n) ** 2 for n in range(degree)]
            return arb_poly([values[0] + arb(0, arb(2) ** -150), *values[1:]])

        piece = _Piece(Fraction(0), Fraction(1), Fraction(1), bits, [], drawn(), drawn(), arb_poly([1]), drawn())
        low = Fraction(source.randint(0, 500), 512) * Fraction(1, 2)
        near = _Near.of(piece, low, low + 2 * _WIDE)
        for name in ("value", "rate", "first"):
            long, short = getattr(piece, name), getattr(near, name)
            assert len(short) < len(long) / 4
            for _ in range(20):
                s = low + 2 * _WIDE * Fraction(source.randint(0, 2**40), 2**40)
                exactly, found = long(ball(s)), near.over(short, s, s)
                assert found.contains(exactly)
                assert radius(found) < radius(exactly) * Fraction(1003, 1000)
                other = min(s + _WIDE * Fraction(1, 2**20), low + 2 * _WIDE)
                part = near.over(short, s, other)
                assert part.contains(exactly)
                assert part.contains(long(ball(other)))
