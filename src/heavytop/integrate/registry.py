"""Integrators by name or source, as callables that take the options asked for, and no others.

An option that an integrator does not have is refused where it is asked for, so none needs to take options that mean
nothing to it.  What each can do: :class:`heavytop.integrate.integrator.Integrator`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from types import FunctionType
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate import peers
from heavytop.integrate.integrator import IntegratorSource, described, loaded, name_of, require_reach
from heavytop.integrate.peers.command import Command, CommandIntegrator
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, Precision, exact
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State


def propagator(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    """What propagates one motion with that integrator; raises InputError for an unknown name or option.

    Its calls raise OutOfReach as :func:`heavytop.integrate.integrator.require_reach` does.
    """
    run = _unguarded(which, options)

    def call(
        top: HeavyTop,
        start: State,
        times: Sequence[Any],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        **more: Any,
    ) -> Any:
        if len(times):  # what is wrong with times is for the integrator to say
            require_reach(Problem.of(top, start, precision, system), exact(times[-1]), options.get("step_limit"))
        return run(top, start, times, precision, system=system, **more)

    return call


def _unguarded(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    name = name_of(which)
    if isinstance(which, Command):
        return _with(CommandIntegrator(which), name, options)
    found = described(which)
    if found.streams:
        return _with(loaded(found.propagate), name, options)
    _with(peers.peer(which), name, options)
    return _with(peers.ready(which), name, options)


def watched(
    which: str | IntegratorSource, options: dict[str, Any], observer: Callable[[Fraction, Any], None]
) -> Callable[..., Any]:
    """The same as :func:`propagator`, with every state given to ``observer``: by a peer at the end of its run."""
    if described(which).streams:
        return propagator(which, {**options, "observer": observer})
    run = propagator(which, options)

    def call(*arguments: Any, **more: Any) -> Any:
        found = run(*arguments, **more)
        for time, state in zip(found.times, found.states, strict=True):
            observer(time, state)
        return found

    return call


def ensemble_propagator(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    """What propagates many motions; raises InputError also for an integrator that runs one at a time.

    Its calls raise OutOfReach as those of :func:`propagator`.
    """
    found, name = described(which), name_of(which)
    if not found.ensemble:
        peers.require(which)
        raise InputError(f"The integrator {name} runs one motion at a time.", "Call propagate for each.")
    run = _with(loaded(found.ensemble), name, options)

    def call(problems: Sequence[Problem], times: Sequence[Any], **more: Any) -> Any:
        for problem in problems if len(times) else ():
            require_reach(problem, exact(times[-1]), options.get("step_limit"))
        return run(problems, times, **more)

    return call


@lru_cache(maxsize=64)
def _names(function: Callable[..., Any]) -> frozenset[str] | None:
    """What it takes by name; None where that is anything."""
    parameters = inspect.signature(function).parameters
    if any(each.kind is inspect.Parameter.VAR_KEYWORD for each in parameters.values()):
        return None
    return frozenset(parameters)


def _with(function: Callable[..., Any], name: str, options: dict[str, Any]) -> Callable[..., Any]:
    """``function`` with these options; raises InputError for one that it does not have."""
    # other callables may have no hash
    names = (_names if isinstance(function, FunctionType) else _names.__wrapped__)(function)
    for option in options:
        if names is not None and option not in names:
            raise InputError(f"The integrator {name} has no {option}.", f"Leave it out, or use another than {name}.")

    def call(*arguments: Any, **more: Any) -> Any:
        return function(*arguments, **more, **options)

    return call
