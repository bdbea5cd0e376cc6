"""What is said where an extra is not installed, and that the core goes on without any."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from heavytop import extras
from heavytop.errors import MissingExtra
from support.in_process import HERE

TOP = ("--inertia", "3,2,1", "--weight", "1", "--centre", "1/2,1/3,1/5")
START = ("--omega", "1/10,2/5,9/10", "--gamma", "3/5,0,4/5", "--times", "1")
MOTION = (*TOP, *START)
REPORT = HERE / "results" / "default"
NEEDS = {
    "claims": (["audit", "ershkov-partial"], ["claims"], ["run", "--plan", "smoke", "--out", "x"]),
    "multiword": (["propagate", *MOTION, "--integrator", "multiword"],),
    "parquet": (["show", REPORT, "--parquet", "x.parquet"], ["run", "--plan", "gate", "--parquet", "--out", "x"]),
    "plots": (["figures", "--out", "x"], ["history", REPORT, REPORT, "--html", "x.html"]),
}


SCRIPT = """
import contextlib, io, json, sys
hidden, commands = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(hidden))
from heavytop.__main__ import main
ends = []
for sys.argv in commands:
    with contextlib.redirect_stderr(io.StringIO()) as errors, contextlib.redirect_stdout(io.StringIO()):
        try:
            main()
        except SystemExit as ended:
            ends.append((ended.code, errors.getvalue()))
print(json.dumps(ends))
"""


def without(*commands: list[object], cwd: Path) -> list[tuple[int, str]]:
    """Exit code and standard error of ``heavytop COMMAND`` where no extra is installed, all in one process."""
    hidden = [module for name in NEEDS for module in extras.EXTRAS[name]]
    request = json.dumps([hidden, [["heavytop", *map(str, command)] for command in commands]])
    line = [sys.executable, "-c", SCRIPT, request]
    done = subprocess.run(line, capture_output=True, text=True, cwd=cwd, timeout=120, check=True)
    return [(code, errors) for code, errors in json.loads(done.stdout)]


def test_the_extras_are_those_of_the_project() -> None:
    project = tomllib.loads((HERE / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert project.keys() >= extras.EXTRAS.keys()
    assert {*project["all"][0].removeprefix("heavytop[").rstrip("]").split(",")} == NEEDS.keys()


@pytest.mark.slow
def test_a_command_that_lacks_its_extra_says_so_in_one_sentence_and_the_core_goes_on(tmp_path: Path) -> None:
    lacking = [(name, command) for name, commands in NEEDS.items() for command in commands]
    core = [["propagate", *MOTION], ["reference", *MOTION], ["show", REPORT, "--html", "page.html"]]
    ends = without(*(command for _, command in lacking), *core, cwd=tmp_path)
    for (name, _), (code, errors) in zip(lacking, ends[: len(lacking)], strict=True):
        assert code == 2
        assert errors.endswith(f"needs the extra {name}: pip install 'heavytop[{name}]'\n")
        assert len(errors.splitlines()) == 1
    assert ends[len(lacking) :] == [(0, "")] * len(core)
    assert [file.name for file in tmp_path.iterdir()] == ["page.html"]
    assert "pip install &#39;heavytop[plots]&#39;" in (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.parametrize("place", ["features.claims.algebra", "features.claims.audit"])
def test_rooms_of_sympy_say_what_they_need(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    hide(monkeypatch, "sympy")
    monkeypatch.delitem(sys.modules, f"heavytop.{place}", raising=False)
    with pytest.raises(MissingExtra, match=r"heavytop\[claims\]"):
        import_module(f"heavytop.{place}")


def hide(monkeypatch: pytest.MonkeyPatch, *modules: str) -> None:
    found: Callable[[str], object] = find_spec
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name in modules else found(name))


@pytest.mark.slow
@pytest.mark.parametrize(("command", "modules"), [(("propagate", *MOTION), "heyoka"), (("list",), "")])
def test_a_command_loads_no_more_than_it_needs(command: tuple[str, ...], modules: str) -> None:
    script = """
import contextlib, sys
from heavytop.__main__ import main
with contextlib.suppress(SystemExit):
    main()
loaded = {"heyoka", "sympy", "mpmath", "llvmlite.binding", "pydantic", "loky"} & sys.modules.keys()
import mpmath, sympy
assert (sympy.Integer(1), mpmath.mpf(1)) == (1, 1)
sys.exit(" ".join(loaded))
"""
    done = subprocess.run([sys.executable, "-c", script, *command], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == modules
