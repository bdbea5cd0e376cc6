"""Kill a run again and again, go on, and compare: ``python validation/kills.py PLAN KILLS [WORKERS [PART]] [each]``.

PLAN: smoke, or kills.toml beside this, of middle size.
PART: of the time that a whole run takes, within which each process is killed; 1.1.
each: what each kill leaves behind is also copied, and the copy left alone to its end.
"""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TINY = """name = "kills"
[[measure]]
kind = "drift"
cases = ["euler"]
runs = [{ precision = "double", horizon = "50", samples = 200 }, { precision = "quad", horizon = "2", samples = 40 }]
[[measure]]
kind = "growth"
cases = ["gyrostat"]
runs = [{ precision = "double", horizon = "5e3", starts = 24 }]
[[measure]]
kind = "homoclinic"
cases = ["delone"]
precisions = ["double", "quad"]
directions = ["forward"]
samples = 1
"""


def start(plan: str, out: Path, workers: int, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "heavytop", "run", "--plan", plan, "--out", str(out), "--workers", str(workers)]
    return subprocess.Popen([*command, *options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finish(process: subprocess.Popen[bytes]) -> None:
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 0, errors.decode()


def comparable(folder: Path) -> bytes:
    """The report but for timings and the environment, in its own order."""
    assert {path.name for path in folder.iterdir()} == {"report.json", "report.json.sha256", "report.html"}
    report = json.loads((folder / "report.json").read_bytes())
    del report["environment"]
    for row in report["rows"]:
        row["seconds"] = {}
    return json.dumps(report).encode()


def kill_and_resume(
    plan: str, kills: int, workers: int = 1, part: float = 1.1, each: bool = False, seed: int = 1
) -> list[tuple[int, bool]]:
    """(kills that a run lived through, whether its report is that of a run left alone), for each run.

    each: for each kill too, of a copy of what it left: (0, whether ...).
    """
    rng = random.Random(seed)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        left_alone = Path(folder) / "whole"
        before = time.monotonic()
        finish(start(plan, left_alone, workers))
        span = time.monotonic() - before
        whole = comparable(left_alone)

        def note(killed: int, out: Path) -> None:
            found.append((killed, comparable(out) == whole))
            print(*found[-1], flush=True)

        while (missing := kills - sum(number for number, _ in found)) > 0:
            out = Path(folder) / f"run{len(found)}"
            killed = 0
            while killed < missing:
                process = start(plan, out, workers, "--resume", "--save-every", "0.02")
                try:
                    _, errors = process.communicate(timeout=rng.uniform(0, part * span))
                    assert process.returncode == 0, errors.decode()
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
                    killed += 1
                if each and out.exists():
                    copy = Path(folder) / f"copy{len(found)}"
                    shutil.copytree(out, copy)
                    finish(start(plan, copy, workers, "--resume"))
                    note(0, copy)
            else:
                finish(start(plan, out, workers, "--resume"))
            if killed:
                note(killed, out)
    return found


if __name__ == "__main__":
    plan, kills, *rest = (argument for argument in sys.argv[1:] if argument != "each")
    options = (kind(text) for kind, text in zip((int, float), rest, strict=False))
    runs = kill_and_resume(plan, int(kills), *options, each="each" in sys.argv)
    killed = sum(number for number, _ in runs)
    print(f"{killed} kills, {len(runs)} reports: {sum(same for _, same in runs)} of them identical")
