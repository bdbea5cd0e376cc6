"""The plan of rooms, enforced by reading the imports."""

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "heavytop"
GROUND = {"display", "errors", "precision", "processes", "records", "version"}
MAY_IMPORT = {
    "errors": set(),
    "precision": {"errors"},
    "display": set(),
    "processes": set(),
    "records": set(),
    "version": set(),
    "top": GROUND,
    "words": GROUND | {"top"},
    "exact": GROUND | {"top", "words"},
    "claims": GROUND | {"top", "exact"},
    "integrate": GROUND | {"top", "words"},
    "measure": GROUND | {"top", "exact", "claims", "integrate"},
    "suite": GROUND | {"top", "exact", "claims", "integrate", "measure"},
    "report": GROUND | {"top", "exact", "claims", "integrate", "measure", "suite"},
    "cli": GROUND | {"top", "exact", "claims", "integrate", "measure", "suite", "report"},
    "api": GROUND | {"top", "exact", "claims", "integrate", "measure", "suite", "report"},
    "__main__": {"cli"},
    "__init__": GROUND | {"top", "integrate", "measure", "api"},
}


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names if node.module == "heavytop"}
    return found


def room(path: Path) -> str:
    first = path.relative_to(SOURCE).parts[0]
    return first.removesuffix(".py")


FILES = sorted(SOURCE.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_room_imports_only_from_rooms_below_it(path: Path) -> None:
    own = room(path)
    used = {name.split(".")[1] for name in imports(path) if name.startswith("heavytop.")}
    assert used - {own} <= MAY_IMPORT[own]


def test_only_one_file_builds_engines_of_heyoka() -> None:
    for path in FILES:
        if path.name != "engines.py":
            assert "taylor_adaptive" not in path.read_text("utf-8"), path


def test_only_the_command_line_prints() -> None:
    for path in FILES:
        calls = [n for n in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(n, ast.Call)]
        if path.parent.name != "cli":
            assert not [c for c in calls if isinstance(c.func, ast.Name) and c.func.id == "print"], path
