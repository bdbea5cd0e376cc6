"""The attitude of Kovalevskaya's top: the vector whose azimuth is an Abel integral, every level, any time."""

import random
from fractions import Fraction
from itertools import cycle

import pytest
from flint import arb, fmpq_mpoly_ctx

from exact.test_kovalevskaya import OTHER, TILTED, UP, motion_from
from heavytop import HeavyTop, OutOfReach, State
from heavytop.exact.cases.kovalevskaya import along_gamma, level_vector
from heavytop.exact.cases.kovalevskaya_theta import KovalevskayaLevel, start_of
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.precision import cross, dot
from support.proofs import assert_attitude, assert_meets, attitude_of, positive, rational, triple

F = Fraction
ALONG_1 = F(1), F(0)
STARTS = {
    "generic": ((F(1, 3), F(4, 5), F(-7, 10)), TILTED),
    "at rest": ((0, 0, 0), TILTED),
    "no area": ((F(1, 2), F(-1, 2), 0), OTHER),
    "q = 0": ((F(1, 2), 0, 1), TILTED),
    "double root outside": ((F(1, 2), F(1, 3), 5), UP),
    "asymptotic": ((-1, F(1, 4), F(1, 4)), UP),
    "asymptotic, tilted": ((F(1, 3), F(1, 6), 1), OTHER),
}


def test_the_level_vector_of_kovalevskayas_top_is_proven_by_polynomials():
    """v·γ = 0, v² = −4q² (w1 − e)(w2 − e) and v² Λ' = γ·(v × (v' + Ω × v)) = (l/2)(v² + 4q² (e² − k²)), on |γ| = 1."""
    context = fmpq_mpoly_ctx.get(["p", "q", "r", "g1", "g2", "g3", "a"], "lex")
    p, q, r, *gamma, a = context.gens()
    omega, up = (p, q, r), tuple(gamma)
    momentum = (2 * p, 2 * q, r)

    def on_sphere(f):
        """The remainder with γ3² = 1 − γ1² − γ2²."""
        return divmod(f, gamma[2] ** 2 + gamma[0] ** 2 + gamma[1] ** 2 - 1)[1]

    moved = [one + other for one, other in zip(cross(momentum, omega), cross(up, (a, 0 * a, 0 * a)), strict=True)]
    rates = (moved[0] / 2, moved[1] / 2, moved[2], *cross(up, omega))

    def rate(f):
        return sum((f.derivative(i) * rates[i] for i in range(6)), 0 * a)

    s, h, l = p**2 + q**2, p**2 + q**2 + r**2 / 2 + a * gamma[0], dot(momentum, up)  # noqa: E741
    e, (real, imaginary) = l**2 / 2 - h, (p**2 - q**2 - a * gamma[0], 2 * p * q - a * gamma[1])
    k2 = real**2 + imaginary**2
    v = (
        r * (l**2 / 2 - 2 * p**2) + gamma[2] * (2 * a * p - l * (h + q**2 - p**2)),
        -2 * p * q * r - a * l * gamma[1] * gamma[2] + 2 * l * p * q * gamma[2] + l * r * (p * gamma[1] - q * gamma[0]),
        l * ((k2 - s**2) / a) + 2 * p * (s + e),
    )
    assert on_sphere(dot(v, up)) == 0
    c, g = a * l, a**2 - k2
    r12, hat = -(s**2) + 2 * h * s - 2 * c * p + g, 2 * h * s**2 - 4 * c * s * p + 4 * g * p**2 + c**2 - 2 * g * h
    square = dot(v, v)
    assert on_sphere(square - (-4 * q**2 * e**2 - 2 * r12 * e + hat)) == 0
    turned = [rate(one) + other for one, other in zip(v, cross(omega, v), strict=True)]
    assert on_sphere(dot(up, cross(v, turned)) - l / 2 * (square + 4 * q**2 * (e**2 - k2))) == 0
    assert on_sphere(rate(k2)) == 0
    assert on_sphere(dot(up, cross(v, turned)) - l / 2 * (square + 4 * q**2 * (e**2 + k2))) != 0


@pytest.mark.parametrize("seed", range(3))
def test_the_vector_is_level_and_its_azimuth_turns_as_the_integrals_say(seed):
    rng = random.Random(seed)
    top = HeavyTop((2, 2, 1), 1, (positive(rng), rational(rng), 0))
    level = KovalevskayaLevel.of(top, State(triple(rng), triple(rng)))
    with working_precision(300, 3):
        motion = [x * 1 for x in start_of(level).motion]
        vector = level_vector(level, motion)
        gamma, size = motion[3:], ball(level.gamma_square).sqrt()
        assert dot(vector, gamma)[0].contains(0)
        square = dot(vector, vector)[0]
        # c² (−4q² (e − w1)(e − w2)), exactly, by the level alone
        found = ball(level.separated(level.double()) / level.moment_square)
        assert square.overlaps(found)
        assert (square - found).abs_upper() < abs(found) * arb("1e-70")
        apart = ball(level.double() ** 2 - level.fourth)
        wanted = along_gamma(level) / 2 * (1 + 4 * motion[1][0] ** 2 * apart / found)
        # in space v' is that in the body + Ω × v
        rates = [x.derivative()[0] for x in vector]
        moved = [a + b[0] for a, b in zip(rates, cross(motion[:3], vector), strict=True)]
        across = cross([g[0] / size for g in gamma], [v[0] for v in vector])
        assert (dot(moved, across) / square - wanted).contains(0)
        assert abs(dot(moved, across) / square - wanted).upper() < arb("1e-60")


@pytest.mark.slow
@pytest.mark.parametrize("name", STARTS)
def test_the_enclosure_holds_the_attitude(name):
    assert_meets(motion_from(ALONG_1, *STARTS[name]), (F(0), F(3, 2), F(-6)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_random_tops_with_the_centre_anywhere(seed):
    rng = random.Random(seed)
    moment = positive(rng) * rng.choice((1, -1)), rational(rng)
    gamma = rng.sample(TILTED, 3)
    assert_meets(motion_from(moment, triple(rng), gamma, positive(rng)), (F(2),))


@pytest.mark.slow
def test_many_turns_are_counted():
    assert_meets(motion_from(ALONG_1, *STARTS["generic"]), (F(30),), 140)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "time"), list(zip(STARTS, cycle((F(10**6), F(-(10**12)))))))
def test_at_any_time_the_attitude_turns_with_the_body(name, time):
    assert_attitude(motion_from(ALONG_1, *STARTS[name]), time)


def test_with_a_variable_at_rest_the_attitude_is_the_enclosures():
    motion = motion_from(ALONG_1, (0, F(-4, 3), 0), UP)
    with pytest.raises(OutOfReach, match="constant separated variable"):
        motion.attitude(F(1), 100)
    assert "validated" in attitude_of(motion, F(2), 170)[0]
    assert_meets(motion, (F(2),))


@pytest.mark.parametrize("area", [F(1, 100), F(1, 10**30)])
def test_near_to_no_area_the_attitude_holds_or_is_the_enclosures(area):
    # the pole of the azimuth then lies beside a turning point
    motion = motion_from(ALONG_1, (F(1, 4) + area, F(1, 3), F(1, 5)), (F(4, 5), F(-3, 5), 0))
    assert_meets(motion, (F(2),))
