"""A reference where no proof is at hand: two runs in words of different length, trusted as far as they agree.

Labelled computed, not proven: the radius is the difference of the two runs, which no theorem bounds.  The state is that
of the longer words, so the radius is the error of the shorter ones, and the state's own is smaller by as many bits as
the words differ by, on a chaotic motion too: what one loses the other loses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import ceil
from typing import Any

from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, midpoint, radius, radius_text, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.integrate.words import follow
from heavytop.integrate.words_engines import Arithmetic, DoubleDouble, choose
from heavytop.precision import Precision, exact, number, real
from heavytop.records import Against
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.times import check_times

MORE_BITS = 30
"""The words of the second run have at least so many more bits than those of the first."""
EFFORT = 60.0
"""Seconds of the model of the cost that each run may take; absurd starts and times would take for ever."""
_MOST_STEPS = 10**8
_SEARCH = 8
_WORD_BITS = 1032


def seconds_a_step(bits: int) -> float:
    """A model of the cost of a step in so many bits, not a measurement: no result depends on a clock."""
    return 3e-6 + 4e-12 * bits**3 if bits <= _WORD_BITS else 6e-8 * bits**2


class ComputedReference:
    """States, and on request attitude vectors, at given times, from runs in about ``bits`` bits and in 30 more.

    times: as for :func:`heavytop.integrate.words.propagate_words`.
    words: the bits of the words of both runs.  accuracy: the bits to which a step of the first is right.
    Raises OutOfReach if either run does not reach the last time within :data:`EFFORT`.
    """

    def __init__(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        bits: int = 256,
        system: System = HEAVY_TOP,
        xi: tuple[Fraction, ...] | None = None,
    ) -> None:
        self._compute(lambda precision: Problem.of(top, start, precision, system, xi), times, bits)

    @classmethod
    def of(cls, problem: Problem, times: Sequence[Fraction], bits: int) -> ComputedReference:
        """The motion of a rounded problem, from the very numbers that it is; ``bits``: at least those of its format."""
        found = cls.__new__(cls)
        found._compute(lambda precision: replace(problem, precision=precision), times, bits)
        return found

    def _compute(self, problem: Callable[[Precision], Problem], times: Sequence[Fraction], bits: int) -> None:
        first = _arithmetic(problem, bits)
        finer, second = _second(problem, bits, first)
        self.bits, self.accuracy, self.words = bits, _accuracy(first), (_bits(first), _bits(second))
        coarse, fine = (_run(problem(real(b)), times, w) for b, w in zip((bits, finer), self.words, strict=True))
        states = zip(times, coarse.states, fine.states, strict=True)
        self.balls: dict[Fraction, list[arb]] = {time: _around(a, b, bits) for time, a, b in states}
        self.against = self.against_at(times)

    def against_at(self, times: Sequence[Fraction]) -> Against:
        """What it is, and how far the runs agree at these times."""
        agreed = radius_text(max(map(self.radius, times))) if times else ""
        return Against("computed", f"words of {self.words[0]} and {self.words[1]} bits", agreed)

    def state(self, time: Fraction, bits: int = 0) -> list[arb]:
        """Six balls, or nine with the attitude vector, at one of the times; ``bits`` are what they are."""
        return self.balls[time]

    def radius(self, time: Fraction) -> Fraction:
        """The largest radius at one of the times, relative to a value above 1."""
        return _radius(self.balls[time])


def _second(problem: Callable[[Precision], Problem], bits: int, first: Arithmetic) -> tuple[int, Arithmetic]:
    """The bits of a second format, and its words: they have 30 bits more at least.

    Two formats may be served by the same words, and then differ by nothing.
    """
    finer = bits + MORE_BITS
    while _bits(found := _arithmetic(problem, finer)) < _bits(first) + MORE_BITS:
        finer += _SEARCH
    return finer, found


def _arithmetic(problem: Callable[[Precision], Problem], bits: int) -> Arithmetic:
    return choose(problem(real(bits)), None)[0]


def _bits(arithmetic: Arithmetic) -> int:
    return int(arithmetic.flags["bits"])


def _accuracy(arithmetic: Arithmetic) -> int:
    """What the local error of double-double aims at; else all bits but a few."""
    if isinstance(arithmetic, DoubleDouble):
        return ceil(1 / arithmetic.tolerance).bit_length() - 1
    return _bits(arithmetic) - _SEARCH


def _run(problem: Problem, times: Sequence[Fraction], words: int) -> Trajectory:
    targets = [number(time, problem.precision) for time in check_times(times)]
    run = follow(problem, targets, step_limit=min(_MOST_STEPS, int(EFFORT / seconds_a_step(words))))
    if run.outcome is not Outcome.SUCCESS:
        raise OutOfReach(
            f"A reference run in words of {words} bits {run.outcome.message}.",
            "Ask for an earlier time.",
        )
    return run


@whole_evaluation
def _around(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[arb]:
    """The finer values; the radius of Ω, γ and ξ is the largest difference in it, and a rounding of the coarser."""
    one, two = ([exact(value) for value in run] for run in (coarse, fine))
    found: list[arb] = []
    with working_precision(bits + 128):
        for k in range(0, len(one), 3):
            group = two[k : k + 3]
            apart = max(abs(b - a) for a, b in zip(one[k : k + 3], group, strict=True))
            apart += max(Fraction(1), *map(abs, group)) * Fraction(2) ** -bits
            found += [ball(value) + arb(0, ball(apart).abs_upper()) for value in group]
    return found


def _radius(values: Sequence[arb]) -> Fraction:
    return max(radius(value) / max(Fraction(1), abs(midpoint(value))) for value in values)
