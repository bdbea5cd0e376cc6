"""Runs of a plan, each killed at another call that changes the disk.

    python validation/killed_everywhere.py PLAN FOLDER

The rows are measured once; what is killed is the keeping of them.  Prints how many calls there are.
"""

import os
import signal
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import heavytop.harness.run
import heavytop.report.render.page
from heavytop.api import run_folder
from heavytop.features.kinds import KINDS
from heavytop.files import replace
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import expand, load

warnings.simplefilter("ignore")  # of forks in a process with threads: those do nothing here
PLAN, ROOT = sys.argv[1], Path(sys.argv[2])
TASKS = expand(load(PLAN, KINDS)[0])
ROWS = {task.label: KINDS[task.key.kind].measure(task, Saved()) for task in TASKS}
SURROUNDINGS = run_folder.environment()
CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "fcntl.flock")


def rows(tasks, kinds, workers, scheduler, done, saved, *_) -> Iterator:
    for index, task in enumerate(tasks):
        if index not in done:
            saved(index).save({"task": task.label})
            yield index, ROWS[task.label]


heavytop.harness.run.rows = rows
run_folder.environment = lambda: SURROUNDINGS
heavytop.report.render.page.write_report = lambda report, path, kinds: replace(path, repr(report.rows).encode())


def run(out: Path, killed_at: int) -> int:
    """Exit code of a run in a process of its own, killed at that call (0: left alone)."""
    calls = 0

    def count(event: str, arguments: tuple) -> None:
        nonlocal calls
        opened = event == "open" and str(arguments[0]).startswith(str(ROOT)) and arguments[1] != "rb"
        if opened or event in CHANGES:
            calls += 1
            if calls == killed_at:
                os.kill(os.getpid(), signal.SIGKILL)

    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.addaudithook(count)
    code = 99
    try:
        asked = run_folder.PlannedRun({"name": "x"}, TASKS, [], out, True, 1, None, 10.0, False)
        code = 0 if asked.measure(lambda task: None).good else 3
    finally:
        os._exit(code)


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


assert run(ROOT / "whole", 0) == 0
whole = content(ROOT / "whole")
at = 0
while True:
    at += 1
    out = ROOT / f"killed{at}"
    code = run(out, at)
    if code == 0:
        break
    assert code == -signal.SIGKILL, code
    if out.exists() and set(content(out)) - {".lock"} == set(whole):
        (out / ".lock").unlink(missing_ok=True)  # killed when all was done
    else:
        assert run(out, 0) == 0, at
    assert content(out) == whole, at
print(at - 1)
