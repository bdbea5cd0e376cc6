"""The loss of digits through one rounding of the state to a format, at the time where that costs most.

The motion is computed on a grid of times with twice the bits of a format.  At some of these times the state is rounded
to the format, and the motion continued from there without rounding errors.  The times at which the worst of these
motions has lost its first digit and all digits are proven: enclosures of both motions lie so far apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from heavytop import arguments
from heavytop.arguments import Number
from heavytop.display import Tabular, TitledTable
from heavytop.errors import InputError, OutOfReach, refusal
from heavytop.exact.catalogue import find
from heavytop.exact.flint.balls import midpoint, radius, whole_evaluation, working_precision
from heavytop.exact.solution import ExactSolution
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import expected_steps, propagator
from heavytop.integrate.trajectory import Problem
from heavytop.measure.truth import seconds_a_step
from heavytop.precision import DOUBLE, Precision, exact, exact_text, physical, real, rounded, six_digits
from heavytop.top.bodies import Body
from heavytop.top.equations import GYROSTAT, System
from heavytop.top.heavy_top import HeavyTop, State

_TIMES, _EACH = 64, 4
"""The number of times; the state is rounded at every fourth."""
_SPARE_BITS = 32
_RUNS, _MOST_SECONDS = 9, 3600
"""As long as the whole way takes at most: the motion itself, and half of it for each of 16 roundings."""
_ALL = 0.5
"""The relative error from which on no digit is correct."""


@dataclass(frozen=True, slots=True)
class Loss:
    """A loss of digits.

    time: at which the digits are lost.  rounded_at: when the state was rounded.  digits: that are correct at the time.
    proven: whether enclosures of both motions show it; else they do not reach so far.
    """

    time: Fraction
    rounded_at: Fraction
    digits: float
    proven: bool

    def to_json(self) -> dict[str, Any]:
        """Times as exact text."""
        times = {"time": exact_text(self.time), "rounded_at": exact_text(self.rounded_at)}
        return times | {"digits": round(self.digits, 2), "proven": self.proven}


@dataclass(frozen=True, slots=True, repr=False)
class DigitsEnd(Tabular):
    """The digits that a single rounding of the state leaves.

    precision: to which it is rounded.  of_digits: decimal digits of that.  digits: left until each of the times.
    first, last: the loss of the first digit and of all digits; None where it is not before the last time.
    """

    precision: str
    of_digits: float
    times: tuple[Fraction, ...]
    digits: tuple[float, ...]
    first: Loss | None
    last: Loss | None

    def to_json(self) -> dict[str, Any]:
        """The entry ``digits_end`` of a document."""
        ends = {
            name: crossing and crossing.to_json() for name, crossing in (("first", self.first), ("last", self.last))
        }
        return {"precision": self.precision, "of_digits": round(self.of_digits, 2)} | ends

    def sentences(self) -> list[str]:
        """Sentences on the loss of the first digit and of all digits."""
        lines = []
        for what, loss in (("the first digit", self.first), ("all digits", self.last)):
            if loss is None:
                end = six_digits(self.times[-1])
                lines.append(f"{what}: not lost at any of {_TIMES} times up to t = {end}")
                continue
            how = "proven" if loss.proven else "computed, beyond the reach of a proof"
            lines.append(
                f"{what}: lost at t = {six_digits(loss.time)} after one rounding of the state to {self.precision} "
                f"at t = {six_digits(loss.rounded_at)}, in exact arithmetic otherwise ({how})"
            )
        return lines

    def _table(self) -> TitledTable:
        rows = [
            (six_digits(time), f"{digits:z.1f}")
            for time, digits in [*zip(self.times, self.digits, strict=True)][_EACH - 1 :: _EACH]
        ]
        title = f"Digits that remain after one rounding to {self.precision}, of {self.of_digits:.1f}"
        return TitledTable(title, ("t", "digits"), rows, self.sentences())


def digits_end(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    precision: Precision | str = DOUBLE,
    *,
    system: System | str | None = None,
) -> DigitsEnd:
    """The times at which one rounding of the state costs the first digit of a format, and all digits.

    Arguments:
        top, start, precision, system: as in :func:`heavytop.propagate`.
        until: an exact time, not 0; digits are counted at 64 times up to it.

    Returns:
        A ``DigitsEnd``: ``first`` and ``last`` with ``time``, ``rounded_at`` and ``proven``; ``digits`` (64,).

    Raises:
        InputError: for an invalid motion or time, and for the gyrostat of the paper.
        OutOfReach: for more than an hour.
    """
    form = arguments.precision(precision)
    body, state = arguments.motion(top, start, form)
    about, end = arguments.system(system, body), physical(until, "until")
    if not end:
        raise refusal("until", "a time other than 0", 0, "Give a time of either sign.")
    if about is GYROSTAT:
        raise InputError("digits_end does not support the system gyrostat.", "Use heavy_gyrostat, with a rotor.")
    setup = Setup.of(body, state, form, about)
    problem = Problem.of(setup.top, setup.start, form, about)
    seconds = _RUNS * expected_steps(problem, end) * seconds_a_step(2 * form.bits + _SPARE_BITS)
    if seconds > _MOST_SECONDS:
        earlier = float(end) * _MOST_SECONDS / seconds
        raise OutOfReach(
            f"The digits up to t = {six_digits(end)} take about {seconds:.1g} s.",
            f"At most {_MOST_SECONDS} s are supported: give an end up to about {earlier:.2g}.",
        )
    times = tuple(end * k / _TIMES for k in range(_TIMES + 1))
    errors = _errors(problem, times)
    worst = [
        max(((row[k], i) for i, row in errors.items() if k in row), default=(0.0, 0)) for k in range(1, _TIMES + 1)
    ]
    of_digits = form.bits * math.log10(2)
    reached = [max(error for error, _ in worst[: k + 1]) for k in range(_TIMES)]
    ends = _losses(problem, times, worst, (10 ** (1 - of_digits), _ALL))
    left = tuple(_digits(error, of_digits) for error in reached)
    return DigitsEnd(form.name, of_digits, times[1:], left, *ends)


def _digits(error: float, most: float = math.inf) -> float:
    return max(0.0, min(most, -math.log10(error))) if error else most


def _errors(problem: Problem, times: Sequence[Fraction]) -> dict[int, dict[int, float]]:
    """The largest relative error of a component, by the index of the rounding and the index of the time.

    No motion is computed beyond the time at which one rounding has lost all digits.  A rounding is an error of 2^-p,
    so that the rounded motion needs half the spare bits of the true one.
    """
    run, bits = propagator("multiword", {}), problem.precision.bits

    def states(start: State, instants: Sequence[Fraction], bits: int) -> list[list[Fraction]]:
        states = run(problem.top, start, instants, real(bits), system=problem.system)
        return [[exact(value) for value in state[:6]] for state in states.states]

    known = [list(problem.start.flat), *states(problem.start, times[1:], 2 * bits + _SPARE_BITS)]
    errors, end = {}, len(known)
    for i in range(0, len(known) - 1, _EACH):
        if i + 1 >= end:
            break
        start = _rounded(known[i], problem.precision)
        after = states(start, [time - times[i] for time in times[i + 1 : end]], bits + _SPARE_BITS // 2)
        errors[i] = {
            i + 1 + k: max(float(_relative(a, b)) for a, b in zip(state, known[i + 1 + k], strict=True))
            for k, state in enumerate(after)
        }
        end = min([end, *(k + 1 for k, error in errors[i].items() if error >= _ALL)])
    return errors


def _relative(value: Fraction, true: Fraction) -> Fraction:
    return abs(value - true) / max(Fraction(1), abs(true))


def _rounded(state: Sequence[Fraction], form: Precision) -> State:
    values = [rounded(value, form) for value in state]
    return State(values[:3], values[3:])


def _losses(
    problem: Problem, times: Sequence[Fraction], worst: Sequence[tuple[float, int]], levels: Sequence[float]
) -> list[Loss | None]:
    """The first time at which each level of error is reached, proven as far as enclosures reach; None for never."""
    known, bits = find(problem.top, problem.start, problem.system), problem.precision.bits + _SPARE_BITS

    @cache
    @whole_evaluation
    def rounded_at(at: Fraction) -> ExactSolution:
        if not at:
            return find(problem.top, _rounded(problem.start.flat, problem.precision), problem.system)
        state = known.state(at, bits)
        if any(ball.rel_accuracy_bits() <= problem.precision.bits for ball in state):  # a small component
            state = known.state(at, bits + problem.precision.bits)
        return find(problem.top, _rounded([midpoint(ball) for ball in state], problem.precision), problem.system)

    losses: list[Loss | None] = []
    for least in levels:
        index = next((k for k, (error, _) in enumerate(worst) if error >= least), None)
        if index is None:
            losses.append(None)
            continue
        error, time, at = worst[index][0], times[index + 1], times[worst[index][1]]
        proven = least * (1 - 2**-20)
        try:
            apart = _apart(known, rounded_at(at), time, time - at, _SPARE_BITS - math.floor(math.log2(least)))
        except OutOfReach:
            apart = 0.0
        losses.append(Loss(time, at, _digits(max(apart, error)), apart >= proven))
    return losses


@whole_evaluation
def _apart(known: ExactSolution, other: ExactSolution, time: Fraction, after: Fraction, bits: int) -> float:
    """A lower bound, less 2^-bits, of the relative error of ``other`` at ``after`` against ``known`` at ``time``."""
    with working_precision(bits):
        pairs = zip(known.state(time, bits), other.state(after, bits), strict=True)
        gaps = [_relative(midpoint(b), midpoint(a)) - radius(a) - radius(b) for a, b in pairs]
    return float(max(Fraction(0), *gaps))
