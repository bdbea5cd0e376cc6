"""Claims of stability: against eigenvalues in 40 digits, a Lyapunov function in rationals, and degenerate tops."""

from fractions import Fraction
from itertools import permutations
from random import Random
from typing import Any

import mpmath
import pytest
import sympy

from heavytop.errors import InputError
from heavytop.features.claims.audit.judge import Audit
from heavytop.top.equations import HEAVY_TOP, Parameters
from support.claim_tables import Table, audited, top

AXES = {"I1": ["3", "5/2"], "I2": ["2", "9/4"], "I3": ["3/2", "1"], "w": ["1", "2"]}
ORDERED = ["I1 > I2 > I3", "w != 0"]
UNITS = ("1 0 0", "0 1 0", "0 0 1")
LAGRANGE = {"I1": ["1", "2"], "I3": ["1/2", "1"], "P": ["1", "2"], "c": ["1", "1/2"]}
POSITIVE = ["P > 0", "c > 0"]


def claim(stable: object, assume: list[str], parameters: Table, of: Table, omega: str, gamma: str) -> Table:
    """The claim that a steady motion is stable, or is not."""
    named = {"kind": "stability", "stable": stable, "assume": assume, "parameters": parameters}
    return {**named, "top": of, "motion": {"omega": omega.split(), "gamma": gamma.split()}}


def audit(*args: Any) -> Audit:
    return audited(claim(*args))


def turning(axis: int, stable: bool, assume: list[str] = ORDERED, sign: str = "", **parameters: list[str]) -> Audit:
    """About an axis of a free body, γ along or against Ω."""
    omega, gamma = UNITS[axis].replace("1", "w"), UNITS[axis].replace("1", f"{sign}1")
    return audit(stable, assume, AXES | parameters, top("I1 I2 I3", "0 0 0", "0"), omega, gamma)


def on_axis(stable: bool, assume: list[str], spins: list[str], up: str = "1") -> Audit:
    """Lagrange's top with its axis upright."""
    of = top("I1 I1 I3", "0 0 c", "P")
    return audit(stable, assume, LAGRANGE | {"w": spins}, of, "0 0 w", f"0 0 {up}")


def growth(inertia: list[Fraction], moment: list[Fraction], state: list[Fraction]) -> mpmath.mpf:
    """The largest real part of an eigenvalue of the equations, differentiated by sympy."""
    y = sympy.symbols("y1:7")
    rational = [[sympy.Rational(v.numerator, v.denominator) for v in part] for part in (inertia, moment, state)]
    rates = sympy.Matrix(HEAVY_TOP.field(Parameters(rational[0], rational[1], 0), y))
    jacobian = rates.jacobian(sympy.Matrix(y)).subs(dict(zip(y, rational[2], strict=True)))
    with mpmath.workdps(40):
        values, _ = mpmath.eig(
            mpmath.matrix([[mpmath.mpf(int(v.p)) / int(v.q) for v in row] for row in jacobian.tolist()])
        )
        return max(mpmath.re(value) for value in values)


@pytest.mark.parametrize("sign", ["", "-"])
@pytest.mark.parametrize(("axis", "is_stable"), [(0, True), (1, False), (2, True)])
def test_the_axes_theorem(axis: int, is_stable: bool, sign: str) -> None:
    right, wrong = turning(axis, is_stable, sign=sign), turning(axis, not is_stable, sign=sign)
    assert (right.verdict, wrong.verdict) == ("holds", "refuted")
    assert wrong.rows[-1].witness == {"parameters": {"I1": "3", "I2": "2", "I3": "3/2", "w": "1"}}


@pytest.mark.slow
@pytest.mark.parametrize("order", [*permutations(("I1", "I2", "I3"))])
def test_the_theorem_in_any_order_of_the_axes_is_that_of_the_eigenvalues(order: tuple[str, ...]) -> None:
    draw = Random(str(order))
    moments = sorted((Fraction(draw.randint(40, 60), 30) for _ in range(3)), reverse=True)
    parameters = {name: [str(value)] for name, value in zip(("I1", "I2", "I3"), moments, strict=True)} | {"w": ["-7/3"]}
    inertia = [moments[int(name[1]) - 1] for name in order]
    for axis, unit in enumerate(UNITS):
        state = [Fraction(u) * w for w in (Fraction(-7, 3), 1) for u in unit.split()]
        grows = growth(inertia, [Fraction(0)] * 3, state) > 1e-8
        of = top(" ".join(order), "0 0 0", "0")
        assert audit(not grows, ORDERED, parameters, of, unit.replace("1", "w"), unit).verdict == "holds"
        assert grows == (order[axis] == "I2")


@pytest.mark.parametrize("axis", [0, 2])
def test_a_lyapunov_function_of_the_axes_theorem_is_definite_in_exact_rationals(axis: int) -> None:
    """±(E − a M·γ − κ γ²/2 − c M²/2) + 1000 (C − C0)² of both Casimir functions C, over all six variables."""
    moments, w = [Fraction(3), Fraction(2), Fraction(3, 2)], Fraction(5, 4)
    y = sympy.symbols("y1:7")
    m, gamma = [sympy.Rational(i) * v for i, v in zip(moments, y[:3], strict=True)], y[3:]
    energy = sum(v * k for v, k in zip(m, y[:3], strict=True)) / 2
    area, square, size = (
        sum(a * b for a, b in zip(*pair, strict=True)) for pair in ((m, gamma), (gamma, gamma), (m, m))
    )
    i, spin, sign = sympy.Rational(moments[axis]), sympy.Rational(w), 1 if axis == 0 else -1
    value = energy - sign * spin * area + sign * spin**2 * i * square / 2 - (0 if axis == 0 else size / i)
    value = sign * value + 1000 * ((area - i * spin) ** 2 + (square - 1) ** 2)
    state = {v: spin * int(k == axis) for k, v in enumerate(y[:3])} | {v: int(k == axis) for k, v in enumerate(gamma)}
    assert not any(sympy.diff(value, v).subs(state) for v in y)
    hessian = sympy.hessian(value, y).subs(state)
    assert all(hessian[:n, :n].det() > 0 for n in range(1, 7))


@pytest.mark.slow
def test_the_sleeping_top_at_its_condition_and_beyond() -> None:
    fast, slow = "(I3*w)^2 > 4*I1*P*c", "(I3*w)^2 < 4*I1*P*c"
    assert on_axis(True, [*POSITIVE, fast], ["5", "-7"]).verdict == "holds"
    assert on_axis(False, [*POSITIVE, fast], ["5", "-7"]).verdict == "refuted"
    assert on_axis(True, [*POSITIVE, fast.replace(">", ">=")], ["5", "-7"]).verdict == "undecided"
    assert on_axis(True, [*POSITIVE, fast.replace("4", "399/100")], ["5", "-7"]).verdict == "undecided"
    assert on_axis(False, [*POSITIVE, slow, "w != 0", "2*I1 > I3"], ["1/10", "-1/5"]).verdict == "holds"
    assert on_axis(False, [slow], ["1/10", "0"]).verdict == "holds"
    for wider in (slow.replace("<", "<="), slow.replace("4", "401/100")):
        assert on_axis(False, [*POSITIVE, wider], ["1/10", "-1/5"]).verdict == "undecided"
    assert on_axis(True, [*POSITIVE, slow], ["1/10", "-1/5"]).verdict == "refuted"
    assert on_axis(True, POSITIVE, ["1", "-2"], up="-1").verdict == "holds"
    for stable in (True, False):
        assert audit(stable, [], {}, top("1 1 1", "0 0 1"), "0 0 2", "0 0 1").verdict == "undecided"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "stable", "assume"),
    [
        (0, True, ["I1 > I2 > I3"]),  # w = 0: a push turns it for ever
        (1, False, ["I1 >= I2", "I2 > I3", "w > 0"]),
        (1, False, ["I1 > I2 > I3"]),
        (2, True, ["I1 > I3", "w > 0"]),
        (0, True, []),
    ],
)
def test_a_domain_that_reaches_the_edge_of_the_theorem_is_undecided(axis: int, stable: bool, assume: list[str]) -> None:
    assert turning(axis, stable, assume).verdict == "undecided"


@pytest.mark.slow
def test_about_an_axis_of_the_equator_of_a_symmetric_body_omega_drifts() -> None:
    parameters = {"I1": ["2"], "I3": ["1"], "w": ["1"]}
    for omega, gamma in (("w 0 0", "1 0 0"), ("3*w 4*w 0", "3/5 4/5 0")):
        of = top("I1 I1 I3", "0 0 0", "0")
        assert audit(True, ["I1 > I3", "w > 0"], parameters, of, omega, gamma).verdict == "refuted"
        assert audit(False, ["I1 > I3", "w > 0"], parameters, of, omega, gamma).verdict == "holds"
        assert audit(False, ["w > 0"], parameters, of, omega, gamma).verdict == "undecided"  # a sphere
    for stable, verdict in ((True, "refuted"), (False, "holds")):
        assert audit(stable, [], AXES, top("I1 I2 I3", "0 0 0", "0"), "0 0 0", UNITS[0]).verdict == verdict
    (stability,) = [row for row in turning(0, True, ["I1 >= I2", "I2 > I3", "w > 0"]).rows if row.holds is False]
    witness = {name: Fraction(value) for name, value in stability.witness["parameters"].items()}
    assert witness["I1"] == witness["I2"]


def test_first_of_all_the_motion_has_to_be_constant() -> None:
    for stable in (True, False):
        report = audit(stable, ORDERED, AXES, top("I1 I2 I3", "0 0 0", "0"), "w 0 0", "3/5 0 4/5")
        assert report.verdict == "refuted"
        assert {row.residual for row in report.rows if row.holds is False} == {"-4*w/5"}
        assert report.rows[-1].holds is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_no_verdict_on_a_random_steady_motion_contradicts_its_eigenvalues(seed: int) -> None:
    """Staude's rotations of numbers: P r = ω² I γ + m γ."""
    draw = Random(seed)
    inertia = [Fraction(draw.randint(20, 35), 10) for _ in range(3)]
    gamma = [Fraction(k, 7) * draw.choice((-1, 1)) for k in draw.choice(((2, 3, 6), (0, 7, 0), (7, 0, 0)))]
    w, lever = Fraction(draw.randint(-4, 4), 2), Fraction(draw.randint(-90, 30), 4)
    moment = [(w**2 * i + lever) * g for i, g in zip(inertia, gamma, strict=True)]
    grows = growth(inertia, moment, [*(w * g for g in gamma), *gamma]) > 1e-8
    texts = [" ".join(map(str, part)) for part in (inertia, moment, [w * g for g in gamma], gamma)]
    stable, unstable = (audit(claimed, [], {}, top(*texts[:2]), *texts[2:]).verdict for claimed in (True, False))
    assert (stable == "refuted", unstable == "holds") == (grows, grows)
    assert grows or (stable, unstable) in (("holds", "refuted"), ("undecided", "undecided"))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"stable": None}, "stable must be true or false"),
        ({"kind": "motion"}, "stable must be true or false"),
        ({"motion": {"omega": ["t", "0", "0"], "gamma": ["1", "0", "0"]}}, "constant in time"),
        ({"domain": "t>0"}, "about all times"),
        ({"system": "gyrostat", "top": top("3 2 1", "0 0 0", "0", rotor="1")}, "must be"),
        ({"top": top("3 2 1", "0 0 0", "0", rotor="1")}, "top.rotor is that of a gyrostat"),
        ({"kind": "motion", "stable": None, "system": "heavy_top", "top": top(rotor="1")}, "top.rotor is that"),
        ({"top": top("3 2 1 1/9 0 0", "0 0 0", "0")}, "principal"),
    ],
)
def test_what_a_claim_of_stability_needs(more: Table, said: str) -> None:
    with pytest.raises(InputError, match=said):
        audited(claim(True, [], {}, top("3 2 1", "0 0 0", "0"), UNITS[0], UNITS[0]) | more)
