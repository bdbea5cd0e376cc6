"""The Delone class: any direction of r, the homoclinic motion as its limit, and its neighbourhood."""

import random
from fractions import Fraction

from heavytop import HeavyTop, State
from heavytop.exact.cases.delone import Delone
from support.proofs import positive, rational

TINY = Fraction(1, 10**30)


def delone(omega, gamma3, moment, i3=Fraction(1)):
    """The start of the class with this Ω and γ3: γ1 + iγ2 = I3 (Ω1 + iΩ2)²/(n1 + i n2)."""
    (w1, w2, _), (n1, n2) = (tuple(map(Fraction, part)) for part in (omega, moment))
    real, imaginary, square = w1 * w1 - w2 * w2, 2 * w1 * w2, Fraction(n1 * n1 + n2 * n2)
    gamma = (i3 * (real * n1 + imaginary * n2) / square, i3 * (imaginary * n1 - real * n2) / square, gamma3)
    return Delone(HeavyTop((2 * i3, 2 * i3, i3), 1, (n1, n2, 0)), State(omega, gamma))


def random_motion(seed):
    rng = random.Random(seed)
    omega = [rational(rng) for _ in range(3)]
    if seed % 6 == 1:
        omega[rng.randrange(3)] = Fraction(0)
    return delone(omega, rational(rng), (rational(rng), positive(rng)), positive(rng))


LEVEL = {"homoclinic": lambda off: ((0, 0, 2 + off), 1), "permanent": lambda off: ((off, 1, 0), 0)}
AZIMUTH = (((1, 0, 1), 3), ((-1, 0, 3), -1), ((1, 0, -2), 1), ((0, 1, 1), 0), ((1, 1, 0), 1), ((1, 0, 0), 1))
"""Turning points (Ω2 = 0), M·γ = 0: (1, 0, −2) with γ = (1, 0, 1), no start at rest."""
NONE = (((1, 0, 2), 1), ((0, 0, 3), -2), ((1, 0, 1), 1))
"""2A, Ω3 along |g|, γ3, so that e = 0, γ along axis 3 among them; a double root of the cubic."""
STARTS = {
    f"no azimuth, {name}, {n}": (*of(off), (0, Fraction(1, 2)), Fraction(1, 2))
    for name, of in LEVEL.items()
    for n, off in enumerate((0, TINY, -TINY))
}
STARTS |= {f"turning point {n}": (*start, (1, 0)) for n, start in enumerate(AZIMUTH)}
STARTS |= {f"no azimuth, {n}": (*start, (1, 0)) for n, start in enumerate(NONE)}
