"""What a fresh machine installs: everything pinned, with hashes and without addresses; two commands in the README."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from heavytop import version

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
    ("file", "extras"),
    [("run.txt", []), ("test.txt", ["test", "peers", "parquet", "cluster"]), ("docs.txt", ["docs"])],
    ids=["run", "test", "docs"],
)
def test_every_dependency_is_pinned_with_hashes_and_without_addresses(file: str, extras: list[str]) -> None:
    wanted = names(PROJECT["dependencies"]) | {"hatchling"}
    for extra in extras:
        wanted |= names(PROJECT["optional-dependencies"][extra])
    assert wanted <= set(pinned(file))


def versions(file: str) -> set[str]:
    return set(re.findall(r"^[\w.-]+==\S+", (ROOT / "constraints" / file).read_text("utf-8"), re.M))


@pytest.mark.slow
def test_all_files_pin_the_same_versions() -> None:
    assert versions("run.txt") <= versions("test.txt")
    assert versions("run.txt") <= versions("docs.txt")
    both = versions("test.txt") | versions("docs.txt")
    for name in {text.split("==")[0] for text in both}:
        told = [{v for v in versions(file) if v.startswith(f"{name}==")} for file in ("test.txt", "docs.txt")]
        assert not all(told) or told[0] == told[1], name


def test_the_quick_start_is_two_commands() -> None:
    first = (ROOT / "README.md").read_text("utf-8").split("```")[1].strip().splitlines()
    assert len(first) == 2
    assert first[0].endswith("heavytop run")
    assert "-m pytest" in first[1]


def git(folder: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
    done = subprocess.run(["git", "-C", folder, *identity, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def build(folder: Path, kind: str) -> Path:
    """The wheel or sdist that the project in ``folder`` makes, without a build environment of its own."""
    out = folder.parent / f"{folder.name}-{kind}"
    code = f"import hatchling.build; print(hatchling.build.build_{kind}({str(out)!r}))"
    out.mkdir()
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out / done.stdout.splitlines()[-1]


def recorded(wheel: Path) -> str | None:
    with zipfile.ZipFile(wheel) as content:
        names = [name for name in content.namelist() if name.endswith(".dist-info/extra_metadata/commit.txt")]
        return content.read(names[0]).decode().strip() if names else None


@pytest.mark.slow
def test_a_wheel_records_its_commit_also_by_way_of_an_sdist(tmp_path: Path) -> None:
    project = tmp_path / "project"
    (project / "src" / "heavytop").mkdir(parents=True)
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "src/heavytop/version.py"):
        shutil.copy(ROOT / name, project / name)
    assert recorded(build(project, "wheel")) is None, "no git, and nothing recorded"
    git(project, "init", "--quiet")
    git(project, "add", ".")
    git(project, "commit", "--quiet", "--message", "all")
    commit = git(project, "rev-parse", "HEAD")
    clean = project.rename(tmp_path / "clean")
    assert recorded(build(clean, "wheel")) == commit
    with tarfile.open(build(clean, "sdist")) as content:
        content.extractall(tmp_path / "elsewhere", filter="data")
    (unpacked,) = (tmp_path / "elsewhere").iterdir()
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "commit", "--quiet", "--allow-empty", "--message", "another project around it")
    assert recorded(build(unpacked, "wheel")) == commit
    (clean / "README.md").write_text("changed")
    dirty = clean.rename(tmp_path / "dirty")
    assert recorded(build(dirty, "wheel")) == f"{commit}-dirty"


def test_the_commit_of_a_checkout_is_read_without_a_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = tmp_path / "src" / "heavytop" / "version.py"
    module.parent.mkdir(parents=True)
    for file in (module, tmp_path / "pyproject.toml"):
        file.write_text("")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "--message", "all")
    os.utime(module, (1, 1))  # git would note the new time in its index
    index = (tmp_path / ".git" / "index").read_bytes()
    monkeypatch.setattr(version, "__file__", str(module))
    assert version.commit() == git(tmp_path, "rev-parse", "HEAD")
    assert (tmp_path / ".git" / "index").read_bytes() == index
    module.write_text("changed")
    assert version.commit() == git(tmp_path, "rev-parse", "HEAD") + "-dirty"
