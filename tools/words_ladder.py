"""What a unit of time costs against the bits that are carried: words and heyoka, taking turns, log-log, as a picture.

Run: python tools/words_ladder.py [--bits 53,64,...] [--rounds 5] [--processor x86-64-v3] [--out docs/words-cost.svg]

--processor: what the machine code of words is made for: x86-64-v3 masks AVX-512.

Prints the table too.  53, 64, 106 and 113 bits are double, extended, double-double, which heyoka has not, and quad.
"""

from __future__ import annotations

import argparse
import sys
from fractions import Fraction
from pathlib import Path
from statistics import median

import matplotlib as mpl
from matplotlib.figure import Figure

from heavytop.integrate.trajectory import Problem
from heavytop.multiword.codegen.machine_code import Processor
from heavytop.precision import FORMATS, Precision, real

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from bench_words import MOTIONS, by_heyoka, by_words

BITS = (53, 64, 106, 113, 138, 184, 276, 396, 528, 792, 1000)
_TURN = 0.1
"""Seconds of a turn, about."""
_BLUE, _ORANGE = "#0072B2", "#E69F00"


def format_of(bits: int) -> Precision:
    """The format with so many bits."""
    return next((precision for precision in FORMATS if precision.bits == bits), None) or real(bits)


def span_of(problem: Problem, run) -> Fraction:
    """Units of time that take about a tenth of a second."""
    short = Fraction(1, 4)
    run(problem, None, short)
    return max(short, Fraction(min(4000, int(4 * _TURN / run(problem, None, short))), 4))


def measured(bits: int, rounds: int) -> tuple[float, float | None]:
    """Microseconds a unit of time of the Kovalevskaya top, by words and by heyoka: medians of turns."""
    precision = format_of(bits)
    problem = Problem.of(*MOTIONS["kovalevskaya"], precision)
    runs = [by_words] if precision.family == "double-double" else [by_words, by_heyoka]
    spans = [span_of(problem, run) for run in runs]
    turns = [[run(problem, None, span) * 1e6 for run, span in zip(runs, spans, strict=True)] for _ in range(rounds)]
    ours, *theirs = (median(column) for column in zip(*turns, strict=True))
    return ours, theirs[0] if theirs else None


def draw(rows: list[tuple[int, float, float | None]], out: Path) -> None:
    """The picture, as SVG without a date."""
    figure = Figure(figsize=(7, 4.5))
    axes = figure.subplots()
    for place, name, colour, marker in ((2, "heyoka", _ORANGE, "s"), (1, "multiword", _BLUE, "o")):
        points = [(row[0], row[place]) for row in rows if row[place] is not None]
        axes.loglog(*zip(*points, strict=True), marker=marker, color=colour, label=name)
    axes.set_xlabel("bits of the format")
    axes.set_ylabel("processor time of a unit of time [µs]")
    ticks = [row[0] for row in rows if row[0] not in (64, 106)]
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    axes.grid(visible=True, alpha=0.3)
    axes.legend()
    with mpl.rc_context({"svg.hashsalt": "words"}):
        figure.savefig(out, metadata={"Date": None}, bbox_inches="tight")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bits", default=",".join(map(str, BITS)))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("docs/words-cost.svg"))
    parser.add_argument("--processor", type=Processor)
    given = parser.parse_args()
    if given.processor is not None:
        Processor.here = classmethod(lambda cls: given.processor)
    rows = []
    print("| bits | words, µs | heyoka, µs | times faster |\n|---|---|---|---|")
    for bits in map(int, given.bits.split(",")):
        ours, theirs = measured(bits, given.rounds)
        rows.append((bits, ours, theirs))
        there = "| |" if theirs is None else f"| {theirs:,.3g} | {theirs / ours:.3g} |"
        print(f"| {bits} | {ours:,.3g} {there}", flush=True)
    draw(rows, given.out)


if __name__ == "__main__":
    main()
