"""Euler angles (3.1), (3.2) and the attitude vector."""

import math
from random import Random

import pytest
import sympy

from heavytop.exact.flint.balls import FUNCTIONS, ball, working_precision
from heavytop.measure.attitude_error import attitude_angle
from heavytop.precision import cross, dot
from heavytop.top.attitude import (
    attitude_from_angles,
    euler_angles,
    gamma_from_angles,
    perpendicular,
    rows_of,
    unwrap,
)
from support.helpers import unit_vector


def test_the_angles_come_back_from_gamma_and_xi() -> None:
    random = Random(1)
    for _ in range(100):
        phi, psi = (random.uniform(-3.1, 3.1) for _ in range(2))
        theta = random.uniform(0.01, 3.1)
        gamma = gamma_from_angles(phi, theta, math)
        xi = attitude_from_angles(phi, theta, psi, math)
        assert euler_angles(gamma, xi, math) == pytest.approx((phi, theta, psi), abs=1e-12)


@pytest.mark.slow
def test_gamma_and_xi_turn_as_3_1_says() -> None:
    """γ' = γ × Ω and ξ' = ξ × Ω with Ω of (3.1), symbolically."""
    t = sympy.Symbol("t")
    phi, theta, psi = (sympy.Function(name)(t) for name in ("phi", "theta", "psi"))
    gamma = gamma_from_angles(phi, theta, sympy)
    xi = attitude_from_angles(phi, theta, psi, sympy)
    omega = (
        psi.diff(t) * gamma[0] + theta.diff(t) * sympy.cos(phi),
        psi.diff(t) * gamma[1] - theta.diff(t) * sympy.sin(phi),
        psi.diff(t) * gamma[2] + phi.diff(t),
    )
    for vector in (gamma, xi):
        for left, right in zip(vector, cross(vector, omega), strict=True):
            assert sympy.simplify(left.diff(t) - right) == 0


def test_the_perpendicular_of_a_rational_unit_vector_is_a_rational_unit_vector() -> None:
    random = Random(2)
    for gamma in [unit_vector(random) for _ in range(50)] + [(0, 0, 1), (0, 0, -1), (1, 0, 0)]:
        xi = perpendicular(gamma)
        assert dot(xi, xi) == 1
        assert dot(xi, gamma) == 0
    assert perpendicular((0, 0, 1)) == (1, 0, 0)


def test_the_rotation_angle_keeps_its_digits_near_0() -> None:
    with working_precision(400):
        tiny = ball(10) ** -60
        phi, theta, psi = ball(1), ball(2), ball(3)
        first, other = (
            rows_of(gamma_from_angles(angle, theta, FUNCTIONS), attitude_from_angles(angle, theta, psi, FUNCTIONS))
            for angle in (phi, phi + tiny)
        )
        angle = attitude_angle(first, other)
        assert angle.overlaps(tiny)
        assert angle.rel_accuracy_bits() > 90


def test_the_rotation_angle_of_a_half_turn_is_pi() -> None:
    axes = [[ball(int(i == j)) for j in range(3)] for i in range(3)]
    turned = [[-value for value in row] for row in axes[:2]] + axes[2:]
    assert float(attitude_angle(axes, turned)) == pytest.approx(math.pi)


def test_unwrapped_angles_never_jump_by_more_than_half_a_turn() -> None:
    true = [0.3 * i for i in range(100)]
    wrapped = [math.atan2(math.sin(a), math.cos(a)) for a in true]
    assert unwrap(wrapped, math.tau) == pytest.approx(true)
    assert unwrap([], math.tau) == []
