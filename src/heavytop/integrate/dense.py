"""The Taylor polynomial of every step of an integrator, as polynomials over the rational numbers.

Coefficients are rounded to fixed-point numbers, to 2^-64 eps of the largest in their component: far below the error
of the integrator, and short enough that a step costs some 0.1 ms.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from time import perf_counter
from typing import Any

import numpy
from flint import fmpq, fmpq_poly, fmpz_poly
from numpy.typing import NDArray

from heavytop.errors import InputError, OutOfReach, Unsupported
from heavytop.integrate.heyoka.engines import compiled as compile_heyoka
from heavytop.integrate.heyoka.engines import load
from heavytop.integrate.heyoka.motions import Stepper, in_unit, unit_of
from heavytop.integrate.multiword.engines import choose
from heavytop.integrate.multiword.engines import compiled as compile_words
from heavytop.integrate.multiword.motions import OUTCOMES
from heavytop.integrate.peers.contract import said
from heavytop.integrate.registry import expected_steps, name_of
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.multiword.double_double.double_double_run import Floating
from heavytop.multiword.problem import ResumableRun, Scaled, Status
from heavytop.precision import DOUBLE, exact, number, rounded, six_digits

_SPARE_BITS = 64
MOST_STEPS = 10**8
"""Each takes some 0.1 ms in double: these take hours."""

Dyadic = tuple[int, int]
"""m and e of the number m 2^e."""


def dyadic(value: Any) -> Dyadic:
    """A binary number as m 2^e."""
    number = exact(value)
    return number.numerator, 1 - number.denominator.bit_length()


def _of_row(rows: NDArray[numpy.float64], index: int) -> list[Dyadic]:
    """Numbers of a format as m 2^e each."""
    values = rows[index]

    if values.dtype == numpy.float64:
        mantissas, exponents = numpy.frexp(values)
        return list(
            zip(numpy.ldexp(mantissas, 53).astype(numpy.int64).tolist(), (exponents - 53).tolist(), strict=True)
        )
    return [dyadic(value) for value in values]


class Piece:
    """A step: the motion at ``began`` + s ``length`` for 0 ≤ s ≤ 1 (and ``end`` of the last one) as polynomials in s.

    began, length: exact; a step back in time has a negative length.
    coefficients: returns the c_n of one component, which is Σ c_n (s length)^n, or Σ c_n s^n without ``powers``.
    doubles: the c_n of all components, shape (6, order + 1), where they are doubles; else None.
    """

    __slots__ = ("_bits", "_coefficients", "_found", "_powers", "began", "doubles", "end", "length")

    def __init__(
        self,
        began: Fraction,
        length: Fraction,
        bits: int,
        coefficients: Callable[[int], Sequence[Dyadic]],
        powers: bool = True,
        doubles: Any = None,
    ) -> None:
        self.began, self.length, self.end, self.doubles = began, length, fmpq(1), doubles
        self._bits, self._coefficients = bits + _SPARE_BITS, coefficients
        self._found: dict[int, fmpq_poly] = {}
        self._powers: list[Dyadic] | None = None if powers else []

    def component(self, index: int) -> fmpq_poly:
        """One component of (Ω, γ) as a polynomial in s."""
        if index not in self._found:
            values = list(self._coefficients(index))
            if self._powers is None:
                self._powers = self._powers_of_length(len(values))
            if self._powers:
                values = [(m * k, e + f) for (m, e), (k, f) in zip(values, self._powers, strict=True)]
            self._found[index] = _fixed_point(values, self._bits)
        return self._found[index]

    def boxes(self) -> tuple[list[float], list[float]] | None:
        """(midpoints, radii) of intervals that contain the components over the step, up to rounding; or None."""
        if self.doubles is None:
            return None
        sizes = abs(float(self.length)) ** numpy.arange(self.doubles.shape[1])
        sizes[0] = 0.0
        return self.doubles[:, 0].tolist(), (abs(self.doubles) @ sizes).tolist()

    def _powers_of_length(self, count: int) -> list[Dyadic]:
        """length^n for 0 ≤ n < count, cut to the bits of the coefficients."""
        m, e = dyadic(self.length)
        powers = [(1, 0)]
        for _ in range(count - 1):
            k, f = powers[-1][0] * m, powers[-1][1] + e
            excess = max(0, k.bit_length() - self._bits)
            powers.append((k >> excess, f + excess))
        return powers

    def state(self, s: fmpq) -> list[Fraction]:
        """(Ω, γ) at s, the exact values of the polynomials."""
        values = (self.component(index)(s) for index in range(6))
        return [Fraction(int(value.p), int(value.q)) for value in values]

    def time(self, s: fmpq) -> Fraction:
        """The time at s."""
        return self.began + self.length * Fraction(int(s.p), int(s.q))

    def cut(self, time: Fraction) -> None:
        """Let the step end at ``time``, inside it."""
        part = (time - self.began) / self.length
        self.end = fmpq(part.numerator, part.denominator)


def _fixed_point(values: Sequence[Dyadic], bits: int) -> fmpq_poly:
    """A polynomial with these coefficients, each within 2^-bits of the largest."""
    top = max((m.bit_length() + e for m, e in values if m), default=0)
    shift = bits - top
    integers = [m << (e + shift) if e + shift >= 0 else m >> -(e + shift) for m, e in values]
    polynomial = fmpq_poly(fmpz_poly(integers))
    return polynomial / (1 << shift) if shift >= 0 else polynomial * (1 << -shift)


@dataclass(slots=True)
class Dense:
    """A run from t = 0, step by step.

    steps_of: yields the steps of the run without end, and sets its outcome, counts, flags and seconds.
    until: exact, a number of the format.  outcome, steps, reached, order, seconds, flags: as of a
    :class:`heavytop.integrate.trajectory.Trajectory`, once :meth:`pieces` is at its end.
    """

    steps_of: Callable[[Dense], Iterator[Piece]]
    problem: Problem
    until: Fraction
    tolerance: Fraction | None = None
    step_limit: int | None = None
    outcome: Outcome = Outcome.SUCCESS
    steps: int = 0
    order: int = 0
    reached: Fraction = Fraction(0)
    seconds: dict[str, float] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)

    def pieces(self) -> Iterator[Piece]:
        """The steps, the last one cut at ``until``; none at an equilibrium."""
        began = perf_counter()
        try:
            for piece in self.steps_of(self):
                ends = piece.began + piece.length
                self.reached = ends
                if abs(ends) >= abs(self.until):
                    piece.cut(self.until)
                    self.reached = self.until
                    yield piece
                    return
                yield piece
            if self.outcome is Outcome.SUCCESS:
                self.reached = self.until
        finally:
            self.seconds["run"] = perf_counter() - began

    def stopped(self) -> bool:
        """Whether the steps so far are all that may be taken."""
        if self.step_limit is None or self.steps < self.step_limit:
            return False
        self.outcome = Outcome.STEP_LIMIT
        return True


def _of_heyoka(run: Dense) -> Iterator[Piece]:
    problem, bits = run.problem, run.problem.precision.bits
    carried = problem.xi is not None
    tool = compile_heyoka(problem.system, problem.precision, attitude=carried, tolerance=run.tolerance)
    run.flags, run.seconds["compile"] = tool.flags, tool.seconds
    unit = unit_of(problem)
    with tool.borrowed() as engine:
        load(engine, problem if unit == 1 else in_unit(problem, unit))
        run.order = engine.order
        stepper = Stepper(engine, run.until > 0, None, None)
        while not run.stopped():
            began = sum(map(exact, engine.dtime), Fraction(0)) / unit
            run.outcome = stepper.single()
            if run.outcome is not Outcome.SUCCESS or stepper.rest is not None:
                return
            run.steps += 1
            rows = stepper.polynomial()
            doubles = rows if problem.precision == DOUBLE and unit == 1 else None
            read = partial(_of_row, rows) if unit == 1 else partial(_in_time, rows, unit)
            yield Piece(began, exact(engine.last_h) / unit, bits, read, doubles=doubles)


def _in_time(rows: NDArray[numpy.float64], unit: Fraction, index: int) -> list[Dyadic]:
    """The row of coefficients of t^n, of those of (``unit`` t)^n; that of Ω too is in units of 1/t."""
    return [dyadic(exact(value) * unit ** (n + (index < 3))) for n, value in enumerate(rows[index])]


def _of_multiword(run: Dense) -> Iterator[Piece]:
    problem, bits = run.problem, run.problem.precision.bits
    arithmetic, scaled = choose(problem, run.tolerance)
    run.seconds["compile"] = compile_words(arithmetic, problem.system, problem.xi is not None)
    run.flags = arithmetic.flags
    if scaled.rest:
        return
    steps = arithmetic.begin(scaled, run.until > 0)
    unit, goal = (1 if steps.forwards else -1) / scaled.rate, abs(run.until) * scaled.rate
    while not run.stopped():
        began = steps.time
        status = steps.advance(goal, 1)
        run.steps, run.order = steps.steps, steps.order
        if status is not Status.OK:
            run.outcome = OUTCOMES[status]
            return
        # double-double gives y_n, the others y_n h^n
        powers = isinstance(steps, Floating)
        read = _reader(steps, scaled, scaled.rate if powers else Fraction(1))
        yield Piece(began * unit, (steps.time - began) * unit, bits, read, powers)


def _reader(run: ResumableRun, scaled: Scaled, rate: Fraction) -> Callable[[int], Sequence[Dyadic]]:
    """Coefficients of the last step in the units of the problem; the nth counts rate^n."""
    give = run.derivatives if isinstance(run, Floating) else run.coefficients
    rows = [give(n) for n in range(run.order + 1)]
    return lambda index: [dyadic(row[index] * scaled.sizes[index] * rate**n) for n, row in enumerate(rows)]


_DENSE = {"heyoka": _of_heyoka, "multiword": _of_multiword}
"""The integrators that expose the polynomial of a step, by name."""


def dense(
    integrator: Any, problem: Problem, until: Fraction, tolerance: Fraction | None, step_limit: int | None
) -> Dense:
    """A run of that integrator; raises Unsupported for one that hands over no polynomial of its steps."""
    steps_of = _DENSE.get(integrator) if isinstance(integrator, str) else None
    if steps_of is None:
        name = said(name_of(integrator))
        raise Unsupported(
            f"The integrator {name} has no dense output, which events and states between samples need.",
            f"Use {' or '.join(_DENSE)}.",
        )
    end = rounded(until, problem.precision)
    steps = expected_steps(problem, end)
    if steps > MOST_STEPS and not (step_limit is not None and step_limit <= MOST_STEPS):
        raise OutOfReach(
            f"A run to t = {six_digits(end)} takes about {steps:.0e} steps, too many for dense output.",
            f"At most {MOST_STEPS:.0e} are supported: give an earlier time, or a step limit.",
        )
    return Dense(steps_of, problem, end, tolerance, step_limit)


@dataclass(frozen=True)
class DenseOutput:
    """(Ω, γ) of a finished run as a function of the time; InputError outside of the run.

    make: the run up to its last time, whose steps are repeated at the first call and kept, but neither pickled nor
    copied.  axes: from numbers of the format in principal axes to those that are returned.
    """

    make: Callable[[], Dense]
    axes: Callable[[list[Any]], Sequence[Any]]

    @cached_property
    def _steps(self) -> tuple[Dense, list[Piece]]:
        run = self.make()
        return run, [*run.pieces()]

    def __reduce__(self) -> tuple[Any, ...]:
        return DenseOutput, (self.make, self.axes)

    def __call__(self, time: Fraction) -> Sequence[Any]:
        run, pieces = self._steps
        sign, end = (1 if run.until > 0 else -1), run.reached
        if not 0 <= sign * time <= abs(end):
            raise InputError(f"t = {six_digits(time)} is outside the run.", f"Give a time from 0 to {six_digits(end)}.")
        problem = run.problem
        if not time or not pieces:
            return self.axes([*problem.native(problem.start.flat)])
        piece = pieces[max(0, bisect_left(pieces, sign * time, key=lambda piece: sign * piece.began) - 1)]
        part = (time - piece.began) / piece.length
        state = piece.state(fmpq(part.numerator, part.denominator))
        return self.axes([number(value, problem.precision) for value in state])
