"""Integrators that a user might pick instead of heyoka, behind the same call; each is imported when it is first used.

A peer is a callable

    peer(top, start, times, precision, *, system, tolerance) -> Trajectory

with the arguments of :func:`heavytop.integrate.taylor.propagate`; ``tolerance`` is exact, relative and absolute, None
for the best that the peer offers; a peer with fixed steps takes ``step`` in its place.  A run that does not reach the
last time is a Trajectory whose outcome says so; InputError is for what the peer cannot be asked at all.

Other packages add theirs under the entry point ``heavytop.peers`` (see docs/peers.md).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from fractions import Fraction
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any, NamedTuple

from heavytop.errors import InputError, PeerFailed
from heavytop.integrate.peers.contract import Contained, contained, quiet, said
from heavytop.integrate.trajectory import Trajectory
from heavytop.processes import ChildContext

GROUP = "heavytop.peers"
HERE = "heavytop.integrate.peers"
_REMEDY = "Install the peers with: pip install 'heavytop[peers]'"

Peer = Callable[..., Trajectory]


class BuiltIn(NamedTuple):
    """Where one of this program's is, as ``module:name``, and the package that it needs, if it is an extra."""

    place: str
    package: str = ""


BUILT_IN = {
    "heyoka": BuiltIn("heavytop.integrate.taylor:propagate"),
    "heyoka:constants": BuiltIn(f"{HERE}.heyoka_taylor:constants"),
    "heyoka:lanes": BuiltIn(f"{HERE}.heyoka_taylor:lanes"),
    "words": BuiltIn("heavytop.integrate.words:propagate_words"),
    "scipy:DOP853": BuiltIn(f"{HERE}.scipy_ivp:dop853", "scipy"),
    "scipy:LSODA": BuiltIn(f"{HERE}.scipy_ivp:lsoda", "scipy"),
    "scipy:Radau": BuiltIn(f"{HERE}.scipy_ivp:radau", "scipy"),
    "cyrk:DOP853": BuiltIn(f"{HERE}.cyrk:dop853", "CyRK"),
    "cyrk:Vern8": BuiltIn(f"{HERE}.cyrk:vern8", "CyRK"),
    "sundials:CVODE": BuiltIn(f"{HERE}.sundials:cvode", "sksundae"),
    "diffrax:Dopri8": BuiltIn(f"{HERE}.diffrax_dopri8:dopri8", "diffrax"),
    "mpmath:odefun": BuiltIn(f"{HERE}.mpmath_taylor:odefun"),
    "splitting:2": BuiltIn(f"{HERE}.splitting:order2"),
    "splitting:4": BuiltIn(f"{HERE}.splitting:order4"),
    "splitting:8": BuiltIn(f"{HERE}.splitting:order8"),
}


def known() -> dict[str, EntryPoint]:
    """Every peer by name, not yet imported: the built-in ones, then those of other packages, which replace none."""
    found = {name: EntryPoint(name, built_in.place, GROUP) for name, built_in in BUILT_IN.items()}
    for entry in entry_points(group=GROUP):
        found.setdefault(entry.name, entry)
    return found


def peer(name: str) -> Peer:
    """The peer of that name, imported; raises InputError for an unknown one and for one that cannot be imported."""
    entry = known().get(name)
    if entry is None:
        raise InputError(f"Unknown integrator {name[:60]!r}.", f"Known: {', '.join(known())}.")
    try:
        with quiet():
            loaded: Any = entry.load()
    except ImportError as error:
        raise InputError(f"The integrator {name} is not available: {said(error)}.", _remedy(entry)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever another package's module does when it is imported
        why = f"{type(error).__name__}: {said(error)}"
        raise InputError(f"The integrator {name} is broken: {why}.", _remedy(entry)) from error
    if not callable(loaded):
        raise InputError(f"The integrator {name} is broken: {entry.value} is not callable.", _remedy(entry))
    return loaded  # type: ignore[no-any-return]


def require(name: str) -> None:
    """Raises InputError for an unknown integrator, and for one of this program's that cannot be imported.

    One of another package is not imported: how that goes is for the rows to say.
    """
    if name not in known() or name in BUILT_IN:
        peer(name)


def ready(name: str, setting: tuple[str, Fraction] | None = None) -> Contained:
    """The peer of that name with ``setting``, ("tolerance", 1e-9) or ("step", 1/50): nothing is looked up in its calls.

    Its calls raise PeerFailed for whatever others do wrong (:mod:`heavytop.integrate.peers.contract`).
    Raises InputError for an unknown integrator and for a setting that one of this program's does not have; PeerFailed
    where another package's cannot be used.
    """
    own = name in BUILT_IN
    try:
        chosen = peer(name)
    except InputError as error:
        if own or name not in known():
            raise
        raise PeerFailed(error.cause.removesuffix(".")) from None
    if setting is None:
        return Contained(name, chosen, own)
    with contained(name, " when its arguments were looked at"):
        arguments = inspect.signature(chosen).parameters
        takes = setting[0] in arguments or any(each.kind is each.VAR_KEYWORD for each in arguments.values())
    if not takes and own:
        raise InputError(f"The integrator {name} has no {setting[0]}.", "Fixed steps take a step, others a tolerance.")
    if not takes:
        raise PeerFailed(f"{name} has no {setting[0]}")
    return Contained(name, chosen, own, dict([setting]))


def knob(name: str) -> str:
    """What a peer is set by: "step", "tolerance", or "" for neither, as for one that cannot be used."""
    for each in ("step", "tolerance"):
        try:
            ready(name, (each, Fraction(1, 100)))
        except (InputError, PeerFailed):
            continue
        return each
    return ""


def knob_apart(name: str) -> str:
    """:func:`knob`; one of another package is looked at in a process of its own, which it may end."""
    if name in BUILT_IN:
        return knob(name)
    with ProcessPoolExecutor(1, mp_context=ChildContext()) as pool:
        try:
            return pool.submit(knob, name).result()
        except BrokenProcessPool:
            return ""


def available() -> dict[str, str | None]:
    """For each peer: None if it is installed, else the reason why it cannot be used.

    One of this program's is not imported: its package is looked for.  One of another package is.
    """
    found: dict[str, str | None] = {}
    for name in known():
        built_in = BUILT_IN.get(name)
        found[name] = None
        if built_in is None or (built_in.package and find_spec(built_in.package) is None):
            try:
                peer(name)
            except InputError as error:
                found[name] = error.cause
    return found


def _remedy(entry: EntryPoint) -> str:
    return _REMEDY if entry.name in BUILT_IN else f"It comes from {entry.value}: repair or remove that package."
