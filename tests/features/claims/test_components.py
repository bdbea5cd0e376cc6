"""One component of a motion as a function of time, its reduced equation, and angles by their rates."""

from typing import Any

import pytest

from heavytop.errors import InputError
from heavytop.features.claims.audit.judge import Audit
from support.claim_tables import audited, open_conditions, top

# Lagrange's top between the heights u1 and u2, from rest at u1, with numbers
LAGRANGE: dict[str, Any] = {
    "kind": "component",
    "parameters": {"C": ["1", "2"]},
    "assume": ["C > 0"],
    "definitions": {
        "u1": "3/5",
        "u2": "4/5",
        "u3": "13/5",
        "m": "(u2 - u1)/(u3 - u1)",
        "p": "sqrt((u3 - u1)*5/16)",
        "L": "2",
        "g2": "4*(u1^2 + u2^2 + u3^2 - u1*u2 - u1*u3 - u2*u3)/3*(5/16)^2",
        "g3": "4*((2*u1 - u2 - u3)*(2*u2 - u1 - u3)*(2*u3 - u1 - u2))/27*(5/16)^3",
    },
    "top": top("1 1 C", "0 0 5/8"),
    "start": {"omega": ["0", "L*(u2 - u1)/(4/5)", "L/C"], "gamma": ["0", "4/5", "u1"]},
    "component": {
        "quantity": "gamma3",
        "reduced": "5/4*(u - u1)*(u - u2)*(u - u3)",
        "value": "u1 + (u2 - u1)*sn(p*t, m)^2",
        "psi": "L/(2*p)*((1 + u2)/(1 + u1)*ellipticPi(-(u2 - u1)/(1 + u1), am(p*t, m), m)"
        " - (1 - u2)/(1 - u1)*ellipticPi((u2 - u1)/(1 - u1), am(p*t, m), m))",
    },
    "quadrature": {"variable": "u", "psi": "L*(u2 - u)/(1 - u^2)"},
}


def audit(**parts: Any) -> Audit:
    """The audit of :data:`LAGRANGE` with other entries in its tables; a table or an entry that is None is left out."""
    changed = {key: value and {k: v for k, v in (LAGRANGE[key] | value).items() if v} for key, value in parts.items()}
    return audited(LAGRANGE | changed)


def rows(report: Audit) -> dict[tuple[str, int], bool | None]:
    return {(row.equation, row.component): row.holds for row in report.rows}


@pytest.mark.slow
def test_an_angle_without_a_rate_of_its_own_is_judged_by_the_true_one() -> None:
    """Every divisor of the true rate is a condition: here 1 − u² and the moments."""
    assert audit(quadrature={"psi": None}).verdict == "holds"
    assert audit(quadrature={"psi": None}, component={"psi": "t"}).verdict == "refuted"


@pytest.mark.slow
@pytest.mark.parametrize(
    "value",
    [
        "u1 + (u2 - u1)*sn(p*t, m)^2",
        "u2 - (u2 - u1)*cn(p*t, m)^2",
        "u1 + (u2 - u1)*(1 - cn(2*p*t, m))/(1 + dn(2*p*t, m))",
        "(u1+u2+u3)/3 + 16/5*wp3(t, g2, g3)",
    ],
)
def test_lagranges_solution_holds_in_each_of_its_forms(value: str) -> None:
    # psi is written in sn(p t)
    parts = {"value": value} | ({"psi": None} if "wp3" in value or "2*p" in value else {})
    assert audit(component=parts).verdict == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "first"),
    [
        ({"reduced": "5/4*(u - u1)*(u - u2)*(u3 - u)"}, ("reduced", 1)),
        ({"value": "u1 + (u2 - u1)*sn(p*t, m^2)^2"}, ("component", 1)),
        ({"value": "u1 + (u2 - u1)*sn(p*(t + 1), m)^2"}, ("start", 1)),
        ({"value": "u1"}, ("component", 2)),
        ({"psi": "L*t"}, ("angle", 3)),
    ],
)
def test_what_is_wrong_is_refuted_where_it_is_wrong(part: dict[str, str], first: tuple[str, int]) -> None:
    report = audit(component=part)
    assert report.verdict == "refuted"
    assert next(key for key, holds in rows(report).items() if holds is False) == first


@pytest.mark.parametrize(
    ("psi", "verdict"),
    [
        ("L*(u2 - u)/(1 - u^2)", "holds"),
        ("L*(u2 + u)/(1 - u^2)", "refuted"),
        ("u", "refuted"),
        ("L*(u2 - sqrt(u^2))/(1 - u^2)", "undecided"),  # true: u > 0 where it moves
    ],
)
def test_rates_of_angles_are_claims_by_themselves(psi: str, verdict: str) -> None:
    bare = dict.fromkeys(("reduced", "value", "psi"))
    assert audit(component=bare, quadrature={"psi": psi}).verdict == verdict


@pytest.mark.parametrize(
    ("p", "value", "verdict"),
    [
        ("1", "sn(t, 1/3)", "holds"),
        ("1", "-sn(t, 1/3)", "refuted"),
        ("1", "sn(t, 1/9)", "refuted"),
        ("sqrt(3)", "sqrt(3)*tanh(t)", "holds"),
    ],
)
def test_eulers_component_obeys_its_quartic(p: str, value: str, verdict: str) -> None:
    """Ω2 of I = (1, 2, 3) from Ω = (p, 0, 1): Ω1² = p² − u², Ω3² = 1 − u²/3, u' = Ω1 Ω3."""
    table = {
        "kind": "component",
        "top": top("1 2 3", "0 0 0", "0"),
        "start": {"omega": [p, "0", "1"], "gamma": ["0", "0", "1"]},
        "component": {
            "quantity": "Omega2",
            "reduced": f"({p}^2 - u^2)*(1 - u^2/3)",
            "value": value,
        },
    }
    assert audited(table).verdict == verdict


# the first component of a free symmetric body: Ω1 = cos t, and f = 1 − u²
CIRCLE: dict[str, Any] = {
    "kind": "component",
    "top": top("2 2 1", "0 0 0", "0"),
    "start": {"omega": ["1", "0", "2"], "gamma": ["0", "0", "1"]},
    "component": {"quantity": "Omega1", "reduced": "1 - u^2"},
}


@pytest.mark.parametrize(
    ("value", "domain", "verdict"),
    [
        ("cos(t)", "all", "holds"),
        ("sin(2*t)/(2*sin(t))", "all", "holds"),  # 0/0 at the start
        ("sin(t)/tan(t)", "t>0", "holds"),
        ("cos(asin(sin(t)))", "all", "undecided"),  # |cos t|: its rate jumps
        ("sqrt(cos(t)^2)", "all", "undecided"),
        ("cos(t + (atan2(-t, -1) - atan(t) - pi)/4)", "t>0", "undecided"),  # cos t at t = 0, then sin t
        ("cos(t + sqrt(t^2)/t - 1)", "t<=0", "undecided"),  # not defined at the start
    ],
)
def test_a_function_of_time_is_smooth_and_defined_from_its_start(value: str, domain: str, verdict: str) -> None:
    assert audited(CIRCLE | {"domain": domain, "component": CIRCLE["component"] | {"value": value}}).verdict == verdict


# u² + 2, which is no rational function as written
_HIDDEN = "(sqrt((u^2 + 2)*(u^2 + 3))*sqrt(u^2 + 2)/sqrt(u^2 + 3))"


@pytest.mark.parametrize(
    ("quantity", "integrand", "verdict"),
    [
        ("Omega1", "1/sqrt(1 - u^2)", "holds"),
        ("Omega1", "1/(sqrt(1 - u)*sqrt(1 + u))", "holds"),
        ("Omega1", "sqrt(1/(1 - u))*sqrt(1/(1 + u))", "holds"),
        ("Omega1", "sqrt(1/(u - 1))*sqrt(1/(-1 - u))", "undecided"),
        ("Omega1", "sqrt(u^2)/(u*sqrt(1 - u^2))", "undecided"),  # changes its sign at u = 0
        ("Omega1", "sqrt(4*u^2 - 4*u + 1)/((2*u - 1)*sqrt(1 - u^2))", "undecided"),  # at u = 1/2
        ("Omega1", f"sqrt({_HIDDEN}^2 - 9/2*{_HIDDEN} + 81/16)/((u^2 - 1/4)*sqrt(1 - u^2))", "undecided"),
        ("Omega1", "sqrt(4*u^2 - 4*u + 1)/((2*u - 1 - 2*a)*sqrt(1 - u^2))", "undecided"),  # a is 0
        ("Omega1", "sqrt(-1 - u^2)/(sqrt(1 + u^2)*sqrt(u^2 - 1))", "undecided"),
        ("Omega1", "1/sqrt(1 - u^2) + 0*log(g^2*(1 - u))", "undecided"),  # not defined where g = 0
        ("Omega1", "sqrt(u + 2)/(sqrt(u + 2)*sqrt(1 - u^2))", "holds"),
        ("Omega1", "sqrt(u + 1/2)/(sqrt(u + 1/2)*sqrt(1 - u^2))", "undecided"),
        ("Omega1", "1/sqrt(1 - u^2) + 0*log(u - 5)", "undecided"),
        ("exp(Omega1)", "1/(u*sqrt(1 - log(u)^2))", "holds"),
        ("exp(Omega1)", "1/(u*sqrt(1 - log(u)^2)) + 0*log(u - 5)", "undecided"),
    ],
)
def test_an_integrand_is_real_where_the_component_moves(quantity: str, integrand: str, verdict: str) -> None:
    component = {"quantity": quantity}
    table = CIRCLE | {"component": component, "quadrature": {"variable": "u", "integrand": integrand}}
    parameters = {"parameters": {"g": "1"}, "definitions": {"a": "sqrt(3 + 2*sqrt(2)) - 1 - sqrt(2)"}}
    assert audited(table | parameters).verdict == verdict


@pytest.mark.parametrize(
    ("time", "verdict"),
    [
        ("asin(u)", "holds"),
        ("atan(u/sqrt(1 - u^2))", "holds"),
        ("-atan(sqrt(1 - u^2)/u)", "undecided"),  # jumps at u = 0
        ("asin(2*u*sqrt(1 - u^2))/2", "undecided"),  # decreases beyond u = 1/√2
        ("asin(2*u^2 - 1)/2", "undecided"),  # decreases before u = 0
    ],
)
def test_the_clock_of_a_component_neither_jumps_nor_turns(time: str, verdict: str) -> None:
    component = {"quantity": "Omega1"}
    table = CIRCLE | {"component": component, "quadrature": {"variable": "u", "time": time}}
    assert audited(table).verdict == verdict


@pytest.mark.parametrize(
    ("quantity", "value"), [("asin(Omega1)", "pi/2 - t"), ("acos(Omega1)", "t"), ("atan2(-Omega2, Omega1)", "t")]
)
def test_a_component_with_kinks_or_jumps_is_no_smooth_function_of_time(quantity: str, value: str) -> None:
    """Each of them is true until Ω1 = cos t turns, or the angle is π."""
    start = {"omega": ["3/5", "-4/5", "2"], "gamma": ["0", "0", "1"]}
    begin = {"pi/2 - t": "asin(3/5) - t", "t": "t + acos(3/5)"}[value]
    component = {"quantity": quantity, "reduced": "1", "value": begin}
    assert audited(CIRCLE | {"start": start, "component": component}).verdict == "undecided"


def test_a_reduced_equation_is_not_refuted_beyond_the_way_of_its_component() -> None:
    """|1 − u²| is 1 − u² where u moves."""
    component = CIRCLE["component"] | {"reduced": "sqrt((1 - u^2)^2)"}
    assert audited(CIRCLE | {"component": component}).verdict == "undecided"


PENDULUM: dict[str, Any] = {
    "kind": "component",
    "assume": ["I > 0", "P > 0", "w > 0"],
    "parameters": {"I": ["2", "1"], "P": ["1", "3/4"], "w": ["3", "4"]},
    "top": top("I 2 3", "0 0 1", "P"),
    "start": {"omega": ["w", "0", "0"], "gamma": ["0", "0", "-1"]},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("quantity", "integrand", "verdict"),
    [
        ("gamma3", "1/sqrt((1 - u^2)*(w^2 - 2*P/I*(1 + u)))", "holds"),
        ("gamma3", "1/sqrt((1 - u^2)*(w^2 + 2*P/I*(1 + u)))", "refuted"),  # by a derivative of order 4
        ("gamma3", "1/sqrt((1 - u^2)*(w^2 - 2*P/I*(1 - u)))", "refuted"),
        ("Omega1", "I/(P*sqrt(1 - (I/(2*P)*(w^2 - u^2) - 1)^2))", "holds"),
        ("Omega1", "2/(sqrt(w - u)*sqrt(w + u)*sqrt(u - sqrt(w^2 - 4*P/I))*sqrt(u + sqrt(w^2 - 4*P/I)))", "holds"),
    ],
)
def test_a_pendulum_starts_at_a_zero_of_its_reduced_equation(quantity: str, integrand: str, verdict: str) -> None:
    table = PENDULUM | {"component": {"quantity": quantity}, "quadrature": {"variable": "u", "integrand": integrand}}
    assume = [*PENDULUM["assume"], "I*w^2 > 4*P"]
    assert audited(table | {"assume": assume}).verdict == verdict
    if verdict == "holds" and quantity == "gamma3":  # at rest t is no function of it
        assert open_conditions(audited(table | {"assume": assume[:2]})) == "u is not constant w != 0 is not assumed"


@pytest.mark.slow
@pytest.mark.parametrize(("quantity", "centre"), [("gamma3", "1 0 0"), ("Omega3", "1 0 0"), ("Omega1^8", "0 0 1")])
def test_an_equation_is_refuted_without_an_elimination_that_takes_minutes(quantity: str, centre: str) -> None:
    """Nothing is a function of one component of Kovalevskaya's top, nor polynomial in a high power."""
    table = {
        "kind": "component",
        "parameters": {"n": ["1", "3/2"], "w": ["1", "1/2"]},
        "top": top("2 2 1", centre, "n"),
        "start": {"omega": ["1", "w", "2"], "gamma": ["0", "3/5", "4/5"]},
    }
    constant = "(Omega1^2 - Omega2^2 - n*gamma1)^2 + (2*Omega1*Omega2 - n*gamma2)^2"
    constants = [constant] if centre == "1 0 0" else []
    component = {"quantity": quantity, "constants": constants, "reduced": "1 - u^2"}
    assert audited(table | {"component": component}).verdict == "refuted"


@pytest.mark.slow
def test_the_rate_of_theta_may_be_by_the_root_of_gamma3() -> None:
    for rate, verdict in (("(gamma2*Omega1 - gamma1*Omega2)/sqrt(1 - u^2)", "holds"), ("Omega1", "refuted")):
        quadrature = {"variable": "u", "theta": rate}
        component = {"quantity": "gamma3"}
        assert audited(LAGRANGE | {"component": component, "quadrature": quadrature}).verdict == verdict


@pytest.mark.slow
def test_an_elimination_names_the_factor_that_must_not_be_0() -> None:
    """Euler's second component from a state on no axis: the elimination divides by powers of I1 and of I1 - I3."""
    twice, square = "(I1*p^2 + I2*q^2 + I3*r^2)", "(I1^2*p^2 + I2^2*q^2 + I3^2*r^2)"
    first, third = f"({square} - I3*{twice} - I2*(I2 - I3)*u^2)", f"(I1*{twice} - {square} - I2*(I1 - I2)*u^2)"
    table = {
        "kind": "component",
        "parameters": {"I1": "3", "I2": "2", "I3": "3/2", "p": "1", "q": "1/3", "r": "2"},
        "top": top("I1 I2 I3", "0 0 0", "0"),
        "start": {"omega": ["p", "q", "r"], "gamma": ["0", "0", "1"]},
        "component": {
            "quantity": "Omega2",
            "reduced": f"{first}*{third}/(I1*I3*I2^2)",
        },
    }
    assert set(open_conditions(audited(table)).split("; ")) == {"I1 - I3 ≠ 0 I1 - I3 != 0 is not assumed"}
    assert audited(table | {"assume": ["I1 != I3"]}).verdict == "holds"


EULER_FROM_TWO_AXES = {
    "name": "euler",
    "kind": "component",
    "parameters": {"I1": "3", "I2": "2", "I3": "1", "w1": "1", "w3": "2", "g": "1"},
    "top": {"inertia": ["I1", "I2", "I3"], "weight": "0", "centre": ["0", "0", "0"]},
    "start": {"omega": ["w1", "0", "w3"], "gamma": ["0", "0", "1"]},
}
FACTORED = {
    "Omega1": "I1*sqrt(I2*I3)/(sqrt(I1*(I1-I3))*sqrt(w1^2 - u^2)*sqrt(I3*(I2-I3)*w3^2 - I1*(I1-I2)*(w1^2 - u^2)))",
    "Omega2": "I2*sqrt(I1*I3)/(sqrt(I3*(I1-I3)*w3^2 - I2*(I1-I2)*u^2)*sqrt(I1*(I1-I3)*w1^2 - I2*(I2-I3)*u^2))",
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("quantity", "factor", "assume", "verdict"),
    [
        ("Omega2", "", ["I1 > I3"], "holds"),
        ("Omega2", "", ["I1 != I3"], "undecided"),  # both radicands are negative for I1 < I3
        ("Omega1", "", ["I1 > I3", "I2 > I3"], "holds"),  # Omega1 turns at the start
        ("Omega1", "", ["I1 > I3", "I2 != I3"], "undecided"),
        ("Omega2", "g*u/(g*u)*", ["I1 > I3", "g != 0"], "holds"),
        ("Omega2", "g*u/(g*u)*", ["I1 > I3"], "undecided"),  # 0/0 for all u where g = 0
    ],
)
def test_an_integrand_is_real_and_defined_for_all_parameters(
    quantity: str, factor: str, assume: list[str], verdict: str
) -> None:
    table = EULER_FROM_TWO_AXES | {
        "assume": ["w1 > 0", "w3 > 0", *assume],
        "component": {"quantity": quantity},
        "quadrature": {"variable": "u", "integrand": factor + FACTORED[quantity]},
    }
    assert audited(table).verdict == verdict


@pytest.mark.parametrize(
    ("square", "verdict"), [("1 - u^2", "holds"), ("1 - 2*u^2", "refuted"), ("1 - u^2/Omega1^2", "refuted")]
)
def test_definitions_too_large_to_substitute_are_of_the_component(square: str, verdict: str) -> None:
    """As symbols they would hide u and the state."""
    growing = {f"f{i + 1}": f"f{i} + f{i} - f{i}" for i in range(7)}
    table = CIRCLE | {"definitions": {"f0": square} | growing}
    assert audited(table | {"component": CIRCLE["component"] | {"reduced": "f7"}}).verdict == verdict


def test_a_component_that_does_not_move_has_no_equation_of_the_second_order() -> None:
    """√Ω3 is 1: u'² = 1 − u² holds of it, and cos t is not it."""
    for value in ("cos(t)", "1"):
        component = {"quantity": "sqrt(Omega3)", "reduced": "1 - u^2", "value": value}
        start = {"omega": ["1", "0", "1"], "gamma": ["0", "0", "1"]}
        assert audited(CIRCLE | {"start": start, "component": component}).verdict == "undecided"


@pytest.mark.slow
def test_the_start_gives_the_gyrostats_energy_to_a_gyrostat() -> None:
    """A sphere with a rotor about axis 2, for which the energy of a heavy top is not constant."""
    table = CIRCLE | {
        "top": top("1 1 1", "1/2 0 1") | {"rotor": "1"},
        "start": {"omega": ["1", "1", "0"], "gamma": ["3/5", "0", "4/5"]},
        "component": {
            "quantity": "Omega1",
            "constants": ["Omega2", "Omega1^2 + Omega3^2"],
            "reduced": "1 - u^2",
            "value": "cos(t)",
        },
    }
    assert audited(table | {"system": "gyrostat"}).verdict == "holds"
    assert audited(table, "gyrostat").verdict == "holds"
    assert audited(table).verdict == "refuted"


@pytest.mark.parametrize(
    ("where", "start", "reduced", "value", "verdict"),
    [
        (["Omega3 - 2"], "2", "1 - u^2", "cos(t)", "holds"),
        (["Omega3 - 2"], "n", "1 - u^2", None, "refuted"),  # on it for n = 2 alone
        (["Omega3 - 10"], "2", "25*(1 - u^2)", "cos(5*t)", "refuted"),  # not where it starts
        (["Omega3 - 2", "Omega1^2 + Omega2^2 - 1"], "", "1 - u^2", None, "holds"),
        (["Omega3 - 2", "Omega3 - 10"], "", "25*(1 - u^2)", None, "undecided"),
        (["Omega3 - 2", "Omega1^2 + Omega2^2 + 1"], "", "-1 - u^2", None, "undecided"),
        (["Omega1", "Omega2"], "", "u^2", None, "undecided"),  # true of u = 0
    ],
)
def test_there_is_a_state_on_the_conditions(
    where: list[str], start: str, reduced: str, value: str | None, verdict: str
) -> None:
    """Anything follows from conditions that exclude each other, and falsehoods from one that the start is not on."""
    component = {"quantity": "Omega1", "where": where, "reduced": reduced, "value": value}
    begin = {"omega": ["1", "0", start], "gamma": ["0", "0", "1"]} if start else None
    table = {"start": begin, "component": {k: v for k, v in component.items() if v}, "parameters": {"n": "2"}}
    assert audited(CIRCLE | table).verdict == verdict


def test_a_start_is_refuted_at_the_time_0() -> None:
    report = audited(CIRCLE | {"component": CIRCLE["component"] | {"value": "cos(t + 1)"}})
    witnesses = [row.witness["t"] for row in report.rows if row.equation == "start" and row.witness]
    assert witnesses == ["0", "0"]


SEED: dict[str, Any] = {
    "kind": "component",
    "parameters": {"C1": "1/6"},  # with Ω = (1/3, 0, 0) on both conditions
    "definitions": {"f1": "(6*C1 - 1)/2 - 6*u - u^2", "f2": "(1 - 2*C1)/6 + 2/3*u - u^2/3"},
    "top": top(),
    "component": {
        "quantity": "Omega2",
        "where": [
            "9*Omega1^2 + 4*Omega2^2 + Omega3^2 - 1",
            "(3*Omega1^2 + 2*Omega2^2 + Omega3^2)/2 + 2*Omega2 - C1",
        ],
    },
    "quadrature": {"variable": "u", "integrand": "1/sqrt(f1*f2)"},
}


def test_the_papers_quadrature_is_that_of_the_gyrostat_and_not_of_the_top() -> None:
    for integrand, verdict in (("1/sqrt(f1*f2)", "holds"), ("1/sqrt(2*f1*f2)", "refuted")):
        quadrature = {"variable": "u", "integrand": integrand}
        gyrostat = SEED | {"system": "gyrostat", "top": top(rotor="1"), "quadrature": quadrature}
        assert audited(gyrostat).verdict == verdict


@pytest.mark.slow
def test_the_papers_rate_of_psi_is_refuted_for_the_top_by_conditions_that_do_not_last() -> None:
    table = SEED | {
        "definitions": {"rest": "gamma3*(Omega1*gamma1 + Omega2*gamma2)/(gamma1^2 + gamma2^2)"},
        "component": {"quantity": "Omega2", "where": ["3*Omega1 - gamma1", "2*Omega2 - gamma2", "Omega3 - gamma3"]},
        "quadrature": {"variable": "u", "psi": "1 - (Omega3 - rest)/Omega3"},
    }
    assert audited(table).verdict == "refuted"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": None}, "start"),
        ({"component": {"reduced": None}}, "reduced"),
        ({"component": {"quantity": "C"}}, "constant"),
        ({"quadrature": {"integrand": "u"}}, "gives reduced and integrand"),
        ({"component": {"reduced": None}, "quadrature": {"time": "u", "integrand": "1"}}, "gives time and integrand"),
        ({"component": {"value": None}}, "does not use psi of .component. without value"),
        ({"quadrature": {"where": ["u > 5"]}}, "does not use where"),
        ({"start": {"angles": ["0", "0", "1"]}}, "does not use angles of .start"),
    ],
)
def test_a_component_whose_parts_lack_or_contradict_others_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        audit(**change)


@pytest.mark.slow
def test_the_integrand_of_a_component_that_starts_at_an_irrational_rate_has_no_sample() -> None:
    table = {
        "kind": "component",
        "top": top("2 2 1", "0 0 1"),
        "start": {"omega": ["1", "sqrt(2)", "1"], "gamma": ["0", "4/5", "3/5"]},
        "component": {"quantity": "gamma3"},
        "quadrature": {"variable": "u", "integrand": "1/sqrt(2 - u^2)"},
    }
    assert "give a start that is rational" in open_conditions(audited(table))


def test_a_start_that_is_rational_at_no_sample_is_named() -> None:
    report = audit(
        parameters={"C": ["2", "3"]},
        definitions={"c": "sqrt(C)"},
        top={"inertia": ["1", "1", "c"]},
        start={"omega": ["0", "L*(u2 - u1)/(4/5)", "L/c"]},
        component={"value": None, "psi": None},
        quadrature={"psi": "(Omega1*gamma1 + Omega2*gamma2)/(gamma1^2 + gamma2^2)"},
    )
    assert "rational" in open_conditions(report)
