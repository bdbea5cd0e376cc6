"""How often the 95 % interval of a law of growth holds its exponent: `python validation/law_coverage.py [ENSEMBLES]`.

Ensembles of 16 and of 64 starts are drawn for each law.  An ensemble whose class is not recognised counts as not
covered.  Exit code 1 where fewer than 92 % are: 184 of 200.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy

from heavytop.measure.growth import Ensemble, law

STEP = 0.5
EPS = 2.0**-52
TIMES = 10 ** (numpy.arange(8 * 5 + 1) / 8)
NAMES = {"walk": "t^0.5", "linear": "t", "integrated": "t^1.5", "quadratic": "t^2", "bounded": "bounded"}
EXPONENT = {"walk": 0.5, "linear": 1, "integrated": 1.5, "quadratic": 2, "bounded": 0}


def walks(rng, starts: int, times=TIMES):
    """A random walk of EPS a step and its sum, exactly at the times: shape (2, starts, samples)."""
    walk, total, done = numpy.zeros(starts), numpy.zeros(starts), 0
    found = []
    for steps in numpy.round(times / STEP):
        n = steps - done
        rise, bridge = rng.normal(size=(2, starts))
        # n steps at once: the sum of a walk given its end has mean n/2 of it and variance n³/12
        total = total + n * walk + n**1.5 * (rise / 2 + bridge / 12**0.5)
        walk, done = walk + rise * n**0.5, steps
        found.append((walk, total))
    return EPS * numpy.moveaxis(numpy.array(found), 0, 2)


def synthetic(kind: str, rng, starts: int = 64, times=TIMES):
    """|error|, shape (starts, samples), with amplitudes that scatter over the starts by a factor 2."""
    amplitude = numpy.exp(0.7 * rng.normal(size=(starts, 1)))
    phase = rng.uniform(0, 6.28, size=(starts, 1))
    if kind in ("walk", "integrated"):
        values = walks(rng, starts, times)[int(kind == "integrated")] * amplitude
    elif kind == "bounded":
        values = 1e-12 * amplitude * numpy.sin(1.3 * times + phase)
    else:
        values = EPS * amplitude * (times / STEP) ** EXPONENT[kind] * (1 + 0.3 * numpy.sin(1.7 * times + phase))
    # the sample is rounded to a number of the format
    return numpy.abs(numpy.round(values / EPS) * EPS)


def chaotic(rng, starts: int, rate: float = 0.15, times=TIMES, spread: float = 0.0):
    """Rates that scatter over the starts by the relative ``spread``, about their median; errors saturate at 1."""
    rates = rate * (1 + spread * rng.normal(size=(starts, 1))) if spread else rate
    grown = EPS * numpy.abs(rng.normal(size=(starts, 1))) * numpy.exp(numpy.minimum(rates * times, 60))
    return numpy.where(grown < 1, grown, 1) * numpy.exp(0.5 * rng.normal(size=(starts, len(times))))


RATE = 0.15
FINE = 10 ** (numpy.arange(32 * 4 + 1) / 32)
"""The times of plan `growth` for a chaotic motion."""
LEAST = 0.92


def covered(draw: Callable[[Any], Any], times: Any, growth: str, exponent: float, count: int) -> tuple[int, Counter]:
    """How many of ``count`` ensembles are of the class and hold the exponent in their interval; and the classes."""
    rng = numpy.random.default_rng(20261121)
    inside, classes, widths = 0, Counter(), []
    for _ in range(count):
        found = law(Ensemble(times, draw(rng), STEP))
        classes[found.growth] += 1
        if found.growth == growth and found.low is not None:
            inside += found.low <= exponent <= found.high
            widths.append((found.high - found.low) / 2)
    classes["half-width"] = round(float(numpy.median(widths)), 4) if widths else None
    return inside, classes


def main(count: int) -> int:
    worst = count
    for starts in (16, 64):
        cells: list[tuple[str, Callable[[Any], Any], Any, str, float]] = [
            (growth, lambda rng, k=kind, n=starts: synthetic(k, rng, n), TIMES, growth, EXPONENT[kind])
            for kind, growth in NAMES.items()
        ]
        cells += [
            (
                f"exponential, rates scatter by {spread:.0%}",
                lambda rng, s=spread, n=starts: chaotic(rng, n, RATE, FINE, s),
                FINE,
                "exponential",
                RATE,
            )
            for spread in (0.0, 0.05, 0.12)
        ]
        for name, draw, times, growth, exponent in cells:
            inside, classes = covered(draw, times, growth, exponent, count)
            worst = min(worst, inside)
            print(f"{starts} starts, {name}: {inside} of {count}; {dict(classes)}", flush=True)
    return int(worst < LEAST * count)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
