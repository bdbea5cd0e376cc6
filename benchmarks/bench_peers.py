"""heyoka against its best peer in double at an error of 1e-10, side by side: the runs of both take turns.

Run on a quiet machine: python -m pytest benchmarks/bench_peers.py --benchmark-enable
The rungs are those of results/peers: of each integrator the fastest whose error stays below 1e-10 to the end.
"""

import statistics
import time
from fractions import Fraction
from pathlib import Path

import pytest

from heavytop.cases import CASES
from heavytop.features.kinds import KINDS
from heavytop.integrate import registry
from heavytop.precision import DOUBLE, exact
from heavytop.report.store.store import read

REPORT = Path(__file__).parents[1] / "results" / "peers"
OURS, THEIRS = ("heyoka", "heyoka:constants"), ("cyrk:DOP853", "cyrk:Vern8")
REPEATS, TURNS = 15, 20


def rungs(case: str) -> dict[str, str]:
    """The setting of each integrator."""
    found: dict[str, tuple[float, str]] = {}
    for row in read(REPORT, KINDS).rows:
        name, _, setting = row.integrator.partition(" ")
        error = row.metrics.get("error_max")
        if row.case != case or row.precision != "double" or row.outcome != "success" or name not in OURS + THEIRS:
            continue
        if error is not None and error.log10 is not None and error.log10 <= -10:
            found[name] = min(found.get(name, (float("inf"), "")), (row.seconds["least"], setting))
    return {name: setting for name, (_, setting) in found.items()}


@pytest.mark.parametrize("case", ["euler/T=1000", "lagrange/T=1000", "pendulum/T=1000", "generic/T=100"])
def test_heyoka_against_the_best_peer(benchmark, case: str) -> None:
    """Ratio of medians over twenty turns each: median of fifteen such, and the smallest and the largest."""
    name, _, horizon = case.partition("/T=")
    problem = CASES[name].top, CASES[name].start, [Fraction(horizon)], DOUBLE
    settings = {each: setting.partition("=") for each, setting in rungs(case).items()}
    ratios: dict[str, list[float]] = {each: [] for each in settings if each in OURS}

    def once(each: str) -> float:
        control, _, text = settings[each]
        time.sleep(0.001)
        run = registry.ready(each, None if text == "eps" else (control, exact(text)))(*problem)
        return run.seconds["run"]

    def repeat() -> None:
        spent = [{each: once(each) for each in settings} for _ in range(TURNS)]
        medians = {each: statistics.median(turn[each] for turn in spent) for each in settings}
        best = min(medians[each] for each in settings if each in THEIRS)
        for each, found in ratios.items():
            found.append(best / medians[each])

    benchmark.pedantic(repeat, rounds=REPEATS, warmup_rounds=1)
    for each, found in ratios.items():
        best = found[-REPEATS:]
        text = f"{statistics.median(best):.2f} ({min(best):.2f} to {max(best):.2f}) at {'='.join(settings[each][::2])}"
        benchmark.extra_info[f"times_faster_{each}"] = text
