"""How the errors of three words grow, in the bits of the words themselves: no format's rounding hides them.

No format is served by words without bits to spare (eight at least), so that rows of plans show no exponent there.
Random starts of the Kovalevskaya top, integrals exactly from the words; along the flow against four words.

Run: python benchmarks/words_grid_laws.py [--starts 32] [--horizon 1e4]
"""

from __future__ import annotations

import argparse
from fractions import Fraction
from random import Random

import numpy

from heavytop.measure.growth import Ensemble, law
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.words.digits import grid_of
from heavytop.words.fixed import Fixed
from heavytop.words.scaled import Scaled

TOP = HeavyTop((2, 2, 1), 1, (0, 1, 0))
SAMPLES = 16
NAMES = ("energy", "area", "abs. square of γ", "along the flow")


def integrals(y: tuple[Fraction, ...]) -> list[Fraction]:
    """Energy, area, |γ|²."""
    omega, gamma, inertia = y[:3], y[3:], TOP.inertia
    energy = sum(i * w * w for i, w in zip(inertia, omega, strict=True)) / 2
    energy += sum(n * g for n, g in zip(TOP.moment, gamma, strict=True))
    area = sum(i * w * g for i, w, g in zip(inertia, omega, gamma, strict=True))
    return [energy, area, sum(g * g for g in gamma)]


def errors(random: Random, times: list[Fraction]) -> tuple[list[list[float]], int]:
    """|error| of each name at the times, of one random start; and the steps taken."""
    omega = tuple(Fraction(random.randint(-4096, 4096), 4096) for _ in range(3))
    gamma = tuple(Fraction(random.randint(-4096, 4096), 4096) for _ in range(3))
    start = State(omega, gamma)
    scaled = Scaled.of(HEAVY_TOP, HEAVY_TOP.parameters(TOP, start), start.flat, bounded=True)
    three, four = (Fixed(scaled, grid_of(words), True) for words in (3, 4))
    first, found = integrals(start.flat), []
    for time in times:
        states = []
        for run in (three, four):
            run.advance(time * scaled.rate, 10**9)
            sample = run.sample(time * scaled.rate)
            assert sample is not None
            states.append(scaled.back(sample))
        velocity = HEAVY_TOP.field(HEAVY_TOP.parameters(TOP, start), states[1])
        apart = sum((a - b) * v for a, b, v in zip(*states, velocity, strict=True))
        along = apart / sum(v * v for v in velocity)
        drifts = [a - b for a, b in zip(integrals(states[0]), first, strict=True)]
        found.append([abs(float(value)) for value in (*drifts, along)])
    return found, three.steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=32)
    parser.add_argument("--horizon", type=float, default=1e4)
    given = parser.parse_args()
    random = Random(138)
    times = [Fraction(int(16 * t), 16) for t in numpy.geomspace(given.horizon / 1e3, given.horizon, SAMPLES)]
    found = [errors(random, times) for _ in range(given.starts)]
    step = given.horizon / numpy.mean([steps for _, steps in found])
    values = numpy.array([rows for rows, _ in found])
    for k, name in enumerate(NAMES):
        ensemble = Ensemble(numpy.array([float(t) for t in times]), values[:, :, k], step, accumulates=1 + k // 3)
        fitted = law(ensemble)
        rms = ensemble.rms()
        between = "none" if fitted.exponent is None else f"{fitted.exponent:.3f} [{fitted.low:.3f}, {fitted.high:.3f}]"
        print(f"{name}: exponent {between}, at the end {rms[-1]:.2g}", flush=True)


if __name__ == "__main__":
    main()
