"""How long does one state of an elliptic motion take, the lattice made, and what does making it cost?"""

from fractions import Fraction

import mpmath
import pytest
from flint import acb

from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.cases.lagrange import Lagrange
from heavytop.exact.elliptic.weierstrass import exact_lattice, thetas
from heavytop.exact.flint.balls import radius, radius_text, working_precision
from heavytop.top.heavy_top import HeavyTop, State

START = State((Fraction(1, 3), 1, 2), (Fraction(3, 5), 0, Fraction(4, 5)))
MOTIONS = {
    "lagrange": Lagrange(HeavyTop((2, 2, 1), 1, (0, 0, 1)), START),
    "gyrostat": Gyrostat(HeavyTop((3, 2, 1), 1, (0, 1, 0)), START, Fraction(1, 3)),
}
TIME = Fraction(10**6)


@pytest.mark.parametrize("digits", [50, 1000])
@pytest.mark.parametrize("name", list(MOTIONS))
def test_state_at_a_million(benchmark, name, digits):
    motion, bits = MOTIONS[name], int(digits * 3.3219281) + 1
    motion.state(TIME, bits)
    state = benchmark(motion.state, TIME, bits)
    benchmark.extra_info["radius"] = radius_text(max(radius(value) for value in state))


@pytest.mark.parametrize("name", list(MOTIONS))
def test_making_the_lattice(benchmark, name):
    g2, g3 = MOTIONS[name].quartic().invariants()

    def make():
        with working_precision(320):
            return exact_lattice.__wrapped__(g2, g3, 320)

    lattice = benchmark(make)
    benchmark.extra_info["radius"] = radius_text(radius(lattice.half_period))


def test_the_theta_values_alone_in_balls(benchmark):
    """The same five values at the same digits: what the arithmetic itself gains."""
    ratio = MOTIONS["lagrange"].quartic().lattice().ratio

    def both():
        with working_precision(200):
            return *thetas(acb(1) / 3, ratio), thetas(acb("0.3", "0.4"), ratio)[0]

    values = benchmark(both)
    benchmark.extra_info["radius"] = radius_text(max(radius(value.real) for value in values))


def test_the_theta_values_alone_in_mpmath(benchmark):
    """The five theta values of one Lagrange state at 60 digits, alone: less than the whole formula costs in mpmath."""
    lattice = MOTIONS["lagrange"].quartic().lattice()
    with mpmath.workdps(60):
        nome = mpmath.exp(mpmath.pi * 1j * mpmath.mpc(str(lattice.ratio.real.mid()), float(lattice.ratio.imag)))

        def thetas():
            real = [mpmath.jtheta(j, mpmath.mpf(1) / 3, nome) for j in (1, 2, 3, 4)]
            return [*real, mpmath.jtheta(1, mpmath.mpc("0.3", "0.4"), nome)]

        values = benchmark(thetas)
    benchmark.extra_info["digits"] = "60"
    assert all(mpmath.isfinite(value) for value in values)
