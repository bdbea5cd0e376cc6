"""What an integrator is to this program: where its functions are, and what it can do; its own by name.

heyoka, multiword, the peers and the deliberately faulty ones (:mod:`heavytop.integrate.broken`) are instances, and so
is what an entry point of another package names.  A new one of this program's is a line in :data:`INTEGRATORS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from typing import Any, Protocol

from heavytop.precision import FORMATS
from heavytop.top.equations import SYSTEMS

_EVERY = (*(form.name for form in FORMATS), "real")
_SYSTEMS = tuple(system.name for system in SYSTEMS)
_HERE = "heavytop.integrate"


class Source(Protocol):
    """An integrator that is defined outside this program and every package."""

    @property
    def name(self) -> str:
        """In rows and messages."""
        ...

    def load(self) -> Callable[..., Any]:
        """The peer; raises InputError where there is none."""
        ...


@dataclass(frozen=True, slots=True)
class Integrator:
    """An integrator and its capabilities; places are ``module:name``, or the functions themselves.

    propagate: called as :func:`heavytop.integrate.taylor.propagate`, or as a peer (:mod:`heavytop.integrate.peers`).
    formats, systems: their names; None where nothing is declared.
    control: the option that sets its error, "tolerance" or "step"; "" where only its signature says.
    ensemble: called as :func:`heavytop.integrate.ensemble.propagate_ensemble`; "" for one motion at a time.
    steps: called as :func:`heavytop.integrate.taylor.first_steps`; "" where single steps are not exposed.
    attitude: whether ξ rides along.  streams: whether it calls an observer at each sample, takes a step limit and
    resumes.  needs: modules of extras.  own: whether it is this program's, and so believed.
    """

    name: str
    propagate: str | Callable[..., Any]
    formats: tuple[str, ...] | None = ("double",)
    systems: tuple[str, ...] | None = _SYSTEMS
    control: str = "tolerance"
    ensemble: str = ""
    steps: str | Callable[..., Any] = ""
    attitude: bool = False
    streams: bool = False
    needs: tuple[str, ...] = ()
    own: bool = True

    @property
    def lacks(self) -> str:
        """The first module of an extra that is not installed; "" where none lacks."""
        return next((module for module in self.needs if find_spec(module) is None), "")

    @property
    def formats_text(self) -> str:
        """The formats in words; "" where these are few or not declared."""
        missing = [name for name in _EVERY if name not in (self.formats or ())]
        return "" if len(missing) > 1 else "every format" + (f" but {missing[0]}" if missing else "")

    def capabilities(self) -> dict[str, Any]:
        """As `list --json` shows them; None for what is not declared."""
        return {
            "formats": self.formats,
            "systems": self.systems,
            "control": self.control or None,
            "ensemble": bool(self.ensemble),
            "steps": bool(self.steps),
            "attitude": self.attitude,
        }


def foreign(name: str, place: str | Callable[..., Any] = "") -> Integrator:
    """One of another package, or of a source: nothing is known of what it can do."""
    return Integrator(name, place, None, None, "", own=False)


def name_of(which: str | Source) -> str:
    """The name in rows of an integrator that is named or defined by its source."""
    return which if isinstance(which, str) else which.name


def described(which: str | Source) -> Integrator:
    """What is known of it, without looking for it: of one that is not this program's, nothing."""
    own = INTEGRATORS.get(which) if isinstance(which, str) else None
    return own or foreign(name_of(which))


def load(place: str | Callable[..., Any]) -> Any:
    """What stands at ``module:name``, imported; a function itself."""
    return EntryPoint("", place, "").load() if isinstance(place, str) else place


loaded = lru_cache(maxsize=64)(load)
"""The same, looked up once: for this program's own."""


def _peer(name: str, place: str, *needs: str, **capabilities: Any) -> Integrator:
    return Integrator(name, f"{_HERE}.peers.{place}", needs=needs, **capabilities)


INTEGRATORS = {
    each.name: each
    for each in (
        Integrator(
            "heyoka",
            f"{_HERE}.taylor:propagate",
            tuple(name for name in _EVERY if name != "double-double"),
            ensemble=f"{_HERE}.ensemble:propagate_ensemble",
            steps=f"{_HERE}.taylor:first_steps",
            attitude=True,
            streams=True,
        ),
        _peer("heyoka:constants", "heyoka_taylor:constants"),
        _peer("heyoka:lanes", "heyoka_taylor:lanes"),
        Integrator(
            "multiword",
            f"{_HERE}.words:propagate_words",
            _EVERY,
            ensemble=f"{_HERE}.words_ensemble:propagate_words_ensemble",
            attitude=True,
            streams=True,
        ),
        _peer("scipy:DOP853", "scipy_ivp:dop853", "scipy"),
        _peer("scipy:LSODA", "scipy_ivp:lsoda", "scipy"),
        _peer("scipy:Radau", "scipy_ivp:radau", "scipy"),
        _peer("cyrk:DOP853", "cyrk:dop853", "CyRK", "numba"),
        _peer("cyrk:Vern8", "cyrk:vern8", "CyRK", "numba"),
        _peer("sundials:CVODE", "sundials:cvode", "sksundae"),
        _peer("diffrax:Dopri8", "diffrax_dopri8:dopri8", "diffrax"),
        _peer("mpmath:odefun", "mpmath_taylor:odefun", formats=_EVERY),
        _peer("splitting:2", "splitting:order2", control="step"),
        _peer("splitting:4", "splitting:order4", control="step"),
        _peer("splitting:8", "splitting:order8", control="step"),
    )
}
