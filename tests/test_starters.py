"""`heavytop new`: in each language whose compiler is here the folder works at once; the others are complete."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tomllib
from fractions import Fraction
from math import log
from pathlib import Path

import pytest

from heavytop.api.integrators import LANGUAGES, METHODS, engines, new_integrator
from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.harness.integrator_check import check
from heavytop.harness.plan import read
from heavytop.integrate import registry
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers.command import close_all
from heavytop.integrate.registry import commands_in
from heavytop.precision import DOUBLE
from heavytop.top.attitude import perpendicular
from support import in_process

COMPILERS = {"python": "python3", "c": "cc", "cpp": "g++", "rust": "rustc", "julia": "julia", "fortran": "gfortran"}


def build(folder: Path, language: str) -> None:
    """Make the program of a folder; the test is skipped where its compiler is not installed."""
    if shutil.which(COMPILERS[language]) is None:
        pytest.skip(f"{COMPILERS[language]} is not installed")
    if (folder / "Makefile").exists():
        built = subprocess.run(["make"], cwd=folder, capture_output=True, text=True, check=False)
        assert (built.returncode, built.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
def test_a_folder_is_complete_and_works_at_once_where_its_compiler_is_there(language: str, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    files = new_integrator(folder, language)
    assert files == sorted(str(each.relative_to(folder)) for each in folder.rglob("*") if each.is_file())
    assert {"mine.toml", "gate.toml", "README.md", ".github/workflows/heavytop.yml", LANGUAGES[language].file} <= set(
        files
    )
    for name in files:
        text = (folder / name).read_text()
        assert not re.search(r"\b(COMMAND|LANGUAGE|BUILD|FILE|TITLE|KEYS|CONTROL|POINTS|METHOD|WHERE)\b", text), name
        assert max(map(len, text.splitlines())) <= 130, name
    program = (folder / LANGUAGES[language].file).read_text()
    assert program.isascii() or language == "julia"
    words = ("heavytop-integrator", "ready mine 1.0", "inertia", "moment", "setting", "times", "go", "quit", "state")
    assert [word for word in words if word not in program] == []
    tomllib.loads((folder / "gate.toml").read_text())
    (command,) = commands_in(folder / "mine.toml")
    tasks = read(str(folder / "gate.toml"), KINDS)[2]
    assert {task.key.kind for task in tasks} == {"drift", "local_error", "homoclinic", "work_precision"}
    assert min(task.times[0] for task in tasks) < 0  # backward too
    build(folder, language)
    try:
        case, solve = CASES["generic"], registry.ready(command)
        problem, xi = (case.top, case.start, [1, 2], DOUBLE), perpendicular(case.start.gamma)
        runs = solve(*problem), solve(*problem, xi=xi), propagate(*problem, xi=xi)
        run, turned, known = (each.to_numpy() for each in runs)
        assert abs(turned - known).max() < 1e-9
        assert (turned[:, :6] == run).all()
        found = {each.check: each for each in check(command)}
        assert [name for name, each in found.items() if each.verdict != "kept"] == ["huge"]
        assert found["attitude"].text == "The attitude agrees with the reference."
    finally:
        close_all()


@pytest.mark.slow
@pytest.mark.parametrize("method", sorted(METHODS.keys() - {"step"}))
@pytest.mark.parametrize("language", LANGUAGES)
def test_other_methods_have_the_order_that_they_say(language: str, method: str, tmp_path: Path) -> None:
    folder, repository = tmp_path / "repository" / "top", tmp_path / "repository"
    new_integrator(folder, language, method, repository)
    (command,) = commands_in(folder / "mine.toml")
    assert (command.order, command.setting) == ((5, "tolerance") if method == "adaptive" else (4, "step"))
    assert (repository / ".github/workflows/heavytop.yml").exists()
    assert not (folder / ".github").exists()
    build(folder, language)
    case, times = CASES["generic"], [-0.7, -1, -4]
    known = propagate(case.top, case.start, times, DOUBLE).to_numpy()

    def error(control: float) -> tuple[float, int]:
        run = registry.ready(command, (command.setting, control))(case.top, case.start, times, DOUBLE)
        return abs(run.to_numpy() - known).max(), run.steps

    try:
        (coarse, few), (fine, many) = map(error, (1e-5, 1e-8) if method == "adaptive" else (1 / 20, 1 / 80))
        order = log(coarse / fine) / log(many / few)
        assert fine < 1e-6
        assert abs(order - command.order) < 0.6
        if method == "multistep":
            # the memory lasts over 100 spans whose rounding differs: 3 steps of the starting method, 4 evaluations each
            run = registry.ready(command, ("step", Fraction(1, 100)))(
                case.top, case.start, [Fraction(i, 5) for i in range(1, 101)], DOUBLE
            )
            assert (run.steps, run.evaluations) == (2000, 2012)
        if language == "c":
            assert {each.verdict for each in check(command)} <= {"kept", "note"}
    finally:
        close_all()


def test_a_workflow_that_exists_is_not_written_over(tmp_path: Path) -> None:
    in_process.printed("new", "--into", ".", cwd=tmp_path)
    assert (tmp_path / "heavytop" / "mine.py").exists()
    assert "FOLDER: heavytop" in (tmp_path / ".github/workflows/heavytop.yml").read_text()
    for words in (("other", "--into", "."), ("../out", "--into", "."), ()):
        in_process.refused("new", *words, cwd=tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".github", "heavytop"]


def test_a_folder_that_holds_anything_and_an_unknown_language_are_refused(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    (tmp_path / "empty").mkdir()
    wrong = ("new", "cobol"), ("new", "c", "rk"), ("new", "c", "step", None, "drake")
    for folder, *words in (("full", "c"), ("full/file", "c"), *wrong):
        with pytest.raises(InputError) as caught:
            new_integrator(tmp_path / folder, *words)
        assert caught.value.remedy
    assert not (tmp_path / "new").exists()
    assert new_integrator(tmp_path / "empty", "c")


def gate_moves(folder: Path) -> None:
    """The gate refuses to run without a baseline, begins it, finds a mistake, and moves with old and new."""
    plan = 'name = "tiny"\nintegrators = ["mine.toml"]\n[[measure]]\nkind = "work_precision"\ncases = ["euler"]\n'
    ladder = 'horizon = "1"\nsamples = 2\nladders = [{ integrator = "mine", steps = ["1/20", "1/40"] }]\n'
    (folder / "gate.toml").write_text(plan + ladder)

    def gate(*words: str) -> tuple[int, str]:
        done = in_process.heavytop("gate", "--workers", "1", *words, cwd=folder)
        return done.returncode, done.stdout or done.stderr

    code, said = gate()
    assert (code, "heavytop gate --workers 1 --bless" in said) == (2, True)
    assert not (folder / ".heavytop").exists()
    code, said = gate("--bless")
    assert code == 0
    assert said.startswith("Begin the baseline of accuracy\n\nThe smallest error is ")
    assert "\nPlan tiny: 2 measurements" in said
    text = (folder / "mine.py").read_text()
    (folder / "mine.py").write_text(text.replace("p + 2 * q", "p + 2.001 * q"))
    code, said = gate("--json")
    assert (code, json.loads(said)["verdict"]) == (1, "worse")
    code, said = gate("--bless")
    message = (folder / ".heavytop" / "new" / "message.txt").read_text()
    assert (code, message in said) == (0, True)
    assert message.startswith("Move the baseline of accuracy: worse\n\n")
    assert re.search(r"^worse: work_precision euler/T=1 mine step=1/40 double: digits right \S+ → \S+", message, re.M)
    kept = sorted(each.name for each in (folder / ".heavytop" / "baseline").iterdir())
    assert kept == ["report.json", "report.json.sha256"]
    (folder / "mine.py").write_text(text)
    (folder / ".heavytop" / "baseline" / "report.json.sha256").unlink()
    done = in_process.heavytop("gate", "--workers", "1", cwd=folder)
    assert (done.returncode, "baseline has no report.json.sha256" in done.stderr) == (0, True)
    (folder / ".heavytop" / "new" / "notes").touch()
    code, said = gate()
    assert (code, "already contains" in said) == (2, True)


@pytest.mark.slow
def test_from_nothing_to_a_gate_on_the_command_line(tmp_path: Path) -> None:
    def heavytop(*words: str) -> int:
        return in_process.heavytop(*words, cwd=tmp_path).returncode

    assert heavytop("new", "mine", "--language", "python") == 0
    assert heavytop("new", "mine", "--language", "python") == 2
    assert heavytop("check-integrator", "mine/mine.toml") == 0
    assert heavytop("check-integrator", "mine/absent.toml") == 2
    gate_moves(tmp_path / "mine")
    program = tmp_path / "mine" / "mine.py"
    program.write_text(program.read_text().replace("map(repr, y)", 'map("{:.6g}".format, y)'))
    assert heavytop("check-integrator", "mine/mine.toml") == 1


def test_a_question_mark_lists_the_engines() -> None:
    assert in_process.printed("new", "--engine", "?").split() == engines()
