"""The plan of rooms, enforced by reading the imports."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import heavytop
from heavytop.kinds import KINDS

ALSO_WORDS = {"drift", "growth", "audit", "score", "local_error", "hunt"}
"""Names that are quantities, sections or commands as well."""
SOURCE = Path(__file__).parents[1] / "src" / "heavytop"
GROUND = {"display", "errors", "files", "guard", "precision", "processes", "records", "version", "written_numbers"}
FLOORS = (
    {"top"},
    {"multiword"},
    {"exact"},
    {"claims"},
    {"cases"},
    {"integrate"},
    {"measure"},
    {"event_times"},
    {"diagnose"},
    {"trajectories"},
    {"suite"},
    {"document"},
    {"store"},
    {"comparison"},
    {"render"},
    {"kinds"},
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


def room(path: Path) -> str:
    first = path.relative_to(SOURCE).parts[0]
    return first.removesuffix(".py")


FILES = sorted(SOURCE.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_room_imports_only_from_rooms_below_it(path: Path) -> None:
    own = room(path)
    used = {name.split(".")[1] for name in read(path).imports if name.startswith("heavytop.")}
    assert used - {own} <= MAY_IMPORT[own]


def test_only_one_file_builds_engines_of_heyoka() -> None:
    for path in FILES:
        if path.name != "engines.py":
            assert "taylor_adaptive" not in path.read_text("utf-8"), path


def test_only_the_command_line_prints() -> None:
    for path in FILES:
        if path.parent.name != "cli":
            assert "print" not in read(path).calls, path


def test_the_name_of_a_kind_stands_in_its_own_file() -> None:
    for path in FILES:
        # `audit` and `score` are commands too, and the rows of a score are made by its room
        own = {path.stem} if path.parent.name == "kinds" else set()
        if path.stem not in ("score", "audit", "__init__", "growth_laws"):
            assert not read(path).said & KINDS.keys() - own - ALSO_WORDS, path


def test_no_files_import_one_another_in_a_circle() -> None:
    names = {path: ".".join(("heavytop", *path.relative_to(SOURCE).with_suffix("").parts)) for path in FILES}
    modules = {name.removesuffix(".__init__"): path for path, name in names.items()}
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
