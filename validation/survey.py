"""Processor time, memory and bytes of a survey: `python validation/survey.py [MOTIONS ...]`, by default 1000 and 10000.

One process, T = 10, 10 samples, heyoka in double.  Bare: heyoka's lanes on the same motions, nothing else.
"""

from __future__ import annotations

import resource
import sys
import tempfile
from fractions import Fraction
from pathlib import Path
from time import process_time

import heavytop as ht
from heavytop.features.survey.gathered import FILE
from heavytop.features.survey.measured import chunks, drawn
from heavytop.harness.sweeps import Random
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.precision import DOUBLE

PLAN = """name = "many"
[[sweep]]
kind = "random"
name = "many"
seed = 1
count = {count}
[[measure]]
kind = "survey"
cases = ["sweep:many"]
horizon = "10"
"""
TIMES = [Fraction(n) for n in range(1, 11)]


def main(counts: list[int]) -> None:
    """A line a count."""
    sweep = Random(name="many", seed=1, count=1000)
    problems = drawn(chunks(sweep, sweep.cases(), 0), DOUBLE).problems
    propagate_ensemble(problems[:16], TIMES, threads=1)
    began = process_time()
    propagate_ensemble(problems, TIMES, threads=1)
    print(f"bare lanes: {(process_time() - began) / len(problems) * 1e6:.0f} us a motion")
    for count in counts:
        with tempfile.TemporaryDirectory() as folder:
            plan, out = Path(folder) / "plan.toml", Path(folder) / "out"
            plan.write_text(PLAN.format(count=count))
            began = process_time()
            ht.run(plan, out, workers=1)
            spent, size = process_time() - began, (out / FILE).stat().st_size
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{count}: {spent / count * 1e6:.0f} us and {size / count:.0f} bytes a motion, at most {most:.0f} MB")


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or [1000, 10000])
