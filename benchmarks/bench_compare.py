"""How long do two reports of 100,000 rows with 4 metrics take to compare, and in how much memory?

Run: python -m pytest benchmarks/bench_compare.py --benchmark-enable
The whole command is timed, from its start to its end, with reading and checking both files.
"""

import math
import resource
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from heavytop.records import SCHEMA, Against, Metric, Report, Row, RowKey, Subject
from heavytop.report.store import store

ROWS = 100_000
NAMES = ("drift_energy_max", "drift_energy_rms", "solution_error_omega_max", "solution_error_omega_final")
FLAGS = {
    "tolerance": "2.220446049250313e-16",
    "order": "20",
    "compact_mode": "false",
    "high_accuracy": "false",
    "opt_level": "3",
    "fast_math": "false",
    "force_avx512": "false",
    "slp_vectorize": "false",
    "code_cache": "none",
    "coefficients": "par",
}
HEYOKA = Subject("computed", "heyoka")
AGAINST = Against("proven", "closed form: Euler-Poinsot")


def metric(random: Random) -> Metric:
    value = f"{10 ** random.gauss(-12, 0.1):.7E}"
    return Metric(value, round(math.log10(float(value)), 6), band=round(0.3 + 0.1 * random.random(), 4))


def large(folder: Path, seed: int) -> Path:
    random = Random(seed)
    rows = [
        Row(
            case=f"top-{number}",
            system="heavy_top",
            integrator="heyoka",
            precision="double",
            bits=53,
            outcome="success",
            horizon="100000",
            time_reached="100000",
            steps=164352,
            finite=True,
            metrics={name: metric(random) for name in NAMES},
            key=RowKey(
                "drift", f"top-{number}", "heavy_top", Subject("computed", "heyoka"), "double", horizon="100000"
            ),
            reference=AGAINST,
            measure="drift",
            measured="computed: heyoka in double",
            against=AGAINST.text,
            order=20,
            flags=FLAGS,
            input_rounding="6.34E-17",
            seconds={"compile": random.random(), "run": random.random()},
        )
        for number in range(ROWS)
    ]
    folder.mkdir()
    store.write(Report(SCHEMA, {"name": "large"}, {}, rows), folder)
    return folder


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("large")
    return [large(folder / str(seed), seed) for seed in range(2)]


def test_whole_command(benchmark, reports: list[Path]) -> None:
    command = [sys.executable, "-m", "heavytop", "compare", *map(str, reports)]
    done = benchmark.pedantic(
        subprocess.run, (command,), {"capture_output": True, "text": True, "check": True}, rounds=5
    )
    assert done.stdout.startswith(f"Verdict: same ({ROWS * len(NAMES)} same)\n")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    benchmark.extra_info["peak_megabytes"] = peak // 1024
    benchmark.extra_info["file_megabytes"] = (reports[0] / store.FILE).stat().st_size // 2**20
