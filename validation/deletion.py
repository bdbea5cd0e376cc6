"""Whether a feature can be deleted: the rest of the program, its tests and the smoke plan go on without it.

    python -m validation.deletion [FEATURE ...] [--few] [--plant]

Copies the checkout, removes the package of a feature, its line in the registry, its tables and rows in the plans and
reports that ship, and the tests that name it or what it adds.  In the copy every module is imported, the smoke plan is
run, and the quick tests that are left pass; with --few two short rows and some tests of the rooms that all share.
--plant lets a shared room import the feature first, which has to be found.  Exit 1 where one cannot be deleted.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec

from heavytop.feature import Feature
from heavytop.features import FEATURES, NAMES
from heavytop.features.kinds import KINDS
from heavytop.report.store import store

ROOT = Path(__file__).parents[1]
_LINKED = ("docs", "examples", "benchmarks", "validation", "tools", "constraints", "pyproject.toml")
_FEW = ("test_cli_help.py", "report/test_compare.py", "harness/test_plan.py")
_FEW_ROWS = """name = "few"
[[measure]]
kind = "drift"
cases = ["euler"]
runs = [{ precision = "double", horizon = "2", samples = 4 }]
[[measure]]
kind = "local_error"
cases = ["euler"]
precisions = ["double"]
horizon = "1"
"""
_IMPORTS = """
import importlib, pathlib, pkgutil, sys, heavytop
assert pathlib.Path(heavytop.__file__).is_relative_to(sys.argv[1]), heavytop.__file__
for module in pkgutil.walk_packages(heavytop.__path__, "heavytop."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("features", nargs="*", metavar="FEATURE", help="all of them without one")
    parser.add_argument("--few", action="store_true")
    parser.add_argument("--plant", action="store_true")
    asked = parser.parse_args()
    left = [problem for name in asked.features or NAMES for problem in problems_without(name, asked.few, asked.plant)]
    return 1 if left else 0


def problems_without(name: str, few: bool = True, plant: bool = False) -> list[str]:
    """What does not go on without a feature, said as it is found."""
    feature = FEATURES[NAMES.index(name)]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        names = added(feature)
        delete(copy, name, feature)
        if plant:
            with (copy / "src/heavytop/measure/scorer.py").open("a", encoding="utf-8") as file:
                file.write(f"\nfrom {feature.package} import FEATURE\n")
        tests = [str(copy / "tests" / each) for each in _FEW] if few else [str(copy / "tests")]
        tests = [test for test in tests if Path(test).exists()] or [str(copy / "tests" / "test_layers.py")]
        plan = "smoke"
        if few:
            (copy / (plan := "few.toml")).write_text(without_kinds(_FEW_ROWS, kinds_of(feature)), "utf-8")
        checks = {
            "imports": ["-c", _IMPORTS, str(copy)],
            "run": ["-m", "heavytop", "run", "--plan", plan, "--out", str(copy / "out"), "--workers", "1"],
            "tests": ["-m", "pytest", "-q", "-x", "-m", "not slow", "-p", "no:cacheprovider", *tests],
        }
        found = []
        for check, arguments in checks.items():
            done = subprocess.run(
                [sys.executable, *arguments],
                cwd=copy,
                env=os.environ | {"PYTHONPATH": f"{copy / 'src'}{os.pathsep}{copy / 'tests'}"},
                capture_output=True,
                text=True,
            )
            if done.returncode:
                found.append(check)
                print(f"without {name}: {check}\n{done.stdout[-3000:]}{done.stderr[-3000:]}", flush=True)
                break
        print(f"{name} {'is needed' if found else 'can be deleted'}; it adds {', '.join(sorted(names))}", flush=True)
        return found


def kinds_of(feature: Feature) -> set[str]:
    """The names of the kinds of measurement that a feature adds."""
    return {feature.load(kind).name for kind in feature.kinds}


def added(feature: Feature) -> set[str]:
    """The kinds, commands and Python names of a feature."""
    text = "".join(
        Path(str(feature.load(module).__file__)).read_text("utf-8") for module in (*feature.commands, "__init__")
    )
    commands = re.findall(r"^@command\n(?:@\w+\n)*def (\w+)", text, re.M)
    return kinds_of(feature) | {
        *feature.plans,
        *commands,
        *(name for names in feature.python.values() for name in names),
    }


def delete(copy: Path, name: str, feature: Feature) -> None:
    """A copy of the checkout without the feature."""
    for part in ("src", "tests"):
        shutil.copytree(ROOT / part, copy / part)  # with what Python compiled of it
    for part in _LINKED:
        if (ROOT / part).exists():
            (copy / part).symlink_to(ROOT / part)
    package = copy / "src/heavytop/features"
    shutil.rmtree(package / name)
    registry = package / "__init__.py"
    registry.write_text(registry.read_text("utf-8").replace(f'    "{name}",\n', ""), "utf-8")
    kinds = kinds_of(feature)
    for plan in (copy / "src/heavytop/harness/plans").glob("*.toml"):
        plan.write_text(without_kinds(plan.read_text("utf-8"), kinds), "utf-8")
    for report in (ROOT / "results").iterdir():
        (copy / "results").mkdir(exist_ok=True)
        if kinds and any((report / name).exists() for name in (store.FILE, f"{store.FILE}.gz")):
            whole = store.read(report, KINDS)
            (copy / "results" / report.name).mkdir()
            left = [row for row in whole.rows if row.key.kind not in kinds]
            store.write(msgspec.structs.replace(whole, rows=left), copy / "results" / report.name)
        else:
            (copy / "results" / report.name).symlink_to(report)
    shutil.rmtree(copy / "tests/features" / name, ignore_errors=True)
    words = "|".join(map(re.escape, added(feature)))
    naming = re.compile(rf"""features\.{name}\b|kind *= *['"]({words})\b|['"]({words})['"]|\bht\.({words})\b""")
    for test in naming_tests(copy / "tests", naming):
        if test.name != "test_layers.py":
            test.unlink()


def naming_tests(folder: Path, naming: re.Pattern[str]) -> Iterator[Path]:
    """The tests that name something, themselves or in what they import from ``support``."""
    support = {file.stem: bool(naming.search(file.read_text("utf-8"))) for file in (folder / "support").glob("*.py")}
    for file in folder.rglob("test_*.py"):
        text = file.read_text("utf-8")
        used = set(re.findall(r"^\s*from support\.(\w+) import", text, re.M))
        if naming.search(text) or any(support.get(each, False) for each in used):
            yield file


def without_kinds(plan: str, kinds: set[str]) -> str:
    """The text of a plan without the tables of these kinds, and the sweeps and tops that nothing else measures."""
    head, *tables = re.split(r"^(?=\[\[)", plan, flags=re.M)
    kept = [table for table in tables if (m := re.search(r'^kind = "(\w+)"', table, re.M)) is None or m[1] not in kinds]
    measured = "".join(table for table in kept if table.startswith("[[measure]]"))
    for table in [table for table in kept if re.match(r"\[\[(sweep|top)\]\]", table)]:
        found = re.search(r'^name = "([^"]+)"', table, re.M)
        if found and found[1] not in measured:
            kept.remove(table)
    return head + "".join(kept)


if __name__ == "__main__":
    raise SystemExit(main())
