"""FLINT's context, its working precision and length of power series, one evaluation at a time.

``flint.ctx`` is one for the whole process.  So every evaluation of this program stands inside a block that sets it,
:class:`working_precision` or :class:`series_length`, and one re-entrant lock admits one thread at a time to them.

That keeps the threads of this program apart.  A thread of the user may still set ``flint.ctx`` meanwhile.  So each
block looks on its way in and out whether the context is the one that it set; if not, :class:`ContextChanged` is raised,
and :func:`whole_evaluation`, the decorator of what evaluates from beginning to end, evaluates again.  From the first
such change on, other threads are let in less often during an evaluation, so that it comes through.  At the end the
context is what the user made it.

Nothing of the user's (an observer, another package's integrator) may be called inside a block: it might wait for a
thread that waits for the lock.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from sys import getswitchinterval, setswitchinterval
from threading import RLock, get_ident
from typing import Any, ParamSpec, TypeVar

from flint import ctx

from heavytop.errors import HeavyTopError

P = ParamSpec("P")
Found = TypeVar("Found")

_DEFAULTS = 53, 10
"""FLINT's own precision and length: what an outermost block that does not set both finds, whatever the user's are."""
_ATTEMPTS = 7
_UNHURRIED = 0.05
"""Seconds between two switches of threads in an evaluation that was disturbed before; four times as long each time."""


class ContextChanged(HeavyTopError):
    """Another thread set ``flint.ctx`` during an evaluation, each time that it was tried."""

    exit_code = 3

    def __init__(self) -> None:
        super().__init__(
            "Another thread of this process keeps changing flint.ctx while balls are evaluated.",
            "Set flint.ctx once, before threads are started, or evaluate in a process of its own.",
        )


class _Held:
    """Who evaluates now, and what the context is meant to be; changed by the thread that owns the lock alone.

    thread: 0 for none.  context: the precision and length set by this program.  own: the user's, to be put back.
    disturbed: whether the context was found changed since the outermost block began; ever: in this process.
    """

    __slots__ = ("context", "disturbed", "ever", "own", "thread")

    def __init__(self) -> None:
        self.thread = 0
        self.context = self.own = _DEFAULTS
        self.disturbed = self.ever = False


_lock = RLock()
_held = _Held()


def _note() -> None:
    """The context is not what it was set to: remember what the user wants from now on, and set it again."""
    found, wanted, own = (ctx.prec, ctx.cap), _held.context, _held.own
    _held.disturbed = _held.ever = True
    _held.own = own[0] if found[0] == wanted[0] else found[0], own[1] if found[1] == wanted[1] else found[1]
    ctx.prec, ctx.cap = wanted


def _set(context: tuple[int, int]) -> None:
    """Set what is not set already: FLINT's setter works out decimal digits each time."""
    precision, length = context
    if ctx.prec != precision:
        ctx.prec = precision
    if ctx.cap != length:
        ctx.cap = length


def current_precision() -> int:
    """The precision of the block that this stands in, whatever another thread has made of ``flint.ctx`` meanwhile."""
    return _held.context[0]


def current_length() -> int:
    """The length of power series of the block that this stands in, as :func:`current_precision`."""
    return _held.context[1]


def require_undisturbed() -> None:
    """Raise ContextChanged if the context was changed since the evaluation began: before something is kept."""
    if (ctx.prec, ctx.cap) != _held.context:
        _note()
    if _held.disturbed:
        raise ContextChanged


class _Block:
    """What the two blocks share.  precision, length: None for the one that stays."""

    __slots__ = ("before", "length", "outermost", "precision")
    precision: int | None
    length: int | None

    def __enter__(self) -> None:
        me = get_ident()
        self.outermost = _held.thread != me
        if self.outermost:
            _lock.acquire()
            _held.own = ctx.prec, ctx.cap
            _held.thread, _held.context, _held.disturbed = me, _DEFAULTS, False
        elif (ctx.prec, ctx.cap) != _held.context:
            _note()
        self.before = precision, length = _held.context
        _held.context = (
            precision if self.precision is None else self.precision,
            length if self.length is None else self.length,
        )
        try:
            _set(_held.context)
        except BaseException:  # no precision: FLINT says what is wrong with it
            ctx.prec, ctx.cap = _held.context = self.before
            self.__exit__(BaseException)
            raise

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if (ctx.prec, ctx.cap) != _held.context:
            _note()
        disturbed = _held.disturbed
        if self.outermost:
            _set(_held.own)
            _held.thread = 0
            _lock.release()
        else:
            _held.context = self.before
            _set(self.before)
        if disturbed and (kind is None or (self.outermost and issubclass(kind, Exception))):
            raise ContextChanged


class working_precision(_Block):  # noqa: N801 - reads as a verb
    """FLINT's working precision set to ``bits`` ≥ 2 within the block, for this thread alone.

    length: of power series, as :class:`series_length` sets it; None for the one around the block.
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


def at_precision(bits: int, length: int, evaluate: Callable[[int], Found]) -> Found:
    """``evaluate(bits)`` as inside :class:`working_precision`, for the thread that evaluates already.

    It spares the block that every state would make.  Raises ContextChanged as the block does.
    """
    before = _held.context
    _held.context = ctx.prec, ctx.cap = bits, length
    try:
        found = evaluate(bits)
    finally:
        if (ctx.prec, ctx.cap) != _held.context:
            _note()
        _held.context = ctx.prec, ctx.cap = before
    if _held.disturbed:
        raise ContextChanged
    return found


def whole_evaluation(function: Callable[P, Found]) -> Callable[P, Found]:
    """``function`` with the context for itself from beginning to end, and again where another thread changed it.

    function: evaluates balls; gives the same when it is called again, and calls nothing of the user's.
    The result raises ContextChanged after seven disturbed evaluations.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> Found:
        me = get_ident()
        if _held.thread == me:
            return function(*args, **kwargs)
        for attempt in range(_ATTEMPTS):
            # a statement, not calls: Ctrl-C cannot come between the lock and its block, nor between the last lines
            with _lock:
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
                    found = function(*args, **kwargs)
                    if _held.disturbed or (ctx.prec, ctx.cap) != _held.context:
                        require_undisturbed()
                    return found
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
    """A forked child has no other thread: none that could release the lock."""
    global _lock
    if _held.thread not in (0, get_ident()):
        _lock = RLock()
        ctx.prec, ctx.cap = _held.own
        _held.thread = 0


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
