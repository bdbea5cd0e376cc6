"""Single conditions of the proofs, each with a claim that would be proven falsely, or not at all, without it."""

from fractions import Fraction

import pytest
import sympy

from heavytop.features.claims.algebra.conditions import ConditionKind, Need
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import Prover, Region
from heavytop.features.claims.algebra.reader import assume
from heavytop.features.claims.algebra.ring import used
from heavytop.features.claims.algebra.signs import Sign
from heavytop.features.claims.algebra.statement import Flow, Formulas, Setting
from heavytop.features.claims.audit.context import STATE
from support.claim_algebra import SYMBOLS, A, B, C, P, T, statement
from support.claim_tables import energy

OMEGA1, OMEGA2 = STATE[:2]
SPHERE = sum(x**2 for x in STATE[3:]) - 1
RESTING = Flow(lambda e: sympy.Integer(0), frozenset(STATE), always=(SPHERE,))


def holds(x: str, divisor: str = "1", **parts: object) -> bool:
    return energy(x, divisor, **parts).verdict == "holds"


# --- what an assumption needs -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("x", "divisor", "assumed", "relations", "expected"),
    [
        ("1", "g", "sqrt(g) > -1", [], False),
        ("1", "1 + g", "sqrt(g) > -1", [], True),
        ("1", "g", "log(g) > -5", [], True),
        ("1", "g", "1/g > -5", [], True),
        ("1", "1 - g", "asin(g) > -2", [], False),
        ("a", "1", "sqrt(g) > -1", ["g*(a - 1)"], False),
        ("a", "1", "log(g) > -5", ["g*(a - 1)"], True),
        ("1 + sqrt(g^2) - g", "1", "sqrt(g) > -1", [], True),
        ("1 + sqrt(g^2) - g", "1", "1/g > -5", [], False),
    ],
)
def test_what_an_assumption_needs_to_be_real_may_be_0(x, divisor, assumed, relations, expected):
    given = {"parameters": {"a": "1", "g": "1/2"}, "assume": [assumed], "relations": relations}
    assert holds(x, divisor, **given) is expected


def test_each_kind_of_need_is_kept_apart():
    needs = [Need(ConditionKind.NONNEGATIVE, A), Need(ConditionKind.POSITIVE, B), Need(ConditionKind.NONZERO, C)]
    found = assume([], needs, [], SYMBOLS)
    assert (found.weak, found.facts) == ((A,), (B, C**2))
    known = Setting(T, facts=found.facts, weak=found.weak).assumptions(0, facts=(B + 1,), weak=(A + 1,))
    assert (known.weak, known.facts) == ((A, A + 1), (B, C**2, B + 1))


@pytest.mark.parametrize(
    ("kind", "expected"), [(ConditionKind.NONNEGATIVE, Sign(1, False)), (ConditionKind.POSITIVE, Sign(1, True))]
)
def test_what_the_flow_keeps_is_as_strict_as_the_need(kind, expected):
    kept = OMEGA1 - OMEGA2
    said = statement(sympy.sqrt(kept), RESTING, formulas=Formulas((sympy.sqrt(kept),), frozenset({Need(kind, kept)})))
    field = Prover([said], Setting(T)).field(said, 0)
    assert field.tower.sign(field.enter(kept)) == expected


# --- divisors ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("divisor", "expected"), [(STATE[3], True), (SPHERE, False), (abs(OMEGA1) - OMEGA1, False)])
def test_a_sign_is_not_kept_where_its_rate_divides_by_what_is_0_on_an_open_set(divisor, expected):
    factor = (divisor * OMEGA1 + divisor * OMEGA2) / divisor
    flow = Flow(lambda e: e * factor, frozenset(STATE), always=(SPHERE,))
    field = Field(Assumptions(T), [OMEGA2])
    region = Region(field, Setting(T), statement(OMEGA2, flow), [])
    assert region.is_kept(field.enter(OMEGA2).numerator) is expected


@pytest.mark.parametrize(("relations", "against"), [((), 0), ((OMEGA1,), 1), ((OMEGA2,), 1), ((OMEGA1 - 1,), 0)])
def test_an_identity_on_relations_divides_by_nothing_that_is_0_there(relations, against):
    said = statement((OMEGA1 * OMEGA2 + OMEGA1) / OMEGA1 - OMEGA2 - 1, RESTING)
    proven, conditions = Prover([said], Setting(T, relations=relations)).prove(said)
    assert proven
    assert sum("a divisor is" in condition.reason for condition in conditions) == against


# --- inverse functions ------------------------------------------------------------------------------------------------

W = P * A**2
AT = {T: Fraction(1), A: Fraction(2), P: Fraction(3)}


def region_of(e: sympy.Expr, **known: object) -> Region:
    return Region(Field(Assumptions(T, (P,), **known), [e]), Setting(T, (P,)), statement(e), [AT])


@pytest.mark.parametrize(
    ("e", "expected"),
    [
        # 0 or π, as the sign of a
        (sympy.acos(abs(A) / A), False),
        (sympy.atan(A) + sympy.atan(1 / A) - sympy.pi / 2, False),
        (sympy.atan(W) + sympy.atan(1 / W) - sympy.pi / 2, True),
        # both ends of the range are π, and neither is reached
        (sympy.acos((1 - W**2) / (1 + W**2)) - 2 * sympy.atan(W), True),
        # equal at the place that is looked at
        (sympy.atan(W) - sympy.atan(W**2 / 12), False),
    ],
)
def test_arcs_on_a_domain_in_two_parts(e, expected):
    assert region_of(e, nonzero=(A,)).vanishes(e) is expected


@pytest.mark.parametrize(("turns", "expected"), [(0, True), (1, False), (-1, False), (2, False)])
def test_a_sum_of_arcs_is_told_from_one_that_is_off_by_pi(turns, expected):
    e = sympy.atan(A) - sympy.asin(A / sympy.sqrt(1 + A**2))
    region = region_of(e)
    first, second = (used(region.field.enter(part).numerator).pop() for part in (sympy.atan(A), -e + sympy.atan(A)))
    arcs = region._arcs
    assert arcs._is_small_somewhere({first: 1, second: -1}, Fraction(turns)) is expected


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ({sympy.atan(P): 2}, True),
        ({sympy.asin(P): 2}, False),
        ({sympy.acos(B): 1, sympy.atan(P): -1}, True),
        ({sympy.acos(B): 1, sympy.atan(A**2): -1}, False),
        ({sympy.atan(P): 3}, False),
    ],
)
def test_a_range_with_the_end_pi_is_small_where_an_open_range_takes_part(terms, expected):
    region = region_of(sympy.Add(*terms))
    weights = {used(region.field.enter(arc).numerator).pop(): weight for arc, weight in terms.items()}
    assert region._arcs._is_small_by_ranges(weights, Fraction(0)) is expected


# --- relations --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("relation", "where_zero"),
    [
        (A + B * C, B * C),
        (A * C + B**2 * C**3, B * C),
        (A + B * (1 + B**2), B),
        (A + 1 + B**2, sympy.Integer(1)),
        (A * B, None),
        # not between parameters alone: as it is
        (A + B**2 * OMEGA1, A + B**2 * OMEGA1),
    ],
)
def test_a_relation_where_a_parameter_is_0_is_the_product_of_what_may_be_0(relation, where_zero):
    field = Field(Assumptions(T, parameters=frozenset(SYMBOLS)), [A, B, C, OMEGA1])
    found = field._where_zero([field.enter(relation).numerator], used(field.enter(A).numerator).pop())
    expected = [A] if where_zero is None else [A, where_zero]
    assert [field.expression(field.tower.polynomial(p)) for p in found] == expected
