"""What is said where an extra is not installed, and that the core goes on without any."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from heavytop import extras
from heavytop.errors import MissingExtra
from support.helpers import python, without_progress
from support.in_process import HERE
from without_extras import CORE, MOTION, NEEDS, says_so, without


def test_the_extras_are_those_of_the_project() -> None:
    project = tomllib.loads((HERE / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert project.keys() >= extras.EXTRAS.keys() == NEEDS.keys()
    page = (HERE / "docs" / "install.md").read_text("utf-8")
    assert all(f"`{name}`" in page for name in project)


@pytest.mark.slow
@pytest.mark.parametrize("names", [("claims", "multiword", "parquet", "plots"), ("peers", "cluster", "logs")])
def test_a_command_that_lacks_its_extra_says_so_and_the_core_goes_on(names: tuple[str, ...], tmp_path: Path) -> None:
    lacking = [(name, command) for name in names for command in NEEDS[name]]
    core = [CORE[0], CORE[-1]]
    commands = [*(command for _, command in lacking), *core]
    ends = [(code, without_progress(errors)) for code, errors in without([*names], commands, tmp_path)]
    for (name, command), end in zip(lacking, ends[: len(lacking)], strict=True):
        assert says_so(name, *end), (command, end)
    assert ends[len(lacking) :] == [(0, "")] * len(core)
    page = (tmp_path / "page.html").read_text("utf-8")
    assert ("pip install &#39;heavytop[plots]&#39;" in page) == ("plots" in names)


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
    assert python("-c", script, *command).stderr.strip() == modules
