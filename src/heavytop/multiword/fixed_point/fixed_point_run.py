"""One motion in K words: the data of the machine code of :mod:`heavytop.multiword.fixed_point.steps`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy

from heavytop.multiword.codegen.machine_code import Doubles, Processor, doubles, once, pointer
from heavytop.multiword.codegen.recurrence import series_rates
from heavytop.multiword.fixed_point import steps
from heavytop.multiword.fixed_point.arithmetic import Grid, digits, exact, words_of
from heavytop.multiword.fixed_point.steps import most_of, most_orders, rows_of, sample_row, size_of
from heavytop.multiword.problem import ResumableRun, Scaled, Status

_FIRST_HALVINGS = 3
_FEWEST_HALVINGS = -4
LONGEST_STEP = 2**-_FEWEST_HALVINGS
"""In the units of the scaled problem."""
_MOST_HALVINGS = 40
_HALVED_SAMPLES = 4
_FINEST_TIME = _MOST_HALVINGS + 1
"""The most fractional bits of the time at the end of a step."""
_STEPS_AT_ONCE = 64
_LARGEST_TIME = Fraction(2) ** 1000
TINY_BITS = 20
"""A component more bits below 1 needs as many more; the spare bits of a format cover fewer."""
_SMALL = Fraction(1, 2**TINY_BITS)
_FIRST_ORDERS = 6


machine = once(steps.build)
"""The machine code, compiled at its first use."""


def excess(problem: Scaled) -> int:
    """The least e for which the coefficients over 2^e are at most 1; products with them lose e bits."""
    largest, excess = problem.coefficients.largest, 0
    while largest > 2**excess:
        excess += 1
    return excess


def constants(problem: Scaled, grid: Grid, over: int, factor: Fraction = Fraction(1)) -> Doubles:
    """The words of the coefficients times ``factor``, over 2^over."""
    coefficients = problem.coefficients
    flat = [row for vector in (coefficients.paired if grid.bounded else coefficients.vectors) for row in vector]
    return words_of_rows(flat, grid, factor / 2**over)


def words_of_rows(rows: Sequence[Sequence[Fraction]], grid: Grid, share: Fraction) -> Doubles:
    """The words of eight exact numbers a row, times ``share``."""
    result = doubles(8 * grid.words * len(rows))
    table = result.reshape(len(rows), grid.words, 8)
    words = {c: digits(c * share, grid) for c in {c for row in rows for c in row}}
    for index, row in enumerate(rows):
        for lane, c in enumerate(row):
            if c:
                table[index, :, lane] = words[c]
    return result


def inverses(grid: Grid) -> Doubles:
    """1/(n + 1) for every order that a step may take."""
    values = doubles(most_orders(grid) + 1)
    values[:] = 1 / numpy.arange(1, most_orders(grid) + 2)
    return values


def spread(problem: Scaled) -> int:
    """Bits by which the smallest component is below 1: of those that are not 0 at the start, and of those that tiny
    coefficients move away from 0, as an unstable axis would amplify these too.
    """
    small = max((_below(value) for value in problem.state if value), default=0)
    coefficients = (c for vector in problem.coefficients.vectors for row in vector for c in row if c)
    if all(problem.state[:6]) or max(small, *map(_below, coefficients)) <= TINY_BITS // 2:
        return small
    # the largest of the first Taylor coefficients of each component of Ω and γ that is 0 at the start and then not
    series, born = [problem.state], dict.fromkeys((k for k in range(6) if not problem.state[k]), Fraction(0))
    while len(series) <= _FIRST_ORDERS and any(value < _SMALL for value in born.values()):
        rates = series_rates(problem.system, problem.coefficients, series)
        series.append(tuple(rate / len(series) for rate in rates))
        born = {k: max(value, abs(series[-1][k])) for k, value in born.items()}
    grown = max((_below(value) for value in born.values() if value), default=0)
    return max(small, grown if grown > TINY_BITS else 0)


def _below(value: Fraction) -> int:
    """Bits by which ``value``, not 0, is below 1; 0 where it is larger."""
    return max(0, value.denominator.bit_length() - abs(value.numerator).bit_length() + 1)


class Fixed(ResumableRun):
    """A motion that advances on a grid of K words; the problem is scaled so that |ω| <= 4."""

    def __init__(self, problem: Scaled, grid: Grid, forwards: bool, processor: Processor | None = None) -> None:
        self.vectors = 1 if len(problem.state) == 6 else 2
        self.machine = machine(grid, problem.system, self.vectors == 2, processor)
        self.problem, self.grid, self.forwards = problem, grid, forwards
        self.steps = 0
        size, scratch = 8 * grid.words * self.vectors, size_of(grid, self.vectors)
        self.excess = excess(problem)
        self.words, self.result = doubles(size), doubles(2 * size)
        for offset, value in zip(self._places, problem.state, strict=True):
            self.words[offset : offset + 8 * grid.words : 8] = digits(value, grid)
        self.inverses = inverses(grid)
        self.rows, self.sums, self.seen = doubles(scratch.rows), doubles(scratch.sums), doubles(8)
        self.starts = numpy.zeros(scratch.starts, numpy.int64)
        self.clock, self.counts = doubles(steps.CLOCK), numpy.zeros(steps.COUNTS, numpy.int64)
        self.clock[steps.SIGN] = 1.0 if forwards else -1.0
        self.counts[steps.EXCESS] = self.excess
        self.counts[[steps.HALVINGS, steps.FEWEST, steps.MOST]] = _FIRST_HALVINGS, _FEWEST_HALVINGS, _MOST_HALVINGS
        self.constants = constants(problem, grid, self.excess)
        arrays = [self.words, *self._scratch(self.constants, self.rows), self.result, self.clock, self.counts]
        self.arrays = [pointer(array) for array in arrays]

    @property
    def _places(self) -> list[int]:
        """Offsets of the first word of each component."""
        second = 8 * self.grid.words
        return [*range(6), *(second + lane for lane in range(3, 6))][: len(self.problem.state)]

    @property
    def order(self) -> int:
        return int(self.counts[steps.ORDERS])

    @property
    def redone(self) -> int:
        """Steps that were repeated with half their length."""
        return int(self.counts[steps.REDONE])

    @property
    def time(self) -> Fraction:
        return Fraction(float(self.clock[steps.TIME]))

    @property
    def state(self) -> tuple[Fraction, ...]:
        return self._exact(self.words)

    def _exact(self, words: Doubles) -> tuple[Fraction, ...]:
        return tuple(exact(words[offset : offset + 8 * self.grid.words : 8]) for offset in self._places)

    def advance(self, target: Fraction, steps_at_most: int) -> Status:
        return self._advance(_not_before(min(target, _LARGEST_TIME)), steps_at_most)

    def _advance(self, target: float, steps_at_most: int) -> Status:
        self.clock[steps.TARGET] = target
        taken = self.machine.functions["advance"](*self.arrays, steps_at_most)
        self.steps += taken
        return Status(int(self.counts[steps.STATUS]))

    def _scratch(self, constants: Doubles, rows: Doubles) -> list[Any]:
        return [constants, self.inverses, rows, self.sums, self.starts, self.seen]

    def sample(self, time: Fraction) -> tuple[Fraction, ...] | None:
        length = self.time - self._began
        if not length:  # no step stands
            return None
        at = doubles(self.grid.words)
        at[:] = digits((time - self._began) / length, self.grid)
        row = doubles(sample_row(self.grid, self.vectors))
        self._samples((pointer(self.rows), pointer(at), pointer(row)), 0, 1)
        return self.exact_state(row, time)

    @property
    def _began(self) -> Fraction:
        return Fraction(float(self.clock[steps.BEGAN]))

    def sampled(
        self, times: Sequence[Fraction] | Doubles
    ) -> tuple[Status, Doubles, dict[int, tuple[Fraction, ...] | None]]:
        """Steps up to the last of the times |τ| > 0, ascending, with the bits of :meth:`advance` and :meth:`sample`.

        times: exact numbers, or an array of doubles, which is faster.
        Returns the status, the states in K + 1 words, shape (samples, K + 1, 6 or 9), and by index the states that
        overflow these words, None where no other form holds them.
        """
        are_doubles = isinstance(times, numpy.ndarray)
        ceilings = times if isinstance(times, numpy.ndarray) else numpy.array([_not_before(time) for time in times])
        count, status, limit, words = len(times), Status.OK, most_of(self.grid), self.grid.words
        at, rows = doubles(words * count), doubles(sample_row(self.grid, self.vectors) * count)
        pointers = pointer(self.rows), pointer(at), pointer(rows)
        table, others = rows.reshape(count, -1), dict[int, tuple[Fraction, ...] | None]()
        progress = numpy.zeros(2, numpy.int64)
        while progress[0] < count and status is Status.OK:
            done, taken = map(int, progress)
            if are_doubles:
                status = self._follow(ceilings, at, progress, rows)
                if [*map(int, progress)] != [done, taken] or status is not Status.OK:
                    continue
            covered = int(ceilings.searchsorted(self.clock[steps.TIME], "right")) if self.steps else 0
            if covered <= done:
                status = self._advance(ceilings[done], _STEPS_AT_ONCE)
                continue
            at[words * done : words * covered] = self._inside([Fraction(time) for time in times[done:covered]])
            self._samples(pointers, done, covered)
            for row in range(done, covered):
                if not table[row, -8:].max() <= limit:
                    others[row] = self.exact_state(table[row], Fraction(times[row]))
            progress[0] = covered
        return status, self._components(table[: progress[0]]), others

    def _follow(self, times: Doubles, at: Doubles, progress: Any, samples: Doubles) -> Status:
        """Some steps and their samples, as long as doubles suffice."""
        before, arrays = int(progress[1]), [pointer(array) for array in (times, at, progress)]
        follow = self.machine.functions["follow"]
        follow(*self.arrays, *arrays, len(times), before + _STEPS_AT_ONCE, pointer(samples))
        self.steps += int(progress[1]) - before
        return Status(int(self.counts[steps.STATUS]))

    def _samples(self, pointers: tuple[Any, Any, Any], first: int, last: int) -> None:
        """Samples ``first`` to ``last`` − 1 of the last step; pointers: to its rows, the words of x, the result."""
        order, (rows, at, samples) = int(self.counts[steps.ORDERS]), pointers
        self.machine.functions["samples"](rows, order, at, first, last, samples)

    def _inside(self, times: Sequence[Fraction]) -> list[float]:
        """The words of (time − began)/h for times in the last step."""
        bits = max(_FINEST_TIME, *(time.denominator.bit_length() for time in times))
        began, step = (int(value * 2**bits) for value in (self._began, self.time - self._began))
        shift = self.grid.total - step.bit_length() + 1  # a step is a power of two
        away = [(time.numerator << bits - time.denominator.bit_length() + 1) - began for time in times]
        x = [value << shift if shift >= 0 else _nearest(value, -shift) for value in away]
        return [word for value in x for word in words_of(value, self.grid)]

    def _components(self, rows: Doubles) -> Doubles:
        """The words of (Ω, γ, ξ) from rows of samples; the last word is the rounding error of the one before it."""
        count = self.grid.words
        table = rows.reshape(len(rows), -1, 8)
        left = [table[:, count * v : count * (v + 1)] for v in range(self.vectors)]
        lanes = [[words[:, :, lane] for lane in range(6)] for words in left]
        components = numpy.zeros((len(rows), count + 1, len(self.problem.state)))
        for index, value in enumerate(state_of_left(lanes)):
            components[:, :count, index] = value
        for v, words in enumerate(left):
            high, half = words[:, -1, 4:2:-1], words[:, -1, 5:6] / 2
            total = high - half
            part = total - high
            components[:, -1, 3 + 3 * v : 6 + 3 * v : 2] = (high - (total - part)) - (half + part)
        return components

    def exact_state(self, words: Doubles, time: Fraction) -> tuple[Fraction, ...] | None:
        """The state from a row of samples, at ``time`` in the last step."""
        if not words[-8:].max() <= most_of(self.grid):
            moved = self._moved(self._before(), time - self._began, _HALVED_SAMPLES)
            return None if moved is None else self._exact(moved)
        size, parts = 8 * self.grid.words, range(self.vectors)
        lanes = [[exact(words[size * v + lane : size * (v + 1) : 8]) for lane in range(6)] for v in parts]
        return state_of_left(lanes)

    def _moved(self, words: Doubles, span: Fraction, halvings: int) -> Doubles | None:
        """The words after a time ``span``, by one series, or by two of half the length where a sum leaves its range."""
        moved, rows = doubles(len(words)), doubles(len(self.rows))
        arrays = [words, *self._scratch(constants(self.problem, self.grid, self.excess, span), rows)]
        factor, raises = steps.raises_of(self.excess)
        call = [*[pointer(array) for array in arrays], factor * float(self.clock[steps.SIGN]), raises, pointer(moved)]
        orders = self.machine.functions["series"](*call)
        if orders >= 0:
            return moved
        half = None if halvings == 0 else self._moved(words, span / 2, halvings - 1)
        return None if half is None else self._moved(half, span / 2, halvings - 1)

    def _before(self) -> Doubles:
        """The words of the state before the last step."""
        words = doubles(len(self.words))
        words[:] = self.result[len(self.words) :]
        return words

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        left = rows_of(self.grid).left
        return state_of_left([left(self.rows, self.grid, self.vectors, n, v) for v in range(self.vectors)])

    def resume_words(self) -> tuple[str, ...]:
        length = Fraction(float(self.clock[steps.TIME])) - Fraction(float(self.clock[steps.BEGAN]))
        halvings = length.denominator.bit_length() - length.numerator.bit_length()
        words = (self.clock[steps.BEGAN], *self._before())
        return (str(halvings), *(float(word).hex() for word in words))

    def restore(self, numbers: tuple[str, ...], steps_before: int) -> None:
        self.counts[steps.HALVINGS] = int(numbers[0])
        words = [float.fromhex(text) for text in numbers[1:]]
        self.clock[steps.TIME] = words[0]
        self.words[:] = words[1:]
        self.steps = steps_before


def state_of_left(lanes: Sequence[Any]) -> tuple[Any, ...]:
    """Components from L of each vector: Ω2, Ω3, Ω1, γ2 + γ3, γ1 + γ2, 2 γ2, or the last three with ξ for γ."""
    state: list[Any] = []
    for vector, left in enumerate(lanes):
        middle = left[5] / 2
        state += [*(left[2], left[0], left[1])[: 3 * (1 - vector)], left[4] - middle, middle, left[3] - middle]
    return tuple(state)


def _nearest(value: int, shift: int) -> int:
    """value/2^shift rounded to nearest, a tie to even."""
    quotient, remainder = value >> shift, value & (1 << shift) - 1
    return quotient + (2 * remainder > 1 << shift or (2 * remainder == 1 << shift and quotient & 1))


def _not_before(target: Fraction) -> float:
    """The least double that is not below ``target``."""
    near = float(target)
    return near if Fraction(near) >= target else float(numpy.nextafter(near, numpy.inf))
