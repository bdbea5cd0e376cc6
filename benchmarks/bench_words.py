"""What a unit of time costs by words and by heyoka in the same format, taking turns, and how far off each then is.

Bare integration on both sides: heyoka's ``propagate_until`` with par[i], and the machine code of words; compiling and
the wall apart.  Ratios are medians over rounds; the error is against the proven motion or a run with 150 bits more.

Run: python -m pytest benchmarks/bench_words.py --benchmark-enable -s
"""

from __future__ import annotations

from fractions import Fraction
from statistics import median
from time import perf_counter, thread_time

import pytest

from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.engines import compiled, load
from heavytop.integrate.multiword.engines import choose
from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, EXTENDED, QUAD, Precision, exact, number, real
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

GAMMA = ("3/5", 0, "4/5")
NEARLY_UP = (Fraction(200, 10001), 0, Fraction(9999, 10001))
MOTIONS = {
    "kovalevskaya": (HeavyTop((2, 2, 1), 1, (0, 1, 0)), State(("1/10", "1/5", "9/10"), GAMMA)),
    "euler": (HeavyTop((3, 2, 1), 0, (0, 0, 0)), State((3, 1, 4), GAMMA)),
    "lagrange": (HeavyTop((1, 1, "1/2"), 1, (0, 0, 1)), State((1, 2, 10), NEARLY_UP)),
    "generic": (HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "1/5", "9/10"), GAMMA)),
}
# format, tolerance on both sides, units of time by words and by heyoka in one turn, rounds
SETTINGS = {
    "double": (DOUBLE, None, 1000, 1000, 15),
    "double at 1e-14": (DOUBLE, Fraction(1, 10**14), 1000, 1000, 15),
    "extended": (EXTENDED, None, 1000, 100, 9),
    "quad": (QUAD, None, 50, 2, 7),
    "real:276": (real(276), None, 16, 1, 9),
    "real:528": (real(528), None, 4, Fraction(1, 2), 5),
    "real:1000": (real(1000), None, 1, Fraction(1, 4), 3),
}


def by_words(problem: Problem, tolerance: Fraction | None, span: Fraction) -> float:
    """Seconds of processor time a unit of time."""
    arithmetic, scaled = choose(problem, tolerance)
    run = arithmetic.begin(scaled, True)
    began = thread_time()
    run.advance(span * scaled.rate, 10**9)
    return (thread_time() - began) / float(run.time / scaled.rate)


def by_heyoka(problem: Problem, tolerance: Fraction | None, span: Fraction) -> float:
    """Seconds a unit of time; to the end of a whole step."""
    with compiled(HEAVY_TOP, problem.precision, tolerance=tolerance).borrowed() as engine:
        load(engine, problem)
        end = number(span, problem.precision)
        began = thread_time()
        while engine.time < end:
            engine.propagate_until(number(Fraction(2) ** 60, problem.precision), max_steps=_steps_ahead(engine, end))
        return (thread_time() - began) / float(exact(engine.time))


def _steps_ahead(engine, end) -> int:
    """How many steps of the last length fit in before the end; heyoka cuts its last step there, which costs as much."""
    length = abs(float(engine.last_h))
    return max(1, int(float(end - engine.time) / length)) if length else 1


def error(problem: Problem, tolerance: Fraction | None, span: Fraction) -> tuple[float, float]:
    """The largest error at ``span`` by words and by heyoka, each as it is handed over."""
    from heavytop.integrate.heyoka.motions import propagate

    wide = propagate_multiword(problem.top, problem.start, [span], real(problem.precision.bits + 150)).states[0]
    found = []
    for how in (propagate_multiword, propagate):
        state = how(problem.top, problem.start, [span], problem.precision, tolerance=tolerance).states[0]
        found.append(max(abs(float(exact(a) - exact(b))) for a, b in zip(state, wide, strict=True)))
    return found[0], found[1]


def said(title: str, found: dict[str, str]) -> None:
    """A line of what was found."""
    print(f"\n{title}: {'; '.join(f'{key} {value}' for key, value in found.items())}", flush=True)


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("setting", SETTINGS)
def test_a_unit_of_time(benchmark, setting: str, name: str) -> None:
    precision, tolerance, long, short, rounds = SETTINGS[setting]
    problem = Problem.of(*MOTIONS[name], precision)
    by_words(problem, tolerance, Fraction(1, 10)), by_heyoka(problem, tolerance, Fraction(1, 10))
    turns = [
        (by_words(problem, tolerance, Fraction(long)), by_heyoka(problem, tolerance, Fraction(short)))
        for _ in range(rounds)
    ]
    span = Fraction(min(long, short))
    ours, theirs = error(problem, tolerance, span)
    benchmark.extra_info["microseconds_by_words"] = f"{median(a for a, _ in turns) * 1e6:.4g}"
    benchmark.extra_info["microseconds_by_heyoka"] = f"{median(b for _, b in turns) * 1e6:.4g}"
    benchmark.extra_info["times_faster"] = f"{median(b / a for a, b in turns):.3g}"
    benchmark.extra_info[f"error_at_{span}"] = f"{ours:.2g} by words, {theirs:.2g} by heyoka"
    said(f"{setting}, {name}", benchmark.extra_info)
    benchmark.pedantic(by_words, (problem, tolerance, Fraction(1)), rounds=1)


@pytest.mark.parametrize("precision", [DOUBLE, DOUBLE_DOUBLE], ids=lambda p: p.name)
def test_eight_motions_in_lanes(benchmark, precision: Precision) -> None:
    """64 starts of the Kovalevskaya top, one thread and two; heyoka's batch of eight beside it in double."""
    top = MOTIONS["kovalevskaya"][0]
    starts = [State((Fraction(k, 64), Fraction(1, 5), Fraction(9, 10) - Fraction(k, 50)), (1, 0, 0)) for k in range(64)]
    problems, span = [Problem.of(top, start, precision) for start in starts], 1000
    motions = len(starts) * span

    def turn(run, **options) -> float:
        began = perf_counter()
        run(problems, [span], **options)
        return (perf_counter() - began) / motions * 1e6

    turn(propagate_multiword_ensemble)
    one, two = ([turn(propagate_multiword_ensemble, threads=n) for _ in range(5)] for n in (1, 2))
    cost = f"{median(one):.3g} by one thread, {median(two):.3g} by two"
    benchmark.extra_info["microseconds_a_motion_and_unit"] = cost
    if precision is DOUBLE:
        turn(propagate_ensemble)
        pairs = [(turn(propagate_multiword_ensemble, threads=1), turn(propagate_ensemble, threads=1)) for _ in range(5)]
        benchmark.extra_info["microseconds_by_heyoka"] = f"{median(b for _, b in pairs):.3g}"
        benchmark.extra_info["words_over_heyoka"] = f"{median(a / b for a, b in pairs):.3g}"
    said(f"in lanes, {precision.name}", benchmark.extra_info)
    benchmark.pedantic(turn, (propagate_multiword_ensemble,), rounds=1)
