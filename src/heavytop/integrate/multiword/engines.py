"""Which arithmetic serves a format and a tolerance, and its machine code, checked before it is used."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import ceil, factorial
from threading import Lock
from typing import Any

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
from heavytop.precision import DOUBLE, Precision, cache_last_call, decimal_text
from heavytop.top.equations import System

# Machine code takes one known step before it takes any other.


_MOST_ORDERS = 100
_LATER = Fraction(7, 11)


def check(system: System, attitude: bool, begin: Callable[[Scaled], Steps], bits: int, bounded: bool = False) -> None:
    """Compare a step with the exact series of a known motion: coefficients, the new state, a sample inside the step.

    begin: a run of a problem at its start.  bits: of its arithmetic.  bounded: the units it wants.
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
        off = max(abs(a - b) for a, b in zip(run.coefficients(n), row, strict=True))
        _require(off <= largest * Fraction(2) ** (_GUARD_BITS - bits), f"Taylor coefficient {n}", bits)
    tail = 4 * max(map(abs, terms[-1])) + largest * Fraction(2) ** (_GUARD_BITS - bits)
    later = run.time * _LATER
    for computed, part, what in (
        (run.state, Fraction(1), "the new state"),
        (run.sample(later), _LATER, "a state inside the step"),
    ):
        sums = [sum(row[i] * part**n for n, row in enumerate(terms)) for i in range(len(start))]
        fine = computed is not None and max(abs(a - b) for a, b in zip(computed, sums, strict=True)) <= tail
        _require(fine, what, bits)


def _require(fine: bool, what: str, bits: int) -> None:
    if not fine:
        raise Contradiction(
            f"Machine code in {bits} bits gives a wrong value in a step that is known: {what}.",
            "It is damaged: run again; if it stays, this machine or LLVM is faulty.",
        )


LOOSEST = Fraction(1, 10**6)
_SPARE_BITS, _SPARE_BITS_OF_DOUBLE = 6, 17
"""Bits beyond those of a format that double-double exceeds: a long run adds its local errors up, and the sum shall stay
below half an eps, to T = 1000 in extended and to T = 10,000 in double (measured)."""
_GUARD_BITS = 8
_FINEST = Fraction(1, 2 ** (double_double_run.BITS - 1))
"""The tolerance of double-double."""


class Arithmetic(ABC):
    """A way of computing, chosen for a format and a tolerance.

    tolerance: the local error aimed at, relative to the state.
    """

    tolerance: Fraction

    @property
    def flags(self) -> dict[str, str]:
        """Everything that can change bits; they are those of every processor."""
        return self._bits() | {"tolerance": decimal_text(self.tolerance, 6)} | self._steps()

    @abstractmethod
    def _bits(self) -> dict[str, str]:
        """The name of this arithmetic, its words and bits."""

    def _steps(self) -> dict[str, str]:
        """Its order, where that is fixed, and the rule of its steps."""
        return {"step_rule": "powers of two, by the number of orders"}

    @abstractmethod
    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        """A motion at its beginning."""

    @abstractmethod
    def make(self, system: System, attitude: bool) -> float:
        """Compile and check the machine code for this system; gives the seconds of compiling.

        Raises Contradiction where its first step, which is known, is wrong.
        """


@dataclass(frozen=True, slots=True)
class DoubleDouble(Arithmetic):
    """106 bits that float, with plain doubles above an order n0.

    schedule: of one motion.  in_lanes: of eight.
    """

    tolerance: Fraction
    schedule: OrderSchedule
    in_lanes: OrderSchedule

    def _bits(self) -> dict[str, str]:
        return {"arithmetic": "double-double", "words": "2", "bits": str(double_double_run.BITS)}

    def _steps(self) -> dict[str, str]:
        return {
            "order": str(self.schedule.order),
            "step_rule": f"radius of convergence times 2^{self.schedule.reach:.3f}, ten bits",
            "plain_orders": f"where rounding is below 2^{self.schedule.room - 53:.1f}",
        }

    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        return Floating(scaled, self.schedule, forwards)

    def make(self, system: System, attitude: bool) -> float:
        made = double_double_run.machine(system, attitude)
        check(system, attitude, lambda scaled: Floating(scaled, _FULL, True), double_double_run.BITS)
        check(system, attitude, lambda scaled: Floating(scaled, _SPLIT, True), _SPLIT_BITS)
        check(system, attitude, lambda scaled: Floating(scaled, _PLAIN, True, low_order=3), _PLAIN_BITS)
        return made.seconds


_REACH = -2.9
# the same machine code with every order in double-double, and with nearly all in plain doubles
_FULL = OrderSchedule(38, _REACH, -1000.0)
_PLAIN = OrderSchedule(24, _REACH, 1000.0)
_ALLOWED = OrderSchedule(38, _REACH, 1000.0)
# with most orders in split coefficients
_SPLIT, _SPLIT_ALLOWED = OrderSchedule(38, _REACH, -1000.0, -40.0), OrderSchedule(38, _REACH, 1000.0, -40.0)
_SPLIT_BITS = 80
_PLAIN_BITS = 53
_CHECKED_BITS = 128
_STEP_OF_BITS = 64


@dataclass(frozen=True, slots=True)
class Words(Arithmetic):
    """K words on fixed grids."""

    tolerance: Fraction
    grid: Grid

    def _bits(self) -> dict[str, str]:
        return {"arithmetic": "fixed grids", "words": str(self.grid.words), "bits": str(self.grid.total)}

    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        return Fixed(scaled, self.grid, forwards)

    def make(self, system: System, attitude: bool) -> float:
        made = fixed_point_run.machine(self.grid, system, attitude)
        check(system, attitude, lambda scaled: Fixed(scaled, self.grid, True), self.grid.total, bounded=True)
        return made.seconds


@dataclass(frozen=True, slots=True)
class WholeNumbers(Arithmetic):
    """Integers of ``bits`` bits, where there are no words for so many."""

    tolerance: Fraction
    bits: int

    def _bits(self) -> dict[str, str]:
        return {"arithmetic": "integers", "bits": str(self.bits)}

    def begin(self, scaled: Scaled, forwards: bool) -> ResumableRun:
        return IntegerMotion(scaled, self.bits, forwards)

    def make(self, system: System, attitude: bool) -> float:
        check(system, attitude, lambda scaled: IntegerMotion(scaled, _CHECKED_BITS, True), _CHECKED_BITS, bounded=True)
        return 0.0


@lru_cache(maxsize=64)
def wanted_tolerance(precision: Precision, tolerance: Fraction | None) -> Fraction:
    """The local error to aim at, relative to the state.

    Raises InputError for a tolerance outside 1e-6 to the format's own.
    """
    most = _SPARE_BITS_OF_DOUBLE if precision.bits <= DOUBLE.bits else _SPARE_BITS
    finest = precision.eps / 2 ** max(0, min(most, double_double_run.BITS - precision.bits))
    wanted = finest if tolerance is None else tolerance
    if not finest <= wanted <= LOOSEST:
        raise InputError(
            f"The integrator multiword has no tolerance {decimal_text(wanted, 6)} in {precision.name}.",
            f"Give one from its eps, {decimal_text(precision.eps, 3)}, to 1e-6, or none.",
        )
    return wanted


def floats(wanted: Fraction, scaled: Scaled | None = None) -> DoubleDouble | None:
    """Double-double for a tolerance and a start, or for usual starts; None where more bits are needed.

    A motion with very small components is computed as finely as those need it: fewer bits serve the Taylor coefficients
    that are small beside the state, and an unstable axis would amplify what they lose.
    """
    tiny = 0 if scaled is None else fixed_point_run.spread(scaled)
    inner = wanted / 2**tiny if tiny > fixed_point_run.TINY_BITS else wanted
    if inner < _FINEST:
        return None
    return DoubleDouble(wanted, OrderSchedule.of(inner), OrderSchedule.of(inner, FALL_IN_LANES))


@cache_last_call
def choose(problem: Problem, tolerance: Fraction | None) -> tuple[Arithmetic, Scaled]:
    """The arithmetic for a format, or for the tolerance where one is given, and the problem in its units.

    A grid is as fine as the smallest component needs it: what an unstable axis amplifies must be there.

    Raises InputError for a tolerance outside 1e-6 to the format's own.
    """
    wanted = wanted_tolerance(problem.precision, tolerance)
    start = (*problem.start.flat, *(problem.xi or ()))
    scaled = Scaled.of(problem.system, problem.parameters, start)
    if (machine := floats(wanted, scaled)) is not None:
        return machine, scaled
    scaled = Scaled.of(problem.system, problem.parameters, start, bounded=True)
    asked = wanted.denominator.bit_length() - wanted.numerator.bit_length()
    bits = asked + _GUARD_BITS + fixed_point_run.spread(scaled) + fixed_point_run.excess(scaled)
    grid = grid_for(bits)
    if grid is None:
        return WholeNumbers(wanted, -(-bits // _STEP_OF_BITS) * _STEP_OF_BITS), scaled
    return Words(wanted, grid), scaled


def accuracy(arithmetic: Arithmetic, scaled: Scaled) -> int:
    """The bits of a number near 1 that a step gets right.

    What a grid has for the smallest component of the start is not counted: numbers that float have it anyway.
    """
    if isinstance(arithmetic, DoubleDouble):
        return ceil(1 / arithmetic.tolerance).bit_length() - 1
    return int(arithmetic.flags["bits"]) - _GUARD_BITS - fixed_point_run.spread(scaled) - fixed_point_run.excess(scaled)


_made: dict[tuple[Any, ...], float] = {}
_making = Lock()


def _once(key: tuple[Any, ...], make: Callable[[], float]) -> float:
    """The result of ``make`` for this key, called once; other threads that ask wait."""
    with _making:
        if key not in _made:
            _made[key] = make()
        return _made[key]


def compiled(arithmetic: Arithmetic, system: System, attitude: bool) -> float:
    """The seconds that compiling took, once for each arithmetic and system; it is checked then."""
    key = (type(arithmetic), getattr(arithmetic, "grid", None), system.name, attitude)
    return _once(key, lambda: arithmetic.make(system, attitude))


def compiled_lanes(system: System) -> float:
    """The seconds that compiling the code of eight lanes took; it is checked then as :meth:`Arithmetic.make` does."""

    def make() -> float:
        seconds, one = eight_lane_run.machine(system).seconds, eight_lane_run.OneOfEight
        check(system, False, lambda scaled: one(scaled, _ALLOWED, _ALLOWED.order - 1), double_double_run.BITS)
        check(system, False, lambda scaled: one(scaled, _SPLIT_ALLOWED, 30), _SPLIT_BITS)
        check(system, False, lambda scaled: one(scaled, _PLAIN, 3), _PLAIN_BITS)
        return seconds

    return _once((eight_lane_run.Eight, system.name), make)
