"""The attitude of the Goryachev-Chaplygin top: the azimuth of M, on tori, with a variable at rest, at any time."""

from fractions import Fraction

import mpmath
import pytest
from flint import fmpq_mpoly_ctx

from exact.test_goryachev_chaplygin import UP, motion_from, random_motion
from heavytop.errors import OutOfReach
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplyginAttitude, _motion
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.precision import cross, dot
from support.proofs import assert_attitude, assert_meets, attitude_of

F = Fraction
PLAIN = motion_from((F(1), F(0)), ("3/2", 1, 0), UP)
TILTED = motion_from((F(1, 2), F(3, 4)), (2, "-1/2", -6), ("3/7", "6/7", "2/7"), F(1, 2))
DOUBLE = motion_from((F(1), F(0)), (0, F(3, 2), 0), (F(4, 5), 0, F(3, 5)))
RESTING = motion_from((F(1), F(0)), (F(-18, 13), 0, F(-30, 13)), (F(-5, 13), 0, F(12, 13)))
RESONANT = motion_from((F(1), F(0)), (F(2877, 4444), F(1), 0), UP)
ASYMPTOTIC = motion_from((F(1), F(0)), (F(-8, 5), 4, F(-24, 5)), (F(-3, 5), 0, F(4, 5)))


def test_the_azimuth_of_the_angular_momentum_is_proven_by_polynomials():
    """γ·(M × (M' + Ω × M)) = |γ|² n·M − (M·γ)(n·γ), M² = (u1 − u2)²; u1 + u2 = r and u1 u2 = −4s."""
    context = fmpq_mpoly_ctx.get(["p", "q", "r", "g1", "g2", "g3", "c"], "lex")
    p, q, r, *gamma, c = context.gens()
    omega, up, moment, momentum = (p, q, r), tuple(gamma), (c, 0 * c, 0 * c), (4 * p, 4 * q, r)

    body = [one + other for one, other in zip(cross(momentum, omega), cross(up, moment), strict=True)]
    space = [one + other for one, other in zip(body, cross(omega, momentum), strict=True)]
    turning = dot(up, cross(momentum, space))
    assert turning == dot(up, up) * dot(moment, momentum) - dot(momentum, up) * dot(moment, up)
    assert dot(momentum, momentum) == r**2 - 4 * (-4 * (p**2 + q**2))


@pytest.mark.slow
@pytest.mark.parametrize("motion", [TILTED, DOUBLE, RESTING], ids=["tilted", "double root", "resting"])
def test_the_enclosure_holds_the_attitude(motion):
    assert "validated" not in attitude_of(motion, F(2), 170)[0]
    assert_meets(motion, (F(3, 2), F(-4)))
    assert_attitude(motion, F(-(10**6)))


@pytest.mark.slow
def test_where_it_is_not_done_the_attitude_is_the_enclosures():
    with pytest.raises(OutOfReach, match="asymptotic"):
        ASYMPTOTIC.attitude(F(1), 100)
    assert_meets(ASYMPTOTIC, (F(1),))
    # 1,000 digits would take minutes
    assert "validated" in attitude_of(PLAIN, F(1), 3400)[0]


def upwards(a, h, side):
    """d/dy of (u, α, β) at s + iy: du/ds = −αβ, α² = ∓(au − X), β² = ∓(au + X)."""

    def field(_y, z):
        u, alpha, beta = z
        slope = 1.5 * u * u - h
        return [-1j * alpha * beta, side * 1j * (a - slope) * beta / 2, side * 1j * (a + slope) * alpha / 2]

    return field


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2])
def test_the_strips_are_analytic_as_far_as_they_say(seed):
    """The motion goes on upwards in s from real places, as far as |Im s| may be, within the bounds."""
    motion = random_motion(seed)
    with working_precision(128):
        form = _motion(motion)
        uniform = GoryachevChaplyginAttitude.of(form).uniform
        a, h = float(form.size), float(ball(form.level.energy))
        for k, one in enumerate(uniform):
            height, middle = float(one.width * one.gap.means[0]), form.line.variables[k].middle
            beside = form.line.variables[1 - k]
            other = float(beside.middle + (2 * k - 1) * -beside.reach)
            for angle in (0.3, 1.5, 2.9):
                u, alpha, beta = (float(x) for x in form.halves(k, middle * 0 + angle, 0))

                with mpmath.workdps(15):
                    flow = mpmath.odefun(upwards(a, h, 2 * k - 1), 0, [u, alpha, beta])
                    place, first, second = flow(height)
                    assert abs(place - u) <= 0.45 * abs(u - other)
                    assert abs(first) <= one.largest[0]
                    assert abs(second) <= one.largest[1]


@pytest.mark.slow
def test_at_a_resonance_the_azimuth_grows_as_no_sum_of_integrals_of_one_variable_does():
    """With ω2 = 3 ω1 the mean of dΛ/ds over a closed motion depends on 3φ1 − φ2: on which closed motion it is.

    A vector whose azimuth splits would make it the same for all: the term would be 0 at the resonance.
    """
    with working_precision(128):
        integral = GoryachevChaplyginAttitude.of(_motion(RESONANT)).integral
        first, second = integral.rates
        assert abs(second / first - 3).upper() < 1e-7
        terms = [one for product in integral.products for one in product.resonances if one.twice == (3, 1)]
        assert abs(sum(one.coefficient for one in terms) / 2) > 0.2
    assert_meets(RESONANT, (F(3),), 136)
