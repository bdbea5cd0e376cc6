"""How the errors of three words grow, in the bits of the words themselves: no format's rounding hides them.

No format is served by words without bits to spare (eight at least), so that rows of plans show no exponent there.
Random starts of a case of the plans, integrals exactly from the words; along the flow against the closed form.

Run: python validation/words_grid_laws.py [--case kovalevskaya] [--starts 64] [--horizon 1e5] [--processes 2]
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from functools import partial

import numpy

from heavytop.cases import CASES
from heavytop.exact.flint.balls import midpoint
from heavytop.harness.case_text import ensemble_of
from heavytop.integrate.trajectory import Problem
from heavytop.measure.growth import Ensemble, law
from heavytop.measure.truth import closed_form
from heavytop.multiword.fixed_point.arithmetic import grid_of
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.problem import Scaled
from heavytop.precision import real
from heavytop.top.equations import Parameters

SAMPLES, START_BITS, TRUE_BITS = 16, 53, 200
NAMES = ("energy", "area", "abs. square of γ", "along the flow")


def integrals(p: Parameters, y: tuple[Fraction, ...]) -> list[Fraction]:
    """Energy, area, |γ|²."""
    omega, gamma, inertia = y[:3], y[3:], p.inertia
    energy = sum(i * w * w for i, w in zip(inertia, omega, strict=True)) / 2
    energy += sum(n * g for n, g in zip(p.moment, gamma, strict=True))
    area = sum(i * w * g for i, w, g in zip(inertia, omega, gamma, strict=True))
    return [energy, area, sum(g * g for g in gamma)]


def errors(case: str, times: list[Fraction], index: int) -> tuple[list[list[float]], int]:
    """|error| of each name at the times, of one random start; and the steps taken."""
    top, start = ensemble_of(CASES[case], index + 1, 1)[index]
    problem = Problem.of(top, start, real(START_BITS), system=CASES[case].system)
    scaled = Scaled.of(problem.system, problem.parameters, problem.start.flat, bounded=True)
    run, truth = Fixed(scaled, grid_of(3), True), closed_form(problem)
    assert truth is not None
    first, found = integrals(problem.parameters, problem.start.flat), []
    for time in times:
        run.advance(time * scaled.rate, 10**9)
        sample = run.sample(time * scaled.rate)
        assert sample is not None
        state = scaled.back(sample)
        true = tuple(midpoint(ball) for ball in truth.state(time, TRUE_BITS))
        velocity = problem.system.field(problem.parameters, true)
        apart = sum((a - b) * v for a, b, v in zip(state, true, velocity, strict=True))
        drifts = [a - b for a, b in zip(integrals(problem.parameters, state), first, strict=True)]
        found.append([abs(float(value)) for value in (*drifts, apart / sum(v * v for v in velocity))])
    return found, run.steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", choices=("euler", "lagrange", "kovalevskaya"), default="kovalevskaya")
    parser.add_argument("--starts", type=int, default=64)
    parser.add_argument("--horizon", type=float, default=1e5)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    times = [Fraction(int(16 * t), 16) for t in numpy.geomspace(given.horizon / 1e3, given.horizon, SAMPLES)]
    with ProcessPoolExecutor(given.processes) as pool:
        found = list(pool.map(partial(errors, given.case, times), range(given.starts)))
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
