"""Are calls from many threads the same, bit for bit, as the same calls in order?

Calls of `propagate`, `reference` and `drift` in mixed formats and digits, from eight threads that are switched as often
as Python can.  With ``--meddle`` another thread sets flint.ctx all the time.  Prints the calls that differ: 0.

Run: python validation/threads.py [CALLS] [--threads N] [--meddle]
"""

import argparse
import random
import sys
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from hashlib import sha256
from time import perf_counter
from typing import Any

from flint import ctx

from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Problem
from heavytop.measure.reference import reference
from heavytop.measure.scorer import Drift
from heavytop.precision import DOUBLE, EXTENDED, QUAD, real
from heavytop.top.equations import holding
from heavytop.top.heavy_top import HeavyTop, State

F = Fraction
FORMATS = (DOUBLE, EXTENDED, QUAD, real(100), real(237))
DIGITS = (15, 40, 120, 300)
CENTRES = (*3 * ((0, 0, 0), (0, 0, F(1, 3))), (F(1, 2), 0, F(1, 5)))
"""Euler's and Lagrange's tops have closed forms; the last has none and is enclosed, at 40 digits at the most."""


def some_top(rng: random.Random) -> tuple[HeavyTop, State]:
    side, up = F(rng.randint(20, 39), rng.randint(11, 19)), F(rng.randint(20, 39), rng.randint(11, 19))
    omega = [F(rng.randint(-14, 14), rng.randint(7, 13)) for _ in range(3)]
    return HeavyTop((side, side, up), 1, rng.choice(CENTRES)), State(omega, (F(3, 5), 0, F(4, 5)))


def call(seed: int) -> tuple[str, str]:
    """(what was called, a digest of all that it returned)."""
    rng = random.Random(seed)
    (top, start), precision = some_top(rng), rng.choice(FORMATS)
    times = sorted({F(rng.randint(1, 40), 10) for _ in range(3)})
    kind = ("propagate", "reference", "drift")[seed % 3]
    found: Any
    if kind == "propagate":
        xi = (F(0), F(1), F(0)) if seed % 2 else None
        run = propagate(top, start, times, precision, xi=xi)
        found, name = (run.texts(), run.steps, run.outcome), f"propagate {precision.name}"
    elif kind == "reference":
        digits = rng.choice(DIGITS[:2] if top.centre == CENTRES[-1] else DIGITS)
        found, name = reference(top, start, times, digits), f"reference {digits} digits"
    else:
        drift = Drift(Problem.of(top, start, precision), holding(top, start), times)
        propagate(top, start, times, precision, observer=drift)
        found, name = (drift.content(), drift.metrics()), f"drift {precision.name}"
    return name, sha256(repr(found).encode()).hexdigest()


@contextmanager
def meddling(meddle: bool) -> Any:
    """A thread of the user that sets flint.ctx all the time."""
    stop = threading.Event()

    def change() -> None:
        rng = random.Random(0)
        while not stop.wait(1e-3):
            ctx.prec, ctx.cap = rng.randint(2, 500), rng.randint(1, 20)

    thread = threading.Thread(target=change)
    if meddle:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        if meddle:
            thread.join()


def timed(run: Callable[[], list[tuple[str, str]]]) -> tuple[list[tuple[str, str]], float]:
    began = perf_counter()
    return run(), perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("calls", nargs="?", type=int, default=10_000)
    parser.add_argument("--threads", type=int, default=8)
    parser.add_argument("--meddle", action="store_true")
    given = parser.parse_args()
    ordered, alone = timed(lambda: [call(seed) for seed in range(given.calls)])
    sys.setswitchinterval(1e-6)
    with ThreadPoolExecutor(given.threads) as pool, meddling(given.meddle):
        found, together = timed(lambda: list(pool.map(call, range(given.calls))))
    differing = [one[0] for one, other in zip(found, ordered, strict=True) if one != other]
    for name, count in sorted(Counter(name for name, _ in ordered).items()):
        print(f"{name:24} {count:6} calls {differing.count(name):6} differ")
    print(f"{given.calls} calls: in order {alone:.1f} s, {given.threads} threads {together:.1f} s")
    print(f"{len(differing)} differ")
    sys.exit(1 if differing else 0)


if __name__ == "__main__":
    main()
