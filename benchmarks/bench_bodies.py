"""What attitude, quaternion and position add to a reference, and what 20,000 samples of a run add to one.

    python benchmarks/bench_bodies.py [REPEATS]

Each figure is the least of REPEATS (5) measurements, in seconds of processor time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
from time import process_time

import numpy

import heavytop as ht
from heavytop.measure.reference import Reference

START = ht.State(("1/2", "1/3", 1), ("3/5", 0, "4/5"))
GENERIC = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
MOTIONS = {
    "Lagrange": (ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), START, 1000),
    "Euler": (ht.HeavyTop((3, 2, 1), 0, (0, 0, 0)), START, 1000),
    "Kovalevskaya": (ht.HeavyTop((2, 2, 1), 1, (1, 0, 0)), START, 1000),
    "enclosure": (*GENERIC, 100),
}
SAMPLES, END, DIGITS = 50, 1000, 50
FORMATS = ("double", "extended", "double-double", "quad", "real:70", "real:200")


def least(repeats: int, call: Callable[[], object]) -> float:
    """Seconds of the fastest of so many calls."""
    found = []
    for _ in range(repeats):
        began = process_time()
        call()
        found.append(process_time() - began)
    return min(found)


def references(repeats: int) -> None:
    """Seconds of a reference at 50 times to 50 digits: states, with ξ, quaternion and position as arrays, as text."""
    print(f"reference, {SAMPLES} times, {DIGITS} digits: seconds, and what they add to a reference with its attitude")
    print(f"{'':14}{'states':>9}{'attitude':>10}{'arrays':>9}{'':8}{'texts':>9}")
    for name, (top, start, end) in MOTIONS.items():
        times = [Fraction(end * k, SAMPLES) for k in range(1, SAMPLES + 1)]

        def asked(attitude: bool, top: ht.HeavyTop = top, start: ht.State = start, times: list = times) -> Reference:
            return ht.reference(top, start, times, DIGITS, attitude=attitude)

        def arrays(asked: Callable[[bool], Reference] = asked) -> None:
            found = asked(True)
            found.quaternions()
            found.positions()

        def texts(asked: Callable[[bool], Reference] = asked) -> None:
            found = asked(True)
            found.balls("quaternion")
            found.balls("position")

        states = least(repeats, lambda asked=asked: asked(False))
        attitude = least(repeats, lambda asked=asked: asked(True))
        both = [least(repeats, call) for call in (arrays, texts)]
        more = "".join(f"{seconds:9.3f}{100 * (seconds / attitude - 1):+6.0f} %" for seconds in both)
        print(f"{name:14}{states:9.3f}{attitude:10.3f}{more}")


def samples(repeats: int) -> None:
    """Seconds of a run to T = 1000: one sample, 20,000, those whose states are made numbers of the format too, and
    20,000 with their quaternions in double.
    """
    many = numpy.linspace(0, END, 20001)[1:]
    print(f"run to T = {END}: seconds")
    head = f"{'1 sample':>12}{'20,000':>12}{'ratio':>8}{'states':>12}{'ratio':>8}"
    print(f"{'':24}{head}{'attitude, 1':>14}{'quaternions':>14}{'ratio':>8}")
    for integrator, format in ((name, each) for each in FORMATS for name in ("heyoka", "multiword")):
        if (integrator, format) == ("heyoka", "double-double"):
            continue

        def run(times: object, attitude: bool = False, by: str = integrator, format: str = format) -> ht.Trajectory:
            return ht.propagate(*GENERIC, times, format, integrator=by, attitude=attitude)

        run([1])
        # in turns: a machine that does something else slows both
        calls = (lambda: run([END])), (lambda: run(many)), (lambda: run(many).states)
        turns = [[least(1, call) for call in calls] for _ in range(repeats)]
        one, all_of_them, made = map(min, zip(*turns, strict=True))
        line = f"{format:14}{integrator:10}{one:12.4f}{all_of_them:12.4f}{all_of_them / one:8.2f}"
        line += f"{made:12.4f}{made / one:8.2f}"
        if format == "double":
            run([1], True)
            riding = least(repeats, lambda: run([END], True))
            quaternions = least(repeats, lambda: run(many, True).quaternions())
            line += f"{riding:14.4f}{quaternions:14.4f}{quaternions / riding:8.2f}"
        print(line, flush=True)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    samples(count)
    references(count)
