"""The bounds of a proof, one by one: what a formula needs, the sign of a value, continuity, where halves join."""

from fractions import Fraction

import pytest
import sympy
from flint import arb

from heavytop.features.claims.algebra.conditions import (
    ConditionKind,
    Need,
    condition,
    conditions_of,
    is_exactly_zero,
    written,
)
from heavytop.features.claims.algebra.fields import Assumptions, Field, Regularity
from heavytop.features.claims.algebra.prover import Prover
from heavytop.features.claims.algebra.reader import FUNCTIONS
from heavytop.features.claims.algebra.ring import used
from heavytop.features.claims.algebra.signs import Sign
from heavytop.features.claims.algebra.statement import AFTER, ALL, BEFORE, Domain, Flow, Formulas, Statement
from heavytop.features.claims.audit.judge import judge
from support.claim_algebra import A, P, Q, T, region_of, setting, sign_of, statement
from support.claim_tables import audited, integral, top

TINY = Fraction(1, 10**200)


def words(needs) -> set[str]:
    return {need.text for need in needs}


@pytest.mark.parametrize(
    ("kind", "met"),
    [
        (ConditionKind.NONZERO, {-1: True, -TINY: True, 0: False, TINY: True, 1: True}),
        (ConditionKind.POSITIVE, {-1: False, -TINY: False, 0: False, TINY: True, 1: True}),
        (ConditionKind.NONNEGATIVE, {-1: False, -TINY: False, 0: True, TINY: True, 1: True}),
    ],
)
def test_a_need_is_met_up_to_its_edge_and_not_beyond(kind: ConditionKind, met: dict) -> None:
    for value, expected in met.items():
        assert Need(kind, T).is_met({T: Fraction(value)}) is expected
    # what is 0 but only to a ball: nobody knows
    assert Need(kind, sympy.sqrt(T) - sympy.sqrt(T + 1 - P)).is_met({T: Fraction(2), P: Fraction(1)}) is None
    assert Need(kind, sympy.log(T)).is_met({T: Fraction(-1)}) is None
    assert Need(kind, 1 / T).is_met({T: Fraction(0)}) is None


@pytest.mark.parametrize("value", [-1, 0, 1])
@pytest.mark.parametrize("strict", [True, False])
def test_a_sign_meets_what_follows_from_it(value: int, strict: bool) -> None:
    kinds = ConditionKind.NONZERO, ConditionKind.POSITIVE, ConditionKind.NONNEGATIVE
    expected = [strict, strict and value == 1, value == 1]
    assert [kind.is_met_by(Sign(value, strict)) for kind in kinds] == expected


@pytest.mark.parametrize(
    ("function", "needs"),
    [
        ("/", {"t ≠ 0"}),
        ("sqrt", {"t ≥ 0"}),
        ("log", {"t > 0"}),
        ("asin", {"-1 ≤ t ≤ 1"}),
        ("acos", {"-1 ≤ t ≤ 1"}),
        ("tan", {"cos(t) ≠ 0"}),
        ("sec", {"cos(t) ≠ 0"}),
        ("coth", {"sinh(t) ≠ 0"}),
        ("csch", {"sinh(t) ≠ 0"}),
        ("atan2", {"a**2 + t**2 > 0"}),
        ("atan", set()),
        ("tanh", set()),
    ],
)
def test_a_function_needs_what_it_needs(function: str, needs: set[str]) -> None:
    assert words(condition(function, (T, A) if function == "atan2" else (T,))) == needs


def test_every_function_of_a_formula_has_conditions_on_its_own_arguments() -> None:
    symbols = sympy.symbols("u v m", real=True)
    for name, (_, count) in FUNCTIONS.items():
        assert all(need.expression.free_symbols <= {*symbols[:count]} for need in condition(name, symbols[:count]))


def test_a_number_that_meets_a_need_is_none_and_one_that_does_not_stays() -> None:
    one, zero = sympy.Integer(1), sympy.Integer(0)
    for function, value in (("/", -one), ("sqrt", one), ("log", one / 3)):
        assert not condition(function, (value,))
    for function, value in (("/", zero), ("log", zero), ("log", -one), ("sqrt", -one), ("asin", 2 * one)):
        assert condition(function, (value,))


@pytest.mark.parametrize(
    ("expression", "needs"),
    [
        (sympy.sqrt(T), {"t ≥ 0"}),
        (T**-2, {"t ≠ 0"}),
        (T ** sympy.Rational(-1, 2), {"t ≥ 0", "t ≠ 0"}),
        (sympy.exp(-T), set()),
        (sympy.sign(T), {"t ≠ 0"}),
        (sympy.log(sympy.sqrt(A) + T), {"a ≥ 0", "sqrt(a) + t > 0"}),
        (sympy.acos(1 / T), {"-1 ≤ 1/t ≤ 1", "t ≠ 0"}),
    ],
)
def test_every_part_of_a_formula_is_asked(expression: sympy.Expr, needs: set[str]) -> None:
    assert words(conditions_of([expression])) == needs


@pytest.mark.parametrize(
    ("expression", "value", "expected"),
    [
        (T**2 - 2 * T + 1, 1, True),
        (T**2 - 2 * T + 1, 1 + TINY, False),
        (sympy.sqrt(T) - 2, 4, True),
        (sympy.sqrt(T) - 2, 4 + TINY, None),
        (sympy.sqrt(T) - sympy.sqrt(2), 2, True),
        (sympy.sin(T) ** 2 + sympy.cos(T) ** 2 - 1, 1, True),
        (T**2 - 4, 2 + Fraction(1, 10**400), False),
        (sympy.sqrt(3 + 2 * T) - 1 - T, Fraction(1, 10**300), False),
        (sympy.sqrt(T), 0, True),
        # nobody knows: undefined, not real, or 0 to no more than a ball
        (sympy.sqrt(T), -1, None),
        (sympy.sqrt(1 - T) * (T - 2), 2, None),
        (sympy.log(T - 1) * (T - 1), 1, None),
        (sympy.log(T * 6) - sympy.log(2) - sympy.log(3) + sympy.Rational(1, 10**200), 1, None),
        ((T - 1) * sympy.sqrt(sympy.log(T * 6) - sympy.log(2) - sympy.log(3) - sympy.Rational(1, 10**200)), 1, None),
    ],
)
def test_0_is_proven_and_what_is_off_by_1e_200_is_off(expression, value, expected) -> None:
    found = is_exactly_zero(expression, {T: Fraction(value), P: Fraction(1)})
    assert found is expected


# --- signs and continuity ---------------------------------------------------------------------------------------------


SIN, COS, ROOT = sympy.sin(T), sympy.cos(T), sympy.sqrt(1 + T**2)


@pytest.mark.parametrize(
    ("expression", "sign", "expected"),
    [
        (T**2, 0, (1, False)),
        (-(T**2), 0, (-1, False)),
        (T**2 + 1, 0, (1, True)),
        (T**2 - 1, 0, (0, False)),
        (T**2 - T + 1, 0, (1, True)),
        (T**2 - 2 * T + P, 0, (0, False)),
        (T, 1, (1, False)),
        (T + 1, 1, (1, True)),
        (T - 1, 1, (0, False)),
        (T, -1, (-1, False)),
        (T - 1, -1, (-1, True)),
        (T**3 - 3 * T + 1, 1, (0, False)),
        (T**3 - 3 * T + 3, 1, (1, True)),
        (T * P, 1, (1, False)),
        (T * P + P**2, 1, (1, True)),
        (SIN + 1, 0, (1, False)),
        (SIN - 1, 0, (-1, False)),
        (SIN + 2, 0, (1, True)),
        (2 * SIN + 1, 0, (0, False)),
        (SIN + COS + 2, 0, (1, True)),
        (SIN + COS + 1, 0, (0, False)),
        (COS - COS**2 / 2 + sympy.Rational(3, 2), 0, (1, False)),
        (T + ROOT, 0, (1, True)),
        (T - ROOT, 0, (-1, True)),
        (2 * T - ROOT, 0, (0, False)),
        (T + sympy.sqrt(T**2), 0, (1, False)),
        (T - sympy.sqrt(T**2), 0, (-1, False)),
        (sympy.sqrt(2) - 1, 0, (1, True)),
        (sympy.sqrt(2) - sympy.Rational(3, 2), 0, (-1, True)),
        # 0, which no ball can tell
        (sympy.atan(sympy.Rational(1, 2)) + sympy.atan(sympy.Rational(1, 3)) - sympy.pi / 4, 0, (0, False)),
        (sympy.sqrt(3 + 2 * sympy.sqrt(2)) - 1 - sympy.sqrt(2), 0, (1, False)),
        (sympy.exp(T) + sympy.exp(-T) - 2, 0, (1, False)),
        (sympy.tanh(T) + 1, 0, (1, True)),
        (T**4 - T**2 + 1, 0, (1, True)),
        (T**2 + 2 * T + 1 - Fraction(1, 10**30), 0, (0, False)),
        (5 - 4 * COS * sympy.sin(A), 0, (1, True)),
        (sympy.exp(2 * T) - sympy.exp(T) + 1, 0, (1, True)),
        (sympy.sqrt(T**2 + P) + sympy.sqrt(T**2), 0, (1, True)),
        (2 + sympy.atan(T), 0, (1, True)),
        (sympy.sqrt(2) + sympy.sqrt(3) - sympy.pi, 0, (1, True)),
        (sympy.sqrt(2) + sympy.sqrt(3) - sympy.pi - sympy.Rational(1, 200), 0, (-1, True)),
        (P * T**2 - P * T + P, 0, (1, True)),
        (1 + SIN * COS, 0, (1, True)),
        (1 + 2 * SIN * COS, 0, (1, False)),
        (P - Q, 0, (0, False)),
        # arcs go to pi and pi/2, which lie between 3 and 22/7
        (sympy.acos(SIN) - 3, 0, (0, False)),
        (sympy.acos(SIN) - sympy.Rational(22, 7), 0, (-1, False)),
        (sympy.asin(COS) - sympy.Rational(3, 2), 0, (0, False)),
        (sympy.atan(T) + sympy.Rational(3, 2), 0, (0, False)),
    ],
)
def test_a_sign_is_what_it_is_or_unknown_and_strict_only_where_it_is_never_0(expression, sign, expected) -> None:
    value, strict = sign_of(sympy.sympify(expression), variable_sign=sign)
    assert value in (expected[0], 0)
    assert strict <= expected[1]
    if expected[1]:
        assert (value, strict) == expected


def test_what_is_known_of_a_fact_turns_with_its_sign() -> None:
    fact = 1 - A - A**2
    expected = [(fact, 1), (-fact, -1), (2 * fact, 1), (fact + 2, 1), (-fact - 2, -1)]
    assert [sign_of(each, facts=(fact,)) for each, _ in expected] == [(value, True) for _, value in expected]
    assert [sign_of(each, facts=(fact,)).value for each in (2 * fact - 1, 1 - 2 * fact)] == [0, 0]
    # a product that is > 0 tells nothing of its factors
    assert sign_of(A - 1, facts=((A - 1) * (A - 2),)).value == 0
    # a closed interval holds its ends
    ends = ((A, (Fraction(1), Fraction(2))),)
    found = {text: sign_of(sympy.sympify(text, {"a": A, "p": P}), ranges=ends) for text in ("a-1", "a-2", "p*(a-1)")}
    assert found == {"a-1": (1, False), "a-2": (-1, False), "p*(a-1)": (1, False)}
    assert sign_of(A - sympy.Rational(3, 2), ranges=ends).value == 0
    assert sign_of(P + A, ranges=ends) == (1, True)
    assert sign_of(2 * P - A, ranges=ends).value == 0


@pytest.mark.parametrize(
    ("expression", "sign", "strict", "continuous", "analytic"),
    [
        (sympy.sqrt(T), 1, False, True, False),
        (sympy.sqrt(T), 1, True, True, True),
        (sympy.sqrt(T), 0, False, False, False),
        (sympy.log(T), 1, False, False, False),
        (sympy.log(T), 1, True, True, True),
        (1 / T, 1, False, False, False),
        (1 / T, 1, True, True, True),
        (sympy.asin(T), 1, True, False, False),
        (sympy.asin(sympy.tanh(T)), 0, False, True, True),
        (sympy.acos(SIN), 0, False, True, False),
        (sympy.atan(1 / T), 0, False, False, False),
        (sympy.atan(sympy.sqrt(T)), 0, False, False, False),
        (sympy.atan2(T, P), 0, False, True, True),
        (sympy.atan2(P, T), 0, False, True, True),
        (sympy.atan2(T, T**2), 0, False, False, False),
        (sympy.atan2(T, -P), 0, False, False, False),
    ],
)
def test_a_formula_is_continuous_only_by_the_rules(expression, sign, strict, continuous, analytic) -> None:
    field = Field(Assumptions(T, (P,), variable_sign=sign, strict=strict), [expression])
    rules, value = Regularity(field), field.enter(expression)
    assert (not rules.obstacle(value)) == continuous
    assert (not rules.obstacle(value, analytic=True)) == analytic


# --- verdicts ---------------------------------------------------------------------------------------------------------

HALVES = sympy.tanh(T) * sympy.sqrt(T**2) - T * sympy.sqrt(sympy.tanh(T) ** 2)
"""0 for either sign of t by algebra, and not for both at once."""


GAP, KINK = (T**2 + T) / T - T - 1, 3 + sympy.sign(sympy.sqrt(2) - sympy.sqrt(T))


@pytest.mark.parametrize(
    ("residual", "parts", "holds"),
    [
        # halves join where the variable is time and nowhere else
        (HALVES, {}, True),
        (HALVES, {"domain": Domain("all", 0, ALL.points, "positive roots")}, None),
        (HALVES, {"flow": Flow(lambda e: sympy.diff(e, T), frozenset((T,)))}, None),
        *((HALVES, {"domain": half}, True) for half in (BEFORE, AFTER)),
        # a half alone proves nothing of the whole
        *((sympy.sqrt(T**2) + sign * T, {}, False) for sign in (1, -1)),
        # the end of the domain belongs to it where its label says so
        (GAP, {"domain": BEFORE}, None),
        (GAP, {"domain": AFTER}, True),
        # a ball that is not a number, or not real, excludes 0 and is no witness
        *((residual, {}, None) for residual in (1 + sympy.sqrt(-1 - T**2), 1 + sympy.log(-1 - T**2))),
        (2 + sympy.acos(2 + T**2), {}, None),
        # where a derivative may have a kink nothing is refuted
        (KINK, {"domain": Domain("t>0", 1, (Fraction(2),))}, None),
        (KINK, {"domain": Domain("t>0", 1, (Fraction(2), Fraction(3)))}, False),
        # off by less than a short ball shows
        (sympy.sqrt(2 + T**2) - sympy.sqrt(2 + T**2 + sympy.Rational(1, 10**100)), {}, False),
    ],
)
def test_a_residual_is_judged_on_its_domain_alone(residual: sympy.Expr, parts: dict, holds: bool | None) -> None:
    (row,) = judge([statement(residual, formulas=Formulas(), **parts)], setting())
    assert row.holds is holds


def test_a_note_makes_another_domain() -> None:
    """Two domains of one label: what is known on the first says nothing on the second."""
    known = Domain("all", 0, ALL.points, "a > 0", facts=(A,))
    residual = sympy.sqrt(A**2) - A
    for domains, expected in (((known, ALL), [True, None]), ((ALL, known), [None, True])):
        stated = [Statement("1", i, "smooth", domain, residual, "") for i, domain in enumerate(domains)]
        assert [row.holds for row in judge(stated, setting())] == expected


def test_a_kink_is_no_place_where_a_residual_is_defined() -> None:
    kink = statement(sympy.sign(sympy.sqrt(T + 1) - sympy.sqrt(2)) + T, formulas=Formulas())
    prover, times = Prover([kink], setting()), (0, 1, 1 + Fraction(1, 10**100), 2)
    # at 1 the difference of roots is 0, and only to a ball: nobody knows
    defined = [prover.is_defined(kink, {T: Fraction(t), P: Fraction(2)}) for t in times]
    assert defined == [True, False, True, True]


def test_what_fails_on_the_relations_is_not_removable() -> None:
    for relations, expected in (((), True), ((A - 1,), False)):
        region = region_of(A - 1, setting(1, relations=relations))
        assert region.is_removable(Need(ConditionKind.NONZERO, A - 1)) is expected


@pytest.mark.parametrize(
    "need",
    [Need(ConditionKind.NONNEGATIVE, -1 - T**2), Need(ConditionKind.NONZERO, T - T), Need(ConditionKind.POSITIVE, -P)],
)
def test_a_place_where_a_formula_is_undefined_is_no_witness(need: Need) -> None:
    for needs, holds in ((frozenset({need}), None), (frozenset(), False)):
        (row,) = judge([statement(1 + T**2, formulas=Formulas(values=(T,), needs=needs))], setting())
        assert row.holds is holds
        assert [c.discharged for c in row.conditions if c.text == written(need.text)] == [False] * len(needs)


# --- what is 0 on no open set, and what is 0 nowhere ------------------------------------------------------------------


@pytest.mark.parametrize("known", [{"facts": (A**2 - 1,)}, {"nonzero": (A,)}, {"facts": (A**2 - 1, -A)}])
def test_a_function_that_is_not_0_at_a_sample_may_be_0_on_another_part_of_a_domain_in_parts(known: dict) -> None:
    """|a| - a is 0 where a > 0."""
    e = sympy.sqrt(A**2) - A
    where = region_of(e, setting(-2, **known))
    assert where.is_zero_nowhere_dense(where.field.enter(e).numerator) is (-A in known.get("facts", ()))


def test_a_condition_of_degree_2_may_part_a_domain() -> None:
    """Where a b > 1, atan a + atan b is atan((a + b)/(1 - a b)), and pi more where a > 0, pi less where a < 0."""
    b = sympy.Symbol("b", real=True)
    expression = sympy.atan(A) + sympy.atan(b) - sympy.atan((A + b) / (1 - A * b)) - sympy.pi
    at = ({P: Fraction(2), A: Fraction(-2), b: Fraction(-2)},)
    where = region_of(expression, setting(samples=at, facts=(A * b - 1,)))
    p = where.field.enter(expression).numerator
    assert not where.regularity.obstacle_of_generators(used(p), analytic=True)
    assert not where.is_zero_nowhere_dense(p)


GUDERMANNIAN = sympy.asin(sympy.tanh(A)) - 2 * sympy.atan(sympy.tanh(A / 2))
"""0, which the algebra does not know."""


def test_an_identity_that_the_algebra_does_not_know_may_be_0_all_over() -> None:
    for e, expected in ((GUDERMANNIAN, False), (GUDERMANNIAN + 1, True)):
        where = region_of(e, setting(-2))
        assert where.is_zero_nowhere_dense(where.field.enter(e).numerator) is expected


@pytest.mark.slow
def test_what_is_said_of_an_undecided_residual_holds_all_balls(monkeypatch) -> None:
    for ball in (arb(0.5, 0.75), arb(-0.5, 0.75), arb(0, 1.25)):
        monkeypatch.setattr("heavytop.features.claims.audit.judge.evaluate", lambda *_, ball=ball: ball)
        (row,) = judge([statement(sympy.exp(GUDERMANNIAN) - 1, formulas=Formulas())], setting(-2))
        assert 1.25 <= float(row.residual.removeprefix("|residual| < ").removesuffix(" at the sample points")) < 1.27


@pytest.mark.parametrize(("rate", "kept"), [(A, True), (A**2, True), (sympy.Integer(1), False), (A / (A - P), False)])
def test_what_the_flow_does_not_keep_may_become_0(rate: sympy.Expr, kept: bool) -> None:
    flow = Flow(lambda e: sympy.diff(e, A) * rate, frozenset({A}))
    where = region_of(A, setting(-2), flow)
    assert where.is_nowhere_zero(where.field.enter(A).numerator) is kept


def test_both_halves_are_asked_what_they_divide_by() -> None:
    """For one sign of t the divisor is |t|; for the other it is |t| (|a| - a), 0 for all a > 0."""
    size = sympy.sqrt(T**2)
    for sign in (1, -1):
        divisor = (size - sign * T) / 2 + (size + sign * T) / 2 * (sympy.sqrt(A**2) - A)
        residual = sympy.Mul(HALVES, 1 / divisor, evaluate=False)
        (row,) = judge([statement(residual, formulas=Formulas(values=(T,)))], setting(-2))
        assert row.holds is None
        assert {c.discharged for c in row.conditions if c.text.startswith("no divisor in the algebra")} == {False}


@pytest.mark.parametrize(("is_relation", "holds"), [(True, None), (False, True)])
def test_a_power_of_a_rate_in_the_ideal_keeps_no_relation(is_relation: bool, holds: bool | None) -> None:
    """a² = 0 forces a = 0 at each point, which does not make a double zero one that stays."""
    flow = Flow(lambda e: sympy.Integer(0), frozenset({A}), is_relation=is_relation)
    (row,) = judge([statement(A, flow)], setting(0, relations=(A**2,)))
    assert row.holds is holds


# --- the structure, the zeros and the context of a claim --------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (sympy.atan(T) + sympy.Rational(3, 2), (0, False)),
        (sympy.atan(T) + sympy.Rational(8, 5), (1, True)),
        (2 * SIN + 1, (0, False)),
        (2 * SIN + 3, (1, True)),
        (sympy.tanh(T) + 2, (1, True)),
    ],
)
def test_a_bounded_function_counts_with_its_bound(expression: sympy.Expr, expected: tuple[int, bool]) -> None:
    value, strict = sign_of(expression)
    assert value == expected[0]
    assert strict <= expected[1]


def test_a_place_is_one_only_where_the_relations_are_proven_to_be_0() -> None:
    for extra, expected in ((0, 1), (Fraction(1, 10**200), 0)):
        relation = sympy.log(A * 6) - sympy.log(2) - sympy.log(3) + sympy.Rational(str(extra))
        at_0 = statement(T, domain=Domain("all", 0, (Fraction(0),)))
        assert len(list(setting(1, relations=(relation,)).sample_points(at_0))) == expected


@pytest.mark.parametrize(("bound", "verdict"), [("a > -1", "refuted"), ("a > 0", "holds")])
def test_what_is_above_a_negative_number_is_not_positive(bound: str, verdict: str) -> None:
    table = integral("(sqrt(a^2) - a)*Omega1", top(), parameters={"a": ["1/2"]}, assume=[bound])
    assert audited(table).verdict == verdict


@pytest.mark.parametrize(
    "claim",
    [
        {"kind": "integral", "integral": {"value": "Omega1*0 + gamma1^2 + gamma2^2 + gamma3^2"}},
        {"kind": "motion", "motion": {"omega": ["0", "0", "0"], "gamma": ["0", "1", "0"]}},
    ],
    ids=["integral", "motion"],
)
def test_what_the_rotor_needs_is_asked_of_the_gyrostat_alone(claim: dict) -> None:
    for about, asked in (("gyrostat", True), ("heavy_top", False)):
        found = audited(claim | {"top": top(rotor="1/a"), "parameters": {"a": "2"}}, about)
        assert ("a ≠ 0" in {c.text for row in found.rows for c in row.conditions}) is asked
