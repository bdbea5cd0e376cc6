"""The imports between the rooms of the package, as a picture: ``python tools/layout_picture.py`` makes docs/layout.svg.

A number says how many files of the room in its row import the room in its column; below the diagonal each imports from
the rooms above it in docs/layout.md alone.
"""

from __future__ import annotations

import ast
from collections import Counter
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "heavytop"
PICTURE = ROOT / "docs" / "layout.svg"
ROOMS = ("ground", "top", "multiword", "exact", "cases", "integrate", "measure", "harness", "report", "features")
ROOMS += ("api", "cli")
"""From the ground up; files of no other room are those of the ground, or of the one that they begin."""
_OF_FILES = {"arguments": "top", "kind": "features", "__main__": "cli", "pytest_plugin": "cli"}
_OF_FILES |= {"cli.app": "features", "cli.output": "features"}
_OF_FILES |= dict.fromkeys(("features.FEATURES", "features.NAMES", "features.__init__"), "ground")
"""Files that belong to another room: what features need of the command line, and the list of them that all read."""
_CELL, _LEFT, _TOP = 40, 90, 76


def room(module: str) -> str:
    """The room of a module of heavytop, by its name behind ``heavytop.``; "" for the public door."""
    if module == "__init__":
        return ""
    head = module.split(".")[0]
    return _OF_FILES.get(".".join(module.split(".")[:2]), _OF_FILES.get(head, head if head in ROOMS else "ground"))


@cache
def imports(path: Path) -> set[str]:
    """The modules of heavytop that a file imports, anywhere and for types too, by their names behind ``heavytop.``."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        modules.update(name.removeprefix("heavytop.") for name in names if name.startswith("heavytop."))
    return modules


def counts() -> Counter[tuple[str, str]]:
    """How many files of the first room import the second."""
    pairs: Counter[tuple[str, str]] = Counter()
    for path in sorted(SOURCE.rglob("*.py")):
        if "starters" in path.parts or "adapters" in path.parts:
            continue
        here = room(".".join(path.relative_to(SOURCE).with_suffix("").parts))
        pairs.update((here, there) for there in {room(name) for name in imports(path)} if here and there)
    return pairs


def svg() -> str:
    """The picture as text."""
    pairs, size = counts(), len(ROOMS) * _CELL
    largest = max(pairs.values())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_LEFT + size + 8} {_TOP + size + 8}" '
        'font-family="sans-serif" font-size="13" role="img">',
        "<title>Files of the room in a row that import the room in a column: all on or below the diagonal</title>",
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for row, here in enumerate(ROOMS):
        y = _TOP + row * _CELL
        parts.append(f'<text x="{_LEFT - 8}" y="{y + 25}" text-anchor="end">{here}</text>')
        x = _LEFT + row * _CELL + 25
        parts.append(f'<text x="{x}" y="{_TOP - 8}" transform="rotate(-60 {x} {_TOP - 8})">{here}</text>')
        for column, there in enumerate(ROOMS):
            count, x = pairs[here, there], _LEFT + column * _CELL
            shade = f' fill-opacity="{0.15 + 0.6 * (count / largest) ** 0.5:.2f}"' if count else ""
            fill = ("#999999" if row == column else "#1f77b4") if count else "none"
            parts.append(
                f'<rect x="{x}" y="{y}" width="{_CELL}" height="{_CELL}" stroke="#cccccc" fill="{fill}"{shade}/>'
            )
            if count:
                parts.append(f'<text x="{x + _CELL // 2}" y="{y + 25}" text-anchor="middle">{count}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    PICTURE.write_text(svg(), "utf-8")
