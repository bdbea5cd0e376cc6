"""True claims in disguise hold, their false neighbours do not: each rule of the proofs with what is just beyond it."""

from fractions import Fraction

import pytest
import sympy

import disguised_claims as disguised
from heavytop.errors import InputError
from heavytop.features.claims.algebra.combinations import nonnegative_combination
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.structure import Defined, at_values, rate_along
from support.claim_algebra import A, B, P, Q, T, sign_of, vanishes
from support.claim_tables import Table, audited, energy, integral, top, upright

ENERGY = "(3*Omega1^2 + 2*Omega2^2 + Omega3^2)"
"""Of the top of Euler, twice."""


@pytest.mark.slow
def test_a_part_of_the_family_is_decided_and_nothing_false_holds():
    """The whole of it is in validation/disguised_claims.py; one of some twenty takes seconds."""
    chosen = [claim for claim in disguised.claims() if claim.family != "definitions"][4::23]
    found = [(claim, disguised.verdict(claim)[0]) for claim in chosen]
    assert [claim.table for claim, verdict in found if disguised.is_fault(claim.expected, verdict)] == []
    missed = [claim.table for claim, verdict in found if claim.expected != "not holds" and verdict != claim.expected]
    assert missed == []
    assert len({claim.family for claim in chosen}) > 5


def said(x: str, **changes: object) -> str:
    return energy(x, **changes).verdict


def holds(table: Table) -> bool:
    return audited(table).verdict == "holds"


# --- orders ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("difference", "assume", "sample", "expected"),
    [
        ("(a - d)", ["a > b > c > d"], "4 3 2 1", True),
        ("(a - d)", ["b > c", "a > b", "d < c"], "4 3 2 1", True),
        ("(a - d)", ["a > b", "c > d"], "4 3 2 1", False),
        ("(a - d)", ["a > b", "b > c", "d > c"], "4 3 2 5/2", False),
        ("(1 - a*b)", ["0 < a < b < 1"], "2/3 3/4 1/3 1/4", True),
        ("(1 - a*b)", ["a < b < 1"], "2/3 3/4 1/3 1/4", False),
        ("(2 - a - b)", ["a < 1", "b < 1"], "2/3 3/4 1/3 1/4", True),
        ("(1 - a - b)", ["a < 1", "b < 1"], "1/4 1/4 1 1", False),
        ("log(a/d)", ["a > b > d > 0"], "4 3 2 1", True),
        ("log(a/d)", ["a > b", "d > 0"], "4 3 2 1", False),
    ],
)
def test_a_sign_follows_from_a_chain_and_from_nothing_less(difference, assume, sample, expected):
    parameters = dict(zip("abcd", sample.split(), strict=True))
    assert (said(f"sqrt({difference}^2)/{difference}", parameters=parameters, assume=assume) == "holds") is expected


@pytest.mark.parametrize(
    "text", ["a > b < c", "a >", "a > b >", "a", "a > b = c", "a => b", "a >= b < 1", "a >> b", "a >="]
)
def test_a_chain_has_one_direction(text):
    with pytest.raises(InputError, match="cannot be parsed"):
        said("1", parameters={"a": "3", "b": "2", "c": "1"}, assume=[text])


@pytest.mark.parametrize(
    ("target", "columns", "weights"),
    [
        ({"x": 1, "y": 1}, [{"x": 1}, {"y": 1}], [1, 1]),
        ({"x": 1, "y": -1}, [{"x": 1}, {"y": 1}], None),
        ({"x": 2}, [{"x": 1, "y": 1}, {"x": 1, "y": -1}], [1, 1]),
        ({"x": 1}, [{"x": 1, "y": 1}, {"x": 1, "y": 1}], None),
        ({"x": -1}, [{"x": 1}], None),
        ({}, [{"x": 1}], [0]),
        ({"x": Fraction(1, 3), "y": Fraction(1, 2)}, [{"x": 1, "y": 1}, {"y": 3}], [Fraction(1, 3), Fraction(1, 18)]),
    ],
)
def test_a_combination_adds_up_and_has_no_negative_weight(target, columns, weights):
    assert nonnegative_combination(target, columns) == weights


# --- relations ------------------------------------------------------------------------------------------------------


CIRCLE = {"parameters": {"a": "3/5", "b": "4/5"}, "relations": ["a^2 + b^2 - 1"]}
"""Of which b = √(1 − a²) is a solution where b > 1/2, and not where b > −1."""
CUBES = {"parameters": {"a": "8", "b": "2", "c": "2"}, "assume": ["b > 0"]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("x", "given", "expected"),
    [
        ("sqrt(1 - a^2)/b", CIRCLE | {"assume": ["b > 1/2"]}, True),
        ("sqrt(1 - a^2) - b + 1", CIRCLE | {"assume": ["b > -1"]}, False),
        ("sqrt(1 - a^2)/b*sqrt((1 + a)^2)/(1 + a)", CIRCLE | {"assume": ["b > 0"]}, True),
        ("sqrt((1 + 2*a)^2)/(1 + 2*a)", CIRCLE | {"assume": ["b > 0"]}, False),
        ("a/c^3", CUBES | {"relations": ["a - b^3", "b^3 - c^3"]}, True),
        ("a/c^3", CUBES | {"relations": ["a - b^3", "b^2 - c^2"]}, False),
    ],
)
def test_a_solution_keeps_what_was_known_of_its_symbol_and_one_follows_another(x, given, expected):
    assert (said(x, **given) == "holds") is expected


# --- radicals and inverse functions -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("nested", "simple", "is_same"),
    [
        (sympy.sqrt(3 + 2 * sympy.sqrt(2)), 1 + sympy.sqrt(2), True),
        (sympy.sqrt(3 - 2 * sympy.sqrt(2)), sympy.sqrt(2) - 1, True),
        (sympy.sqrt(3 - 2 * sympy.sqrt(2)), 1 - sympy.sqrt(2), False),
        (sympy.sqrt(2 + 2 * sympy.sqrt(2)), 1 + sympy.sqrt(2), False),
        (sympy.sqrt(P + Q + 2 * sympy.sqrt(P * Q)), sympy.sqrt(P) + sympy.sqrt(Q), True),
        # which of the two is larger is not known
        (sympy.sqrt(P + Q - 2 * sympy.sqrt(P * Q)), sympy.sqrt(P) - sympy.sqrt(Q), False),
        (sympy.sqrt(P + Q - 2 * sympy.sqrt(P * Q)), sympy.sqrt(Q) - sympy.sqrt(P), False),
        # real where a > 0 alone, and where a < 0 it is √(a + b) − √a with other roots
        (sympy.sqrt(2 + T**2 - 2 * sympy.sqrt(1 + T**2)), sympy.sqrt(1 + T**2) - 1, True),
        (sympy.sqrt(2 + T**2 - 2 * sympy.sqrt(1 + T**2)), 1 - sympy.sqrt(1 + T**2), False),
        (sympy.sqrt(sympy.sqrt(2) - 1) * sympy.sqrt(sympy.sqrt(2) + 1), sympy.Integer(1), True),
        (sympy.sqrt(sympy.sqrt(2) - 1) * sympy.sqrt(sympy.sqrt(2) + 1), sympy.Integer(-1), False),
    ],
)
def test_nested_roots_are_sums_of_roots_with_the_right_signs(nested, simple, is_same):
    assert vanishes(nested - simple) is is_same


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [(), ((P, Q),), ((Q, P),)])
def test_a_denested_root_is_the_root_at_random_values(sign, order):
    """√(p + q ± 2 √(p q)) against numbers on either side of p = q, where the order is known and where it is not."""
    nested = sympy.sqrt(P + Q + sign * 2 * sympy.sqrt(P * Q))
    field = Field(Assumptions(T, (P, Q), greater=order), [nested])
    found = field.expression(field.enter(nested))
    for p, q in ((4, 1), (1, 4), (9, 2)):
        if all((p > q) is (larger == P) for larger, _ in order):
            values = {P: p, Q: q}
            assert abs(sympy.N(found.subs(values) - nested.subs(values))) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(
    ("x", "given", "expected"),
    [
        ("4*(4*atan(1/5) - atan(1/239))/pi", {}, True),
        ("4*(4*atan(1/5) - atan(1/240))/pi", {}, False),
        ("(atan(1) + atan(2) + atan(3))/pi", {}, True),
        # the tangent of the sum is right, the sum off by π
        ("1 + atan(1) + atan(2) + atan(3)", {}, False),
        ("(atan(2) + atan(3))*4/pi + 2", {}, False),
        ("(atan(2) + atan(3))*4/pi - 2", {}, True),
        ("(atan(a) + atan(1/a))*2/pi", {"assume": ["a > 0"]}, True),
        ("(atan(a) + atan(1/a))*2/pi", {"assume": ["a > -1"]}, False),
        ("2/pi*(atan(a) + atan(1/a))", {"parameters": {"a": ["2", "3", "5"]}, "assume": ["a > 1"]}, True),
        # arcs at samples tell nothing of another part of the domain
        ("2/pi*(atan(a) + atan(1/a))", {"parameters": {"a": ["2", "3", "5"]}, "assume": ["a^2 > 1"]}, False),
        ("1 + 2*atan(a) - atan(2*a/(1 - a^2))", {"assume": ["0 < a < 1"]}, True),
        ("1 + 2*atan(a) - atan(2*a/(1 - a^2))", {"assume": ["a > 0"]}, False),
        ("acos(a)/(2*atan(sqrt(1 - a)/sqrt(1 + a)))", {"assume": ["0 < a < 1"]}, True),
        ("log(2 + sqrt(3)) + log(2 - sqrt(3)) + 1", {}, True),
        ("log(2 + sqrt(3)) - log(2 - sqrt(3)) + 1", {}, False),
        ("log(2 + sqrt(3)) + log(3 - sqrt(3)) + 1", {}, False),
    ],
)
def test_sums_of_inverse_functions_are_what_they_are_and_not_off_by_pi(x, given, expected):
    assert (said(x, **({"parameters": {"a": "1/2"}} | given)) == "holds") is expected


def test_a_sum_that_jumps_inside_the_domain_proves_nothing():
    """2 atan t = atan(2 t/(1 − t²)) for |t| < 1 only; the samples lie there."""
    for spin, expected in (
        ("2*atan(t) - atan(2*t/(1 - t^2))", False),
        ("2*atan(t) - 2*asin(t/sqrt(1 + t^2))", True),
    ):
        assert holds(upright(f"1 + {spin}", top("1 1 2", "0 0 3"), times=["1/3"])) is expected


# --- saturation -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("relation", "assume", "holds"),
    [
        ("(1 - g^2)*(a - 1)", ["1 > g^2"], True),
        ("(1 - g^2)*(a - 1)", ["2 > g^2"], False),
        ("(1 - g^2)*(a - 1)", [], False),
        ("g*(a - 1)", ["g^2 > 0"], True),
        ("g*(a - 1)", ["g^2 > -1"], False),
        ("(g + 2)*(a - 1)", ["g > -1"], True),
        ("(g + 2)*(a - 1)", ["g > -3"], False),
        ("g*h*(a - 1)", ["g*h > 0"], True),
        ("g*h*(a - 1)", ["g > 0"], False),
    ],
)
def test_a_factor_that_is_never_0_is_divided_out_and_no_other(relation, assume, holds):
    given = {"parameters": {"a": "1", "g": "1/2", "h": "1/3"}, "relations": [relation], "assume": assume}
    assert (said("a", **given) == "holds") is holds


@pytest.mark.slow
def test_what_is_only_kept_from_0_along_a_motion_is_not_divided_out():
    """sqrt(E) needs E ≥ 0; on E Ω1 = 0 the motions with E = 0 have any Ω1."""
    table = integral(f"sqrt({ENERGY} - 5)*0 + Omega1", top(weight="0"), [f"({ENERGY} - 5)*Omega1"])
    assert not holds(table)


@pytest.mark.slow
def test_a_relation_of_hess_needs_no_sign_of_its_centre():
    given = {"kind": "relation", "parameters": {"a": "9", "b": "5", "c": "4", "x": "4", "z": "3"}}
    value, relations = "a*x*Omega1 + c*z*Omega3", ["a*(b - c)*x^2 - c*(a - b)*z^2"]
    assert holds(integral(value, top("a b c", "x 0 z"), relations=relations, **given))
    # without the relation, or with another sign, it is none
    assert audited(integral(value, top("a b c", "x 0 z"), **given)).verdict == "refuted"
    assert not holds(integral(value.replace("+", "-"), top("a b c", "x 0 z"), relations=relations, **given))


@pytest.mark.slow
@pytest.mark.parametrize(("divisor", "expected"), [("a - b", True), ("a - 2*b", False), ("2 - a", False)])
def test_a_constant_of_parameters_is_no_gap_that_can_be_removed(divisor, expected):
    """A constant that is 0 at some parameters is 0 there all along every motion."""
    given = {"parameters": {"a": "5", "b": "4"}, "assume": ["a > b", "b > 0"]}
    assert holds(integral(f"{ENERGY}/({divisor})*Omega1/Omega1", top(weight="0"), **given)) is expected


# --- definitions ----------------------------------------------------------------------------------------------------


def test_a_definition_has_the_rate_and_the_values_of_its_formula():
    inner = Defined("d", T**2 + P)
    outer = Defined("e", inner**3 * T)
    plain = (T**2 + P) ** 3 * T
    values = {T: sympy.Rational(2, 3), P: sympy.Integer(5)}
    assert T in outer.free_symbols
    assert at_values(outer + inner, values) == (plain + T**2 + P).subs(values)
    assert at_values(rate_along({T: sympy.Integer(1)})(outer), values) == sympy.diff(plain, T).subs(values)
    assert Defined("d", T) != Defined("d", T)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "end", "expected"),
    [
        ("d{0}*(2 + t^2 + sin(t))/(2 + t^2 + sin(t))", "d25/(1 + t^2)", True),
        ("sqrt(1 + d{0}^2)", "d25/sqrt(25 + (1 + t^2)^2)", True),
        ("d{0} + sin(t)^2 + cos(t)^2", "d25 - t^2 - 24", False),
        ("d{0} + sin(t)^2 + cos(t)^2", "d25 - t^2 - 25", True),
    ],
)
def test_a_formula_through_25_definitions_is_carried(link, end, expected):
    definitions = {"d0": "1 + t^2"} | {f"d{i + 1}": link.format(i) for i in range(25)}
    omega = [f"2/cosh(t)*({end})", "0", "0"]
    motion = {"omega": omega, "gamma": ["0", "-2*tanh(t)/cosh(t)", "1 - 2/cosh(t)^2"]}
    assert holds(upright("", top("1 2 3", "0 0 1"), motion=motion, definitions=definitions)) is expected


@pytest.mark.slow
@pytest.mark.parametrize(("extra", "steps", "verdict"), [("", 25, "holds"), (" + Omega1", 4, "refuted")])
def test_a_function_of_first_integrals_through_definitions_is_constant(extra, steps, verdict):
    definitions = {"d0": "3*Omega1^2 + 2*Omega2^2 + Omega3^2" + extra}
    definitions |= {f"d{i + 1}": f"d{i}^2/(1 + d{i}^2) + d{i}" for i in range(steps)}
    assert audited(integral(f"d{steps}", top(weight="0"), definitions=definitions)).verdict == verdict


# --- what is no reason ----------------------------------------------------------------------------------------------


def _signs(inside: list[sympy.Expr], *asked: sympy.Expr, **known: tuple) -> list[int]:
    return [sign_of(e, [*inside, *asked], **known).value for e in asked]


def test_a_root_does_not_make_what_is_under_it_positive():
    logarithms = [sympy.log(B**2 + 2), sympy.log(B**2 + 1)]
    assert _signs([sympy.sqrt(A), *logarithms], A, A + 1) == [0, 0]
    assert _signs([], A, A + 1, A * B + 1, facts=(sympy.sqrt(A) + A * B,)) == [0, 0, 0]
    assert _signs([sympy.sqrt(A)], A, A + 1, A + sympy.sqrt(A), weak=(A,)) == [1, 1, 1]


@pytest.mark.parametrize(("assumed", "expected"), [([], "undecided"), (["sqrt(a) > 1"], "holds")])
def test_an_assumption_makes_its_own_roots_real_and_a_formula_does_not(assumed, expected):
    table = upright("sqrt(a) + log(3) + log(2)", top("1 1 2", "0 0 0", "0"), assume=assumed)
    assert audited(table | {"parameters": {"a": ["4", "9"]}}).verdict == expected


def test_an_exponential_below_1_is_no_lower_bound_above_1():
    small = sympy.exp(-P)
    for known in ({"facts": (B - small,)}, {"greater": ((B, small),)}):
        assert _signs([small], B - 1, B * small - 1, B, small - 2, **known) == [0, 0, 1, -1]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("Omega3 + atan(Omega3) + atan(1/Omega3)", "holds"),
        ("Omega1*(atan(Omega3) + atan(1/Omega3) - pi/2)", "refuted"),
        ("Omega1*(atan(1 + Omega3^2) + atan(1/(1 + Omega3^2)) - pi/2)", "holds"),
        ("Omega1*(log(Omega3) + log(1/Omega3))", "holds"),
    ],
)
def test_halves_that_a_divisor_parts_have_sums_of_arcs_of_their_own(value, expected):
    """Integrals of the top of Lagrange that spins either way; the states of the file spin one way, the audit's both."""
    states = [f"1 2 {spin} 3/5 0 4/5" for spin in ("2", "3/7", "5")]
    assert audited(integral(value, top("2 2 1", "0 0 1"), states=states)).verdict == expected
