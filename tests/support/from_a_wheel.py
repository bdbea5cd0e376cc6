"""The ways in, word for word as the README has them, with the wheel in an environment that has nothing else.

``python -m support.from_a_wheel ENVIRONMENT`` in tests/ (a folder made by venv, with ``constraints/run.txt`` in it):
makes the wheel, installs it there and runs the three blocks in a folder of their own, which knows no checkout but the
examples.  Then the plan `gate` as it is, for the integrator that the second block installed.
A verdict on a trajectory must be there within two minutes, a gate of a program in C within two (from nothing: the
program, its contract, a baseline, a mistake, the comparison), one of a package within ten, an audit within two.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from support.documents import ROOT, Block, blocks, run_shell

LIMITS = {
    "score motion.csv": 120,
    "gate --plan rk4/gate.toml": 120,
    "compare baseline candidate": 600,
    "audit claim.toml": 120,
}
"""A command that names the block, and the seconds that it may take."""
COMPILED = "gate --plan rk4/gate.toml"
"""The block that needs a compiler of C and make."""
SAYS = {COMPILED: "- Order observed 4 → 0 in single steps on lagrange"}
"""What a block prints."""
SCORE = " ".join((ROOT / "docs" / "score.md").read_text("utf-8").split())
GATE = """.venv/bin/heavytop run --plan gate --integrator mine:rk4 --out gate
.venv/bin/heavytop compare gate gate
"""


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
        # with its documentation, which messages refer to
        pages = timed("heavytop docs", ".venv/bin/heavytop docs score", 60, folder, SCORE)
        found = [
            timed(f"README line {block.line}, {key}", block.text, LIMITS[key], folder, SAYS.get(key, ""))
            for key, block in doors()
            if key != COMPILED or compiler()
        ]
        return max(pages, *found, timed("the plan gate for mine:rk4", GATE, 600, folder))


def doors() -> list[tuple[str, Block]]:
    """The blocks of the README, each with the command that names it."""
    found = [(key, block) for key in LIMITS for block in blocks(ROOT / "README.md") if f"heavytop {key}" in block.text]
    assert [key for key, _ in found] == list(LIMITS)
    return found


def compiler() -> bool:
    """Whether there is a compiler of C, and make; says so where there is none."""
    there = all(map(shutil.which, ("cc", "make")))
    if not there:
        print(f"{COMPILED}: left out, for there is no compiler of C here")
    return there


def timed(name: str, commands: str, limit: float, folder: Path, says: str = "") -> int:
    """Run these commands; returns 1 where one failed, they took longer, or did not say that."""
    began = perf_counter()
    done = run_shell(commands, folder, dict(os.environ))
    seconds = perf_counter() - began
    good = done.returncode == 0 and seconds < limit and says in " ".join(done.stdout.split())
    print(f"{name}: {seconds:.0f} s" + ("" if good else f", FAILED\n{done.stdout}{done.stderr}"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
