"""`score` and `list --case`: the answer in the first lines, the page, the data of a case ready to paste."""

import json
import re
import shlex
import tomllib
from fractions import Fraction
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

import heavytop as ht
import heavytop.features.score.measurement as score_module
from heavytop.cases import CASES
from heavytop.cli import app
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.features.score.measurement import Assessment, assess, direction
from heavytop.features.score.text import digits_over_time, guessed, requirement, score_report, score_text
from heavytop.features.score.trajectories.files import read as read_file
from heavytop.features.score.trajectories.observed import GivenTrajectory, of_arrays
from heavytop.harness.plan import read
from heavytop.measure.scalar import digits_kept
from heavytop.measure.scorer import SOLUTION_ERROR
from heavytop.precision import DOUBLE
from heavytop.records import Quantity, Series
from heavytop.report.render.page import report_page
from support import small_reports
from support.helpers import shown
from support.small_reports import error

pytestmark = pytest.mark.pictures

CASE = CASES["lagrange"]
TIMES = [Fraction(k) for k in range(1, 9)]
HEADER = "t,omega1,omega2,omega3,gamma1,gamma2,gamma3"


def command(*arguments: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    return done.exit_code, done.stdout, done.stderr


def lines_of(times, states) -> list[str]:
    """The rows of a file, in digits that name each double."""
    return [",".join([str(t), *(repr(float(x)) for x in state)]) for t, state in zip(times, states, strict=True)]


def given(case=CASE, times=TIMES, spoilt=lambda i, state: state, precision=DOUBLE) -> GivenTrajectory:
    run = ht.propagate(case.top, case.start, times, precision, system=case.system)
    rows = [spoilt(i, list(state)) for i, state in enumerate(run.states)]
    return of_arrays(case.top, case.start, case.system, times, rows, precision, "mine", "rk4")


def printed(found, width: int = 80) -> list[str]:
    return [line.rstrip() for line in shown(score_text(found), width).splitlines()]


@pytest.fixture(scope="module")
def unknown() -> Assessment:
    """Of a motion that has no reference: most of its time goes into looking for one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("heavytop.features.score.diagnose.diagnosis.diagnose", lambda *_, **__: [])
        return assess(given(CASES["generic"], [Fraction(3000)]))


def across(i: int, state: list) -> list:
    # Ω3 is constant, so an error in it lies across the flow
    return [*state[:2], state[2] + 2e-9, *state[3:]]


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.slow
def test_the_first_lines_say_how_good_it_is() -> None:
    found = assess(given(spoilt=across))
    lines = printed(found)
    assert re.fullmatch(r"8\.9 of 16 digits right at every sample up to T = 8; heyoka in double: 1\d\.\d\.", lines[0])
    narrow = printed(found, 70)
    assert re.fullmatch(r"8\.9 of 16 digits right .* heyoka in double: 1\d\.\d\.", " ".join(narrow[:2]))
    assert "The error is mostly across the flow." in lines[:3]
    assert max(map(len, lines)) <= 80
    assert found.peer is not None
    assert found.peer.digits_right == assess(given()).digits_right


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["double-double", "real:600"])
def test_there_is_no_sentence_about_heyoka_where_it_did_not_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heavytop.features.score.measurement._EFFORT", 1e-6)
    rows = [list(state) for state in given().states]
    found = assess(of_arrays(CASE.top, CASE.start, CASE.system, TIMES, rows, ht.precision.parse(name), "a", "b"))
    assert found.peer is None
    assert not any("heyoka" in line for line in printed(found)[:3])


@pytest.mark.slow
def test_without_a_reference_and_without_a_sample_no_digits_are_said(unknown: Assessment) -> None:
    assert (unknown.digits_right, digits_kept(unknown.row), unknown.peer, direction(unknown.row)) == (None,) * 4
    assert "no reference" in unknown.row.against
    assert "drift_energy_max" in unknown.row.metrics
    assert printed(unknown)[0].startswith("The number of digits right is unknown")
    lost = assess(given(spoilt=lambda i, state: [float("nan")] * 6))
    assert printed(lost)[:2] == [
        "The run ended early (non_finite), at t = 0 of 8.",
        "The number of digits right is unknown: the first state is not finite.",
    ]


@pytest.mark.slow
def test_the_command_takes_a_case_and_writes_json_and_a_page(tmp_path: Path) -> None:
    run = ht.propagate(CASE.top, CASE.start, TIMES, DOUBLE)
    rows = lines_of(TIMES, run.to_numpy() * [1, 1, 1, -1, -1, -1])
    file, page = tmp_path / "mine.csv", tmp_path / "page.html"
    file.write_text("\n".join(["t,Ω1,Ω2,Ω3,γ1,γ2,γ3", *rows]), "utf-8")
    code, out, _ = command("score", str(file), "--case", "lagrange", "--json", "--html", str(page))
    assert code == 0
    said = json.loads(out)
    assert 0 <= said["digits_right"] == said["digits_kept"] < 0.05
    assert [said[key] for key in ("of_digits", "format_guessed", "case")] == [16, True, "lagrange"]
    assert said["precision"] == "double"
    assert said["peer"]["digits_right"] > 14
    (diagnosis,) = said["diagnosis"]
    assert diagnosis["kind"] == "gamma_down"
    assert diagnosis["sentence"].startswith("In these states γ points down")
    text = page.read_text("utf-8")
    assert re.search(r"<h2 id=\"verdict-heading\">0\.0 of 16 digits right at every sample up to T = 8", text)
    assert diagnosis["sentence"].split(";")[0] in text
    assert "Digits right over time" in text


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.slow
def test_the_page_draws_both_parts_and_is_the_same_every_time(unknown: Assessment) -> None:
    found = assess(given(spoilt=across))
    page = report_page(score_report(found, {"commit": "x"}), KINDS)
    assert page == report_page(score_report(found, {"commit": "x"}), KINDS)
    assert page.count("<svg") >= 1
    assert "along the flow (phase)" in page
    assert "Digits right over time" not in report_page(score_report(unknown, {}), KINDS)


def write_motion(folder: Path, spoilt=lambda i, state: state, more: str = "") -> str:
    """A file of the motion of the case."""
    motion = given(spoilt=spoilt)
    lines = [HEADER, *lines_of(motion.times, motion.states), *([more] if more else [])]
    (folder / "motion.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return str(folder / "motion.csv")


@pytest.mark.slow
def test_the_page_of_score_and_that_of_its_report_are_the_same(tmp_path: Path) -> None:
    motion, out = write_motion(tmp_path, lambda i, state: [*state[:3], *(-x for x in state[3:])]), str(tmp_path / "out")
    pages = [tmp_path / name for name in ("a.html", "b.html", "c.html")]
    command("score", motion, "--case", "lagrange", "--html", str(pages[0]), "--out", out)
    command("score", motion, "--case", "lagrange", "--html", str(pages[1]))
    assert command("show", out, "--html", str(pages[2]))[0] == 0
    first, *others = (page.read_bytes() for page in pages)
    assert b"digits right at every sample up to T = 8; heyoka" in first
    assert others == [first, first]
    # a report that says nothing beside its row has the usual page
    content = json.loads((tmp_path / "out" / "report.json").read_text())
    del content["beside"]
    (tmp_path / "old.json").write_text(json.dumps(content))
    assert command("show", str(tmp_path / "old.json"), "--html", str(pages[1]))[0] == 0
    assert "heavytop report, plan score" in pages[1].read_text("utf-8")


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("require", "spoilt", "more", "code", "said"),
    [
        ("8", across, "", 0, "8 digits required: satisfied."),
        ("9", across, "", 1, "9 digits required: only 8."),
        ("99", None, "", 1, "99 digits required: only 1"),
        ("8", across, "9,nan,nan,nan,nan,nan,nan", 3, "8 digits required: unknown, because the run ended early."),
        ("9", across, "9,nan,nan,nan,nan,nan,nan", 1, "9 digits required: only 8."),
    ],
)
def test_digits_that_are_required(require: str, spoilt, more: str, code: int, said: str, tmp_path: Path) -> None:
    motion = write_motion(tmp_path, spoilt or (lambda i, state: state), more)
    done = command("score", motion, "--case", "lagrange", "--require", require)
    assert done[0] == code, done
    assert said in done[1]
    code, text, _ = command("score", motion, "--case", "lagrange", "--require", require, "--json")
    assert {0: True, 1: False, 3: None}[done[0]] is json.loads(text)["passed"]
    assert code == done[0]


@pytest.mark.parametrize("require", ["0", "-1", "nan", "nine", "", "1e400"])
def test_a_number_of_digits_that_is_none_is_refused(require: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        command("score", write_motion(tmp_path), "--case", "lagrange", "--require", require)
    assert caught.value.remedy
    with pytest.raises(InputError):
        ht.score(TIMES, given().states, top=CASE.top, start=CASE.start, require=require)


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.slow
def test_digits_that_nobody_knows_do_not_pass(unknown: Assessment) -> None:
    run = ht.propagate(CASE.top, CASE.start, TIMES)
    scores = [
        ht.score(TIMES, run.states, top=CASE.top, start=CASE.start, require=require).passed for require in (9, None, 17)
    ]
    assert scores == [True, True, False]
    assert score_module.passed(unknown.row, None) is True
    # without a reference nothing is known
    assert score_module.passed(unknown.row, Fraction(1, 10)) is None
    row = assess(given(spoilt=across)).row
    unresolved = msgspec.structs.replace(
        row.metrics["solution_error_relative_max"], bound="1e-9", value="unresolved", log10=None
    )
    unsure = msgspec.structs.replace(row, metrics=row.metrics | {"solution_error_relative_max": unresolved})
    assert score_module.passed(unsure, Fraction(9)) is True
    assert score_module.passed(unsure, Fraction(10)) is None
    assert "9 are resolved" in requirement(unsure, Fraction(10))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lagrange", "gyrostat", "goryachev"])
def test_the_data_of_a_case_can_be_pasted_everywhere(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    _, out, _ = command("list", "--case", name, "--json")
    data = json.loads(out)
    # the command line
    line = shlex.split(data["command"])[1:]
    code, out, _ = command(*line, "--json")
    made = json.loads(out)
    assert code == 0
    assert tuple(map(Fraction, made["inertia"])) == case.top.inertia
    assert tuple(map(Fraction, made["omega"] + made["gamma"])) == case.start.flat
    # TOML
    plan = tmp_path / "plan.toml"
    measure = f'[[measure]]\nkind = "local_error"\ncases = ["my-{name}"]\nprecisions = ["double"]\nhorizon = "1"\n'
    plan.write_text(f'name = "mine"\n{data["toml"]}\n{measure}')
    (top,) = read(str(plan), KINDS)[0].top
    assert (tuple(map(Fraction, top.inertia)), top.system) == (case.top.inertia, case.system.name)
    # Python
    names: dict = {}
    exec(data["python"], names)
    assert (names["top"], names["start"]) == (case.top, case.start)
    # CSV
    rows = [",".join([time, *state]) for time, state in zip(made["times"], made["states"], strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([data["csv"], *rows]))
    assert read_file(tmp_path / "a.csv").start == case.start
    # JSON
    _, text, _ = command("list", "--case", name)
    pasted = json.loads(re.search(r"^\{.*?^\}", text, re.S | re.M)[0])
    pasted |= {key: made[key] for key in ("times", "states")}
    (tmp_path / "a.json").write_text(json.dumps(pasted))
    assert read_file(tmp_path / "a.json").start == case.start
    assert tomllib.loads(data["toml"])


def test_list_names_everything_once() -> None:
    _, text, _ = command("list")
    assert max(map(len, text.splitlines())) <= 80
    words = ("default", "gyrostat", "real:BITS", "113 bits", "scipy:DOP853", *CASES)
    assert [word for word in words if word not in text] == []
    names = re.findall(r"^  (\S+)", text, re.M)
    assert len(names) == len(set(names))
    _, out, _ = command("list", "--json")
    listed = json.loads(out)
    assert listed["integrators"]["heyoka"] == "every format but double-double"
    assert {case["name"] for case in listed["cases"]} == set(CASES)
    with pytest.raises(ht.InputError, match="Unknown case"):
        command("list", "--case", "nothing")


@pytest.mark.slow
def test_numbers_of_single_precision_are_noticed(tmp_path: Path) -> None:
    off = (ht.propagate(CASE.top, CASE.start, TIMES).to_numpy() * (1 + 1e-5)).astype("float32").astype(float)
    lines = [HEADER, *lines_of(map(float, TIMES), off)]
    (tmp_path / "m.csv").write_text("\n".join(lines))
    found = assess(read_file(tmp_path / "m.csv", CASE))
    assert found.diagnoses == []
    assert "single precision (24 bits)" in (guessed(found) or "")
    decimal = "\n".join([lines[0], *(line.replace(".", ",") for line in lines[1:])])
    (tmp_path / "comma.csv").write_text(decimal)
    with pytest.raises(InputError) as caught:
        read_file(tmp_path / "comma.csv", CASE)
    assert caught.value.remedy == "For decimal commas, separate the columns by semicolons."


@pytest.mark.parametrize(
    ("most", "said"), [("1e-4", ["Between these samples the fewest digits right are 4.0."]), ("1e-8", [])]
)
def test_an_error_between_the_samples_that_are_drawn_is_said(most: str, said: list[str]) -> None:
    across = Quantity(SOLUTION_ERROR, "across")
    course = {across.text: Series(["1", "20"], ["1e-9", "1e-8"], across)}
    one = small_reports.row(series=course, metrics={across.over("max").text: error(most)}, samples=20)
    section = digits_over_time([("", small_reports.report(one))])
    assert section is not None
    assert section.notes == ["2 of 20 samples, evenly in log |t|; the verdict counts all.", *said]
