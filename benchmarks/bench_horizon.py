"""Does a run take time in proportion to its horizon, and no more memory for a longer one?

Run on a quiet machine: LARGEST_HORIZON=100000000 python -m pytest benchmarks/bench_horizon.py --benchmark-enable
Without LARGEST_HORIZON up to 10^6.  To 10^8 one trajectory takes about five minutes, 64 starts an hour.
"""

import json
import os
import subprocess
import sys

import numpy
import pytest

LARGEST = int(os.environ.get("LARGEST_HORIZON", "1000000"))

# in a process of its own: the peak of its memory is that of this run
RUN = """
import json, resource, sys
from fractions import Fraction
from time import process_time
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scorer import Drift
from heavytop.precision import DOUBLE
from heavytop.cases import CASES
from heavytop.top.heavy_top import State
from heavytop.top.equations import holding

horizon, count = int(sys.argv[1]), int(sys.argv[2])
case = CASES["kovalevskaya"]
starts = [State([v + Fraction(i, 1000) for v in case.start.omega], case.start.gamma) for i in range(count)]
given = [Problem.of(case.top, start, DOUBLE) for start in starts]
drifts = [Drift(*pair) for pair in zip(given, [holding(case.top, start) for start in starts])]
times = sorted({round(horizon ** Fraction(i, 100)) for i in range(1, 101)})


def run(times):
    if count == 1:
        return [propagate(case.top, case.start, times, DOUBLE, observer=drifts[0])]
    return propagate_ensemble(given, times, observer=lambda index, time, state: drifts[index](time, state))


run([1])
began = process_time()
runs = run(times)
json.dump({
    "seconds": process_time() - began,
    "steps": sum(run.steps for run in runs),
    "outcomes": sorted({run.outcome.value for run in runs}),
    "kilobytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    "drift": max(float(drift.metrics()["drift_energy_max"].value) for drift in drifts),
}, sys.stdout)
"""


def measured(horizon: int, count: int) -> dict:
    run = subprocess.run([sys.executable, "-c", RUN, str(horizon), str(count)], check=True, capture_output=True)
    found = json.loads(run.stdout)
    assert found["outcomes"] == ["success"]
    return found


@pytest.mark.parametrize("count", [1, 64])
def test_memory_does_not_grow_with_the_horizon(benchmark, count: int) -> None:
    """Peak resident memory for T = 1e4 and for the largest, 100 log-spaced samples with drift."""
    short = measured(10**4, count)
    long = benchmark.pedantic(measured, (LARGEST, count), rounds=1)
    growth = long["kilobytes"] / short["kilobytes"] - 1
    benchmark.extra_info["megabytes"] = (
        f"{short['kilobytes'] / 1024:.1f} at 1e4, {long['kilobytes'] / 1024:.1f} at {LARGEST:.0e}"
    )
    benchmark.extra_info["growth_in_percent"] = f"{100 * growth:.2f}"
    benchmark.extra_info["largest_drift_of_the_energy"] = f"{long['drift']:.3g}"
    assert growth <= 0.05


def test_time_is_in_proportion_to_the_horizon(benchmark) -> None:
    """Slope of log processor time against log T, one trajectory, from 1e5 up by factors of √10; best of three runs."""
    horizons = [round(10 ** (k / 2)) for k in range(10, 2 * len(str(LARGEST)) - 1)]

    def best(horizon: int) -> dict:
        return min((measured(horizon, 1) for _ in range(3)), key=lambda one: one["seconds"])

    found = [best(horizon) for horizon in horizons[:-1]]
    found.append(benchmark.pedantic(best, (horizons[-1],), rounds=1))
    for name in ("seconds", "steps"):
        slope = numpy.polyfit(numpy.log(horizons), numpy.log([one[name] for one in found]), 1)[0]
        benchmark.extra_info[f"slope_of_the_{name}"] = f"{slope:.4f} from {horizons[0]:.0e} to {horizons[-1]:.0e}"
    benchmark.extra_info["load_of_the_machine"] = f"{os.getloadavg()[0]:.1f} on {len(os.sched_getaffinity(0))}"
