"""The integrators that have a name, and what each is called with.  A new one is a line in :data:`INTEGRATORS`.

The two functions of an integrator are called as :func:`heavytop.integrate.taylor.propagate` and
:func:`heavytop.integrate.ensemble.propagate_ensemble`.  An option that one of them does not have is refused where it is
asked for, so no integrator needs to take options that mean nothing to it.  Peers serve under their own names.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from importlib.metadata import EntryPoint
from types import FunctionType
from typing import Any, NamedTuple

from heavytop.errors import InputError, quoted
from heavytop.integrate import peers
from heavytop.integrate.peers.command import Command, CommandIntegrator
from heavytop.integrate.peers.source import Source
from heavytop.integrate.reach import require_reach
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, Precision, exact
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

HERE = "heavytop.integrate"


class Integrator(NamedTuple):
    """Where the functions of an integrator are, as ``module:name``; ensemble: "" where it runs one motion at a time."""

    propagate: str
    ensemble: str = ""


INTEGRATORS = {
    "heyoka": Integrator(f"{HERE}.taylor:propagate", f"{HERE}.ensemble:propagate_ensemble"),
    "multiword": Integrator(f"{HERE}.words:propagate_words", f"{HERE}.words_ensemble:propagate_words_ensemble"),
}


def propagator(which: str | Source, options: dict[str, Any]) -> Callable[..., Any]:
    """What propagates one motion with that integrator; raises InputError for an unknown name or option.

    Its calls raise OutOfReach as :func:`heavytop.integrate.reach.require_reach` does.
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


def _unguarded(which: str | Source, options: dict[str, Any]) -> Callable[..., Any]:
    if isinstance(which, Command):
        return _with(CommandIntegrator(which), which.name, options)
    if not isinstance(which, str) or (which not in INTEGRATORS and which in peers.known()):
        _with(peers.peer(which), peers.name_of(which), options)
        return _with(peers.ready(which), peers.name_of(which), options)
    return _with(_load(_find(which).propagate), which, options)


def watched(
    which: str | Source, options: dict[str, Any], observer: Callable[[Fraction, Any], None]
) -> Callable[..., Any]:
    """The same as :func:`propagator`, with every state given to ``observer``: by a peer at the end of its run."""
    if isinstance(which, str) and which in INTEGRATORS:
        return propagator(which, {**options, "observer": observer})
    run = propagator(which, options)

    def call(*arguments: Any, **more: Any) -> Any:
        found = run(*arguments, **more)
        for time, state in zip(found.times, found.states, strict=True):
            observer(time, state)
        return found

    return call


def ensemble_propagator(which: str | Source, options: dict[str, Any]) -> Callable[..., Any]:
    """What propagates many motions; raises InputError also for an integrator that runs one at a time.

    Its calls raise OutOfReach as those of :func:`propagator`.
    """
    one_at_a_time = not isinstance(which, str) or (which not in INTEGRATORS and which in peers.known())
    place = "" if one_at_a_time else _find(peers.name_of(which)).ensemble
    if not place:
        name = peers.name_of(which)
        raise InputError(f"The integrator {name} runs one motion at a time.", "Call propagate for each.")
    run = _with(_load(place), peers.name_of(which), options)

    def call(problems: Sequence[Problem], times: Sequence[Any], **more: Any) -> Any:
        for problem in problems if len(times) else ():
            require_reach(problem, exact(times[-1]), options.get("step_limit"))
        return run(problems, times, **more)

    return call


def _find(name: str) -> Integrator:
    found = INTEGRATORS.get(name) if isinstance(name, str) else None
    if found is None:
        known = ", ".join([*INTEGRATORS, *(peer for peer in peers.known() if peer not in INTEGRATORS)])
        raise InputError(f"Unknown integrator {quoted(name)}.", f"Known: {known}.")
    return found


@lru_cache(maxsize=16)
def _load(place: str) -> Callable[..., Any]:
    found: Callable[..., Any] = EntryPoint("", place, "").load()
    return found


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
