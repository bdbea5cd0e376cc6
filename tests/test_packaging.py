"""What a fresh machine installs: everything pinned, with hashes and without addresses; two commands in the README."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def names(requirements: list[str]) -> set[str]:
    return {re.split(r"[<>=\[; ]", text)[0].lower() for text in requirements}


def pinned(file: str) -> dict[str, str]:
    """Name -> the block of lines that pins it."""
    text = (ROOT / "constraints" / file).read_text("utf-8")
    assert "://" not in text
    blocks = re.findall(r"^([\w.-]+)==\S+[^\n]*\n((?:    --hash=sha256:[0-9a-f]{64}[^\n]*\n?)+)", text, re.M)
    assert len(blocks) == len(re.findall(r"^[\w.-]+==", text, re.M))
    return dict(blocks)


@pytest.mark.parametrize(
    ("file", "extras"), [("run.txt", []), ("test.txt", ["test", "peers", "parquet", "cluster"])], ids=["run", "test"]
)
def test_every_dependency_is_pinned_with_hashes_and_without_addresses(file: str, extras: list[str]) -> None:
    wanted = names(PROJECT["dependencies"]) | {"hatchling"}
    for extra in extras:
        wanted |= names(PROJECT["optional-dependencies"][extra])
    assert wanted <= set(pinned(file))


def test_both_files_pin_the_same_versions() -> None:
    run, test = (set(re.findall(r"^[\w.-]+==\S+", (ROOT / "constraints" / f).read_text("utf-8"), re.M))
                 for f in ("run.txt", "test.txt"))  # fmt: skip
    assert run <= test


def test_the_quick_start_is_two_commands() -> None:
    first = (ROOT / "README.md").read_text("utf-8").split("```")[1].strip().splitlines()
    assert len(first) == 2
    assert first[0].endswith("heavytop run")
    assert "-m pytest" in first[1]
