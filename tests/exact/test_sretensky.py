"""Sretensky's gyrostat in closed form: its separation by polynomials, random motions, levels, what is refused."""

import random
from fractions import Fraction

import pytest
from flint import fmpq_mpoly_ctx

from heavytop import HeavyTop, State
from heavytop.exact.cases.goryachev_chaplygin import Sretensky
from heavytop.exact.separable.abel import Rest
from support.proofs import assert_attitude, assert_narrow, assert_solves, positive, rational

F = Fraction


def motion_from(moment, rotor, omega, gamma, i3=F(1)):
    """The motion whose third component of Ω makes M·γ vanish where γ3 is not 0."""
    w1, w2, *given = omega
    third = given[0] if given else -4 * (w1 * gamma[0] + w2 * gamma[1]) / F(gamma[2]) - rotor / i3
    top = HeavyTop((4 * i3, 4 * i3, i3), 1, (*moment, 0), (0, 0, rotor))
    return Sretensky(top, State((w1, w2, third), gamma))


def random_motion(seed):
    """The centre anywhere in the plane, any rotor, |γ| not 1."""
    rng = random.Random(seed)
    gamma = rational(rng), rational(rng), positive(rng)
    moment = positive(rng) * rng.choice((1, -1)), rational(rng)
    return motion_from(moment, positive(rng), (rational(rng), rational(rng)), gamma, positive(rng))


def test_the_separation_is_proven_by_polynomials():
    """x = X(u), x² + y² = a²u² and y = u' (u − v) of the roots u, v of u² − ρu − 4s, from the field equations."""
    context = fmpq_mpoly_ctx.get(["u", "p", "q", "r", "g1", "g2", "g3", "c", "k"], "degrevlex")
    u, p, q, r, g1, g2, g3, c, k = context.gens()
    rho, s = r + k, p * p + q * q
    energy = 2 * s + r * r / 2 + c * g1 - k * k / 2
    third = (r - k) * s - c * p * g3
    area = 4 * p * g1 + 4 * q * g2 + rho * g3
    separated = u * u - rho * u - 4 * s
    x, y = c * (2 * p * g3 - g1 * u), c * (2 * q * g3 - g2 * u)
    cubic = (u**3 - 2 * k * u * u - 2 * energy * u - 4 * third) / 2
    assert divmod(cubic - x, separated)[1] == 0
    square = x * x + y * y - c * c * (g1 * g1 + g2 * g2 + g3 * g3) * u * u
    # modulo the area: c²γ3 (γ3 (4s + ρu − u²) − area u)
    assert square == c * c * g3 * (-g3 * separated - area * u)
    # I1 Ω1' = M2 Ω3 − M3 Ω2, I2 Ω2' = M3 Ω1 − M1 Ω3 + γ3 c, M3' = −c γ2
    rate_of_s = (p * (4 * q * r - rho * q) + q * (rho * p - 4 * p * r + g3 * c)) / 2
    # u' (2u − ρ) = ρ'u + 4s', and 2u − ρ = u − v
    assert -c * g2 * u + 4 * rate_of_s == y


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 5])
def test_the_attitude_turns_with_the_body_at_any_time(seed):
    assert_attitude(random_motion(seed), F(-(10**4)))


ALONG_1 = (F(1), F(0))
STARTS = {
    "no rotor": (ALONG_1, 0, (F(3, 4), F(1, 2), 0), (0, 0, 1)),
    "turning point": (ALONG_1, 1, (F(3, 4), F(1, 2)), (0, 0, 1)),
    "both at turning points": (ALONG_1, F(-5, 2), (F(1, 3), F(0)), (0, 0, 1)),  # q = γ2 = 0
    "γ along the centre": (ALONG_1, -2, (0, F(1, 2), 0), (1, 0, 0)),
    "level": (ALONG_1, 2, (1, 0, 3), (0, 1, 0)),
    "tilted": (ALONG_1, 3, (0, F(3, 2)), (F(4, 5), 0, F(3, 5))),
}


@pytest.mark.slow
@pytest.mark.parametrize("place", [F(1), F(-2, 3)])
def test_a_variable_may_rest_at_a_double_root(place):
    """u = e at rest: Ω1 = e (1 + γ1)/(2γ3), ρ = e − 4Ω1²/e, and λ from X'(e) = a."""
    g1, g3 = F(-5, 13), F(12, 13)
    p = place * (1 + g1) / (2 * g3)
    rho = place - 4 * p * p / place
    rotor = (1 + g1 + 2 * p * p + rho * rho / 2 - 3 * place**2 / 2) / (rho - 2 * place)
    motion = motion_from((F(1), F(0)), rotor, (p, F(0), rho - rotor), (g1, 0, g3))
    assert_solves(motion, F(-40))
    assert_narrow(motion, F(10**6))
    assert all(isinstance(form.line.variables[0 if place > 0 else 1], Rest) for form in motion.made.values())
    assert_attitude(motion, F(7, 3))
