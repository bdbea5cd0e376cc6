"""Functions of (Ω, γ) whose changes of sign are events: read from text or from a callable.

A rational function N/D of the six components is known as such: text is parsed into one, and a callable is called once
with six indeterminates over the rational numbers.  What comes back is exact, so nothing of the user's is called again.
A callable that needs numbers (``math.sin``, comparisons, ``abs``) has no such form and is sampled.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache, reduce
from operator import mul
from typing import Any, NamedTuple

import msgspec
import numpy
from flint import Ordering, fmpq, fmpq_mpoly_ctx, fmpq_series
from numpy.typing import NDArray

from heavytop.display import Lazy, Tabular, TitledTable, plural
from heavytop.errors import InputError, quoted
from heavytop.exact.closed_form import taylor
from heavytop.exact.flint.balls import coefficient, radius_text, rational, series_length, whole_evaluation
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.reference import Ball, rounded_up
from heavytop.precision import Array, decimal_text, exact, native_text, six_digits
from heavytop.top.equations import NAMES, VARIABLES, Parameters, System, component

_GREEK = {f"{greek}{axis}": f"{name}{axis}" for greek, name in (("Ω", "omega"), ("γ", "gamma")) for axis in (1, 2, 3)}
_GREEK |= {f"\N{OHM SIGN}{axis}": f"omega{axis}" for axis in (1, 2, 3)}
_REMEDY = (
    'Write a rational function of omega1..omega3 and gamma1..gamma3, such as "omega1", "gamma3 = 1/2" or '
    '"omega1*gamma2 - omega2*gamma1".'
)
_LONGEST, _DEEPEST, _HIGHEST, _MOST_TERMS = 1000, 100, 32, 2000
_TERMS = 24
"""First length of a Taylor series at the start; it is extended where all of these terms vanish."""
_context = fmpq_mpoly_ctx.get(VARIABLES, Ordering.lex)


class NotRational(TypeError):
    """Raised where a callable needs the number of an indeterminate."""


class Ratio:
    """A rational function N/D of six indeterminates: the argument with which a callable is tried.

    numerator, denominator: without a common factor once they are :meth:`reduced`.
    """

    __slots__ = ("denominator", "numerator")

    def __init__(self, numerator: Any, denominator: Any) -> None:
        for part in (numerator, denominator):
            if part.total_degree() > _HIGHEST or len(part) > _MOST_TERMS:
                raise InputError(
                    f"The function has degree {part.total_degree()} and {len(part)} terms.",
                    f"Degrees up to {_HIGHEST} and {_MOST_TERMS} terms are supported.",
                )
        self.numerator, self.denominator = numerator, denominator

    @staticmethod
    def of(value: Any) -> Ratio:
        """The ratio of a number, or a ratio as it is; raises NotRational for anything else."""
        if isinstance(value, Ratio):
            return value
        try:
            if isinstance(value, str):
                raise NotRational
            number = exact(value)
        except InputError:
            raise NotRational(f"{quoted(value)} is not a number") from None
        return Ratio(_context.constant(rational(number)), _context.constant(1))

    def __add__(self, other: Any) -> Ratio:
        o = Ratio.of(other)
        if self.denominator == o.denominator:
            return Ratio(self.numerator + o.numerator, self.denominator)
        return Ratio(
            self.numerator * o.denominator + o.numerator * self.denominator, self.denominator * o.denominator
        ).reduced()

    def __neg__(self) -> Ratio:
        return Ratio(-self.numerator, self.denominator)

    def __pos__(self) -> Ratio:
        return self

    def __sub__(self, other: Any) -> Ratio:
        return self + -Ratio.of(other)

    def __rsub__(self, other: Any) -> Ratio:
        return Ratio.of(other) - self

    def __mul__(self, other: Any) -> Ratio:
        o = Ratio.of(other)
        pairs = (self.numerator, o.numerator), (self.denominator, o.denominator)
        if (degree := max(a.total_degree() + b.total_degree() for a, b in pairs)) > _HIGHEST:
            raise InputError(f"The function has degree {degree}.", f"Degrees up to {_HIGHEST} are supported.")
        return Ratio(self.numerator * o.numerator, self.denominator * o.denominator)

    def __truediv__(self, other: Any) -> Ratio:
        o = Ratio.of(other)
        if o.numerator.is_zero():
            raise InputError("The function divides by zero.", _REMEDY)
        return (self * Ratio(o.denominator, o.numerator)).reduced()

    def __rtruediv__(self, other: Any) -> Ratio:
        return Ratio.of(other) / self

    def __pow__(self, power: Any) -> Ratio:
        if isinstance(power, Ratio):
            if not (power.numerator.is_constant() and power.denominator.is_constant()):
                raise NotRational("an exponent that is not a number")
            power = power.constant
        count = exact(power)
        if count.denominator != 1:
            raise NotRational(f"the power {count}")
        if abs(count) > _HIGHEST:
            raise InputError(f"The function has a power {quoted(int(count))}.", f"Powers go up to {_HIGHEST}.")
        base = self if count >= 0 else Ratio.of(1) / self
        product = Ratio.of(1)
        for _ in range(abs(int(count))):
            product = product * base
        return product

    __radd__, __rmul__ = __add__, __mul__

    def __bool__(self) -> bool:
        raise NotRational("a comparison")

    def __eq__(self, other: object) -> bool:
        raise NotRational("a comparison")

    __hash__ = object.__hash__

    @property
    def constant(self) -> Fraction:
        """The value of a constant ratio."""
        value = self.numerator.coefficient(0) / self.denominator.coefficient(0) if self.numerator else fmpq(0)
        return Fraction(int(value.p), int(value.q))

    def reduced(self) -> Ratio:
        """The ratio without a common factor."""
        if self.denominator.is_constant():
            return self
        common = self.numerator.gcd(self.denominator)
        return Ratio(self.numerator / common, self.denominator / common)


@dataclass(frozen=True, slots=True)
class EventFunction:
    """A function of (Ω, γ).

    name: as it was given, or the callable's.  numerator, square, denominator: polynomials over the rational numbers,
    of which it is numerator · square² / denominator, the numerator without a square: it changes sign where this one
    does.  None for a callable that is sampled, ``call``.
    """

    name: str
    numerator: Any = None
    square: Any = None
    denominator: Any = None
    call: Callable[[Any, Any], Any] | None = None

    @property
    def rational(self) -> bool:
        """Whether it is known as a rational function."""
        return self.numerator is not None

    def used(self) -> list[int]:
        """The components that it depends on, 0 to 5."""
        if not self.rational:
            return list(range(6))
        degrees = [max(pair) for pair in zip(self.numerator.degrees(), self.denominator.degrees(), strict=True)]
        return [index for index, degree in enumerate(degrees) if degree > 0]


class Wanted(NamedTuple):
    """Requested events.

    direction: 1 for those at which the function rises with time, −1 where it falls, 0 for all.
    limit: stop after so many.  reached: called with the times on the way.
    """

    function: EventFunction
    direction: int = 0
    limit: int | None = None
    reached: Callable[[Fraction], None] | None = None


def event_function(function: Any) -> EventFunction:
    """The function that a text or a callable names; raises InputError for anything else, and for a constant."""
    if isinstance(function, EventFunction):
        return function
    if isinstance(function, str):
        parsed, name = _parsed(function), " ".join(function.split())
    elif callable(function):
        name = str(getattr(function, "__name__", type(function).__name__))
        tried = _tried(function)
        if tried is None:
            return EventFunction(name, call=function)
        parsed = tried
    else:
        raise InputError(f"function must be text or a callable; got {quoted(function)}.", _REMEDY)
    parsed = parsed.reduced()
    if parsed.numerator.is_constant() and parsed.denominator.is_constant():
        raise InputError(f"The function {quoted(name)} does not depend on the state.", _REMEDY)
    return EventFunction(name, *_without_square(parsed.numerator), parsed.denominator)


def _without_square(polynomial: Any) -> tuple[Any, Any]:
    """(f, g), of which the polynomial is f g² and f has no square."""
    constant, factors = polynomial.factor_squarefree()
    rest, square = _context.constant(constant), _context.constant(1)
    for factor, power in factors:
        rest, square = rest * factor ** (power % 2), square * factor ** (power // 2)
    return rest, square


def _tried(function: Callable[[Any, Any], Any]) -> Ratio | None:
    """The rational function that a callable is; None where it wants numbers."""
    y = numpy.array(_variables(), dtype=object)
    try:
        value = function(y[:3], y[3:])
        if isinstance(value, numpy.ndarray) and value.shape == ():
            value = value[()]
        return Ratio.of(value)
    except Exception:  # whatever a callable does that is made for numbers: those are tried next, and speak for it
        return None


def _variables() -> list[Ratio]:
    return [Ratio(generator, _context.constant(1)) for generator in _context.gens()]


def _parsed(text: str) -> Ratio:
    """The rational function of a text, in which one ``=`` may stand."""
    if len(text) > _LONGEST:
        raise InputError(f"A function of {len(text)} characters is too long.", f"Use at most {_LONGEST} characters.")
    sides = text.replace("^", "**").split("=")
    if len(sides) > 2 or not all(side.strip() for side in sides):
        raise InputError(f"{quoted(text)} is not a function.", _REMEDY)
    try:
        values = [_evaluated(ast.parse(side.strip(), mode="eval").body, side.strip()) for side in sides]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{quoted(text)} is not a function.", _REMEDY) from None
    except NotRational as error:
        raise InputError(f"{quoted(text)} is not a rational function: {error}.", _REMEDY) from None
    return values[0] if len(values) == 1 else values[0] - values[1]


_OPERATIONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}


def _evaluated(node: ast.expr, source: str, depth: int = 0) -> Ratio:
    if depth > _DEEPEST:
        raise RecursionError
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        left, right = (_evaluated(part, source, depth + 1) for part in (node.left, node.right))
        return Ratio.of(_OPERATIONS[type(node.op)](left, right))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        value = _evaluated(node.operand, source, depth + 1)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.Name):
        name = _GREEK.get(node.id, node.id)
        if name in VARIABLES:
            return _variables()[VARIABLES.index(name)]
        raise InputError(f"{quoted(node.id)} is not a component of the state.", _REMEDY)
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return Ratio.of(exact(ast.get_source_segment(source, node) or ""))  # as it is written, not as a double
    raise InputError(f"{quoted(ast.unparse(node))} is not part of a rational function.", _REMEDY)


def in_body_axes(function: EventFunction, axes: Sequence[Sequence[Fraction]]) -> EventFunction:
    """The function of the state in axes e of which the given ones are A e, the rows of A being ``axes``."""
    if not function.rational:
        return function
    own = _context.gens()
    forms = [
        sum((rational(axes[i][j]) * own[3 * part + j] for j in range(3)), _context.constant(0))
        for part in range(2)
        for i in range(3)
    ]
    parts = (function.numerator, function.square, function.denominator)
    return EventFunction(function.name, *(part.compose(*forms) for part in parts))


def terms_of(polynomial: Any) -> list[tuple[tuple[int, ...], fmpq]]:
    """(exponents of the six components, coefficient) of every term."""
    return [(tuple(map(int, powers)), coefficient) for powers, coefficient in polynomial.to_dict().items()]


def composed(terms: Sequence[tuple[tuple[int, ...], Any]], components: Sequence[Any], zero: Any) -> Any:
    """The polynomial with these terms at six elements of any ring, of which those that do not occur may be None."""

    @cache
    def power(index: int, count: int) -> Any:
        return components[index] if count == 1 else power(index, count // 2) * power(index, count - count // 2)

    total = zero
    for exponents, times in terms:
        factors = [power(index, count) for index, count in enumerate(exponents) if count]
        total = total + (reduce(mul, factors) * times if factors else times)
    return total


def rate_along(polynomial: Any, system: System, parameters: Parameters) -> Any:
    """d/dt of a polynomial along the motions: Σ ∂f/∂y_i f_i(y), a polynomial."""

    field = system.field(parameters.mapped(rational), _context.gens())
    total = _context.constant(0)
    for index, rate in enumerate(field):
        total = total + polynomial.derivative(index) * rate
    return total


@whole_evaluation
def start_series(
    polynomials: Sequence[Any],
    system: System,
    parameters: Parameters,
    start: Sequence[Fraction],
    terms: int = _TERMS,
) -> list[list[Fraction]]:
    """The Taylor coefficients of polynomials along the motion from an exact start, in powers of t, exactly."""
    rows = taylor(system.field, parameters, start, terms)
    with series_length(terms):
        series = [fmpq_series([rational(v) for v in row], prec=terms) for row in rows]
        zero = fmpq_series([0], prec=terms)
        along_motion = [composed(terms_of(polynomial), series, zero) for polynomial in polynomials]
        coefficients = [[coefficient(series, n) for n in range(terms)] for series in along_motion]
    return [[Fraction(int(c.p), int(c.q)) for c in row] for row in coefficients]


def first_term(
    function: EventFunction, system: System, parameters: Parameters, start: Sequence[Fraction]
) -> tuple[int, Fraction]:
    """(order, coefficient) of the first term of the numerator along the motion from an exact start.

    Raises InputError where the function is zero along the motion as far as its series is followed, or what it is
    divided by is.
    """
    parts = function.numerator, function.square, function.denominator
    # a component leaves its value at the start as t, t^2 or, rarely, a little later
    for terms in (_TERMS, _TERMS + 4 * max(part.total_degree() for part in parts)):
        series = start_series(parts, system, parameters, start, terms)
        leading = [next(((n, value) for n, value in enumerate(row) if value), None) for row in series]
        if all(leading) and leading[0]:
            return leading[0]
    fault = "is divided by 0" if leading[2] is None else "is zero"
    raise InputError(
        f"The function {quoted(function.name)} {fault} along this motion: the first {terms} terms of its series at "
        "t = 0 vanish.",
        "Choose a function that is defined and not identically zero.",
    )


# Events: of a computed motion as numbers of its format, of a known one as balls.


_SHOWN = 15

POLYNOMIAL, SAMPLED, PROVEN = "polynomial", "sampled", "proven"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events(Tabular):
    """The events of a computed motion, in the order in which the run comes to them.

    function: its text or name.  direction: 1 or −1 where only rising or falling ones were asked for, else 0.
    guarantee: ``"polynomial"``: every change of sign of the function along the Taylor polynomial of each step is there,
    isolated exactly; ``"sampled"``: a callable that needs numbers, whose changes of sign between samples of a step may
    be missed.
    times: numbers of the format, shape (n,).  states: at them, shape (n, 6), Ω1 Ω2 Ω3 γ1 γ2 γ3.
    directions: 1 where the function rises with time, −1 where it falls, shape (n,).
    discontinuities: (time, "jump" or "pole") where a sampled function changes sign and |f| does not go to 0: no events.
    until: the exact time up to which was looked; outcome, time_reached, steps, order, seconds, flags: as of a
    trajectory.
    """

    problem: Problem
    integrator: str
    function: str
    direction: int
    guarantee: str
    times: Array
    states: Array
    directions: Array
    until: Fraction
    outcome: Outcome
    time_reached: Fraction
    steps: int
    order: int
    seconds: dict[str, float] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)
    discontinuities: tuple[tuple[Any, str], ...] = ()

    def __len__(self) -> int:
        return len(self.times)

    def discontinuity_text(self) -> str:
        """How often the function jumps or has a pole where it changes sign, and when first; "" for never."""
        if not self.discontinuities:
            return ""
        kinds = Counter(kind for _, kind in self.discontinuities)
        counted = " and ".join(f"{count} {kind}{'s' * (count > 1)}" for kind, count in kinds.items())
        first = six_digits(exact(self.discontinuities[0][0]))
        return f"no events, though the sign changes: {counted} of the function, first at t = {first}"

    def texts(self) -> list[list[str]]:
        """The states as full-precision decimal strings, shape (n, 6)."""
        return [[native_text(value, self.problem.precision) for value in state] for state in self.states]

    def time_texts(self) -> list[str]:
        """The times as full-precision decimal strings."""
        return [native_text(time, self.problem.precision) for time in self.times]

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The states rounded to double, shape (n, 6)."""
        return numpy.array([[float(value) for value in state] for state in self.states]).reshape(-1, 6)

    def to_json(self) -> dict[str, Any]:
        """An entry of ``events`` in the document of `propagate --json`."""
        return {
            "function": self.function,
            "direction": self.direction,
            "guarantee": self.guarantee,
            "times": self.time_texts(),
            "directions": [int(value) for value in self.directions],
            "states": self.texts(),
            "discontinuities": [
                {"time": native_text(time, self.problem.precision), "kind": kind} for time, kind in self.discontinuities
            ],
        }

    def _table(self) -> TitledTable:
        title = (
            f"{plural(len(self), 'event')} {self.function} in {self.problem.precision.name} by {self.integrator}, "
            f"t = 0 to {six_digits(self.until)}"
        )
        notes = [_EXPLAINED[self.guarantee], *filter(None, [self.discontinuity_text()])]
        if self.outcome is not Outcome.SUCCESS:
            notes.append(f"{self.outcome.message}; searched to t = {six_digits(self.time_reached)} only")
        return _listed(self, title, self.problem.precision.digits, exact, notes)


class ReferenceEvents(Tabular, msgspec.Struct, frozen=True):
    """The events of a known motion, proven: each is there, and none is missed; its JSON is that of `reference
    --events`.

    function, direction: as in :class:`Events`.  guarantee: ``"proven"``.  method, digits, system: as of a reference.
    until: the time up to which was looked, as text.
    times, states: balls, shapes (n,) and (n, 6): the true number is within the radius of the value; the state is that
    at the true time.  directions: 1 where the function rises with time, −1 where it falls.
    """

    function: str
    direction: int
    guarantee: str
    method: str
    digits: int
    system: str
    until: str
    times: list[Ball]
    directions: list[int]
    states: list[list[Ball]]

    def __len__(self) -> int:
        return len(self.times)

    def texts(self) -> list[list[str]]:
        """The values of the states as decimal text, shape (n, 6)."""
        return [[ball.value for ball in state] for state in self.states]

    def time_texts(self) -> list[str]:
        """The values of the times as decimal text."""
        return [ball.value for ball in self.times]

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The values of the states rounded to double, shape (n, 6)."""
        return numpy.array([[float(ball.value) for ball in state] for state in self.states]).reshape(-1, 6)

    def times_numpy(self) -> NDArray[numpy.float64]:
        """The values of the times rounded to double, shape (n,)."""
        return numpy.array([float(ball.value) for ball in self.times], dtype=numpy.float64)

    def radii(self) -> NDArray[numpy.float64]:
        """The radii of the states rounded up to double, shape (n, 6)."""
        return numpy.array([[rounded_up(ball.radius) for ball in state] for state in self.states]).reshape(-1, 6)

    def _table(self) -> TitledTable:
        worst = max((Fraction(ball.radius) for ball in self.times), default=Fraction(0))
        until = six_digits(exact(self.until))
        title = f"{plural(len(self), 'event')} {self.function}, known to {self.digits} digits, t = 0 to {until}"
        radius = f"largest radius of a time {radius_text(worst)}; " if self.times else ""
        notes = [_EXPLAINED[PROVEN], f"{radius}{self.method}"]
        return _listed(self, title, self.digits, lambda ball: exact(ball.value), notes)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Section(Tabular):
    """A Poincaré section: the states of several motions of one top where a function changes sign.

    events: of each start in order, computed or proven.  energies, areas: ½ Ω·M + P r·γ and M·γ of each start; the
    points of motions on one level of both lie on one surface.
    """

    events: tuple[Events | ReferenceEvents, ...]
    energies: tuple[float, ...]
    areas: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.events)

    def points(self, x: str = "gamma1", y: str = "gamma2") -> list[NDArray[numpy.float64]]:
        """Two components of the states of each start, arrays of shape (n, 2)."""
        columns = [component(name) for name in (x, y)]
        return [event.to_numpy()[:, columns] for event in self.events]

    @property
    def on_one_level(self) -> bool:
        """Whether all starts have one energy and one M·γ, to 1e-9."""
        return all(max(v) - min(v) <= 1e-9 * max(1.0, *map(abs, v)) for v in (self.energies, self.areas))

    def _table(self) -> TitledTable:
        def line(index: int) -> list[str]:
            event = self.events[index]
            return [str(index), str(len(event)), f"{self.energies[index]:.9g}", f"{self.areas[index]:.9g}"]

        first = self.events[0]
        points = plural(sum(map(len, self.events)), "point")
        title = f"Poincaré section {first.function} of {plural(len(self), 'motion')}, {points}"
        notes = [] if self.on_one_level else ["the starts are on different levels of energy or M·γ"]
        return TitledTable(title, ("start", "points", "energy", "M·γ"), Lazy(len(self), line), notes)


_EXPLAINED = {
    POLYNOMIAL: "polynomial: no change of sign of the Taylor polynomials of the steps is missed",
    SAMPLED: "sampled: changes of sign between two samples of a step may be missed",
    PROVEN: "proven: each lies within its radius, and there is no other",
}


def _listed(
    events: Events | ReferenceEvents, title: str, digits: int, number: Callable[[Any], Fraction], notes: list[str]
) -> TitledTable:
    """A line for each event: its time, whether the function rises, and the state."""

    def line(index: int) -> list[str]:
        exactly = map(number, (events.times[index], *events.states[index]))
        time, *state = (decimal_text(value, min(_SHOWN, digits)) for value in exactly)
        return [time, "rises" if events.directions[index] > 0 else "falls", *state]

    return TitledTable(title, ("t", "sign", *NAMES), Lazy(len(events), line), notes)
