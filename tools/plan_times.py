"""Where does the processor time of a plan go: compiling, integrating (runs and their reruns), runs of multiword that
are references, the rest of the truth, scoring, what else the rounding noise takes, the rest?  The last line is the
share of integrating once everything is imported and compiled.

Run: python tools/plan_times.py [PLAN]     (default; one process, processor seconds, by kind and row)
"""

from __future__ import annotations

import sys
from collections import Counter
from functools import reduce, wraps
from importlib import import_module
from time import process_time
from typing import Any

from heavytop.features.kinds import KINDS
from heavytop.harness import rows
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import read

PARTS = {
    "compiling": (
        "integrate.heyoka.engines:compiled",
        "integrate.multiword.engines:compiled",
        "integrate.multiword.engines:compiled_lanes",
    ),
    "integrating": (
        "integrate.registry:Integrator.propagate",
        "integrate.registry:Integrator.propagate_many",
        "integrate.heyoka.motions:propagate",
    ),
    "reference runs": ("measure.truth:_trajectories",),
    "truth": ("measure.truth:truth", "measure.truth:uncertified", "measure.truth:reference", "measure.truth:certified"),
    "scoring": ("measure.scorer:Scorer.__call__", "measure.scorer:Drift.flush", "measure.scorer:flush_together"),
    "noise": ("measure.rounding_noise:Reruns.of",),
}


class Clock:
    """Processor seconds of each part, without what is inside another."""

    def __init__(self) -> None:
        self.spent: Counter[str] = Counter()
        self.stack = ["rest"]
        self.last = process_time()

    def switch(self) -> None:
        now = process_time()
        self.spent[self.stack[-1]] += now - self.last
        self.last = now

    def around(self, function: Any, part: str) -> Any:
        @wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            self.switch()
            self.stack.append(part)
            try:
                return function(*arguments, **named)
            finally:
                self.switch()
                self.stack.pop()

        return call


def owner(function: str) -> tuple[Any, str]:
    """The module or class of ``MODULE:NAME``, and its attribute."""
    module, _, name = function.partition(":")
    *classes, attribute = name.split(".")
    return reduce(getattr, classes, import_module(f"heavytop.{module}")), attribute


def watch(clock: Clock) -> None:
    """Put the clock around each function, wherever a module has it."""
    for part, functions in PARTS.items():
        for function in functions:
            owned_by, attribute = owner(function)
            original = getattr(owned_by, attribute)
            timed = clock.around(original, part)
            owners = [owned_by]
            if not isinstance(owned_by, type):
                owners = [m for n, m in sys.modules.items() if n.startswith("heavytop")]
            for one in owners:
                if getattr(one, attribute, None) is original:
                    setattr(one, attribute, timed)


def main() -> None:
    plan = sys.argv[1] if len(sys.argv) > 1 else "default"
    only = sys.argv[2] if len(sys.argv) > 2 else ""
    _, _, tasks = read(plan, KINDS)
    import_module("sympy")  # its time is that of the start, whichever row needs it first
    clock = Clock()
    watch(clock)
    kinds: dict[str, Counter[str]] = {}
    whole: Counter[str] = Counter()
    for task in tasks:
        if only not in task.label:
            continue
        before = clock.spent.copy()
        row = rows.measure(KINDS[task.key.kind], task, Saved())
        clock.switch()
        spent = clock.spent - before
        kinds.setdefault(task.key.kind, Counter()).update(spent)
        whole.update(spent)
        parts = "  ".join(f"{part} {seconds:.2f}" for part, seconds in spent.most_common() if seconds > 0.005)
        print(f"{sum(spent.values()):7.2f}  {task.label:50} {row.reference.how:8} {parts}", flush=True)
    for kind, spent in [*kinds.items(), ("all", whole)]:
        parts = "  ".join(f"{part} {seconds:.1f}" for part, seconds in spent.most_common())
        print(f"{sum(spent.values()):7.1f}  {kind:20} {parts}")
    busy = whole.total() - whole["compiling"]
    integrated = whole["integrating"] + whole["reference runs"]
    print(f"integrating: {whole['integrating'] / busy:.1%}, with the runs of references {integrated / busy:.1%}")


if __name__ == "__main__":
    main()
