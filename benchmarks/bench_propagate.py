"""How fast is a propagation per format, and what do samples and drift cost on top of bare heyoka?

Run: python -m pytest benchmarks/bench_propagate.py --benchmark-enable
"""

from fractions import Fraction
from statistics import median
from time import perf_counter, process_time

import heyoka
import numpy
import pytest

from heavytop.cases import CASES
from heavytop.integrate.heyoka.engines import compiled, expressions
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scorer import Drift
from heavytop.precision import DOUBLE, EXTENDED, QUAD, exact, number, real
from heavytop.top.equations import HEAVY_TOP, VARIABLES, Parameters, holding

TOP, START = CASES["kovalevskaya"].top, CASES["kovalevskaya"].start


def drift_text(top, start, precision, times) -> tuple[str, object]:
    """Largest drift of the energy on the way, and the run."""
    drift = Drift(Problem.of(top, start, precision), holding(top, start))
    run = propagate(top, start, times, precision, observer=drift)
    return drift.metrics()["drift_energy_max"].value, run


@pytest.mark.parametrize(
    ("precision", "horizon"),
    [(DOUBLE, 10000), (EXTENDED, 2000), (QUAD, 50), (real(237), 10), (real(1024), 1)],
    ids=lambda value: getattr(value, "name", value),
)
def test_propagate(benchmark, precision, horizon: int) -> None:
    compiled(HEAVY_TOP, precision)
    run = benchmark.pedantic(propagate, (TOP, START, [horizon], precision), rounds=3, warmup_rounds=1)
    benchmark.extra_info["steps"] = str(run.steps)
    benchmark.extra_info["order"] = str(run.order)
    benchmark.extra_info["microseconds_per_step"] = f"{benchmark.stats['median'] / run.steps * 1e6:.3g}"
    benchmark.extra_info["largest_drift_of_the_energy"] = drift_text(TOP, START, precision, [horizon])[0]


def test_thousand_samples_with_drift_against_bare_heyoka(benchmark) -> None:
    """T = 1e5 in double, 1,000 samples with the drift of every integral, against ``propagate_until`` alone: the same
    field with par[i], and the field with literal coefficients.  Interleaved; medians of the ratios.
    """
    horizon = Fraction(100000)
    times = [horizon * i / 1000 for i in range(1, 1001)]
    problem = Problem.of(TOP, START, DOUBLE)
    literals = Parameters(
        [heyoka.expression(float(v)) for v in problem.parameters.inertia],
        [heyoka.expression(float(v)) for v in problem.parameters.moment],
        None,
    )
    y = heyoka.make_vars(*VARIABLES)
    start = [float(v) for v in problem.start.flat]
    with_literals = heyoka.taylor_adaptive(list(zip(y, HEAVY_TOP.field(literals, y), strict=True)), start)
    coefficients = [float(v) for v in (*problem.parameters.inertia, *problem.parameters.moment)]
    with_par = heyoka.taylor_adaptive(expressions(HEAVY_TOP, False), start, pars=coefficients)
    compiled(HEAVY_TOP, DOUBLE)

    def bare(engine) -> float:
        engine.time, engine.state[:] = 0.0, start
        began = perf_counter()
        engine.propagate_until(float(horizon))
        return perf_counter() - began

    def ours() -> float:
        began = perf_counter()
        drift_text(TOP, START, DOUBLE, times)
        return perf_counter() - began

    ours(), bare(with_par), bare(with_literals)
    triples = [(ours(), bare(with_par), bare(with_literals)) for _ in range(11)]
    benchmark.extra_info["ratio_to_heyoka_with_par"] = f"{median(a / b for a, b, _ in triples):.3f}"
    benchmark.extra_info["ratio_to_heyoka_with_literals"] = f"{median(a / c for a, _, c in triples):.3f}"
    benchmark.extra_info["largest_drift_of_the_energy"] = drift_text(TOP, START, DOUBLE, times)[0]
    benchmark.pedantic(ours, rounds=3)


def test_samples_do_not_change_the_end(benchmark) -> None:
    """What the samples cost without drift."""
    times = [Fraction(10 * i) for i in range(1, 1001)]
    run = benchmark.pedantic(propagate, (TOP, START, times, DOUBLE), rounds=5, warmup_rounds=1)
    alone = propagate(TOP, START, times[-1:], DOUBLE)
    difference = max(abs(exact(a) - exact(b)) for a, b in zip(run.states[-1], alone.states[-1], strict=True))
    assert difference == 0
    benchmark.extra_info["difference_at_the_end"] = str(difference)
    assert numpy.isfinite(run.states[-1]).all()
    assert number(times[-1], DOUBLE) == 10000


@pytest.mark.parametrize("integrator", [propagate, propagate_multiword], ids=["heyoka", "multiword"])
def test_twenty_thousand_samples_against_one(benchmark, integrator) -> None:
    """T = 1000 in double: 20,000 regular samples, and the last alone, interleaved; processor seconds, least of 15."""
    times = [Fraction(k, 20) for k in range(1, 20001)]

    def seconds(asked: list[Fraction]) -> float:
        began = process_time()
        integrator(TOP, START, asked, DOUBLE)
        return process_time() - began

    seconds(times), seconds(times[-1:])
    pairs = [(seconds(times), seconds(times[-1:])) for _ in range(15)]
    many, one = (min(each) for each in zip(*pairs, strict=True))
    benchmark.extra_info["ratio"] = f"{many / one:.2f}"
    benchmark.extra_info["microseconds_per_sample"] = f"{(many - one) / len(times) * 1e6:.3f}"
    benchmark.extra_info["milliseconds_of_one"] = f"{one * 1e3:.2f}"
    benchmark.pedantic(integrator, (TOP, START, times, DOUBLE), rounds=3)


def test_repr_of_many_rows(benchmark) -> None:
    """The text of a run of 200,000 samples, of which it shows ten."""
    run = propagate(TOP, START, [Fraction(k, 200) for k in range(1, 200001)], DOUBLE)
    benchmark.pedantic(repr, (run,), rounds=5)
