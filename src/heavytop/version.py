"""Which version this is, and which commit it was made from."""

from __future__ import annotations

import subprocess
from importlib import metadata
from pathlib import Path


def version() -> str:
    """The version of the package."""
    return metadata.version("heavytop")


def commit() -> str | None:
    """The commit of the checkout that the program runs from, with "-dirty" where files differ from it; else the one
    that the wheel was built from (``hatch_build.py`` records it); None where neither is known.
    """
    return _of_checkout() or recorded()


def recorded() -> str | None:
    """The commit that the installed wheel was built from."""
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
        done = subprocess.run(
            ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=40", "--match="],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
