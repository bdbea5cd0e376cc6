"""Version and commit of the program."""

from __future__ import annotations

import re
import subprocess
from importlib import metadata
from pathlib import Path


def version() -> str:
    """The version of the package."""
    return metadata.version("heavytop")


def commit() -> str | None:
    """The commit of the checkout that the program runs from, with "-dirty" if files differ from it; else that of the
    wheel (recorded by ``hatch_build.py``); None if both are unknown.
    """
    return _of_checkout() or recorded()


def recorded() -> str | None:
    """The commit of the installed wheel."""
    try:
        text = metadata.distribution("heavytop").read_text("extra_metadata/commit.txt")
    except metadata.PackageNotFoundError:
        return None
    return text.strip() if text else None


def _of_checkout() -> str | None:
    here = Path(__file__).resolve().parent
    if not (here.parents[1] / "pyproject.toml").exists():
        return None  # an installed copy may lie inside somebody else's repository
    try:
        completed = subprocess.run(
            # without a lock, which a run that is killed would leave behind
            ["git", "--no-optional-locks", "status", "--porcelain=v2", "--branch", "--untracked-files=no"],
            cwd=here,
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    found = re.search(r"^# branch\.oid ([0-9a-f]{40,})$", completed.stdout, re.M)
    if completed.returncode or found is None:
        return None
    return found[1] + ("" if re.search(r"^[^#]", completed.stdout, re.M) is None else "-dirty")
