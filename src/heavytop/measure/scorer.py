"""The scorer: states in; drift, distance from the known motion and what it was compared with, out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial, reduce
from typing import TYPE_CHECKING, Any

import numpy
from flint import arb
from numpy.typing import NDArray

from heavytop.exact.flint.balls import (
    ball,
    ball_from,
    ball_text,
    midpoint,
    radius,
    rational,
    whole_evaluation,
    working_precision,
)
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scalar import (
    GUARD_BITS,
    decided,
    larger,
    largest,
    metric,
    relative_error,
    resolved,
    root,
    text,
    to_balls,
)
from heavytop.multiword.pairs import Pairs
from heavytop.precision import EXTENDED, dot, log10
from heavytop.records import Against, Metric, Quantity, Series, by_name
from heavytop.top.equations import Integral, Magnitude, Parameters

if TYPE_CHECKING:
    from heavytop.measure.truth import Truth

# Drift of first integrals along a computed motion, in one pass and constant memory.


Sums = tuple[arb, arb, arb]
TimeText = Callable[[Fraction], str]
STATISTICS = ("max", "rms", "final")
_RELATIVE = "relative"
DRIFT = "drift"
"""The name of the quantity; its components are the first integrals."""
_ROWS = 1024
"""States wait until they are so many."""
_MANY = 128
"""Drifts of fewer states take less time as balls than as arrays."""
_SUMS_OF_DOUBLES = numpy.dtype(float), numpy.dtype(numpy.longdouble)
_RANGE, _LOST = (1e-40, 1e40), 1e-170
"""Of numbers in this range, or 0, an integral loses at most that by underflow: 2^-1070 an operation, times 1e120."""


class Running:
    """Maximum, mean square and last of a stream of balls, and its values at chosen times."""

    def __init__(self) -> None:
        self.maximum = arb(0)
        self.squares = arb(0)
        self.final = arb(0)
        self.count = 0
        self.kept: dict[Fraction, arb] = {}

    def following(self, value: arb) -> Sums:
        """Maximum, sum of squares and last with |value| too; evaluated at the working precision, nothing taken in."""
        size = abs(value)
        return larger(self.maximum, size), self.squares + size * size, size

    def following_all(self, counted: Sequence[int], value: Callable[[int], arb], squares: Rough | None) -> Sums:
        """As :meth:`following`, with the values of these numbers.  Where their ``squares`` fix the printed digits of
        the root mean square, balls are evaluated of the last and of those that may be the largest alone.
        """
        if not counted:
            return self.maximum, self.squares, self.final
        maximum, total, final = self.maximum, self.squares, self.final
        places, more = ([], arb("nan")) if squares is None else _largest_and_sum(squares)
        enough = decided(root((total + more) / (self.count + len(counted))))
        for place in sorted({*places, len(counted) - 1}) if enough else range(len(counted)):
            final = abs(value(counted[place]))
            maximum = larger(maximum, final)
            if not enough:
                total = total + final * final
        return maximum, total + more if enough else total, final

    def take(self, time: Fraction, sums: Sums, keep: bool) -> None:
        """Take in a value at ``time`` by its :meth:`following`; remember it for the series if ``keep``."""
        self.take_all(sums, 1, {time: sums[2]} if keep else {})

    def take_all(self, sums: Sums, count: int, kept: dict[Fraction, arb]) -> None:
        """Take in so many values by the sums with all of them; kept: for the series, by time."""
        self.maximum, self.squares, self.final = sums
        self.count += count
        self.kept |= kept

    def metrics(self, quantity: Quantity) -> dict[Quantity, Metric]:
        """Its ``max``, ``rms`` and ``final``; ``missing`` without a sample."""
        if not self.count:
            return {quantity.over(part): Metric("missing", None) for part in STATISTICS}
        statistics = (self.maximum, root(self.squares / self.count), self.final)
        return {quantity.over(part): metric(value) for part, value in zip(STATISTICS, statistics, strict=True)}

    def series(self, quantity: Quantity, time_text: Callable[[Fraction], str]) -> Series:
        """The kept values."""
        return Series([time_text(t) for t in self.kept], [text(v) for v in self.kept.values()], quantity)

    def content(self) -> dict[str, Any]:
        """As plain text and integers, exact."""
        return {
            "maximum": ball_text(self.maximum),
            "squares": ball_text(self.squares),
            "final": ball_text(self.final),
            "count": self.count,
            "kept": {str(time): ball_text(value) for time, value in self.kept.items()},
        }

    def restore(self, content: dict[str, Any]) -> None:
        """Become what had that :meth:`content`."""
        self.maximum, self.squares, self.final = (ball_from(content[k]) for k in ("maximum", "squares", "final"))
        self.count = content["count"]
        if type(self.count) is not int or self.count < 0:
            raise ValueError(f"{self.count!r} samples")
        self.kept = {Fraction(time): ball_from(value) for time, value in content["kept"].items()}


class Statistics:
    """Quantities of a motion whose statistics grow sample by sample.  bits: of the working precision."""

    bits: int

    def quantities(self) -> dict[Quantity, Running]:
        """The running values by what they are of."""
        raise NotImplementedError

    def largest_alone(self, quantity: Quantity) -> bool:
        """Whether its maximum is all that is said of it: so of errors relative to the state."""
        return quantity.component == _RELATIVE

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``NAME_max``, ``_rms`` and ``_final`` of every quantity, or the first alone."""
        with working_precision(self.bits):
            metrics: dict[Quantity, Metric] = {}
            for quantity, running in self.quantities().items():
                every, largest = running.metrics(quantity), quantity.over("max")
                metrics |= {largest: every[largest]} if self.largest_alone(quantity) else every
            return by_name(metrics)

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """``NAME`` over the kept times, but for relative errors."""
        quantities = self.quantities().items()
        return {
            quantity.text: run.series(quantity, time_text)
            for quantity, run in quantities
            if quantity.component != _RELATIVE
        }

    def content(self) -> dict[str, Any]:
        """The sums so far, by component, as plain text and integers, exact."""
        return {quantity.component: run.content() for quantity, run in self.quantities().items()}

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        for quantity, run in self.quantities().items():
            run.restore(content[quantity.component])


class StatisticsOfStates(Statistics):
    """Statistics of native states, which wait until they are many or a statistic is asked for.

    Of many, arrays of doubles with proven errors tell which few may be the largest and what squares add up to.  Balls
    are evaluated of these few, of the last and of those kept for the series; of all where a printed digit stays open.
    """

    at_once = True
    """Whether arrays are used: sums by balls alone are those of any number of states at a time, to the bit."""

    def __init__(self, problem: Problem, names: Iterable[str], keep: Sequence[Fraction], width: int) -> None:
        self.problem, self.bits, self.keep = problem, problem.precision.bits + GUARD_BITS, frozenset(keep)
        self.parameters = parameter_balls(problem, self.bits)
        self._running = {name: Running() for name in names}
        self._width = width
        self._waiting: list[tuple[Fraction, Any]] = []

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        numbers = state[: self._width]
        self._waiting.append((time, numbers.copy() if isinstance(numbers, numpy.ndarray) else numbers))
        if len(self._waiting) == _ROWS:
            self.settle()

    def settle(self) -> None:
        """Take in the states that wait."""
        raise NotImplementedError

    @property
    def running(self) -> dict[str, Running]:
        """The running values of all states by component."""
        self.settle()
        return self._running

    def metrics(self) -> dict[str, Metric]:
        """As :meth:`Statistics.metrics`; states are taken in before, once, however often that is evaluated."""
        self.settle()
        return super().metrics()

    def one_by_one(self) -> None:
        """Take in the states that wait, and all that follow, by balls alone."""
        self.at_once = False
        self.settle()

    def _kept(self, times: Sequence[Fraction]) -> list[int]:
        """The numbers of the times that are kept; a Fraction's hash takes as long as an operation on balls."""
        return [i for i, time in enumerate(times) if time in self.keep] if self.keep else []


class Drift(StatisticsOfStates):
    """|I(t) − I(0)| of each integral, absolute, from the rounded start; evaluated with 64 guard bits.

    problem: what the integrator was given.  integrals: those that hold for the exact top and start.
    keep: the times whose values go into the series.
    With an attitude riding along, |ξ|² and ξ·γ are watched as well.
    """

    def __init__(self, problem: Problem, integrals: Sequence[Integral], keep: Sequence[Fraction] = ()) -> None:
        self.functions: dict[str, Callable[[Parameters, Any], Any]] = {i.name: i.value for i in integrals}
        if problem.xi is not None:
            self.functions["xi_squared"] = lambda _, y: dot(y[6:9], y[6:9])
            self.functions["xi_dot_gamma"] = lambda _, y: dot(y[6:9], y[3:6])
        self.start = (*problem.start.flat, *(problem.xi or ()))
        super().__init__(problem, self.functions, keep, len(self.start))
        self.initial = self._values(self.start)

    def settle(self) -> None:
        """Take in the states that wait."""
        if self._waiting:
            times, states = zip(*self._waiting, strict=True)
            self._waiting = []
            self.take_array(states, times)

    def take_array(self, states: Any, times: Sequence[Fraction] = ()) -> None:
        """Take in many native states, an array or a list; none is kept for the series without the times."""
        for first in range(0, len(states), _ROWS):
            rows, at = states[first : first + _ROWS], times[first : first + _ROWS]
            for running, (sums, kept) in zip(self._running.values(), self._following(rows, at), strict=True):
                running.take_all(sums, len(rows), kept)

    @whole_evaluation
    def _values(self, state: Sequence[Fraction]) -> dict[str, arb]:
        with working_precision(self.bits):
            y = [ball(value) for value in state]
            return {name: value(self.parameters, y) for name, value in self.functions.items()}

    @whole_evaluation
    def _following(self, states: Any, times: Sequence[Fraction]) -> list[tuple[Sums, dict[Fraction, arb]]]:
        """The sums of each drift with all of these states, and the values to keep; nothing is taken in."""
        kept, squares = self._kept(times), dict[str, Rough]()
        if self.at_once and len(states) >= max(_MANY, 2 * len(kept)) and self.problem.precision.bits <= EXTENDED.bits:
            squares = self._squares(numpy.asarray(states)[:, : self._width])
        with working_precision(self.bits):
            balls = cache(lambda index: to_balls(states[index]))
            drift = cache(lambda name, i: self.functions[name](self.parameters, balls(i)) - self.initial[name])
            return [
                (
                    running.following_all(range(len(states)), partial(drift, name), squares.get(name)),
                    {times[i]: abs(drift(name, i)) for i in kept},
                )
                for name, running in self._running.items()
            ]

    @numpy.errstate(all="ignore")
    def _squares(self, rows: Any) -> dict[str, Rough]:
        """The squared drifts of each integral as arrays; none of other numbers than sums of doubles, at odd scales.

        An operation on double-doubles is off by 16 u² at most, u = 2^-53 (Joldes, Muller, Popescu 2017), and no term of
        an integral goes through more than 16: I(t) − I(0) is off by 2^-96 of the sum of its absolute terms, and by what
        underflows.
        """
        parameters, moving = self.problem.parameters, self._width
        if rows.dtype not in _SUMS_OF_DOUBLES:
            return {}
        numbers = [Fraction(value) for value in (*parameters.numbers, *self.start)]
        sizes, most = [abs(value) for value in numbers if value], numpy.abs(rows).max(axis=0)
        high = rows.astype(float)
        low = (rows - high).astype(float)
        ordinary = most.max() < _RANGE[1] and _RANGE[0] < min(sizes) and max(sizes) < _RANGE[1]
        if not ordinary or (high + low.astype(rows.dtype) != rows).any():
            return {}
        pairs = Pairs.nearest(numbers)
        words = ((pairs.high[-moving:], high), (pairs.low[-moving:], low))
        state = [Pairs(*column) for column in zip(*(numpy.vstack(word).T for word in words), strict=True)]
        of_number = {number: pairs[k] for k, number in enumerate(numbers)}
        most = [Magnitude(max(float(value), abs(float(own)))) for value, own in zip(most, self.start, strict=True)]
        squares = {}
        for name, value in self.functions.items():
            values = value(parameters.mapped(of_number.__getitem__), state)
            size = float(value(parameters.mapped(Magnitude), most).size)
            drifts = (values[1:] - values[:1]).high
            squares[name] = Rough(drifts, 2.0**-52 * abs(drifts) + (2.0**-96 * size + _LOST)).squared()
        return squares

    def quantities(self) -> dict[Quantity, Running]:
        """The running values by what they are of."""
        return {Quantity(DRIFT, name): values for name, values in self.running.items()}


@whole_evaluation
def parameter_balls(problem: Problem, bits: int) -> Parameters:
    """I, P r and the rotor of a problem as balls of ``bits`` bits."""
    with working_precision(bits):
        return problem.parameters.mapped(ball)


# Distance of a computed motion from a known one that starts from the same rounded data.


SOLUTION_ERROR, INTEGRATION_ERROR = "solution_error", "integration_error"
"""Distance to the true motion; to the motion that the formulas of a claim do solve."""
ERRORS = Quantity("error", statistic="max"), Quantity("error", statistic="final")
"""Distance in one number: the largest over the samples, and that at the end."""
OBSERVED_ORDER = Quantity("observed_order")
"""Order of a method, by its errors of single steps."""
ORDER_OF_RUNS = Quantity("observed_order", "runs")
"""Order of a method, by the errors of whole runs at h, h/2, h/4."""
COMPONENTS = ("omega", "gamma", "along", "across")


class SolutionError(StatisticsOfStates):
    """Error of Ω and of γ (largest component), of the state along the flow (phase) and across it (Euclidean), and
    relative: the largest |error|/max(1, |true value|) of a component, which says how many digits are kept.

    truth: the true motion from the start and top of ``problem``, rounded, so no input rounding is charged; what it does
    not cover is not compared.
    threshold: the error of Ω, in units of Ω, whose first crossing is the escape time.
    until: the |t| up to which errors count; later ones go into the series alone.
    name: of the quantity, whose components are omega, gamma, along and across.
    """

    def __init__(
        self,
        problem: Problem,
        truth: Truth,
        keep: Sequence[Fraction] = (),
        threshold: Fraction | None = None,
        until: float = math.inf,
        name: str = SOLUTION_ERROR,
    ) -> None:
        super().__init__(problem, (*COMPONENTS, _RELATIVE), keep, 6)
        self.truth = truth
        self.threshold = threshold
        self.until = until
        self.name = name
        self._escape: Fraction | None = None

    @property
    def escape(self) -> Fraction | None:
        """The first time at which an error of Ω is beyond the threshold."""
        self.settle()
        return self._escape

    def settle(self) -> None:
        """Take in the states that wait."""
        summarise([self])

    def values(self, y: Sequence[arb], truth: Sequence[arb]) -> list[arb]:
        """The errors of a state of six balls by :data:`COMPONENTS`, and relative, at the working precision."""
        delta = [value - true for value, true in zip(y, truth, strict=True)]
        flow = self.problem.system.field(self.parameters, truth)
        return [largest(delta[:3]), largest(delta[3:]), *split(delta, flow), relative_error(delta, truth)]

    def last(self, rate: Fraction) -> float:
        """The error of the last state that was taken in, at most: of Ω over ``rate``, or of γ, the larger."""
        omega, gamma = (self.running[part].final for part in ("omega", "gamma"))

        @whole_evaluation
        def at_most() -> float:
            with working_precision(self.bits):
                return float(largest((omega / rational(rate), gamma)).abs_upper())

        return at_most()

    def quantities(self) -> dict[Quantity, Running]:
        """``NAME_omega``, ``_gamma``, ``_along``, ``_across`` and ``_relative``."""
        return {Quantity(self.name, part): values for part, values in self.running.items()}

    def content(self) -> dict[str, Any]:
        """See :meth:`Statistics.content`; the escape time too."""
        return {"escape": None if self.escape is None else str(self.escape), **super().content()}

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        self._escape = None if content["escape"] is None else Fraction(content["escape"])
        super().restore(content)


def split(delta: Sequence[arb], flow: Sequence[arb]) -> tuple[arb, arb]:
    """|δ| along the unit vector of the flow, and the Euclidean rest across it; the whole across at an equilibrium."""
    total = _product(delta, delta)
    speed = _product(flow, flow)
    if not resolved(speed) or speed == 0:
        return arb(0), root(total)
    projection = _product(delta, flow)
    along = projection * projection / speed
    return root(along), root(total - along)


def _product(a: Sequence[arb], b: Sequence[arb]) -> Any:
    return dot(a[:3], b[:3]) + dot(a[3:], b[3:])


class DriftAndError:
    """Measures of the samples of a motion: drift, where the state is whole, and error, where there is a reference.

    truth: the true motion, or why it is missing.
    """

    truth: Truth | str
    drift: Drift | None
    error: Statistics | None

    @property
    def against(self) -> Against:
        """The reference of the motion."""
        if isinstance(self.truth, str):
            return Against("none", reason=f"no reference: {self.truth}")
        return self.truth.against

    def _parts(self) -> list[Statistics]:
        return [part for part in (self.drift, self.error) if part is not None]

    def running(self) -> dict[Quantity, Running]:
        """The running values of every drift and error by what they are of."""
        return {quantity: run for part in self._parts() for quantity, run in part.quantities().items()}

    def metrics(self) -> dict[str, Metric]:
        """``drift_NAME_max``, ... for every integral; ``solution_error_omega_max``, ... where there is a reference."""
        return {name: metric for part in self._parts() for name, metric in part.metrics().items()}

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The series of every drift and error over the kept times."""
        return {name: series for part in self._parts() for name, series in part.series(time_text).items()}


class Scorer(DriftAndError):
    """Takes in the states of one motion, one after the other, and holds what they are worth.

    problem: what the integrator was given.  truth: the true motion, or why it is missing.
    keep: the times whose values go into the series.
    threshold, until, name: as in :class:`heavytop.measure.scorer.SolutionError`.
    Drift is in the units of each integral, errors of Ω are in 1/time unit, of γ in none.
    """

    drift: Drift
    error: SolutionError | None

    def __init__(
        self,
        problem: Problem,
        truth: Truth | str,
        keep: Sequence[Fraction] = (),
        *,
        threshold: Fraction | None = None,
        until: float = math.inf,
        name: str = SOLUTION_ERROR,
    ) -> None:
        self.truth = truth
        self.drift = Drift(problem, problem.integrals(), keep)
        self.error = None
        if not isinstance(truth, str):
            self.error = SolutionError(problem, truth, keep, threshold, until, name)

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        self.drift(time, state)
        if self.error is not None:
            self.error(time, state)

    def one_by_one(self) -> None:
        """Take in the states that wait, and all that follow, by balls alone."""
        self.drift.one_by_one()
        if self.error is not None:
            self.error.one_by_one()

    def take(self, times: Iterable[Fraction], states: Iterable[Sequence[Any]]) -> None:
        """Take in an array of native states, one at each of the exact times."""
        for time, state in zip(times, states, strict=True):
            self(time, state)

    def content(self) -> dict[str, Any]:
        """The sums so far, as plain text and integers, exact."""
        self.one_by_one()
        return {"drift": self.drift.content()} | ({"error": self.error.content()} if self.error else {})

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        self.one_by_one()
        self.drift.restore(content["drift"])
        if self.error is not None:
            self.error.restore(content["error"])


# Many samples at once.
#
# The distances of samples from the truth are balls.  What follows from them is worked out for all samples in doubles
# with proven errors: the squares that :meth:`Running.following_all` takes.


_FEW = 24
_ROUNDING, _ROOM, _UNDERFLOW = 2.0**-52, 1 + 2.0**-48, 1e-300


@dataclass(frozen=True, slots=True)
class Rough:
    """Arrays of doubles, and bounds of their errors: a ring, so that the fields are evaluated for many states.

    Each bound has room for the rounding of its own evaluation, and for underflow.
    """

    value: NDArray[numpy.float64]
    error: NDArray[numpy.float64]

    @classmethod
    def of(cls, balls: Sequence[Sequence[arb]]) -> Rough:
        """Of rows of balls, a column each: exact where a ball is 0."""
        value = numpy.array([[float(ball) for ball in row] for row in balls])
        radii = numpy.array([[float(ball.rad()) for ball in row] for row in balls])
        exact = (value == 0) & (radii == 0)
        for row, column in zip(*numpy.nonzero(exact), strict=True):
            exact[row, column] = balls[row][column].is_zero()
        return _rounded(value.T, radii.T, numpy.where(exact.T, 0.0, _UNDERFLOW))

    def __getitem__(self, where: Any) -> Rough:
        return Rough(self.value[where], self.error[where])

    def __add__(self, other: Rough) -> Rough:
        return _rounded(self.value + other.value, self.error + other.error)

    def __sub__(self, other: Rough) -> Rough:
        return _rounded(self.value - other.value, self.error + other.error)

    def __mul__(self, other: Rough) -> Rough:
        one, two = abs(self.value) + self.error, abs(other.value)
        return _rounded(self.value * other.value, one * other.error + two * self.error)

    def __truediv__(self, other: Rough) -> Rough:
        ratio, least = self.value / other.value, abs(other.value) - other.error * _ROOM
        error = (self.error + abs(ratio) * other.error) / numpy.where(least > 0, least, 0.0)
        return _rounded(ratio, error)

    def squared(self) -> Rough:
        """The squares: exactly 0 of exactly 0."""
        square = self * self
        return Rough(square.value, numpy.where((self.value == 0) & (self.error == 0), 0.0, square.error))


def _rounded(value: Any, error: Any, underflow: Any = _UNDERFLOW) -> Rough:
    return Rough(value, (error + (_ROUNDING * abs(value) + underflow)) * _ROOM)


def _most(parts: Sequence[Rough]) -> Rough:
    return Rough(reduce(numpy.maximum, (p.value for p in parts)), reduce(numpy.maximum, (p.error for p in parts)))


def _sum(parts: Iterable[Rough]) -> Rough:
    return reduce(Rough.__add__, parts)


@numpy.errstate(all="ignore")
def _largest_and_sum(squares: Rough) -> tuple[list[int], arb]:
    """Which of them may be the largest, and their sum."""
    largest = numpy.flatnonzero(squares.value + squares.error >= (squares.value - squares.error).max()).tolist()
    try:
        total, error = math.fsum(squares.value), math.fsum(squares.error)
    except OverflowError:  # of finite squares whose sum is beyond a double
        return largest, arb("nan")
    return largest, arb(total, (error + _ROUNDING * total) * _ROOM)


class _Samples:
    """The states that waited for errors, where there is a truth."""

    def __init__(self, error: SolutionError) -> None:
        waiting, error._waiting = error._waiting, []
        known = [sample for sample in waiting if error.truth.covers(sample[0])]
        self.error, self.times, self.states = error, [time for time, _ in known], [state for _, state in known]
        self.truths = [error.truth.state(time, error.bits) for time in self.times]
        self.kept, until = error._kept(self.times), error.until
        self.counted = [i for i, time in enumerate(self.times) if math.isinf(until) or abs(float(time)) <= until]

    def deltas(self) -> list[list[arb]]:
        """The differences from the truth."""
        with working_precision(self.error.bits):
            pairs = zip(map(to_balls, self.states), self.truths, strict=True)
            return [[value - true for value, true in zip(y, truth, strict=True)] for y, truth in pairs]

    @whole_evaluation
    def following(self, squares: Sequence[Rough] | None) -> tuple[list[tuple[Sums, dict[Fraction, arb]]], int | None]:
        """The sums of each error with all of these states, and the values to keep; and which is the first beyond the
        threshold.  Nothing is taken in.
        """
        error, results = self.error, []
        with working_precision(error.bits):
            values = cache(lambda index: error.values(to_balls(self.states[index]), self.truths[index]))
            for j, running in enumerate(error._running.values()):
                part = None if squares is None else squares[j][numpy.array(self.counted, int)]
                sums = running.following_all(self.counted, lambda i, j=j: values(i)[j], part)  # type: ignore[misc]
                results.append((sums, {self.times[i]: abs(values(i)[j]) for i in self.kept}))
            if error.threshold is None:
                return results, None
            below = numpy.zeros(len(self.times), bool)
            if squares is not None:
                below = squares[0].value + squares[0].error < float(error.threshold) ** 2 / _ROOM
            escaped = (i for i in numpy.flatnonzero(~below).tolist() if values(i)[0] > rational(error.threshold))
            return results, next(escaped, None)


def summarise(errors: Iterable[SolutionError]) -> None:
    """Take in the states that wait for errors of one motion, whose roundings may differ."""
    samples = [_Samples(error) for error in errors if error._waiting]
    count, kept = sum(len(one.times) for one in samples), sum(len(one.kept) for one in samples)
    squares, first = None, 0
    if count >= max(_FEW, 2 * kept) and all(one.error.at_once for one in samples):
        squares = _error_squares(samples)
    for one in samples:
        end = first + len(one.times)
        sums, beyond = one.following(squares and [part[first:end] for part in squares])
        for running, (part, values) in zip(one.error._running.values(), sums, strict=True):
            running.take_all(part, len(one.counted), values)
        if beyond is not None and one.error._escape is None:
            one.error._escape = one.times[beyond]
        first = end


@whole_evaluation
@numpy.errstate(all="ignore")
def _error_squares(samples: Sequence[_Samples]) -> list[Rough]:
    """The squares of the errors that :meth:`SolutionError.values` gives, of all samples that have a truth."""
    delta = Rough.of([row for one in samples for row in one.deltas()])
    truth = Rough.of([row for one in samples for row in one.truths])
    owners = numpy.repeat(numpy.arange(len(samples)), [len(one.times) for one in samples])
    numbers: list[list[arb]] = [[] for _ in samples]
    for one, row in zip(samples, numbers, strict=True):
        one.error.parameters.mapped(row.append)
    columns = iter(Rough.of(numbers)[:, owners])
    parameters = samples[0].error.parameters.mapped(lambda _: next(columns))
    flow: Any = samples[0].error.problem.system.field(parameters, [truth[k] for k in range(6)])
    squares = [delta[k].squared() for k in range(6)]
    share = _sum(delta[k] * flow[k] for k in range(6)) / _sum(rate.squared() for rate in flow)
    along = _sum((share * rate).squared() for rate in flow)
    across = _sum((delta[k] - share * rate).squared() for k, rate in enumerate(flow))
    # balls give it as the difference of two squares, and resolve it only where that is larger than their radii
    radii = delta.error - _ROUNDING * abs(delta.value)
    unresolved = 100 * numpy.sqrt(_sum(squares).value * (radii**2).sum(axis=0)) > across.value
    across = Rough(across.value, numpy.where(unresolved, math.inf, across.error))
    size = Rough(numpy.maximum(1.0, abs(truth.value)), truth.error)
    relative = (delta / size).squared()
    return [_most(squares[:3]), _most(squares[3:]), along, across, _most([relative[k] for k in range(6)])]


# The error of a motion at each of its samples, and the drift of its integrals there, as decimal logarithms.


Logs = list[float | None]
"""log10 of a quantity at each sample; None where it is 0."""


def sample_errors(
    problem: Problem,
    times: Sequence[Fraction],
    states: Sequence[Sequence[Fraction]],
    known: Sequence[Sequence[Fraction]],
) -> dict[str, Logs]:
    """The error of each state, by the components of :class:`SolutionError`.

    states, known: exact numbers, six each, at the same times.
    """
    true = dict(zip(times, known, strict=True))

    def state_at(time: Fraction, bits: int) -> list[arb]:
        with working_precision(bits):
            return to_balls(true[time])

    from heavytop.measure.truth import Truth

    error = SolutionError(problem, Truth(Against("computed"), state_at), times)
    # as many bits as tell a state of the format from one that is right to as many digits again
    error.bits = 2 * problem.precision.bits + GUARD_BITS
    for time, state in zip(times, states, strict=True):
        error(time, state)
    return {part: _logs(running) for part, running in error.running.items()}


def sample_drifts(problem: Problem, times: Sequence[Fraction], states: Sequence[Sequence[Fraction]]) -> dict[str, Logs]:
    """|I(y(t)) − I(y(0))| at each state, of every first integral that holds for the exact start."""
    drift = Drift(replace(problem, xi=None), problem.integrals(), times)
    for time, state in zip(times, states, strict=True):
        drift(time, state)
    return {name: _logs(running) for name, running in drift.running.items()}


def _logs(running: Running) -> Logs:
    """Logarithms of the middles of the kept balls; None where one may be 0."""
    pairs = ((midpoint(value), radius(value)) for value in running.kept.values())
    return [None if middle <= width else log10(middle) for middle, width in pairs]
