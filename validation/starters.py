"""Whether an unchanged program is green at its own gate: `validation/starters.py [--repeats N] [--load N]`.

An untouched starter in each language whose compiler is here, each method of `heavytop new` in C and BDF2 in Python, is
checked and measured by its own gate N times, every other time beside processes that do nothing but compute.  Each
report is compared with each other one, both ways round, under the policy of the starter.  Prints a line for each that
is not green; exit code 1 where there is one.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import permutations
from pathlib import Path

from typer.testing import CliRunner

from heavytop.api.integrators import LANGUAGES, METHODS
from heavytop.cli import app

HEAVYTOP = [sys.executable, "-m", "heavytop"]
COMPILERS = {"python": "python3", "c": "cc", "cpp": "g++", "rust": "rustc", "julia": "julia", "fortran": "gfortran"}
BUSY = [sys.executable, "-c", "while True: pass"]


BDF2 = '''def step(f, y, h, before):
    """y after one step of BDF2, of which `before` is the state before y: Newton's method with differences."""
    z = [2 * a - b for a, b in zip(y, before)]
    for _ in range(3):
        rates = f(z)
        rest = numpy.array(z) - (4 * numpy.array(y) - numpy.array(before)) / 3 - 2 * h / 3 * numpy.array(rates)
        slopes = [(numpy.array(f([*z[:i], z[i] + 1e-7, *z[i + 1 :]])) - rates) / 1e-7 for i in range(len(z))]
        z = list(z - numpy.linalg.solve(numpy.eye(len(z)) - 2 * h / 3 * numpy.array(slopes).T, rest))
    return z


def advance(f, y, span, h, memory):
    """y after the span, and how many equal steps that takes; the first of a size by the midpoint rule."""
    count = math.ceil(abs(span) / h)
    h = span / max(count, 1)
    before = memory.get("before") if abs(memory.get("h", 0.0) - h) < 1e-9 * abs(h) else None
    for _ in range(count):
        if before is None:
            half = f([a + h / 2 * b for a, b in zip(y, f(y))])
            before, y = y, [a + h * b for a, b in zip(y, half)]
        else:
            before, y = y, step(f, y, h, before)
        y = [float(a) for a in y]
    memory.update(h=h, before=before)
    return y, count
'''


def starters(folder: Path) -> Iterator[Path]:
    """Their folders: each language in fixed steps, the other methods in C, and BDF2 in Python."""
    for language in LANGUAGES:
        for method in METHODS if language == "c" else ("step",):
            if shutil.which(COMPILERS[language]) is not None:
                yield made(folder / f"{language}-{method}", language, method)
    bdf2 = made(folder / "python-bdf2", "python", "multistep")
    program, table = bdf2 / "mine.py", bdf2 / "mine.toml"
    head, tail = re.split(r"\ndef start.*?(?=\ndef run)", program.read_text(), flags=re.DOTALL)
    program.write_text(f"{head}import numpy\n\n\n{BDF2}\n{tail}")
    table.write_text(table.read_text().replace("order = 4", "order = 2").replace("python3", sys.executable))
    yield bdf2


def made(folder: Path, language: str, method: str) -> Path:
    ran(folder.parent, "new", folder.name, "--language", language, "--method", method)
    if (folder / "Makefile").exists():
        subprocess.run(["make"], cwd=folder, check=True, capture_output=True)
    return folder


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
        paths = [str(folder / name) for name in (old, new, "policy.toml")]
        done = CliRunner().invoke(app, ["compare", *paths[:2], "--policy", paths[2]])
        if done.exit_code:
            wrong += 1
            print(f"{folder.name}: {old} against {new} ends with {done.exit_code}: {done.output[:600]}", flush=True)
    print(f"{folder.name}: {wrong} of {1 + repeats * (repeats - 1)} are not green", flush=True)
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--load", type=int, default=6)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        for folder in starters(Path(place)):
            if asked.only in folder.name:
                wrong += findings(folder, asked.repeats, asked.load)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
