"""How often the 95 % interval of a law of growth holds its exponent: `python validation/law_coverage.py [ENSEMBLES]`.

Ensembles of 16 and of 64 starts are drawn for each law.  An ensemble whose class is not recognised counts as not
covered.  Exit code 1 where fewer than 92 % are: 184 of 200.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy

from heavytop.measure.growth import Ensemble, law

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.synthetic_ensembles import EXPONENT, NAMES, STEP, TIMES, chaotic, synthetic

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
