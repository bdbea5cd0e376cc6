"""Balls (python-flint's arb): enclosures of functions of exact numbers.

FLINT has one working precision for the whole process, so every evaluation is inside
:class:`heavytop.exact.flint.balls.working_precision`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Generator, Iterable, Sequence
from decimal import ROUND_CEILING, ROUND_HALF_EVEN, Decimal
from fractions import Fraction
from functools import wraps
from sys import getswitchinterval, setswitchinterval
from threading import RLock, get_ident
from types import SimpleNamespace
from typing import Any, ParamSpec, Protocol, Self, SupportsInt, TypeVar

from flint import acb_mat, arb, arb_mat, ctx, fmpq

from heavytop.errors import ExitCode, HeavyTopError, OutOfReach
from heavytop.precision import quotient_text, ratio_text
from heavytop.top.equations import Parameters
from heavytop.top.heavy_top import HeavyTop, State

# The largest length of exact data, and the unit of time in which a motion changes at a rate near 1.
#
# With Ω = s ω, τ = s t and P r = s² n the equations of ω, γ and n in τ are those of Ω, γ and P r in t.


_LONGEST = 1 << 15
"""Bits of a numerator or denominator: exact invariants have up to twenty times as many, and are made in seconds."""
_ORDINARY = 16


def require_handy(top: HeavyTop, start: State, times: Iterable[Fraction] = ()) -> None:
    """Raise OutOfReach for numbers whose exact arithmetic would take too long."""
    for value in (*top.inertia, *top.moment, *(top.rotor or ()), *start.flat, *times):
        length = max(value.numerator.bit_length(), value.denominator.bit_length())
        if length > _LONGEST:
            raise OutOfReach(
                f"The numbers of top, start and times must have at most {_LONGEST} bits; got {length}.",
                "Choose other units: 1e-9000 to 1e9000 are supported.",
            )


def unit_of_time(parameters: Parameters, start: tuple[Fraction, ...]) -> int:
    """k such that the motion changes at about the rate 2^k; 0 for rates from 2^-16 to 2^16.

    The rates are |Ω|, |λ| or |k|/I, and the root of |P r||γ|/I, whichever is largest.
    """
    turning = max(*map(abs, start[:3]), parameters.rotor_rate)
    weight = max(map(abs, parameters.moment)) * max(map(abs, start[3:6])) / min(parameters.inertia)
    rates = [exponent(turning)] * (turning > 0) + [exponent(weight) // 2] * (weight > 0)
    largest = max(rates, default=None)
    return 0 if largest is None or -_ORDINARY <= largest <= _ORDINARY else largest


def exponent(value: Fraction) -> int:
    """e with 2^(e − 1) < value < 2^(e + 1), value > 0."""
    return value.numerator.bit_length() - value.denominator.bit_length()


# FLINT's context, its working precision and length of power series, for one evaluation at a time.
#
# ``flint.ctx`` is shared by the whole process.  So every evaluation of this program is inside a block that sets it,
# :class:`working_precision` or :class:`series_length`, and one re-entrant lock admits one thread at a time.
#
# A thread of the user may still set ``flint.ctx`` meanwhile.  So each block compares the context with the one that it
# set, at its entry and at its exit; if they differ, it raises :class:`ContextChanged`, and :func:`whole_evaluation`,
# the decorator of complete evaluations, evaluates again.  After the first such change threads are switched less often
# during an evaluation, so that it succeeds.  At the end the context is the user's again.
#
# No code of the user (an observer, another package's integrator) may be called inside a block: it might wait for a
# thread that waits for the lock.
#
# Ctrl-C comes after a call at the earliest.  From Python 3.14 on ``with _lock`` calls, and Ctrl-C between the lock and
# its block would leave it held.  So the lock is acquired within a ``try``, and released by the first call of its
# ``finally``; where Ctrl-C came before the lock was acquired, that raises RuntimeError.


P = ParamSpec("P")
Result = TypeVar("Result")

_DEFAULTS = 53, 10
"""FLINT's default precision and length, from which an outermost block starts, whatever the user's are."""
_ATTEMPTS = 7
_UNHURRIED = 0.05
"""Seconds between two switches of threads in an evaluation that was disturbed before; times four at each attempt."""


class ContextChanged(HeavyTopError):
    """Another thread set ``flint.ctx`` during every attempt of an evaluation."""

    exit_code = ExitCode.INCOMPLETE

    def __init__(self) -> None:
        super().__init__(
            "Another thread of this process keeps changing flint.ctx while balls are evaluated.",
            "Set flint.ctx once, before threads are started, or evaluate in a process of its own.",
        )


class _Held:
    """The evaluating thread and the intended context; changed only by the thread that owns the lock.

    thread: 0 for none.  context: the precision and length set by this program.  own: the user's, to be restored.
    disturbed: whether the context was changed since the outermost block began; ever: in this process.
    """

    __slots__ = ("context", "disturbed", "ever", "own", "thread")

    def __init__(self) -> None:
        self.thread = 0
        self.context = self.own = _DEFAULTS
        self.disturbed = self.ever = False


_lock = RLock()
_held = _Held()


def _note() -> None:
    """Record the context that the user has set meanwhile, and restore the intended one."""
    precision, context, users = (ctx.prec, ctx.cap), _held.context, _held.own
    _held.disturbed = _held.ever = True
    _held.own = (
        users[0] if precision[0] == context[0] else precision[0],
        users[1] if precision[1] == context[1] else precision[1],
    )
    ctx.prec, ctx.cap = context


def _set(context: tuple[int, int]) -> None:
    """Set the context where it differs: FLINT's setter also computes decimal digits."""
    precision, length = context
    if ctx.prec != precision:
        ctx.prec = precision
    if ctx.cap != length:
        ctx.cap = length


def current_precision() -> int:
    """The precision of the enclosing block, whatever another thread has set meanwhile."""
    return _held.context[0]


def current_length() -> int:
    """The length of power series of the enclosing block, whatever another thread has set meanwhile."""
    return _held.context[1]


def require_undisturbed() -> None:
    """Raise ContextChanged if the context was changed since the evaluation began; called before a result is cached."""
    if (ctx.prec, ctx.cap) != _held.context:
        _note()
    if _held.disturbed:
        raise ContextChanged


def _alone(thread: int) -> Generator[None, None, None]:
    """Hold the lock from the first ``next`` until it is closed or deleted, whenever Ctrl-C comes."""
    try:
        _lock.acquire()
        _held.own = ctx.prec, ctx.cap
        _held.context, _held.disturbed = _DEFAULTS, False
        _held.thread = thread
        try:
            yield
        finally:
            _held.thread = 0
            ctx.prec, ctx.cap = _held.own
    finally:
        try:  # noqa: SIM105 - no call before it
            _lock.release()
        except RuntimeError:
            pass


class _Block:
    """The base of both blocks.  precision, length: None for unchanged."""

    __slots__ = ("before", "holding", "length", "precision")
    precision: int | None
    length: int | None

    def __enter__(self) -> None:
        me = get_ident()
        self.holding = None if _held.thread == me else _alone(me)
        self.before = _DEFAULTS if self.holding else _held.context
        precision, length = self.before
        try:
            if self.holding:
                next(self.holding)
            elif (ctx.prec, ctx.cap) != _held.context:
                _note()
            _held.context = (
                precision if self.precision is None else self.precision,
                length if self.length is None else self.length,
            )
            _set(_held.context)
        except BaseException:  # Ctrl-C, or a precision that FLINT refuses
            if self.holding:
                self.holding.close()
            else:
                ctx.prec, ctx.cap = _held.context = self.before
            raise

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if (ctx.prec, ctx.cap) != _held.context:
            _note()
        disturbed, outermost = _held.disturbed, self.holding is not None
        if self.holding:
            self.holding.close()
        else:  # no call, after which Ctrl-C might come, between both contexts
            precision, length = self.before
            if ctx.prec != precision:
                ctx.prec = precision
            if ctx.cap != length:
                ctx.cap = length
            _held.context = self.before
        if disturbed and (kind is None or (outermost and issubclass(kind, Exception))):
            raise ContextChanged


class working_precision(_Block):  # noqa: N801 - reads as a verb
    """FLINT's working precision set to ``bits`` ≥ 2 within the block, for this thread alone.

    length: of power series, as in :class:`series_length`; None for that of the enclosing block.
    Raises ContextChanged at the end where another thread changed the context meanwhile.
    """

    __slots__ = ()

    def __init__(self, bits: int, length: int | None = None) -> None:
        self.precision, self.length = bits, length


class series_length(_Block):  # noqa: N801 - reads as a verb
    """FLINT's cap on the length of power series set to ``length`` ≥ 1 within the block, for this thread alone.

    Raises ContextChanged at the end where another thread changed the context meanwhile.
    """

    __slots__ = ()

    def __init__(self, length: int) -> None:
        self.precision, self.length = None, length


def whole_evaluation(function: Callable[P, Result]) -> Callable[P, Result]:
    """``function`` with an undisturbed context; it is called again where another thread changed the context.

    function: evaluates balls, can be repeated, and calls no code of the user.
    The result raises ContextChanged after seven disturbed evaluations.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> Result:
        me = get_ident()
        if _held.thread == me:
            return function(*args, **kwargs)
        for attempt in range(_ATTEMPTS):
            try:
                _lock.acquire()
                _held.own = ctx.prec, ctx.cap
                interval = None
                try:
                    _held.disturbed, _held.context = False, _DEFAULTS
                    _held.thread = me
                    if _held.own != _DEFAULTS:
                        ctx.prec, ctx.cap = _DEFAULTS
                    if _held.ever:
                        interval = getswitchinterval()
                        setswitchinterval(max(interval, _UNHURRIED * 4**attempt))
                    result = function(*args, **kwargs)
                    if _held.disturbed or (ctx.prec, ctx.cap) != _held.context:
                        require_undisturbed()
                    return result
                except ContextChanged:
                    _held.ever = True
                except Exception:
                    if (ctx.prec, ctx.cap) == _held.context and not _held.disturbed:
                        raise
                    _note()
                finally:
                    _held.thread = 0
                    if (ctx.prec, ctx.cap) != _held.own:
                        ctx.prec, ctx.cap = _held.own
                    if interval is not None:
                        setswitchinterval(interval)
            finally:
                try:  # noqa: SIM105 - no call before it
                    _lock.release()
                except RuntimeError:
                    pass
        raise ContextChanged

    return alone


def coefficient(series: Any, order: int) -> Any:
    """The coefficient of ε^order of a power series; raises ContextChanged where it was cut off.

    FLINT gives 0 for a coefficient that a changed ``ctx.cap`` cut off: a wrong number, where a changed precision gives
    a wide ball only.
    """
    if order >= series.prec:
        raise ContextChanged
    return series[order]


def _after_fork() -> None:
    """Replace a lock that another thread held at the fork: the child has no thread that could release it."""
    global _lock
    if _held.thread not in (0, get_ident()):
        _lock = RLock()
        ctx.prec, ctx.cap = _held.own
        _held.thread = 0


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


class BallLike(Protocol):
    """The arithmetic that balls, complex balls and power series of either have in common."""

    def __neg__(self) -> Self: ...
    def __add__(self, other: Any, /) -> Self: ...
    def __radd__(self, other: Any, /) -> Self: ...
    def __sub__(self, other: Any, /) -> Self: ...
    def __rsub__(self, other: Any, /) -> Self: ...
    def __mul__(self, other: Any, /) -> Self: ...
    def __rmul__(self, other: Any, /) -> Self: ...
    def __truediv__(self, other: Any, /) -> Self: ...
    def __rtruediv__(self, other: Any, /) -> Self: ...
    def __pow__(self, other: Any, /) -> Self: ...
    def sqrt(self) -> Self: ...
    def exp(self) -> Self: ...
    def log(self) -> Self: ...
    def sin(self) -> Self: ...
    def cos(self) -> Self: ...
    def sin_cos(self) -> tuple[Self, Self]: ...


Balls = TypeVar("Balls", bound=BallLike)
"""Balls, complex balls or power series: the type of the arguments and of the result."""


FUNCTIONS = SimpleNamespace(
    sqrt=arb.sqrt,
    exp=arb.exp,
    log=arb.log,
    sin=arb.sin,
    cos=arb.cos,
    tanh=arb.tanh,
    cosh=arb.cosh,
    arctan=arb.atan,
    arccos=arb.acos,
    atan2=lambda y, x: arb.atan2(y, x),
)
_MAX_BITS = 1 << 22
_HALF = arb(0.5)
_INTEGER = re.compile(r"-?[0-9]+")
_GUARD, _STEP = 16, 64
_RADIUS_BITS = 30
_RADIUS_DIGITS = 3
_ENOUGH = 1 << 15
"""Working bits that are always tried, for tops whose moments, weight and spin differ by a thousand decades."""
_SERIES_DIVISION = ("leading term in denominator is not nonzero", "quotient would not be a power series")
"""Message of python-flint on a division by a power series whose first coefficient may be 0, instead of nan."""


class Undecided(ArithmeticError):
    """The working precision does not decide a discrete question."""


def the_only(candidates: Sequence[Result]) -> Result:
    """The one candidate that balls do not exclude; raises Undecided where none or several are left."""
    if len(candidates) != 1:
        raise Undecided
    return candidates[0]


def rational(value: Fraction | int) -> fmpq:
    """``value`` as FLINT's fraction."""
    return fmpq(value.numerator, value.denominator)


def ball(value: Fraction | int) -> arb:
    """``value`` as a ball at the working precision; of radius 0 where it is a binary number that fits."""
    return arb(rational(value))


def midpoint(value: arb) -> Fraction:
    """The exact midpoint of a finite ball."""
    return _fraction(*value.mid().man_exp())


def radius(value: arb) -> Fraction:
    """The exact radius of a finite ball."""
    return _fraction(*value.rad().man_exp())


def _fraction(mantissa: SupportsInt, exponent: SupportsInt) -> Fraction:
    """mantissa · 2^exponent."""
    m, e = int(mantissa), int(exponent)
    return Fraction(m << e) if e >= 0 else Fraction(m, 1 << -e)


def radius_text(value: Fraction) -> str:
    """A radius as decimal text of three digits, rounded up."""
    return quotient_text(value, _RADIUS_DIGITS, ROUND_CEILING)


def ball_text(value: arb) -> str:
    """A ball as text, ``m e r s`` for m 2^e ± r 2^s, or ``nan``; :func:`ball_from` restores the same ball."""
    if not value.is_finite():
        return "nan"
    # Decimal, as Python limits the digits of an int in text
    return " ".join(str(Decimal(int(part))) for part in (*value.mid().man_exp(), *value.rad().man_exp()))


@whole_evaluation
def ball_from(text: str) -> arb:
    """The ball of :func:`ball_text`.  Raises ValueError for other text."""
    if text == "nan":
        return arb("nan")
    m, e, r, s = (_integer(part) for part in text.split())
    if not r:
        return arb((m, e))
    with working_precision(m.bit_length() + 64):
        value = arb((m, e), (r, s))
        if r.bit_length() == _RADIUS_BITS:
            # FLINT rounds such a radius up at input, and adds one unit for a tiny addition
            value = arb((m, e), (r - 1, s)) + arb(0, (1, s - 100))
    if ball_text(value) != text:
        raise ValueError(f"no ball is {text[:60]!r}")
    return value


def _integer(text: str) -> int:
    if not _INTEGER.fullmatch(text):
        raise ValueError(f"no integer is {text[:60]!r}")
    return int(Decimal(text))


def value_text(value: arb, digits: int) -> tuple[str, str]:
    """(value, radius) as decimal text: the radius includes the rounding of the printed value.

    A ball that contains 0 is printed as 0 with its largest absolute value as the radius.
    """
    (m, e), (r, s) = ((int(part[0]), int(part[1])) for part in (value.mid().man_exp(), value.rad().man_exp()))
    # over one denominator, not reduced
    unit = min(e, s, 0)
    middle, wide = m << (e - unit), r << (s - unit)
    text = "0" if abs(middle) <= wide else ratio_text(middle, 1 << -unit, digits, ROUND_HALF_EVEN)
    above, below = Decimal(text).as_integer_ratio()
    error = wide * below + abs((above << -unit) - middle * below)
    return text, ratio_text(error, below << -unit, _RADIUS_DIGITS, ROUND_CEILING)


@whole_evaluation
def nearest_integer(value: arb) -> int:
    """The integer nearest to the midpoint of a ball; 0 if it is not finite."""
    nearest = (value + _HALF).mid().floor().unique_fmpz()
    return 0 if nearest is None else int(nearest)


def relative_bits(value: arb) -> int:
    """Correct bits of a ball, relative above 1 and absolute below 1; -1 if it is not finite."""
    return max(0, min(_MAX_BITS, value.rel_one_accuracy_bits())) if value.is_finite() else -1


def _size(value: arb) -> int:
    """The smallest e with |value| < 2^e, of an exact ball; a large negative number for 0."""
    mantissa, exponent = value.man_exp()
    return int(exponent) + int(mantissa).bit_length() if mantissa else -_MAX_BITS


def _graspable(value: arb, smallest: int) -> arb:
    """``value``, or a ball around 0 that contains it where it is smaller than 2^smallest.

    Near a saddle components fall like e^(−t): at t = 10^6 their exact midpoints have a million bits.
    """
    if float(value) or value.is_zero() or max(_size(value.mid()), _size(value.rad())) > smallest:
        return value
    return arb(0, arb(2) ** (smallest + 1))


@whole_evaluation
def to_bits(
    evaluate: Callable[[int], list[arb]], bits: int, time: Fraction | None = None, length: int = 1
) -> list[arb]:
    """``evaluate(working bits)`` repeated at growing working precision until every ball has ``bits`` bits.

    Bits count relative to a value above 1 and absolutely below it; Undecided counts as no correct bit.
    time: of the evaluation; its size costs bits, and the precision is then a multiple of 64, so that lattices are
    cached.
    length: of power series.
    Raises OutOfReach where even a precision of 16 times ``bits`` plus 4096, or of 32768, does not suffice.
    """
    extra = -1 if time is None else _GUARD + (abs(time.numerator) // time.denominator).bit_length()
    working, smallest = bits + 32, -16 * bits - 4096
    most = max(-smallest, _ENOUGH)
    while True:
        inside = working if extra < 0 else -(-(working + extra) // _STEP) * _STEP
        try:
            with working_precision(inside, length):
                values = evaluate(inside)
        except Undecided:
            values = [arb("nan")]
        except ValueError as error:
            if str(error) not in _SERIES_DIVISION:
                raise
            values = [arb("nan")]
        right = [value.rel_one_accuracy_bits() for value in values]
        if min(right) >= bits:
            # only exact, infinite and very small values have more bits right than that
            if max(right) < -smallest:
                return values
            if all(value.is_finite() for value in values):
                return [v if r < -smallest else _graspable(v, smallest) for v, r in zip(values, right, strict=True)]
        reached = min(map(relative_bits, values))
        if working >= most:
            raise OutOfReach(
                f"Only {max(reached, 0)} of {bits} bits could be proven at a working precision of {inside} bits.",
                "Request fewer digits or an earlier time; moments, weights and rates of very different size cost most.",
            )
        working = min(most, working + (max(bits - reached, working // 2) if reached >= 0 else working))


# The largest singular value of a real matrix of balls, enclosed.


@whole_evaluation
def largest_singular_value(matrix: list[list[arb]], bits: int) -> arb:
    """σ ≥ 0 with σ² the largest eigenvalue of S = JᵀJ: a ball, as narrow as ``matrix`` allows to ``bits`` bits.

    From below Rayleigh's quotient of any vector, here an approximate eigenvector, at most σ².  From above any μ such
    that μ − S is positive definite, which Cholesky's factorisation in balls proves: μ is the quotient plus a margin,
    which grows sixteenfold until the factorisation exists.  Several equal singular values need no special case.
    An infinite ball where no such μ is found.
    """
    with working_precision(2 * bits + 64):
        entries = arb_mat(matrix)
        square = entries.transpose() * entries
        below = _quotient(square)
        margin = below.abs_upper() * arb(2) ** -(bits + 8)
        for _ in range(bits // 4 + 16):
            above = (below + margin).upper()
            if _positive_definite(above, square):
                return below.lower().sqrt().union(above.sqrt())
            margin = margin * 16
        return arb(0, arb("inf"))


def _quotient(square: arb_mat) -> arb:
    """xᵀSx/xᵀx of the approximate eigenvector x of the largest eigenvalue."""
    size = square.nrows()
    middle = acb_mat([[square[i, j].mid() for j in range(size)] for i in range(size)])
    values, vectors = middle.eig(right=True, algorithm="approx")
    largest = max(range(size), key=lambda k: float(values[k].real.mid() / (1 + values[0].real.abs_upper())))
    x = arb_mat([[vectors[i, largest].real.mid()] for i in range(size)])
    numerator, denominator = (x.transpose() * square * x)[0, 0], (x.transpose() * x)[0, 0]
    return numerator / denominator


def _positive_definite(shift: arb, square: arb_mat) -> bool:
    """Whether shift − S is positive definite: every pivot of its L D Lᵀ factorisation is proven to be positive."""
    size = square.nrows()
    remaining = [[(shift if i == j else arb(0)) - square[i, j] for j in range(size)] for i in range(size)]
    for k in range(size):
        pivot = remaining[k][k]
        if not pivot > 0:
            return False
        for i in range(k + 1, size):
            for j in range(k + 1, i + 1):
                remaining[i][j] = remaining[j][i] = remaining[i][j] - remaining[i][k] * remaining[j][k] / pivot
    return True
