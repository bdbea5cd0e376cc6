"""A reference where no proof is at hand: two runs in words of different length, trusted as far as they agree.

Labelled computed, not proven: the radius is the difference of the two runs, which no theorem bounds.  The state is that
of the longer words, so the radius is the error of the shorter ones, and the state's own is smaller by as many bits as
the words differ by, on a chaotic motion too: what one loses the other loses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, midpoint, radius, radius_text, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.integrate.words import follow
from heavytop.integrate.words_engines import accuracy, choose
from heavytop.integrate.words_ensemble import propagate_words_ensemble
from heavytop.precision import Precision, decimal_text, exact, number, real, time_text
from heavytop.records import Against
from heavytop.top.times import check_times

MORE_BITS = 30
"""The words of the second run have at least so many more bits than those of the first."""
EFFORT = 60.0
"""Seconds of the model of the cost that each run may take; absurd starts and times would take for ever."""
EFFORT_OF_MANY = 600.0
"""The same for all the runs of an ensemble together."""
_PILOT_STEPS = 1000
"""A run that takes more is forecast from so many: what would take longer than its effort is refused at once."""
_SEARCH = 8
_WORD_BITS = 1032
_DIGIT = 10
"""An error leaves a digit where it is below the size of the state over this."""
_STAGES = 6
_PROBES = 12
"""A truth that may end is computed to the horizon over 4^6 first, and then to four times as far, until it has ended;
where that is before the first sample, to the horizon over 4^12, so that nothing runs to where no digit is left."""

Given = Callable[[Precision], Problem]
"""A motion to be computed, in any format."""


def seconds_a_step(bits: int) -> float:
    """A model of the cost of a step in so many bits, not a measurement: no result depends on a clock."""
    return 3e-6 + 4e-12 * bits**3 if bits <= _WORD_BITS else 6e-8 * bits**2


@dataclass(frozen=True, slots=True)
class ComputedReference:
    """States, with an attitude vector where the motion has one, at the times of two runs.

    words: the bits of the words of both.  ends: the first time at which the format that is measured has no digit left;
    None where it keeps one to the last.
    """

    words: tuple[int, int]
    balls: dict[Fraction, list[arb]]
    ends: Fraction | None = None

    @property
    def against(self) -> Against:
        """What it is, how far the runs agree as long as the format has digits, and how long that is."""
        return agreement([self])

    def state(self, time: Fraction, bits: int = 0) -> list[arb]:
        """Six balls, or nine with the attitude vector, at one of the times; ``bits`` are what they are."""
        return self.balls[time]

    def radius(self, time: Fraction) -> Fraction:
        """The largest radius at one of the times, relative to a value above 1."""
        return max(radius(value) / max(Fraction(1), abs(midpoint(value))) for value in self.balls[time])

    def blur(self, time: Fraction) -> float:
        """How far the state at one of the times may be off, absolute."""
        return float(sum(map(radius, self.balls[time])))

    def beyond(self, part: Fraction) -> set[Fraction]:
        """The times at which Ω or γ is uncertain by more than this part of the largest that it becomes."""
        found: set[Fraction] = set()
        for group in (slice(0, 3), slice(3, 6)):
            largest = max(abs(midpoint(value)) for state in self.balls.values() for value in state[group])
            found |= {t for t, state in self.balls.items() if radius(state[group][0]) > part * largest}
        return found


def agreement(found: Sequence[ComputedReference]) -> Against:
    """What the references of one ensemble are, all over the same times."""
    (coarse, fine), ends = found[0].words, found[0].ends
    radii = [each.radius(t) for each in found for t in each.balls if ends is None or abs(t) < abs(ends)]
    agreed = radius_text(max(radii)) if radii else ""
    until = "" if ends is None else time_text(ends)
    return Against("computed", f"words of {coarse} and {fine} bits", agreed, until=until)


def of_rounded(
    problems: Sequence[Problem], times: Sequence[Fraction], least: int = 0, effort: float | None = None
) -> list[ComputedReference]:
    """The motions of problems of one format, from the very numbers that they are, in 30 bits more and 60 more.

    least: bits of the first run at least.  effort: as in :func:`compute`.
    All end where one has no digit left in the format, as laws of growth do.
    Raises OutOfReach as :func:`compute` does, and InputError for more bits than there are.
    """
    bits = problems[0].precision.bits
    given = [partial(_in_format, problem) for problem in problems]
    return compute(given, times, max(least, bits + MORE_BITS), bits, effort)


def _in_format(problem: Problem, precision: Precision) -> Problem:
    return replace(problem, precision=precision)


def compute(
    given: Sequence[Given],
    times: Sequence[Fraction],
    bits: int,
    format_bits: int | None = None,
    effort: float | None = None,
) -> list[ComputedReference]:
    """The motions at ``times``, from runs in about ``bits`` bits and in at least :data:`MORE_BITS` more.

    times: as for :func:`heavytop.integrate.words.propagate_words`.
    format_bits: those of the format that is measured, in which the motions may lose all digits; None for no format.
    effort: seconds of the model of the cost that each run may take; None for 60, or the 600 of an ensemble shared out.
    Raises OutOfReach if a run does not reach the last time within the effort.
    """
    first = [_Served.of(each, bits) for each in given]
    finer = _finer(given, bits, first)
    second = [_Served.of(each, finer) for each in given]
    words = [(one.bits, two.bits) for one, two in zip(first, second, strict=True)]
    balls: list[dict[Fraction, list[arb]]] = [{} for _ in given]
    seconds = effort or (EFFORT if len(given) == 1 else EFFORT_OF_MANY / len(given))
    for early in _stages(times, _STAGES if format_bits is not None else 0):
        # no bit of a run depends on the samples taken: what a shorter stage had is not taken again
        more = [time for time in early if time not in balls[0]]
        for index, pair in enumerate(zip(_states(first, more, seconds), _states(second, more, seconds), strict=True)):
            known = balls[index] | dict(zip(more, _around(*pair, bits), strict=True))
            balls[index] = {time: known[time] for time in early}
        found = [ComputedReference(*each) for each in zip(words, balls, strict=True)]
        ends = None if format_bits is None else _last_digit(found, [each.accuracy - format_bits for each in first])
        if ends is not None and ends not in times:
            # lost on the way to the first sample
            return [ComputedReference(each, {}, times[0]) for each in words]
        if ends is not None:
            break
    return [replace(each, ends=ends) for each in found]


@dataclass(frozen=True, slots=True)
class _Served:
    """A motion in a format, and the words that serve it.

    bits: of the words.  accuracy: as in :func:`heavytop.integrate.words_engines.accuracy`.
    """

    problem: Problem
    bits: int
    accuracy: int

    @classmethod
    def of(cls, given: Given, bits: int) -> _Served:
        problem = given(real(bits))
        arithmetic, scaled = choose(problem, None)
        return cls(problem, int(arithmetic.flags["bits"]), accuracy(arithmetic, scaled))


def _finer(given: Sequence[Given], bits: int, first: Sequence[_Served]) -> int:
    """The bits of a second format, whose words have 30 bits more at least.

    Two formats may be served by the same words, and then differ by nothing.
    """
    finer = bits + MORE_BITS
    for each, one in zip(given, first, strict=True):
        while _Served.of(each, finer).bits < one.bits + MORE_BITS:
            finer += _SEARCH
    return finer


def _stages(times: Sequence[Fraction], stages: int) -> list[Sequence[Fraction]]:
    """Those of the times within the horizon over 4^n, each longer than the one before; where there is none, its end."""
    ends = {n: times[-1] / 4**n for n in range(_PROBES if stages else 0, -1, -1)}
    counts = {n: sum(abs(time) <= abs(end) for time in times) for n, end in ends.items()}
    before = [[ends[n]] for n, count in counts.items() if not count]
    return [*before, *(times[:count] for count in dict.fromkeys(counts[n] for n in range(stages, -1, -1)) if count)]


def _last_digit(found: Sequence[ComputedReference], fewer: Sequence[int]) -> Fraction | None:
    """The first time at which some motion has no digit left in a format of so many bits ``fewer`` than the words have.

    Its error is that of the shorter words, times 2 to as many bits: both are amplified alike.
    """
    lost = [each.beyond(Fraction(1, _DIGIT) / 2 ** max(0, bits)) for each, bits in zip(found, fewer, strict=True)]
    return next((time for time in found[0].balls if any(time in each for each in lost)), None)


def _states(served: Sequence[_Served], times: Sequence[Fraction], effort: float) -> list[Sequence[Any]]:
    """The states of each motion at ``times``."""
    problems = [each.problem for each in served]
    words = max(each.bits for each in served)
    limit = int(effort / seconds_a_step(words))
    runs = _followed(problems, times, min(limit, _PILOT_STEPS))
    states: list[Sequence[Any]] = [run.states for run in runs]
    if limit > _PILOT_STEPS and any(run.outcome is Outcome.STEP_LIMIT for run in runs):
        reached = min(abs(run.time_reached) for run in runs if run.outcome is Outcome.STEP_LIMIT)
        if abs(times[-1]) * _PILOT_STEPS > limit * reached:
            raise OutOfReach(
                f"A reference run in words of {words} bits to t = {decimal_text(times[-1], 6)} takes too long: its "
                f"first {_PILOT_STEPS} steps end at t = {decimal_text(reached, 3)}.",
                "Ask for an earlier time.",
            )
        done = min(map(len, states))
        runs = _followed(problems, times[done:], limit)
        states = [[*before[:done], *run.states] for before, run in zip(states, runs, strict=True)]
    for run in runs:
        if run.outcome is not Outcome.SUCCESS:
            raise OutOfReach(
                f"A reference run in words of {words} bits {run.outcome.message}.", "Ask for an earlier time."
            )
    return states


def _followed(problems: Sequence[Problem], times: Sequence[Fraction], limit: int) -> list[Trajectory]:
    """In words; one by itself is not put into lanes."""
    targets = [number(time, problems[0].precision) for time in check_times(times)]
    if len(problems) == 1:
        return [follow(problems[0], targets, step_limit=limit)]
    return propagate_words_ensemble(problems, targets, step_limit=limit)


@whole_evaluation
def _around(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[list[arb]]:
    """The finer values; the radius of Ω, γ and ξ is the largest difference in it, and a rounding of the coarser."""
    with working_precision(bits + 128):
        return [_group_balls(one, two, bits) for one, two in zip(coarse, fine, strict=True)]


def _group_balls(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[arb]:
    one, two = ([exact(value) for value in state] for state in (coarse, fine))
    found: list[arb] = []
    for k in range(0, len(one), 3):
        group = two[k : k + 3]
        apart = max(abs(b - a) for a, b in zip(one[k : k + 3], group, strict=True))
        apart += max(map(abs, group)) * Fraction(2) ** -bits
        found += [ball(value) + arb(0, ball(apart).abs_upper()) for value in group]
    return found
