"""Jacobi's functions in claims: their values, their identities, and what nobody may call proven."""

import json
import re
from fractions import Fraction
from typing import Any

import mpmath
import pytest
import sympy

from heavytop.errors import InputError
from heavytop.features.claims.algebra.elliptic import cn, dn, sn
from heavytop.features.claims.algebra.evaluate import evaluate
from support.claim_algebra import T, vanishes
from support.claim_tables import audited, integral, open_conditions, top

M = sympy.Symbol("m", real=True)
# Euler's free body, I1 > I2 > I3 and 2 T I2 < G²: the parameter lies between 0 and 1
EULER: dict[str, Any] = {
    "kind": "motion",
    "assume": ["A > B", "B > C", "C > 0", "E > 0", "H > 0", "H > E*B", "E*A > H"],
    "parameters": {"A": ["3", "5"], "B": ["2", "3"], "C": ["1", "2"], "E": ["1", "3/2"], "H": ["5/2", "6"]},
    "definitions": {
        "m": "(A*E - H)*(B - C)/((A - B)*(H - C*E))",
        "rate": "sqrt((H - C*E)*(A - B)/(A*B*C))",
        "m1": "sqrt(A*(H - C*E)/(A - C))*dn(rate*t, m)",
        "m2": "-sqrt(B*(A*E - H)/(A - B))*sn(rate*t, m)",
        "m3": "sqrt(C*(A*E - H)/(A - C))*cn(rate*t, m)",
    },
    "top": top("A B C", "0 0 0", "0"),
    "motion": {"omega": ["m1/A", "m2/B", "m3/C"], "gamma": ["m1/sqrt(H)", "m2/sqrt(H)", "m3/sqrt(H)"]},
}


NUMBERS = {"A": "3", "B": "2", "C": "1", "E": "1", "H": "(5/2)"}
"""One such body and motion, of which an audit takes a tenth of the time."""


def verdict(table: dict[str, Any]) -> str:
    return audited(table).verdict


def changed(**definitions: str) -> dict[str, Any]:
    return EULER | {"definitions": EULER["definitions"] | definitions}


def in_numbers(table: dict[str, Any], letters: str = "ABCEH") -> dict[str, Any]:
    """The claim with numbers for these letters, and without assumptions and parameters."""
    text = json.dumps({key: part for key, part in table.items() if key not in ("assume", "parameters")})
    numbers: dict[str, Any] = json.loads(re.sub(rf"\b[{letters}]\b", lambda letter: NUMBERS[letter[0]], text))
    return numbers


@pytest.mark.parametrize("m", ["0", "1/3", "99/100", "1"])
@pytest.mark.parametrize("u", ["0", "1/7", "-5/2", "40"])
def test_the_values_are_those_of_another_library(u: str, m: str) -> None:
    with mpmath.workdps(40):
        place, parameter = (mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator for x in (u, m))
        for function, name in ((sn, "sn"), (cn, "cn"), (dn, "dn")):
            ball = evaluate(function(sympy.Rational(u), sympy.Rational(m), evaluate=False), {}, 120)
            true = mpmath.ellipfun(name, place, m=parameter)
            assert abs(mpmath.mpf(ball.str(35, radius=False)) - true) < mpmath.mpf(10) ** -30


@pytest.mark.parametrize("m", ["-1/10", "11/10"])
def test_a_parameter_out_of_range_has_no_value(m: str) -> None:
    assert not evaluate(sn(sympy.Integer(1), sympy.Rational(m)), {}, 100).is_finite()


S, C, D = sn(T, M), cn(T, M), dn(T, M)


@pytest.mark.parametrize(
    "zero",
    [
        S**2 + C**2 - 1, D**2 + M * S**2 - 1, S.diff(T) - C * D, C.diff(T) + S * D, D.diff(T) + M * S * C,
        S.diff(T, 2) + (1 + M) * S - 2 * M * S**3, sympy.sqrt(1 - M * S**2) - D, sn(-T, M) + S, cn(-T, M) - C,
    ],
)  # fmt: skip
def test_identities_are_proven(zero: sympy.Expr) -> None:
    assert vanishes(zero)


@pytest.mark.parametrize(
    "other",
    [
        sympy.sqrt(1 - S**2) - C, S.diff(T) - C, D**2 + S**2 - 1, C.diff(T) - S * D, sn(2 * T, M) - 2 * S * C * D,
        sn(T, M) - sn(T, 1 - M), dn(T, M) - dn(T + 1, M),
    ],
)  # fmt: skip
def test_what_is_no_identity_is_not_proven(other: sympy.Expr) -> None:
    assert not vanishes(other)
    values = {T: Fraction(5, 2), M: Fraction(1, 3)}
    assert not evaluate(other, values, 100).contains(0)


@pytest.mark.slow
def test_eulers_motion_holds_for_every_body() -> None:
    assert verdict(EULER) == verdict(in_numbers(EULER)) == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("definitions", "verdicts"),
    [
        ({"m2": "sqrt(B*(A*E - H)/(A - B))*sn(rate*t, m)"}, {"refuted"}),
        ({"m": "(A*E - H)*(B - C)/((A - B)*(H - C*E))*99/100"}, {"refuted"}),
        ({"m3": "sqrt(C*(A*E - H)/(A - C))*dn(rate*t, m)"}, {"refuted"}),
        ({"m": "sin(t)^2"}, {"refuted", "undecided"}),  # a parameter that moves
    ],
)
def test_a_planted_fault_is_refuted(definitions: dict[str, str], verdicts: set[str]) -> None:
    assert verdict(in_numbers(changed(**definitions))) in verdicts


@pytest.mark.slow
def test_a_fault_planted_in_the_motion_of_every_body_is_refuted() -> None:
    assert verdict(changed(rate="sqrt((H - C*E)*(A - B)/(A*B*C))*101/100")) == "refuted"


@pytest.mark.slow
def test_without_the_range_of_the_parameter_it_is_undecided_and_says_so() -> None:
    loose = in_numbers(EULER, "ABCE") | {"parameters": {"H": "5/2"}}
    assert verdict(loose | {"assume": ["2 < H < 3"]}) == "holds"
    report = audited(loose | {"assume": ["1 < H < 3"]})
    assert report.verdict == "undecided"
    assert "≤ 1" in open_conditions(report)


@pytest.mark.parametrize("value", ["Omega3/cn(1, 1/2)*cn(1, 1/2)", "Omega3*dn(Omega1, 1/2)/dn(Omega1, 1/2)"])
def test_divisors_that_are_never_0_do_no_harm(value: str) -> None:
    assert verdict(integral(value, top("2 2 1", "0 0 1"))) == "holds"


@pytest.mark.parametrize("formula", ["sn(t)", "sn(t, 1/2, 3)", "sn", "cn()", "dn t"])
def test_wrong_calls_are_refused(formula: str) -> None:
    with pytest.raises(InputError):
        audited(changed(m1=formula))


def test_an_unknown_name_lists_the_functions() -> None:
    with pytest.raises(InputError, match="unknown name 'sd'") as error:
        audited(changed(m1="sd(t, 1/2)"))
    assert "sn, cn, dn" in error.value.remedy
