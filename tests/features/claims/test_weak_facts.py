"""A fact ≥ 0 is not taken for one > 0, and a relation is solved only where the solution is the whole of it."""

import pytest
import sympy

from heavytop.features.claims.algebra.conditions import solve_relations
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import Region
from heavytop.features.claims.algebra.ring import used
from heavytop.features.claims.algebra.signs import Sign
from heavytop.features.claims.algebra.statement import Flow, Setting
from heavytop.features.claims.audit.context import STATE
from support.claim_algebra import SYMBOLS, A, B, C, D, E, P, Q, T, sign_of, statement

UNKNOWN, NONNEGATIVE, POSITIVE = Sign(0, False), Sign(1, False), Sign(1, True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("e", "facts", "weak", "expected"),
    [
        (P * A**2 + Q * B**2, (A**2 + B**2,), (), POSITIVE),
        (P * A**2 + Q * B**4, (A * C + B,), (), POSITIVE),
        (P * A**2 + Q * B**2, (A**2 + C**2,), (), NONNEGATIVE),
        (P * A**2 + Q * B**2 * C**2, (A**2 + B**2,), (), NONNEGATIVE),
        (A, (A**2 * B,), (), Sign(0, True)),
        (B, (A**2 * B,), (), POSITIVE),
        (A, (), (A**2 * B,), UNKNOWN),
        (B, (), (A**2 * B,), UNKNOWN),
        (A, (A + B, A * B), (), POSITIVE),
        (A, (A + B,), (A * B,), UNKNOWN),
        (A - C, (), (A - B, B - C), NONNEGATIVE),
        (A - C, (B - C,), (A - B,), POSITIVE),
        ((A - C) * (B - C) + (D - C) * (E - C), (B - C, E - C), (A - C, D - C), NONNEGATIVE),
        ((A - C) * (B - C) + (D - C) * (E - C), (A - C, B - C, E - C), (D - C,), POSITIVE),
        (A + P**2, (sympy.sqrt(A) + A * B,), (), UNKNOWN),
        (A + P**2, (sympy.sqrt(A) + A * B,), (A,), POSITIVE),
        (1 - sympy.sin(A), (sympy.cos(A),), (), POSITIVE),
        (1 + sympy.cos(A), (sympy.sin(A) * B,), (), POSITIVE),
        (1 - sympy.sin(A), (), (sympy.cos(A),), NONNEGATIVE),
        (1 - 2 * sympy.sin(A), (sympy.cos(A),), (), UNKNOWN),
        (A * B, (4 * P * A * B - C**2,), (), POSITIVE),
        (A * B, (), (4 * P * A * B - C**2,), NONNEGATIVE),
        (A * B, (4 * P * A * B - C,), (), UNKNOWN),
        (C, (C**2 - 4 * P * A * B, A * B), (), Sign(0, True)),
        (sympy.pi / 2 - sympy.atan(P), (), (), POSITIVE),
        (sympy.atan(P) - sympy.pi / 4, (), (), UNKNOWN),
        (sympy.atan(P) + sympy.atan(A) + sympy.pi / 2, (), (), POSITIVE),
    ],
)
def test_a_sign_is_as_strict_as_what_it_follows_from(e, facts, weak, expected):
    assert sign_of(sympy.expand(e), facts=facts, weak=weak) == expected


@pytest.mark.parametrize(("facts", "weak", "expected"), [((A,), (), True), ((), (A,), False), ((), (), False)])
def test_only_what_is_never_0_is_divided_out_of_a_relation(facts, weak, expected):
    known = Assumptions(T, facts=facts, weak=weak, relations=(A * C,), parameters=frozenset(SYMBOLS))
    field = Field(known, [A, C])
    assert field.is_forced(C, radical=False) is expected
    assert field.is_forced(A * C, radical=False)


def test_a_fact_of_the_state_is_not_divided_out_of_a_relation():
    """A motion that starts with it positive may be near one on which it is 0."""
    field = Field(Assumptions(T, facts=(A,), relations=(A * C,), parameters=frozenset((C,))), [A, C])
    assert not field.is_forced(C, radical=False)


def test_a_parameter_that_may_be_0_parts_a_proof_in_two():
    parameters = frozenset(SYMBOLS)
    for relations, forced in (
        ((A * B, B - A * C), True),
        ((A * B,), False),
        ((A * B, A * C), False),
        ((A**2 + A * B,), False),
    ):
        field = Field(Assumptions(T, relations=relations, parameters=parameters), [A, B, C])
        assert field.is_forced(B, radical=True) is forced, relations


@pytest.mark.parametrize(
    ("relation", "known", "symbol", "value"),
    [
        (A**3 - 1, {}, A, 1),
        (P**2 - 4, {}, P, 2),
        (P**3 - P, {}, P, 1),
        (A**3 - B**3, {}, B, A),
        (P**2 - Q**2, {}, Q, P),
        (A**5 + B**5, {}, B, -A),
        (A**2 + P**2 - 1, {}, P, sympy.sqrt(1 - A**2)),
        (P * B - 1, {}, B, 1 / P),
        (A * B + C, {}, C, -A * B),
        (A**2 + B**2 - 1, {"facts": (B,)}, B, sympy.sqrt(1 - A**2)),
        ((A**2 + B**2 + 1) * (C - 1), {}, C, 1),
        ((A**2 + 2 * B**2) * A, {}, A, 0),
        (A**2 - 1, {}, None, None),
        (A**3 - A, {}, None, None),
        (A**2 - B**2, {}, None, None),
        (A**4 - B**4, {}, None, None),
        ((A - B + C) * (A**2 + A * B + B**2), {}, None, None),
        ((A - B) * (A**2 + C**2), {}, None, None),
        ((A**2 + B**2) * (C - 1), {}, None, None),
        (A**2 + B**2 - 1, {"weak": (B,)}, None, None),
        (A * B - 1, {}, None, None),
        (A * B + C * D, {}, None, None),
        (B - sympy.sqrt(B + 3), {}, None, None),
        ((A**2 - 2 * B**2) * A, {}, None, None),
    ],
)
def test_a_relation_is_solved_where_the_solution_is_the_whole_of_it(relation, known, symbol, value):
    found = solve_relations([relation], Assumptions(T, (P, Q), **known), [*SYMBOLS, P, Q])
    assert [solution.symbol for solution in found] == ([] if symbol is None else [symbol])
    assert all(sympy.simplify(solution.value - value) == 0 for solution in found)


@pytest.mark.parametrize(
    ("facts", "weak", "relations", "connected"),
    [
        ((), (), (), True),
        ((A,), (), (), True),
        ((STATE[3],), (), (), False),
        ((), (STATE[4] - A,), (), False),
        ((STATE[0],), (), (), True),
        ((STATE[0] - STATE[3],), (), (), False),
        ((STATE[0] ** 2 - 1,), (), (), True),
        ((), (), (STATE[0] * STATE[1],), True),
        ((), (), (STATE[0] - STATE[3],), False),
    ],
)
def test_the_unit_sphere_is_connected_where_nothing_cuts_it(facts, weak, relations, connected):
    """Asked of gamma: what bounds Omega alone has nothing to do with it."""
    sphere = sum(x**2 for x in STATE[3:]) - 1
    known = Assumptions(T, facts=facts, weak=weak, relations=(*relations, sphere))
    field = Field(known, STATE)
    flow = Flow(lambda e: sympy.Integer(0), frozenset(STATE), always=(sphere,))
    region = Region(field, Setting(T), statement(STATE[3], flow), [])
    assert region.is_connected(used(field.enter(STATE[3] + STATE[4]).numerator)) is connected
