"""How long does one state of a motion in Jacobi functions take, the lattice made, and the same formulas in mpmath?"""

from fractions import Fraction

import mpmath
import pytest

from heavytop.exact import euler, pendulum
from heavytop.exact.balls import radius, radius_text, working_precision
from heavytop.exact.bobylev_steklov import bobylev_steklov_motion
from heavytop.exact.delone import Delone
from heavytop.exact.euler import Euler
from heavytop.exact.pendulum import Pendulum
from heavytop.top.heavy_top import HeavyTop, State

F = Fraction
MOTIONS = {
    "euler": Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((F(1, 3), 1, 2), (F(3, 5), 0, F(4, 5)))),
    "pendulum": Pendulum(HeavyTop((3, 2, 1), 1, (0, 1, 0)), State((1, 0, 0), (0, F(3, 5), F(4, 5)))),
    "bobylev-steklov": bobylev_steklov_motion((F(5, 2), F(1)), F(1), F(1, 2), F(1, 3), F(2)),
    "delone": Delone(HeavyTop((2, 2, 1), 1, (1, 0, 0)), State((1, F(1, 2), F(1, 3)), (F(3, 4), 1, F(1, 5)))),
}
TIME = F(10**6)


@pytest.mark.parametrize("digits", [50, 1000])
@pytest.mark.parametrize("name", list(MOTIONS))
def test_state_at_a_million(benchmark, name, digits):
    motion, bits = MOTIONS[name], int(digits * 3.3219281) + 1
    motion.state(TIME, bits)
    state = benchmark(motion.state, TIME, bits)
    benchmark.extra_info["radius"] = radius_text(max(radius(value) for value in state))


@pytest.mark.parametrize("room", [euler, pendulum], ids=["euler", "pendulum"])
def test_making_the_lattice(benchmark, room):
    motion = MOTIONS[room.__name__.rpartition(".")[2]]

    def make():
        with working_precision(320):
            return room._lattice.__wrapped__(motion, 320)

    lattice = benchmark(make)
    benchmark.extra_info["radius"] = radius_text(radius(lattice.rate))


def test_the_same_state_of_euler_in_mpmath(benchmark):
    """sn, cn, dn and the phase θ1/|θ1| from the same constants at 60 digits; Ω must agree to 50."""
    motion = MOTIONS["euler"]
    with working_precision(320):
        lattice = euler._lattice.__wrapped__(motion, 320)
        a, b, c = lattice.axes
        jacobi = lattice.functions
    with mpmath.workdps(70):
        number = lambda ball: mpmath.mpf(ball.str(75, radius=False))  # noqa: E731
        rate, origin, m = number(lattice.rate), number(lattice.origin), number(jacobi.parameter)
        quarter, pole = number(jacobi.quarter), number(lattice.pole)
        amplitude = {axis: number(value) for axis, value in lattice.amplitudes.items()}
        nome = mpmath.qfrom(m=m)

        def state():
            u = mpmath.fmod(rate * 10**6 + origin, 4 * quarter)
            sn, cn, dn = (mpmath.ellipfun(kind, u, m=m) for kind in ("sn", "cn", "dn"))
            theta = mpmath.jtheta(1, mpmath.pi * (u + 1j * pole) / (2 * quarter), nome)
            return {a: amplitude[a] * dn, b: amplitude[b] * cn, c: amplitude[c] * sn}, theta / abs(theta)

        omega, _ = benchmark(state)
        for axis, value in enumerate(motion.state(TIME, 170)[:3]):
            assert abs(number(value) - omega[axis]) < mpmath.mpf("1e-50")
