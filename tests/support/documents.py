"""The code blocks of README and docs, and a folder to run them in."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts),
]
_FENCE = re.compile(r" *(```+|~~~+)(.*)")
_COMMENT = re.compile(r"<!-- (not run|file|printed): (.+) -->")
_EXIT_CODE = re.compile(r"^(.*\S)\s+# exit code (\d+)\b.*$", re.M)


class Block(NamedTuple):
    """A fenced block: the word after its fence, its text, and what the comment above it says."""

    line: int
    language: str
    text: str
    not_run: str
    file: str
    printed: str = ""
    """Says of which commands above this is what they print."""


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in its order."""
    found: list[Block] = []
    fence, said, lines, began, language = "", {}, [], 0, ""
    for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
        match, comment = _FENCE.fullmatch(line), _COMMENT.fullmatch(line.strip())
        if fence:
            if match and match[1] == fence and not match[2].strip():
                text = "\n".join(lines) + "\n"
                comments = (said.get(key, "") for key in ("not run", "file", "printed"))
                found.append(Block(began, language, text, *comments))
                fence, said, lines = "", {}, []
            else:
                lines.append(line)
        elif match:
            fence, began, language = match[1], number, match[2].strip()
        elif comment:
            said[comment[1]] = comment[2]
        elif line.strip():
            said = {}
    assert not fence, f"{page.name}:{began}: this fence is not closed"
    return found


def folder_like_a_checkout(folder: Path) -> dict[str, str]:
    """Make in ``folder`` what commands of a page find in a checkout with its .venv; returns their environment."""
    for name in ("docs", "results", "src"):
        (folder / name).symlink_to(ROOT / name)
    subprocess.run(["cp", "-r", str(ROOT / "examples"), str(folder)], check=True)
    programs, packages = folder / ".venv" / "bin", folder / ".venv" / "packages"
    programs.mkdir(parents=True)
    packages.mkdir()
    for name, command in (
        ("python", ""),
        ("heavytop", "-m heavytop"),
        ("pip", f"-m pip --disable-pip-version-check --quiet install --target {packages}"),
    ):
        rest = 'shift\nexec "$python" ' + command + ' "$@"' if name == "pip" else f'exec "$python" {command} "$@"'
        script = programs / name
        script.write_text(f'#!/bin/sh\npython="{sys.executable}"\n{rest}\n')
        script.chmod(0o755)
    return os.environ | {
        "PATH": f"{programs}:{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(filter(None, [str(packages), str(folder), os.environ.get("PYTHONPATH")])),
        "MPLBACKEND": "Agg",
        "COLUMNS": "100",
    }


def run_shell(text: str, folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a block with bash; every command must succeed, or end with what its comment ``# exit code N`` says."""
    script = _EXIT_CODE.sub(r'code=0; \1 || code=$?; [ "$code" -eq \2 ]', text)
    return subprocess.run(
        ["bash", "-eu", "-o", "pipefail", "-c", script],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
