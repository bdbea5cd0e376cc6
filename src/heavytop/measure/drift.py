"""Drift of first integrals along a computed motion, in one pass and constant memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.balls import ball, ball_from, ball_text, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scalar import GUARD_BITS, larger, metric, root, text, to_ball
from heavytop.records import Metric, Quantity, Series, by_name
from heavytop.top.equations import Parameters
from heavytop.top.heavy_top import dot
from heavytop.top.integrals import Integral

Sums = tuple[arb, arb, arb]
STATISTICS = ("max", "rms", "final")
DRIFT = "drift"
"""The name of the quantity; its components are the first integrals."""


def drift_of(integral: str) -> Quantity:
    """The drift of the first integral of that name."""
    return Quantity(DRIFT, integral)


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

    def take(self, time: Fraction, sums: Sums, keep: bool) -> None:
        """Take in a value at ``time`` by its :meth:`following`; remember it for the series if ``keep``."""
        self.maximum, self.squares, self.final = sums
        self.count += 1
        self.remember(time, sums, keep)

    def remember(self, time: Fraction, sums: Sums, keep: bool) -> None:
        """Remember a value for the series if ``keep``, and count it for nothing else."""
        if keep:
            self.kept[time] = sums[2]

    def metrics(self, quantity: Quantity) -> dict[Quantity, Metric]:
        """Its ``max``, ``rms`` and ``final``; ``missing`` without a sample."""
        if not self.count:
            return {quantity.over(part): Metric("missing", None) for part in STATISTICS}
        found = (self.maximum, root(self.squares / self.count), self.final)
        return {quantity.over(part): metric(value) for part, value in zip(STATISTICS, found, strict=True)}

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


class Drift:
    """|I(t) − I(0)| of each integral, absolute, from the rounded start; evaluated with 64 guard bits.

    problem: what the integrator was given.  integrals: those that hold for the exact top and start.
    keep: the times whose values go into the series.
    With an attitude riding along, |ξ|² and ξ·γ are watched as well.
    """

    def __init__(self, problem: Problem, integrals: Sequence[Integral], keep: Sequence[Fraction] = ()) -> None:
        self.bits = problem.precision.bits + GUARD_BITS
        self.keep = frozenset(keep)
        self.functions: dict[str, Callable[[Parameters, Any], Any]] = {i.name: i.value for i in integrals}
        if problem.xi is not None:
            self.functions |= {"xi_squared": _xi_squared, "xi_dot_gamma": _xi_dot_gamma}
        self.parameters = parameter_balls(problem, self.bits)
        self.initial = self._values((*problem.start.flat, *(problem.xi or ())))
        self.running = {name: Running() for name in self.functions}

    def __call__(self, time: Fraction, state: Sequence[Any]) -> None:
        """Take in one native state."""
        self.take(time, self.following(state))

    def take(self, time: Fraction, sums: Sequence[Sums]) -> None:
        """Take in one state by its :meth:`following`."""
        keep = bool(self.keep) and time in self.keep  # a Fraction's hash takes as long as an operation on balls
        for running, each in zip(self.running.values(), sums, strict=True):
            running.take(time, each, keep)

    @whole_evaluation
    def _values(self, state: Sequence[Fraction]) -> dict[str, arb]:
        with working_precision(self.bits):
            y = [ball(value) for value in state]
            return {name: value(self.parameters, y) for name, value in self.functions.items()}

    @whole_evaluation
    def following(self, state: Sequence[Any]) -> list[Sums]:
        """What the drifts add up to with this native state; nothing is taken in."""
        with working_precision(self.bits):
            return self.sums([to_ball(value) for value in state])

    def sums(self, y: Sequence[arb]) -> list[Sums]:
        """The same with a state of balls, at a working precision of ``bits``."""
        return [
            self.running[name].following(value(self.parameters, y) - self.initial[name])
            for name, value in self.functions.items()
        ]

    @whole_evaluation
    def metrics(self) -> dict[str, Metric]:
        """``drift_NAME_max``, ``_rms``, ``_final`` for every integral."""
        with working_precision(self.bits):
            return by_name({q: m for each, run in self.quantities().items() for q, m in run.metrics(each).items()})

    def series(self, time_text: Callable[[Fraction], str]) -> dict[str, Series]:
        """``drift_NAME`` over the kept times."""
        return {quantity.text: run.series(quantity, time_text) for quantity, run in self.quantities().items()}

    def quantities(self) -> dict[Quantity, Running]:
        """The running values by what they are of."""
        return {drift_of(name): values for name, values in self.running.items()}

    def content(self) -> dict[str, Any]:
        """What was taken in so far, as plain text and integers, exact."""
        return {name: run.content() for name, run in self.running.items()}

    def restore(self, content: dict[str, Any]) -> None:
        """Go on from that :meth:`content`."""
        for name, run in self.running.items():
            run.restore(content[name])


@whole_evaluation
def parameter_balls(problem: Problem, bits: int) -> Parameters:
    """I, P r and the rotor of a problem as balls of ``bits`` bits."""
    with working_precision(bits):
        return problem.parameters.mapped(ball)


def _xi_squared(_: Parameters, y: Any) -> Any:
    return dot(y[6:9], y[6:9])


def _xi_dot_gamma(_: Parameters, y: Any) -> Any:
    return dot(y[6:9], y[3:6])
