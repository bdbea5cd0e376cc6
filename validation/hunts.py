"""How long a hunt takes to find each planted fault, and what it shrinks it to.

    python validation/hunts.py [SEED ...]

Each fault of tests/support/hunted_integrators.py is hunted as a file, in a process of its own, over T = 100 with a
budget of 120 s; processor seconds of this process and its children are what is reported.  The healthy one comes last.
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path
from time import perf_counter

import heavytop as ht

FAULTS = Path(__file__).parents[1] / "tests" / "support" / "hunted_integrators.py"


def processor_seconds() -> float:
    """Of this process and of children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def measure(integrator: str, budget: str, seed: int) -> None:
    """A line about one hunt."""
    began, used = perf_counter(), processor_seconds()
    hunt = ht.hunt(integrator, budget=budget, seed=seed)
    seconds, used = perf_counter() - began, processor_seconds() - used
    taken = f"{hunt.motions:6} motions, {seconds:5.1f} s ({used:5.1f} s of processor)"
    head = f"{integrator.rpartition(':')[2]:8} seed {seed}: {taken}"
    if not hunt.found:
        print(f"{head}: nothing found")
    for each in hunt.found[:1]:
        data = "; ".join(f"{key} {each[key]}" for key in ("inertia", "weight", "centre", "omega", "gamma"))
        print(f"{head}: {each['outcome']}, {each['digits_lost']} digits lost: {data}")
    sys.stdout.flush()


if __name__ == "__main__":
    for seed in map(int, sys.argv[1:] or ["1", "2", "3"]):
        for fault in ("ratio", "branch", "spin", "rest"):
            measure(f"{FAULTS}:{fault}", "120s", seed)
        measure("heyoka", "2000", seed)
