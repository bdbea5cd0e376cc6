"""Motions in a variable u with t = F(u): they hold where F has an inverse, and nowhere else."""

import tomllib
from importlib.resources import files
from typing import Any

import mpmath
import pytest

from heavytop.errors import InputError
from support.claim_tables import audited, integral, open_conditions, top

EXAMPLE = files("heavytop.features.claims") / "examples" / "pendulum-quadrature.toml"


def pendulum(**quadrature: Any) -> dict[str, Any]:
    table = tomllib.loads(EXAMPLE.read_text())
    table["quadrature"] |= quadrature
    return table


def turning(angle: str, time: str, *where: str) -> dict[str, Any]:
    """A free body that turns at the rate 1 about a level axis, γ by formulas of u."""
    return {
        "kind": "motion",
        "top": top("1 2 3", "0 0 0"),
        "quadrature": {"variable": "u", "time": time, "where": list(where)},
        "motion": {"omega": ["0", "0", "1"], "gamma": [f"cos({angle})", f"-sin({angle})", "0"]},
    }


def test_the_pendulum_holds_between_its_turning_points() -> None:
    report = audited(pendulum())
    assert report.verdict == "holds"
    assert {row.domain for row in report.rows} == {"-1 < u < 1"}
    assert report.solves == ("heavy_top",)


@pytest.mark.slow
def test_the_example_is_the_pendulum_of_an_integration_of_its_own() -> None:
    """u(t) = sn(a t, k²), put into the formulas of the file, moves as θ'' = -a² sin θ does: by mpmath alone."""
    table = pendulum()
    values = {"a": mpmath.mpf(2) / 3, "k": mpmath.mpf(3) / 5, "sqrt": mpmath.sqrt}
    with mpmath.workdps(40):
        a, k = values["a"], values["k"]
        path = mpmath.odefun(lambda _, y: [y[1], -(a**2) * mpmath.sin(y[0])], 0, [mpmath.mpf(0), 2 * a * k])
        angle, rate = path(mpmath.mpf("1.25"))
        u = mpmath.ellipfun("sn", a * mpmath.mpf("1.25"), m=k**2)

        def at(text: str) -> mpmath.mpf:
            return eval(text.replace("^", "**"), {**values, "u": u})

        assert abs(at(table["motion"]["omega"][2]) - rate) < 1e-30
        assert abs(at(table["motion"]["gamma"][0]) + mpmath.cos(angle)) < 1e-30
        assert abs(at(table["motion"]["gamma"][1]) - mpmath.sin(angle)) < 1e-30


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "verdict", "why"),
    [
        ({"where": ["0 < u", "1 - u^2 > 0"]}, "holds", ""),
        ({"where": ["1 - u^2 > 0"], "points": ["1/7"]}, "holds", ""),
        ({"where": ["-2 < u < 2"]}, "undecided", "(1 - u^2)*(-k^2*u^2 + 1) ≥ 0 not shown"),
        ({"where": []}, "undecided", "(1 - u^2)*(-k^2*u^2 + 1) ≥ 0 not shown"),
        ({"where": ["-1 < u < 1"], "points": ["2"]}, "undecided", "no point tried lies where -1 < u < 1: u = 2"),
        ({"where": ["u > 2", "u < 1"]}, "undecided", "no point tried"),
        ({"integrand": "1/(2*a*sqrt((1 - u^2)*(1 - k^2*u^2)))"}, "refuted", ""),
        ({"integrand": "-1/(a*sqrt((1 - u^2)*(1 - k^2*u^2)))"}, "refuted", ""),
    ],
)
def test_neighbours_of_the_pendulum(change: dict[str, Any], verdict: str, why: str) -> None:
    report = audited(pendulum(**change))
    assert report.verdict == verdict
    assert why in open_conditions(report)
    if verdict == "refuted":
        witness = next(row.witness for row in report.rows if row.witness is not None)
        assert "u" in witness
        assert "t" not in witness


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "time", "where", "verdict"),
    [
        ("u^3/3", "u^3/3", (), "undecided"),  # the inverse has no rate at 0
        ("u^3/3", "u^3/3", ("u > 0",), "holds"),
        ("u^2/2", "u^2/2", (), "undecided"),  # two u at every time
        ("u^2/2", "u^2/2", ("-1 < u < 1",), "undecided"),
        ("u^2/2", "u^2/2", ("u < 0",), "holds"),
        ("1/u", "1/u", (), "undecided"),
        ("1/u", "1/u", ("u > 0",), "holds"),
        ("log(u)", "log(u)", (), "undecided"),
        ("log(u)", "log(u)", ("u > 0",), "holds"),
        ("sqrt(u^2)", "sqrt(u^2)", (), "undecided"),
        ("u", "u + atan(u) + atan(1/u)", (), "undecided"),  # at no u for a time of pi
        ("u", "u + atan(u) + atan(1/u)", ("u < 0",), "holds"),
        ("atan(u)", "atan(u)", (), "holds"),
        ("tan(u)", "tan(u)", (), "undecided"),
        ("tan(u)", "tan(u)", ("-1 < u < 1",), "holds"),
        ("u", "u", ("sqrt(u) > 1",), "undecided"),  # not known to be defined wherever it is asked
        ("-u", "u", (), "refuted"),
        ("u", "2*u", (), "refuted"),
        ("u*sqrt(u^2)/u", "u", ("u^2 > 1",), "refuted"),  # right on one of two components
    ],
)
def test_a_quadrature_needs_an_inverse(angle: str, time: str, where: tuple[str, ...], verdict: str) -> None:
    assert audited(turning(angle, time, *where)).verdict == verdict


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"variable": "t"}, "'t' of the variable"),
        ({"variable": "Omega1"}, "'Omega1' of the variable"),
        ({"variable": "sqrt"}, "'sqrt' of the variable"),
        ({"variable": "a"}, "'a' is reserved"),
        ({"time": "u"}, "either time or integrand"),
        ({"integrand": "0*u"}, "does not depend on u"),
        ({"integrand": "t"}, "unknown name 't'"),
        ({"where": ["u"]}, "where of [quadrature]: 'u' cannot be parsed"),
        ({"where": ["v > 0"]}, "unknown name 'v'"),
        ({"points": ["x"]}, "quadrature.points"),
        ({"low": "0"}, "low"),
        ({"psi": "u"}, "does not use psi of [quadrature]"),
    ],
)
def test_what_cannot_be_a_quadrature_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        audited(pendulum(**change))
    assert said in str(error.value)


@pytest.mark.parametrize(
    "edit",
    [
        {"domain": "t>0"},
        {"times": ["1"]},
        {"relations": ["u - 1"]},
        {"assume": ["a > 0", "0 < k < 1", "u > 0"]},
        {"top": {"inertia": ["1", "1", "2/3"], "weight": "u", "centre": ["1", "0", "0"]}},
        {"kind": "integral", "motion": None, "integral": {"value": "Omega1"}},
    ],
)
def test_the_variable_stands_in_nothing_that_is_constant(edit: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        audited(pendulum() | edit)


def test_a_relation_that_the_samples_miss_is_named() -> None:
    value, where = "Omega3*(Omega1^2 + Omega2^2) - Omega1*gamma3", "4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3"
    table = integral(value, top("4 4 1", "1 0 0"), [where], ["1 2 3 3/5 0 4/5"])
    said = open_conditions(audited(table))
    assert "where Omega1 = 1, Omega2 = 2, Omega3 = 3, gamma1 = 3/5, gamma2 = 0, gamma3 = 4/5" in said
    assert f"{where} is not 0" in said
