"""A claim is about bodies: a top that does not change, |γ| = 1, moments that a body has; all else is said by name."""

from fractions import Fraction

import pytest
import sympy

from heavytop.errors import InputError
from heavytop.features.claims.algebra.fields import Field
from heavytop.features.claims.algebra.prover import Region
from heavytop.features.claims.algebra.statement import ALL, Flow, Formulas, Setting, Statement
from heavytop.features.claims.audit.context import STATE, TIME
from support.claim_tables import Table, audited, open_conditions, top, upright
from support.claim_tables import integral as integral_of

ENERGY = "((2*Omega1^2 + 3*Omega2^2 + 4*Omega3^2)/2 + gamma1 + 2*gamma2 + 3*gamma3)"
AREA = "(2*Omega1*gamma1 + 3*Omega2*gamma2 + 4*Omega3*gamma3)"
MOMENTUM = "(4*Omega1^2 + 9*Omega2^2 + 16*Omega3^2)"
G = "(gamma1^2 + gamma2^2 + gamma3^2)"


def integral(value: str, *, of: Table | None = None, **parts) -> Table:
    """The claim that a value is constant along the motions of a top without symmetry, changed in some of its data."""
    return integral_of(value, top("2 3 4", "1 2 3") | (of or {}), **parts)


def spinning(changes: Table, rate: str = "1") -> Table:
    return upright(rate, top("2 2 3", "0 0 1") | changes)


# --- a top that moves -------------------------------------------------------------------------------------------------


def _part(name: str, formula: str) -> Table:
    return {
        "centre": {"centre": ["0", "0", formula]},
        "weight": {"weight": formula},
        "inertia": {"inertia": ["2", "2", f"3 + ({formula})^2"]},
    }[name]


@pytest.mark.parametrize("part", ["centre", "weight", "inertia"])
@pytest.mark.parametrize("depth", [0, 3])
@pytest.mark.parametrize("moving", ["t", "t/t", "2 - gamma3"])
def test_the_data_of_a_top_that_move_are_refused_however_deep_they_are_hidden(part, depth, moving):
    formula, definitions = moving, {}
    for index in range(depth):
        definitions[f"d{index}"], formula = f"2*({formula}) + 1", f"d{index}"
    is_motion = "t" in moving
    table = spinning(_part(part, formula)) if is_motion else integral("1", of=_part(part, formula))
    with pytest.raises(InputError, match=rf"top\.{part}: .* depends on {'t' if is_motion else '(Omega1|gamma3)'}"):
        audited(table | {"definitions": definitions})


@pytest.mark.parametrize("about", ["heavy_top", "gyrostat"])
@pytest.mark.parametrize("moving", ["t", "sqrt(t^2)/t", "1 + exp(-t^2)"])
def test_a_rotor_that_changes_in_time_is_refused(about, moving):
    with pytest.raises(InputError, match="not shown to be constant"):
        audited(spinning({"rotor": moving}), about)


@pytest.mark.parametrize("rotor", ["Omega2", f"{AREA} + gamma1", ENERGY, f"1/({MOMENTUM} + Omega1)"])
def test_a_rotor_that_the_gyrostat_changes_is_refused(rotor):
    with pytest.raises(InputError, match="not shown to be constant"):
        audited(integral("1", of={"rotor": rotor}), "gyrostat")


@pytest.mark.slow
@pytest.mark.parametrize("rotor", ["2", f"1/{AREA}", MOMENTUM, f"2*{AREA} - 1/3"])
def test_a_rotor_that_is_a_first_integral_of_the_gyrostat_is_one(rotor):
    for value, verdict in ((f"{MOMENTUM} + {AREA}", "holds"), (f"{MOMENTUM} + Omega1", "refuted")):
        assert audited(integral(value, of={"rotor": rotor}), "gyrostat").verdict == verdict


def test_a_rotor_of_a_motion_may_be_written_with_the_time():
    """λ = P b/(M·γ) along the motion of (4.2)-(4.6): tanh² + sech² of the time is 1."""
    moving = spinning({"rotor": "2*(tanh(t)^2 + 1/cosh(t)^2)", "centre": ["0", "0", "0"]})
    assert audited(moving, "gyrostat").verdict == audited(spinning({"rotor": "2"}), "gyrostat").verdict


def test_a_rotor_that_jumps_is_no_constant_one():
    report = audited(integral(AREA, of={"rotor": "sqrt(gamma2^2)/gamma2"}), "gyrostat")
    assert report.verdict == "undecided"
    assert "gamma2" in open_conditions(report)


@pytest.mark.parametrize("relation", ["t", "a - t", "Omega1 - 1", "a*gamma2", "d"])
def test_a_relation_is_between_parameters(relation):
    is_motion = "t" in relation
    table = (upright("1") if is_motion else integral("Omega1")) | {"parameters": {"a": "1"}, "relations": [relation]}
    table["definitions"] = {"d": "t^2" if is_motion else "Omega3^2"}
    with pytest.raises(InputError, match=r"relations: .* depends on"):
        audited(table)


# --- off the unit sphere ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gamma", "size"), [("0 0 2", "4"), ("1/2 1/2 1/2", "3/4")])
def test_a_state_off_the_unit_sphere_is_refused_by_name(gamma, size):
    with pytest.raises(InputError, match=rf"State 2 of \[integral\] has \|gamma\|\^2 = {size}, not 1"):
        audited(integral("Omega1", states=["1 2 3 3/5 0 4/5", f"1 2 3 {gamma}"]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "parts", "named"),
    [
        (f"{ENERGY}/({G} - 1)", {}, "it is 0 where |gamma| = 1"),
        (f"{ENERGY} + 0/({G}^2 - 1)", {}, "it is 0 where |gamma| = 1"),
        (f"sqrt({G} - 2)", {}, "it is -1 where |gamma| = 1"),
        (f"{AREA} + sqrt(1/2 - {G})", {}, "it is -1/2 where |gamma| = 1"),
        (f"log({G} - 1) + {AREA}", {}, "it is 0 where |gamma| = 1"),
        (f"asin({G} + 1/7)", {}, "where |gamma| = 1"),
        (f"{ENERGY}/(sqrt({G}) - 1)", {}, "at every sample"),
        # relations that no body meets
        (f"{G} - 4", {"kind": "relation"}, "exclude each other within |gamma| = 1"),
        ("1", {"where": [f"{G} - 4"]}, "exclude each other within |gamma| = 1"),
        *((text, {"kind": "relation"}, "") for text in (f"sqrt({G}) - 2", f"{G} + {AREA}^2", "gamma1 - 2")),
        (f"gamma1^2 + {G} + 1", {"kind": "relation"}, ""),
        # a quotient keeps its sign only where its divisor does
        (f"sqrt({ENERGY}/Omega1)^2*Omega1", {}, "not shown"),
        (f"exp(log({AREA}*gamma2))/gamma2", {}, "not shown"),
        (f"sqrt({AREA}/(Omega1*gamma2))^2*Omega1*gamma2", {}, "not shown"),
    ],
)
def test_what_no_state_of_a_body_meets_or_defines_is_undecided_and_said(value, parts, named):
    report = audited(integral(value, **parts))
    assert report.verdict == "undecided"
    assert named in open_conditions(report)


@pytest.mark.parametrize(
    "value",
    [
        f"{ENERGY} + Omega1*({G} - 1)",
        f"{AREA}*{G}^3 + gamma2*(2*{G} - 2)^2",
        f"{AREA} + Omega1*(sqrt({G}) - 1)",
        f"exp({ENERGY} + Omega2*gamma1*({G} - 1))",
        f"{ENERGY}/(1 + Omega1*({G} - 1))",
    ],
)
def test_what_is_constant_on_the_unit_sphere_holds(value):
    assert audited(integral(value)).verdict == "holds"


@pytest.mark.slow
def test_what_is_constant_off_the_unit_sphere_alone_is_refuted_on_it():
    for value in (f"{ENERGY} + Omega1*({G} - 4)", f"{AREA}*(1 + Omega3*({G} - 1/2))"):
        (row,) = audited(integral(value)).rows
        assert row.holds is False
        assert sum(Fraction(row.witness["parameters"][f"gamma{axis}"]) ** 2 for axis in (1, 2, 3)) == 1


# --- moments, and assumptions that nothing meets ----------------------------------------------------------------------


def of_moments(**samples) -> Table:
    return integral("Omega1", of=top("a b c", "1 2 3"), parameters={"a": "1", "b": "1", **samples})


@pytest.mark.slow
def test_a_witness_has_the_moments_of_a_body():
    assert audited(of_moments(c="2")).verdict == "refuted"  # flat, and a body
    (row,) = audited(of_moments(c=f"2.{1:030}")).rows  # at moments near those of no body
    a, b, c = (Fraction(row.witness["parameters"][name]) for name in "abc")
    assert (row.holds, c <= a + b) == (False, True)
    report = audited(of_moments(c="5"))
    assert report.verdict == "undecided"
    assert "no body has such moments" in open_conditions(report)
    (row,) = audited(of_moments(c=["5", "3/2", "7"], a=["1"] * 3)).rows
    assert (row.holds, row.witness["parameters"]["c"]) == (False, "3/2")


def test_a_claim_about_one_top_is_judged_about_that_top():
    assert audited(integral("Omega1", of=top("1 1 5", "1 2 3"))).verdict == "refuted"


@pytest.mark.parametrize(
    ("assume", "relations"),
    [
        *((assume, []) for assume in (["a > 1", "a < 0"], ["a > b", "b > a"], ["0 > 1"], ["a^2 < 0"])),
        (["a > 0"], ["a + 1"]),
        *(([], relations) for relations in (["a^2 + 1"], ["a - 1", "a - 2"], ["a - b", "a - b - 1"])),
    ],
)
def test_assumptions_and_relations_that_contradict_each_other_prove_nothing(assume, relations):
    for sample in ("2", "1", "-1"):
        parameters = {"a": sample, "b": "1"}
        with pytest.raises(InputError, match=r"violates the (assumption|relation)"):
            audited(integral("Omega1", assume=assume, relations=relations, parameters=parameters))


@pytest.mark.parametrize(
    ("inertia", "parameters", "cause", "is_curable"),
    [
        ("4*C -C C", {"C": "1"}, "I2 = -C of top.inertia must be positive; it is -1 at the sample C = 1.", False),
        ("-2 1 1", {}, "I1 = -2 of top.inertia must be positive.", False),
        ("C-D D-C C", {"C": "2", "D": "1"}, "I2 = -C + D of top.inertia must be positive; it is -1", False),
        ("C C-5 C", {"C": "2"}, "I2 = C - 5 of top.inertia must be positive; it is -3 at the sample", True),
        ("C sqrt(C)-5 C", {"C": "2"}, "it is -3.58579 at the sample C = 2.", True),
        ("1 1 1 D 0 0", {"D": "2"}, "principal minor 1 - D^2 of top.inertia must be positive", True),
        ("1 -D^2 1", {"D": "2"}, "I2 = -D^2 of top.inertia must be positive; it is -4", False),
    ],
)
def test_a_moment_that_is_not_positive_is_told_with_its_value_and_what_cures_it(inertia, parameters, cause, is_curable):
    with pytest.raises(InputError) as error:
        audited(integral("Omega1", of=top(inertia, "1 2 3"), parameters=parameters))
    assert cause in str(error.value)
    assert ("Change the sample" in error.value.remedy) is is_curable


@pytest.mark.parametrize("name", ["t", "Omega2", "gamma1", "pi", "sin", "atan2"])
@pytest.mark.parametrize("table", ["parameters", "definitions"])
def test_a_name_that_is_taken_is_refused(name, table):
    with pytest.raises(InputError, match="is reserved"):
        audited(integral("Omega1") | {table: {name: "1"}})


# --- conditions that the flow leaves ----------------------------------------------------------------------------------

PLANE = ("Omega2", "Omega3", "gamma1")
"""Pendulum motions about axis 1, of a top with its centre on axis 3: an invariant plane."""


@pytest.mark.slow
@pytest.mark.parametrize("u", ["Omega1", "(Omega1*gamma3)"])
@pytest.mark.parametrize("half", ["sqrt({0}^2) - {0}", "sqrt({0}^2 + 3*gamma1^2)*2 + 2*{0}"])
def test_half_an_invariant_plane_is_left_where_its_rate_is_divided_by_0(u, half):
    of = top("2 3 4", "0 0 1")
    report = audited(integral("gamma1^2 + 1", of=of, where=[*PLANE, half.format(u)]))
    assert report.verdict == "undecided"
    assert "is divided by" in open_conditions(report)
    assert audited(integral("gamma1^2 + 1", of=of, where=PLANE)).verdict == "holds"


def test_half_a_plane_that_the_flow_keeps_is_one():
    """Ω3 of a symmetric top rests: where it is not negative at first, it stays so."""
    report = audited(integral("Omega3", of=top("2 2 1", "0 0 1"), where=["sqrt(1 + Omega3^2) - 2"]))
    assert "is divided by" not in open_conditions(report)


@pytest.mark.slow
@pytest.mark.parametrize(
    "value",
    [
        "{0} + 0*sqrt({1}^2*({1}^2 - 2)) + Omega1*(1 - sqrt(({1}^2 - 2)^2)/({1}^2 - 2))",
        "Omega1*(sqrt(({1}^2 - 2)^2) - {1}^2 + 2) + 0*sqrt({1}^4*({1}^2 - 2))",
    ],
)
def test_a_radicand_is_0_where_a_factor_of_it_is_whatever_the_sign_of_the_other(value):
    """M·γ = 0 is kept, and there the other factor is negative."""
    assert audited(integral(value.format(ENERGY, AREA), states=["1 2 1 3/5 0 4/5"])).verdict != "holds"


def test_what_is_0_all_over_the_unit_sphere_is_0_on_no_thin_set():
    """A divisor may be 0 on a set without interior, of the states with |γ| = 1."""
    off = sum(x**2 for x in STATE[3:]) - 1
    flow = Flow(lambda e: sympy.Integer(0), frozenset(STATE), always=(off,))
    statement = Statement("", 1, "", ALL, off, "", Formulas(), flow)
    setting = Setting(TIME)
    field = Field(setting.assumptions(0), [off, STATE[0]])
    region = Region(field, setting, statement, [])
    assert not region.is_zero_nowhere_dense(field.enter(off).numerator)
    assert region.is_zero_nowhere_dense(field.enter(off + 1).numerator)
    assert region.is_zero_nowhere_dense(field.enter(STATE[0]).numerator)
