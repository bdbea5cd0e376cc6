"""How far the states of words are those of the true motion, rounded: the largest error over random starts, in eps.

Run: python validation/words_accuracy.py [--starts 64] [--horizon 1e4] [--precision double]

Random starts of the cases euler, lagrange (spins to 10), gyrostat and kovalevskaya, against the closed form of the same
rounded data, at 64 times to the horizon; in eps max(1, |value|) of a component.
"""

from __future__ import annotations

import argparse
from fractions import Fraction
from random import Random

from heavytop.cases import CASES
from heavytop.exact.flint.balls import midpoint
from heavytop.harness.case_text import Member, ensemble_of
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.truth import closed_form
from heavytop.precision import Precision, exact, parse
from heavytop.top.heavy_top import State

SAMPLES, FASTEST = 64, 10


def members(name: str, count: int) -> list[Member]:
    """Random starts of a case; those of the Lagrange top spin at up to 10."""
    found = ensemble_of(CASES[name], count, 1)
    if name != "lagrange":
        return found
    random = Random(1)
    spins = (Fraction(random.randint(-1000 * FASTEST, 1000 * FASTEST), 1000) for _ in found)
    return [
        (top, State((*start.omega[:2], spin), start.gamma)) for (top, start), spin in zip(found, spins, strict=True)
    ]


def worst(name: str, count: int, times: list[Fraction], precision: Precision) -> float:
    """The largest error of a component over starts and times, in eps max(1, |value|)."""
    largest = 0.0
    for top, start in members(name, count):
        run = propagate_multiword(top, start, times, precision, system=CASES[name].system)
        assert run.outcome is Outcome.SUCCESS, run.outcome
        truth = closed_form(run.problem)
        assert truth is not None, start
        for time, state in zip(run.times, run.states, strict=True):
            for value, ball in zip(state, truth.state(time, 2 * precision.bits), strict=True):
                true = midpoint(ball)
                largest = max(largest, float(abs(exact(value) - true) / max(1, abs(true)) / precision.eps))
    return largest


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=64)
    parser.add_argument("--horizon", type=lambda text: int(float(text)), default=10_000)
    parser.add_argument("--precision", default="double")
    given = parser.parse_args()
    at = [Fraction(given.horizon * (i + 1), SAMPLES) for i in range(SAMPLES)]
    for case in ("euler", "lagrange", "gyrostat", "kovalevskaya"):
        print(f"{case}: {worst(case, given.starts, at, parse(given.precision)):.3f} eps", flush=True)
