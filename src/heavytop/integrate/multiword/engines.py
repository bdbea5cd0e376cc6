"""The arithmetic for a format and a tolerance, and its machine code, checked before it is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import ceil, factorial

from heavytop.errors import Contradiction, InputError
from heavytop.integrate.heyoka.engines import GAMMA, OMEGA, XI, derivatives, known_parameters
from heavytop.integrate.trajectory import Problem
from heavytop.multiword.double_double import double_double_run, eight_lane_run
from heavytop.multiword.double_double.double_double_run import FALL_IN_LANES, Floating, OrderSchedule
from heavytop.multiword.fixed_point import fixed_point_run
from heavytop.multiword.fixed_point.arithmetic import Grid, grid_for
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.integers.integer_series import IntegerMotion
from heavytop.multiword.problem import ResumableRun, Scaled, Status, Steps
from heavytop.precision import DOUBLE, OncePerArguments, Precision, cache_last_call, decimal_text
from heavytop.top.equations import System

# A step that is known, which machine code takes before any other.


_MOST_ORDERS = 100
_LATER = Fraction(7, 11)


def check(system: System, attitude: bool, begin: Callable[[Scaled], Steps], bits: int, bounded: bool = False) -> None:
    """Compare a step with the exact series of a known motion: coefficients, the new state, a sample inside the step.

    begin: makes a run of a problem.  bits: of its arithmetic.  bounded: the units of that, as :meth:`Scaled.of`.
    Raises Contradiction.
    """
    parameters = known_parameters(system).mapped(Fraction)
    start = tuple(map(Fraction, (*OMEGA, *GAMMA, *(XI if attitude else ()))))
    scaled = Scaled.of(system, parameters, start, bounded)
    run = begin(scaled)
    _require(run.advance(Fraction(1, 2**40), 1) is Status.OK, "the outcome of a step", bits)
    exact = list(derivatives(system, attitude, min(run.order, _MOST_ORDERS) + 1, parameters))
    step, largest = run.time / scaled.rate, max(map(abs, scaled.state))
    terms = [
        [Fraction(value) * step**n / (factorial(n) * size) for value, size in zip(row, scaled.sizes, strict=True)]
        for n, row in enumerate(exact)
    ]
    for n, row in enumerate(terms):
        error = max(abs(a - b) for a, b in zip(run.coefficients(n), row, strict=True))
        _require(error <= largest * Fraction(2) ** (_GUARD_BITS - bits), f"Taylor coefficient {n}", bits)
    tail = 4 * max(map(abs, terms[-1])) + largest * Fraction(2) ** (_GUARD_BITS - bits)
    later = run.time * _LATER
    for computed, part, what in (
        (run.state, Fraction(1), "the new state"),
        (run.sample(later), _LATER, "a state inside the step"),
    ):
        sums = [sum(row[i] * part**n for n, row in enumerate(terms)) for i in range(len(start))]
        agrees = computed is not None and max(abs(a - b) for a, b in zip(computed, sums, strict=True)) <= tail
        _require(agrees, what, bits)


def _require(agrees: bool, what: str, bits: int) -> None:
    if not agrees:
        raise Contradiction(
            f"Machine code in {bits} bits failed its check against a known step: {what} is wrong.",
            "It is damaged: run again. If the error persists, this machine or LLVM is faulty.",
        )


LOOSEST = Fraction(1, 10**6)
_SPARE_BITS, _SPARE_BITS_OF_DOUBLE = 6, 17
"""Bits beyond those of a format narrower than double-double: the sum of the local errors of a long run stays below
half an eps, to T = 1000 in extended and to T = 10,000 in double (measured)."""
_GUARD_BITS = 8
_FINEST = Fraction(1, 2 ** (double_double_run.BITS - 1))
"""The tolerance of double-double."""


_STEP_RULE = {"step_rule": "powers of two, by the number of orders"}


@dataclass(frozen=True, slots=True)
class DoubleDouble:
    """106 bits in floating point, with plain doubles above an order n0.

    tolerance: of each arithmetic, the local error aimed at, relative to the state.  schedule: of one motion.  in_lanes:
    of eight.
    """

    tolerance: Fraction
    schedule: OrderSchedule
    in_lanes: OrderSchedule

    @property
    def flags(self) -> dict[str, str]:
        """All that can change bits; the same on every processor."""
        return {
            "arithmetic": "double-double",
            "words": "2",
            "bits": str(double_double_run.BITS),
            "tolerance": decimal_text(self.tolerance, 6),
            "order": str(self.schedule.order),
            "step_rule": f"radius of convergence times 2^{self.schedule.reach:.3f}, ten bits",
            "plain_orders": f"where rounding is below 2^{self.schedule.room - 53:.1f}",
        }

    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        """A motion at its beginning."""
        return Floating(scaled, self.schedule, forwards)


@dataclass(frozen=True, slots=True)
class FixedPoint:
    """Fixed point: K words on a grid or, beyond the largest, where ``grid`` is None, integers of ``bits`` bits."""

    tolerance: Fraction
    bits: int
    grid: Grid | None = None

    @property
    def flags(self) -> dict[str, str]:
        """All that can change bits; the same on every processor."""
        kind = {"arithmetic": "fixed grids", "words": str(self.grid.words)} if self.grid else {"arithmetic": "integers"}
        return kind | {"bits": str(self.bits), "tolerance": decimal_text(self.tolerance, 6)} | _STEP_RULE

    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        """A motion at its beginning."""
        if self.grid is None:
            return IntegerMotion(scaled, self.bits, forwards)
        return Fixed(scaled, self.grid, forwards)


Arithmetic = DoubleDouble | FixedPoint
_STEP_OF_BITS = 64


@lru_cache(maxsize=64)
def wanted_tolerance(precision: Precision, tolerance: Fraction | None) -> Fraction:
    """The local error to aim at, relative to the state.

    Raises InputError for a tolerance outside 1e-6 to the format's own.
    """
    spare = _SPARE_BITS_OF_DOUBLE if precision.bits <= DOUBLE.bits else _SPARE_BITS
    finest = precision.eps / 2 ** max(0, min(spare, double_double_run.BITS - precision.bits))
    wanted = finest if tolerance is None else tolerance
    if not finest <= wanted <= LOOSEST:
        raise InputError(
            f"The tolerance of multiword must be from eps to 1e-6; got {decimal_text(wanted, 6)} in {precision.name}.",
            f"Give one from {decimal_text(precision.eps, 3)} to 1e-6, or none.",
        )
    return wanted


def floats(wanted: Fraction, scaled: Scaled | None = None) -> DoubleDouble | None:
    """Double-double for a tolerance and a start, or for usual starts; None where more bits are needed.

    Very small components of the state need more bits: the schedule computes Taylor coefficients that are small beside
    the state in fewer, and an unstable axis would amplify their rounding errors.
    """
    tiny = 0 if scaled is None else fixed_point_run.spread(scaled)
    inner = wanted / 2**tiny if tiny > fixed_point_run.TINY_BITS else wanted
    if inner < _FINEST:
        return None
    return DoubleDouble(wanted, OrderSchedule.of(inner), OrderSchedule.of(inner, FALL_IN_LANES))


@cache_last_call
def choose(problem: Problem, tolerance: Fraction | None) -> tuple[Arithmetic, Scaled]:
    """The arithmetic for a format, or for the tolerance where one is given, and the problem in its units.

    A grid resolves the smallest component, which an unstable axis may amplify.

    Raises InputError for a tolerance outside 1e-6 to the format's own.
    """
    wanted = wanted_tolerance(problem.precision, tolerance)
    start = (*problem.start.flat, *(problem.xi or ()))
    scaled = Scaled.of(problem.system, problem.parameters, start).in_invariant_plane()
    if (double_double := floats(wanted, scaled)) is not None:
        return double_double, scaled
    scaled = Scaled.of(problem.system, problem.parameters, start, bounded=True).in_invariant_plane()
    accuracy_bits = wanted.denominator.bit_length() - wanted.numerator.bit_length()
    bits = accuracy_bits + _GUARD_BITS + fixed_point_run.spread(scaled) + fixed_point_run.excess(scaled)
    grid = grid_for(bits)
    return FixedPoint(wanted, grid.total if grid else -(-bits // _STEP_OF_BITS) * _STEP_OF_BITS, grid), scaled


def accuracy(arithmetic: Arithmetic, scaled: Scaled) -> int:
    """The correct bits of a number near 1 after a step.

    The bits of a grid for the smallest component of the start are not counted: floating point has them anyway.
    """
    if isinstance(arithmetic, DoubleDouble):
        return ceil(1 / arithmetic.tolerance).bit_length() - 1
    return arithmetic.bits - _GUARD_BITS - fixed_point_run.spread(scaled) - fixed_point_run.excess(scaled)


# Compiled once, and checked before the first use.


_REACH = -2.9
_SPLIT_BITS = 80
_PLAIN_BITS = 53
_CHECKED_BITS = 128
# every order in double-double, most orders in split coefficients, and nearly all in plain doubles
_FULL, _FULL_IN_LANES = OrderSchedule(38, _REACH, -1000.0), OrderSchedule(38, _REACH, 1000.0)
_SPLIT, _SPLIT_IN_LANES = OrderSchedule(38, _REACH, -1000.0, -40.0), OrderSchedule(38, _REACH, 1000.0, -40.0)
_PLAIN = OrderSchedule(24, _REACH, 1000.0)


def compiled(arithmetic: Arithmetic, system: System, attitude: bool) -> float:
    """The seconds of compiling the machine code for this system at its first use.

    Raises Contradiction where its first step, which is known, is wrong.
    """
    if isinstance(arithmetic, DoubleDouble):
        return _double_double(system, attitude)
    return _fixed_point(arithmetic.grid, system, attitude)


@OncePerArguments
def _double_double(system: System, attitude: bool) -> float:
    seconds = double_double_run.machine(system, attitude).seconds
    check(system, attitude, lambda scaled: Floating(scaled, _FULL, True), double_double_run.BITS)
    check(system, attitude, lambda scaled: Floating(scaled, _SPLIT, True), _SPLIT_BITS)
    check(system, attitude, lambda scaled: Floating(scaled, _PLAIN, True, low_order=3), _PLAIN_BITS)
    return seconds


@OncePerArguments
def _fixed_point(grid: Grid | None, system: System, attitude: bool) -> float:
    seconds = fixed_point_run.machine(grid, system, attitude).seconds if grid else 0.0
    numbers = FixedPoint(_FINEST, grid.total if grid else _CHECKED_BITS, grid)
    check(system, attitude, lambda scaled: numbers.begin(scaled, True), numbers.bits, bounded=True)
    return seconds


@OncePerArguments
def compiled_lanes(system: System) -> float:
    """The seconds of compiling the code of eight lanes at its first use; raises Contradiction as :func:`compiled`."""
    seconds, lane = eight_lane_run.machine(system).seconds, eight_lane_run.OneOfEight
    check(system, False, lambda scaled: lane(scaled, _FULL_IN_LANES, _FULL_IN_LANES.order - 1), double_double_run.BITS)
    check(system, False, lambda scaled: lane(scaled, _SPLIT_IN_LANES, 30), _SPLIT_BITS)
    check(system, False, lambda scaled: lane(scaled, _PLAIN, 3), _PLAIN_BITS)
    return seconds
