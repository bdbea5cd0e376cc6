"""Peak memory and time of a run against its number of rows: ``python validation/many_rows.py [ROWS ...]``.

One measured row stands in for all of them: what is measured is the keeping, the writing and the summing up.  Each
number of rows runs in a process of its own, beside one of 10 rows.
"""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter


def child(count: int) -> None:
    from msgspec.structs import replace

    import heavytop.harness.run
    from heavytop.api.run_folder import PlannedRun
    from heavytop.cases import CASES
    from heavytop.features.drift.kind import DriftTable
    from heavytop.features.kinds import KINDS
    from heavytop.harness.checkpoint import Saved
    from heavytop.harness.rows import Task, computed
    from heavytop.records import RowKey

    times = tuple(range(1, 11))
    names = [f"euler-{index}" for index in range(count)]
    keys = [RowKey("drift", name, "heavy_top", computed("heyoka"), "double", horizon="10") for name in names]
    table = DriftTable([], [], noise=False)
    tasks = [Task(key, key.case, "heyoka", CASES["euler"], times, times, table) for key in keys]
    row = KINDS["drift"].measure(tasks[0], Saved())

    def rows(tasks, *_) -> Iterator:
        return ((index, replace(row, case=task.title, key=task.key)) for index, task in enumerate(tasks))

    heavytop.harness.run.rows = rows
    with tempfile.TemporaryDirectory() as folder:
        began = perf_counter()
        asked = PlannedRun({"name": "many"}, tasks, [], Path(folder) / "out", False, 1, None, 10.0, False)
        code = 0 if asked.measure(lambda task: None).good else 3
        size = (Path(folder) / "out" / "report.json").stat().st_size
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{count} rows: exit {code}, report {size / 1e6:.1f} MB, {perf_counter() - began:.1f} s, peak {peak:.0f} MB")


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(int(sys.argv[2]))
    else:
        for count in sys.argv[1:] or ("10", "10000", "100000"):
            done = subprocess.run(
                [sys.executable, __file__, "child", count], capture_output=True, text=True, check=True
            )
            print(done.stdout.splitlines()[-1], flush=True)
