"""heyoka's Taylor integrators, compiled: the only file that builds its engines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from math import comb, exp, factorial, log
from threading import Lock
from time import perf_counter
from typing import Any

import numpy

from heavytop.errors import Contradiction, InputError
from heavytop.extras import import_heyoka
from heavytop.integrate.trajectory import Problem
from heavytop.precision import (
    DOUBLE,
    DOUBLE_DOUBLE,
    OncePerArguments,
    Precision,
    cache_last_call,
    exact,
    number,
    require,
    usable_tolerance,
)
from heavytop.top.equations import HEAVY_GYROSTAT, VARIABLES, Parameters, System

# The known step, which a compiled integrator takes before any other.
#
# Machine code can be damaged in a cache on disk or in memory.  The known step starts from integers for which every
# derivative of the motion is an integer, so that it is known exactly, from the field alone.


# Ω in multiples of I1 I2 I3 and γ in multiples of its square keep every division by a moment whole
PARAMETERS = Parameters((3, 2, 1), (2, -1, 3), 6)
OMEGA = (6, -12, 6)
GAMMA = (36, 72, -36)
XI = (1, 2, -5)
_ROTOR = (6, -12, 18)
_MOST_DERIVATIVES = 100
_COEFFICIENT_EPS, _GROWTH_AN_ORDER = 8, Fraction(5, 4)
"""Rounding of the first coefficient, and its growth: up to 35 eps of the terms of coefficient 20, of 1,500 tops."""
_SUM_EPS = 4
_STEP_ERROR = 1e-12
Exact = int | Fraction


class Jet:
    """A function of time by its exact derivatives at t = 0: a ring in which the fields can be evaluated.

    at: gives the n-th derivative, computed once; n = 0, 1, ... in turn.
    """

    def __init__(self, at: Callable[[int], Exact]) -> None:
        self.at = cache(at)

    def __add__(self, other: Jet | Exact) -> Jet:
        if not isinstance(other, Jet):
            return type(self)(lambda n: self.at(n) + (0 if n else other))
        return type(self)(lambda n: self.at(n) + other.at(n))

    def __sub__(self, other: Jet) -> Jet:
        return type(self)(lambda n: self.at(n) - other.at(n))

    def __mul__(self, other: Jet | Exact) -> Jet:
        if not isinstance(other, Jet):
            return type(self)(lambda n: self.at(n) * other)
        return type(self)(lambda n: sum(comb(n, k) * self.at(k) * other.at(n - k) for k in range(n + 1)))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Exact) -> Jet:
        def at(n: int) -> Exact:
            quotient = Fraction(self.at(n)) / divisor
            return quotient.numerator if quotient.denominator == 1 else quotient

        return type(self)(at)


class _Sizes(Jet):
    """The sums of the absolute values of all terms, to which rounding errors are in proportion where terms cancel."""

    def __abs__(self) -> _Sizes:
        return self

    def __add__(self, other: Any) -> Jet:
        return super().__add__(abs(other))

    __sub__ = __add__

    def __mul__(self, other: Any) -> Jet:
        return super().__mul__(abs(other))

    __rmul__ = __mul__


def known_parameters(system: System) -> Parameters:
    """The parameters of the known step."""
    return PARAMETERS._replace(rotor=_ROTOR) if system is HEAVY_GYROSTAT else PARAMETERS


def derivatives(system: System, attitude: bool, count: int, p: Parameters | None = None) -> Iterator[list[Exact]]:
    """y, y', y'', ... at the known start, from the field: ``count`` lists of six exact numbers, or nine with ξ."""
    values: list[list[Exact]] = [[first] for first in (*OMEGA, *GAMMA, *(XI if attitude else ()))]
    y = [Jet(column.__getitem__) for column in values]
    parameters = p or known_parameters(system)
    rates = system.with_attitude(parameters, y)
    for n in range(count):
        yield [column[n] for column in values]
        following = [rate.at(n) for rate in rates]
        for column, value in zip(values, following, strict=True):
            column.append(value)


def check(engine: Any, system: System, precision: Precision, constants: Parameters | None = None) -> None:
    """Compare the known step of a compiled integrator, scalar or batch, with its exact values; then reset the engine.

    The first 100 Taylor coefficients are compared with the exact ones, to rounding of their terms, the step size with
    Jorba and Zou's rule, the new state and the dense output with the polynomial summed here.  Raises Contradiction.
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
    sizes: list[Any] = [_Sizes([*map(abs, values)].__getitem__) for values in zip(*known, strict=True)]
    terms = system.with_attitude(p, sizes)
    half = number(Fraction(1, 2), precision)
    steps = numpy.reshape(numpy.array(engine.last_h), (-1,))
    dense = engine.update_d_output(engine.last_h * half)
    for lane in range(len(steps)):
        at = (..., lane) if lanes else ...
        coefficients, h = engine.tc[at], steps[lane]
        for n, column in enumerate(known):
            limit = n and _COEFFICIENT_EPS * _GROWTH_AN_ORDER**n * eps * max(term.at(n - 1) for term in terms)
            for computed, value in zip(coefficients[:, n], column, strict=True):
                error = abs(_number(computed) * factorial(n) - value)
                _require(error <= limit, f"Taylor coefficient {n}", precision)
        expected = _length_of_step(coefficients, order)
        _require(abs(float(h) / expected - 1) < max(_STEP_ERROR, 32 * float(eps)), "the length of the step", precision)
        for name, result, time in (("the step", engine.state[at], h), ("the dense output", dense[at], h * half)):
            total = coefficients[:, order]
            for n in reversed(range(order)):
                total = total * time + coefficients[:, n]
            limit = _SUM_EPS * number(eps, precision) * max(abs(value) for value in total)
            _require(all(abs(a - b) <= limit for a, b in zip(result, total, strict=True)), name, precision)
    _reset(engine, precision)


def _reset(engine: Any, precision: Precision) -> None:
    zero = number(Fraction(0), precision)
    engine.state[:] = numpy.full_like(engine.state, zero)
    if engine.state.ndim == 1:
        engine.time = zero
    else:
        engine.set_time(zero)


def _number(value: Any) -> Fraction:
    """The exact value; of a number that is not finite, one that agrees with nothing."""
    return exact(value) if numpy.isfinite(value) else Fraction(10) ** 9999


def _length_of_step(coefficients: Any, order: int) -> float:
    """Jorba and Zou, Exp. Math. 14 (2005) 99: radius from the last two coefficients, over e², with a safety factor."""

    def size(n: int) -> float:
        # no float holds the coefficients of a high order
        value = max(abs(_number(c)) for c in coefficients[:, n])
        return log(value.numerator or 1) - log(value.denominator)

    return exp(min((size(0) - size(n)) / n for n in (order - 1, order)) - 2 - 0.7 / (order - 1))


def _require(agrees: bool, what: str, precision: Precision) -> None:
    if not agrees:
        raise Contradiction(
            f"A compiled integrator for {precision.name} failed its check against a known step: {what} is wrong.",
            "Its machine code is damaged: run again. If the error persists, this machine or heyoka is faulty.",
        )


_XI = ("xi1", "xi2", "xi3")


@dataclass(slots=True)
class Compiled:
    """A compiled integrator of one system and format, reused for every top.

    engine: never run, only copied, so that a copy can be made while others run.  spare: idle copies.
    """

    engine: Any
    seconds: float
    flags: dict[str, str]
    spare: list[Any] = field(default_factory=list)
    copying: Lock = field(default_factory=Lock)

    @contextmanager
    def borrowed(self) -> Iterator[Any]:
        """A copy of the engine for one run, returned at its end, also where it raises.

        A run that starts meanwhile, in another thread or in an observer of this run, has another copy.
        """
        engine = self.take()
        try:
            yield engine
        finally:
            self.spare.append(engine)

    def take(self) -> Any:
        """A copy that the caller returns to ``spare``: :meth:`borrowed` without the cost of a context manager."""
        try:
            return self.spare.pop()
        except IndexError:
            with self.copying:
                return deepcopy(self.engine)


@cache
def not_finite() -> Any:
    """The outcome of a step to a state that is not finite."""
    heyoka = import_heyoka()

    return heyoka.taylor_outcome.err_nf_state


def expressions(system: System, attitude: bool, constants: Parameters | None = None) -> list[tuple[Any, Any]]:
    """The field as heyoka expressions with par[0..2] = I and par[3..5] = P r, or par[3] = λ for the gyrostat; par[6..8]
    = k for the heavy gyrostat.

    constants: doubles in place of par[i].
    """
    heyoka = import_heyoka()

    names = VARIABLES + (_XI if attitude else ())
    y = heyoka.make_vars(*names)
    p = constants or system.taken_in([heyoka.par[i] for i in range(_count(system))])
    return list(zip(y, system.with_attitude(p, y), strict=True))


def compiled(
    system: System,
    precision: Precision,
    *,
    attitude: bool = False,
    tolerance: Fraction | None = None,
    high_accuracy: bool = False,
    compact_mode: bool | None = None,
    lanes: int | None = None,
    constants: Parameters | None = None,
) -> Compiled:
    """The integrator for this system and format, compiled at its first use.

    constants: exact parameters of one top, compiled into the code, in double only (heyoka demotes all constants to it);
    None for code that serves every top.
    lanes: how many motions run at once in SIMD lanes, in double only; None for a scalar integrator, whose bits differ.
    tolerance: None for the format's eps.  compact_mode: None for off in double and extended (faster to run) and on in
    quad and real (else they take minutes to compile).

    Raises Contradiction where the known step is wrong.
    """
    compact = precision.family in ("quad", "real") if compact_mode is None else compact_mode
    return build(system, precision, attitude, tolerance, high_accuracy, compact, lanes, constants)


@OncePerArguments
def build(
    system: System,
    precision: Precision,
    attitude: bool,
    tolerance: Fraction | None,
    high_accuracy: bool,
    compact: bool,
    lanes: int | None,
    constants: Parameters | None,
) -> Compiled:
    """A new integrator, checked; the arguments: as in :func:`compiled`."""
    require(precision)
    if precision == DOUBLE_DOUBLE:
        raise InputError("heyoka does not support double-double.", "Use the integrator multiword for it, or quad.")
    if constants is not None and precision != DOUBLE:
        raise InputError(f"Constants cannot be compiled in for {precision.name}.", "Use double.")
    heyoka = import_heyoka()

    # a cache of machine code on disk is not protected against corruption: a flipped bit gives wrong numbers silently
    heyoka.llvm_state.set_diskcache_enabled(False)
    one, zero = number(Fraction(1), precision), number(Fraction(0), precision)
    options: dict[str, Any] = {"compact_mode": compact, "high_accuracy": high_accuracy}
    if tolerance is not None:
        options["tol"] = number(usable_tolerance(tolerance, precision), precision)
    if precision.family == "real":
        options["prec"] = precision.bits
    make, shape = (heyoka.taylor_adaptive, ()) if lanes is None else (heyoka.taylor_adaptive_batch, (lanes,))
    if constants is None:
        options["pars"] = numpy.full((_count(system), *shape), one)
    field, start = expressions(system, attitude, constants and constants.mapped(float)), (9 if attitude else 6, *shape)
    began = perf_counter()
    engine = make(field, numpy.full(start, zero), fp_type=type(one), **options)
    seconds = perf_counter() - began
    check(engine, system, precision, constants)
    return Compiled(engine, seconds, _flags(engine))


def _count(system: System) -> int:
    """The number of parameters that enter the field."""
    return len(system.entering(Parameters((1, 1, 1), (0, 0, 0), (0, 0, 0) if system is HEAVY_GYROSTAT else 0)))


def _flags(engine: Any) -> dict[str, str]:
    """All that can change bits."""
    code = engine.llvm_state
    values = {
        "tolerance": engine.tol,
        "order": engine.order,
        "compact_mode": engine.compact_mode,
        "high_accuracy": engine.high_accuracy,
        "opt_level": code.opt_level,
        "fast_math": code.fast_math,
        "force_avx512": code.force_avx512,
        "slp_vectorize": code.slp_vectorize,
        "code_cache": "none",
        "coefficients": "par" if len(engine.pars) else "constants",
    }
    if hasattr(engine, "batch_size"):
        values["batch_size"] = engine.batch_size
    return {name: str(value).lower() for name, value in values.items()}


def load(engine: Any, problem: Problem) -> None:
    """Set an engine to the beginning of a problem."""
    parameters, engine.state[:] = arrays(problem)
    if len(engine.pars):
        engine.pars[:] = parameters
    engine.time = 0.0 if problem.precision == DOUBLE else number(Fraction(0), problem.precision)


@cache_last_call
def arrays(problem: Problem) -> tuple[Any, Any]:
    """The parameters and the initial state of an engine, as native arrays."""
    p = problem.parameters
    numbers = list(problem.system.entering(p))
    start = [*problem.start.flat, *(problem.xi or ())]
    columns = numpy.array(problem.native(numbers)), numpy.array(problem.native(start))
    for array in columns:
        array.setflags(write=False)  # cached, and shared
    return columns
