"""A Dask worker of several threads gives the rows of one process."""

import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from support.reports import drift, rows, tasks_of


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
    cases, runs = ("euler", "gyrostat", "pendulum", "kovalevskaya"), [("double", "20", 20), ("extended", "9", 9)]
    tasks = tasks_of(tmp_path, drift(*cases, runs=runs))

    def measured(scheduler: str | None) -> list:
        found = dict(rows(tasks, 1, scheduler))
        return [msgspec.structs.replace(found[index], seconds={}) for index in range(len(tasks))]

    assert measured(address) == measured(None)
