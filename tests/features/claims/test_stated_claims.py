"""Claims as papers state them: >= in assume, attitudes as quaternion and matrix, and a sample of validation's own."""

import copy
import random
from typing import Any

import pytest

import stated_claims
from heavytop.errors import InputError
from heavytop.features.claims.audit.judge import Audit
from heavytop.features.claims.text import audit_text
from support.claim_tables import audited, rotation
from support.helpers import shown


def spinning(rate: str, assume: list[str], **parts: Any) -> Audit:
    return rotation(rate, assume, parameters={"a": ["3/4", "7/8"], "b": ["1/2", "5/8"]}, **parts)


@pytest.mark.parametrize(
    ("rate", "assume", "expected"),
    [
        ("sqrt(a - b)", ["a >= b"], "holds"),
        ("sqrt(a - b)", ["b <= a", "a < 1"], "holds"),
        ("sqrt(a)", ["0 <= a <= 1"], "holds"),
        ("1/(a - b)", ["a >= b"], "undecided"),
        ("1/(a - b)", ["a > b"], "holds"),
        ("a + t*sqrt((a - 3/4)^2)*(a - 7/8)", ["a >= 1/2"], "refuted"),  # right at the samples, not where a = 1/2
    ],
)
def test_a_claim_holds_where_its_assumptions_are_equalities_too(rate: str, assume: list[str], expected: str) -> None:
    assert spinning(rate, assume).verdict == expected


def test_what_equality_leaves_open_is_said() -> None:
    report = spinning("1/(a - b)", ["a >= b"])
    assert "a - b != 0" in {c.assumption for row in report.rows for c in row.conditions if not c.discharged}


def test_a_parameter_that_no_formula_uses_is_said_and_columns_are_those_that_tell_something() -> None:
    report = spinning("2*c", ["b > 0"], definitions={"c": "a", "d": "b"})
    assert report.unused == ("b",)
    assert report.to_json()["unused"] == ["b"]
    text = shown(audit_text(report))
    assert "No formula uses b" in text
    assert "equation  verdict  residual" in text
    assert "equation  domain  verdict" in shown(audit_text(spinning("2*a", [], domain="t>0")))


ATTITUDE = stated_claims.free_quaternion()


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(ATTITUDE.same)))
def test_an_attitude_holds_as_a_quaternion_and_as_a_matrix(number: int) -> None:
    table = copy.deepcopy(ATTITUDE.table)
    stated_claims._swapped(table, ATTITUDE.same[number])
    assert audited(table).verdict == "holds"


@pytest.mark.slow
def test_a_quaternion_beside_omega_and_gamma_has_to_be_theirs() -> None:
    table = copy.deepcopy(ATTITUDE.table)
    u = "2*b"
    gamma = [f"2*c*s*sin({u})", f"2*c*s*cos({u})", "h"]
    omega = [f"g/A*{gamma[0]}", f"g/A*{gamma[1]}", "g*h/C"]
    table["motion"] |= {"omega": omega, "gamma": gamma}
    assert audited(table).verdict == "holds"
    table["motion"]["quaternion"][1:3] = ["-s*cos(a - b)", "-s*sin(a - b)"]
    assert {row.equation for row in audited(table).rows if row.holds is False} == {"attitude"}


def test_one_attitude_at_a_time() -> None:
    table = copy.deepcopy(ATTITUDE.table)
    table["motion"]["angles"] = ["t", "t", "t"]
    with pytest.raises(InputError, match="attitude twice"):
        audited(table)


@pytest.mark.slow
def test_an_angle_in_t_needs_no_rate_of_the_claim() -> None:
    family = stated_claims.lagrange_angles()
    table = copy.deepcopy(family.table)
    table["quadrature"] = {"variable": "u", "phi": "Omega3 - gamma3*(b - a*gamma3)/(A*(1 - gamma3^2))"}
    assert audited(table).verdict == "holds"  # the state is u and Omega3 = a/C
    del table["quadrature"]
    assert audited(table).verdict == "holds"
    assert stated_claims._swapped(table, family.wrong[0])
    assert audited(table).verdict == "refuted"


@pytest.mark.slow
def test_a_condition_whose_rate_is_0_at_the_start_alone_is_not_kept() -> None:
    table = copy.deepcopy(stated_claims.euler_component(0)().table)
    table["component"]["constants"] = ["(I1*Omega1)^2 + I2*Omega2^2 + (I3*Omega3)^2"]
    report = audited(table)
    assert report.verdict == "refuted"
    assert any("the flow leaves" in row.residual for row in report.rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["theta pendulum", "bounded"])
def test_no_verdict_is_false(name: str) -> None:
    outcomes = list(stated_claims.outcomes(3, 10, name))
    assert [(o.mistake, o.table) for o in outcomes if o.is_false] == []
    assert all(o.verdict in ("holds", "refuted") for o in outcomes)


def test_the_numbers_of_the_generator_see_a_mistake() -> None:
    family = stated_claims.swinging()
    assert stated_claims.is_true(family.table, family.draw, random.Random(1))
    table = copy.deepcopy(family.table)
    assert stated_claims._swapped(table, family.wrong[0])
    assert not stated_claims.is_true(table, family.draw, random.Random(1))
