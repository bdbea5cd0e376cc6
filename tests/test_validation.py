"""Scripts outside of the package: each attack stands in the table of validation/, and every script can be imported."""

import ast
import importlib
import re
import runpy
from itertools import chain
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = [path for folder in ("benchmarks", "tools", "validation") for path in sorted((ROOT / folder).glob("*.py"))]


def test_the_table_of_attacks_names_each_script_and_no_other() -> None:
    folder = ROOT / "validation"
    named = set(re.findall(r"\b[a-z_]+\.(?:py|toml)\b", (folder / "README.md").read_text("utf-8")))
    assert named == {path.name for path in folder.iterdir() if path.suffix in (".py", ".toml")}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_what_a_script_takes_from_the_package_is_there(script: Path) -> None:
    """Its imports alone are looked up: to import the script would run some, and need what not everybody has."""
    for node in ast.walk(ast.parse(script.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "heavytop":
            module = importlib.import_module(node.module)
            for name in (alias.name for alias in node.names):
                assert hasattr(module, name) or importlib.import_module(f"{node.module}.{name}"), name


def test_the_functions_whose_time_is_measured_are_there() -> None:
    script = runpy.run_path(str(ROOT / "tools" / "plan_times.py"))
    for owner, attribute in map(script["owner"], chain(*script["PARTS"].values())):
        assert callable(getattr(owner, attribute))
