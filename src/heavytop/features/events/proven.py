"""Events of the true motion as balls: each proven to be there, none missed.

On a step of the enclosure the motion is y(τ) = p(τ) + w(τ), p a polynomial and |w| ≤ W
(:mod:`heavytop.exact.enclosure.step`). With balls of radius W in the constant coefficients, a polynomial f of the state
is enclosed at every τ by one polynomial with ball coefficients; so is its rate along the motion, which is a polynomial
of the state as well.  A step is divided until in each part either f or its rate is proven not to vanish: in the first
case there is no zero, in the second at most one, and it is simple.  Signs of f on both sides of a chain of such parts,
proven, tell whether there is one.

A part in which neither can be proven holds a zero that is not simple or two that are too close for the precision: more
bits are taken, and then it is out of reach, never left out.  Zeros are refined by Newton's method for intervals.

At t = 0 the data are exact.  Where f vanishes there, to order m, its mth derivative is proven not to vanish up to some
time; by Taylor's theorem f has no zero between.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import chain
from math import ceil, floor, log2
from typing import Any, NamedTuple

from flint import arb, arb_poly

from heavytop.errors import Contradiction, HeavyTopError, OutOfReach
from heavytop.exact.enclosure.run import ScaledMotion, Validated
from heavytop.exact.enclosure.step import Step
from heavytop.exact.flint.balls import ball, midpoint, radius, whole_evaluation, working_precision
from heavytop.exact.resolved import Resolved
from heavytop.features.events.functions import (
    EventFunction,
    Wanted,
    composed,
    first_term,
    in_body_axes,
    rate_along,
    terms_of,
)
from heavytop.precision import decimal_text
from heavytop.top.attitude import rotated

_GUARD_BITS = 24
_ATTEMPTS = 3
_MOST_PARTS = 4096
"""Most parts of a step.  A simple zero takes some twenty; where the function is as small as its error, many more."""
_REFINEMENTS = 200
_MOST_ORDER = 8
"""Derivatives that may vanish at t = 0 beside a function that does."""
_EXTRA_BITS = 64
_SHORT_ORDER, _SHORT_BITS, _WIDE = 28, 96, Fraction(1, 2**10)
"""Over a wider part a polynomial is evaluated by its leading coefficients, in so many bits; the others are a ball."""
_NARROW = Fraction(1, 2**16)
"""Over a part that is not wider it is evaluated as it stands first: near a multiple zero that is too coarse."""


class ProvenEvent(NamedTuple):
    """time, states: balls.  rising: whether the function rises with time."""

    time: arb
    state: list[arb]
    rising: bool


class _Undecided(HeavyTopError):
    """Raised where the precision does not decide the events near a time."""

    def __init__(self, time: Fraction, why: str) -> None:
        super().__init__(why)
        self.time = time


class _Terms(NamedTuple):
    """The numerator of a function, its rate, the denominator, and the numerator's first derivative along the motion
    that does not vanish at t = 0: the terms of each."""

    value: list[Any]
    rate: list[Any]
    below: list[Any]
    first: list[Any]
    by_omega: list[Any]
    lacking: Fraction


@dataclass(slots=True)
class _Piece:
    """One step: polynomials in s, 0 ≤ s ≤ ``last``, that enclose what is named.

    began, length: of the step in scaled time.  components: the state in the units given.
    """

    began: Fraction
    length: Fraction
    last: Fraction
    bits: int
    components: list[Any]
    value: Any
    rate: Any
    below: Any
    first: Any
    short: dict[int, Any] = field(default_factory=dict)

    def over(self, what: Any, low: Fraction, high: Fraction) -> Any:
        """The values of a polynomial at low ≤ s ≤ high, as a ball."""
        middle, half = (low + high) / 2, (high - low) / 2
        if half > _WIDE:
            if id(what) not in self.short:
                self.short[id(what)] = _shortened(what)
            with working_precision(_SHORT_BITS, _SHORT_ORDER + 1):
                return _range(self.short[id(what)], middle, half)
        if half <= _NARROW:
            enclosure = what(ball(middle) + arb(0, ball(half).upper()))
            if half == 0 or _sign(enclosure):
                return enclosure
        return _range(what, middle, half)

    def part(self, low: Fraction, high: Fraction) -> tuple[Fraction, Fraction]:
        """The s of two scaled times, as far as this step goes."""
        return max(Fraction(0), (low - self.began) / self.length), min(self.last, (high - self.began) / self.length)


class _Near(NamedTuple):
    """The polynomials of a piece on a part of it, in x = (s − low)/width, without what is far below their error."""

    low: Fraction
    width: Fraction
    value: Any
    rate: Any
    first: Any

    @classmethod
    def of(cls, piece: _Piece, low: Fraction, high: Fraction) -> _Near:
        """At low ≤ s ≤ high: there a multiple zero takes thousands of evaluations, of polynomials of a few terms."""
        line = arb_poly([ball(low), ball(high - low)])
        return cls(low, high - low, *(_without_tail(part(line)) for part in (piece.value, piece.rate, piece.first)))

    def over(self, what: Any, low: Fraction, high: Fraction) -> Any:
        """As :meth:`_Piece.over`."""
        middle, half = ((low + high) / 2 - self.low) / self.width, (high - low) / 2 / self.width
        enclosure = what(ball(middle) + arb(0, ball(half).upper()))
        return enclosure if half == 0 or _sign(enclosure) else _range(what, middle, half)


def _without_tail(what: Any) -> Any:
    """A polynomial at 0 ≤ x ≤ 1 whose constant coefficient holds all later ones that add a thousandth to its radius."""
    coefficients = what.coeffs() or [arb(0)]
    allowed, rest = coefficients[0].rad() / 1024, arb(0)
    while len(coefficients) > 1 and (more := (rest + abs(coefficients[-1])).upper()) <= allowed:
        rest = more
        coefficients.pop()
    return arb_poly([coefficients[0] + arb(0, rest), *coefficients[1:]])


def _range(what: Any, middle: Fraction, half: Fraction) -> Any:
    """The values of a polynomial within ``half`` of ``middle``: its coefficients there, added up.

    The constant one is the value there, as narrow as it is over a part without width.
    """
    moved = what(arb_poly([ball(middle), ball(half)]))
    others = sum((abs(moved[n]).upper() for n in range(1, len(moved))), arb(0))
    return what(ball(middle)) + arb(0, others.upper())


def _shortened(what: Any) -> Any:
    """A polynomial whose constant coefficient is a ball that holds all beyond an order, for 0 ≤ s ≤ 1."""
    coefficients = what.coeffs()
    rest = sum((abs(c).upper() for c in coefficients[_SHORT_ORDER + 1 :]), arb(0)).upper()
    leading = coefficients[: _SHORT_ORDER + 1] or [arb(0)]
    leading[0] = leading[0] + arb(0, rest)
    return arb_poly(leading)


def _sign(value: Any) -> int:
    return 1 if value > 0 else -1 if value < 0 else 0


class _Cell(NamedTuple):
    """A part of a step in scaled time: where f is proven to have the sign ``clear``, or its rate the sign ``slope``.

    at_high: the sign of f at its end, 0 where it is not proven.
    """

    low: Fraction
    high: Fraction
    clear: int
    slope: int
    at_high: int


def proven_events(
    solution: Validated, until: Fraction, wanted: Wanted, digits: int, resolved: Resolved | None = None
) -> list[ProvenEvent]:
    """The events in 0 < t < ``until`` (or until < t < 0), in the order of |t|, each to ``digits`` digits.

    resolved: where the function and the states are those of other axes, how ``solution`` was made; None for its own.
    Raises InputError where the function is zero along the motion, OutOfReach where the enclosure does not reach or
    cannot decide whether there is an event.
    """
    bits = ceil(digits * log2(10)) + _GUARD_BITS
    axes = None if resolved is None or not resolved.is_rotated else resolved.axes
    if axes is not None:
        wanted = wanted._replace(function=in_body_axes(wanted.function, axes))
    order, sign = (0, 0) if solution.uncertainty is not None else _begins(solution, wanted.function)
    undecided: _Undecided | None = None
    for attempt in range(_ATTEMPTS):
        try:
            return _Search(solution, until, wanted, digits, order, sign, axes).run(bits)
        except _Undecided as error:
            undecided = error
            bits += max(_EXTRA_BITS, bits) if attempt else _EXTRA_BITS
    assert undecided is not None
    raise OutOfReach(
        f"Near t = {decimal_text(undecided.time, 12)} it is not decided {undecided.cause}.",
        "Give another until, or another value of the function: a double zero cannot be proven.",
    )


def _begins(solution: Validated, function: EventFunction) -> tuple[int, int]:
    """(order of the zero at t = 0, sign of the function right behind it in the direction t > 0)."""
    order, value = first_term(function, solution.system, solution.parameters, solution.start.flat)
    if order > _MOST_ORDER:
        raise OutOfReach(f"The first {order - 1} derivatives vanish at t = 0.", f"At most {_MOST_ORDER} are supported.")
    return order, 1 if value > 0 else -1


@dataclass(slots=True)
class _Search:
    """One walk along the motion at one working precision."""

    solution: Validated
    until: Fraction
    wanted: Wanted
    digits: int
    order: int
    sign: int
    axes: Any = None
    motion: Any = None
    terms: Any = None
    pieces_since: list[_Piece] = field(default_factory=list)

    def run(self, bits: int) -> list[ProvenEvent]:
        """The events; raises _Undecided where ``bits`` bits are too few."""
        self.motion, steps = self.solution.walk(self.until, bits)
        self.terms = _terms(self.wanted.function, self.solution, self.order)
        pieces = self._pieces(steps)
        if self.sign:
            after = self.sign * (-1 if self.until < 0 and self.order % 2 else 1)
        else:
            first = next(pieces)
            after = _sign_at_start(first)
            if not after:
                raise _Undecided(Fraction(0), "what sign the function has, with irrational data")
            pieces = chain([first], pieces)
        events: list[ProvenEvent] = []
        for low, high in self._zeros(pieces, after):
            event = self._event(low, high, after)
            after = -after
            if self.wanted.direction in (0, 1 if event.rising else -1):
                events.append(event)
                if self.wanted.limit is not None and len(events) >= self.wanted.limit:
                    break
        return events

    def _time(self, scaled: Fraction) -> Fraction:
        unit: Fraction = self.motion.scaled.rate
        return scaled / unit * (1 if self.until > 0 else -1)

    def _pieces(self, steps: Iterator[Step]) -> Iterator[_Piece]:
        span, covered = abs(self.until) * self.motion.scaled.rate, Fraction(0)
        for step in steps:
            piece = _piece(step, self.motion, self.terms, span)
            covered = step.node.time + step.length
            if self.wanted.reached is not None:
                self.wanted.reached(self._time(min(covered, span)))
            yield piece
        if covered < span:
            raise _Undecided(self._time(covered), "the further motion: too many bits are lost")

    def _zeros(self, pieces: Iterator[_Piece], after: int) -> Iterator[tuple[Fraction, Fraction]]:
        """Scaled times between which there is exactly one zero, simple or proven by its derivatives.

        ``pieces_since`` holds the steps from the last time at which the sign is proven.
        """
        anchor, sign, slope = Fraction(0), after, 0
        last = Fraction(0)
        fresh = self.order > 0
        for piece in pieces:
            self.pieces_since.append(piece)
            for cell in self._cells(piece, fresh):
                if fresh:
                    # up to here the first derivative that does not vanish at t = 0 has one sign
                    anchor, fresh = cell.high, False
                elif cell.clear:
                    if cell.clear != sign:
                        if not slope:
                            raise Contradiction("A function is enclosed twice, without a common point.")
                        yield anchor, cell.low
                    anchor, sign, slope = cell.high, cell.clear, 0
                else:
                    if slope and slope != cell.slope:
                        raise _Undecided(self._time(cell.low), "whether the function changes sign")
                    slope = cell.slope
                    if cell.at_high:
                        if cell.at_high != sign:
                            yield anchor, cell.high
                        anchor, sign, slope = cell.high, cell.at_high, 0
                last = cell.high
            self.pieces_since = [piece for piece in self.pieces_since if piece.began + piece.length >= anchor]
        if slope:
            raise _Undecided(self._time(last), "whether the function changes sign before the end of the run")

    def _cells(self, piece: _Piece, fresh: bool) -> list[_Cell]:
        cells = _cells(piece, fresh)
        if isinstance(cells, Fraction):
            raise _Undecided(self._time(cells), "whether the function changes sign or only touches zero")
        return cells

    def _event(self, low: Fraction, high: Fraction, before: int) -> ProvenEvent:
        """The zero between two scaled times, refined; ``before``: the sign of the numerator before it."""
        pieces = [piece for piece in self.pieces_since if piece.began <= high and piece.began + piece.length >= low]
        refined = _refined(pieces, low, high, -before, self.digits, self.motion, self.until > 0, self.axes)
        if refined is None:
            raise _Undecided(self._time(high), "to so many digits where the function changes sign")
        time, state, below = refined
        if below == 0:
            raise _Undecided(self._time(high), "whether the denominator of the function vanishes with its numerator")
        rising = (-before if self.until > 0 else before) * below > 0
        return ProvenEvent(time, state, rising)


def _terms(function: EventFunction, solution: Validated, order: int) -> _Terms:
    system, parameters = solution.system, solution.parameters
    rate = rate_along(function.numerator, system, parameters)
    first = function.numerator
    for _ in range(order):
        first = rate_along(first, system, parameters)
    value, rate, below, first = map(terms_of, (function.numerator, rate, function.denominator, first))
    lacking = Fraction(0) if solution.uncertainty is None else solution.uncertainty.rate
    derivatives = [terms_of(function.numerator.derivative(i)) for i in range(3)] if lacking else []
    return _Terms(value, rate, below, first, derivatives, lacking)


@whole_evaluation
def _sign_at_start(piece: _Piece) -> int:
    with working_precision(piece.bits):
        return _sign(piece.over(piece.value, Fraction(0), Fraction(0)))


@whole_evaluation
def _piece(step: Step, motion: ScaledMotion, terms: _Terms, span: Fraction) -> _Piece:
    """A step with the function composed; ``span``: the scaled time at which the run ends."""
    bits = step.precision + 64
    with working_precision(bits, step.order * 40 + 64):
        unit = arb(2) ** -step.precision
        error = arb(0, arb(step.widest))
        components = []
        for values, size in zip(step.coefficients, motion.scaled.sizes, strict=True):
            scale = ball(size)
            numbers = [arb(int(value)) * unit * scale for value in values]
            numbers[0] = numbers[0] + error * scale
            components.append(arb_poly(numbers))
        value, rate, below = (_composed(part, components) for part in (terms.value, terms.rate, terms.below))
        first = _composed(terms.first, components) if step.node.time == 0 else value
        for part in terms.by_omega:
            most = sum((abs(c).upper() for c in _composed(part, components).coeffs()), arb(0))
            rate = rate + arb_poly([arb(0, (most * ball(terms.lacking)).upper())])
    last = min(Fraction(1), (span - step.node.time) / step.length)
    return _Piece(step.node.time, step.length, last, bits, components, value, rate, below, first)


def _composed(terms: list[Any], components: list[Any]) -> Any:
    return composed([(exponents, arb(c)) for exponents, c in terms], components, arb_poly([0]))


@whole_evaluation
def _cells(piece: _Piece, fresh: bool) -> list[_Cell] | Fraction:
    """The parts of a step in order; where one stays undecided, the scaled time at which it is.

    fresh: the function vanishes at the beginning, and the first part is one in which its first derivative that does not
    vanish there vanishes nowhere.
    """
    cells: list[_Cell] = []
    deepest = piece.bits // 2 + 16
    with working_precision(piece.bits):
        parts: list[tuple[Fraction, Fraction, int, _Piece | _Near]] = [(Fraction(0), piece.last, 0, piece)]
        for _ in range(_MOST_PARTS):
            if not parts:
                return cells
            low, high, depth, near = parts.pop()
            if near is piece and high - low <= 2 * _WIDE:
                near = _Near.of(piece, low, high)
            ends = piece.began + low * piece.length, piece.began + high * piece.length
            if fresh and low == 0:
                if _sign(near.over(near.first, low, high)):
                    cells.append(_Cell(*ends, 0, 0, 0))
                    continue
            elif clear := _sign(near.over(near.value, low, high)):
                cells.append(_Cell(*ends, clear, 0, clear))
                continue
            elif slope := _sign(near.over(near.rate, low, high)):
                cells.append(_Cell(*ends, 0, slope, _sign(near.over(near.value, high, high))))
                continue
            if depth >= deepest:
                return ends[0]
            middle = (low + high) / 2
            parts += [(middle, high, depth + 1, near), (low, middle, depth + 1, near)]
    return ends[0]


def _hull(pieces: Sequence[_Piece], choose: Callable[[_Piece], Any], low: Fraction, high: Fraction) -> Any:
    """The values of a polynomial of the pieces between two scaled times, as one ball."""
    hull = None
    for piece in pieces:
        first, last = piece.part(low, high)
        if first <= last:
            value = piece.over(choose(piece), first, last)
            hull = value if hull is None else hull.union(value)
    return hull


@whole_evaluation
def _refined(
    pieces: Sequence[_Piece],
    low: Fraction,
    high: Fraction,
    behind: int,
    digits: int,
    motion: ScaledMotion,
    forwards: bool,
    axes: Any,
) -> tuple[arb, list[arb], int] | None:
    """(time, state, sign of the denominator) at the only zero between two scaled times; None for too few digits.

    behind: the sign of the numerator behind the zero.  axes: of the state, None for those of the pieces.
    """
    bits = max(piece.bits for piece in pieces)
    sign = 1 if forwards else -1
    with working_precision(bits):
        low, high = _narrowed(pieces, low, high, behind, bits, sign / motion.scaled.rate)
        middle, half = (low + high) / 2, (high - low) / 2
        unit = ball(sign / motion.scaled.rate)
        time = (ball(middle) + arb(0, ball(half).upper())) * unit
        state = [_hull(pieces, lambda piece, i=index: piece.components[i], low, high) for index in range(6)]  # type: ignore[misc]
        if axes is not None:
            turn = [[ball(entry) for entry in row] for row in axes]
            state = [*rotated(turn, state[:3]), *rotated(turn, state[3:])]
        below = _sign(_hull(pieces, lambda piece: piece.below, low, high))
    allowed = Fraction(1, 2 * 10**digits)
    if any(radius(v) > allowed * max(Fraction(1), abs(midpoint(v))) for v in (time, *state)):
        return None
    return time, state, below


def _narrowed(
    pieces: Sequence[_Piece], low: Fraction, high: Fraction, behind: int, bits: int, unit: Fraction
) -> tuple[Fraction, Fraction]:
    """Scaled times around the zero as close as the enclosure allows: Newton's method for intervals, or bisection.

    unit: of the scaled time; the rate is that of the time given.
    """
    for _ in range(_REFINEMENTS):
        width = high - low
        middle = _rounded((low + high) / 2, bits)
        if not low < middle < high:
            break
        value = _hull(pieces, lambda piece: piece.value, middle, middle)
        rate = _hull(pieces, lambda piece: piece.rate, low, high) * ball(unit)
        if _sign(rate):
            where = ball(middle) - value / rate
            centre, spread = midpoint(where), radius(where)
            below, above = _rounded(centre - spread, bits, -1), _rounded(centre + spread, bits, 1)
            low, high = max(low, below), min(high, above)
        elif now := _sign(value):
            low, high = (low, middle) if now == behind else (middle, high)
        else:
            break
        if high - low > width * Fraction(15, 16):
            break
    return low, high


def _rounded(value: Fraction, bits: int, direction: int = 0) -> Fraction:
    """A dyadic number within 2^-bits: not above the value for −1, not below it for 1, near it for 0."""
    scaled = value * 2**bits
    return Fraction(ceil(scaled) if direction > 0 else floor(scaled), 1 << bits)
