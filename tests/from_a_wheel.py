"""The three ways in, word for word as the README has them, with the wheel in an environment that has nothing else.

``python tests/from_a_wheel.py ENVIRONMENT`` (a folder made by venv, with ``constraints/run.txt`` installed): makes the
wheel, installs it there and runs the three blocks in a folder of their own, which knows no checkout but the examples.
A verdict on a trajectory must be there within two minutes, a gate within ten, an audit within two.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from documents import ROOT, blocks, run_shell

LIMITS = {"score motion.csv": 120, "compare baseline candidate": 600, "audit claim.toml": 120}
"""A command that names the block, and the seconds that it may take."""


def main(environment: Path) -> int:
    """Returns the exit code: 1 where a block failed or took too long."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pip = [environment / "bin" / "pip", "--quiet", "--disable-pip-version-check"]
        options = ["--no-deps", "--no-build-isolation"]
        subprocess.run([*pip, "wheel", *options, "--wheel-dir", folder / "dist", ROOT], check=True)
        (wheel,) = (folder / "dist").glob("*.whl")
        subprocess.run([*pip, "install", "--no-deps", "--force-reinstall", wheel], check=True)
        (folder / ".venv").symlink_to(environment)
        shutil.copytree(ROOT / "examples", folder / "examples")
        said = run_shell(".venv/bin/heavytop --version", folder, dict(os.environ))
        print(f"{wheel.name}, {wheel.stat().st_size // 1000} kB: {said.stdout.strip()}")
        return max(timed(key, limit, folder) for key, limit in LIMITS.items())


def timed(key: str, limit: float, folder: Path) -> int:
    """Run the block that holds ``key``; returns 1 where it failed or took longer."""
    (block,) = (each for each in blocks(ROOT / "README.md") if f"heavytop {key}" in each.text)
    began = perf_counter()
    done = run_shell(block.text, folder, dict(os.environ))
    seconds = perf_counter() - began
    good = done.returncode == 0 and seconds < limit
    print(
        f"README line {block.line}, {key}: {seconds:.0f} s" + ("" if good else f", FAILED\n{done.stdout}{done.stderr}")
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
