"""Integrators that a user might pick instead of heyoka, behind the same call; each is imported when it is first used.

A peer is a callable

    peer(top, start, times, precision, *, system, tolerance) -> Trajectory

with the arguments of :func:`heavytop.integrate.heyoka.motions.propagate`; ``tolerance`` is exact, relative and
absolute, None for the best that the peer offers; a peer with fixed steps takes ``step`` in its place.  A run that does
not reach the last time is a Trajectory whose outcome says so; InputError is for what the peer cannot be asked at all.

Other packages add theirs under the entry point ``heavytop.peers`` (see docs/peers.md).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from fractions import Fraction
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from heavytop.errors import InputError, PeerFailed, quoted
from heavytop.integrate.integrator import INTEGRATORS, Integrator, IntegratorSource, described, foreign, load, name_of
from heavytop.integrate.peers.command import Command, CommandIntegrator
from heavytop.integrate.peers.contract import Contained, Declared, contained, quiet, said
from heavytop.integrate.peers.source import PythonFile
from heavytop.integrate.trajectory import Outcome, Trajectory
from heavytop.records import INTEGRATORS as FORMER

GROUP = "heavytop.peers"
_REMEDY = "Install the peers with: pip install 'heavytop[peers]'"

Peer = Callable[..., Trajectory]
STEP_LIMIT = 10**7
"""Steps that are handed to a third-party integrator as a limit, where it takes one."""
_PATIENCE = 60
"""Seconds that a third-party package has to say what it is set by."""


def known() -> dict[str, Integrator]:
    """Every integrator by name, not yet imported: its own, then those of other packages, which replace none."""
    found = dict(INTEGRATORS)
    for entry in entry_points(group=GROUP):
        if entry.name not in FORMER:
            found.setdefault(entry.name, foreign(entry.name, entry.value))
    return found


def is_third_party(name: str) -> bool:
    """Whether an integrator of that name is not one of this program's."""
    return name not in INTEGRATORS and name not in FORMER


def peer(which: str | IntegratorSource) -> Peer:
    """The peer, imported; raises InputError for an unknown one and for one that cannot be imported."""
    if not isinstance(which, str):
        return which.load()
    name = which
    entry = known().get(name)
    if entry is None:
        raise InputError(f"Unknown integrator {quoted(name)}.", f"Known: {', '.join(known())}.")
    if entry.lacks:
        raise InputError(f"The integrator {name} needs {entry.lacks}, which is not installed.", _REMEDY)
    try:
        with quiet():
            found = load(entry.propagate)
    except ImportError as error:
        raise InputError(f"The integrator {name} is not available: {said(error)}.", _remedy(entry)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever another package's module does when it is imported
        why = f"{type(error).__name__}: {said(error)}"
        raise InputError(f"The integrator {name} is broken: {why}.", _remedy(entry)) from error
    if not callable(found):
        raise InputError(f"The integrator {name} is broken: {entry.propagate} is not callable.", _remedy(entry))
    return found  # type: ignore[no-any-return]


def require(which: str | IntegratorSource) -> None:
    """Raises InputError for an unknown integrator, and for one of this program's that cannot be imported.

    One of another package is not imported: how that goes is for the rows to say.  A Python file has to be there.
    """
    if isinstance(which, PythonFile) and not Path(which.path).is_file():
        raise InputError(f"There is no file {which.path}.", "Give FILE.py:FUNCTION.")
    if isinstance(which, str) and (which not in known() or which in INTEGRATORS):
        peer(which)


def ready(which: str | IntegratorSource, setting: tuple[str, Fraction] | None = None) -> Peer:
    """The peer with ``setting``, ("tolerance", 1e-9) or ("step", 1/50): nothing is looked up in its calls.

    Its calls raise PeerFailed for whatever others do wrong (:mod:`heavytop.integrate.peers.contract`).
    Raises InputError for an unknown integrator and for a setting that one of this program's does not have; PeerFailed
    where another package's cannot be used.
    """
    name, own = name_of(which), described(which).own
    if isinstance(which, Command):
        return _program(which, setting)
    try:
        chosen = peer(which)
    except InputError as error:
        if own or (isinstance(which, str) and which not in known()):
            raise
        raise PeerFailed(error.cause.removesuffix(".")) from None
    declared = getattr(chosen, "declared", None)
    declared = declared if isinstance(declared, Declared) else None
    given: dict[str, Any] = dict([setting] if setting else [])
    if setting is not None or not own:
        with contained(name, " when its arguments were looked at"):
            arguments = inspect.signature(chosen).parameters
            takes_any = any(each.kind is each.VAR_KEYWORD for each in arguments.values())
        for control in given:
            if control not in arguments and not takes_any and own:
                raise InputError(
                    f"The integrator {name} has no {control}.", "Fixed steps take a step, others a tolerance."
                )
            if control not in arguments and not takes_any:
                raise PeerFailed(f"{name} has no {control}")
        if "step_limit" in arguments and not own:
            given["step_limit"] = STEP_LIMIT
    return Contained(name, chosen, own, declared, given)


def _program(command: Command, setting: tuple[str, Fraction] | None) -> Peer:
    """The program with that setting; one that says that it failed raises PeerFailed with what it said."""
    if setting is not None and setting[0] != command.control:
        raise PeerFailed(f"{command.name} has no {setting[0]}")
    integrate: Peer = CommandIntegrator(command)

    def call(*arguments: Any, **options: Any) -> Trajectory:
        run = integrate(*arguments, **options, **dict([setting] if setting else []))
        if run.outcome is Outcome.FAILED:
            raise PeerFailed(f"{command.name} failed: {run.flags['failure']}", answered=True)
        return run

    return call


def control(which: str | IntegratorSource) -> str:
    """What a peer is set by: "step", "tolerance", or "" for neither, as for one that cannot be used."""
    if isinstance(which, Command):
        return which.control
    if control := described(which).control:
        return control
    for each in ("step", "tolerance"):
        try:
            ready(which, (each, Fraction(1, 100)))
        except (InputError, PeerFailed):
            continue
        return each
    return ""


def control_apart(which: str | IntegratorSource) -> str:
    """:func:`control`; a third-party one is looked at in a process of its own, which it may end, or never leave."""
    if isinstance(which, Command) or described(which).own:
        return control(which)
    from heavytop.processes import ChildContext

    context = ChildContext()
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            return pool.submit(control, which).result(timeout=_PATIENCE)
        except BrokenProcessPool:
            return ""
        except TimeoutError:
            context.kill()
            return ""


def available() -> dict[str, str | None]:
    """For each peer: None if it can be used, else why not, and the remedy.

    One of this program's is not imported: the packages that it needs are looked for.  One of another package is.
    """
    found: dict[str, str | None] = {}
    for name, each in known().items():
        found[name] = None
        if not each.own or each.lacks:
            try:
                peer(name)
            except InputError as error:
                found[name] = f"{error.cause} {error.remedy}"
    return found


def _remedy(entry: Integrator) -> str:
    return _REMEDY if entry.own else f"It comes from {entry.propagate}: repair or remove that package."
