"""`heavytop new`: in each language whose compiler is here the folder works at once; the others are complete."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from heavytop.api.integrators import LANGUAGES, new_integrator
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
        assert not re.search(r"\b(COMMAND|LANGUAGE|BUILD|FILE)\b", text), name
        assert max(map(len, text.splitlines())) <= 130, name
    program = (folder / LANGUAGES[language].file).read_text()
    assert program.isascii() or language == "julia"
    for word in (
        "heavytop-integrator",
        "ready mine 1.0",
        "inertia",
        "moment",
        "setting",
        "times",
        "go",
        "quit",
        "state",
    ):
        assert word in program
    tomllib.loads((folder / "gate.toml").read_text())
    (command,) = commands_in(folder / "mine.toml")
    tasks = read(str(folder / "gate.toml"), KINDS)[2]
    assert {task.key.kind for task in tasks} == {"drift", "local_error", "homoclinic", "work_precision"}
    if shutil.which(COMPILERS[language]) is None:
        pytest.skip(f"{COMPILERS[language]} is not installed")
    if "Makefile" in files:
        built = subprocess.run(["make"], cwd=folder, capture_output=True, text=True, check=False)
        assert (built.returncode, built.stderr) == (0, "")
    try:
        case = CASES["generic"]
        run = registry.ready(command)(case.top, case.start, [1, 2], DOUBLE)
        known = propagate(case.top, case.start, [1, 2], DOUBLE)
        assert abs(run.to_numpy() - known.to_numpy()).max() < 1e-9
        xi = perpendicular(case.start.gamma)
        turned, known = (
            each(case.top, case.start, [1, 2], DOUBLE, xi=xi) for each in (registry.ready(command), propagate)
        )
        assert abs(turned.to_numpy() - known.to_numpy()).max() < 1e-9
        assert (turned.to_numpy()[:, :6] == run.to_numpy()).all()
        found = {each.check: each for each in check(command)}
        assert [name for name, each in found.items() if each.verdict != "kept"] == ["huge"]
        assert found["attitude"].text == "It carries the attitude."
    finally:
        close_all()


def test_a_folder_that_holds_anything_and_an_unknown_language_are_refused(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    (tmp_path / "empty").mkdir()
    for folder, language in ((tmp_path / "full", "c"), (tmp_path / "full" / "file", "c"), (tmp_path / "new", "cobol")):
        with pytest.raises(InputError) as caught:
            new_integrator(folder, language)
        assert caught.value.remedy
    assert not (tmp_path / "new").exists()
    assert new_integrator(tmp_path / "empty", "c")


@pytest.mark.slow
def test_from_nothing_to_a_gate_on_the_command_line(tmp_path: Path) -> None:
    def heavytop(*words: str) -> int:
        return in_process.heavytop(*words, cwd=tmp_path).returncode

    assert heavytop("new", "mine", "--language", "python") == 0
    assert heavytop("new", "mine", "--language", "python") == 2
    assert heavytop("check-integrator", "mine/mine.toml") == 0
    assert heavytop("check-integrator", "mine/absent.toml") == 2
    program = tmp_path / "mine" / "mine.py"
    program.write_text(program.read_text().replace("map(repr, y)", 'map("{:.6g}".format, y)'))
    assert heavytop("check-integrator", "mine/mine.toml") == 1
