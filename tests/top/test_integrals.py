"""Every first integral, on random rational tops and states: the derivative along the flow is exactly 0."""

from itertools import permutations
from random import Random

import pytest
from flint import fmpq, fmpq_poly

from heavytop.precision import cross, dot
from heavytop.top import equations
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters, heavy_top, holding
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import flipped_gamma, fraction, moments, positive, rational, renamed, unit_vector, vector


def derivative(integral, p: Parameters, y, field) -> fmpq:
    """d/dt of the integral along the field: the coefficient of ε at y + ε y'."""
    exact = Parameters([rational(v) for v in p.inertia], [rational(v) for v in p.moment], rational(p.rotor))
    point = [rational(v) for v in y]
    moving = [fmpq_poly([v, rate]) for v, rate in zip(point, field(exact, point), strict=True)]
    return integral.value(exact, moving)[1]


def random_tops(random: Random, axes):
    """(name of an integral that must be offered, top, start) for every class, on renamed axes."""
    i1, i2, i3 = moments(random)
    weight, a, b, c = positive(random), fraction(random), fraction(random), fraction(random)
    start = State(vector(random), unit_vector(random))

    def top(inertia, centre):
        return HeavyTop(renamed(inertia, axes), weight, renamed(centre, axes))

    yield "energy", top((i1, i2, i3), (a, b, c)), start
    yield "momentum_squared", top((i1, i2, i3), (0, 0, 0)), start
    yield f"spin{axes[2] + 1}", top((i1, i1, i3), (0, 0, c)), start
    yield "kovalevskaya", top((2 * i3, 2 * i3, i3), (a, b, 0)), start
    yield "moment_along_centre", top((i1, i1, i1), (a, b, c)), start
    body = top((4 * i3, 4 * i3, i3), (a, b, 0))
    momentum = body.angular_momentum(start.omega)
    off = dot(momentum, start.gamma)
    omega = [w - off * g / m for w, g, m in zip(start.omega, start.gamma, body.inertia, strict=True)]
    yield "goryachev_chaplygin", body, State(omega, start.gamma)
    yield "hess", *hess_top(random, axes, weight)


def hess_top(random: Random, axes, weight):
    """b = 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², with rational a, c: I1 (I2 - I3) = I3 (I1 - I2) (c/a)²."""
    ratio, i1, i3 = positive(random), positive(random), positive(random)
    i2 = i1 * i3 * (1 + ratio**2) / (i1 + i3 * ratio**2)
    a = fraction(random)
    c = a * ratio
    w2, w3 = fraction(random), fraction(random)
    w1 = -i3 * c * w3 / (i1 * a)
    top = HeavyTop(renamed((i1, i2, i3), axes), weight, renamed((a, 0, c), axes))
    return top, State(renamed((w1, w2, w3), axes), unit_vector(random))


@pytest.mark.parametrize("axes", list(permutations(range(3))))
def test_every_integral_of_the_heavy_top_is_conserved_exactly_on_any_axes(axes) -> None:
    random = Random(str(axes))
    for _ in range(15):
        for name, top, start in random_tops(random, axes):
            p = HEAVY_TOP.parameters(top, start)
            found = {integral.name: integral for integral in holding(top, start)}
            assert name in found, (name, top)
            for integral in found.values():
                assert derivative(integral, p, start.flat, heavy_top) == 0, integral.name


def test_every_integral_of_the_gyrostat_is_conserved_exactly_whatever_m_and_gamma_are() -> None:
    random = Random(7)
    for equal in (False, True):
        for _ in range(20):
            i1, i2, i3 = moments(random)
            top = HeavyTop((i1, i2, i1 if equal else i3), positive(random), (0, fraction(random), 0))
            gamma = unit_vector(random)
            parallel = State([3 * g / i for g, i in zip(gamma, top.inertia, strict=True)], gamma)
            p = GYROSTAT.parameters(top, parallel)
            y = (*vector(random), *vector(random))
            found = holding(top, parallel, GYROSTAT)
            assert {"momentum_squared", "gyrostat_energy"} <= {i.name for i in found}
            assert ("spin2" in {i.name for i in found}) is equal or i1 == i3
            for integral in found:
                assert derivative(integral, p, y, equations.gyrostat) == 0, integral.name


def flipped_torque(p: Parameters, y):
    """The field with the sign of one torque wrong."""
    rates = list(heavy_top(p, y))
    torque = cross(y[3:6], p.moment)
    rates[1] -= 2 * torque[1] / p.inertia[1]
    return tuple(rates)


@pytest.mark.parametrize("wrong", [flipped_torque, flipped_gamma])
def test_a_flipped_sign_in_the_field_is_caught_by_an_integral(wrong) -> None:
    random = Random(3)
    for name, top, start in random_tops(random, (0, 1, 2)):
        if name == "momentum_squared":
            continue  # no torque to flip, and |γ|² does not see the sense of its rotation
        p = HEAVY_TOP.parameters(top, start)
        rates = [derivative(i, p, start.flat, wrong) for i in holding(top, start)]
        assert any(rate != 0 for rate in rates), name
