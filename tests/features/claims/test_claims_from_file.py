"""Claims that users write: the worked examples, planted errors in them, and files that mean harm."""

from __future__ import annotations

import time
import tomllib
from importlib.resources import files

import pytest
from typer.testing import CliRunner

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import audit, audit_claim, claim_from_table
from heavytop.features.claims.audit.guard import in_time
from heavytop.features.claims.audit.judge import Audit
from heavytop.top.equations import GYROSTAT, HEAVY_TOP

EXAMPLES = files("heavytop.features.claims") / "examples"

HOSTILE = [
    "__import__('os').system('true')",
    "t.__class__.__mro__",
    "10^10^10",
    "10**10**10",
    "((((t+1)^64)^64)^64)^64",
    "(" * 3000 + "t" + ")" * 3000,
    "t" + "+t" * 4900,
    "1e999999",
    "t^t",
    "lambda: t",
    "[t]",
    "'t'",
    "sqrt(-1)",
    "1/(t-t)",
    "tan(pi/2)",
    "unknown*t",
    "sin(t, t)",
    "",
    "t)",
]


def table(name: str) -> dict:
    return tomllib.loads((EXAMPLES / f"{name}.toml").read_text())


def verdict(content: dict, system=HEAVY_TOP) -> Audit:
    return audit_claim(claim_from_table(content, "test"), system)


def refuted(report: Audit) -> set[tuple[str, int]]:
    return {(row.equation, row.component) for row in report.rows if row.holds is False}


@pytest.mark.slow
def test_the_delone_motion_holds_in_every_equation():
    report = verdict(table("delone-homoclinic"))
    assert report.verdict == "holds"
    assert report.solves == ("heavy_top",)
    assert {row.equation for row in report.rows} == {"1.1", "1.2", "1.3"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "index", "wrong", "expected"),
    [
        ("omega", 0, "-alpha*sin_phi/2", ("1.1", 1)),
        ("omega", 2, "(2 + 1e-30)*alpha*cos_theta", ("1.1", 3)),
        ("gamma", 2, "-cos_theta", ("1.2", 3)),
    ],
)
def test_a_mistake_in_the_delone_motion_is_refuted(part, index, wrong, expected):
    content = table("delone-homoclinic")
    content["motion"][part][index] = wrong
    report = verdict(content)
    assert report.verdict == "refuted"
    assert expected in refuted(report) or {name for name, _ in refuted(report)} & {expected[0]}


def test_the_lagrange_example_is_refuted_in_1_1_and_holds_with_the_sign_put_right():
    content = table("lagrange-wrong-sign")
    assert refuted(verdict(content)) == {("1.1", 1), ("1.1", 2)}
    content["definitions"]["moment"] = "p*(I3*(s + p*cos(theta)) - I1*p*cos(theta))"
    assert verdict(content).verdict == "holds"


@pytest.mark.slow
def test_kovalevskayas_integral_holds_and_fails_with_other_moments():
    content = table("kovalevskaya-integral")
    assert verdict(content).verdict == "holds"
    content["top"]["inertia"] = ["2*I3", "2*I3", "3*I3/2"]
    assert verdict(content).verdict == "refuted"


@pytest.mark.slow
def test_the_momentum_is_constant_for_the_gyrostat_and_not_for_the_heavy_top():
    content = table("momentum-squared")
    assert verdict(content).verdict == "refuted"
    assert verdict(content, GYROSTAT).verdict == "holds"
    assert verdict(content).solves == ("gyrostat",)


def test_a_conditional_integral_holds_on_its_condition_alone():
    content = {
        "name": "goryachev-chaplygin",
        "kind": "integral",
        "assume": ["I3 > 0"],
        "parameters": {"I3": "1", "n": "3/2"},
        "top": {"inertia": ["4*I3", "4*I3", "I3"], "weight": "1", "centre": ["n", "0", "0"]},
        "integral": {
            "value": "Omega3*(Omega1^2 + Omega2^2) - n/I3*Omega1*gamma3",
            "where": ["4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3"],
            "states": [["1", "-1", "-3", "3/5", "0", "4/5"]],
        },
    }
    assert verdict(content).verdict == "holds"
    content["integral"] |= {"where": [], "states": [["1", "2", "5", "3/5", "0", "4/5"]]}
    assert verdict(content).verdict == "refuted"


@pytest.mark.slow
def test_hess_relation_is_invariant_under_its_relation_between_the_parameters():
    content = {
        "name": "hess",
        "kind": "relation",
        "assume": ["I1 > 0", "I2 > 0", "I3 > 0", "c > 0"],
        "parameters": {"I1": "9", "I2": "5", "I3": "4", "a": "4", "c": "3"},
        "relations": ["I1*(I2 - I3)*a^2 - I3*(I1 - I2)*c^2"],
        "top": {"inertia": ["I1", "I2", "I3"], "weight": "1", "centre": ["a", "0", "c"]},
        "integral": {"value": "I1*a*Omega1 + I3*c*Omega3", "states": [["1", "1/2", "-3", "2/3", "1/3", "2/3"]]},
    }
    assert verdict(content).verdict == "holds"
    content["relations"] = []
    # the sample still satisfies the relation, so nothing refutes it; but it is proven no more
    assert verdict(content).verdict == "undecided"


@pytest.mark.slow
def test_what_the_algebra_cannot_carry_is_undecided_and_never_holds():
    content = table("delone-homoclinic")
    # 0 for t > 0, but no algebra of this kind knows it
    content["definitions"]["T"] = "tanh(alpha*t/sqrt(2)) + 2*atan(t) - atan2(2*t, 1 - t^2)"
    content |= {"domain": "t>0"}
    report = verdict(content)
    assert report.verdict == "undecided"
    assert report.exit_code == 3
    assert all(row.residual.startswith("|residual| < ") for row in report.rows if row.holds is None)


@pytest.mark.slow
@pytest.mark.parametrize("formula", HOSTILE)
def test_a_hostile_formula_is_refused_at_once(formula):
    content = table("delone-homoclinic")
    content["motion"]["omega"][0] = formula
    before = time.monotonic()
    with pytest.raises(InputError):
        verdict(content)
    assert time.monotonic() - before < 5


@pytest.mark.slow
@pytest.mark.parametrize("text", ["(" * 500_000 + ")" * 500_000, "a = " + "[" * 50_000, "\x00", "name = 1"])
def test_a_hostile_file_is_exit_2(tmp_path, text):
    from heavytop.cli import app

    path = tmp_path / "claim.toml"
    path.write_text(text)
    result = CliRunner().invoke(app, ["audit", str(path)])
    assert isinstance(result.exception, InputError)
    assert result.exception.exit_code == 2


def test_an_audit_that_does_not_end_is_stopped(tmp_path):
    content = (EXAMPLES / "delone-homoclinic.toml").read_text()
    path = tmp_path / "slow.toml"
    path.write_text(content)
    with pytest.raises(InputError, match="was stopped"):
        in_time(str(path), "heavy_top", seconds=0.01)


def test_a_sample_that_breaks_an_assumption_is_refused():
    content = table("delone-homoclinic")
    content["parameters"]["alpha"] = ["-1", "1"]
    with pytest.raises(InputError, match="breaks the assumption"):
        verdict(content)


@pytest.mark.slow
def test_a_file_is_audited_by_its_path():
    report = audit(str(EXAMPLES / "momentum-squared.toml"))
    assert (report.claim, report.exit_code) == ("momentum-squared", 1)


@pytest.mark.slow
def test_the_command_prints_the_json_that_scripts_read():
    import json

    from heavytop.cli import app

    result = CliRunner().invoke(app, ["audit", str(EXAMPLES / "lagrange-wrong-sign.toml"), "--json"])
    document = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (document["claim"], document["system"], document["verdict"]) == (
        "lagrange-wrong-sign",
        "heavy_top",
        "refuted",
    )
    text = CliRunner().invoke(app, ["audit", str(EXAMPLES / "lagrange-wrong-sign.toml")]).stdout
    assert "Witnesses" in text
    assert "(1.1) 1" in text
