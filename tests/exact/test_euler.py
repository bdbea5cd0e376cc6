"""Euler-Poinsot against its equations, and its separatrix."""

import random
from fractions import Fraction

from heavytop.exact.cases.euler import Euler
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import positive, triple

TINY, THIRD = Fraction(1, 10**30), Fraction(1, 3)


def euler(inertia, omega, gamma=(Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3))):
    return Euler(HeavyTop(inertia, 1, (0, 0, 0)), State(omega, gamma))


def random_motion(seed):
    rng = random.Random(seed)
    inertia, omega = list(triple(rng, positive)), list(triple(rng))
    if seed % 4 == 1:
        inertia[rng.randrange(3)] = inertia[rng.randrange(3)]
    if seed % 5 == 2:
        omega[rng.randrange(3)] = Fraction(0)
    if seed % 11 == 3:
        inertia = [inertia[0]] * 3
    return euler(inertia, omega, triple(rng))


# the separatrix L² = 2E I2 is I1 (I1 − I2) Ω1² = I3 (I2 − I3) Ω3²: for these moments 36 Ω1² = 4 Ω3², rational
CROSSED, NEAR = (9, 5, 1), 1 - TINY
STARTS = {
    **{
        f"separatrix {n}, {signs}": (CROSSED, (signs[0] * THIRD, signs[1] * Fraction(2, 7), signs[2] * (1 + off)))
        for signs in ((1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, 1))
        for n, off in enumerate((0, TINY, -TINY, Fraction(1, 10**12)))
    },
    "at rest": ((3, 2, 1), (0, 0, 0)),
    "saddle, 1": (CROSSED, (TINY, 1, 0)),
    "saddle, 3": (CROSSED, (0, 1, TINY)),
    "saddle, both": (CROSSED, (TINY, 1, 3 * TINY)),
    "saddle, in and out": (CROSSED, (TINY, 1, -TINY)),
    "axis 1": ((3, 2, 1), (1, TINY, 0)),
    "axis 3": ((3, 2, 1), (TINY, 0, 1)),
    "nearly symmetric about 3": ((2 + TINY, 2, 1), (1, 1, 1)),
    "nearly symmetric about 1": ((2, 1, NEAR), (1, 1, 1)),
    "nearly a sphere": ((2 + TINY, 2, 2 - TINY), (1, 2, 1)),
    "nearly a sphere, symmetric": ((2 + TINY, 2, 2), (1, 2, 1)),
}
