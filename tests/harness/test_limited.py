"""A run always ends: rows of third-party integrators have a time limit and a process of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from time import sleep

import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.guard import how_it_ended, stopwatch
from heavytop.harness.limited import RowLimits, in_limited_process
from heavytop.harness.plan import read
from support.helpers import START, TOP, gone, is_running, running, wait_until, without_progress
from support.in_process import heavytop
from support.midpoint import MIDPOINT
from support.reports import all_good, drift, plan_file, rows

PROGRAM = Path(__file__).parents[1] / "support" / "faulty_program.py"
MODULE = """
import os, re, subprocess, time
from pathlib import Path
from heavytop.integrate.peers.double import Solved

def solve(given):
    assert given.step_limit == 10**7
    os.environ["LEFT"] = "by solve"
    return midpoint(given)

def sleeps(given):
    time.sleep(1000)

def naps(given):
    time.sleep(0.3)
    return midpoint(given)

def stuck(given):  # in one call of C that holds the interpreter, in a process that no other integrator had
    assert "LEFT" not in os.environ
    subprocess.Popen(["sleep", "987"], start_new_session=True)
    re.match("(a+)+$", 60 * "a" + "b")

def leaves(given):  # a forked process of another session, which holds the pipes of this one
    if child := os.fork():
        (Path(__file__).parent / "left").write_text(str(child))
    else:
        os.setsid()
    time.sleep(987)

def interrupts(given):
    raise KeyboardInterrupt
"""
MODULE += MIDPOINT.format(name="midpoint")
PLAN = """name = "faults"
row_timeout = "2"
integrators = {files}
"""
TABLE = """[[integrator]]
name = "{name}"
command = ["{python}", "{program}", "{name}"]
setting = "step"
"""


def plan(folder: Path, *names: str, cases: tuple[str, ...] = ("euler",)) -> Path:
    (folder / "mine.py").write_text(MODULE)
    files = [name for name in names if name.startswith("mine.py")]
    programs = [name for name in names if name in ("silent", "forks")]
    head = PLAN.format(files=json.dumps(files))
    head += "".join(TABLE.format(name=name, python=sys.executable, program=PROGRAM) for name in programs)
    tables = [drift(*cases, integrator=name, runs=[("double", "2", 4)]) for name in names]
    return Path(plan_file(folder, head + "".join(tables)))


@pytest.mark.slow
def test_rows_that_do_not_end_are_ended_and_all_others_are_measured(tmp_path: Path) -> None:
    ends = {"mine.py:solve": "success", "mine.py:interrupts": "failed"}
    ends |= dict.fromkeys(("mine.py:stuck", "silent", "mine.py:leaves"), "out_of_time")
    file = plan(tmp_path, *ends)
    done = heavytop("run", "--plan", file, "--out", tmp_path / "out", "--workers", "1")
    assert (done.returncode, without_progress(done.stderr)) == (3, "")
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert {row["integrator"]: row["outcome"] for row in report["rows"]} == ends
    against = {row["integrator"]: row["against"] for row in report["rows"]}
    assert against["mine.py:stuck"] == "nothing: mine.py:stuck was stopped after 2 s, in euler"
    assert against["mine.py:interrupts"] == "nothing: mine.py:interrupts raised KeyboardInterrupt, in euler"
    assert "mine.py:stuck was stopped after 2 s, in euler in double" in done.stdout
    assert report["environment"]["integrators"] == {"silent": "faulty 1.2"}
    for words in ((str(PROGRAM),), ("sleep", "987")):
        assert gone(*words)
    assert wait_until(lambda: not is_running(int((tmp_path / "left").read_text())))


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_whatever_ends_a_run_ends_what_it_started(tmp_path: Path, end: int) -> None:
    file = plan(tmp_path, "silent", "mine.py:stuck")
    line = [sys.executable, "-m", "heavytop", "run", "--plan", str(file), "--out", str(tmp_path / "out")]
    with subprocess.Popen(
        [*line, "--workers", "2", "--row-timeout", "100"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as parent:
        wait_until(lambda: running(str(PROGRAM), "silent") and running("sleep", "987"), 60)
        os.kill(parent.pid, end)
        said = parent.communicate(timeout=30)[1]  # its standard error ends with the last process that holds it
    assert parent.returncode == (130 if end == signal.SIGINT else -9)
    assert ("interrupted" in said) == (end == signal.SIGINT)
    assert gone(str(PROGRAM))
    assert gone("sleep", "987")


def test_an_end_is_named_by_its_signal_or_its_exit_code() -> None:
    said = {0: "with exit code 0", 3: "with exit code 3", -11: "by SIGSEGV", -9: "by SIGKILL", -40: "by signal 40"}
    assert {code: how_it_ended(code) for code in said} == said


@pytest.mark.slow
def test_the_limit_of_a_row_follows_its_cost_and_what_the_others_took(tmp_path: Path) -> None:
    task = read(str(plan(tmp_path, "mine.py:solve")), KINDS)[2][0]
    other = replace(task, key=read(str(plan(tmp_path, "mine.py:sleeps")), KINDS)[2][0].key)
    limits = RowLimits()
    assert [limits.seconds(task, cost) for cost in (1.0, 5.0)] == [40, 80]
    limits.finished(task, 2.0, 1.0)  # quicker than heyoka: no less time
    assert limits.seconds(task, 1.0) == 40
    limits.finished(task, 2.0, 20.0)
    limits.finished(task, 2.0, 6.0)
    assert limits.seconds(task, 3.0) == 330  # ten times the slowest
    assert limits.seconds(other, 3.0) == 60
    limits.ran_out(other)
    assert limits.seconds(other, 3.0) == 30
    limits.finished(other, 1.0, 1.0)
    assert limits.seconds(other, 3.0) == 60
    assert RowLimits(7.0).seconds(task, 100.0) == 7


@pytest.mark.slow
def test_a_row_in_the_child_of_a_worker_of_a_cluster_says_how_long_it_took(tmp_path: Path) -> None:
    (task,) = read(str(plan(tmp_path, "mine.py:naps")), KINDS)[2]
    row, seconds = in_limited_process(KINDS["drift"], task, 60.0)
    assert row.outcome == "success"
    assert seconds > 0.3


@pytest.mark.slow
def test_a_time_limit_that_is_none_is_refused(tmp_path: Path) -> None:
    file = plan(tmp_path, "mine.py:solve")
    for bad in (0, -1, "soon", "1e99"):
        with pytest.raises(InputError):
            ht.run(file, out=tmp_path / "out", row_timeout=bad)
    text = file.read_text()
    for bad in ('"never"', "0", '"-3"', "nan", "true"):
        file.write_text(text.replace('"2"', bad, 1))
        with pytest.raises(InputError):
            ht.run(file, out=tmp_path / "out")
    file.write_text(text.replace('"2"', "2.5", 1))
    assert float(read(str(file), KINDS)[0].row_timeout) == 2.5
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ('name = "silent"', 'name = "forks"', "two integrators the same name"),
        ('name = "silent"', 'name = "words"', "built-in"),
        ('"mine.py:solve"', '"mine"', "integrators must name files"),
        ('"mine.py:solve"', '"absent.toml"', "cannot be read"),
        ('name = "silent"', "", "name"),
    ],
)
def test_integrators_of_a_plan_that_cannot_be_are_refused(tmp_path: Path, old: str, new: str, cause: str) -> None:
    file = plan(tmp_path, "forks", "silent", "mine.py:solve")
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=cause):
        read(str(file), KINDS)


def test_progress_names_the_row_that_is_running(tmp_path: Path) -> None:
    tables = drift("euler", integrator="heyoka"), drift("euler", integrator="multiword")
    tasks = read(plan_file(tmp_path, "".join(tables)), KINDS)[2]
    heard: list[str] = []
    for index, _ in rows(tasks, 1, begun=lambda task: heard.append(task.label)):
        assert heard[-1] == tasks[index].label
    assert sorted(heard) == sorted(task.label for task in tasks)


def solved(given):
    """A solver that never moves."""
    from heavytop.integrate.peers.double import Solved

    return Solved([given.start] * len(given.times), given.times[-1], 1)


@pytest.mark.slow
def test_a_callable_is_an_integrator_without_a_package(tmp_path: Path) -> None:
    local = lambda given: solved(given)  # noqa: E731
    for given, name in ((solved, "test_limited.py:solved"), (local, "")):
        run = ht.propagate(TOP, START, [1, 2], integrator=given)
        assert run.outcome is ht.Outcome.SUCCESS
        assert (run.to_numpy()[1] == [0.1, 0.4, 0.9, 0.6, 0, 0.8]).all()
        assert not name or run.integrator == name
    file = plan_file(tmp_path, drift("euler"))
    report = ht.run(file, out=tmp_path / "out", integrator=local, workers=1)
    assert [row.outcome for row in report.rows] == ["success", "success"]
    for bad in (lambda: 0, lambda a, b: 0, 3, int):
        with pytest.raises(InputError):
            ht.propagate(TOP, START, [1], integrator=bad)


def test_an_integrator_that_ran_out_of_time_twice_is_not_asked_a_third_time(tmp_path: Path) -> None:
    file = plan(tmp_path, "mine.py:sleeps", cases=("euler", "lagrange", "pendulum", "kovalevskaya"))
    found = dict(rows(read(str(file), KINDS)[2], 2, row_timeout=1.0))
    outcomes = sorted(row.outcome for row in found.values())
    under_way = outcomes.count("out_of_time") - 2
    assert 0 <= under_way < 2
    assert outcomes == ["not_asked"] * (2 - under_way) + ["out_of_time"] * (2 + under_way)
    (said, *_) = [row.against for row in found.values() if row.outcome == "not_asked"]
    assert said.startswith("nothing: mine.py:sleeps ran out of time in 2 other rows and was skipped, in ")
    assert not all_good(list(found.values()))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="the system counts no waiting")
def test_what_the_program_of_a_row_waits_for_a_processor_is_not_charged() -> None:
    busy = "import os\nos.sched_setaffinity(0, [min(os.sched_getaffinity(0))])\nwhile True: pass"
    asking = f"import subprocess, sys\nsubprocess.Popen([sys.executable, '-c', {busy!r}]).wait()"
    rivals = [subprocess.Popen([sys.executable, "-c", busy]) for _ in range(2)]
    process = subprocess.Popen([sys.executable, "-c", asking], start_new_session=True)
    try:
        sleep(0.5)
        alone, both = stopwatch(process.pid), stopwatch(process.pid, with_children=True)
        sleep(1)
        assert both() < 0.8 * alone()
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        for each in (*rivals, process):
            each.kill()
            each.wait()
