"""Puts the pages of docs/ into the wheel, and records the commit that a distribution is built from.

`heavytop docs` prints the pages.  The commit is in a file of the sdist, and in the metadata of the wheel.  Without git,
and outside of a checkout of this project, a wheel takes what the sdist says; where neither is there it records nothing.
An editable installation asks git at run time instead (:mod:`heavytop.version`).
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NAME = "commit.txt"


class CommitHook(BuildHookInterface):  # type: ignore[type-arg]  # hatchling names no configuration of its builders
    """Adds the pages and ``commit.txt`` to what is built."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the file and tell hatchling what goes where; ``version`` is "standard" or "editable"."""
        if self.target_name == "wheel" and version != "editable":
            docs = Path(self.root) / "docs"
            for page in (*docs.glob("*.md"), *docs.glob("tutorials/*.md")):
                build_data["force_include"][str(page)] = f"heavytop/docs/{page.relative_to(docs).as_posix()}"
        commit = of_checkout(self.root) or of_sdist(self.root)
        if commit is None or version == "editable":
            return
        self._folder = tempfile.TemporaryDirectory()
        file = Path(self._folder.name) / NAME
        file.write_text(commit + "\n", "utf-8")
        if self.target_name == "wheel":
            build_data["extra_metadata"][str(file)] = NAME
        else:
            build_data["force_include"][str(file)] = NAME

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the file."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()


def of_checkout(root: str) -> str | None:
    """The commit, with "-dirty" where files differ from it; None where git does not know this project's files."""
    for arguments in (["ls-files", "--error-unmatch", "hatch_build.py"], ["describe", *DESCRIBE]):
        try:
            done = subprocess.run(["git", "-C", root, *arguments], capture_output=True, text=True, timeout=20)
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode:
            return None
    return done.stdout.strip()


DESCRIBE = ["--always", "--dirty", "--abbrev=40", "--match="]


def of_sdist(root: str) -> str | None:
    """What the sdist recorded."""
    file = Path(root) / NAME
    return file.read_text("utf-8").strip() if file.is_file() else None
