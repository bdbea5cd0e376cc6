"""Random tops by the integrator multiword: is every result right, or an outcome that says why not?

Run: python validation/words_random_tops.py capacity [--runs 3000]   word sizes, good and bad, against more words
     python validation/words_random_tops.py formats [--runs 300] [--first 0]

formats: every format, moments, weights and spins over ten decades, against the enclosure or, where that is dear,
against a run with 60 bits more.
"""

from __future__ import annotations

import argparse
from collections import Counter
from fractions import Fraction
from random import Random

from heavytop.errors import OutOfReach
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.multiword.fixed_point.arithmetic import Grid, grid_of
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.problem import Scaled, Status
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, EXTENDED, QUAD, exact, real
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.heavy_top import HeavyTop, State

SPAN = Fraction(4)
WRONG_ULP = 1e6
DEAREST = 1.0
"""Seconds that an enclosure may take."""
GRIDS = [(words, bits) for words in (3, 6) for bits in (None, 48, 49, 50, 51, 52)]
FORMATS = [DOUBLE, EXTENDED, DOUBLE_DOUBLE, QUAD, real(276)]
EPS = {"double": 1, "extended": 1, "double-double": 2000, "quad": 8, "real": 8}
"""Units of eps max(1, |value|) within which a result counts as right."""


def moments(random: Random, decades: float) -> tuple[Fraction, ...]:
    """Of a body that there can be: sums of squares of three half axes."""
    axes = [Fraction(10 ** random.uniform(-decades / 4, decades / 4)).limit_denominator(10**6) ** 2 for _ in range(3)]
    return axes[1] + axes[2], axes[0] + axes[2], axes[0] + axes[1]


def some(random: Random, size: float = 1.0) -> tuple[Fraction, ...]:
    """Three numbers of about that size."""
    return tuple(Fraction(random.randint(-4096, 4096), 4096) * Fraction(size) for _ in range(3))


def capacity(runs: int) -> None:
    """Counts of what runs at each word size came to."""
    random, found = Random(2026), {grid: Counter() for grid in GRIDS}
    for index in range(-(-runs // len(GRIDS))):
        p = Parameters(moments(random, 1.0), some(random, 2.0), Fraction(0))
        scaled = Scaled.of(HEAVY_TOP, p, (*some(random, 3.0), *some(random, 0.6)), bounded=True)
        span = SPAN * scaled.rate
        truths = {}
        for words, bits in GRIDS:
            if words not in truths:
                known = Fixed(scaled, grid_of(2 * words), True)
                known.advance(span, 10**6)
                truths[words] = known.sample(span)
            grid = grid_of(words) if bits is None else Grid(words, bits)
            run = Fixed(scaled, grid, True)
            status = run.advance(span, 10**4)
            sample = run.sample(span) if status is Status.OK else None
            fired = "fired, " if run.redone else ""
            if sample is None:
                found[words, bits]["ended as an outcome"] += 1
                continue
            off = max(abs(a - b) for a, b in zip(sample, truths[words], strict=True)) * 2**grid.total
            found[words, bits][fired + ("right" if off < WRONG_ULP else f"WRONG (top {index})")] += 1
    for (words, bits), counts in found.items():
        name = f"{words} words of {bits or grid_of(words).bits} bits{'' if bits else ', in use'}"
        print(f"{name}: {dict(counts)}")


def truth(problem: Problem, time: Fraction) -> tuple[list[tuple[Fraction, Fraction]], str]:
    """Each component and its error bound at ``time``, from the format's data; and where they are from."""
    bits = problem.precision.bits
    try:
        balls = Validated(problem.top, problem.start, effort=DEAREST).state(time, bits + 40)
        return [(midpoint(ball), radius(ball)) for ball in balls], "proven"
    except OutOfReach:
        wide = propagate_multiword(problem.top, problem.start, [time], real(bits + 60)).states[0]
        return [(exact(value), Fraction(0)) for value in wide], "by 60 bits more"


def formats(first: int, runs: int) -> None:
    """The worst error of each format, in eps, and the outcomes."""
    worst, counts = dict.fromkeys(FORMATS, 0.0), {precision: Counter() for precision in FORMATS}
    for index in range(first, first + runs):
        random = Random(index)
        speed, weight = (10 ** random.uniform(-5, 5) for _ in range(2))
        top = HeavyTop(moments(random, 10.0), Fraction(weight), some(random))
        start = State(some(random, speed), some(random))
        # about ten radians, whatever turns it
        least = min(map(float, top.inertia))
        time = Fraction(10 / max(speed, (weight / least) ** 0.5)).limit_denominator(10**12)
        for precision in FORMATS:
            problem = Problem.of(top, start, precision)
            run = propagate_multiword(top, start, [time], precision)
            if run.outcome is not Outcome.SUCCESS:
                counts[precision][run.outcome.value] += 1
                continue
            known, how = truth(problem, run.times[0])
            off = 0.0
            for group in (slice(0, 3), slice(3, 6)):
                size = max(Fraction(1), *(abs(value) for value, _ in known[group]))
                for value, (middle, within) in zip(run.states[0][group], known[group], strict=True):
                    off = max(off, float((abs(exact(value) - middle) + within) / size / precision.eps))
            worst[precision] = max(worst[precision], off)
            right = off <= EPS[precision.family]
            counts[precision][f"right, {how}" if right else f"WRONG by {off:.3g} eps (top {index})"] += 1
    for precision in FORMATS:
        print(f"{precision.name}: worst {worst[precision]:.3g} eps, {dict(counts[precision])}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["capacity", "formats"])
    parser.add_argument("--runs", type=int)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    if given.what == "capacity":
        capacity(given.runs or 3000)
    else:
        formats(given.first, given.runs or 300)
