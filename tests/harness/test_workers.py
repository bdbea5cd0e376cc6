"""The same rows from one process, from two, and from a Dask cluster on this machine; with workers killed too."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from fractions import Fraction
from io import StringIO
from multiprocessing import Pipe, active_children
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from heavytop import processes
from heavytop.errors import HeavyTopError, InputError
from heavytop.features.kinds import KINDS
from heavytop.harness import run
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Task
from heavytop.measure.scalar import digits_kept
from heavytop.processes import ChildContext
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.render.terminal import brief, summary
from heavytop.report.store.checks import contradictions
from support.reports import drift, plan_file, rows, tasks_of

pytestmark = pytest.mark.slow

PLAN = drift("euler", "lagrange", "pendulum", runs=[("double", "5", 5), ("double", "6", 5)])


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory):
    return tasks_of(tmp_path_factory.mktemp("plan"), PLAN)


@pytest.fixture(scope="module")
def expected(tasks):
    return measured(tasks, 1)


def measured(tasks, processes: int, scheduler: str | None = None, after_first: Callable[[], object] = lambda: None):
    found = {}
    for index, row in rows(tasks, processes, scheduler):
        assert index not in found
        if not found:
            after_first()
        found[index] = msgspec.structs.replace(row, seconds={})
    return [found[index] for index in range(len(tasks))]


def test_every_kind_of_truth_is_the_same_in_one_process_and_in_two(tmp_path: Path) -> None:
    growth = '[[measure]]\nkind = "growth"\ncases = ["generic"]\nruns = [{ precision = "double", horizon = "20", '
    truths = drift("generic", runs=[("double", "30", 6), ("double", "1600", 16)]) + growth
    tasks = tasks_of(tmp_path, f"{truths}starts = 3, samples = 4 }}]\n")
    found = [measured(tasks, processes) for processes in (1, 2)]
    # as reports are written: from rows that were read again
    one, two = (msgspec.json.decode(msgspec.json.encode(each), type=list[Row]) for each in found)
    assert msgspec.json.encode(one) == msgspec.json.encode(two)
    proven, lost, many = one
    assert [row.reference.how for row in (proven, lost, many)] == ["proven", "computed", "computed"]
    assert [bool(row.reference.until) for row in (proven, lost, many)] == [False, True, False]
    for row in (proven, many):
        assert digits_kept(row) > 3
    # the row names the time, scores what is before it, and keeps no digit
    ends = Fraction(lost.reference.until)
    assert 200 <= ends <= 1500
    assert all(Fraction(time) < ends for time in lost.series["solution_error_along"].times)
    assert Fraction(lost.series["drift_energy"].times[-1]) == 1600
    assert lost.finite
    assert digits_kept(lost) == 0
    assert list(contradictions(lost, KINDS["drift"])) == []
    for text in (summary_of([lost]), brief(Report(SCHEMA, {}, {}, []), [lost], KINDS)):
        last, first = re.search(r"lost (\d+)–(\d+)", text).groups()
        assert 200 <= int(last) < int(first) <= ends


class Poison:
    """Ends the process that reads it."""

    name = "poison"

    def __reduce__(self):
        return os._exit, (9,)


def summary_of(found: list[Row]) -> str:
    console = Console(width=200, file=StringIO())
    console.print(summary(Report(SCHEMA, {}, {}, found), KINDS))
    return console.file.getvalue()


def poisoned(tasks) -> list[Task]:
    return [*tasks[:2], with_case(tasks[0], "poison", Poison()), *tasks[2:4]]


def with_case(task: Task, name: str, case: object) -> Task:
    return replace(task, key=msgspec.structs.replace(task.key, case=name), case=case)


def kill(pid: int) -> None:
    os.kill(pid, signal.SIGKILL)


def test_two_processes_give_the_same_rows_as_one_even_if_one_of_them_is_killed(tasks, expected) -> None:
    others = {*active_children()}
    assert measured(tasks, 2, after_first=lambda: kill(({*active_children()} - others).pop().pid)) == expected


def test_a_task_that_kills_its_worker_every_time_is_named_and_the_others_are_measured(tasks) -> None:
    others = {*active_children()}
    with pytest.raises(HeavyTopError, match="died 3 times during drift poison"):
        list(rows(poisoned(tasks), 2, None))
    assert {*active_children()} <= others


def test_rows_that_are_there_are_not_measured_again(tasks) -> None:
    assert [index for index, _ in rows(tasks, 1, None, done=set(range(1, len(tasks))))] == [0]


class Slow(Poison):
    """Keeps the process that reads it for a minute, then leaves a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return exec, (f"import time; time.sleep(60); open({str(self.path)!r}, 'w').close()",)


def test_a_run_begins_a_few_tasks_at_a_time_and_does_not_wait_for_them_where_it_is_stopped(
    tasks, tmp_path: Path
) -> None:
    others = {*active_children()}
    slow, asked = with_case(tasks[0], "slow", Slow(tmp_path / "done")), []
    stream = rows([tasks[0], slow, *tasks[:1] * 10_000], 2, None, saved=lambda index: asked.append(index) or Saved())
    next(stream)
    with pytest.raises(KeyboardInterrupt):
        stream.throw(KeyboardInterrupt)
    for process in {*active_children()} - others:
        process.join()
    assert not (tmp_path / "done").exists()
    assert len(asked) <= 4 * 2


def test_a_process_ends_with_its_parent_and_no_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[int] = []
    monkeypatch.setattr(processes.os, "_exit", ended.append)
    child, parent = Pipe(duplex=False)
    waiting = threading.Thread(target=processes._end_with, args=(child,))
    waiting.start()
    waiting.join(0.1)
    assert (waiting.is_alive(), ended) == (True, [])
    parent.close()
    waiting.join(10)
    assert (waiting.is_alive(), ended) == (False, [1])


def test_processes_end_when_their_parent_is_killed_in_the_midst_of_a_row_too(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(
        "from multiprocessing import active_children\n"
        "from heavytop.features.kinds import KINDS\n"
        "from heavytop.harness.plan import expand, load\n"
        "from heavytop.harness.run import rows\n"
        "if __name__ == '__main__':\n"
        f"    tasks = expand(load({str(tmp_path / 'plan.toml')!r}, KINDS)[0])\n"
        "    stream = rows(tasks, KINDS, 2, None)\n"
        "    next(stream)\n"
        "    print(*(child.pid for child in active_children()), flush=True)\n"
        "    input()\n"
    )
    plan_file(tmp_path, PLAN + drift("gyrostat", runs=[("double", "1e9", 100)]))
    with subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as parent:
        assert len(parent.stdout.readline().split()) == 2
        parent.kill()
        # its output ends when the last process that holds it has ended
        assert parent.communicate(timeout=30)[0] == ""


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    address = f"tcp://127.0.0.1:{port}"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    once = os.environ | {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
    start = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port]
    join = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nworkers", "2", "--nthreads", "1"]
    commands = ([*start, "--no-dashboard"], once), ([*join, "--no-dashboard"], None)
    processes = [subprocess.Popen(line, env=environment, **quiet) for line, environment in commands]
    try:
        yield address
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(20)


@pytest.fixture
def worker_pids(cluster: str) -> Iterator[Callable[..., list[int]]]:
    """The processes of the workers; of those alone that have a task where ``busy``."""
    from distributed import Client

    with Client(cluster, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=30)

        def pids(busy: bool = False) -> list[int]:
            tasks = client.processing() if busy else {}
            return [pid for address, pid in client.run(os.getpid).items() if not busy or tasks.get(address)]

        yield pids


dask = pytest.mark.filterwarnings("default")


@dask
def test_a_cluster_gives_the_same_rows_as_this_process_even_if_a_worker_is_killed(
    tasks, expected, cluster: str, worker_pids
) -> None:
    assert measured(tasks, 1, cluster, after_first=lambda: kill(worker_pids()[0])) == expected


@dask
def test_a_worker_of_four_threads_gives_the_rows_of_one_process(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    cases, runs = ("euler", "gyrostat", "pendulum", "kovalevskaya"), [("double", "20", 20), ("extended", "9", 9)]
    tasks = tasks_of(tmp_path, drift(*cases, runs=runs))
    options = {"n_workers": 1, "threads_per_worker": 4, "processes": False, "dashboard_address": None}
    before = sys.getswitchinterval()
    with distributed.LocalCluster(**options, silence_logs="error") as cluster:
        sys.setswitchinterval(1e-6)
        try:
            found = measured(tasks, 1, cluster.scheduler_address)
        finally:
            sys.setswitchinterval(before)
    assert found == measured(tasks, 1)


THIRD_PARTY = """
import os, re, subprocess
from heavytop.integrate.peers.double import Solved

def good(given):
    return Solved([given.start + 1e-9 for _ in given.times], given.times[-1], 10)

def stuck(given):
    subprocess.Popen(["sleep", "876"], start_new_session=True)
    re.match("(a+)+$", 60 * "a" + "b")

def dies(given):
    os._exit(3)
"""


@dask
def test_on_a_cluster_too_rows_of_others_end_and_their_workers_live(
    tmp_path: Path, cluster: str, worker_pids, tasks
) -> None:
    (tmp_path / "mine.py").write_text(THIRD_PARTY)
    names = [f"mine.py:{name}" for name in ("good", "stuck", "dies")]
    tables = [drift("pendulum", integrator=name, runs=[("double", "1", 2)]) for name in names]
    theirs = tasks_of(tmp_path, f"integrators = {names}\n" + "".join(tables))
    before = worker_pids()
    found = dict(run.rows([*theirs, tasks[0]], KINDS, 1, cluster, row_timeout=2.0))
    assert [found[index].outcome for index in range(4)] == ["success", "out_of_time", "failed", "success"]
    assert found[1].against == "nothing: mine.py:stuck was stopped after 2 s, in pendulum"
    assert "mine.py:dies ended its process 3 times, with exit code 3, in pendulum" in found[2].against
    assert worker_pids() == before
    assert not subprocess.run(["pgrep", "-f", "^sleep 876$"], capture_output=True, check=False).stdout


@dask
def test_a_row_whose_workers_die_one_after_the_other_is_named(tmp_path: Path, cluster: str, worker_pids) -> None:
    endless = tasks_of(tmp_path, PLAN.replace('"5"', '"1e9"').replace("samples = 5", "samples = 100"))[:1]
    stop = threading.Event()

    def keep_killing() -> None:
        while not stop.wait(0.5):
            for pid in worker_pids(busy=True):
                kill(pid)

    killer = threading.Thread(target=keep_killing)
    killer.start()
    try:
        with pytest.raises(HeavyTopError, match="2 workers died during drift euler double"):
            measured(endless, 1, cluster)
    finally:
        stop.set()
        killer.join()


@dask
def test_a_worker_with_other_versions_is_refused(tasks, cluster: str, monkeypatch: pytest.MonkeyPatch) -> None:
    here = run.versions()
    monkeypatch.setattr(run, "versions", lambda: here | {"heyoka": "0.1"})
    with pytest.raises(InputError, match=f"A worker has heyoka {here['heyoka']} instead of 0.1"):
        measured(tasks, 1, cluster)


@dask
def test_a_scheduler_that_does_not_answer_is_a_clear_error(tasks, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(run, "_ANSWER", 1.0)
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match="No scheduler answers"):
            measured(tasks, 1, address)


def test_a_file_with_the_name_of_a_module_is_no_module_for_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where Python itself is started in that folder the file counts, as always."""
    (tmp_path / "pickle.py").write_text("raise RuntimeError('the file of the user')")
    monkeypatch.chdir(tmp_path)
    alone = [sys.executable, "-c", "import pickle"]
    with ProcessPoolExecutor(1, mp_context=ChildContext()) as pool:
        found = pool.submit(eval, "__import__('pickle').__file__").result()
        started = pool.submit(subprocess.call, alone, stderr=subprocess.DEVNULL).result()
    assert not Path(found).is_relative_to(tmp_path)
    assert started == 1
