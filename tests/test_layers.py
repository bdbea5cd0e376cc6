"""The plan of rooms, enforced by reading the imports; each feature can be deleted.

One a run, chosen by the commit; all of them by ``python -m validation.deletion``.
"""

import ast
import subprocess
import sys
import zlib
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import heavytop
import layout_picture
from heavytop import features
from heavytop.features.kinds import KINDS
from heavytop.version import commit

ALSO_WORDS = {"drift", "growth", "audit", "score", "local_error", "hunt"}
"""Names that are quantities, sections or commands as well."""
SOURCE = Path(__file__).parents[1] / "src" / "heavytop"
FEATURES = {f"features.{name}" for name in features.NAMES}
GROUND = {
    "errors": set(),
    "display": set(),
    "extras": {"errors"},
    "feature": set(),
    "features": {"feature"},
    "files": {"errors"},
    "guard": set(),
    "precision": {"errors", "extras"},
    "processes": {"guard"},
    "records": {"errors", "precision"},
    "version": set(),
    "written_numbers": {"errors", "precision"},
}
"""What each file of the ground imports; the rest imports any of them."""
FLOORS = (
    {"top"},
    {"arguments"},
    {"multiword"},
    {"exact"},
    {"cases"},
    {"integrate"},
    {"measure"},
    {"harness"},
    {"report", "report.document"},
    {"report.store"},
    {"report.compare"},
    {"report.render"},
    {"kind"},
    {"features.kinds"},
    {"cli.output"},
    {"cli.app"},
    FEATURES,
    {"api"},
    {"__init__"},
    {"cli", "pytest_plugin"},
    {"__main__"},
)
"""The rooms from the ground up: each imports only from those before it, and none a feature."""
MAY_IMPORT = GROUND | {
    room: GROUND.keys() | set().union(*FLOORS[:floor]) - FEATURES
    for floor, rooms in enumerate(FLOORS)
    for room in rooms
}
MAY_IMPORT["__init__"] |= FEATURES  # their names, for type checkers


class Read(NamedTuple):
    """What the tests here ask of a file; its tree is not kept."""

    imports: set[str]
    """At its head, when it is used, and for types alone."""
    calls: set[str]
    said: set[str]
    annotations: list[bool]
    """Of each annotation, whether Any stands in it."""
    classes: list[str]


@cache
def read(path: Path) -> Read:
    tree = ast.parse(path.read_text("utf-8"))
    found = Read(set(), set(), set(), [], [n.name for n in tree.body if isinstance(n, ast.ClassDef)])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.imports.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found.calls.add(node.func.id)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.said.add(node.value)
        annotation = getattr(node, "returns" if isinstance(node, ast.FunctionDef) else "annotation", None)
        if annotation is not None:
            found.annotations.append("Any" in {getattr(each, "id", "") for each in ast.walk(annotation)})
    return found


def room(module: str) -> str:
    """The room of a module of heavytop, the longest of their names that its own begins with; of others the public."""
    inside = module.removeprefix("heavytop.")
    return max((name for name in MAY_IMPORT if f"{inside}.".startswith(f"{name}.")), key=len, default="__init__")


def module_of(path: Path) -> str:
    return ".".join(("heavytop", *path.relative_to(SOURCE).with_suffix("").parts))


FILES = sorted(SOURCE.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_room_imports_only_from_rooms_below_it(path: Path) -> None:
    own = room(module_of(path))
    assert {room(name) for name in read(path).imports if name.startswith("heavytop.")} - {own} <= MAY_IMPORT[own]


def test_only_one_file_builds_engines_of_heyoka() -> None:
    for path in FILES:
        if path.name != "engines.py":
            assert "taylor_adaptive" not in path.read_text("utf-8"), path


def test_only_the_command_line_prints() -> None:
    for path in FILES:
        if path.parent.name != "cli" and path.name != "command.py":
            assert "print" not in read(path).calls, path


def test_the_name_of_a_kind_stands_in_its_own_feature() -> None:
    for path in set(FILES) - {SOURCE / "features" / "__init__.py"}:
        own = {name for name, kind in KINDS.items() if room(type(kind).__module__) == room(module_of(path))}
        assert not read(path).said & KINDS.keys() - own - ALSO_WORDS, path


def test_no_files_import_one_another_in_a_circle() -> None:
    modules = {module_of(path).removesuffix(".__init__"): path for path in FILES}

    def imported(name: str) -> str:
        return name if name in modules else name.rpartition(".")[0]

    graph = {name: {*map(imported, read(path).imports)} & modules.keys() - {name} for name, path in modules.items()}
    while leaves := {name for name, used in graph.items() if not used & graph.keys()}:
        graph = {name: used for name, used in graph.items() if name not in leaves}
    assert not graph


def test_no_room_hides_a_public_name() -> None:
    assert not {path.stem for path in SOURCE.iterdir() if path.suffix in ("", ".py")} & set(heavytop.__all__)


TWO_MEANINGS = {"Integrator", "Report", "Section", "Engine"}
"""Of the Python interface, each with its namesake behind it; and what an adapter of each engine has."""


def test_a_public_class_name_has_one_meaning() -> None:
    places = Counter(name for path in FILES for name in read(path).classes if not name.startswith("_"))
    assert {name for name, count in places.items() if count > 1} <= TWO_MEANINGS


MOST_ANY = 0.08
"""Of the annotations, those in which Any stands."""


def test_few_annotations_say_nothing() -> None:
    silent = [says_any for path in FILES for says_any in read(path).annotations]
    assert sum(silent) / len(silent) <= MOST_ANY


CHOSEN = features.NAMES[zlib.crc32((commit() or "").encode()) % len(features.NAMES)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "printed"),
    [([CHOSEN], 0, "can be deleted"), (["events", "--plant"], 1, "without events: imports")],
    ids=["as it is", "a shared room imports it"],
)
def test_a_feature_can_be_deleted_unless_a_shared_room_imports_it(
    arguments: list[str], code: int, printed: str
) -> None:
    line = [sys.executable, "-m", "validation.deletion", *arguments, "--few"]
    done = subprocess.run(line, cwd=SOURCE.parents[1], capture_output=True, text=True)
    assert (done.returncode, printed in done.stdout) == (code, True), done.stdout


def test_the_picture_of_the_rooms_is_that_of_the_imports() -> None:
    assert layout_picture.PICTURE.read_text("utf-8") == layout_picture.svg(), "python tools/layout_picture.py"
    order = layout_picture.ROOMS.index
    assert all(order(there) <= order(here) for here, there in layout_picture.counts())
