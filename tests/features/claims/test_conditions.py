"""A proof has conditions: what is undefined, not real, jumps or is not kept by the flow never holds, and is named."""

from fractions import Fraction

import pytest

from heavytop.errors import InputError
from heavytop.features.claims.algebra.conditions import written
from heavytop.features.claims.algebra.prover import KEPT
from heavytop.features.claims.text import audit_text
from support.claim_tables import Table, audited, integral, open_conditions, top, upright
from support.helpers import shown

FREE = top("2 3 5", "0 0 1", weight="0")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spin", "domain", "named"),
    [
        ("sqrt(t^2)/t", "all", "t ≠ 0"),
        ("atan(t) + atan(1/t)", "all", "t ≠ 0"),
        ("1 + atan(tan(t)) - t", "all", "cos(t) ≠ 0"),
        ("sqrt(sin(a*t)^2)/sin(a*t)", "t>0", "sin(a*t) ≠ 0"),
        ("sqrt(1 - 2*t + t^2)/(1 - t)", "t>0", "1 - t ≠ 0"),
        ("1 + atan2(sin(t), cos(t)) - t", "all", "may jump"),
        ("sqrt(a^2)/a", "all", "a ≠ 0"),
        ("2 + 0*sqrt(1 - 4*a^2)", "all", "1 - 4*a^2 ≥ 0"),
        ("exp(log(-1 - t^2)) + 1 + t^2", "all", "-t^2 - 1 > 0"),
        ("1 + 0*log(t)", "all", "t > 0"),
        ("1 + 0*sqrt(-t)", "t>0", "-t ≥ 0"),
        ("1 + 0*asin(2 + t^2)", "all", "at every sample in the domain a formula is undefined"),
        ("(t + sqrt(t^2))/(t + sqrt(t^2))", "all", "t + sqrt(t^2) ≠ 0"),
        ("sqrt(sinh(t)^2)/sinh(t)", "all", "sinh(t) ≠ 0"),
        ("t*(sqrt(3 + 2*sqrt(2)) - 1 - sqrt(2))/(sqrt(3 + 2*sqrt(2)) - 1 - sqrt(2)) - t + 1", "all", "≠ 0"),
    ],
)
def test_a_formula_that_jumps_or_is_undefined_is_undecided_and_the_condition_is_named(spin, domain, named):
    report = audited(upright(spin, domain=domain, parameters={"a": ["1", "2"]}))
    assert report.verdict == "undecided"
    assert named in open_conditions(report)


@pytest.mark.parametrize(
    ("spin", "domain", "assume"),
    [
        ("sqrt(t^2)/t", "t>0", []),
        ("sqrt(t^2)/t", "t<=0", []),
        ("sin(t)/sin(t)", "all", []),
        ("(t^2 - 1)/((t - 1)*(t + 1))", "all", []),
        ("1 + 0*log(t)", "t>0", []),
        ("sqrt(a^2)/a", "all", ["a > 0"]),
        ("1 + 0*sqrt(9 - a^2)", "all", ["a > 0", "a < 3"]),
        ("1 + 0*sqrt(5 - 4*cos(t)*sin(a*t))", "all", []),
        # an exponential above 1, and a square that its expansion hides
        ("sqrt(sinh(a)^2)/sinh(a)", "all", ["a > 0"]),
        ("1 + 0*sqrt((5 - 3*sin(a)*sin(3*t) - 2*cos(t))^2)", "all", []),
        ("cos(atan(sinh(t)))*cosh(t)", "all", []),
        ("tanh(log(2 + t^2))*((2 + t^2)^2 + 1)/((2 + t^2)^2 - 1)", "all", []),
    ],
)
def test_what_is_defined_or_removable_holds(spin, domain, assume):
    report = audited(upright(spin, domain=domain, assume=assume, parameters={"a": ["1", "2"]}))
    assert report.verdict == "holds", open_conditions(report)


ON_AXIS_1 = "0 1 2 1 0 0"


@pytest.mark.parametrize(
    ("value", "kind", "named"),
    [
        ("sqrt(Omega1)", "relation", "Omega1"),
        ("Omega1^2 + 1", "relation", "no sample lies on the relations"),
        ("sqrt(Omega1^2)/Omega1", "integral", "Omega1 ≠ 0"),
        ("sqrt(Omega1) - sqrt(Omega1) + gamma1^2 + gamma2^2 + gamma3^2", "integral", "Omega1 ≥ 0"),
        ("acos(2 + gamma1^2 + gamma2^2 + gamma3^2)", "integral", "at every sample"),
    ],
)
def test_what_needs_a_condition_that_is_not_shown_and_a_set_without_points_are_undecided(value, kind, named):
    report = audited(integral(value, FREE, kind=kind, states=[ON_AXIS_1] if kind == "relation" else []))
    assert report.verdict == "undecided"
    assert named in open_conditions(report)


# on Ω1² = 0 every rate is 0, and yet Ω1 does not stay 0
@pytest.mark.parametrize("condition", ["Omega1", "Omega1^2", "Omega1*Omega2", "exp(Omega1) - 1"])
def test_a_side_condition_that_the_flow_leaves_refutes_with_a_witness(condition):
    report = audited(integral("Omega3*0 + gamma1^2 + gamma2^2 + gamma3^2", FREE, [condition], [ON_AXIS_1]))
    (row,) = report.rows
    assert report.verdict == "refuted"
    assert row.residual.startswith("the flow leaves ")
    # Ω1' = (I2 − I3) Ω2 Ω3/I1 at the state of the file
    assert abs(float(row.witness["value"])) in (2.0, 4.0)
    # a state of the audit's own, where that of the file lies elsewhere
    off = audited(integral("gamma1^2 + gamma2^2 + gamma3^2", FREE, [condition], ["1 1 2 1 0 0"]))
    assert off.verdict == "refuted"


@pytest.mark.parametrize(
    ("value", "where"),
    [
        ("gamma1", ("Omega1", "Omega2", "gamma2")),
        ("Omega2^2", ()),
        ("Omega2^2", ("Omega1^2",)),
        ("exp(3*Omega2) - 1", ()),
        ("5*Omega2/(1 + gamma1^2)", ()),
        ("Omega3", ("gamma1^4", "gamma3")),
    ],
)
def test_a_rate_that_refutes_is_that_of_the_formula_it_is_said_to_be_of(value, where):
    parts = {"kind": "relation", "parameters": {"I1": "3", "I2": "2", "I3": "4"}}
    report = audited(integral(value, top("I1 I2 I3", "1 0 0"), where, **parts))
    assert report.verdict == "refuted"
    for row in report.rows:
        assert row.witness is not None
        w1, w2, w3, g1, g2, g3 = (float(Fraction(x)) for x in list(row.witness["parameters"].values())[3:])
        rates = {
            "Omega1": -2 * w2 * w3 / 3,
            "Omega2": (w3 * w1 + g3) / 2,
            "Omega3": (w1 * w2 - g2) / 4,
            "gamma1": g2 * w3 - g3 * w2,
            "gamma2": g3 * w1 - g1 * w3,
            "gamma3": g1 * w2 - g2 * w1,
        }
        left, _, kept = row.residual.removeprefix("the flow leaves ").partition(" = 0, at the rate ")
        named = left if kept else row.statement.partition("d(")[2].partition(")/dt")[0] or value
        assert abs(float(row.witness["value"]) - rates[named]) < 1e-12


@pytest.mark.parametrize(
    ("value", "state", "verdict"),
    [
        ("Omega1^2", ON_AXIS_1, "refuted"),
        ("Omega1", ON_AXIS_1, "refuted"),
        ("2*Omega1*gamma1 + 3*Omega2*gamma2 + 5*Omega3*gamma3", "0 0 2 1 0 0", "holds"),
        # at gamma = e1 the rate is 0 and the second derivative -(Omega2^2 + Omega3^2) is not
        ("gamma1 - 1", "0 0 2 1 0 0", "refuted"),
        ("gamma1 - 1", "2 0 0 1 0 0", "refuted"),
    ],
)
def test_the_square_of_what_does_not_stay_0_is_no_invariant_relation(value, state, verdict):
    assert audited(integral(value, FREE, states=[state], kind="relation")).verdict == verdict


@pytest.mark.parametrize("spin", ["1", "-1"])
def test_what_is_not_0_is_not_positive_for_that(spin: str) -> None:
    """Ω3 of a symmetric top stays what it is: not 0, of either sign."""
    value = "gamma3*(sqrt(Omega3^2) - Omega3)/Omega3"
    assert audited(integral(value, top("2 2 5", "0 0 1"), states=[f"1 0 {spin} 3/5 0 4/5"])).verdict != "holds"


def test_a_state_off_its_condition_by_1e_200_refutes_nothing():
    off, on = "1e-200 1 2 1 0 0", "0 0 2 1 0 0"
    assert audited(integral("Omega3", FREE, ["Omega1", "Omega2"], [on, off])).verdict == "holds"
    report = audited(integral("Omega3", FREE, ["Omega1", "Omega2"], [off]))
    assert report.verdict == "undecided"
    assert "1e-200, Omega1 is not 0" in open_conditions(report)


def test_a_parameter_off_a_relation_by_1e_400_is_refused():
    with pytest.raises(InputError, match="violates the relation"):
        audited(upright("1 + t*(a - 1)", relations=["a - 1"], parameters={"a": "1." + "0" * 399 + "1"}))


def test_a_witness_lies_in_the_domain():
    with pytest.raises(InputError, match="outside t>0"):
        audited(upright("1", domain="t>0", times=["0"]))
    report = audited(upright("sqrt(t)", domain="t>0"))
    assert report.verdict == "refuted"
    assert all(float(eval(row.witness["t"])) > 0 for row in report.rows if row.witness)


@pytest.mark.parametrize(
    ("factor", "power"),
    [("exp(-10^6)", -434295), ("exp(-10^12)", -434294481904), ("exp(10^9)", 434294481), ("exp(-exp(20))", -210704569)],
)
def test_a_witness_of_any_size_refutes(factor: str, power: int) -> None:
    report = audited(upright(f"t*{factor}"))
    assert report.verdict == "refuted"
    witness = next(row for row in report.rows if (row.equation, row.component) == ("1.1", 3)).witness
    # I3/2 or so times the factor: log10 e^(10^6) = 434294.48, and so on
    assert abs(int(witness["value"].partition("e")[2]) - power) <= 1
    assert int(witness["radius"].partition("e")[2]) < power - 15


@pytest.mark.parametrize(
    ("assume", "verdict"), [([], "refuted"), (["A >= B"], "refuted"), (["A >= B", "A <= B"], "holds")]
)
def test_what_is_true_at_the_samples_alone_is_refuted_near_them(assume, verdict):
    samples = {"A": ["2", "3"], "B": ["2", "3"]}
    report = audited(integral("Omega3", top("A B 1", "0 0 1"), assume=assume, parameters=samples))
    assert report.verdict == verdict
    for witness in (row.witness["parameters"] for row in report.rows if row.witness):
        assert Fraction(witness["A"]) > Fraction(witness["B"])


def test_the_witness_of_an_integral_has_no_time_and_its_text_no_equations_of_motion() -> None:
    right, wrong = (audited(integral(value, top("2 2 5", "0 0 1"))) for value in ("Omega3", "Omega1"))
    text = shown(audit_text(right))
    assert "first integral" in text
    assert "proven to be constant along the motions of: heavy_top" in text
    assert "equations of motion" not in text
    assert "t" not in wrong.to_json()["equations"][0]["witness"]


def test_of_a_quaternion_that_jumps_omega_gamma_and_the_attitude_are_continuous() -> None:
    quaternion = [f"{part}(t/2)*(t/sqrt(t^2))" if part else "0" for part in ("cos", "", "", "sin")]
    report = audited(upright("1") | {"motion": {"omega": ["0", "0", "1"], "quaternion": quaternion}})
    assert report.verdict == "holds"
    reasons = {c.reason for row in report.rows for c in row.conditions if c.text == "sqrt(t^2) ≠ 0"}
    assert reasons == {"removable: Omega and gamma are continuous across it"}


def test_conditions_stand_in_the_text_and_in_the_json() -> None:
    report = audited(upright("sqrt(t^2)/t"))
    assert report.exit_code == 3
    assert "not discharged: t ≠ 0" in shown(audit_text(report))
    equations = report.to_json()["equations"]
    assert all(row["holds"] is None for row in equations)
    assert {"text": "t ≠ 0", "discharged": False, "reason": "not shown"} in equations[0]["conditions"]


def loose(value: str = "Omega3*sqrt(a^3)", **parts) -> Table:
    parameters = {"a": ["2", "3"], "c": ["1", "2"]}
    return integral(value, top("2 2 1", "0 0 c"), **({"parameters": parameters} | parts))


@pytest.mark.slow
def test_an_undecided_claim_says_which_assumption_would_decide_it_and_that_one_does(unhurried) -> None:
    report = audited(loose())
    assert report.verdict == "undecided"
    assert dict(report.deciding)["a > 0"] == "holds"
    assert report.to_json()["would_decide"] == dict(report.deciding)
    for bound, verdict in report.deciding:
        assert audited(loose(assume=[bound])).verdict == verdict
    broken = audited(loose(parameters={"a": ["-2", "3"], "c": ["1", "2"]}))
    assert "a > 0" not in dict(broken.deciding)  # a sample breaks it


def test_formulas_are_printed_as_files_have_them() -> None:
    report = audited(loose("sqrt(a^3)*Omega1^2"))
    said = [row.residual for row in report.rows] + [c.text for row in report.rows for c in row.conditions]
    assert any("^" in text for text in said)
    assert not any("**" in text for text in said)


@pytest.fixture
def unhurried(monkeypatch):
    """As many seconds for assumptions that would decide as a busy machine takes."""
    monkeypatch.setattr("heavytop.features.claims.audit.user_claims._SEARCH", 600.0)


def _verdict(value: str, assume: list[str], inertia: str = "2 2 1", centre: str = "0 0 1", **parts):
    """That a formula is constant; or, of the time, that it is the spin of an upright top: what would decide it too."""
    parts = {"parameters": {"g": ["1", "2"], "h": ["4", "-3"]}, "assume": assume} | parts
    of = top(inertia, centre)
    report = audited(
        integral(value, of, **parts) if "Omega" in value or "gamma" in value else upright(value, of, **parts)
    )
    return report.verdict, dict(report.deciding)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "missing"),
    [
        ("Omega3*g/g", "g != 0"),
        ("Omega3*(g*Omega1)/(g*Omega1)", "g != 0"),
        ("Omega3/(g*Omega3)", "g != 0"),
        ("Omega3*(g - h)*gamma1/((g - h)*gamma1)", "g - h != 0"),
        ("Omega3 + 0*log(g^2)", "g^2 > 0"),
        ("Omega3*sin(g*Omega1)/sin(g*Omega1)", "g > 0"),
        ("Omega3*(g*Omega1 + h)/(g*Omega1 + h)", "g > 0"),
        ("Omega3*(g*Omega1 + gamma1^2 + gamma2^2 + gamma3^2 - 1)/(g*Omega1)", "g != 0"),
        ("1 + 0/(g*Omega3)", "g != 0"),
        ("g*t/(g*t)", "g != 0"),
        ("sin(g*t)/sin(g*t)", "g > 0"),
        ("(g*t + h)/(g*t + h)", "g > 0"),
    ],
)
@pytest.mark.usefixtures("unhurried")
def test_a_divisor_that_is_0_all_over_for_some_parameters_is_not_removable(value: str, missing: str) -> None:
    verdict, deciding = _verdict(value, [])
    assert verdict == "undecided"
    assert deciding[missing] == "holds"
    assert _verdict(value, [missing])[0] == "holds"
    if missing == "g > 0":
        assert _verdict(value, ["g != 0"])[0] == "holds"


@pytest.mark.parametrize(
    "value",
    ["Omega3*(2*Omega1 + g)/(2*Omega1 + g)", "Omega3*(g*Omega1 + gamma1^2)/(g*Omega1 + gamma1^2)", "(t + g)/(t + g)"],
)
def test_a_divisor_that_no_parameters_make_0_all_over_is_removable(value: str) -> None:
    assert _verdict(value, [])[0] == "holds"


@pytest.mark.slow
@pytest.mark.parametrize("domain", ["all", "t<=0", "t>0"])
def test_a_zero_of_a_divisor_is_removable_on_each_half_of_the_time(domain: str) -> None:
    for assume, verdict in ((["g != 0"], "holds"), ([], "undecided")):
        assert _verdict("sin(-g*t)/sin(-g*t)", assume, domain=domain)[0] == verdict


def test_messages_write_formulas_as_files_do() -> None:
    for assumed, relations in ((["g^2 > sqrt(g^2)^3"], []), ([], ["g^2 - 3"])):
        with pytest.raises(InputError, match=r"violates the (assumption|relation) g\^2 ") as error:
            _verdict("Omega1", assumed, relations=relations, parameters={"g": ["1"]})
        assert "**" not in str(error.value)
        assert "Abs" not in str(error.value)
    text = written("Abs(Omega1) - a*Abs(c + Abs(b*(d)))**2")
    assert text == "sqrt(Omega1^2) - a*sqrt((c + sqrt((b*(d))^2))^2)^2"


@pytest.mark.usefixtures("unhurried")
def test_what_is_assumed_to_be_unequal_is_of_no_sign() -> None:
    value = "Omega1*(sqrt(g^2) - g)"
    assert _verdict(value, ["g != 0"], parameters={"g": ["1", "2"]}) == ("refuted", {"g > 0": "holds"})
    for text in ("g != 1", "g != g", "2 != 2"):
        with pytest.raises(InputError, match=f"violates the assumption {text}"):
            _verdict(value, [text], parameters={"g": ["1"]})
    for text in ("g !=", "!= 0", "g != 0 != 1", "g ! 0", "g != 0 > 1"):
        with pytest.raises(InputError):
            _verdict(value, [text])


@pytest.mark.slow
def test_components_of_gamma_lie_between_minus_1_and_1() -> None:
    for value, verdict in (("sin(asin(gamma1)) - gamma1", "holds"), ("sin(asin(2*gamma1)) - 2*gamma1", "undecided")):
        assert _verdict(value, [])[0] == verdict
    for value in ("asin(sin(Omega1)) - Omega1", "sqrt(Omega3^2) - Omega3 + 0*Omega1"):
        assert _verdict(value, [], "2 3 4", "1 1 1")[0] == "refuted"
    # true at small angles alone, and of a product whose second factor does not stay 0
    assert _verdict("asin(2*gamma1*sqrt(1 - gamma1^2)) - 2*asin(gamma1)", [])[0] == "refuted"
    assert _verdict("Omega3*gamma1", [], kind="relation")[0] == "refuted"


@pytest.mark.parametrize("value", ["sqrt(Omega3 - 5)", "log(Omega3)", "asin(Omega3)", "log(Omega3)/Omega3"])
def test_a_sign_that_a_motion_keeps_is_not_said_to_be_that_of_the_whole_domain(value: str) -> None:
    report = audited(integral(value, top("2 2 1", "0 0 1")))
    assert report.verdict == "holds"
    of_state = [c for row in report.rows for c in row.conditions if c.text.startswith(("Omega3", "-1"))]
    assert {c.reason for c in of_state} == {KEPT}
