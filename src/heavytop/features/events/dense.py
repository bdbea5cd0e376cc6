"""The Taylor polynomial of every step of an integrator, as polynomials over the rational numbers.

Coefficients are rounded to fixed-point numbers 2^-64 below the format's eps of the largest in their component: far
below what the integrator itself errs, and short enough that a step costs some 0.1 ms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from itertools import pairwise
from time import perf_counter
from typing import TYPE_CHECKING, Any

from flint import fmpq, fmpq_poly, fmpz, fmpz_poly

from heavytop.errors import OutOfReach, Unsupported
from heavytop.integrate.heyoka.engines import compiled as compile_heyoka
from heavytop.integrate.heyoka.engines import load
from heavytop.integrate.heyoka.motions import Stepper
from heavytop.integrate.multiword.engines import choose
from heavytop.integrate.multiword.engines import compiled as compile_words
from heavytop.integrate.multiword.motions import OUTCOMES
from heavytop.integrate.peers.contract import said
from heavytop.integrate.registry import expected_steps, name_of
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.multiword.double_double.double_double_run import Floating
from heavytop.multiword.problem import ResumableRun, Scaled, Status
from heavytop.precision import DOUBLE, decimal_text, exact, number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SPARE_BITS = 64
MOST_STEPS = 10**8
"""Each is looked at, in some 0.1 ms in double: these take hours."""

Dyadic = tuple[int, int]
"""m and e of the number m 2^e."""


def dyadic(value: Any) -> Dyadic:
    """A binary number as m 2^e."""
    number = exact(value)
    return number.numerator, 1 - number.denominator.bit_length()


def _of_row(rows: NDArray[np.float64], index: int) -> list[Dyadic]:
    """Numbers of a format as m 2^e each."""
    import numpy

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
    coefficients: gives the numbers c_n of one component, which is Σ c_n (s length)^n, or Σ c_n s^n without ``powers``.
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
        """(middles, half widths) of intervals that hold the components over the step, but for roundings; or None."""
        if self.doubles is None:
            return None
        import numpy

        sizes = abs(float(self.length)) ** numpy.arange(self.doubles.shape[1])
        sizes[0] = 0.0
        return self.doubles[:, 0].tolist(), (abs(self.doubles) @ sizes).tolist()

    def _powers_of_length(self, count: int) -> list[Dyadic]:
        """length^n for 0 ≤ n < count, to as many bits as are kept."""
        m, e = dyadic(self.length)
        found = [(1, 0)]
        for _ in range(count - 1):
            k, f = found[-1][0] * m, found[-1][1] + e
            excess = max(0, k.bit_length() - self._bits)
            found.append((k >> excess, f + excess))
        return found

    def state(self, s: fmpq) -> list[Fraction]:
        """(Ω, γ) at s, exactly as the polynomials give it."""
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
    found = fmpq_poly(fmpz_poly(integers))
    return found / (1 << shift) if shift >= 0 else found * (1 << -shift)


@dataclass(slots=True)
class Dense:
    """A run from t = 0 whose steps are looked at one by one.

    until: exact, a number of the format.  outcome, steps, reached, order, seconds, flags: as of a
    :class:`heavytop.integrate.trajectory.Trajectory`, once :meth:`pieces` is at its end.
    """

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
            for piece in self._steps():
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

    def _steps(self) -> Iterator[Piece]:
        raise NotImplementedError

    def _stopped(self) -> bool:
        if self.step_limit is None or self.steps < self.step_limit:
            return False
        self.outcome = Outcome.STEP_LIMIT
        return True


class OfHeyoka(Dense):
    """Steps of heyoka."""

    __slots__ = ()

    def _steps(self) -> Iterator[Piece]:
        problem, bits = self.problem, self.problem.precision.bits
        tool = compile_heyoka(problem.system, problem.precision, tolerance=self.tolerance)
        self.flags, self.seconds["compile"] = tool.flags, tool.seconds
        with tool.borrowed() as engine:
            load(engine, problem)
            self.order = engine.order
            stepper = Stepper(engine, self.until > 0, None, None)
            while not self._stopped():
                began = sum(map(exact, engine.dtime), Fraction(0))
                self.outcome = stepper.single()
                if self.outcome is not Outcome.SUCCESS or stepper.rest is not None:
                    return
                self.steps += 1
                rows = stepper.polynomial()
                doubles = rows if problem.precision == DOUBLE else None
                yield Piece(began, exact(engine.last_h), bits, partial(_of_row, rows), doubles=doubles)


class OfWords(Dense):
    """Steps of the multi-word integrator."""

    __slots__ = ()

    def _steps(self) -> Iterator[Piece]:
        problem, bits = self.problem, self.problem.precision.bits
        arithmetic, scaled = choose(problem, self.tolerance)
        self.seconds["compile"] = compile_words(arithmetic, problem.system, False)
        self.flags = arithmetic.flags
        if scaled.rest:
            return
        run = arithmetic.begin(scaled, self.until > 0)
        sign, goal = (1 if run.forwards else -1), abs(self.until) * scaled.rate
        while not self._stopped():
            began = run.time
            status = run.advance(goal, 1)
            self.steps, self.order = run.steps, run.order
            if status is not Status.OK:
                self.outcome = OUTCOMES[status]
                return
            # double-double gives y_n, the others y_n h^n
            powers, unit = isinstance(run, Floating), sign / scaled.rate
            read = _reader(run, scaled, scaled.rate if powers else Fraction(1))
            yield Piece(began * unit, (run.time - began) * unit, bits, read, powers)


def _reader(run: ResumableRun, scaled: Scaled, rate: Fraction) -> Callable[[int], Sequence[Dyadic]]:
    """Coefficients of the last step in the units of the problem; the nth counts rate^n."""
    give = run.derivatives if isinstance(run, Floating) else run.coefficients
    rows = [give(n) for n in range(run.order + 1)]
    return lambda index: [dyadic(row[index] * scaled.sizes[index] * rate**n) for n, row in enumerate(rows)]


_DENSE: dict[str, type[Dense]] = {
    "heyoka": OfHeyoka,
    "multiword": OfWords,
}
"""By name: those that hand over the polynomial of a step."""


def dense(
    integrator: Any, problem: Problem, until: Fraction, tolerance: Fraction | None, step_limit: int | None
) -> Dense:
    """A run of that integrator; raises Unsupported for one that hands over no polynomial of its steps."""
    made = _DENSE.get(integrator) if isinstance(integrator, str) else None
    if made is None:
        name = said(name_of(integrator))
        raise Unsupported(
            f"The integrator {name} hands over no polynomial of its steps, so it locates no events.",
            f"Events are located by {' and '.join(_DENSE)}.",
        )
    end = exact(number(until, problem.precision))
    steps = expected_steps(problem, end)
    if steps > MOST_STEPS and not (step_limit is not None and step_limit <= MOST_STEPS):
        raise OutOfReach(
            f"A run to t = {decimal_text(end, 6)} takes some {steps:.0e} steps, and each is looked at for events.",
            f"Up to {MOST_STEPS:.0e} are tried: ask for an earlier time, or give a step limit.",
        )
    return made(problem, end, tolerance, step_limit)


# Changes of sign of a polynomial with integer coefficients, isolated and refined without rounding.
#
# Isolation is Vincent's theorem with bisection (Collins and Akritas, 1976): on (0, 1) the number of roots is at most
# the number v of sign changes among the coefficients of (1 + x)^n g(1/(1 + x)), and equal to it for v = 0 and v = 1.
# An interval that is shorter than asked for is not divided any more: the signs at its ends tell whether the function
# changes sign in it, so roots that coincide in the format count as one change, or as none where they are
# even in number.
#
# Refinement is Abbott's quadratic interval refinement (2014): a secant says where among N parts the root lies, and
# exact signs prove it.


_ONE_MORE = fmpz_poly([1, 1])
_DEEPEST = 400
"""Bisections of an interval at most: roots that lie 2^-400 of a step apart are not distinguished in any format."""
_MOST_PARTS_BITS = 4096


@dataclass(frozen=True, slots=True)
class SignChange:
    """A change of sign between ``low`` and ``high``, equal where it is known exactly; rising: from − to +."""

    low: fmpq
    high: fmpq
    rising: bool


def sign_after(polynomial: fmpz_poly) -> int:
    """The sign at a small x > 0: −1, 0 for the polynomial 0, or 1."""
    return next((1 if c > 0 else -1 for c in polynomial.coeffs() if c), 0)


def sign_before(polynomial: fmpz_poly, end: fmpq | None = None) -> int:
    """The sign just before x = ``end``, None for 1."""
    total = polynomial(fmpq(1) if end is None else end)
    if total:
        return 1 if total > 0 else -1
    moved = (polynomial if end is None else _scaled(polynomial, end))(_ONE_MORE)
    return next(((1 if c > 0 else -1) * (-1) ** n for n, c in enumerate(moved.coeffs()) if c), 0)


def sign_changes(polynomial: fmpz_poly, end: fmpq, resolution: int) -> Iterator[SignChange]:
    """Every change of sign of a polynomial in 0 < x < ``end`` ≤ 1, in order.

    resolution: intervals of length 2^-resolution ``end`` are not divided any more.
    """
    if end > 0 and not _bounded_away(polynomial):
        yield from _isolated(_scaled(polynomial, end), 0, 0, end, min(resolution, _DEEPEST))


def _isolated(part: fmpz_poly, place: int, depth: int, span: fmpq, resolution: int) -> Iterator[SignChange]:
    """The changes in the part ``place`` of the 2^``depth`` of (0, span); ``part`` is the polynomial there on (0, 1)."""
    part = _without_root_at_zero(part)
    variations = _variations(part)
    if variations == 0:
        return
    if variations == 1 or depth >= resolution:
        before, after = sign_after(part), sign_before(part)
        if before != after:
            yield SignChange(span * fmpq(place, 1 << depth), span * fmpq(place + 1, 1 << depth), after > 0)
        return
    left = _halved(part)
    right = left(_ONE_MORE)
    yield from _isolated(left, 2 * place, depth + 1, span, resolution)
    if right[0] == 0 and sign_before(left) != (after := sign_after(right)):
        middle = span * fmpq(2 * place + 1, 2 << depth)
        yield SignChange(middle, middle, after > 0)
    yield from _isolated(right, 2 * place + 1, depth + 1, span, resolution)


def _bounded_away(polynomial: fmpz_poly) -> bool:
    """Whether the constant coefficient alone keeps the polynomial from 0 on 0 ≤ x ≤ 1."""
    sizes = [abs(int(c)) for c in polynomial.coeffs()]
    return bool(sizes) and sizes[0] > sum(sizes[1:])


def _scaled(polynomial: fmpz_poly, end: fmpq) -> fmpz_poly:
    """A positive multiple of g(end x): that on (0, 1) is g on (0, end)."""
    if end == 1:
        return polynomial
    p, q, found = int(end.p), int(end.q), [int(c) for c in polynomial.coeffs()]
    power = 1
    for n in range(len(found)):
        found[n] *= power
        power *= p
    power = 1
    for n in range(len(found) - 1, -1, -1):
        found[n] *= power
        power *= q
    return fmpz_poly(found)


def _without_root_at_zero(polynomial: fmpz_poly) -> fmpz_poly:
    count = next((n for n, c in enumerate(polynomial.coeffs()) if c), 0)
    return fmpz_poly(polynomial.coeffs()[count:]) if count else polynomial


def _halved(polynomial: fmpz_poly) -> fmpz_poly:
    """2^n g(x/2)."""
    coefficients = polynomial.coeffs()
    last = len(coefficients) - 1
    return fmpz_poly([c << (last - n) for n, c in enumerate(coefficients)])


def _variations(polynomial: fmpz_poly) -> int:
    """Descartes' bound of the number of roots in (0, 1)."""
    if not _alternates(polynomial.coeffs()):
        return 0
    return _alternates(fmpz_poly(polynomial.coeffs()[::-1])(_ONE_MORE).coeffs())


def _alternates(coefficients: Sequence[fmpz]) -> int:
    signs = [c > 0 for c in coefficients if c]
    return sum(a != b for a, b in pairwise(signs))


def refined(polynomial: fmpz_poly, change: SignChange, bits: int) -> fmpq:
    """A point within 2^-bits of the change, as a dyadic part of its interval or exactly."""
    low, high = change.low, change.high
    before = -1 if change.rising else 1
    goal, parts_bits = fmpq(1, 1 << bits), 2
    at_low = polynomial(low)
    while high - low > goal:
        width, at_high = high - low, polynomial(high)
        unit = width / (1 << parts_bits)
        if parts_bits == 1 or at_low * at_high >= 0:
            # bisection: also where an end of the interval is a root of its own, which is not the one that is meant
            middle = low + width / 2
            value = polynomial(middle)
            if value == 0:
                return middle
            low, high, at_low = (middle, high, value) if (value < 0) == (before < 0) else (low, middle, at_low)
            parts_bits = 2
            continue
        place = (at_low / (at_low - at_high) * (1 << parts_bits) + fmpq(1, 2)).floor()
        x = low + unit * place
        value = polynomial(x)
        if value == 0:
            return x
        onward = (value < 0) == (before < 0)
        other = x + unit if onward else x - unit
        beyond = polynomial(other)
        if beyond == 0:
            return other
        if low <= other <= high and ((beyond < 0) == (before < 0)) != onward:
            low, high, at_low = (x, other, value) if onward else (other, x, beyond)
            parts_bits = min(2 * parts_bits, _MOST_PARTS_BITS)
        else:
            parts_bits = max(1, parts_bits // 2)
    return (low + high) / 2
