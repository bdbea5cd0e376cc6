"""Whether an unchanged program is green at its own gate: `validation/starters.py [--repeats N] [--load N]`.

An untouched starter in each language whose compiler is here is checked and measured by its own gate N times, every
other time beside processes that do nothing but compute.  Each report is compared with each other one, both ways round,
under the policy of the starter.  Prints a line for each that is not green; exit code 1 where there is one.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from itertools import permutations
from pathlib import Path

from heavytop.api.integrators import LANGUAGES

HEAVYTOP = [sys.executable, "-m", "heavytop"]
COMPILERS = {"python": "python3", "c": "cc", "cpp": "g++", "rust": "rustc", "julia": "julia", "fortran": "gfortran"}
BUSY = [sys.executable, "-c", "while True: pass"]


def ran(folder: Path, *words: str) -> tuple[int, str]:
    done = subprocess.run([*HEAVYTOP, *words], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def measured(folder: Path, number: int, load: int) -> str:
    """The report of one more run, beside a load where the number is odd."""
    busy = [subprocess.Popen(BUSY) for _ in range(load * (number % 2))]
    try:
        code, said = ran(folder, "run", "--plan", "gate.toml", "--out", f"run-{number}")
    finally:
        for process in busy:
            process.kill()
            process.wait()
    if code:
        print(f"{folder.name}: run {number} ends with {code}: {said[-400:]}")
    return f"run-{number}"


def findings(folder: Path, repeats: int, load: int) -> int:
    """How many checks, runs and comparisons of one integrator are not green."""
    wrong = 0
    code, said = ran(folder, "check-integrator", "mine.toml")
    if code:
        wrong += 1
        print(f"{folder.name}: check-integrator ends with {code}: {said}")
    runs = [measured(folder, number, load) for number in range(repeats)]
    for old, new in permutations(runs, 2):
        code, said = ran(folder, "compare", old, new, "--policy", "policy.toml")
        if code:
            wrong += 1
            print(f"{folder.name}: {old} against {new} ends with {code}: {said[:600]}")
    print(f"{folder.name}: {wrong} of {1 + repeats * (repeats - 1)} are not green")
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--load", type=int, default=6)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        for language in LANGUAGES:
            if asked.only not in language or shutil.which(COMPILERS[language]) is None:
                continue
            folder = Path(place) / language
            ran(Path(place), "new", language, "--language", language)
            if (folder / "Makefile").exists():
                subprocess.run(["make"], cwd=folder, check=True, capture_output=True)
            wrong += findings(folder, asked.repeats, asked.load)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
