"""Theta series as polynomials against FLINT's own theta functions: containment both ways, and the ball is narrow."""

import random
from fractions import Fraction

import pytest
from flint import acb, arb, arb_series, ctx

from heavytop.exact.elliptic.jacobi import jacobi, wave
from heavytop.exact.elliptic.weierstrass import Lattice, Theta, from_invariants
from heavytop.exact.flint.balls import ball, radius, series_length, working_precision

TINY = Fraction(1, 10**30)
PARAMETERS = [
    Fraction(0),
    TINY,
    Fraction(1, 7),
    Fraction(1, 2),
    Fraction(8, 9),
    Fraction(10, 11),
    1 - TINY,
    Fraction(1),
]


def assert_same(quick, slow, limit):
    assert quick.overlaps(slow), (quick, slow)
    assert radius(quick) < limit
    assert radius(slow) < limit


@pytest.mark.parametrize("bits", [64, 300, 2000])
@pytest.mark.parametrize("m", PARAMETERS)
def test_jacobi_functions_and_waves_at_numbers_are_those_at_series(m, bits):
    rng = random.Random(5)
    with working_precision(bits), series_length(2):
        functions = jacobi(ball(m), ball(1 - m))
        shift = functions.theta.rate.rsqrt() / 3
        turning = wave(functions, shift)
        for _ in range(6):
            u = ball(Fraction(rng.randint(-900, 900), 70))
            limit = Fraction(2) ** (30 - bits)
            series = arb_series([u, 1], prec=2)
            for quick, slow in zip(functions.functions(u), functions.functions(series), strict=True):
                assert_same(quick, slow[0], limit)
            quick, slow = turning.at(u)[0], turning.at(series)[0][0]
            scale = Fraction(2) ** 30 * limit
            assert_same(quick.real, slow.real, scale)
            assert_same(quick.imag, slow.imag, scale)


def test_an_argument_too_wide_to_be_reduced_gives_no_number():
    """The truncated series are proven for |u| ≤ 2K·reach alone; a ball that sticks out is not a number."""
    with working_precision(100):
        functions = jacobi(ball(Fraction(99, 100)), ball(Fraction(1, 100)))
        reach = functions.period[1]
        for middle in (arb(0), 7 * functions.period[0]):
            inside, beyond = (middle + arb(0, (reach * part).upper()) for part in (0.99, 1.01))
            assert functions.reduced(inside)[0].is_finite()
            assert not functions.reduced(beyond)[0].is_finite()
            assert not any(value.is_finite() for value in functions.functions(beyond))


@pytest.mark.parametrize("bits", [64, 300, 2000])
def test_a_lattice_at_numbers_is_that_at_series(bits):
    rng = random.Random(9)
    kinds = set()
    with working_precision(bits):
        for _ in range(25):
            g2, g3 = Fraction(rng.randint(-40, 60), 7), Fraction(rng.randint(-40, 40), 9)
            lattice = from_invariants(g2, g3)
            assert isinstance(lattice, Lattice)
            if lattice.theta is None:
                continue
            kinds.add(bool(lattice.ratio.real == 0))
            time = Fraction(rng.randint(-99, 99), 50)
            quick, slow = lattice.point(time), lattice.point(time, 1)
            flip = slow.thetas[0]
            for name, sign in (("scale", flip), ("raised", flip), ("square", 1), ("high", 1), ("slope", flip)):
                assert_same(getattr(quick, name), sign * getattr(slow, name)[0], Fraction(2) ** (40 - bits))
    assert kinds == {True, False}


@pytest.mark.parametrize("hyperbolic", [False, True])
def test_the_tail_alone_makes_up_for_what_is_left_out(hyperbolic):
    """q = 1/4: at 32 bits every term that is taken is exact, so the radius is that of the tail and nothing else."""
    growth = arb(17) / 16 if hyperbolic else arb(1)
    with working_precision(32):
        theta = Theta(arb(1) / 16, arb(1), hyperbolic, growth)
        parts = [theta.even(1), theta.even(-1)]
    with working_precision(300):
        angle = growth.log() if hyperbolic else arb(1) / 3
        c = angle.cosh() if hyperbolic else angle.cos()
        z = acb(0, angle) if hyperbolic else acb(angle)
        _, _, *thetas = (z / (2 * arb.pi())).modular_theta(acb(0, arb(4).log() / arb.pi()))
        for part, wanted in zip(parts, thetas, strict=True):
            assert all(coefficient.is_exact() for coefficient in part.coeffs()[1:])
            value = part(c)
            assert value.overlaps(wanted.real)
            assert not value.mid().overlaps(wanted.real), "nothing was left out: no test of the tail"
            assert radius(value) < Fraction(1, 2**32)


@pytest.mark.parametrize("nome", [arb("nan"), arb(0.5, 1)])
def test_a_nome_that_is_not_known_gives_balls_that_are_not_finite(nome):
    for part in (*Theta(nome, arb(1), False, arb(1)).odd(), Theta(nome, arb(1), False, arb(1)).both()):
        assert not part(arb(0.3)).is_finite()


def test_the_working_precision_comes_back_after_an_error():
    before = ctx.prec, ctx.cap
    with pytest.raises(ZeroDivisionError), working_precision(777), series_length(3):
        1 / 0  # noqa: B018
    assert (ctx.prec, ctx.cap) == before
