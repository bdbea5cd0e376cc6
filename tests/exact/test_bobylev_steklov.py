"""Bobylev-Steklov motions: both kinds, the separatrix, states of the attitude that are special, and the builder."""

import random
from fractions import Fraction

import pytest

from heavytop import HeavyTop, InputError, State
from heavytop.exact.cases.bobylev_steklov import BobylevSteklov
from rational_motions import bobylev_steklov_motion
from support.proofs import assert_solves, positive, rational

TINY, HALF = Fraction(1, 10**30), Fraction(1, 2)


def motion_from(p, x, gamma1, gamma2, moment=1, inertia=(Fraction(3, 2), Fraction(1))):
    p, x, gamma1, gamma2 = map(Fraction, (p, x, gamma1, gamma2))
    i2, i3 = inertia
    top = HeavyTop((2 * i3, i2, i3), 1, (moment, 0, 0))
    return BobylevSteklov(top, State((p, 0, x), (gamma1, gamma2, i3 * p * x / Fraction(moment))))


def random_motion(seed):
    rng = random.Random(seed)
    moment, p = positive(rng) * rng.choice((1, -1)), rational(rng)
    return motion_from(p, rational(rng), rational(rng), rational(rng), moment, (positive(rng), positive(rng)))


@pytest.mark.parametrize("seed", range(10))
def test_the_builder_gives_unit_gamma(seed):
    rng = random.Random(seed)
    inertia = (positive(rng), positive(rng))
    motion = bobylev_steklov_motion(inertia, rational(rng) + 5, positive(rng), rational(rng), rational(rng))
    motion.start.require_unit_gamma()
    assert_solves(motion, rational(rng, size=30))


# C = 0 is |γ|² n1² = h²: I3 = n1 = 1, γ3 = p x, h = γ1 + x²/2; γ1² + γ2² + p² x² = (γ1 + x²/2)², and so
# γ2² = x² (γ1 + x²/4 − p²): x = 2, p = 1, γ1 = 1, γ2 = 2.
# x = 0, γ = (±1, 0, 0) turns steadily about the vertical, stable or not; so does γ2 = 0, x² = 2B
OFF = (Fraction(0), TINY, -TINY)
RATES = ((1, HALF, 0), (-1, HALF, 0), (1, 2, 0), (-1, 1, 1), (2, 1, 2))
STARTS = {
    **{f"separatrix {sign}, {n}": (1, 2 * sign, 1, 2 + off) for sign in (1, -1) for n, off in enumerate(OFF)},
    **{f"equilibrium {g}, {p}, {n}": (p, x + off, g, off) for g, p, x in RATES for n, off in enumerate(OFF)},
    **{f"turning {x}": (Fraction(2, 3), x, Fraction(4, 5), 0) for x in (HALF, -3)},
    "axis 3 is vertical, up": (1, 1, 0, 0),  # the pole of its azimuth
    "axis 3 is vertical, down": (1, -1, 0, 0),
    "M along γ at a turning point": (1, 1, 2, 0),  # γ2 = 0, γ1/γ3 = 2p/x
    "M along γ, another": (2, -1, 8, 0),
    "cn through 0": (1, 0, 1, 0),
    "cn through 0, nearly": (1, 0, 1, TINY),
    "pendulum about axis 3": (0, 1, 1, 1),
    "pendulum at rest": (0, 0, 1, 0),
    "nearly a pendulum": (TINY, 1, 1, 1),
    "level": (1, 0, 0, 1),
    "pendulum turning over": (0, 2, 1, 0),
}


def test_a_builder_without_a_centre_is_refused():
    with pytest.raises(InputError, match="a = 0"):
        bobylev_steklov_motion((Fraction(1), Fraction(1)), Fraction(0), Fraction(1), Fraction(1), Fraction(1))
