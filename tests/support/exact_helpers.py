"""What tests of exact motions share: the residual of the equations, and random rationals."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, log2
from random import Random

from flint import arb

from heavytop.exact.flint.balls import ball, working_precision


def residual(solution, time: Fraction, digits: int = 60) -> list[arb]:
    """y' − f(y) at ``time``, six balls, from the motion's own power series: no differences are taken."""
    bits = ceil(digits * log2(10)) + 32
    series = solution.series(time, 2, bits)
    parameters = getattr(solution, "parameters", None)
    if parameters is None:
        parameters = solution.system.parameters(solution.top, solution.start)
    with working_precision(bits + 64, 2):
        rates = solution.system.field(in_balls(parameters), series)
        return [y[1] - rate[0] for y, rate in zip(series, rates, strict=True)]


def in_balls(parameters):
    """The parameters of a field as balls at the working precision."""

    def of(values):
        return [ball(Fraction(value)) for value in values]

    return parameters._replace(
        inertia=of(parameters.inertia), moment=of(parameters.moment), rotor=ball(Fraction(parameters.rotor))
    )


def random_fractions(rng: Random, count: int, low: int = -20, high: int = 20) -> tuple[Fraction, ...]:
    """``count`` rationals n/d, low ≤ n ≤ high and 7 ≤ d ≤ 13; 0 may be among them."""
    return tuple(Fraction(rng.randint(low, high), rng.randint(7, 13)) for _ in range(count))
