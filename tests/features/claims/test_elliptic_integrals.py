"""Jacobi's functions, am, Legendre's integrals, theta functions, ζ and σ in claims: values, derivatives, identities."""

from fractions import Fraction

import mpmath
import pytest
import sympy

from heavytop.errors import InputError
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.reader import parse, symbol
from heavytop.features.claims.algebra.structure import rate_along
from support.claim_tables import rotation

U, M, N = sympy.symbols("u m n", real=True)
NAMES = {str(x): symbol(x) for x in (U, M, N)} | {"pi": symbol(sympy.pi)}


def formula(text: str) -> sympy.Expr:
    return parse(text, NAMES, "formula").expression


def value(expression: sympy.Expr, u: Fraction) -> mpmath.mpf:
    return mpmath.mpf(evaluate(expression, {U: u}, 300).str(45, radius=False))


def of_theta(index: int, m: str, real: str, imaginary: str = "0") -> mpmath.mpc:
    """θ at π (real + i F(atan imaginary, 1 − m))/(2K)."""
    p = mpmath.mpf(m)
    argument = mpmath.mpc(mpmath.mpf(real), mpmath.ellipf(mpmath.atan(mpmath.mpf(imaginary)), 1 - p))
    return mpmath.jtheta(index, mpmath.pi * argument / (2 * mpmath.ellipk(p)), mpmath.qfrom(m=p))


@pytest.mark.parametrize(
    ("text", "true"),
    [
        ("ellipticF(5*u, 1/3)", lambda u: mpmath.ellipf(5 * u, mpmath.mpf(1) / 3)),
        ("ellipticE(-7*u, 3/4)", lambda u: mpmath.ellipe(-7 * u, 0.75)),
        ("ellipticPi(1/4, 7*u, -2)", lambda u: mpmath.ellippi(0.25, 7 * u, -2)),
        ("sin(am(9*u, 1/4))", lambda u: mpmath.ellipfun("sn", 9 * u, m=0.25)),
        *((f"theta{i}(u, 1/7)", lambda u, i=i: mpmath.jtheta(i, u, mpmath.mpf(1) / 7)) for i in (1, 2, 3, 4)),
        ("Eta(u, 3/4)", lambda u: of_theta(1, "0.75", u).real),
        ("Theta(u, 3/4)", lambda u: of_theta(4, "0.75", u).real),
        ("thetaArgument(4*u, 3/4, 1/5)", lambda u: mpmath.arg(of_theta(4, "0.2", 4 * u, "0.75"))),
        ("modulus(nome(u/9)*1)", lambda u: u / 9),
        ("wzeta(u, 4, 0) - wzeta(u + 0, 4, 0) + wp(u, 4, 0)*wsigma(u, 4, 0)^2", lambda u: weierstrass(u)),
    ],
)
def test_values_are_those_of_another_library(text: str, true: object) -> None:
    with mpmath.workdps(40):
        assert abs(value(formula(text), Fraction(12345, 10000)) - true(mpmath.mpf("1.2345"))) < 1e-30  # type: ignore[operator]


@pytest.mark.parametrize("m", ["0", "1/3", "99/100", "1"])
@pytest.mark.parametrize("u", ["0", "1/7", "-5/2", "40"])
def test_values_of_jacobis_functions_are_those_of_another_library(u: str, m: str) -> None:
    with mpmath.workdps(40):
        for name in ("sn", "cn", "dn"):
            ball = evaluate(formula(f"{name}(u, m)"), {U: Fraction(u), M: Fraction(m)}, 120)
            true = mpmath.ellipfun(name, mpmath.mpmathify(u), m=mpmath.mpmathify(m))
            assert abs(mpmath.mpf(ball.str(35, radius=False)) - true) < mpmath.mpf(10) ** -30


def weierstrass(u: mpmath.mpf) -> mpmath.mpf:
    """℘ σ² of the square lattice g2 = 4, g3 = 0 by theta functions of nome e^(−π)."""
    half, q = mpmath.gamma(0.25) ** 2 / (4 * mpmath.sqrt(2 * mpmath.pi)), mpmath.exp(-mpmath.pi)
    z = mpmath.pi * u / (2 * half)
    first, third = mpmath.jtheta(1, 0, q, 1), mpmath.jtheta(1, 0, q, 3)
    sigma = 2 * half / mpmath.pi * mpmath.exp(-(z**2) * third / (6 * first)) * mpmath.jtheta(1, z, q) / first
    cosine = mpmath.jtheta(2, z, q) / mpmath.jtheta(1, z, q) * first / mpmath.jtheta(2, 0, q)
    return (1 + (mpmath.pi / (2 * half) * cosine) ** 2) * sigma**2


RATES = [
    ("sn(u, m)", "cn(u, m)*dn(u, m)"),
    ("cn(u, m)", "-sn(u, m)*dn(u, m)"),
    ("dn(u, m)", "-m*sn(u, m)*cn(u, m)"),
    ("cn(u, m)*dn(u, m)", "2*m*sn(u, m)^3 - (1 + m)*sn(u, m)"),
    ("am(u, m)", "dn(u, m)"),
    ("ellipticF(am(2*u, m), m)", "2"),
    ("ellipticE(am(u, m), m)", "1 - m*sin(am(u, m))^2"),
    ("ellipticPi(n, am(3*u, m), m)", "3/(1 - n*sn(3*u, m)^2)"),
    ("jacobiZeta(u, m)", "dn(u, m)^2 - ellipticE(pi/2, m)/ellipticK(m)"),
    ("log(Theta(u, m))", "jacobiZeta(u, m)"),
    ("theta1(u, m)/theta4(u, m)", "theta4(0, m)^2*theta2(u, m)*theta3(u, m)/theta4(u, m)^2"),
    ("theta2(u, m)/theta4(u, m)", "-theta3(0, m)^2*theta1(u, m)*theta3(u, m)/theta4(u, m)^2"),
    ("Eta(u, m)/Theta(u, m)", "sqrt(sqrt(m))*cn(u, m)*dn(u, m)"),
    ("thetaArgument(u, n, m)",
     "thetaRate(n, m) - m*n*sqrt((1 + m*n^2)*(1 + n^2))*sn(u, m)^2/(1 + m*n^2*sn(u, m)^2)"),
    ("log(wsigma3(u, 4, n))", "wzeta3(u, 4, n)"),
    ("wsigma(u, 4, n)", "wsigma(u, 4, n)*wzeta(u, 4, n)"),
    ("wzeta(u, 4, n) + wzeta3(u, 4, m)", "-wp(u, 4, n) - wp3(u, 4, m)"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "rate"), RATES)
def test_derivatives_are_proven_and_wrong_ones_are_not(text: str, rate: str) -> None:
    residual = rate_along({U: sympy.Integer(1)})(formula(text)) - formula(rate)
    known = Assumptions(U, positive=(M, N), facts=(1 - M, 1 - N))
    assert Field(known, [residual]).is_zero(residual)
    wrong = residual + formula(rate) / 1000
    assert not Field(known, [wrong]).is_zero(wrong)


@pytest.mark.parametrize(("text", "rate"), RATES)
def test_derivatives_are_those_of_the_values(text: str, rate: str) -> None:
    at = {M: sympy.Rational(1, 3), N: sympy.Rational(2, 7)}
    f, g, step = formula(text).subs(at), formula(rate).subs(at), Fraction(1, 10**12)
    with mpmath.workdps(40):
        slope = (value(f, Fraction(4, 5) + step) - value(f, Fraction(4, 5) - step)) / (2 * mpmath.mpf(10) ** -12)
        assert abs(slope - value(g, Fraction(4, 5))) < 1e-20


@pytest.mark.parametrize(
    ("rate", "parameter", "assume", "missing"),
    [
        ("1 + am(t, a) - am(t, a)", "1/2", [], "a ≥ 0"),
        ("1 + 0*am(t, a)", "1/2", ["0 < a < 1"], ""),
        ("1 + 0*ellipticF(t, a)", "1/2", [], "a < 1"),
        ("1 + 0*ellipticE(t, a)", "1/2", [], "a ≤ 1"),
        ("1 + 0*ellipticPi(a, t, 1/3)", "-1/2", [], "a < 1"),
        ("1 + 0*Theta(t, a)", "1/2", ["a > 0"], "a < 1"),
        ("1 + 0*theta3(t, a)", "1/2", ["a > 0"], "a < 1"),
        ("1 + 0*wzeta3(t, 4, a)", "1/2", [], "> 0"),
        ("1 + 0*wzeta(t, 4, a)", "1/2", [], "not a period"),
        ("1 + 0*thetaArgument(t, a, 1/2)", "1/2", [], "a ≠ 0"),
        # a nome lies between 0 and 1, and says nothing of the other arguments
        ("1 + 0*thetaArgument(t, a, nome(1/3))", "1/2", [], "a ≠ 0"),
        ("1 + 0*ellipticPi(a, t, nome(1/3))", "-1/2", [], "a < 1"),
        ("1 + 0*wsigma(t, 4, a)", "1/2", [], ""),
    ],
)
def test_degenerate_parameters_and_poles_are_conditions(
    rate: str, parameter: str, assume: list[str], missing: str
) -> None:
    report = rotation(rate, assume, parameters={"a": parameter})
    left = [c.text for row in report.rows for c in row.conditions if not c.discharged]
    assert (report.verdict == "holds") is not bool(missing)
    assert any(missing in text for text in left) if missing else not left


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sn(t, a)^2 + cn(t, a)^2 - 1", "holds"),
        ("dn(t, a)^2 + a*sn(t, a)^2 - 1", "holds"),
        ("sqrt(1 - a*sn(t, a)^2) - dn(t, a)", "holds"),
        ("sn(-t, a) + sn(t, a) + cn(-t, a) - cn(t, a)", "holds"),
        ("cn(t, 1/2)/cn(1, 1/2)*cn(1, 1/2) - cn(t, 1/2)*dn(t, a)/dn(t, a)", "holds"),  # divisors that are never 0
        ("sqrt(1 - sn(t, a)^2) - cn(t, a)", "refuted"),
        ("dn(t, a)^2 + sn(t, a)^2 - 1", "refuted"),
        ("sn(2*t, a) - 2*sn(t, a)*cn(t, a)*dn(t, a)", "refuted"),
        ("sn(t, a) - sn(t, 1 - a^2)", "refuted"),
        ("dn(t, a) - dn(t + 1, a)", "refuted"),
        ("ellipticPi(0, t, a) - ellipticF(t, a)", "holds"),
        ("sin(am(t, 1)) - tanh(t)", "holds"),
        ("wp3(-t, 4, a) - wp3(t, 4, a)", "holds"),
        ("wp3prime(-t, 4, a) + wp3prime(t, 4, a)", "holds"),
        ("theta3(0, nome(a))^2 - 2*ellipticK(a)/pi", "holds"),
        ("theta3(0, nome(a))^2 - 2*ellipticK(a)/pi + 1e-30", "refuted"),
        ("asin(sin(t)) - t", "refuted"),  # from a quarter of the period on
        ("ellipticE(t, 1) - sin(t)", "refuted"),
        ("ellipticF(asin(sn(t, a)), a) - t", "refuted"),
        ("sn(t + 2*ellipticK(a), a) + sn(t, a) + cn(6*ellipticK(a) - t, a) + cn(t, a)", "holds"),
        ("am(t - 4*ellipticK(a), a) - am(t, a) + 2*pi + dn(t, a) - dn(2*ellipticK(a) + t, a)", "holds"),
        ("sn(t + 2*ellipticK(1/3), a) + sn(t, a)", "refuted"),
        ("dn(t - 2*ellipticK(a), a) + dn(t, a)", "refuted"),
    ],
)
def test_degenerate_values_nomes_and_later_branches_are_decided(text: str, expected: str) -> None:
    assert rotation(f"1 + t*({text})", ["0 < a < 1"], parameters={"a": "1/2"}).verdict == expected


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("am(1, {})", "2"),
        ("ellipticF(1, {})", "1"),
        ("ellipticPi({}, 1, 1/2)", "2"),
        ("modulus({})", "2"),
        ("sn(1, {})", "-1/10"),
        ("cn(1, {})", "11/10"),
        ("wp3(1, {}, 1)", "3"),
        ("asin({})", "2"),
    ],
)
def test_beyond_the_parameters_there_is_no_value(text: str, number: str) -> None:
    assert not evaluate(formula(text.format("u")), {U: Fraction(number)}, 100).is_finite()
    with pytest.raises(InputError, match="which is false"):
        formula(text.format(number))


def test_a_parameter_may_have_the_name_of_an_elliptic_function() -> None:
    assert rotation("nome", parameters={"nome": "1/2"}).verdict == "holds"


@pytest.mark.parametrize("text", ["sn(t)", "sn(t, 1/2, 3)", "sn", "cn()", "dn t"])
def test_wrong_calls_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        rotation(text)


def test_an_unknown_name_lists_the_functions() -> None:
    with pytest.raises(InputError, match="unknown name 'sd'") as error:
        rotation("sd(t, 1/2)")
    assert "sn, cn, dn" in error.value.remedy
