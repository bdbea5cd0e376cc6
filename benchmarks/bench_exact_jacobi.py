"""How long does one state of a motion in Jacobi functions take, the lattice made?"""

from fractions import Fraction

import pytest

from heavytop.exact.cases import euler, pendulum
from heavytop.exact.cases.delone import Delone
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.pendulum import Pendulum
from heavytop.exact.flint.balls import radius, radius_text, working_precision
from heavytop.top.heavy_top import HeavyTop, State
from rational_motions import bobylev_steklov_motion

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
            return room._lattice.__wrapped__(motion)

    lattice = benchmark(make)
    benchmark.extra_info["radius"] = radius_text(radius(getattr(lattice, "swing", lattice).rate))
