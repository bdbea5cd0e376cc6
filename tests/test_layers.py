"""The plan of rooms, enforced by reading the imports."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import heavytop
from heavytop.features.kinds import KINDS

ALSO_WORDS = {"drift", "growth", "audit", "score", "local_error", "hunt"}
"""Names that are quantities, sections or commands as well."""
SOURCE = Path(__file__).parents[1] / "src" / "heavytop"
FEATURES = {f"features.{path.name}" for path in (SOURCE / "features").iterdir() if path.is_dir()} - {
    "features.__pycache__"
}
GROUND = {"display", "errors", "files", "guard", "precision", "processes", "records", "version", "written_numbers"}
FLOORS = (
    {"top"},
    {"arguments"},
    {"multiword"},
    {"exact"},
    {"cases"},
    {"integrate"},
    {"measure"},
    {"harness"},
    {"report.document"},
    {"report.store"},
    {"report.compare"},
    {"report.render"},
    {"kind"},
    {"cli.output"},
    {"cli.app"},
    FEATURES,
    {"features.kinds"},
    {"api"},
    {"cli", "pytest_plugin", "__init__"},
    {"__main__"},
)
"""The rooms from the ground up: each imports only from those before it."""
MAY_IMPORT = {
    "errors": set(),
    "display": set(),
    "files": {"errors"},
    "precision": {"errors"},
    "guard": set(),
    "processes": {"guard"},
    "records": {"errors", "precision"},
    "version": set(),
    "written_numbers": {"errors", "precision"},
    "features": set(),
    "report": set(),
} | {room: GROUND.union(*FLOORS[:floor]) for floor, rooms in enumerate(FLOORS) for room in rooms}


class Read(NamedTuple):
    """What the tests here ask of a file; its tree is not kept."""

    imports: set[str]
    used: set[str]
    """What it imports, at its head or when it is used; not for types alone."""
    calls: set[str]
    said: set[str]
    annotations: list[bool]
    """Of each annotation, whether Any stands in it."""
    classes: list[str]


@cache
def read(path: Path) -> Read:
    tree = ast.parse(path.read_text("utf-8"))
    found = Read(set(), set(), set(), set(), [], [n.name for n in tree.body if isinstance(n, ast.ClassDef)])
    for_types: set[int] = set()
    for node in ast.walk(tree):  # a block before what it holds
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for_types |= {id(each) for each in ast.walk(node)}
        elif isinstance(node, ast.Import):
            names = {alias.name for alias in node.names}
            found.imports.update(names)
            found.used.update(names if id(node) not in for_types else ())
        elif isinstance(node, ast.ImportFrom):
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found.imports.update({node.module} | (names if node.module == "heavytop" else set()))
            found.used.update({node.module, *names} if id(node) not in for_types else ())
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.calls.add(node.func.id)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.said.add(node.value)
        annotation = getattr(node, "returns" if isinstance(node, ast.FunctionDef) else "annotation", None)
        if annotation is not None:
            found.annotations.append("Any" in {getattr(each, "id", "") for each in ast.walk(annotation)})
    return found


def room(module: str) -> str:
    """The room of a module of heavytop: the longest of their names that its own begins with."""
    inside = module.removeprefix("heavytop.")
    return max((name for name in MAY_IMPORT if f"{inside}.".startswith(f"{name}.")), key=len)


def module_of(path: Path) -> str:
    return ".".join(("heavytop", *path.relative_to(SOURCE).with_suffix("").parts))


FILES = sorted(SOURCE.rglob("*.py"))
LEFT = {
    "cases.py features.claims",
    "harness/case_text.py features.score",
    "harness/plan.py features.survey",
    "report/compare/compare.py features.survey",
    "report/compare/findings.py features.local_error",
    "report/compare/findings.py features.work_precision",
    "report/render/motion.py features.events",
    "report/render/page.py features.work_precision",
    "kind.py features.score",
    "features/homoclinic/kind.py features.claims",
    "features/derivatives/api.py features.score",
    "cli/app.py api",
    "features/claims/command.py features.kinds",
    "features/score/api.py features.kinds",
}
"""Imports that still go upwards, or from one feature into another."""


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_room_imports_only_from_rooms_below_it(path: Path) -> None:
    own = room(module_of(path))
    used = {room(name) for name in read(path).imports if name.startswith("heavytop.")} - {own, "features", "report"}
    upward = {f"{path.relative_to(SOURCE).as_posix()} {name}" for name in used - MAY_IMPORT[own]}
    assert upward <= LEFT


def test_only_one_file_builds_engines_of_heyoka() -> None:
    for path in FILES:
        if path.name != "engines.py":
            assert "taylor_adaptive" not in path.read_text("utf-8"), path


def test_only_the_command_line_prints() -> None:
    for path in FILES:
        if path.parent.name != "cli" and path.name != "command.py":
            assert "print" not in read(path).calls, path


def test_the_name_of_a_kind_stands_in_its_own_feature() -> None:
    for path in FILES:
        own = {name for name, kind in KINDS.items() if room(type(kind).__module__) == room(module_of(path))}
        assert not read(path).said & KINDS.keys() - own - ALSO_WORDS, path


def test_no_files_import_one_another_in_a_circle() -> None:
    modules = {module_of(path).removesuffix(".__init__"): path for path in FILES}
    graph = {name: {each for each in read(path).used if each in modules} - {name} for name, path in modules.items()}
    while leaves := {name for name, used in graph.items() if not used & graph.keys()}:
        graph = {name: used for name, used in graph.items() if name not in leaves}
    assert not graph


def test_no_file_is_longer_than_anyone_reads() -> None:
    for path in SOURCE.rglob("*.py"):
        assert len(path.read_text("utf-8").splitlines()) <= 700, path


def test_no_room_hides_a_public_name() -> None:
    assert not {path.stem for path in SOURCE.iterdir() if path.suffix in ("", ".py")} & set(heavytop.__all__)


TWO_MEANINGS = {"Integrator", "Report", "Section"}
"""Of the Python interface, each with its namesake behind it."""


def test_a_public_class_name_has_one_meaning() -> None:
    places = Counter(name for path in FILES for name in read(path).classes if not name.startswith("_"))
    assert {name for name, count in places.items() if count > 1} == TWO_MEANINGS


MOST_ANY = 0.08
"""Of the annotations, those in which Any stands."""


def test_few_annotations_say_nothing() -> None:
    silent = [says_any for path in FILES for says_any in read(path).annotations]
    assert sum(silent) / len(silent) <= MOST_ANY
