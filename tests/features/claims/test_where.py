"""Claims on conditions: states found without help, conditions in other words, and their false neighbours."""

from fractions import Fraction

import pytest
import sympy

from heavytop.features.claims.algebra.conditions import conditions_for_zero, is_exactly_zero
from heavytop.features.claims.audit.context import STATE
from heavytop.features.claims.audit.user_claims import states_on
from support.claim_tables import audited, integral, top

AREA = "(4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3)"
CHAPLYGIN = "Omega3*(Omega1^2 + Omega2^2) - Omega1*gamma3"
HESS = "(36*Omega1 + 12*Omega3)"
K1, K2 = "(Omega1^2 - Omega2^2 - gamma1)", "(2*Omega1*Omega2 - gamma2)"
FREE_AREA = "(2*Omega1*gamma1 + 3*Omega2*gamma2 + 5*Omega3*gamma3)"
TOPS = {
    "chaplygin": top("4 4 1", "1 0 0"),
    "hess": top("9 5 4", "4 0 3"),
    "kovalevskaya": top("2 2 1", "1 0 0"),
    "lagrange": top("2 2 1", "0 0 1"),
    "free": top("2 3 5", "0 0 0"),
}


def verdict(of: str, value: str, where: tuple[str, ...] = (), kind: str = "integral", **parts) -> str:
    return audited(integral(value, TOPS[of], where, kind=kind, **parts)).verdict


TRUE = [
    ("chaplygin", CHAPLYGIN, (AREA,), "integral"),
    ("chaplygin", f"exp({CHAPLYGIN})", (f"-3*{AREA}",), "integral"),
    ("chaplygin", CHAPLYGIN, (f"exp({AREA}) - 1",), "integral"),
    ("chaplygin", CHAPLYGIN, (f"{AREA}^2",), "integral"),
    ("hess", HESS, (), "relation"),
    ("hess", f"exp({HESS}) - 1", (), "relation"),
    ("hess", f"sqrt({HESS}^2)", (), "relation"),
    ("hess", f"sin({HESS})*Omega1", (HESS,), "integral"),
    ("kovalevskaya", f"{K1}^2 + {K2}^2", (), "relation"),
    ("kovalevskaya", K1, (f"{K1}^2 + {K2}^2",), "integral"),
    ("kovalevskaya", f"exp({K2})*2", (K1, K2), "integral"),
    ("lagrange", "Omega3", (AREA.replace("4", "2"),), "integral"),
    ("lagrange", "log(-Omega3 - 8)", (), "integral"),
    ("lagrange", "1/Omega3", ("Omega1", "Omega2", "gamma1", "gamma2"), "integral"),
    ("lagrange", "gamma1^2/sqrt(1 + gamma1^2 + gamma2^2)^2 + (1 + gamma2^2)/(2 - gamma3^2)", (), "integral"),
    ("free", "Omega3", ("Omega1^2 + Omega2^2",), "integral"),
    ("free", "sqrt(4*Omega1^2 + 9*Omega2^2 + 25*Omega3^2) - 2", (), "relation"),
    ("free", "Omega1 - sqrt(5)*Omega3", (), "relation"),
    ("free", f"cos({FREE_AREA})*(4*Omega1^2 + 9*Omega2^2 + 25*Omega3^2)", (FREE_AREA,), "integral"),
]
FALSE = [
    # the condition is not kept, or the claim is false on it
    ("chaplygin", CHAPLYGIN, ("Omega1",), "integral"),
    ("hess", HESS.replace("+", "-"), (), "relation"),
    ("hess", f"exp({HESS}) - 2", (), "relation"),
    ("hess", f"log({HESS})", (), "relation"),
    # sin L = 0 and cos L = 1 at L = π, 2π too, which are not kept
    ("hess", f"sin({HESS})", (), "relation"),
    ("hess", f"cos({HESS}) - 1", (), "relation"),
    ("hess", f"{HESS}*Omega2", (), "relation"),
    ("hess", f"cos({HESS})*Omega1", (HESS,), "integral"),
    ("kovalevskaya", f"{K1}^2", (), "relation"),
    ("lagrange", "Omega1", (AREA.replace("4", "2"),), "integral"),
    ("free", "Omega3", ("Omega1^2 + gamma2^2",), "integral"),
    ("free", "Omega1*Omega2", (), "relation"),
    ("free", "sqrt(Omega1^2 + Omega3^2) - 2", (), "relation"),
    ("free", "sqrt(2)*Omega1 + sqrt(3)*Omega3", (), "relation"),
    ("free", "Omega1^2 + 1", (), "relation"),
    ("free", f"sin({FREE_AREA})*Omega1", (f"{FREE_AREA} - 1",), "integral"),
    ("free", f"log({FREE_AREA})", (FREE_AREA,), "integral"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("of", "value", "where", "kind"), TRUE)
def test_what_is_true_on_its_conditions_holds(of, value, where, kind):
    report = audited(integral(value, TOPS[of], where, kind=kind))
    assert (report.verdict, report.where) == ("holds", where)


@pytest.mark.slow
@pytest.mark.parametrize(("of", "value", "where", "kind"), FALSE)
def test_its_false_neighbours_do_not(of, value, where, kind):
    assert verdict(of, value, where, kind) != "holds"


@pytest.mark.slow
def test_a_false_integral_on_a_condition_is_refuted_without_a_state():
    assert verdict("chaplygin", CHAPLYGIN.replace("- Omega1*", "+ Omega1*"), (AREA,)) == "refuted"
    assert verdict("chaplygin", CHAPLYGIN) == "refuted"
    assert verdict("free", "Omega3^2*gamma1", (FREE_AREA,)) == "refuted"


@pytest.mark.slow
def test_a_sum_of_squares_of_parameters_is_0_only_where_each_is():
    parts = {"parameters": {"a": "0", "b": "0"}}
    for value in ("a*Omega1 + b*gamma2", "Omega1*sin(a)", "Omega1*(exp(a - b) - 1)"):
        assert verdict("free", value, relations=["a^2 + b^2"], **parts) == "holds"
        assert verdict("free", value, relations=["2*a^2 + 2*a*b + b^2"], **parts) == "holds"
        assert verdict("free", value.replace("Omega1", "(Omega1 + a)"), relations=["a^2 + b^2"], **parts) == "holds"
    assert verdict("free", "a*Omega1", relations=["a^2 - b^2"], **parts) != "holds"
    assert verdict("free", "a*Omega1", relations=["a^2 + b^3"], **parts) != "holds"


x, y, z = STATE[:3]
p = sympy.Symbol("p", positive=True)


@pytest.mark.parametrize(
    ("condition", "simpler"),
    [
        (sympy.exp(x) - 1, {x}),
        (3 - 3 * sympy.exp(2 * x - y), {2 * x - y}),
        (sympy.log(1 + x), {x}),
        (sympy.acos(x), {x - 1}),
        (sympy.sech(x) - 1, {x}),
        (sympy.exp(x) - 2, {sympy.exp(x) - 2}),
        (sympy.exp(x) + 1, {sympy.exp(x) + 1}),
        (sympy.sin(x), {sympy.sin(x)}),
        (sympy.cos(x) - 1, {sympy.cos(x) - 1}),
        (sympy.sqrt(x), {sympy.sqrt(x)}),
        (6 - 3 * sympy.sqrt(x), {x - 4}),
        (6 + 3 * sympy.sqrt(x), {6 + 3 * sympy.sqrt(x)}),
        (p * x**2 + y**4 / p, {x, y}),
        (p * x**2 - y**4, {p * x**2 - y**4}),
        (x**2 + y**2 + 1, {x**2 + y**2 + 1}),
        (x**2 * (y**2 + z**2), {x * y, x * z}),
        (x**3 * y / (1 + z), {x * y}),
        ((1 + y**2) * x, {x}),
        (p**2 * x**2 + 2 * p * x * y + 2 * y**2, {p * x + y, y}),
        (2 * p**2 * x**2 + 4 * p * x * y + y**2, {2 * p**2 * x**2 + 4 * p * x * y + y**2}),
        ((1 + y**2) * x**2 + z**2 - 2 * z + 1 - x, {(1 + y**2) * x**2 + z**2 - 2 * z + 1 - x}),
    ],
)
def test_conditions_in_other_words(condition, simpler):
    assert set(conditions_for_zero(condition)) == simpler


@pytest.mark.slow
@pytest.mark.parametrize(
    "texts",
    [
        ("Omega1*gamma1 + Omega2*gamma2 - 3", "gamma1**2 + gamma2**2 + gamma3**2 - 1"),
        ("Omega1*Omega2 - gamma1", "Omega2*gamma3 - gamma1*gamma2", "Omega3**2 - gamma1**2"),
        ("Omega1**2 - Omega2**2 - gamma1", "2*Omega1*Omega2 - gamma2"),
        ("Omega1*Omega2*Omega3", "Omega1 + Omega2 - 1"),
        ("4*Omega1**2 - 9", "Omega2/Omega1 - 2"),
    ],
)
def test_states_found_lie_exactly_on_the_conditions(texts):
    names = {str(variable): variable for variable in STATE}
    conditions = [sympy.sympify(text, locals=names) for text in texts]
    states = list(states_on(conditions, STATE, {}))
    assert states
    for state in states:
        assert set(state) == set(STATE)
        assert all(is_exactly_zero(condition, state) for condition in conditions)


def test_no_state_is_found_where_there_is_none():
    assert not list(states_on([x**2 + 1], STATE, {}))
    assert not list(states_on([x**5 - x - 1], STATE, {}))
    assert not list(states_on([x - y, x - y - 1], STATE, {}))


# Hess' condition is a^2 = 3/5 c^2 for these moments
RATIOS = [("sqrt(5/3)", "refuted"), ("sqrt(2)", "refuted"), ("pi", "refuted"), ("-sqrt(3/5)", "holds")]


@pytest.mark.slow
@pytest.mark.parametrize(("a", "expected"), RATIOS)
def test_a_relation_whose_states_are_irrational_is_refuted_at_one_of_them(a, expected):
    report = audited(integral(f"5*({a})*Omega1 + 3*Omega3", top("5 4 3", f"{a} 0 1"), kind="relation"))
    assert report.verdict == expected
    for witness in (row.witness for row in report.rows if row.witness):
        at = {name: sympy.sympify(value) for name, value in witness["parameters"].items()}
        w1, w2, w3 = (at[f"Omega{axis}"] for axis in (1, 2, 3))
        ratio = sympy.sympify(a)
        assert sympy.simplify(5 * ratio * w1 + 3 * w3) == 0
        assert sum(at[f"gamma{axis}"] ** 2 for axis in (1, 2, 3)) == 1
        # M1' = (I2 - I3) Omega2 Omega3 + gamma2, M3' = (I1 - I2) Omega1 Omega2 - a gamma2
        assert abs(float(ratio * w2 * w3 + w1 * w2) - float(witness["value"])) < 1e-12


@pytest.mark.parametrize(("factor", "expected"), [("sqrt(2)", "holds"), ("sqrt(3)", "refuted")])
def test_conditions_with_irrational_coefficients_have_states_where_these_matter(factor, expected):
    bobylev = integral("Omega2", top("2 5/4 1", "sqrt(2) 0 0"), (f"{factor}*gamma3 - Omega1*Omega3",), kind="relation")
    assert audited(bobylev).verdict == expected
    value, where = f"Omega1^2 - Omega2^2 - {factor}*gamma1", ("2*Omega1*Omega2 - sqrt(2)*gamma2",)
    delone = integral(value, top("2 2 1", "sqrt(2) 0 0"), where, kind="relation")
    assert audited(delone).verdict == expected


def test_conditions_too_large_to_expand_end_at_once():
    large = f"({' + '.join(map(str, STATE))} + 1)^40 - 3"
    assert verdict("free", "Omega3", (large,)) != "holds"
    assert verdict("free", f"sin({large})*Omega3", ("Omega1",)) != "holds"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "where"),
    [
        ("gamma2^2", ("gamma1 - 1",)),
        ("gamma1*gamma2", ("gamma3 + 1",)),
        ("gamma1", ("gamma1^2 + gamma2^2 + gamma3^2 - 2",)),
        ("Omega1*gamma2", ("gamma1 - 2", "Omega1")),
    ],
)
def test_no_witness_is_off_the_unit_sphere(value, where):
    """With γ = (1, 3/5, -1/2) γ2² does not rest, and that is no body's state; from (1, 0, 0) γ1 leaves 1 as t²."""
    report = audited(integral(value, TOPS["free"], where))
    assert report.verdict == ("refuted" if where[0] in ("gamma1 - 1", "gamma3 + 1") else "undecided")
    for row in report.rows:
        point = row.witness["parameters"] if row.witness else {"gamma1": 1}
        assert sum(Fraction(point.get(f"gamma{axis}", 0)) ** 2 for axis in (1, 2, 3)) == 1
        assert not row.witness or "the flow leaves" in row.residual


def test_a_witness_is_looked_for_on_the_unit_sphere():
    assert verdict("free", "gamma2", ("gamma1 - 1",)) == "refuted"
    assert verdict("free", "gamma2^2", ("3*gamma1 - 2",)) == "refuted"
