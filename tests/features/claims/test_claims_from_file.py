"""Claims that users write: the worked examples, planted errors in them, and files that mean harm."""

import json
import re
import time
import tomllib
from importlib.resources import files
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import answer, claim_from_table, read_claim
from heavytop.features.claims.audit.guard import in_time
from heavytop.features.claims.audit.judge import Audit
from heavytop.features.claims.text import audit_text
from support.claim_tables import audited, integral, top
from support.in_process import heavytop

EXAMPLES = files("heavytop.features.claims") / "examples"

HOSTILE = [
    "__import__('os').system('true')",
    "t.__class__.__mro__",
    "10^10^10",
    "10**10**10",
    "((((t+1)^64)^64)^64)^64",
    "(" * 3000 + "t" + ")" * 3000,
    "t" + "+t" * 4900,
    "1e999999",
    "t^t",
    "lambda: t",
    "[t]",
    "'t'",
    "sqrt(-1)",
    "1/(t-t)",
    "tan(pi/2)",
    "unknown*t",
    "sin(t, t)",
    "",
    "t)",
]


def table(name: str) -> dict:
    return tomllib.loads((EXAMPLES / f"{name}.toml").read_text())


def refuted(report: Audit) -> set[tuple[str, int]]:
    return {(row.equation, row.component) for row in report.rows if row.holds is False}


MOMENT = "p*(I3*(s + p*cos(theta)) - I1*p*cos(theta))"
EXAMPLE_AND_NEIGHBOURS = [
    ("delone-homoclinic", (), "", {}),
    ("delone-homoclinic", ("motion", "omega", 0), "-alpha*sin_phi/2", {("1.1", 1)}),
    ("delone-homoclinic", ("motion", "omega", 2), "(2 + 1e-30)*alpha*cos_theta", {("1.1", 3)}),
    ("delone-homoclinic", ("motion", "gamma", 2), "-cos_theta", {("1.2", 2)}),
    ("lagrange-wrong-sign", (), "", {("1.1", 1), ("1.1", 2)}),
    ("lagrange-wrong-sign", ("definitions", "moment"), MOMENT, {}),
    ("kovalevskaya-integral", (), "", {}),
    ("kovalevskaya-integral", ("top", "inertia"), ["2*I3", "2*I3", "3*I3/2"], {("dF/dt", 1)}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "place", "value", "wrong"), EXAMPLE_AND_NEIGHBOURS)
def test_an_example_has_its_verdict_and_a_mistake_in_it_is_refuted_where_it_is(name, place, value, wrong):
    content = part = table(name)
    for key in place[:-1]:
        part = part[key]
    if place:
        part[place[-1]] = value
    report = audited(content)
    assert report.verdict == ("refuted" if wrong else "holds")
    assert refuted(report) >= set(wrong)
    if (name, place) == ("delone-homoclinic", ()):
        assert report.solves == ("heavy_top",)
        assert {row.equation for row in report.rows} == {"1.1", "1.2", "1.3"}
    if (name, place) == ("lagrange-wrong-sign", ()):
        assert refuted(report) == wrong


@pytest.mark.slow
def test_the_momentum_is_constant_for_the_gyrostat_and_not_for_the_heavy_top():
    content = table("momentum-squared")
    report = audited(content)
    assert (report.verdict, report.solves) == ("refuted", ("gyrostat",))
    assert audited(content, "gyrostat").verdict == "holds"


@pytest.mark.slow
def test_what_the_algebra_cannot_carry_is_undecided_and_never_holds():
    content = table("delone-homoclinic")
    # 0 for t > 0, but no algebra of this kind knows it
    content["definitions"]["T"] = "tanh(alpha*t/sqrt(2)) + 2*atan(t) - atan2(2*t, 1 - t^2)"
    content |= {"domain": "t>0"}
    report = audited(content)
    assert report.verdict == "undecided"
    assert report.exit_code == 3
    assert all(row.residual.startswith("|residual| < ") for row in report.rows if row.holds is None)


@pytest.mark.slow
@pytest.mark.parametrize("formula", HOSTILE)
def test_a_hostile_formula_is_refused_at_once(formula):
    content = table("delone-homoclinic")
    content["motion"]["omega"][0] = formula
    before = time.monotonic()
    with pytest.raises(InputError):
        audited(content)
    assert time.monotonic() - before < 5


@pytest.mark.slow
@pytest.mark.parametrize("text", ["(" * 500_000 + ")" * 500_000, "a = " + "[" * 50_000, "\x00", "name = 1"])
def test_a_hostile_file_is_exit_2(tmp_path, text):
    (path := tmp_path / "claim.toml").write_text(text)
    assert heavytop("audit", path).returncode == 2


def test_an_audit_that_does_not_end_is_stopped():
    with pytest.raises(InputError, match="was stopped"):
        in_time(str(EXAMPLES / "delone-homoclinic.toml"), "heavy_top", seconds=0.01)


@pytest.mark.slow
def test_the_command_prints_the_json_that_scripts_read():
    run = heavytop("audit", EXAMPLES / "lagrange-wrong-sign.toml", "--json")
    document = json.loads(run.stdout)
    assert run.returncode == 1
    assert [document[key] for key in ("claim", "system", "verdict")] == ["lagrange-wrong-sign", "heavy_top", "refuted"]
    text = heavytop("audit", EXAMPLES / "lagrange-wrong-sign.toml").stdout
    assert "Witnesses" in text
    assert "(1.1) 1" in text


WRONG_KEYS = [
    ({"parameters": {"I-1": "2"}}, "A name must be a letter and up to 30 of .*; got 'I-1'"),
    ({"parameters": {"\x1b[31m": "2"}}, r"A name must be .*; got '\\x1b\[31m'"),
    ({"definitions": {"": "2"}}, "A name must be .*; got ''"),
    ({"parameters": {"A": "2", "B": 2.5}}, "parameters.B must be text or a list; got a number.*\n.*decimals as text"),
    ({"definitions": {"A": "2", "B": ["2"]}}, "definitions.B must be text; got a list"),
    ({"parameter": {"A": "2"}}, "unknown field `parameter` in the file; the nearest key is parameters"),
    ({"top": top() | {"center": ["0", "0", "1"]}}, "unknown field `center` in top; the nearest key is centre"),
    ({"top": top() | {"\x1b[31m": "1"}}, r"unknown field `\\x1b\[31m` in top\."),
    ({"id": "An id"}, "id must be lower-case words joined by hyphens"),
    ({"name": ""}, "name must be text of length >= 1"),
    ({"top": top() | {"centre": ["0", "1"]}}, "top.centre must be a list of three"),
    ({"motion": {"matrix": ["1"] * 9}}, "motion.matrix must be three rows of three"),
    ({"parameters": {"a": ["1", "2"], "b": ["1", "2", "3"]}}, "differ: 2 of a, 3 of b"),
    ({"parameters": {"a": "sqrt(2)"}}, r"a must be a rational number; got 'sqrt\(2\)'"),
    ({"definitions": {"a": "b", "b": "1"}}, "definition of a uses b, which is not defined before it"),
    ({"parameters": {"a": "1"}, "assume": ["a = 1"]}, "left = right is left - right in relations"),
    ({"parameters": {"a": "1"}, "assume": ["a > 0 and a < 2"]}, "each comparison is a text of its own"),
    ({"assume": ["Omega3/Omega3 > 0"]}, "assume: 1 depends on Omega3"),
    ({"top": top(weight="x")}, "Known here: pi; "),
    *(  # what would be another name or formula in ASCII stays as it is
        (
            {"parameters": dict.fromkeys(("Omega3n", "alphabeta", "api", "sqrtab"), "2"), "integral": {"value": text}},
            re.escape(text),
        )
        for text in ("Omega3ⁿ", "αβ", "aπ", "√Omega3^2")
    ),
    ({"definitions": {"q": "abs(c)", "abs": "2"}, "parameters": {"c": "2"}, "integral": {"value": "c*x"}}, "'x'"),
    *(
        ({"integral": {"value": text}}, f"Did you mean {re.escape(meant)}\\?")
        for text, meant in {
            "omega3": "Omega3",
            "Ω_3 + w1": "Omega3 + Omega1",
            "Omega[3]": "Omega3",
            "2Ω₃(Ω₁ + 1)": "2*Omega3*(Omega1 + 1)",
            "sin²(Omega3)": "sin(Omega3)^2",
            "|Omega3|": "abs(Omega3)",
            "Omega3 = 1": "Omega3 - 1",
            "gamma1 == 0": "gamma1",
            "Omega3 = Omega1 + 1": "Omega3 - (Omega1 + 1)",
            "e^(2*Omega3)": "exp(2*Omega3)",
            "sign(Omega3)": "(Omega3)/abs(Omega3)",
            "Omega3^(1/3)": "exp(log(Omega3)/3)",
        }.items()
    ),
    ({"start": {"gamma": ["0", "0", "1"]}}, r"a claim of kind 'integral' does not use gamma of \[start\]"),
]


@pytest.mark.parametrize(("parts", "said"), WRONG_KEYS)
def test_a_wrong_key_is_named_in_words(parts, said):
    entry = {"title": "A title", "language": "en", "read": "the text", "status": "as published", "expects": "holds"}
    source = {"authors": ["A"], "year": 2000, "title": "T"}
    claim = integral("Omega3", top("2 2 1", "0 0 1")) | (
        entry | {"note": "N", "source": source} if "id" in parts else {}
    )
    with pytest.raises(InputError, match=said) as caught:
        claim_from_table(({"name": "x"} if "id" not in parts else {}) | claim | parts, "x")
    assert "\x1b" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        ("Omega3", "holds"),
        ("Omega1", "refuted"),
        ("2·Ω₃² − ln(α) + abs(λ×Ω3) + 10^70*ln + √α·√(α + 1)", "holds"),
        ("arctan(Omega3) + arsinh(Omega3) + coth(1 + Omega3^2)", "holds"),
        ("cot(Ω₁)", "refuted"),
    ],
)
def test_a_first_integral_is_one_at_any_time(value: str, verdict: str) -> None:
    """Every state is the start of a motion, so neither a domain nor times change the verdict."""
    parameters = {"α": 2, "lambda": ["1"], "ln": ["3", "4"]}
    of = top("2 2 1", "0 0 1") | {"inertia": [2, "2", 1]}
    claim = integral(value, of, parameters=parameters, assume=["α ≥ 1"])
    for part in ({}, {"domain": "t>0"}, {"domain": "t<=0", "times": ["-1"]}):
        assert audited(claim | part).verdict == verdict


NINES = "8" + "9" * 60  # SymPy's sqrt raises ValueError


def test_a_number_whose_root_sympy_refuses_is_an_error_in_words(tmp_path):
    (path := tmp_path / "claim.toml").write_text(f"""name = "x"
kind = "integral"
top = {{ inertia = ["2", "2", "1"], weight = "1", centre = ["0", "0", "1"] }}
integral = {{ value = "Omega3*sqrt({NINES})" }}""")
    cause, remedy = answer(str(path), "")
    assert "SymPy cannot take the root of a number of the claim" in cause
    table = integral("Omega3*sqrt(k)", top("2 2 1", "0 0 1"), assume=["k > 0"], parameters={"k": NINES})
    assert "as a parameter" in remedy
    assert audited(table).verdict == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(("length", "verdict"), [("1e30", "refuted"), ("1e300", "undecided")])
def test_samples_of_many_digits_are_searched_up_to_a_length(length, verdict):
    claim = integral("Omega1^2 - Omega2^2 - c*gamma1", top("2 2 1", "c 0 0"), kind="relation", parameters={"c": length})
    assert audited(claim).verdict == verdict


def test_the_name_and_the_source_of_a_claim_are_printed_without_control_characters():
    report = audited(integral("Omega3", top("2 2 1", "0 0 1"), name="a\x1b[31m\nb", source="\x07s\u202e"))
    (console := Console(file=StringIO(), width=80)).print(audit_text(report))
    printed = console.file.getvalue()
    assert "a [31m b as a first integral" in printed
    assert not set(printed) & set("\x07\x1b\u202e")
    assert "\x1b" not in repr(report)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    claim = tmp_path / "claim.toml"
    claim.write_bytes(b"\xef\xbb\xbf" + (EXAMPLES / "kovalevskaya-integral.toml").read_bytes())
    assert read_claim(claim).name == "kovalevskaya-integral"
