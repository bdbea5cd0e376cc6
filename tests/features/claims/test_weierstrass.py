"""Claims in Weierstrass' functions and about tops with products of inertia: proofs, their conditions, and traps."""

from fractions import Fraction
from typing import Any

import pytest
import sympy

from heavytop.errors import InputError
from heavytop.features.claims.algebra.elliptic import wp, wpprime
from heavytop.features.claims.algebra.evaluate import evaluate
from support.claim_tables import audited, integral, open_conditions, rotation, top

U, G2, G3 = sympy.symbols("u g2 g3", real=True)


def _zero(p: str, g2: str, g3: str) -> str:
    """1, if the differential equation holds."""
    return f"1 + {p}prime(t, {g2}, {g3})^2 - 4*{p}(t, {g2}, {g3})^3 + {g2}*{p}(t, {g2}, {g3}) + {g3}"


def test_the_branch_without_poles_satisfies_its_equation_where_the_roots_are_three() -> None:
    assert rotation(_zero("wp3", "4", "1")).verdict == "holds"
    assert rotation(_zero("wp3", "4", "1") + " + wp3(t, 4, 1)").verdict == "refuted"
    samples = {"a": ["4", "5"], "b": ["1", "-1"]}
    for roots in (("3", "1"), ("0", "0"), ("1", "3")):  # colliding and complex roots leave no bounded branch
        with pytest.raises(InputError, match="> 0, which is false"):
            rotation(_zero("wp3", *roots))
    assert "a^3 - 27*b^2 > 0" in open_conditions(rotation(_zero("wp3", "a", "b"), parameters=samples))
    assert rotation(_zero("wp3", "a", "b"), ["a^3 > 27*b^2"], parameters=samples).verdict == "holds"


POLES = (_zero("wp", "4", "1"), "1 + 0*wp(t, 4, 1)", "1 + wp(t, 4, 1) - wp(t, 4, 1)", "wp(t, 1, 0)/wp(t, 1, 0)")


@pytest.mark.parametrize(
    ("rate", "domain", "verdict", "named"),
    [
        # poles on the real line are never passed over; of numbers they are excluded by balls
        *((rate, domain, "undecided", "t is not a period of wp(u, ") for rate in POLES for domain in ("all", "t>0")),
        ("1 + wp(1, 4, 1) - wp(1, 4, 1)", "all", "holds", ""),
        ("1 + 0*wp(0, 4, 1)", "all", "undecided", ""),
        ("1 + wp3(t, 4, 1) - wp3(t, 4, 999/1000)", "all", "refuted", ""),
        ("wp3(t, 4, 1)", "all", "refuted", ""),
        ("1 + wp(t, 4, 1) - wp(2*t, 4, 1)", "all", "refuted", ""),
    ],
)
def test_a_rate_is_constant_where_it_is_defined_and_its_neighbours_are_not(
    rate: str, domain: str, verdict: str, named: str
) -> None:
    report = rotation(rate, domain=domain)
    assert report.verdict == verdict
    assert named in open_conditions(report)


def test_invariants_that_move_are_not_proven() -> None:
    assert rotation("1 + wp3(t, 4 + t^2, 1)").verdict != "holds"


@pytest.mark.parametrize(("g2", "g3"), [(4, 1), (4, -1), (5, 0), (1, 3), (-2, 1), (0, -2), (-3, 0)])
def test_balls_of_weierstrass_functions_satisfy_their_equation_and_begin_as_their_series(g2: int, g3: int) -> None:
    place = {U: Fraction(1, 50), G2: Fraction(g2), G3: Fraction(g3)}
    p, q = (float(evaluate(f(U, G2, G3, evaluate=False), place, 192).mid()) for f in (wp, wpprime))
    u = 1 / 50
    assert abs(p - (1 / u**2 + g2 * u**2 / 20 + g3 * u**4 / 28 + g2**2 * u**6 / 1200)) < 1e-11
    assert abs(q - (-2 / u**3 + g2 * u / 10 + g3 * u**3 / 7)) < 1e-8
    far = {**place, U: Fraction(7, 5)}
    equation = wpprime(U, G2, G3) ** 2 - 4 * wp(U, G2, G3) ** 3 + G2 * wp(U, G2, G3) + G3
    assert evaluate(equation, far, 192).contains(0)


def _integral(value: str, inertia: list[Any], rotor: Any = None, **parts: Any) -> str:
    of = top("", "1 0 2") | {"inertia": inertia} | ({"rotor": rotor} if rotor else {})
    return audited(integral(value, of, **parts)).verdict


_FULL = "(3*Omega1 + Omega3/2)*gamma1 + 5*Omega2*gamma2 + (6*Omega3 + Omega1/2)*gamma3"


@pytest.mark.slow
@pytest.mark.parametrize(
    "inertia",
    [
        ["3", "5", "6", "0", "1/2", "0"],
        ["3", "0", "1/2", "0", "5", "0", "1/2", "0", "6"],
        [["3", "0", "1/2"], ["0", "5", "0"], ["1/2", "0", "6"]],
    ],
)
def test_integrals_with_products_of_inertia(inertia: list[Any]) -> None:
    assert _integral(_FULL, inertia) == "holds"
    assert _integral("3*Omega1*gamma1 + 5*Omega2*gamma2 + 6*Omega3*gamma3", inertia) == "refuted"


@pytest.mark.slow
def test_the_area_integral_of_any_tensor_with_any_rotor() -> None:
    parameters = {"A": "3", "B": "4", "C": "5", "F": "1/2", "E": "1/4", "D": "1/3"}
    value = (
        "(A*Omega1 + F*Omega2 + E*Omega3 + 1)*gamma1 + (F*Omega1 + B*Omega2 + D*Omega3 + 2)*gamma2"
        " + (E*Omega1 + D*Omega2 + C*Omega3 + 3)*gamma3"
    )
    for text, verdict in ((value, "holds"), (value.replace("+ 3)", "+ 2)"), "refuted")):
        assert _integral(text, list("ABCFED"), ["1", "2", "3"], parameters=parameters) == verdict


@pytest.mark.parametrize(
    "inertia",
    [["1", "2"], ["1", "2", "3", "0", "0", "5"], [["1", "2", "0"], ["0", "4", "0"], ["0", "0", "3"]], ["1"] * 7],
)
def test_a_tensor_that_is_none_is_refused(inertia: list[Any]) -> None:
    with pytest.raises(InputError):
        _integral("Omega1", inertia)
