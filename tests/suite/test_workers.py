"""The same rows from one process, from two, and from a Dask cluster on this machine."""

import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from heavytop.errors import InputError
from heavytop.suite.plan import expand, load
from heavytop.suite.workers import rows

PLAN = """name = "tiny"
[[measure]]
kind = "drift"
cases = ["euler", "gyrostat"]
runs = [{ precision = "double", horizon = "5", samples = 5 }]
"""


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory):
    file = tmp_path_factory.mktemp("plan") / "tiny.toml"
    file.write_text(PLAN)
    return expand(load(str(file))[0])


def measured(tasks, workers: int, scheduler: str | None = None):
    found = dict(rows(tasks, workers, scheduler))
    for row in found.values():
        row.seconds = {}
    return [found[index] for index in range(len(tasks))]


@pytest.fixture
def cluster() -> Iterator[str]:
    pytest.importorskip("distributed")
    address = "tcp://127.0.0.1:8797"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    processes = [subprocess.Popen([*dask, "--host", "127.0.0.1", "--port", "8797", "--no-dashboard"],
                                  stderr=subprocess.DEVNULL)]  # fmt: skip
    time.sleep(2)
    processes.append(subprocess.Popen([*worker, "--host", "127.0.0.1"], stderr=subprocess.DEVNULL))
    try:
        yield address
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(20)


@pytest.mark.filterwarnings("default")
def test_a_cluster_gives_the_same_rows_as_this_process(tasks, cluster: str) -> None:
    assert measured(tasks, 1, cluster) == measured(tasks, 1)


@pytest.mark.filterwarnings("default")
def test_a_scheduler_that_does_not_answer_is_a_clear_error(tasks) -> None:
    pytest.importorskip("distributed")
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match="No scheduler answers"):
            measured(tasks, 1, address)
