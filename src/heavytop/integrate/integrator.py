"""What an integrator is to this program: where its functions are, and what it can do; its own by name.

heyoka, multiword, the peers and the deliberately faulty ones (:mod:`heavytop.integrate.broken`) are instances, and so
is what an entry point of another package names.  A new one of this program's is a line in :data:`INTEGRATORS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from typing import Any, Protocol

from heavytop.errors import OutOfReach
from heavytop.integrate.trajectory import Problem
from heavytop.precision import FORMATS, decimal_text, last_call, log10
from heavytop.top.amplification import square_of_rate
from heavytop.top.equations import SYSTEMS

_EVERY = (*(form.name for form in FORMATS), "real")
_SYSTEMS = tuple(system.name for system in SYSTEMS)
_HERE = "heavytop.integrate"


class IntegratorSource(Protocol):
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

    propagate: called as :func:`heavytop.integrate.heyoka.motions.propagate`, or as a peer
    (:mod:`heavytop.integrate.peers`).
    formats, systems: their names; None where nothing is declared.
    control: the option that sets its error, "tolerance" or "step"; "" where only its signature says.
    ensemble: called as :func:`heavytop.integrate.ensemble.propagate_ensemble`; "" for one motion at a time.
    steps: called as :func:`heavytop.integrate.heyoka.motions.first_steps`; "" where single steps are not exposed.
    attitude: whether ξ rides along.
    streams: whether it calls an observer at each sample, takes a step limit and resumes.
    needs: modules of extras.
    own: whether it is this program's, and so believed.
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


def name_of(which: str | IntegratorSource) -> str:
    """The name in rows of an integrator that is named or defined by its source."""
    return which if isinstance(which, str) else which.name


def described(which: str | IntegratorSource) -> Integrator:
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
            f"{_HERE}.heyoka.motions:propagate",
            tuple(name for name in _EVERY if name != "double-double"),
            ensemble=f"{_HERE}.ensemble:propagate_ensemble",
            steps=f"{_HERE}.heyoka.motions:first_steps",
            attitude=True,
            streams=True,
        ),
        _peer("heyoka:constants", "heyoka_taylor:constants"),
        _peer("heyoka:lanes", "heyoka_taylor:lanes"),
        Integrator(
            "multiword",
            f"{_HERE}.multiword.motions:propagate_words",
            _EVERY,
            ensemble=f"{_HERE}.multiword.lanes:propagate_words_ensemble",
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


# Which runs are tried at all: those of no more steps than anyone waits for, whatever the units of the data.


MOST_STEPS = 10**12
"""In double a step takes a microsecond: these take days."""
_FAR_BELOW = 1e11


def expected_steps(problem: Problem, end: Fraction, step: Fraction | None = None) -> int:
    """How many steps a run to the time ``end`` takes, within a factor of ten; 0 for a motion that rests.

    The time over the step: over the fixed ``step`` of the method, else over the time in which the motion changes.
    """
    p, start = problem.parameters, problem.start.flat
    if not any(problem.system.field(p, start)):
        return 0
    square = end**2 * (square_of_rate(problem.system, p, start) if step is None else 1 / step**2)
    return math.isqrt(square.numerator // square.denominator)


@last_call
def _square_in_doubles(problem: Problem) -> float:
    """The square of the rate at which the motion changes; inf where doubles do not hold it."""
    try:
        p, start = problem.parameters.mapped(float), tuple(map(float, problem.start.flat))
        return float(square_of_rate(problem.system, p, start))
    except (OverflowError, ZeroDivisionError):
        return math.inf


def _is_near(problem: Problem, end: Fraction) -> bool:
    """True only where the end is in reach by far; in doubles."""
    try:
        return float(end) ** 2 * _square_in_doubles(problem) < _FAR_BELOW**2
    except OverflowError:
        return False


def require_reach(problem: Problem, end: Fraction, step_limit: int | None = None, step: Fraction | None = None) -> None:
    """Raises OutOfReach where a run to the time ``end`` takes more than :data:`MOST_STEPS` :func:`expected_steps`.

    A run that ``step_limit`` ends early is in reach.
    """
    if (step_limit is not None and step_limit <= MOST_STEPS) or (step is None and _is_near(problem, end)):
        return
    steps = expected_steps(problem, end, step)
    if steps > MOST_STEPS:
        raise OutOfReach(
            f"A run to t = {decimal_text(end, 6)} takes some 1e{math.floor(log10(Fraction(steps)) or 0.0)} steps.",
            f"Up to {MOST_STEPS:.0e} are tried: ask for an earlier time, or for a proven state, which needs no steps "
            "where there is a closed form (`heavytop reference`).",
        )
