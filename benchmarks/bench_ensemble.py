"""What do lanes and threads gain over a plain loop of heyoka, and what do samples with drift cost?

Run on a quiet machine: python -m pytest benchmarks/bench_ensemble.py --benchmark-enable
"""

import os
from fractions import Fraction
from random import Random
from statistics import median
from time import perf_counter, process_time

import numpy
import pytest

from heavytop.cases import CASES
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.engines import arrays, compiled
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.scorer import Drift
from heavytop.precision import DOUBLE
from heavytop.top.equations import HEAVY_TOP, holding
from heavytop.top.heavy_top import State

TOP, START = CASES["kovalevskaya"].top, CASES["kovalevskaya"].start


def starts(count: int) -> list[State]:
    """Near the case's own: each component of Ω moved by up to 1/20."""
    random = Random(3)
    return [
        State([value + Fraction(random.randint(-50, 50), 1000) for value in START.omega], START.gamma)
        for _ in range(count)
    ]


def problems(count: int) -> list[Problem]:
    return [Problem.of(TOP, start, DOUBLE) for start in starts(count)]


@pytest.mark.parametrize("lanes", [2, 4, 8, 16])
@pytest.mark.parametrize("threads", [1, 2])
def test_hundred_starts_against_a_plain_loop(benchmark, lanes: int, threads: int) -> None:
    """T = 1000 in double.  Alternated with the loop; the median of seven ratios.

    The ratio of processor times is what one processor gains; it depends less on what else the machine does.
    """
    given = problems(100)
    engine = compiled(HEAVY_TOP, DOUBLE).engine
    numbers = [arrays(problem) for problem in given]

    def timed(work):
        began, processor = perf_counter(), process_time()
        result = work()
        return perf_counter() - began, process_time() - processor, result

    def plain() -> list:
        ends = []
        for parameters, state in numbers:
            engine.time, engine.pars[:], engine.state[:] = 0.0, parameters, state
            engine.propagate_until(1000.0)
            ends.append(engine.state.copy())
        return ends

    def ours() -> list:
        return propagate_ensemble(given, [1000], lanes=lanes, threads=threads)

    ours()
    pairs = [(timed(plain), timed(ours)) for _ in range(7)]
    (*_, ends), (*_, runs) = pairs[-1]
    assert all(run.outcome is Outcome.SUCCESS for run in runs)
    off = max(numpy.abs(run.states[-1] - end).max() for run, end in zip(runs, ends, strict=True))
    assert off < 1e-9
    for name, clock in (("times_as_fast_as_the_loop", 0), ("times_less_processor_time", 1)):
        ratios = sorted(one[clock] / two[clock] for one, two in pairs)
        benchmark.extra_info[name] = f"{median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})"
    benchmark.extra_info["largest_difference_from_the_loop"] = f"{off:.2g}"
    benchmark.extra_info["load_of_the_machine"] = f"{os.getloadavg()[0]:.1f} on {len(os.sched_getaffinity(0))}"
    benchmark.pedantic(ours, rounds=3)


@pytest.mark.parametrize("samples", [1, 100, 1000])
@pytest.mark.parametrize("watched", [False, True], ids=["states alone", "with drift"])
def test_samples_of_64_starts(benchmark, samples: int, watched: bool) -> None:
    """T = 1e5 in double, samples evenly spaced; log-spaced ones cost less, since many are early."""
    given = problems(64)
    times = [Fraction(10**5 * i, samples) for i in range(1, samples + 1)]

    def ours() -> list[Drift]:
        drifts = [Drift(problem, holding(TOP, start)) for problem, start in zip(given, starts(64), strict=True)]
        propagate_ensemble(given, times, observer=lambda i, t, y: drifts[i](t, y) if watched else None)
        return drifts

    drifts = benchmark.pedantic(ours, rounds=1, warmup_rounds=0)
    if watched:
        worst = max((drift.metrics()["drift_energy_max"] for drift in drifts), key=lambda metric: metric.log10 or -999)
        benchmark.extra_info["largest_drift_of_the_energy"] = worst.value
