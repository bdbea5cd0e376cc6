"""One field for every ring: what it gives does not depend on the numbers it is given."""

from fractions import Fraction
from random import Random

import mpmath
import pytest
import sympy

from heavytop.exact.flint.balls import ball, working_precision
from heavytop.integrate.heyoka.engines import expressions
from heavytop.precision import cross
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, SYSTEMS, Parameters
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import fraction, moments, positive, unit_vector, vector


def random_problem(random: Random):
    top = HeavyTop(moments(random), positive(random), vector(random))
    p = Parameters(top.inertia, top.moment, fraction(random))
    return p, (*vector(random), *vector(random))


def converted(p: Parameters, y, to):
    return Parameters([to(v) for v in p.inertia], [to(v) for v in p.moment], to(p.rotor)), [to(v) for v in y]


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda s: s.name)
def test_the_field_is_the_vector_equation_of_the_paper(system) -> None:
    random = Random(1)
    for _ in range(30):
        p, y = random_problem(random)
        omega, gamma = y[:3], y[3:]
        momentum = [i * w for i, w in zip(p.inertia, omega, strict=True)]
        turning = system.angular_velocity(p, y)
        torque = cross(gamma, p.moment) if system is HEAVY_TOP else (0, 0, 0)
        rates = system.field(p, y)
        momentum_rate = [i * rate for i, rate in zip(p.inertia, rates, strict=False)]
        assert momentum_rate == [a + b for a, b in zip(cross(momentum, turning), torque, strict=True)]
        assert rates[3:] == cross(gamma, turning)
        if system is HEAVY_TOP:
            assert turning == omega
        else:
            assert turning == (omega[0], omega[1] + p.rotor, omega[2])


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda s: s.name)
def test_fractions_balls_mpf_sympy_and_heyoka_give_the_same_field(system) -> None:
    import heyoka

    random = Random(3)
    p, y = random_problem(random)
    truth = system.field(p, y)

    with working_precision(200):
        assert all(ball(t).overlaps(v) for t, v in zip(truth, system.field(*converted(p, y, ball)), strict=True))
    with mpmath.workdps(60):
        values = system.field(*converted(p, y, lambda v: mpmath.mpf(v.numerator) / v.denominator))
        assert all(abs(v - mpmath.mpf(t.numerator) / t.denominator) < 1e-50 for v, t in zip(values, truth, strict=True))
    names = sympy.symbols("i1:4 n1:4 lam w1:4 g1:4")
    symbolic = system.field(Parameters(names[:3], names[3:6], names[6]), names[7:])
    at = dict(zip(names, [sympy.Rational(v.numerator, v.denominator) for v in (*p.inertia, *p.moment, p.rotor, *y)],
                  strict=True))  # fmt: skip
    assert [Fraction(int(e.subs(at).p), int(e.subs(at).q)) for e in symbolic] == list(truth)

    pairs = expressions(system, attitude=False)
    compiled = heyoka.cfunc([rate for _, rate in pairs], vars=[name for name, _ in pairs])
    coefficients = (*p.inertia, p.rotor) if system is GYROSTAT else (*p.inertia, *p.moment)
    values = compiled([float(v) for v in y], pars=[float(v) for v in coefficients])
    assert values == pytest.approx([float(t) for t in truth], rel=1e-12)


def test_the_attitude_vector_turns_with_the_body_s_own_angular_velocity() -> None:
    random = Random(4)
    p, y = random_problem(random)
    xi = unit_vector(random)
    for system in (HEAVY_TOP, HEAVY_GYROSTAT):
        assert system.attitude(p._replace(rotor=vector(random)), y, xi) == cross(xi, y[:3])
    assert GYROSTAT.attitude(p, y, xi) == cross(xi, (y[0], y[1] + p.rotor, y[2]))


def test_a_system_from_another_process_is_the_same_object() -> None:
    import pickle

    for system in SYSTEMS:
        assert pickle.loads(pickle.dumps(system)) is system
    state = State((1, 2, 3), (0, 0, 1))
    assert pickle.loads(pickle.dumps(state)) == state
