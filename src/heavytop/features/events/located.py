"""Events of a computed motion, located on the Taylor polynomial of every step to the format.

A rational function N/D composed with the polynomials of a step is a quotient of polynomials: its changes of sign
without a pole are those of N, isolated exactly (:mod:`heavytop.features.events.dense`).  Steps err by a rounding at
their common ends: a change that only shows between the end of one and the beginning of the next is an event at that
time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy
from flint import fmpq, fmpq_poly

from heavytop.errors import InputError, quoted
from heavytop.features.events.functions import (
    POLYNOMIAL,
    SAMPLED,
    EventFunction,
    Events,
    Wanted,
    composed,
    in_body_axes,
    terms_of,
)
from heavytop.features.events.sign_changes import refined, sign_after, sign_before, sign_changes
from heavytop.integrate.dense import Dense, Piece
from heavytop.integrate.multiword.motions import native_state
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import Precision, Vector, number
from heavytop.top.attitude import rotated

Axes = tuple[Vector, Vector, Vector]

_GUARD_BITS = 8
_SAMPLES = 48
"""Samples of a step for a callable that needs numbers; steps of a Taylor method turn the body by less than a radian."""
_NARROWED = 60
_POLE = 2.0**10
"""|f| grows by so much towards a pole, in a bisection by far more digits."""
_ROUNDING, _TINY = 2.0**-36, 1e-250


class Found(NamedTuple):
    """A change of sign in a piece: at s, rising or not in the direction of the run.

    discontinuity: "jump" or "pole" where |f| does not go to 0 there; "" of an event.
    """

    piece: Piece
    s: fmpq
    rising: bool
    discontinuity: str = ""


def locate(run: Dense, integrator: str, wanted: Wanted, axes: Axes | None = None, order: int = 0) -> Events:
    """The events of a run, up to its ``until``.

    order: of the zero of a rational function at the exact start, 0 where it has none there.
    axes: the rows of A where the function is of v_given = A v, and the states are wanted in these axes; None for those
    of the run.
    Raises InputError where a callable raises, or gives no finite number.
    """
    precision, forwards, function = run.problem.precision, run.until > 0, wanted.function
    inner = function if axes is None else in_body_axes(function, axes)
    found_in = _watched(run, wanted.reached)
    events = (
        _of_rational(inner, found_in, precision, order)
        if function.rational
        else _of_callable(_Sampler(function, precision, axes), found_in)
    )
    times: list[Any] = []
    states: list[Any] = []
    directions: list[int] = []
    discontinuities: list[tuple[Any, str]] = []
    outcome = None
    for event in events:
        if event.discontinuity:
            discontinuities.append((_native_time(event.piece.time(event.s), precision), event.discontinuity))
            continue
        sign = 1 if event.rising == forwards else -1
        if wanted.direction not in (0, sign):
            continue
        state = native_state(_given(event.piece.state(event.s), axes), precision)
        if state is None:
            outcome = Outcome.NON_FINITE
            break
        times.append(_native_time(event.piece.time(event.s), precision))
        states.append(state)
        directions.append(sign)
        if wanted.limit is not None and len(times) >= wanted.limit:
            break
    return Events(
        run.problem,
        integrator,
        function.name,
        wanted.direction,
        POLYNOMIAL if function.rational else SAMPLED,
        numpy.array(times),
        numpy.array(states) if states else numpy.empty((0, 6)),
        numpy.array(directions, dtype=numpy.int64),
        run.until,
        outcome or run.outcome,
        run.reached,
        run.steps,
        run.order,
        run.seconds,
        run.flags,
        tuple(discontinuities),
    )


def _given(state: Sequence[Fraction], axes: Axes | None) -> tuple[Fraction, ...]:
    """(Ω, γ) in the axes given."""
    if axes is None:
        return tuple(state)
    return (*rotated(axes, state[:3]), *rotated(axes, state[3:]))


def _watched(run: Dense, reached: Callable[[Fraction], None] | None) -> Iterator[Piece]:
    for piece in run.pieces():
        if reached is not None:
            reached(piece.began)
        yield piece


def _native_time(time: Fraction, precision: Precision) -> Any:
    try:
        return number(time, precision)
    except InputError:  # below the smallest number of the format
        return number(Fraction(0), precision)


def _of_rational(function: EventFunction, pieces: Iterator[Piece], precision: Precision, order: int) -> Iterator[Found]:
    """Changes of sign of the numerator where the denominator is not 0.

    order: of its zero at the exact start.  Rounding the start scatters such a zero by a term eps t^k, which is no
    event: up to t = eps^(1/(order + 1 - k)) of a step the function is below a rounding.
    """
    terms, below = terms_of(function.numerator), terms_of(function.denominator)
    used, zero = function.used(), fmpq_poly([0])
    before, floats = 0, _as_floats(terms)
    for piece in pieces:
        if before and floats and _sign_over(floats, piece) == before:
            continue
        components = [piece.component(index) if index in used else None for index in range(6)]
        polynomial = composed(terms, components, zero).numer()
        bits = precision.bits + _GUARD_BITS + (precision.bits if piece.began == 0 else 0)
        changes = [(refined(polynomial, c, bits), c.rising) for c in sign_changes(polynomial, piece.end, bits)]
        if order and piece.began == 0:
            scattered = order + 1 - next((k for k in range(order) if polynomial[k] != 0), order)
            changes = [change for change in changes if change[0] > fmpq(1, 1 << precision.bits // scattered)]
        after = sign_after(polynomial)
        if before and after and before != after:
            # the two steps disagree at their common end by a rounding
            if changes and changes[0][0] < fmpq(1, 1 << precision.bits // 2):
                changes = changes[1:]
            else:
                changes = [(fmpq(0), after > 0), *changes]
        for s, rising in changes:
            at = composed(below, [None if c is None else c(s) for c in components], fmpq(0))
            if at != 0:
                yield Found(piece, s, rising == (at > 0))
        before = sign_before(polynomial, piece.end) or before


_Floats = list[tuple[list[tuple[int, int]], float]]


def _as_floats(terms: Sequence[tuple[tuple[int, ...], Any]]) -> _Floats:
    """The terms of a polynomial in double, each as its (component, power) and coefficient; none where one overflows."""
    try:
        return [([(i, count) for i, count in enumerate(powers) if count], int(c.p) / int(c.q)) for powers, c in terms]
    except OverflowError:
        return []


def _sign_over(terms: _Floats, piece: Piece) -> int:
    """The sign of a polynomial over a whole step, 0 where intervals in double do not show it.

    It is that of the value at the middle of the box of the components, if that exceeds the most that the terms change
    in the box and 2^-36 of their sizes, for roundings.
    """
    box = piece.boxes()
    if box is None:
        return 0
    middles, widths = box
    value = change = size = 0.0
    try:
        for powers, coefficient in terms:
            at, most = coefficient, abs(coefficient)
            for index, count in powers:
                at *= middles[index] ** count
                most *= (abs(middles[index]) + widths[index]) ** count
            value, change, size = value + at, change + most - abs(at), size + most
    except OverflowError:
        return 0
    if not abs(value) > change + _ROUNDING * size or not abs(value) > _TINY:
        return 0
    return 1 if value > 0 else -1


@dataclass(slots=True)
class _Sampler:
    """Values of a callable on a piece, in numbers of the format."""

    function: EventFunction
    precision: Precision
    axes: Axes | None = None

    def value(self, piece: Piece, s: fmpq) -> Any:
        """The function at s; raises InputError where it raises, or gives no finite number."""
        state = native_state(_given(piece.state(s), self.axes), self.precision)
        if state is None:
            raise InputError("The state is too large for its format.", "Choose other units, or a wider format.")
        assert self.function.call is not None
        try:
            value = self.function.call(state[:3], state[3:])
        except Exception as error:
            raise InputError(
                f"The function {quoted(self.function.name)} raised {type(error).__name__} at the state "
                f"({', '.join(str(v) for v in state)}): {quoted(str(error))}.",
                "It is called with Ω and γ, arrays of three numbers of the format, and gives one number.",
            ) from None
        finite = False
        with suppress(TypeError, ValueError):  # not a number, or several
            several = isinstance(value, list | tuple) or numpy.iscomplexobj(value)
            finite = not several and bool(numpy.isfinite(value))
        if not finite:
            raise InputError(
                f"The function {quoted(self.function.name)} gave {quoted(value)} at the state "
                f"({', '.join(str(v) for v in state)}).",
                "It must give one finite number at every state of the motion.",
            )
        return value


def _of_callable(sampler: _Sampler, pieces: Iterator[Piece]) -> Iterator[Found]:
    """Changes of sign between samples, and where |f| has a minimum between samples of one sign."""
    sign, piece = 0, None
    for piece in pieces:
        places = [piece.end * n / _SAMPLES for n in range(_SAMPLES + 1)]
        values = [sampler.value(piece, s) for s in places]
        for n, (s, value) in enumerate(zip(places, values, strict=True)):
            now = _sign(value)
            if now and sign and now != sign:
                if n == 0:
                    yield Found(piece, places[0], now > 0)
                else:
                    yield _bisected(sampler, piece, (places[n - 1], s), sign)
            elif now and 0 < n < _SAMPLES and abs(values[n - 1]) > abs(value) < abs(values[n + 1]):
                other = _narrowed(sampler, piece, places[n - 1], s, places[n + 1], now)
                if other is not None and now == sign == _sign(values[n + 1]):
                    yield _bisected(sampler, piece, (places[n - 1], other), now)
                    yield _bisected(sampler, piece, (other, places[n + 1]), -now)
            sign = now or sign
    if not sign and piece is not None:
        raise InputError(
            f"The function {quoted(sampler.function.name)} is zero at every sample of this motion.",
            "Choose another function.",
        )


def _sign(value: Any) -> int:
    return int(value > 0) - int(value < 0)


def _bisected(sampler: _Sampler, piece: Piece, ends: tuple[fmpq, fmpq], before: int) -> Found:
    """Where the sign changes between the two ends, at the first of which it is ``before``.

    |f| goes to 0 at a zero, so it is smaller at the end of the bisection than in its middle, unless both are roundings.
    """
    (low, high), bits = ends, sampler.precision.bits + _GUARD_BITS
    values = [sampler.value(piece, s) for s in ends]
    sizes = [_size(values)]
    for _ in range(bits):
        middle = (low + high) / 2
        value = sampler.value(piece, middle)
        now = _sign(value)
        if now == 0:
            return Found(piece, middle, before < 0)
        if now == before:
            low, values[0] = middle, value
        else:
            high, values[1] = middle, value
        sizes.append(_size(values))
    first, halfway, last = sizes[0], sizes[bits // 2], sizes[-1]
    kind = ""
    if last > first * 2.0 ** -(bits // 2) and 2 * last > halfway:
        kind = "pole" if last > _POLE * first else "jump"
    return Found(piece, (low + high) / 2, before < 0, kind)


def _size(values: Sequence[Any]) -> Any:
    return max(abs(value) for value in values)


def _narrowed(sampler: _Sampler, piece: Piece, low: fmpq, middle: fmpq, high: fmpq, sign: int) -> fmpq | None:
    """A place between, where the function has the other sign, found on the way to its least absolute value; or None."""
    least = abs(sampler.value(piece, middle))
    for step in range(_NARROWED):
        other = (low + middle) / 2 if step % 2 else (middle + high) / 2
        value = sampler.value(piece, other)
        if _sign(value) == -sign:
            return other
        if abs(value) < least:
            low, middle, high = (low, other, middle) if step % 2 else (middle, other, high)
            least = abs(value)
        elif step % 2:
            low = other
        else:
            high = other
    return None
