"""Claims of kind `value`: published numbers, against numbers that are known otherwise."""

import json
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import mpmath
import pytest

from heavytop.errors import InputError
from heavytop.features.claims.audit import audit as auditing
from heavytop.features.claims.audit.audit import audit, claim_from_table
from heavytop.features.claims.audit.judge import Audit, StatementVerdict
from heavytop.features.claims.audit.values import PrintedNumber, ValueClaim
from heavytop.features.claims.kinds.audit import AuditTable
from heavytop.features.claims.library import entry as entries
from heavytop.features.claims.text import audit_text
from heavytop.features.kinds import KINDS
from heavytop.harness.checkpoint import Saved
from heavytop.precision import cross, exact
from support.claim_tables import audited, top
from support.full_tensor import integrate
from support.helpers import shown
from support.in_process import heavytop

TOP = top("3 2 1", "1/2 1/3 1/5")
START = {"omega": ["1/10", "2/5", "9/10"], "gamma": ["3/5", "0", "4/5"]}
UPRIGHT = top("2 2 1", "0 0 1/2", "3")
"""Turning about the vertical, its axis of symmetry: q = (cos wt/2, 0, 0, sin wt/2)."""


def claim(values: list[dict[str, Any]], **changes: Any) -> dict[str, Any]:
    return {"name": "x", "kind": "value", "top": TOP, "start": START, "value": values} | changes


def judged(values: list[dict[str, Any]], about: str = "", **changes: Any) -> Audit:
    return audited(claim(values, **changes), about)


def one(quantity: str, component: int, number: str, time: str = "0", **more: str) -> dict[str, Any]:
    return {"quantity": quantity, "component": component, "number": number, "time": time} | more


def figures(row: StatementVerdict) -> dict[str, Any]:
    assert row.figures is not None
    return dict(row.figures)


@pytest.mark.parametrize(
    ("text", "value", "unit", "digits"),
    [
        ("0.450", "9/20", "1/1000", 3),
        ("-12", "-12", "1", 2),
        ("1500", "1500", "1", 4),
        ("+.5e-3", "1/2000", "1/10000", 1),
        ("1.20E2", "120", "1", 3),
        ("0.1D+01", "1", "1", 1),
        ("0.000", "0", "1/1000", 4),
        ("007", "7", "1", 1),
        ("\N{MINUS SIGN}0.50", "-1/2", "1/100", 2),
        ("3.", "3", "1", 1),
    ],
)
def test_a_printed_number_has_the_digits_that_are_written(text: str, value: str, unit: str, digits: int) -> None:
    found = PrintedNumber.read(text, "x")
    assert (found.value, found.unit, found.digits) == (Fraction(value), Fraction(unit), digits)


@pytest.mark.parametrize(
    "text", ["", ".", "1/3", "nan", "inf", "1e", "1 2", "0x1p3", "--1", "1e99999", "1" * 1001, "١"]
)
def test_what_is_no_decimal_number_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        PrintedNumber.read(text, "x")


def test_digits_right_are_those_that_half_a_unit_of_each_covers() -> None:
    number, errors = PrintedNumber.read("1.234", "x"), ("0.0005", "0.00051", "0.005", "0.0051", "0.4", "0.5", "0.6")
    assert [number.right(Fraction(error)) for error in errors] == [4, 3, 3, 2, 1, 1, 0]


def test_random_numbers_of_a_turning_top_get_the_verdict_that_their_cosine_gives() -> None:
    """q of a top that turns upright is elementary; numbers of 1 to 30 digits are off by random amounts."""
    random, lib = Random(30), mpmath.MPContext()
    lib.prec = 400
    given = {}
    for _ in range(120):
        time = Fraction(random.randint(-5000, 5000), random.choice((7, 100, 1)))
        angle = lib.mpf(3 * time.numerator) / (7 * time.denominator) / 2
        component = random.choice((1, 4))
        true = lib.cos(angle) if component == 1 else lib.sin(angle)
        digits = random.randint(1, 30)
        near = true + lib.mpf(10) ** (-random.randint(1, 32)) * random.choice((0, 1, -1)) * random.random()
        text = lib.nstr(near, digits, strip_zeros=False)
        number = PrintedNumber.read(text, "x")
        # of either sign: one component alone does not fix it
        exact = Fraction(*(int(part) for part in (lib.nint(true * lib.mpf(2) ** 380), 2**380)))
        off = min(abs(number.value - exact), abs(number.value + exact))
        given[time] = one("quaternion", component, text, str(time)), off, number
    start = {"omega": ["0", "0", "3/7"], "quaternion": ["1", "0", "0", "0"]}
    report = judged([value for value, *_ in given.values()], top=UPRIGHT, start=start)
    verdicts = set()
    for row, (_, off, number) in zip(report.rows, given.values(), strict=True):
        assert row.holds is (off <= number.half_unit)
        assert figures(row)["digits_right"] == number.right(off)
        verdicts.add(row.holds)
    assert verdicts == {True, False}


TENSOR = [["1.5", "0.1", "-0.2"], ["0.1", "1.2", "0.05"], ["-0.2", "0.05", "0.9"]]
TENSOR_BODY = {
    "mass": "2",
    "gravity": "9.81",
    "centre": ["0.1", "-0.2", "0.3"],
    "inertia": [part for row in TENSOR for part in row],
    "about": "pivot",
    "rotor": ["0.3", "-0.1", "0.7"],
}
TURNED = {"omega": ["0.5", "-0.25", "1.5"], "euler": "ZXZ:30deg,0.4,1"}


def integrated(time: str) -> dict[str, list[str]]:
    """The motion of :data:`TENSOR_BODY` by Taylor series of a rotation matrix, to 22 digits."""
    lib = mpmath.MPContext()
    lib.dps = 30

    def turn(angle: Any, axis: int) -> Any:
        matrix, i, j = lib.eye(3), (axis + 1) % 3, (axis + 2) % 3
        matrix[i, i] = matrix[j, j] = lib.cos(angle)
        matrix[j, i], matrix[i, j] = lib.sin(angle), -lib.sin(angle)
        return matrix

    begun = turn(lib.pi / 6, 2) * turn(lib.mpf("0.4"), 0) * turn(lib.mpf(1), 2)
    axes = [[exact(begun[i, j]) for j in range(3)] for i in range(3)]
    centre, rotor = ([Fraction(part) for part in TENSOR_BODY[key]] for key in ("centre", "rotor"))
    pull = [2 * Fraction("9.81") * part for part in centre]
    found = integrate(TENSOR, pull, rotor, axes, TURNED["omega"], Fraction(time))
    omega, gamma, xi = found[:3], found[3:6], found[6:]
    r = (xi, cross(gamma, xi), gamma)
    w = lib.sqrt(sum((r[i][i] for i in range(3)), Fraction(1))) / 2
    momentum = [sum(Fraction(a) * b for a, b in zip(row, omega, strict=True)) for row in TENSOR]
    values = {
        "omega": omega,
        "gamma": gamma,
        "quaternion": [w, *(lib.convert(r[i - 1][i - 2] - r[i - 2][i - 1]) / (4 * w) for i in range(3))],
        "position": [dot(row, centre) for row in r],
        "energy": [dot(momentum, omega) / 2 + dot(pull, gamma)],
        "area": [dot([a + b for a, b in zip(momentum, rotor, strict=True)], gamma)],
    }
    return {
        name: [lib.nstr(lib.convert(part), 22, strip_zeros=False) for part in parts] for name, parts in values.items()
    }


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


@pytest.mark.slow
def test_a_full_tensor_with_a_rotor_from_euler_angles_agrees_with_mpmath() -> None:
    """22 digits of mpmath's integration of other equations, every quantity, and each again with a digit changed."""
    known = integrated("0.5")
    right = [one(name, place, text, "0.5") for name, texts in known.items() for place, text in enumerate(texts, 1)]
    report = judged(right, top=None, body=TENSOR_BODY, start=TURNED)
    assert report.system == "heavy_gyrostat"
    assert report.verdict == "holds", [row.residual for row in report.rows]
    assert all(figures(row)["digits_right"] == figures(row)["digits_printed"] for row in report.rows)
    # the eighth digit from the end one higher, or 0 in place of 9
    texts = [value["number"] for value in right]
    others = [text[:-8] + str((int(text[-8]) + 1) % 10) + text[-7:] for text in texts]
    wrong = [value | {"number": text} for value, text in zip(right, others, strict=True)]
    for row in judged(wrong, top=None, body=TENSOR_BODY, start=TURNED).rows:
        assert row.holds is False
        assert row.witness is not None
        assert abs(Fraction(row.witness["value"])) > Fraction(row.witness["radius"])


def test_rational_numbers_at_the_start_are_decided_even_where_half_a_unit_is_met_exactly() -> None:
    values = [one("omega", 1, "0.1"), one("gamma", 1, "0.6"), one("gamma", 3, "0.75"), one("gamma", 2, "0.0")]
    rows = judged([*values, one("omega", 2, "0.45")]).rows
    assert [row.holds for row in rows] == [True, True, False, True, False]
    for number, tolerance, verdict in (
        ("0.65", {}, "refuted"),
        ("0.65", {"tolerance": "0.05"}, "holds"),
        ("0.65", {"tolerance": "0.049999999999999999999999"}, "refuted"),
        ("0.6", {"tolerance": "0"}, "holds"),
        ("1", {}, "holds"),
    ):
        assert judged([one("gamma", 1, number, **tolerance)]).verdict == verdict


def test_a_first_integral_is_exact_at_any_time() -> None:
    energy = Fraction(1, 2) * (Fraction(3, 100) + Fraction(32, 100) + Fraction(81, 100)) + Fraction(23, 50)
    text = f"{float(energy):.4f}"
    assert Fraction(text) == energy
    for number, holds in ((text, True), ("1.0401", False), ("1.04", True), ("1.0", True), ("1.1", False)):
        assert judged([one("energy", 1, number, "1e6")]).rows[0].holds is holds


def test_a_first_integral_of_a_full_tensor_is_exact_where_the_start_is() -> None:
    """½ Ω·JΩ + n·γ by hand: met to half a unit exactly, which no ball would decide."""
    start = {"omega": ["0", "0", "1"], "quaternion": ["1", "0", "0", "0"]}
    body = TENSOR_BODY | {"gravity": "1"}
    energy = Fraction("0.9") / 2 + 2 * Fraction("0.3")
    assert energy == Fraction("1.05")
    for number, holds in (("1.0", True), ("1.1", True), ("1.06", False), ("1.050", True)):
        row = judged([one("energy", 1, number, "3")], top=None, body=body, start=start).rows[0]
        assert row.holds is holds, number
    assert judged([one("area", 1, "1.600", "3")], top=None, body=body, start=start).verdict == "holds"
    with pytest.raises(InputError, match="one of this motion"):
        judged([one("spin3", 1, "1")], top=None, body=body, start=start)


def test_the_sign_of_a_quaternion_is_free_but_one_for_all_of_its_components() -> None:
    start = {"omega": ["0", "0", "0"], "quaternion": ["3/5", "0", "0", "4/5"]}

    def said(*numbers: str) -> str:
        values = [one("quaternion", place, number) for place, number in enumerate(numbers, 1)]
        return judged(values, top=UPRIGHT, start=start).verdict

    assert said("0.6", "0", "0", "0.8") == said("-0.6", "0", "0", "-0.8") == "holds"
    assert said("0.6", "0", "0", "-0.8") == said("0.6", "0.1", "0", "0.8") == "refuted"


def test_of_two_signs_that_both_fail_the_nearer_is_judged() -> None:
    """One number is wrong, the others are right to more digits than the first balls have."""
    lib = mpmath.mp.clone()
    lib.dps = 50
    start = {"omega": ["0", "0", "3/7"], "quaternion": ["1", "0", "0", "0"]}
    values = [
        one("quaternion", 1, lib.nstr(lib.cos(lib.mpf(3) / 14), 40), "1"),
        one("quaternion", 3, "0.001", "1"),
        one("quaternion", 4, lib.nstr(lib.sin(lib.mpf(3) / 14), 40), "1"),
    ]
    rows = judged(values, top=UPRIGHT, start=start).rows
    assert [row.holds for row in rows] == [True, False, True]
    assert [figures(row)["digits_right"] for row in rows] == [40, 0, 40]


def test_a_height_follows_from_gamma_alone_and_nothing_else_of_the_attitude_does() -> None:
    assert judged([one("position", 3, "0.4600")]).verdict == "holds"
    for name, component in (("position", 1), ("quaternion", 1)):
        with pytest.raises(InputError, match="gamma does not fix"):
            judged([one(name, component, "0.5")])


@pytest.mark.slow
def test_out_of_reach_is_undecided_with_the_reason_and_no_guess() -> None:
    report = judged([one("omega", 1, "0.5", "100000"), one("energy", 1, "1.04", "100000")])
    assert [row.holds for row in report.rows] == [None, True]
    assert report.verdict == "undecided"
    assert "digit" in report.rows[0].residual or "reach" in report.rows[0].residual
    assert "digits_right" not in figures(report.rows[0])


def test_scales_times_and_digits_far_from_one() -> None:
    """Scaled by s in time: Omega by 1/s; numbers keep their digits, and the verdict with them."""
    fast = {"omega": ["1e99", "4e99", "9e99"], "gamma": START["gamma"]}
    heavy = TOP | {"weight": "1e200"}
    value = figures(judged([one("omega", 1, "0.1000000000000000", "-1/2")]).rows[0])["proven"]["value"]
    near = f"{Fraction(value).numerator / Fraction(value).denominator:.12f}"
    assert judged([one("omega", 1, near, "-1/2")]).verdict == "holds"
    rows = judged([one("omega", 1, f"{near}e100", "-0.5e-100")], top=heavy, start=fast).rows
    assert rows[0].holds is True
    assert figures(rows[0])["digits_right"] == PrintedNumber.read(near, "x").digits


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"values": []}, "length >= 1"),
        ({"values": [one("speed", 1, "1")]}, "quantity must be one of this motion; got 'speed'"),
        ({"values": [one("kovalevskaya", 1, "1")]}, "one of this motion"),
        (
            {"values": [one("omega", 1, "1"), one("power", 1, "1", "2")]},
            "value 2 (component 1, t = 2): quantity must be one of this motion; got 'power'",
        ),
        ({"values": [one("gamma", 3, "1"), one("quaternion", 2, "1", "1/2")]}, "value 2 (component 2, t = 1/2): gamma"),
        ({"values": [one("omega", 1, "1"), one("omega", 2, 1.5)]}, "value 2: number must be text"),  # type: ignore[arg-type]
        ({"values": [one("omega", 1, "1"), {"time": "0", "number": "1"}]}, "value 2 lacks the key quantity"),
        ({"values": [one("omega", 4, "1")]}, "no component 4"),
        ({"values": [one("energy", 2, "1")]}, "no component 2"),
        ({"values": [{"quantity": "gamma", "number": "1", "time": "0"}]}, "gamma of a component that is not named"),
        ({"top": TOP | {"rotor": ["1", "0"]}}, "top.rotor must be a list of three"),
        ({"values": [one("omega", 0, "1")]}, ">= 1"),
        ({"values": [one("omega", 1, "1"), one("omega", 1, "2", "0.0")]}, "is in value 1 already"),
        ({"values": [one("omega", 1, "1", tolerance="-1")]}, "negative"),
        ({"values": [one("omega", 1, "1", tolerance="nan")]}, "tolerance"),
        ({"values": [one("omega", 1, "1", "inf")]}, "time"),
        ({"values": [one("omega", 1, 0.5)]}, "must be text; got a number"),  # type: ignore[arg-type]
        ({"values": [one("omega", 1, "1") | {"unit": "m"}]}, "unit"),
        ({"body": TENSOR_BODY}, "one of"),
        ({"top": None}, "one of"),
        ({"top": TOP | {"rotor": "1"}}, "top.rotor is one number"),
        ({"top": TOP | {"rotor": ["1", "0", "0"]}, "system": "heavy_top"}, "rotor"),
        ({"top": TOP | {"weight": "1e"}}, "top, body or start"),
        ({"start": {"omega": ["1", "2", "3"], "gamma": ["0.6", "0", "0.81"]}}, "not a unit vector"),
        ({"start": {"omega": ["1", "2", "3"]}}, "No attitude"),
        ({"start": {"gamma": ["1", "0", "0"]}}, "omega_space must be given"),
        ({"start": START | {"quaternion": ["1", "0", "0"]}}, "quaternion must have 4 numbers; got 3"),
        ({"start": {"omega": ["1", "2", "3"], "matrix": ["1", "0", "0"]}}, "matrix"),
        ({"start": {"omega": ["1", "2", "3"], "euler": "ZXZ:1,2"}}, "euler"),
        ({"system": "pendulum"}, "pendulum"),
        ({"assume": ["a > 0"]}, "assume"),
        ({"domain": "all"}, "domain"),
    ],
)
def test_what_is_no_claim_of_numbers_says_what_is_wrong(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        judged(**({"values": [one("omega", 1, "0.1")]} | changes))
    assert said in str(error.value)


def test_an_error_found_while_a_file_is_audited_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "b.toml"
    path.write_text(FILE.format("1").replace('"omega"\ncomponent = 1', '"power"'))
    cause, remedy = auditing.answer(str(path), "")  # type: ignore[misc]
    assert cause.startswith(f"{path}: value 1 (component 1, t = 2): quantity must be one of this motion; got 'power'")
    assert "energy" in remedy
    about, _ = auditing.answer(str(path), "gyrostat")  # type: ignore[misc]
    assert about.startswith(f"{path}: ")


def test_a_rounded_gamma_is_taken_where_the_file_says_so() -> None:
    start = {"omega": ["1", "2", "3"], "gamma": ["0.6", "0", "0.81"], "normalize": True}
    found = judged([one("gamma", 1, "0.595")], start=start)
    assert found.verdict == "holds"


def test_the_systems_are_the_files_or_asked_for() -> None:
    gyrostat = {"top": TOP | {"rotor": ["0", "0", "1/2"]}}
    assert judged([one("omega", 1, "0.1")]).system == "heavy_top"
    assert judged([one("omega", 1, "0.1")], **gyrostat).system == "heavy_gyrostat"
    assert judged([one("omega", 1, "0.1")], "heavy_gyrostat").system == "heavy_gyrostat"
    with pytest.raises(InputError, match="about heavy_top"):
        judged([one("omega", 1, "0.1")], "heavy_gyrostat", system="heavy_top")
    with pytest.raises(InputError, match="gyrostat"):  # centre of mass off axis 2
        judged([one("omega", 1, "0.1")], "gyrostat")


FILE = """
name = "a table"
kind = "value"
[top]
inertia = ["3", "2", "1"]
weight = "1"
centre = ["1/2", "1/3", "1/5"]
[start]
omega = ["1/10", "2/5", "9/10"]
gamma = ["3/5", "0", "4/5"]
[[value]]
time = "2"
quantity = "omega"
component = 1
number = "{}"
[[value]]
time = "2"
quantity = "energy"
number = "1.0400"
"""


@pytest.mark.slow
def test_the_command_line_shows_printed_and_proven(tmp_path: Path) -> None:
    path = tmp_path / "table.toml"
    path.write_text(FILE.format("0.9"), "utf-8")
    found = audit(path)
    assert found.verdict == "refuted"
    near = f"{float(Fraction(figures(found.rows[0])['proven']['value'])):.5f}"
    path.write_text(FILE.format(near), "utf-8")
    done = heavytop("audit", path, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert (document["kind"], document["verdict"]) == ("value", "holds")
    row = document["equations"][0]
    assert row["printed"] == near
    assert row["digits_right"] == row["digits_printed"] == PrintedNumber.read(near, "x").digits
    assert row["domain"] == "t=2"
    text = shown(audit_text(found), 120)
    parts = "omega 1|energy |0.9|0 of 1|5 of 5|half a unit|refuted|+/-|Reference: validated"
    assert [part for part in parts.split("|") if part not in text] == []


def test_a_claim_of_numbers_is_no_claim_of_formulas() -> None:
    assert isinstance(claim_from_table(claim([one("omega", 1, "0.1")]), "x"), ValueClaim)
    with pytest.raises(InputError, match=r"needs the table \[motion\]"):
        claim_from_table({"name": "x", "kind": "motion", "top": TOP, "start": START}, "x")
    with pytest.raises(InputError, match="kind = 'values' with"):
        claim_from_table(claim([one("omega", 1, "0.1")]) | {"kind": "values"}, "x")


@pytest.mark.slow
def test_a_report_counts_the_digits_that_are_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    head = 'id = "three"\ntitle = "Three"\nlanguage = "en"\nread = "the text"\nstatus = "as published"\n'
    head += 'expects = "refuted"\nnote = "A slip."\nsource = {authors = ["A"], year = 2000, title = "T"}\n'
    body = FILE.format("0.203").replace('name = "a table"\n', "")
    (tmp_path / "three.toml").write_text(head + body, "utf-8")
    monkeypatch.setattr(entries, "FOLDER", tmp_path)
    monkeypatch.setattr(auditing, "FOLDER", tmp_path)
    entries.library.cache_clear()
    try:
        (task,) = AuditTable(claims=["three"]).tasks(lambda name: pytest.fail(name))
        row = KINDS["audit"].measure(task, Saved())
    finally:
        entries.library.cache_clear()
    assert {name: metric.value for name, metric in row.metrics.items()} == {
        "(omega).1 printed t=2": "0",
        "(energy).1 printed t=2": "1",
        "digits_right.omega1 printed t=2": "1",
        "digits_right.energy1 printed t=2": "5",
        "as_expected": "1",
    }
    headline, *_ = KINDS["audit"].document([row])
    assert headline.text == "Library of 1 claim: 1 refuted; every verdict as expected."
    assert headline.word is None  # no green "holds" over what is refuted
