"""The command line as a newcomer and as a script meets it."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.version import commit
from support import in_process
from support.helpers import options, python
from support.reports import drift, plan_file

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "heavytop"]


STEPS = '[[measure]]\nkind = "local_error"\ncases = ["euler"]\nprecisions = ["double"]\nhorizon = "1"\n'
run, printed, refused = in_process.heavytop, in_process.printed, in_process.refused


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tiny")
    plan_file(folder, drift("euler", "kovalevskaya", runs=[("double", "20", 20)]) + STEPS)
    for name in ("one", "two"):
        more = ["--workers", "1", *(["--parquet"] if name == "two" else [])]
        done = run("run", "--plan", "plan.toml", "--out", name, *more, cwd=folder)
        assert done.returncode == 0, done.stderr
        assert f"{name}/report.json" in done.stdout
        assert "Traceback" not in done.stderr
    return folder


def test_propagate_prints_for_people_and_carries_the_attitude() -> None:
    text = printed("propagate", *options(), "--attitude")
    assert all(word in text for word in ("reached every time asked for", "ψ", "energy"))
    answer = json.loads(printed("propagate", *options(), "--attitude", "--json"))
    assert len(answer["states"][0]) == 6
    assert len(answer["attitude"][0]) == len(answer["angles"][0]) == 3
    assert "drift_xi_squared_max" in answer["metrics"]


def test_a_run_that_stops_early_is_incomplete_and_keeps_what_it_reached() -> None:
    done = run("propagate", *options(times="1,2,900"), "--max-steps", "40", "--json")
    assert done.returncode == 3
    answer = json.loads(done.stdout)
    assert answer["outcome"] == "step_limit"
    assert len(answer["states"]) == len(answer["times"]) == 2
    assert "stopped" in run("propagate", *options(times="1,2,900"), "--max-steps", "40").stdout
    fast = printed("propagate", *options(omega="1e140,1e140,1", times="8e-140"), "--json")
    assert json.loads(fast)["outcome"] == "success"


@pytest.mark.parametrize(
    ("changes", "more", "message"),
    [
        ({"omega": "1,x,2"}, [], "--omega: 'x' is not a finite number"),
        ({"gamma": "1,1,0"}, [], "--normalize"),
        ({"gamma": "0,0,0"}, ["--normalize"], "must not be zero"),
        ({}, ["--system", "gyrostat"], "centre of mass on axis 2"),
        ({"centre": "0,1,0"}, ["--system", "gyrostat"], "parallel to M"),
        ({"centre": "0,1,0", "omega": "0,1,0"}, ["--system", "gyrostat"], "M·gamma != 0"),
        ({}, ["--max-steps", "0"], "--max-steps must be at least 1; got 0"),
        ({}, ["--integrator", "splitting:2", "--max-steps", "5"], "splitting:2 does not support --max-steps"),
        ({}, ["--integrator", "splitting:4", "--tolerance", "1e-9"], "Leave it out: --step sets the accuracy"),
        ({}, ["--quaternion", "1,0,0,0", "--matrix", "1,0,0,0,1,0,0,0,1"], "--quaternion and --matrix were given"),
        ({}, ["--mass", "2"], "--weight and --mass were given"),
        ({}, ["--link", "arm"], "--link was given without --file"),
        ({}, ["--colour", "red"], "--colour"),
        ({"times": "1e5000,1e5000"}, [], "too large"),
        ({"inertia": "-1e5000,1,1"}, [], "must be positive"),
    ],
)
def test_bad_input_gets_a_clear_error_and_exit_2(changes, more, message) -> None:
    assert message in refused("propagate", *options(**changes), *more, "--json")


def test_normalize_moves_gamma_onto_the_sphere() -> None:
    answer = json.loads(printed("propagate", *options(gamma="1,1,0"), "--normalize", "--json"))
    gamma = [Fraction(v) for v in answer["states"][0][3:]]
    assert abs(sum(g * g for g in gamma) - 1) < Fraction(1, 10**13)


def test_a_format_whose_steps_take_long_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heavytop.cli.motions._SLOW_BITS", 100)
    done = CliRunner().invoke(app, ["propagate", *options(), "--precision", "real:100", "--max-steps", "1", "--json"])
    assert done.exit_code == 3
    assert "warning: in real:100 a step sums a Taylor series of order 35: seconds" in done.stderr
    assert json.loads(done.stdout)["outcome"] == "step_limit"


def test_moments_that_no_body_has_are_a_warning() -> None:
    done = run("propagate", *options(inertia="9,2,1"), "--json")
    assert done.returncode == 0
    assert "no rigid body has such moments" in done.stderr
    json.loads(done.stdout)


def test_two_runs_of_a_plan_are_the_same_but_for_timings(finished: Path) -> None:
    one, two = (json.loads((finished / name / "report.json").read_text()) for name in ("one", "two"))
    for report in (one, two):
        assert set(report) == {"schema", "plan", "environment", "rows"}
        for row in report["rows"]:
            row.pop("seconds", None)
    assert one["rows"] == two["rows"]
    assert {row["outcome"] for row in one["rows"]} == {"success"}
    assert json.loads(printed("compare", "one", "two", "--json", cwd=finished))["verdict"] == "same"
    assert printed("compare", "one", "two", cwd=finished).startswith("Verdict: same (")


def test_a_command_that_is_printed_can_be_pasted(finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished / "one", tmp_path / "a b")
    assert "heavytop show 'a b' --full" in printed("show", "a b", cwd=tmp_path)
    assert "Next: cd 'c d'; " in printed("new", "c d", cwd=tmp_path)


def test_rows_as_parquet_come_with_the_run_or_from_its_report(finished: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    printed("show", finished / "one", "--parquet", "one.parquet", cwd=tmp_path)
    assert (tmp_path / "one.parquet").read_bytes() == (finished / "two" / "rows.parquet").read_bytes()
    assert not (finished / "one" / "rows.parquet").exists()
    assert "ends in .parquet" in refused("show", finished / "one", "--parquet", "report.json", cwd=tmp_path)
    document = printed("show", finished / "one", "--parquet", "again.parquet", "--json", cwd=tmp_path)
    assert json.loads(document) == json.loads(printed("show", finished / "one", "--json", cwd=tmp_path))
    twice = ("--parquet", "x.parquet", "--html", "./x.parquet")
    assert "is named twice" in refused("show", finished / "one", *twice, cwd=tmp_path)
    assert not (tmp_path / "x.parquet").exists()


def test_parquet_without_pyarrow_is_refused_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    said = refused("run", "--plan", "smoke", "--out", "out", "--parquet", cwd=tmp_path)
    assert "pip install 'heavytop[parquet]'" in said
    assert not (tmp_path / "out").exists()


def test_compare_and_show_refuse_what_is_no_report(finished: Path) -> None:
    (finished / "cut.json").write_text((finished / "one" / "report.json").read_text()[:500])
    for arguments in (["show", "nowhere"], ["show", "cut.json"], ["compare", "one", "cut.json"], ["show", "plan.toml"]):
        assert "heavytop: " in refused(*arguments, cwd=finished)
    assert "Name one of the reports in .: one, two" in refused("show", ".", cwd=finished)
    (finished / "motion.csv").write_text("t,omega1\n")
    assert "`heavytop score motion.csv` reads a trajectory" in refused("show", "motion.csv", cwd=finished)


def test_a_folder_with_other_content_is_left_alone(tmp_path: Path) -> None:
    plan_file(tmp_path, STEPS)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "precious.txt").write_text("keep me")
    (tmp_path / "file").write_text("")
    for out, message in (("out", "already contains precious.txt"), ("file", "is a file")):
        assert message in refused("run", "--plan", "plan.toml", "--out", out, cwd=tmp_path)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["precious.txt"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--plan", "none.toml"], "as --plan gate; `heavytop new`"),
        (["--plan", "bad.toml"], "unknown field `surprise`"),
        (["--resume"], "--out"),
        (["--plan", "smoke", "--out", "x", "--save-every", "nan"], "save_every must be 0 or more; got nan"),
    ],
)
def test_a_bad_run_writes_nothing(tmp_path: Path, arguments: list[str], message: str) -> None:
    (tmp_path / "bad.toml").write_text('name = "bad"\nmeasure = []\nsurprise = 1\n')
    assert message in refused("run", *arguments, cwd=tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["bad.toml"]


def test_what_a_killed_run_left_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "rows.jsonl").touch()
    assert "--resume" in refused("run", "--plan", "smoke", "--out", "out", cwd=tmp_path)


def seconds_so_far(pid: int) -> float:
    """Processor time of a process that runs."""
    fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def seconds_of_ended_children() -> float:
    """Processor time of all of them."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.mark.parametrize(("after", "integrator"), [(0.3, "heyoka"), (2.0, "heyoka"), (1.6, "multiword")])
def test_ctrl_c_ends_a_propagation_within_two_seconds_of_processor_time_with_exit_130(
    after: float, integrator: str
) -> None:
    """While libraries load, while heyoka compiles, while it integrates: ``after`` is processor time."""
    process = subprocess.Popen(
        [*COMMAND, "propagate", *options(times="1e12", integrator=integrator)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while seconds_so_far(process.pid) < after:
        assert process.poll() is None
        time.sleep(0.02)
    before = seconds_of_ended_children() + seconds_so_far(process.pid)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert seconds_of_ended_children() - before < 2
    assert process.returncode == 130
    assert "Traceback" not in errors


def test_the_version_is_that_of_the_package_with_its_commit() -> None:
    done = python("-m", "heavytop", "--version")
    made_from = commit()
    told = f" (commit {made_from})" if made_from else ""
    assert (done.returncode, done.stdout) == (0, f"heavytop {version('heavytop')}{told}\n")


def test_help_lists_the_commands_and_loads_nothing_heavy() -> None:
    text = printed("--help")
    assert all(name in text for name in ("run", "propagate", "compare", "score", "show", "list"))
    heavy = {"heyoka", "numpy", "flint", "matplotlib", "sympy", "distributed"}
    said = f"atexit.register(lambda: print({heavy} & sys.modules.keys()))"
    done = python("-c", f"import atexit, sys; from heavytop.__main__ import main; {said}; main()", "--help")
    assert done.stdout.splitlines()[-1] == "set()"


def test_reference_of_the_gyrostat_uses_its_closed_form() -> None:
    given = options(inertia="6,6,1", weight="1", centre="0,15,0", omega="0,0,6", gamma="0,0,1", times="-3")
    text = printed("reference", *given, "--system", "gyrostat", "--digits", "40")
    assert "(4.2)-(4.6)" in text
    assert "±" in text


@pytest.mark.parametrize(
    ("changes", "more", "code", "message"),
    [
        ({}, ["--digits", "20001"], 2, "1 to 20000"),
        ({}, ["--digits", "many"], 2, "--digits"),
        ({"times": "inf"}, [], 2, "not a finite number"),
        ({"gamma": "1,1,1"}, [], 2, "--normalize"),
        ({"times": "1e6"}, [], 3, "cannot prove a digit at t = 1e+06"),
        ({}, ["--effort", "1e-9"], 3, "or a larger --effort of reference"),
        ({"times": "300"}, ["--effort", "1e-3", "--derivatives", "start"], 3, "or a larger --effort of reference"),
        ({"weight": "1" * 5000}, [], 3, "cannot prove a digit at t = 8"),
    ],
)
def test_reference_refuses_what_it_cannot_prove(changes, more, code, message) -> None:
    assert message in refused("reference", *options(**changes), *more, "--json", code=code)


def test_a_gate_without_a_baseline_names_the_command_that_makes_it(tmp_path: Path) -> None:
    said = refused("gate", "--plan", "smoke", "--baseline", "my base", cwd=tmp_path)
    assert said.endswith(" heavytop gate --plan smoke --baseline 'my base' --bless\n")


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("--bless --policy nope.toml", "The policy nope.toml cannot be read"),
        ("--bless --markdown no/folder.md", "no/folder.md cannot be written"),
        ("--bless --baseline a_file", "a_file is a file"),
        ("", "report.json was changed since it was written"),
    ],
)
def test_a_gate_refuses_what_it_can_before_it_measures(tmp_path: Path, line: str, cause: str) -> None:
    (tmp_path / "a_file").write_text("")
    baseline = tmp_path / ".heavytop" / "baseline"
    baseline.mkdir(parents=True)
    (baseline / "report.json").write_text("{}")
    (baseline / "report.json.sha256").write_text("0")
    assert cause in refused("gate", "--plan", "smoke", *line.split(), cwd=tmp_path)
    assert not (tmp_path / ".heavytop" / "new").exists()


def test_a_gate_of_no_plan_leaves_the_report_of_before(tmp_path: Path) -> None:
    before = tmp_path / ".heavytop" / "new" / "message.txt"
    before.parent.mkdir(parents=True)
    before.write_text("Move the baseline\n")
    refused("gate", "--plan", "gaet.toml", "--bless", cwd=tmp_path)
    assert before.read_text() == "Move the baseline\n"


@pytest.mark.slow
def test_a_gate_in_which_an_integrator_has_no_number_is_not_passed(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('[[integrator]]\nname = "mine"\ncommand = ["./not-built"]\n')
    measure = drift("euler", integrator="mine.toml", runs=[("double", "1", 3)])
    (tmp_path / "gate.toml").write_text(f'name = "gate"\n{measure}')
    said = refused("gate", "--bless", cwd=tmp_path, code=3)
    assert "No row of mine has a number, so no baseline is made: mine: the program ./not-built does not exist" in said
    assert run("run", *["--plan", "gate.toml", "--out", ".heavytop/baseline"], cwd=tmp_path).returncode == 3
    done = run("gate", "--json", *["--markdown", "changes.md", "--junit", "changes.xml"], cwd=tmp_path)
    said = json.loads(done.stdout)
    assert (done.returncode, said["verdict"]) == (3, "incomparable")
    assert "1 row of mine cannot be compared: no row of mine has a number." in said["findings"]
    for text in (done.stdout, *(tmp_path.joinpath(f"changes.{form}").read_text() for form in ("md", "xml"))):
        assert "no row of mine has a number" in text
    assert run("compare", *[".heavytop/baseline", ".heavytop/new"], cwd=tmp_path).returncode == 3
