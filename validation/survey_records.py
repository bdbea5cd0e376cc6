"""Records of a survey against the scorer, motion by motion: `python validation/survey_records.py [MOTIONS]`, by default
1000 of each class.

T = 10, 10 samples, heyoka in double.  The scorer takes its reference from a closed form or an enclosure where there is
one.  Printed for each class: how many motions, and of each quantity the largest relative difference of the two; where
the quantity itself is below the radius of its reference both are noise, and it is left out and counted.
"""

from __future__ import annotations

import math
import sys
from fractions import Fraction
from typing import Any, get_args, get_type_hints

from heavytop.features.survey import measured as records
from heavytop.features.survey.measured import chunks, drawn
from heavytop.harness.sweeps import Random
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.registry import described
from heavytop.measure.scorer import Scorer
from heavytop.measure.truth import truth
from heavytop.precision import DOUBLE

TIMES = [Fraction(n) for n in range(1, 11)]
FAMILIES = get_args(get_type_hints(Random)["family"])
RECORDED = {
    "error_max": "solution_error_relative_max",
    "error_omega": "solution_error_omega_max",
    "error_gamma": "solution_error_gamma_max",
    "drift_gamma_squared": "drift_gamma_squared_max",
    "drift_area": "drift_area_max",
    "drift_energy": "drift_energy_max",
}


def main(count: int) -> None:
    """A line a class."""
    for family in FAMILIES:
        sweep = Random(name="s", seed=11, count=count, family=family)
        motions = drawn(chunks(sweep, sweep.cases(), 0), DOUBLE)
        found = records.measured(motions, described("heyoka"), TIMES, DOUBLE, {})
        runs = propagate_ensemble(motions.problems, TIMES, threads=1)
        apart: dict[str, float] = dict.fromkeys(RECORDED, 0.0)
        steps = skipped = 0
        for place, (problem, run) in enumerate(zip(motions.problems, runs, strict=True)):
            scored = _scored(problem, run)
            steps += int(found["steps"][place] != run.steps)
            for name, metric in RECORDED.items():
                ours = float(found[name][place])
                size = float(scored[metric])
                if not math.isfinite(size) or size < 1e3 * float(found["reference_radius"][place]):
                    skipped += 1
                    continue
                apart[name] = max(apart[name], abs(ours - size) / size)
        said = ", ".join(f"{name} {value:.1e}" for name, value in apart.items())
        kinds = ", ".join(sorted(set(motions.classes)))
        print(f"{family} ({kinds}): {count} motions, {steps} with other steps, {skipped} left out; {said}", flush=True)


def _scored(problem: Any, run: Any) -> dict[str, Any]:
    scorer = Scorer(problem, truth(problem, TIMES))
    for time, state in zip(run.times, run.states, strict=True):
        scorer(time, state)
    return scorer.metrics()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
