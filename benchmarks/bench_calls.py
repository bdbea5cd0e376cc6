"""What a short call costs around its integration: the bare engine, ht.Integrator and ht.propagate taking turns.

    python benchmarks/bench_calls.py [ROUNDS]

One motion to t = 1/10 in double.  heyoka alone: an engine at hand, loaded with the start, stepped and sampled.
Turns of 20 calls each; medians of all calls of ROUNDS (default 100) rounds, in µs.
"""

from __future__ import annotations

import random
import statistics
import sys
from collections.abc import Callable
from time import perf_counter

import numpy

import heavytop as ht
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import states_at
from heavytop.precision import DOUBLE
from heavytop.top.equations import HEAVY_TOP

TOP = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=(0, "1/4", "1/3"))
START = ht.State(omega=(1, "1/2", "1/3"), gamma=("3/5", 0, "4/5"))
ROW = numpy.array([1, 0.5, 1 / 3, 0.6, 0, 0.8])
AT = 0.1
TURN = 20


def bare() -> Callable[[], object]:
    """heyoka alone."""
    tool = compiled(HEAVY_TOP, DOUBLE)
    with tool.borrowed() as engine:
        found = engine
    tool.spare.remove(found)
    found.pars[:] = [3, 2, 1, 0, 1 / 4, 1 / 3]

    def call() -> object:
        found.time = 0.0
        found.state[:] = ROW
        found.step(write_tc=True)
        return found.update_d_output(AT).copy()

    assert (call() == states_at(found, [3, 2, 1, 0, 1 / 4, 1 / 3], ROW, (AT,), None, DOUBLE)[0][0]).all()
    return call


def main() -> None:
    """A line a way of calling."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    dice = random.Random(1)
    others = [ht.State((1, dice.random(), "1/3"), ("3/5", 0, "4/5")) for _ in range(TURN * rounds + 1)]
    prepared, words = ht.Integrator(TOP), ht.Integrator(TOP, integrator="multiword")
    rows = numpy.tile(ROW, (100, 1))
    state = iter(others)
    calls: dict[str, Callable[[], object]] = {
        "heyoka alone": bare(),
        "ht.Integrator, an array": lambda: prepared.propagate(ROW, AT),
        "ht.Integrator, a State": lambda: prepared.propagate(START, AT),
        "ht.propagate, the same top and start": lambda: ht.propagate(TOP, START, [AT]),
        "ht.propagate, another start each time": lambda: ht.propagate(TOP, next(state), [AT]),
        "multiword: ht.Integrator": lambda: words.propagate(START, AT),
        "multiword: ht.propagate, the same top and start": lambda: ht.propagate(
            TOP, START, [AT], integrator="multiword"
        ),
        "ht.Integrator, each of 100 starts": lambda: prepared.propagate(rows, AT),
    }
    for call in calls.values():
        call()
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            for _ in range(TURN):
                began = perf_counter()
                call()
                seconds[name].append(perf_counter() - began)
    for name, found in seconds.items():
        each = 100 if "100" in name else 1
        print(f"{name:50} {statistics.median(found) * 1e6 / each:8.1f}")


if __name__ == "__main__":
    main()
