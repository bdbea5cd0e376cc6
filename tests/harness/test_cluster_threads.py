"""A Dask worker of several threads gives the rows of one process."""

import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from support.reports import expand, load, rows

PLAN = """name = "threads"
[[measure]]
kind = "drift"
cases = ["euler", "gyrostat", "pendulum", "kovalevskaya"]
runs = [{ precision = "double", horizon = "20", samples = 20 }, { precision = "extended", horizon = "9", samples = 9 }]
"""


@pytest.fixture
def address() -> Iterator[str]:
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 1, "threads_per_worker": 4, "processes": False, "dashboard_address": None}
    before = sys.getswitchinterval()
    with distributed.LocalCluster(**options, silence_logs="error") as cluster:
        sys.setswitchinterval(1e-6)
        try:
            yield cluster.scheduler_address
        finally:
            sys.setswitchinterval(before)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_worker_of_four_threads_gives_the_rows_of_one_process(tmp_path: Path, address: str) -> None:
    file = tmp_path / "threads.toml"
    file.write_text(PLAN)
    tasks = expand(load(str(file))[0])

    def measured(scheduler: str | None) -> list:
        found = dict(rows(tasks, 1, scheduler))
        return [msgspec.structs.replace(found[index], seconds={}) for index in range(len(tasks))]

    assert measured(address) == measured(None)
