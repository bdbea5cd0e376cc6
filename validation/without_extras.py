"""Each extra left out in turn: does each of its features say so, does the core go on, and do other tests pass?

A module that is hidden counts as one that is not installed.  Prints what each command says; with ``--tests`` the tests
that fail, which are none, and how many were skipped by the name of the extra.

Run: python -m validation.without_extras [EXTRA ...] [--tests PATH ...]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from heavytop.extras import EXTRAS, install

HERE = Path(__file__).resolve().parents[1]
REPORT = str(HERE / "results" / "default")
TOP = ("--inertia", "3,2,1", "--weight", "1", "--centre", "1/2,1/3,1/5")
MOTION = (*TOP, "--omega", "1/10,2/5,9/10", "--gamma", "3/5,0,4/5", "--times", "1")
NEEDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "claims": (
        ("audit", "ershkov-partial"),
        ("audit", "--library"),
        ("claims",),
        ("run", "--plan", "smoke", "--out", "y"),
    ),
    "multiword": (("propagate", *MOTION, "--integrator", "multiword"),),
    "parquet": (
        ("show", REPORT, "--parquet", "x"),
        ("run", "--plan", "gate", "--parquet", "--out", "y"),
        ("score", "x.parquet"),
    ),
    "plots": (("figures", "--out", "x"), ("history", REPORT, REPORT, "--html", "x.html")),
    "peers": tuple(
        ("propagate", *MOTION, "--integrator", name)
        for name in ("scipy:DOP853", "scipy:LSODA", "cyrk:DOP853", "sundials:CVODE", "diffrax:Dopri8")
    ),
    "cluster": (("run", "--plan", "smoke", "--scheduler", "tcp://127.0.0.1:1", "--out", "y"),),
    "logs": (("score", "x.mcap"), ("score", "x.bag"), ("score", "x.db3")),
}
"""The commands that cannot do without an extra."""
CORE = (
    ("propagate", *MOTION),
    ("reference", *MOTION),
    ("list",),
    ("score", "x.csv"),
    ("compare", REPORT, REPORT),
    ("show", REPORT, "--html", "page.html"),
)
"""The commands that need none."""
SCRIPT = """
import contextlib, io, json, sys
hidden, commands = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(hidden))
from heavytop.__main__ import main
ends = []
for command in commands:
    sys.argv = ["heavytop", *command]
    with contextlib.redirect_stderr(io.StringIO()) as errors, contextlib.redirect_stdout(io.StringIO()):
        try:
            main()
        except SystemExit as ended:
            ends.append((ended.code, errors.getvalue()))
print(json.dumps(ends))
"""
_HIDDEN = "HEAVYTOP_HIDDEN_MODULES"
sys.modules.update(dict.fromkeys(os.environ.get(_HIDDEN, "").split()))  # type: ignore[arg-type]  # as a plug-in


def without(extras: list[str], commands: list[tuple[str, ...]], folder: Path) -> list[tuple[int, str]]:
    """Exit code and standard error of each command where these extras are not installed, all in one process."""
    for suffix in ("parquet", "mcap", "bag", "db3"):
        (folder / f"x.{suffix}").touch()
    motion = subprocess.run(["awk", "-f", str(HERE / "examples" / "rk4.awk")], capture_output=True, check=True)
    (folder / "x.csv").write_bytes(motion.stdout)
    request = json.dumps([[module for extra in extras for module in EXTRAS[extra]], commands])
    line = [sys.executable, "-c", SCRIPT, request]
    done = subprocess.run(line, capture_output=True, text=True, cwd=folder, timeout=120, check=True)
    return [(code, errors) for code, errors in json.loads(done.stdout)]


def says_so(extra: str, code: int, errors: str) -> bool:
    """Whether the command ended with one sentence that names the extra."""
    return code == 2 and errors.endswith(f"needs the extra {extra}: {install(extra)}\n") and errors.count("\n") == 1


def tests_of_the_rest(extra: str, paths: list[str]) -> str:
    """The tests that fail without the extra, and the last line of pytest."""
    environment = os.environ | {_HIDDEN: " ".join(EXTRAS[extra]), "PYTHONPATH": str(HERE / "validation")}
    line = [sys.executable, "-m", "pytest", "-p", "without_extras", "-m", "not slow", "--tb=no", "-rf", *paths]
    done = subprocess.run([*line, "-o", "addopts="], capture_output=True, text=True, cwd=HERE, env=environment)
    return "\n".join(line for line in done.stdout.splitlines() if line.startswith("FAILED") or " in " in line)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("extras", nargs="*", default=[*NEEDS])
    parser.add_argument("--tests", nargs="+", default=[])
    request = parser.parse_args()
    for extra in request.extras:
        with tempfile.TemporaryDirectory() as name:
            ends = without([extra], [*NEEDS[extra], *CORE], Path(name))
        for command, (code, errors) in zip((*NEEDS[extra], *CORE), ends, strict=True):
            good = says_so(extra, code, errors) if command in NEEDS[extra] else (code, errors) == (0, "")
            shown = " ".join(part for part in command if part not in MOTION)
            print(f"{'good' if good else 'BAD '}  {extra:9}  {shown:60.60}  {code} {errors.strip()}", flush=True)
        if request.tests:
            print(tests_of_the_rest(extra, request.tests), flush=True)


if __name__ == "__main__":
    main()
