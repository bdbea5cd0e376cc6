"""Events from Python: times at which a function of the state changes sign, and Poincaré sections."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any, overload

from heavytop import arguments
from heavytop.arguments import Number
from heavytop.errors import InputError, OutOfReach, prefixed, quoted, refusal
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import require_handy, value_text
from heavytop.exact.resolved import Resolved, resolve
from heavytop.features.events.functions import (
    PROVEN,
    Events,
    ReferenceEvents,
    Section,
    Wanted,
    event_function,
    first_term,
    in_body_axes,
)
from heavytop.features.events.located import locate
from heavytop.features.events.proven import proven_events
from heavytop.integrate.dense import dense
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import named
from heavytop.measure.reference import DIGITS, Ball
from heavytop.precision import DOUBLE, Precision, as_integer, exact_text, physical
from heavytop.top.amplification import amplification
from heavytop.top.bodies import Body
from heavytop.top.equations import System, area, energy
from heavytop.top.heavy_top import HeavyTop, State

_DATA_BITS = 192
Function = str | Callable[[Any, Any], Any]
"""Text such as "omega1" or "gamma3 = 1/2", or a callable of (Ω, γ) that gives a number."""
Reached = Callable[[Fraction], None]


@overload
def events(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    function: Function = "omega1",
    direction: int = 0,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str = "heyoka",
    digits: None = None,
    system: System | str | None = None,
    tolerance: Number | None = None,
    step_limit: int | None = None,
    limit: int | None = None,
    reached: Reached | None = None,
) -> Events: ...


@overload
def events(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    function: Function = "omega1",
    direction: int = 0,
    *,
    digits: int,
    system: System | str | None = None,
    limit: int | None = None,
    reached: Reached | None = None,
) -> ReferenceEvents: ...


def events(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    function: Function = "omega1",
    direction: int = 0,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str = "heyoka",
    digits: int | None = None,
    system: System | str | None = None,
    tolerance: Number | None = None,
    step_limit: int | None = None,
    limit: int | None = None,
    reached: Reached | None = None,
) -> Events | ReferenceEvents:
    """The times strictly between 0 and ``until`` at which a function of the state changes sign, and the states there.

    Arguments:
        top, start: as in :func:`propagate`; of a body in its own axes the function and the states are of those axes.
        until: an exact number of either sign, not 0.
        function: a rational function as text, ``"omega1"``, ``"gamma3 = 1/2"``, ``"omega1*gamma2 - omega2*gamma1"``; or
            a callable of (Ω, γ), called once with indeterminates. One that needs numbers (``math.sin``, ``abs``) is
            sampled.
        direction: 1 for events at which it rises with time, −1 where it falls, 0 for all.
        precision, system, tolerance, step_limit: as in :func:`propagate`.
        integrator: "heyoka" or the multi-word integrator; others hand over no polynomial of their steps.
        digits: None for a computed motion; 1 to 20,000 for proven events of the true motion, in place of ``precision``
            and ``integrator``.
        limit: stop after so many events.
        reached: called with the times on the way.

    Returns:
        :class:`Events`: ``times`` (n,), ``states`` (n, 6) and ``directions`` (n,), each time and state rounded once
        from the Taylor polynomial of its step, and ``guarantee``; or with ``digits`` :class:`ReferenceEvents`, whose
        times and states are balls. t = 0 is not an event, also where the function vanishes there; a zero that is only
        touched is not.

    Raises:
        InputError: for an invalid motion, time or function; where the function is zero along the motion, or raises.
        OutOfReach: for more than 1e8 steps; with ``digits`` beyond the reach of the enclosure, and where it is not
            decided whether the function changes sign or only touches zero.
    """
    which, way = event_function(function), require_direction(direction)
    wanted = Wanted(which, way, arguments.count(limit, "limit"), arguments.callback(reached, "reached"))
    if digits is None:
        form = arguments.precision(precision)
        body, state = arguments.motion(top, start, form)
        setup = Setup.of(body, state, form, arguments.system(system, body))
        named_one, axes = named(integrator), None if setup.frame is None else setup.frame.axes
        end, limits = _until(until), (arguments.tolerance(tolerance, form), arguments.steps(step_limit))
        own = which if axes is None else in_body_axes(which, axes)
        exact = setup.system.parameters(setup.top, setup.start), setup.start.flat
        order = first_term(own, setup.system, *exact)[0] if which.rational else 0
        run = dense(named_one, setup.problem, end, *limits)
        return locate(run, str(named_one), wanted, axes, order)
    if (precision, integrator, tolerance, step_limit) != (DOUBLE, "heyoka", None, None):
        raise InputError(
            "Proven events (digits) do not support precision, integrator, tolerance or step_limit.",
            "Leave these out, or digits.",
        )
    body, state = arguments.motion(top, start, of_any_size=True)
    known = arguments.system(system, body), _until(until), wanted, as_integer(digits, "digits")
    return _known_events(body, state, *known)


def _known_events(
    top: HeavyTop | Body, start: State, system: System, until: Fraction, wanted: Wanted, digits: int
) -> ReferenceEvents:
    """Proven events of a motion that was checked."""
    function = wanted.function
    if digits not in DIGITS:
        raise refusal("digits", "from 1 to 20000", quoted(digits), "Give, for example, 50.")
    if not function.rational:
        raise refusal(
            "For a proof the function",
            "rational in Ω and γ",
            quoted(function.name),
            "Use +, -, * and / alone, or leave out digits.",
        )
    resolved = _resolved(top, start, until, digits, system)
    require_handy(resolved.top, resolved.start, [until])
    method = "validated: Taylor enclosure" + (" of irrational data" if resolved.uncertainty else "")
    solution = Validated(resolved.top, resolved.start, system, method=method, uncertainty=resolved.uncertainty)
    try:
        events = proven_events(solution, until, wanted, digits, resolved)
    except OutOfReach as error:
        remedy = f"{error.remedy} Computed ones reach further: leave digits out, and ask for quad or real:BITS."
        raise OutOfReach(error.cause, remedy) from None
    return ReferenceEvents(
        function=function.name,
        direction=wanted.direction,
        guarantee=PROVEN,
        method=solution.method,
        digits=digits,
        system=system.name,
        until=exact_text(until),
        times=[Ball(*value_text(event.time, digits + 1)) for event in events],
        directions=[1 if event.rising else -1 for event in events],
        states=[[Ball(*value_text(value, digits + 1)) for value in event.state] for event in events],
    )


def _resolved(top: HeavyTop | Body, start: State, until: Fraction, digits: int, system: System) -> Resolved:
    """The motion in principal axes; irrational data to as many bits as the motion loses until then, and more."""
    resolved_start = resolve(top, start)
    if resolved_start.uncertainty is None:
        return resolved_start
    lost = amplification(
        system, system.parameters(resolved_start.top, resolved_start.start), resolved_start.start.flat, until
    )
    return resolve(top, start, _DATA_BITS + math.ceil(digits * math.log2(10) + 2 * math.log2(max(1.0, lost))))


def poincare(
    top: HeavyTop | Body,
    starts: State | Iterable[State],
    until: Number,
    function: Function = "omega1",
    direction: int = 1,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str = "heyoka",
    digits: int | None = None,
    system: System | str | None = None,
    limit: int | None = None,
) -> Section:
    """The Poincaré section of one or several motions of a top: their states where a function changes sign.

    Arguments:
        starts: one or several; on one level of energy and M·γ their points lie on one surface.
        direction: 1 (rising), −1 or 0, as in :func:`events`; 1 here, for a section is crossed in one direction.
        until, function, precision, integrator, digits, system, limit: as in :func:`events`, for each start.

    Returns:
        A :class:`Section`: ``events``, those of each start; ``points(x, y)``, two components of each as arrays of shape
        (n, 2); ``energies``, ``areas`` and ``on_one_level``.

    Raises:
        InputError, OutOfReach: as :func:`events`, naming the start.
    """
    listed = arguments.listed(starts, State, "starts")
    if digits is not None and (precision, integrator) != (DOUBLE, "heyoka"):
        raise InputError(
            "A proven section (digits) does not support precision or integrator.", "Leave these out, or digits."
        )
    if not listed:
        raise InputError("No starts were given.", "Give at least one State.")
    how: dict[str, Any] = {"precision": precision, "integrator": integrator} if digits is None else {"digits": digits}
    sections: list[Events | ReferenceEvents] = []
    for index, start in enumerate(listed):
        with prefixed(f"Start {index}"):
            sections.append(events(top, start, until, function, direction, system=system, limit=limit, **how))
    about = arguments.system(system, top)
    own = [resolve(top, start) for start in listed]
    parameters = [about.parameters(setup.top, setup.start) for setup in own]
    levels = [
        tuple(_as_float(integral(p, setup.start.flat)) for p, setup in zip(parameters, own, strict=True))
        for integral in (energy, area)
    ]
    return Section(tuple(sections), *levels)


def _as_float(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)


def _until(value: Number) -> Fraction:
    end = physical(value, "until")
    if end == 0:
        raise refusal("until", "a time other than 0", 0, "Give a time of either sign.")
    return end


def require_direction(value: int) -> int:
    """1, -1 or 0; raises InputError for any other."""
    sign = as_integer(value, "direction")
    if sign not in (-1, 0, 1):
        raise refusal("direction", "a sign", quoted(sign), "Give 1 (rising), -1 (falling) or 0 (both).")
    return sign
