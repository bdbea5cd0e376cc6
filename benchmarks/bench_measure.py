"""What does it cost to measure 256 states: drift of the integrals, and distance from an exact motion?

Run: python -m pytest benchmarks/bench_measure.py --benchmark-enable
"""

from fractions import Fraction

import pytest

from heavytop.cases import CASES
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.flint.balls import radius, radius_text
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scorer import Drift, SolutionError
from heavytop.measure.truth import Truth
from heavytop.precision import DOUBLE, EXTENDED, QUAD, real
from heavytop.records import Against
from heavytop.top.equations import holding

FORMATS = [DOUBLE, EXTENDED, QUAD, real(237)]
TIMES = [Fraction(i, 64) for i in range(1, 257)]


def measure_all(measure, run) -> None:
    for time, state in zip(run.times, run.states, strict=True):
        measure(time, state)
    measure.flush()


@pytest.mark.parametrize("precision", FORMATS, ids=lambda p: p.name)
def test_drift_of_many_states(benchmark, precision) -> None:
    case = CASES["kovalevskaya"]
    drift = Drift(Problem.of(case.top, case.start, precision), holding(case.top, case.start))
    benchmark(measure_all, drift, propagate(case.top, case.start, TIMES, precision))
    benchmark.extra_info["drift_of_the_energy"] = drift.metrics()["drift_energy_final"].value


@pytest.mark.parametrize("precision", FORMATS, ids=lambda p: p.name)
def test_solution_error_of_many_states(benchmark, precision) -> None:
    known = DeloneHomoclinic(Fraction(5, 4), Fraction(3))
    error = SolutionError(
        Problem.of(known.top, known.start, precision), Truth(Against("proven", known.method), known.state)
    )
    benchmark(measure_all, error, propagate(known.top, known.start, TIMES, precision))
    benchmark.extra_info["error_of_omega"] = error.metrics()["solution_error_omega_final"].value


@pytest.mark.parametrize("bits", [117, 177, 365, 3400])
def test_exact_evaluation(benchmark, bits: int) -> None:
    known = DeloneHomoclinic(Fraction(5, 4), Fraction(3))
    state = benchmark(known.state, Fraction(22, 7), bits)
    benchmark.extra_info["largest_radius"] = radius_text(max(radius(value) for value in state))
