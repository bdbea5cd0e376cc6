"""A compiled integrator takes one step that is known before it takes any other.

Machine code can be damaged on its way: in a cache on disk, in memory.  The known step starts from integers for which
every derivative of the motion is an integer again, so that it is known exactly, from the field alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import comb, exp, factorial, log
from typing import Any

import numpy

from heavytop.errors import Contradiction
from heavytop.precision import Precision, exact, number
from heavytop.top.equations import HEAVY_GYROSTAT, Parameters, System

# Ω in multiples of I1 I2 I3 and γ in multiples of its square keep every division by a moment whole
PARAMETERS = Parameters((3, 2, 1), (2, -1, 3), 6)
OMEGA = (6, -12, 6)
GAMMA = (36, 72, -36)
XI = (1, 2, -5)
_ROTOR = (6, -12, 18)
_MOST_DERIVATIVES = 100
_COEFFICIENT_EPS = 8
_COEFFICIENT_EPS_AN_ORDER = Fraction(1, 4)
_SUM_EPS = 4
_STEP_ERROR = 1e-12
Exact = int | Fraction


class Derivatives:
    """A quantity by its derivatives at t = 0, exact: a ring in which the fields can be evaluated.

    at: the n-th derivative, for n in turn.
    """

    def __init__(self, at: Callable[[int], Exact]) -> None:
        self.at = at

    def __add__(self, other: Derivatives | Exact) -> Derivatives:
        if not isinstance(other, Derivatives):
            return Derivatives(lambda n: self.at(n) + (0 if n else other))
        return Derivatives(lambda n: self.at(n) + other.at(n))

    def __sub__(self, other: Derivatives) -> Derivatives:
        return Derivatives(lambda n: self.at(n) - other.at(n))

    def __mul__(self, other: Derivatives | Exact) -> Derivatives:
        if not isinstance(other, Derivatives):
            return Derivatives(lambda n: self.at(n) * other)
        return Derivatives(lambda n: sum(comb(n, k) * self.at(k) * other.at(n - k) for k in range(n + 1)))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Exact) -> Derivatives:
        def at(n: int) -> Exact:
            quotient = Fraction(self.at(n)) / divisor
            return quotient.numerator if quotient.denominator == 1 else quotient

        return Derivatives(at)


def known_parameters(system: System) -> Parameters:
    """Those of the known step."""
    return PARAMETERS._replace(rotor=_ROTOR) if system is HEAVY_GYROSTAT else PARAMETERS


def derivatives(system: System, attitude: bool, count: int, p: Parameters | None = None) -> Iterator[list[Exact]]:
    """y, y', y'', ... at the known start, from the field: ``count`` lists of six exact numbers, or nine with ξ."""
    values: list[list[Exact]] = [[first] for first in (*OMEGA, *GAMMA, *(XI if attitude else ()))]
    y = [Derivatives(column.__getitem__) for column in values]
    given = p or known_parameters(system)
    rates = system.field(given, y[:6])
    if attitude:
        rates = (*rates, *system.attitude(given, y[:6], y[6:]))
    for n in range(count):
        yield [column[n] for column in values]
        following = [rate.at(n) for rate in rates]
        for column, value in zip(values, following, strict=True):
            column.append(value)


def check(engine: Any, system: System, precision: Precision, constants: Parameters | None = None) -> None:
    """One step of a compiled integrator, scalar or batch, compared with what is known; its time and state are reset.

    Taylor coefficients (the first 100) against the exact ones; the length of the step against Jorba and Zou's rule;
    the new state and the dense output against the polynomial summed here.  Raises Contradiction.
    constants: exact parameters that were compiled in; None where the engine takes any.
    """
    p = constants or known_parameters(system)
    lanes = engine.state.shape[1:]
    size = engine.state.shape[0]

    def set_to(values: Any, target: Any) -> None:
        for index, value in enumerate(values):
            target[index] = number(Fraction(value), precision)

    _reset(engine, precision)
    if constants is None:
        set_to(system.entering(p), engine.pars)
    set_to((*OMEGA, *GAMMA, *XI)[:size], engine.state)
    engine.step(write_tc=True)
    eps, order = precision.eps, engine.order
    known = list(derivatives(system, size == 9, min(order + 1, _MOST_DERIVATIVES), p))
    half = number(Fraction(1, 2), precision)
    steps = numpy.reshape(numpy.array(engine.last_h), (-1,))
    dense = engine.update_d_output(engine.last_h * half)
    for lane in range(len(steps)):
        at = (..., lane) if lanes else ...
        coefficients, h = engine.tc[at], steps[lane]
        for n, column in enumerate(known):
            limit = (
                (_COEFFICIENT_EPS + n * _COEFFICIENT_EPS_AN_ORDER) * eps * max(abs(Fraction(value)) for value in column)
            )
            for computed, value in zip(coefficients[:, n], column, strict=True):
                off = abs(_number(computed) * factorial(n) - value)
                _require(off <= limit, f"Taylor coefficient {n}", precision)
        expected = _length_of_step(coefficients, order)
        _require(abs(float(h) / expected - 1) < max(_STEP_ERROR, 32 * float(eps)), "the length of the step", precision)
        for what, result, time in (("the step", engine.state[at], h), ("the dense output", dense[at], h * half)):
            total = coefficients[:, order]
            for n in reversed(range(order)):
                total = total * time + coefficients[:, n]
            limit = _SUM_EPS * number(eps, precision) * max(abs(value) for value in total)
            _require(all(abs(a - b) <= limit for a, b in zip(result, total, strict=True)), what, precision)
    _reset(engine, precision)


def _reset(engine: Any, precision: Precision) -> None:
    zero = number(Fraction(0), precision)
    engine.state[:] = numpy.full_like(engine.state, zero)
    if engine.state.ndim == 1:
        engine.time = zero
    else:
        engine.set_time(zero)


def _number(value: Any) -> Fraction:
    """Exact; what is not finite as a number that is wrong everywhere."""
    return exact(value) if numpy.isfinite(value) else Fraction(10) ** 9999


def _length_of_step(coefficients: Any, order: int) -> float:
    """Jorba and Zou, Exp. Math. 14 (2005) 99: radius from the last two coefficients, over e², with a safety factor."""

    def size(n: int) -> float:
        # no float holds the coefficients of a high order
        value = max(abs(_number(c)) for c in coefficients[:, n])
        return log(value.numerator or 1) - log(value.denominator)

    return exp(min((size(0) - size(n)) / n for n in (order - 1, order)) - 2 - 0.7 / (order - 1))


def _require(fine: bool, what: str, precision: Precision) -> None:
    if not fine:
        raise Contradiction(
            f"A compiled integrator for {precision.name} gives a wrong value in a step that is known: {what}.",
            "Its machine code is damaged: run again; if it stays, this machine or heyoka is faulty.",
        )
