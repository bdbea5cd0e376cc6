"""The physical pendulum: libration, rotation, separatrix, equilibria, about each axis."""

import random
from fractions import Fraction

from heavytop.exact.cases.pendulum import Pendulum, PendulumGyrostat
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import positive, rational, triple

TINY = Fraction(1, 10**30)


def pendulum(axis, rate, gamma, centre, inertia=(3, 2, Fraction(3, 2))):
    """About that axis, from the components of γ and r on the next two axes."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    omega, up, arm = [0, 0, 0], [0, 0, 0], [0, 0, 0]
    omega[axis], up[i], up[j], arm[i], arm[j] = rate, *gamma, *centre
    return Pendulum(HeavyTop(inertia, 2, arm), State(omega, up))


def random_motion(seed):
    rng = random.Random(seed)
    gamma, centre = (rational(rng), 1 + positive(rng)), (positive(rng), rational(rng))
    return pendulum(seed % 3, rational(rng, size=8), gamma, centre, triple(rng, positive))


def random_gyrostat(seed):
    plain, rng = random_motion(seed), random.Random(seed)
    rotor = [rational(rng, size=5) * (axis == seed % 3) for axis in range(3)]
    return PendulumGyrostat(HeavyTop(plain.top.inertia, plain.top.weight, plain.top.centre, rotor), plain.start)


# the separatrix is ½ I Ω² + n·γ = |n||γ|: n = (0, 2), γ = (3/5, −4/5) and I = 4/5 ask Ω² = 9
LEVEL = (Fraction(3, 5), Fraction(-4, 5))
OFF = dict(enumerate((0, TINY, -TINY)))
STARTS = {
    **{
        f"separatrix {axis}, {rate}, {n}": (axis, rate + off, LEVEL, (0, 1), [Fraction(4, 5)] * 3)
        for axis in range(3) for rate in (3, -3) for n, off in OFF.items()
    },
    **{
        f"equilibrium {n}, {place}": (1, rate, gamma, (0, 1))
        for n, rate in OFF.items() for place, gamma in enumerate(((0, 1), (0, -1), (TINY, 1), (-TINY, -1)))
    },
    # r = (1, 1), γ = (2, 2): n·γ = 8 = N, at the top; ½ I Ω² = 0 is the equilibrium, any other Ω rotates
    **{f"top {n}": (0, rate, (2, 2), (1, 1)) for n, rate in enumerate((TINY, 0))},
    # γ = (2, -2) is level: N = 8 again, and ½ I Ω² = 8 on the separatrix with I = 4, Ω = 2
    "irrational separatrix": (0, 2, (2, -2), (1, 1), (4, 3, 2)),
}  # fmt: skip
