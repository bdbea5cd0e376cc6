"""Motions computed in multi-word arithmetic, by the project's own Taylor integrator; called as heyoka's."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy

from heavytop.errors import InputError, OutOfReach
from heavytop.extras import import_heyoka
from heavytop.integrate.multiword.engines import choose, compiled
from heavytop.integrate.registry import expected_steps
from heavytop.integrate.trajectory import (
    Observer,
    Outcome,
    Problem,
    ResumePoint,
    SampledRun,
    Trajectory,
    sampled,
    trajectory_of,
)
from heavytop.multiword.codegen.machine_code import Doubles
from heavytop.multiword.double_double.double_double_run import BITS, PLACES, Floating
from heavytop.multiword.fixed_point.arithmetic import Grid
from heavytop.multiword.fixed_point.fixed_point_run import LONGEST_STEP, Fixed
from heavytop.multiword.problem import ResumableRun, Scaled, Status
from heavytop.precision import (
    DOUBLE,
    Array,
    OrderedRing,
    Precision,
    decimal_text,
    exact,
    number,
    numbers,
    require,
    six_digits,
)
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import DoubleTimes, HeavyTop, RoundedTimes, State, check_times

CHUNK_SECONDS = 0.25
_FIRST_CHUNK = 16
_LARGE_EXPONENT = 500
_MANY = 64
"""From so many times on, states are sampled in few calls."""
_LARGE = 2.0**_LARGE_EXPONENT
_EVERY_BIT = 1200
"""Bits in which sums of doubles below 2^100 are exact."""
_SLACK = 8
"""Words are at most so many bits wider than those of their grid, and their sums than they."""
_TOO_MANY, _FEW = 1000, 10**6
"""A run may take so many times the steps of the motion, and so many more: in quad 10**9 take twenty minutes."""
_LEAST_LOW = 2.0**-960
"""A larger low word has all its bits."""
OUTCOMES = {
    Status.OK: Outcome.SUCCESS,
    Status.NON_FINITE: Outcome.NON_FINITE,
    Status.TOO_SMALL: Outcome.STEP_TOO_SMALL,
    Status.CAPACITY: Outcome.CAPACITY,
}


def propagate_multiword(
    top: HeavyTop,
    start: State,
    times: Sequence[OrderedRing],
    precision: Precision,
    *,
    system: System = HEAVY_TOP,
    xi: tuple[Fraction, ...] | None = None,
    tolerance: Fraction | None = None,
    step_limit: int | None = None,
    observer: Observer | None = None,
    place: ResumePoint | None = None,
    mark: Callable[[ResumePoint], None] | None = None,
) -> Trajectory:
    """The motion from ``start`` at t = 0, at ``times``, computed in multi-word arithmetic and rounded to ``precision``
    once.

    tolerance: the local error aimed at, relative to the state; None for that of the format.
    The other arguments and what is raised: as in :func:`heavytop.integrate.heyoka.motions.propagate`.

    Raises InputError for a tolerance that is not positive and below 1.  A failed run is an outcome, not an exception.
    """
    problem = Problem.of(top, start, require(precision), system, xi)
    instants = check_times(times)
    # doubles are used as they are: converting them to reals takes as long as hundreds of steps
    wide = precision.bits >= DOUBLE.bits
    targets = instants.numbers if wide and isinstance(instants, DoubleTimes) else numbers(instants, precision)
    return integrate_to_samples(problem, targets, tolerance, step_limit, observer, place=place, mark=mark)


def integrate_to_samples(
    problem: Problem,
    targets: Sequence[Any],
    tolerance: Fraction | None = None,
    step_limit: int | None = None,
    observer: Observer | None = None,
    between: Callable[[], None] | None = None,
    *,
    place: ResumePoint | None = None,
    mark: Callable[[ResumePoint], None] | None = None,
) -> Trajectory:
    """The motion of ``problem`` at ``targets``, native numbers in order.

    between: called between chunks of a quarter of a second; it may raise to abort the run.
    """
    arithmetic, scaled = choose(problem, tolerance)
    compiling = compiled(arithmetic, problem.system, problem.xi is not None)
    flags = arithmetic.flags
    forwards = bool(targets[-1] >= 0)
    began = perf_counter()
    run = _ScaledRun(arithmetic.begin(scaled, forwards), scaled, problem.precision, step_limit, between)
    if step_limit is None and isinstance(run.run, Fixed):
        _require_reach(problem, scaled, exact(targets[-1]))
    times: Sequence[Fraction]
    states: Any
    if all(option is None for option in (step_limit, observer, between, place, mark)) and _are_many(
        run, targets, problem
    ):
        outcome, states = run.sampled(targets, problem.precision)
        times, seconds = RoundedTimes(targets[: len(states)]), perf_counter() - began
    else:
        times, states, outcome, seconds = sampled(run, targets, flags, began, observer, place, mark)
    ended = times, states, outcome, seconds
    return trajectory_of(problem, "multiword", run, run.run.order, compiling, flags, *ended)


def _require_reach(problem: Problem, scaled: Scaled, end: Fraction) -> None:
    """Raises OutOfReach for a run on a grid of far more steps than the motion needs.

    A grid bounds |Ω| by the energy over the least moment; a thin rod never turns so fast.
    """
    fewest = abs(end) * scaled.rate / LONGEST_STEP
    if not scaled.rest and fewest > _TOO_MANY * (expected_steps(problem, end) + _FEW):
        raise OutOfReach(
            f"A run of multiword in {problem.precision.name} to t = {six_digits(end)} takes at least "
            f"{decimal_text(fewest, 2)} steps: its step size allows for all the energy in a rotation about the axis of "
            "least inertia.",
            "Use double-double or heyoka, which adapt the step size, or limit the steps.",
        )


def _are_many(run: _ScaledRun, targets: Sequence[Any], problem: Problem) -> bool:
    """Whether there are many times, and arrays hold the states, far from the ends of their exponent range."""
    if len(targets) < _MANY or run.scaled.rest or not _holds(run.run, problem.precision):
        return False
    far = all(
        1 / _LARGE < abs(float(time) * float(run.scaled.rate)) < _LARGE
        for time in (targets[int(targets[0] == 0)], targets[-1])
    )
    return far and max(map(abs, run.scaled.exponents)) <= _LARGE_EXPONENT


def _holds(run: ResumableRun, precision: Precision) -> bool:
    """Whether arrays hold the states of this run: two words in a format that has no more, K of a grid in any other."""
    if isinstance(run, Floating):
        return DOUBLE.bits <= precision.bits <= BITS and precision.family != "quad"
    return isinstance(run, Fixed) and precision.family in ("quad", "real")


def native_state(state: tuple[Fraction, ...], precision: Precision) -> Any:
    """A state rounded to numbers of a format, an array of shape (6,) or (9,); None where one is too large for it.

    A number too small for the format becomes 0, as in its own arithmetic.
    """
    values = []
    for value in state:
        try:
            values.append(number(value, precision))
        except InputError:
            if abs(value) > 1:
                return None
            values.append(number(Fraction(0), precision))
    return numpy.array(values)


def sums_of_two(words: Iterable[tuple[float, float, int]], precision: Precision) -> list[Any] | None:
    """(high + low) 2^exponent of each, rounded once as by :func:`heavytop.precision.number`, without exact numbers.

    None where exact numbers are needed: near the ends of the exponents of doubles, in quad, and in fewer bits than
    double has.
    """
    if precision.bits < DOUBLE.bits or precision.family == "quad":
        return None
    widen, sums = _widening(precision), []
    for high, low, exponent in words:
        total = high + low
        if not (total == 0 or 1 / _LARGE < abs(total) < _LARGE) or abs(exponent) > _LARGE_EXPONENT:
            return None
        # a zero has no sign
        sums.append((widen(high + 0.0) + low) * math.ldexp(1.0, exponent))
    return sums


def _sums_of_columns(pair: Sequence[Doubles], sizes: Doubles, precision: Precision) -> tuple[Array, Any]:
    """:func:`sums_of_two` of columns times a size each; and the rows that need exact numbers."""
    highs, lows = pair
    total = highs + lows
    inexact = _outside(total, 1 / _LARGE, _LARGE)
    if precision.family == "double":
        total += 0.0  # a zero has no sign
        return total if (sizes == 1).all() else total * sizes, inexact
    lows = lows * sizes
    inexact |= _outside(lows, _LEAST_LOW, math.inf)
    if precision.family == "extended":
        sums = (highs * sizes + 0.0).astype("longdouble")
        sums += lows
        return sums, inexact
    return _added(_widening(precision)(0.0), [highs * sizes, lows]), inexact


def _outside(values: Doubles, smallest: float, largest: float) -> Any:
    """The rows in which some number is neither 0 nor of a size between the two."""
    sizes = abs(values)
    if sizes.min(initial=largest) > smallest and sizes.max(initial=0) < largest:
        return numpy.zeros(len(sizes), bool)
    return (((sizes <= smallest) & (sizes > 0)) | ~(sizes < largest)).any(axis=1)


def _added(start: Array, arrays: Sequence[Doubles]) -> Array:
    """start + the first + the second …, in the number type of ``start``, accumulated in one array."""
    total = start + arrays[0]
    for array in arrays[1:]:
        total += array
    return total


def _reals(words: list[Doubles], grid: Grid, sizes: Doubles, bits: int) -> Array:
    """The sums of words times the sizes, powers of two, rounded once.

    The words that fit into ``bits`` bits add up exactly; where the others do too, only the last sum is rounded.
    """
    heyoka = import_heyoka()
    zero, first = heyoka.real(0, bits), min(grid.words - 1, (bits - _SLACK) // grid.bits)
    # a larger double has all its 53 bits within those of the sum
    smallest = 2.0 ** max(-1000, DOUBLE.bits + _SLACK - grid.bits * first - bits)
    scale = numpy.array([heyoka.real(float(size)) for size in sizes])
    if first > 0 and all(((abs(word) >= smallest) | (word == 0)).all() for word in words[first:]):
        if scaled_first := smallest * sizes.min() > _LEAST_LOW:
            words = [word * sizes for word in words]
        sums = _added(zero, words[:first])
        for column in range(len(sizes)):
            lower = [word[:, column] for word in words[first:] if word[:, column].any()]
            if lower:
                sums[:, column] += lower[0] if len(lower) == 1 else _added(zero, lower)
        if scaled_first:
            return sums
    else:
        total = _added(heyoka.real(0, _EVERY_BIT), words)
        rounded = [heyoka.real(value, bits) for value in total.ravel()]
        sums = numpy.array(rounded, dtype=heyoka.real).reshape(total.shape)
    sums *= scale
    return sums


def _sums_of_words(words: Doubles, grid: Grid, sizes: Doubles, precision: Precision) -> tuple[Array, Any]:
    """The sums of words of a grid, shape (n, K + 1, components), times a size each, rounded once; and the rows that
    need exact numbers.
    """
    heyoka = import_heyoka()
    columns = [words[:, k] for k in range(words.shape[1])]
    if precision.family == "real":
        return _reals(columns, grid, sizes, precision.bits), numpy.zeros(len(words), bool)
    # two words fill a quad: the sum of the others is added to them at once
    first, second, third, *smaller = (word * sizes for word in columns)
    lower, inexact = third.astype(heyoka.real128), numpy.zeros(len(words), bool)
    for word in smaller:
        for column in numpy.flatnonzero(word.any(axis=0)):
            before, added = lower[:, column], word[:, column].astype(heyoka.real128)
            total = before + added
            inexact |= (total - before != added) | (total - added != before)
            lower[:, column] = total
    result = first.astype(heyoka.real128) + second
    result += lower
    return result, inexact


def _exact_sums(words: Iterable[Doubles]) -> tuple[Fraction, ...]:
    """The sum of the words of each component."""
    return tuple(
        sum(map(Fraction, words_of_number), Fraction(0))
        for words_of_number in zip(*(word.tolist() for word in words), strict=True)
    )


def _widening(precision: Precision) -> Callable[[float], Any]:
    """The conversion of a double to a format with as many bits or more."""
    if precision.family in ("double-double", "real"):
        heyoka = import_heyoka()

        return lambda value: heyoka.real(value, precision.bits)
    return numpy.longdouble if precision.family == "extended" else numpy.float64


@dataclass(slots=True)
class _ScaledRun(SampledRun):
    """A run advanced in chunks, in the units of the problem."""

    run: ResumableRun
    scaled: Scaled
    precision: Precision
    step_limit: int | None
    between: Callable[[], None] | None
    _chunk: int = _FIRST_CHUNK

    @property
    def steps(self) -> int:
        """The steps taken so far."""
        return self.run.steps

    @property
    def time(self) -> Fraction:
        """The exact time at the end of the last step."""
        return self.run.time / self.scaled.rate * (1 if self.run.forwards else -1)

    def covers(self, target: Fraction) -> bool:
        """Whether the last step covers ``target``; there are no steps at an equilibrium."""
        return self.scaled.rest or self.run.time >= abs(target) * self.scaled.rate

    def advance(self, target: Fraction, most: int | None) -> Outcome:
        """A chunk of steps of a quarter of a second, or fewer."""
        chunk = self._chunk if most is None else min(self._chunk, most)
        began, before = perf_counter(), self.run.steps
        status = self.run.advance(abs(target) * self.scaled.rate, chunk)
        if status is Status.OK:
            seconds_per_step = (perf_counter() - began) / max(1, self.run.steps - before)
            self._chunk = max(1, min(4 * self._chunk, int(CHUNK_SECONDS / seconds_per_step)))
        return OUTCOMES[status]

    def sampled(self, targets: Any, precision: Precision) -> tuple[Outcome, Array]:
        """The outcome and the states at the times reached, of many: those of :meth:`at`, in few calls."""
        if targets[0] == 0:
            outcome, states = self.sampled(targets[1:], precision)
            start = native_state(self.scaled.back(self.scaled.state), precision)
            return outcome, numpy.concatenate([[start], states])
        sampler = self._of_a_grid if isinstance(self.run, Fixed) else self._of_two_words
        status, states, exact_states = sampler(
            targets, numpy.array([float(size) for size in self.scaled.sizes]), precision
        )
        for row, state in sorted(exact_states.items()):
            rounded = None if state is None else native_state(self.scaled.back(state), precision)
            if rounded is None:
                return Outcome.CAPACITY if state is None else Outcome.NON_FINITE, states[:row]
            states[row] = rounded
        return OUTCOMES[status], states

    def _of_two_words(self, targets: Any, sizes: Doubles, precision: Precision) -> Any:
        """The status, the states at the times reached, and by its row each state that needs exact numbers."""
        assert isinstance(self.run, Floating)
        times, rate = numpy.asarray(targets), float(self.scaled.rate) * (1 if self.run.forwards else -1)
        highs = times.astype(float)
        lows = numpy.zeros(len(times)) if (times == highs).all() else (times - highs).astype(float)
        columns = [[index + word for index in PLACES[: len(sizes)]] for word in (0, 8)]
        parts, count, exact_states = list[Array](), 0, dict[int, tuple[Fraction, ...]]()
        for words in self.run.sampled(highs * rate, lows * rate):
            pair = [words.take(indices, 1) for indices in columns]
            states, inexact = _sums_of_columns(pair, sizes, precision)
            exact_states |= {
                count + int(row): _exact_sums(word[row] for word in pair) for row in numpy.flatnonzero(inexact)
            }
            parts.append(states)
            count += len(words)
        return self.run.status, numpy.concatenate(parts), exact_states

    def _of_a_grid(self, targets: Any, sizes: Doubles, precision: Precision) -> Any:
        """As :meth:`_of_two_words`, of a run on a grid."""
        assert isinstance(self.run, Fixed)
        instants, rate, grid = numpy.asarray(targets), self.scaled.rate, self.run.grid
        times: Doubles = instants.astype(float)
        if (instants == times).all():  # the rate is a power of two
            status, words, overflows = self.run.sampled(abs(times) * float(rate))
        else:
            status, words, overflows = self.run.sampled([abs(exact(target)) * rate for target in targets])

        states, inexact = _sums_of_words(words, grid, sizes, precision)
        return status, states, {int(row): _exact_sums(words[row]) for row in numpy.flatnonzero(inexact)} | overflows

    def at(self, target: Any, time: Fraction) -> tuple[Outcome, Any]:
        """The outcome of :meth:`reach`, and the state at ``time``, rounded; None where it has no number."""
        outcome, precision = self.reach(time), self.precision
        if outcome is not Outcome.SUCCESS:
            return outcome, None
        if isinstance(self.run, Floating) and not self.scaled.rest and time != 0:
            words = self.run.words_at(abs(time) * self.scaled.rate).tolist()
            pairs = (
                (words[at], words[at + 8], power) for at, power in zip(PLACES, self.scaled.exponents, strict=False)
            )
            state = sums_of_two(pairs, precision)
            if state is not None:
                return Outcome.SUCCESS, numpy.array(state)
        sample = self.sample(time)
        if sample is None:
            return Outcome.CAPACITY, None
        rounded = native_state(sample, precision)
        return Outcome.NON_FINITE if rounded is None else Outcome.SUCCESS, rounded

    def sample(self, target: Fraction) -> tuple[Fraction, ...] | None:
        """The state at ``target``, inside the last step; None where the numbers outgrow their words there."""
        at_start = self.scaled.rest or target == 0
        state = self.scaled.state if at_start else self.run.sample(abs(target) * self.scaled.rate)
        return None if state is None else self.scaled.back(state)

    def place(self, samples: int, seconds: float, flags: dict[str, str]) -> ResumePoint:
        """The resume point at the beginning of the last step; of an equilibrium, the start."""
        words, steps = ((), 0) if self.scaled.rest else (self.run.resume_words(), self.run.steps - 1)
        return ResumePoint(samples, (), (), steps, seconds, flags, words)

    def take_up(self, resume_point: ResumePoint, covered: Any) -> None:
        """Resume there: repeat the step that covers the last sample."""
        if resume_point.words:
            self.run.restore(resume_point.words, resume_point.steps)
            self.reach(exact(covered))
            resume_point.require_covered(self.run.steps)
            if self.run.resume_words() != resume_point.words:
                raise ValueError("words that are no state of this arithmetic")
