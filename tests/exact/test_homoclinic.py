"""The two homoclinic closed forms: residuals proven symbolically, values against states made elsewhere."""

from fractions import Fraction
from random import Random

import pytest
import sympy

from heavytop.errors import NotInClass
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial, hyperbolic, hyperbolic_angles
from heavytop.exact.flint.balls import FUNCTIONS, ball, midpoint, radius, working_precision
from heavytop.top.attitude import attitude_from_angles, gamma_from_angles, perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters
from support.helpers import positive
from support.proofs import assert_overlap

T, S = sympy.symbols("T S")
BOTH = [ErshkovPartial(Fraction(3, 4), Fraction(5), Fraction(2)), DeloneHomoclinic(Fraction(3, 4), Fraction(5))]


def derivative(expression, rate):
    """d/dt with T = tanh x, S = sech x, x' = rate: T' = S² x', S' = -S T x'."""
    return (expression.diff(T) * S**2 - expression.diff(S) * S * T) * rate


def vanishes(expression) -> bool:
    """Identity in T and S modulo T² + S² = 1, exactly."""
    numerator, _ = sympy.fraction(sympy.together(expression))
    return sympy.rem(sympy.expand(numerator), T**2 + S**2 - 1, T) == 0


def test_the_partial_case_solves_the_gyrostat_identically() -> None:
    alpha, ratio = sympy.symbols("alpha rho", positive=True)
    omega, gamma = hyperbolic(alpha, ratio, T, S)
    k = alpha * (ratio - 1)
    p = Parameters((ratio, ratio, 1), (0, 0, 0), k / 2)
    y = (*omega, *gamma)
    for value, rate in zip(y, GYROSTAT.field(p, y), strict=True):
        assert vanishes(derivative(sympy.sympify(value), k / 2) - rate)


@pytest.mark.slow
def test_the_delone_motion_solves_the_heavy_top_identically() -> None:
    alpha = sympy.Symbol("alpha", positive=True)
    d = 1 + S**2
    sin_theta, cos_theta, sin_phi = T**2 / d, 2 * S / d, -2 * sympy.sqrt(2) * T * S / d
    cos_phi = 2 * sin_theta - 1
    gamma = (sin_theta * sin_phi, sin_theta * cos_phi, cos_theta)
    y = (alpha / 2 * sin_phi, alpha * sin_theta, 2 * alpha * cos_theta, *gamma)
    p = Parameters((2, 2, 1), (0, alpha**2, 0), 0)
    for value, rate in zip(y, HEAVY_TOP.field(p, y), strict=True):
        assert vanishes(derivative(value, alpha / sympy.sqrt(2)) - rate)
    # and the code evaluates these very forms
    known = DeloneHomoclinic(Fraction(3, 4), Fraction(2))
    for time in (Fraction(-2), Fraction(5, 3)):
        x = 0.75 * float(time) / 2**0.5
        at = {T: sympy.tanh(x), S: 1 / sympy.cosh(x), alpha: 0.75}
        assert [float(v) for v in known.state(time, 60)] == pytest.approx([float(v.subs(at)) for v in y], abs=1e-14)


@pytest.mark.parametrize("known", BOTH)
def test_angles_and_attitude_agree_with_the_state_on_both_sides_of_the_pole(known) -> None:
    for time in (Fraction(-3), Fraction(-1, 7), Fraction(1, 9), Fraction(4)):
        state, (phi, theta, psi) = known.state(time, 150), known.angles(time, 150)
        with working_precision(150):
            gamma = gamma_from_angles(phi, theta, FUNCTIONS)
            xi = attitude_from_angles(phi, theta, psi, FUNCTIONS)
        assert_overlap(gamma, state[3:])
        assert_overlap(xi, known.attitude(time, 150))


@pytest.mark.parametrize("known", BOTH)
def test_the_start_is_the_state_at_0_and_the_end_is_the_saddle(known) -> None:
    assert [midpoint(v) for v in known.state(Fraction(0), 100)] == list(known.start.flat)
    assert known.start.require_unit_gamma()
    saddle = (0, known.alpha, 0, 0, 1, 0)
    for value, limit in zip(known.state(Fraction(300), 100), saddle, strict=True):
        assert abs(midpoint(value) - limit) < Fraction(1, 10**30)


def test_any_number_of_bits_comes_out() -> None:
    random = Random(1)
    known = ErshkovPartial(positive(random), Fraction(7), Fraction(2))
    for bits in (24, 53, 1000, 20000):
        for value in known.state(Fraction(31, 7), bits):
            assert radius(value) <= Fraction(1, 2**bits) * max(1, abs(midpoint(value)))


def test_the_angles_of_the_partial_case_keep_their_digits_at_both_ends() -> None:
    with working_precision(100):
        phi, theta = hyperbolic_angles(ball(Fraction(-200)), FUNCTIONS)
        assert phi.rel_accuracy_bits() > 80
        assert (theta - ball(1).acos()).is_finite()


@pytest.mark.parametrize("data", [(0, 2, 1), (-1, 2, 1), (1, 1, 1), (1, 1, 2), (1, 2, 0)])
def test_data_outside_the_partial_case_are_refused(data) -> None:
    with pytest.raises(NotInClass):
        ErshkovPartial(*(Fraction(v) for v in data))


def test_the_default_attitude_of_a_start_at_the_pole_is_e1() -> None:
    assert perpendicular(DeloneHomoclinic(Fraction(1), Fraction(2)).start.gamma) == (1, 0, 0)
