"""The verdicts on the paper's claims, and what the audit makes of planted mistakes."""

from fractions import Fraction
from functools import cache

import pytest
import sympy

from heavytop.errors import InputError
from heavytop.exact.flint.balls import FUNCTIONS, ball, working_precision
from heavytop.features.claims.audit.audit import audit, only_branch
from heavytop.features.claims.audit.judge import Audit, StatementVerdict, judge
from heavytop.features.claims.library import ershkov, ershkov_general
from heavytop.features.claims.library.ershkov_audit import GeneralClaim, PartialClaim
from heavytop.top.equations import GYROSTAT, HEAVY_TOP


@cache
def report(name: str, system: str = "heavy_top") -> Audit:
    return audit(name, system)


def rows(found: Audit, equation: str, branch: str = "smooth", domain: str = "all") -> dict[int, StatementVerdict]:
    chosen = [r for r in found.rows if (r.equation, r.branch, r.domain) == (equation, branch, domain)]
    assert chosen, f"no row for {equation} {branch} {domain}"
    return {row.component: row for row in chosen}


SMOOTH, UP_TO_0, AFTER_0 = ("smooth", "all"), ("printed", "t<=0"), ("printed", "t>0")
# + of a component that holds, − of one that is refuted
VERDICTS = {
    # where the roots follow the flow, (1.2) alone fails, and ψ is a line
    ("ershkov-partial", SMOOTH): {"1.1": "+++", "1.2": "-+-", "1.3": "+++", "3.1": "+-+", "4.6": "++"},
    ("ershkov-partial", UP_TO_0): {"1.1": "+++", "1.2": "-+-", "1.3": "+++", "3.1": "+-+", "4.5": "+++", "4.6": "++"},
    # after 0 the printed roots fail everywhere, the arctan of (4.5) loses its quadrant, and ψ breaks
    ("ershkov-partial", AFTER_0): {"1.1": "---", "1.2": "---", "1.3": "+++", "4.5": "-++", "4.6": "-"},
    ("ershkov-general", SMOOTH): {
        **{"1.1": "+++", "1.2": "-+-", "1.3": "+++", "3.1": "+-+"},
        **{"2.2": "+", "2.3": "+", "2.4": "+"},
    },
    # with positive roots it holds only where Ω2 falls
    ("ershkov-general", UP_TO_0): {"1.1": "+++"},
    ("ershkov-general", AFTER_0): {"1.1": "---"},
}
RESIDUALS = {"ershkov-partial": "k/2", "ershkov-general": "P*b/C0"}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "place"), VERDICTS)
def test_each_equation_has_its_verdict_in_each_component(name: str, place: tuple[str, str]) -> None:
    found = report(name)
    for equation, expected in VERDICTS[name, place].items():
        verdicts = [row.holds for _, row in sorted(rows(found, equation, *place).items())]
        assert verdicts[: len(expected)] == [sign == "+" for sign in expected], equation
    if VERDICTS[name, place].get("1.2") == "-+-":
        residuals = [rows(found, "1.2", *place)[component].residual for component in (1, 3)]
        assert residuals == [f"-({RESIDUALS[name]})*gamma3", f"({RESIDUALS[name]})*gamma1"]
        assert name == "ershkov-general" or rows(found, "3.1", *place)[2].residual == "-k/2"
    if (name, place) == ("ershkov-general", AFTER_0):
        assert "Omega2' > 0" in rows(found, "1.1", *place)[1].note


@pytest.mark.slow
def test_everything_holds_on_the_smooth_branch_of_the_gyrostat():
    smooth = only_branch(report("ershkov-partial", "gyrostat"), "smooth")
    assert smooth.verdict == "holds"
    assert smooth.exit_code == 0
    # the general case takes long: its smooth branch alone is audited
    claim = GeneralClaim()
    general = judge([each for each in claim.statements(GYROSTAT) if each.branch == "smooth"], claim.setting)
    assert all(row.holds for row in general)
    for rows_of in (smooth.rows, general):
        assert {row.equation for row in rows_of} >= {"1.1", "1.2", "1.3", "3.1"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ershkov-partial", "ershkov-general"])
def test_the_reason_is_proven_and_the_system_that_is_solved_is_named(name):
    found = report(name)
    assert found.solves == ("gyrostat",)
    assert all(finding.holds for finding in found.why)
    assert any("det(gamma, M, r)" in finding.statement for finding in found.why)
    assert (found.verdict, found.exit_code) == ("refuted", 1)


@pytest.mark.slow
def test_the_papers_angles_list_their_pole_as_removable():
    for system in ("heavy_top", "gyrostat"):
        rows = [row for row in report("ershkov-partial", system).rows if row.equation in ("3.1", "4.5", "4.6", "6.1")]
        assert rows
        for row in rows:
            poles = [c for c in row.conditions if c.text == "t ≠ 0 (pole of the angles)"]
            assert [(c.discharged, c.reason) for c in poles] == [(True, "removable in gamma")]


def test_the_json_has_the_keys_that_scripts_read():
    document = report("ershkov-partial").to_json()
    assert document.keys() >= {"claim", "system", "verdict", "equations"}
    for row in document["equations"]:
        assert row.keys() >= {"equation", "component", "branch", "domain", "holds", "residual"}
        assert row["branch"] in ("smooth", "printed")
        assert row["domain"] in ("all", "t<=0", "t>0")
        assert (row["holds"] is False) == ("witness" in row)


def test_every_witness_is_confirmed_by_an_independent_evaluation_of_1_2():
    # the residual of (1.2) 1, by differences of the printed formulas in balls, at the witness of the audit
    witness = rows(report("ershkov-partial"), "1.2")[1].witness
    assert witness is not None
    i1, i3, alpha = (Fraction(witness["parameters"][name]) for name in ("I1", "I3", "alpha"))
    time, step = Fraction(witness["t"]), Fraction(1, 10**20)

    def values(t: Fraction) -> ershkov.Values:
        c1 = alpha**2 * i1**2 / (2 * i3)
        return ershkov.partial_case(ball(i1), ball(i3), ball(c1), ball(t), FUNCTIONS)

    with working_precision(300):
        here, before, after = values(time), values(time - step), values(time + step)
        rate = (after.gamma[0] - before.gamma[0]) / ball(2 * step)
        residual = rate - (here.omega[2] * here.gamma[1] - here.omega[1] * here.gamma[2])
        assert abs(residual - ball(Fraction(witness["value"]))) < 1e-18
        assert not ball(Fraction(witness["value"])).contains(0)


def _lost_term_in_2_4(c, omega2):
    linear = 2 * c.weight * c.inertia[2] * c.b * c.inertia[1] / (c.c0 * c.inertia[0] * (c.inertia[0] - c.inertia[2]))
    return ershkov_general.omega1_squared(c, omega2) - linear * omega2


TINY = sympy.Rational(1, 10**12)
OF_MOTION = {"1.1", "1.2", "1.3", "3.1"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("claim", "equation"),
    [
        (GeneralClaim(omega1_squared=_lost_term_in_2_4), "2.4"),
        (PartialClaim(omega1=lambda c, omega2, lib: lib.sqrt((c.alpha + TINY) * omega2 - omega2**2)), "4.3"),
        (PartialClaim(omega3=lambda c, *rest: ershkov.omega3(c._replace(i1=c.i3, i3=c.i1), *rest)), "4.4"),
        (PartialClaim(psi=lambda *given: ershkov.psi(*given) + TINY * given[4]), "4.6"),
    ],
)
def test_a_planted_mistake_is_refuted_in_its_own_equation_and_in_no_other_step(claim, equation):
    # what does not hold without the mistake says nothing of it, nor what any mistake may break, as the equations of
    # motion; the general case takes long: its smooth branch
    rows_without = zip(claim.statements(HEAVY_TOP), report(claim.name).rows, strict=True)
    held = [(statement, row) for statement, row in rows_without if row.holds and row.equation not in OF_MOTION]
    if isinstance(claim, GeneralClaim):
        held = [(statement, row) for statement, row in held if row.branch == "smooth"]
    found = judge([statement for statement, _ in held], claim.setting)
    broken = {before.equation for row, (_, before) in zip(found, held, strict=True) if not row.holds}
    assert all(row.equation == before.equation for row, (_, before) in zip(found, held, strict=True))
    assert equation in broken
    assert broken <= {equation} | ({"4.5", "4.6"} if equation == "4.4" else set())
    if equation in ("2.4", "4.4"):
        of_equation = [row for row in report(claim.name).rows if row.equation == equation]
        assert all(row.holds for row in of_equation), "or the next line would not see them all"
        assert all(row.holds is False for row in found if row.equation == equation)


@pytest.mark.slow
def test_samples_of_the_general_case_lie_where_both_roots_are_real():
    claim = GeneralClaim()
    for statement in claim.statements(HEAVY_TOP):
        for sample in claim.setting.samples:
            for omega2 in statement.domain.points:
                values = {str(symbol): number for symbol, number in sample.items()}
                c = ershkov_general.GeneralConstants(
                    (values["I1"], values["I2"], values["I3"]), values["P"], values["b"], values["C0"], values["C1"]
                )
                assert ershkov_general.f1(c, omega2) > 0
                assert ershkov_general.f2(c, omega2) > 0


def test_unknown_names_are_refused():
    for arguments in (("ershkov",), ("ershkov-partial", "pendulum")):
        with pytest.raises(InputError):
            audit(*arguments)
    with pytest.raises(InputError):
        only_branch(report("ershkov-partial"), "rough")
