"""Drift of first integrals along a computed motion, and its distance from a reference, in one pass."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy
from flint import arb

from heavytop.exact.flint.balls import ball, midpoint, radius, rational, whole_evaluation, working_precision
from heavytop.integrate.trajectory import Problem
from heavytop.measure.bounded_doubles import ROUNDING, BoundedDoubles, pointwise_maximum, pointwise_sum
from heavytop.measure.running import RELATIVE, RunningStatistics, Statistics, Sums, TimeText
from heavytop.measure.scalar import GUARD_BITS, largest, relative_error, resolved, root, to_balls
from heavytop.multiword.pairs import Pairs
from heavytop.precision import EXTENDED, dot, log10
from heavytop.records import Against, Metric, Quantity, Series
from heavytop.top.equations import Integral, Magnitude, Parameters

if TYPE_CHECKING:
    from heavytop.measure.truth import Truth

DRIFT = "drift"
"""The name of the quantity; its components are the first integrals."""
_BATCH = 1024
"""States of one batch."""
_MANY_DRIFTS, _MANY_ERRORS = 128, 24
"""Below so many states balls take less time than arrays."""
_SUMS_OF_DOUBLES = numpy.dtype(float), numpy.dtype(numpy.longdouble)
_RANGE, _UNDERFLOW = (1e-40, 1e40), 1e-170
"""Bound of the underflow in an integral of numbers in this range, or 0: 2^-1070 per operation, times 1e120."""


class StatisticsOfStates(Statistics):
    """Statistics of native states, which are evaluated in batches.

    In a large batch, arrays of doubles with proven errors give the sums of squares and the few states that may have the
    largest value.  Only these, the last state and those of the series are evaluated as balls; all of them where the
    arrays leave a printed digit undecided.
    """

    batched = True
    """Whether arrays are used.  Without them the sums do not depend, to the bit, on how states fall into batches."""

    def __init__(self, problem: Problem, names: Iterable[str], keep: Sequence[Fraction], width: int) -> None:
        self.problem, self.bits, self.keep = problem, problem.precision.bits + GUARD_BITS, frozenset(keep)
        self.parameters = parameter_balls(problem, self.bits)
        self._running = {name: RunningStatistics() for name in names}
        self._width = width
        self._pending: list[tuple[Fraction, Any]] = []

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Add one native state."""
        numbers = state[: self._width]
        self._pending.append((time, numbers.copy() if isinstance(numbers, numpy.ndarray) else numbers))
        if len(self._pending) == _BATCH:
            self.flush()

    @abstractmethod
    def flush(self) -> None:
        """Evaluate the pending states."""

    @property
    def running(self) -> dict[str, RunningStatistics]:
        """The statistics of all states by component."""
        self.flush()
        return self._running

    def metrics(self) -> dict[str, Metric]:
        """The metrics of all states; pending ones are evaluated before, once, however often those are evaluated."""
        self.flush()
        return super().metrics()

    def one_by_one(self) -> None:
        """Evaluate the pending states and all that follow as balls."""
        self.batched = False
        self.flush()

    def _series_indices(self, times: Sequence[Fraction]) -> list[int]:
        """Indices of the times of the series; a Fraction's hash takes as long as an operation on balls."""
        return [i for i, time in enumerate(times) if time in self.keep] if self.keep else []


class Drift(StatisticsOfStates):
    """|I(t) − I(0)| of each integral, absolute, from the rounded start; evaluated with 64 guard bits.

    problem: what the integrator was given.  integrals: those that hold for the exact top and start.
    keep: the times whose values go into the series.
    With an attitude, |ξ|² and ξ·γ are integrals too.
    """

    def __init__(self, problem: Problem, integrals: Sequence[Integral], keep: Sequence[Fraction] = ()) -> None:
        self.functions: dict[str, Callable[[Parameters, Any], Any]] = {i.name: i.value for i in integrals}
        if problem.xi is not None:
            self.functions["xi_squared"] = lambda _, y: dot(y[6:9], y[6:9])
            self.functions["xi_dot_gamma"] = lambda _, y: dot(y[6:9], y[3:6])
        self.start = (*problem.start.flat, *(problem.xi or ()))
        super().__init__(problem, self.functions, keep, len(self.start))
        self.initial = self._values(self.start)

    def flush(self) -> None:
        """Evaluate the pending states."""
        if self._pending:
            times, states = zip(*self._pending, strict=True)
            self._pending = []
            self.add_states(states, times)

    def add_states(self, states: Any, times: Sequence[Fraction] = ()) -> None:
        """Add many native states, an array or a list; without times, none goes into the series."""
        for first in range(0, len(states), _BATCH):
            batch = states[first : first + _BATCH]
            sums = self._including(batch, times[first : first + _BATCH])
            for running, (total, kept) in zip(self._running.values(), sums, strict=True):
                running.update(total, len(batch), kept)

    @whole_evaluation
    def _values(self, state: Sequence[Fraction]) -> dict[str, arb]:
        with working_precision(self.bits):
            y = [ball(value) for value in state]
            return {name: value(self.parameters, y) for name, value in self.functions.items()}

    @whole_evaluation
    def _including(self, states: Any, times: Sequence[Fraction]) -> list[tuple[Sums, dict[Fraction, arb]]]:
        """The sums of each drift with these states, and the values of the series."""
        kept, squares = self._series_indices(times), dict[str, BoundedDoubles]()
        many = len(states) >= max(_MANY_DRIFTS, 2 * len(kept))
        if self.batched and many and self.problem.precision.bits <= EXTENDED.bits:
            squares = self._squares(numpy.asarray(states)[:, : self._width])
        with working_precision(self.bits):
            balls = cache(lambda index: to_balls(states[index]))
            drift = cache(lambda name, i: self.functions[name](self.parameters, balls(i)) - self.initial[name])
            return [
                (
                    running.including_many(range(len(states)), partial(drift, name), squares.get(name)),
                    {times[i]: abs(drift(name, i)) for i in kept},
                )
                for name, running in self._running.items()
            ]

    @numpy.errstate(all="ignore")
    def _squares(self, rows: Any) -> dict[str, BoundedDoubles]:
        """The squared drifts of each integral; empty for numbers that are not sums of two doubles, or out of range.

        An operation on double-doubles is off by 16 u² at most, u = 2^-53 (Joldes, Muller, Popescu 2017), and no term of
        an integral goes through more than 16: I(t) − I(0) is off by 2^-96 of the sum of its absolute terms, and by what
        underflows.
        """
        parameters, width = self.problem.parameters, self._width
        if rows.dtype not in _SUMS_OF_DOUBLES:
            return {}
        numbers = [Fraction(value) for value in (*parameters.numbers, *self.start)]
        sizes, bounds = [abs(value) for value in numbers if value], numpy.abs(rows).max(axis=0)
        high = rows.astype(float)
        low = (rows - high).astype(float)
        in_range = bounds.max() < _RANGE[1] and _RANGE[0] < min(sizes) and max(sizes) < _RANGE[1]
        if not in_range or (high + low.astype(rows.dtype) != rows).any():
            return {}
        pairs = Pairs.nearest(numbers)
        words = ((pairs.high[-width:], high), (pairs.low[-width:], low))
        state = [Pairs(*column) for column in zip(*(numpy.vstack(word).T for word in words), strict=True)]
        pair_of = {number: pairs[k] for k, number in enumerate(numbers)}
        magnitudes = [Magnitude(max(float(a), abs(float(b)))) for a, b in zip(bounds, self.start, strict=True)]
        squares = {}
        for name, value in self.functions.items():
            values = value(parameters.mapped(pair_of.__getitem__), state)
            size = float(value(parameters.mapped(Magnitude), magnitudes).size)
            drifts = (values[1:] - values[:1]).high
            bound = ROUNDING * abs(drifts) + (2.0**-96 * size + _UNDERFLOW)
            squares[name] = BoundedDoubles(drifts, bound).squared()
        return squares

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """The statistics of each drift."""
        return {Quantity(DRIFT, name): running for name, running in self.running.items()}


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
        super().__init__(problem, (*COMPONENTS, RELATIVE), keep, 6)
        self.truth = truth
        self.threshold = threshold
        self.until = until
        self.name = name
        self._escape: Fraction | None = None

    @property
    def escape(self) -> Fraction | None:
        """The first time at which an error of Ω is beyond the threshold."""
        self.flush()
        return self._escape

    def flush(self) -> None:
        """Evaluate the pending states."""
        flush_together([self])

    def values(self, y: Sequence[arb], truth: Sequence[arb]) -> list[arb]:
        """The errors of a state of six balls by :data:`COMPONENTS`, and relative, at the working precision."""
        delta = [value - true for value, true in zip(y, truth, strict=True)]
        flow = self.problem.system.field(self.parameters, truth)
        return [largest(delta[:3]), largest(delta[3:]), *split(delta, flow), relative_error(delta, truth)]

    def last(self, rate: Fraction) -> float:
        """An upper bound of the last state's error: of Ω over ``rate``, or of γ, the larger."""
        omega, gamma = (self.running[part].sums.final for part in ("omega", "gamma"))

        @whole_evaluation
        def at_most() -> float:
            with working_precision(self.bits):
                return float(largest((omega / rational(rate), gamma)).abs_upper())

        return at_most()

    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """``NAME_omega``, ``_gamma``, ``_along``, ``_across`` and ``_relative``."""
        return {Quantity(self.name, part): running for part, running in self.running.items()}

    def content(self) -> dict[str, object]:
        """The state of a checkpoint, the escape time included."""
        return {"escape": None if self.escape is None else str(self.escape), **super().content()}

    def restore(self, content: dict[str, Any]) -> None:
        """Restore a state saved by :meth:`content`."""
        self._escape = None if content["escape"] is None else Fraction(content["escape"])
        super().restore(content)


def split(delta: Sequence[arb], flow: Sequence[arb]) -> tuple[arb, arb]:
    """|δ| along the unit vector of the flow, and the Euclidean norm of what is left across it; at an equilibrium all of
    it is across.
    """
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

    def running(self) -> dict[Quantity, RunningStatistics]:
        """The statistics of every drift and error."""
        return {quantity: running for part in self._parts() for quantity, running in part.quantities().items()}

    def metrics(self) -> dict[str, Metric]:
        """``drift_NAME_max``, ... for every integral; ``solution_error_omega_max``, ... where there is a reference."""
        return {name: metric for part in self._parts() for name, metric in part.metrics().items()}

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """The series of every drift and error."""
        return {name: series for part in self._parts() for name, series in part.series(time_text).items()}


class Scorer(DriftAndError):
    """Drift and error of one trajectory, accumulated state by state.

    problem: what the integrator was given.  truth: the true motion, or why it is missing.
    keep: the times whose values go into the series.
    threshold, until, name: see :class:`heavytop.measure.scorer.SolutionError`.
    Drift is in the units of each integral, errors of Ω are in 1/time unit, those of γ have no unit.
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
        """Add one native state."""
        self.drift(time, state)
        if self.error is not None:
            self.error(time, state)

    def one_by_one(self) -> None:
        """Evaluate the pending states and all that follow as balls."""
        self.drift.one_by_one()
        if self.error is not None:
            self.error.one_by_one()

    def add_states(self, times: Iterable[Fraction], states: Iterable[Sequence[Any]]) -> None:
        """Add native states, one at each of the exact times."""
        for time, state in zip(times, states, strict=True):
            self(time, state)

    def content(self) -> dict[str, object]:
        """The state of a checkpoint: text and integers, exact."""
        self.one_by_one()
        content: dict[str, object] = {"drift": self.drift.content()}
        return content | {"error": self.error.content()} if self.error else content

    def restore(self, content: dict[str, Any]) -> None:
        """Restore a state saved by :meth:`content`."""
        self.one_by_one()
        self.drift.restore(content["drift"])
        if self.error is not None:
            self.error.restore(content["error"])


# Errors of many samples: the distances from the truth are balls, the rest is evaluated in doubles with proven errors.


class _Batch:
    """The pending states of one motion within the domain of its reference."""

    def __init__(self, error: SolutionError) -> None:
        pending, error._pending = error._pending, []
        known = [sample for sample in pending if error.truth.covers(sample[0])]
        self.error, self.times, self.states = error, [time for time, _ in known], [state for _, state in known]
        self.truths = [error.truth.state(time, error.bits) for time in self.times]
        self.kept, until = error._series_indices(self.times), error.until
        self.counted = [i for i, time in enumerate(self.times) if math.isinf(until) or abs(float(time)) <= until]

    def differences(self) -> list[list[arb]]:
        """States minus true states."""
        with working_precision(self.error.bits):
            pairs = zip(map(to_balls, self.states), self.truths, strict=True)
            return [[value - true for value, true in zip(y, truth, strict=True)] for y, truth in pairs]

    @whole_evaluation
    def including(
        self, squares: Sequence[BoundedDoubles] | None
    ) -> tuple[list[tuple[Sums, dict[Fraction, arb]]], int | None]:
        """The sums of each error with these states and the values of the series; the index of the first state beyond
        the threshold.
        """
        error, sums = self.error, []
        with working_precision(error.bits):
            values = cache(lambda index: error.values(to_balls(self.states[index]), self.truths[index]))
            for j, running in enumerate(error._running.values()):
                part = None if squares is None else squares[j][numpy.array(self.counted, int)]
                total = running.including_many(self.counted, lambda i, j=j: values(i)[j], part)  # type: ignore[misc]
                sums.append((total, {self.times[i]: abs(values(i)[j]) for i in self.kept}))
            if error.threshold is None:
                return sums, None
            below = numpy.zeros(len(self.times), bool)
            if squares is not None:
                below = squares[0].certainly_below(float(error.threshold) ** 2)
            escaped = (i for i in numpy.flatnonzero(~below).tolist() if values(i)[0] > rational(error.threshold))
            return sums, next(escaped, None)


def flush_together(errors: Iterable[SolutionError]) -> None:
    """Evaluate the pending states of several runs of one motion, whose roundings may differ, as one batch."""
    batches = [_Batch(error) for error in errors if error._pending]
    count, kept = sum(len(batch.times) for batch in batches), sum(len(batch.kept) for batch in batches)
    squares, first = None, 0
    if count >= max(_MANY_ERRORS, 2 * kept) and all(batch.error.batched for batch in batches):
        squares = _error_squares(batches)
    for batch in batches:
        end = first + len(batch.times)
        sums, beyond = batch.including(squares and [part[first:end] for part in squares])
        for running, (total, values) in zip(batch.error._running.values(), sums, strict=True):
            running.update(total, len(batch.counted), values)
        if beyond is not None and batch.error._escape is None:
            batch.error._escape = batch.times[beyond]
        first = end


@whole_evaluation
@numpy.errstate(all="ignore")
def _error_squares(batches: Sequence[_Batch]) -> list[BoundedDoubles]:
    """The squares of the errors that :meth:`SolutionError.values` gives, over the states of all batches."""
    delta = BoundedDoubles.of([row for batch in batches for row in batch.differences()])
    truth = BoundedDoubles.of([row for batch in batches for row in batch.truths])
    owners = numpy.repeat(numpy.arange(len(batches)), [len(batch.times) for batch in batches])
    numbers: list[list[arb]] = [[] for _ in batches]
    for batch, row in zip(batches, numbers, strict=True):
        batch.error.parameters.mapped(row.append)
    columns = iter(BoundedDoubles.of(numbers)[:, owners])
    parameters = batches[0].error.parameters.mapped(lambda _: next(columns))
    flow: Any = batches[0].error.problem.system.field(parameters, [truth[k] for k in range(6)])
    squares = [delta[k].squared() for k in range(6)]
    projection = pointwise_sum(delta[k] * flow[k] for k in range(6)) / pointwise_sum(rate.squared() for rate in flow)
    along = pointwise_sum((projection * rate).squared() for rate in flow)
    across = pointwise_sum((delta[k] - projection * rate).squared() for k, rate in enumerate(flow))
    # balls give it as the difference of two squares, and resolve it only where that is larger than their radii
    radii = delta.error - ROUNDING * abs(delta.value)
    unresolved = 100 * numpy.sqrt(pointwise_sum(squares).value * (radii**2).sum(axis=0)) > across.value
    across = BoundedDoubles(across.value, numpy.where(unresolved, math.inf, across.error))
    size = BoundedDoubles(numpy.maximum(1.0, abs(truth.value)), truth.error)
    relative = [(delta / size).squared()[k] for k in range(6)]
    return [
        *(pointwise_maximum(part) for part in (squares[:3], squares[3:])),
        along,
        across,
        pointwise_maximum(relative),
    ]


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


def _logs(running: RunningStatistics) -> Logs:
    """Logarithms of the midpoints of the series; None where a ball may contain 0."""
    pairs = ((midpoint(value), radius(value)) for value in running.kept.values())
    return [None if middle <= width else log10(middle) for middle, width in pairs]
