"""Running statistics of quantities along a motion, in constant memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from typing import Any, NamedTuple

from flint import arb

from heavytop.exact.flint.balls import ball_from, ball_text, whole_evaluation, working_precision
from heavytop.measure.bounded_doubles import BoundedDoubles
from heavytop.measure.scalar import decided, larger, metric, root, text
from heavytop.records import Metric, Quantity, Series, by_name

TimeText = Callable[[Fraction], str]
STATISTICS = ("max", "rms", "final")
RELATIVE = "relative"


class Sums(NamedTuple):
    """The largest, the sum of squares and the last of absolute values."""

    maximum: arb
    squares: arb
    final: arb


class RunningStatistics:
    """Maximum, root mean square and last of a sequence of absolute values, and the values at chosen times.

    An evaluation of balls may be repeated, see :func:`heavytop.exact.flint.balls.whole_evaluation`.  So values are
    added in two steps: :meth:`including` evaluates and changes nothing, :meth:`update` evaluates nothing.
    """

    def __init__(self) -> None:
        self.sums = Sums(arb(0), arb(0), arb(0))
        self.count = 0
        self.kept: dict[Fraction, arb] = {}

    def including(self, values: Iterable[arb]) -> Sums:
        """The sums with further values, at the working precision."""
        maximum, squares, final = self.sums
        for value in values:
            final = abs(value)
            maximum, squares = larger(maximum, final), squares + final * final
        return Sums(maximum, squares, final)

    def including_many(
        self, indices: Sequence[int], value: Callable[[int], arb], squares: BoundedDoubles | None
    ) -> Sums:
        """The sums with the values at ``indices``.

        squares: of these values.  Where they decide the printed digits of the root mean square, only the last value and
        those that may be the largest are evaluated as balls.
        """
        if squares is not None and indices:
            total = self.sums.squares + squares.total()
            if decided(root(total / (self.count + len(indices)))):
                needed = sorted({*squares.candidates_for_maximum(), len(indices) - 1})
                sizes = [abs(value(indices[i])) for i in needed]
                return Sums(reduce(larger, sizes, self.sums.maximum), total, sizes[-1])
        return self.including(map(value, indices))

    def update(self, sums: Sums, count: int = 1, kept: Mapping[Fraction, arb] | None = None) -> None:
        """Store the sums with ``count`` further values.  kept: the values for the series, by time."""
        self.sums = sums
        self.count += count
        self.kept |= kept or {}

    def metrics(self, quantity: Quantity) -> dict[Quantity, Metric]:
        """Its ``max``, ``rms`` and ``final``; ``missing`` without a sample."""
        if not self.count:
            return {quantity.over(part): Metric("missing", None) for part in STATISTICS}
        statistics = self.sums._replace(squares=root(self.sums.squares / self.count))
        return {quantity.over(part): metric(value) for part, value in zip(STATISTICS, statistics, strict=True)}

    def series(self, quantity: Quantity, time_text: TimeText) -> Series:
        """The values at the chosen times."""
        return Series([time_text(t) for t in self.kept], [text(v) for v in self.kept.values()], quantity)

    def content(self) -> dict[str, object]:
        """The state of a checkpoint: text and integers, exact."""
        return {
            **{name: ball_text(value) for name, value in self.sums._asdict().items()},
            "count": self.count,
            "kept": {str(time): ball_text(value) for time, value in self.kept.items()},
        }

    def restore(self, content: dict[str, Any]) -> None:
        """Restore a state saved by :meth:`content`."""
        self.sums = Sums(*(ball_from(content[name]) for name in Sums._fields))
        self.count = content["count"]
        if type(self.count) is not int or self.count < 0:
            raise ValueError(f"{self.count!r} samples")
        self.kept = {Fraction(time): ball_from(value) for time, value in content["kept"].items()}


class Statistics(ABC):
    """Running statistics of several quantities of a motion.  bits: of the working precision."""

    bits: int

    @abstractmethod
    def quantities(self) -> dict[Quantity, RunningStatistics]:
        """The statistics of each quantity."""

    def maximum_only(self, quantity: Quantity) -> bool:
        """Whether only its maximum is reported: true of errors relative to the state."""
        return quantity.component == RELATIVE

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``NAME_max``, ``_rms`` and ``_final`` of every quantity, or the first alone."""
        with working_precision(self.bits):
            metrics: dict[Quantity, Metric] = {}
            for quantity, running in self.quantities().items():
                statistics, largest = running.metrics(quantity), quantity.over("max")
                metrics |= {largest: statistics[largest]} if self.maximum_only(quantity) else statistics
            return by_name(metrics)

    def series(self, time_text: TimeText) -> dict[str, Series]:
        """``NAME`` over the chosen times, without relative errors."""
        return {
            quantity.text: running.series(quantity, time_text)
            for quantity, running in self.quantities().items()
            if quantity.component != RELATIVE
        }

    def content(self) -> dict[str, object]:
        """The state of a checkpoint by component: text and integers, exact."""
        return {quantity.component: running.content() for quantity, running in self.quantities().items()}

    def restore(self, content: dict[str, Any]) -> None:
        """Restore a state saved by :meth:`content`."""
        for quantity, running in self.quantities().items():
            running.restore(content[quantity.component])
