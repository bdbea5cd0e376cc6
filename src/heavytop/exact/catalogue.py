"""The closed form of a motion, found by exact rational tests on the exact data, up to a renaming of the axes.

Constants come first, then elementary functions, then elliptic and hyperelliptic ones; every other motion has its
validated enclosure.
A class is found by its exact conditions, first on the body and then on the start (:mod:`heavytop.exact.solution`);
:func:`table` writes them down.  Its constructor makes the same test, and raises NotInClass with what fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial

from heavytop.errors import LevelNotDone, NotInClass, OutOfReach
from heavytop.exact.cases.bobylev_steklov import BobylevSteklov
from heavytop.exact.cases.delone import Delone, DeloneHomoclinic
from heavytop.exact.cases.dokshevich import Dokshevich
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplygin, Sretensky
from heavytop.exact.cases.goryachev_chaplygin_rest import GoryachevChaplyginRest
from heavytop.exact.cases.grioli import Grioli
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.cases.hess import Hess, HessPendulum
from heavytop.exact.cases.kovalevskaya import Kovalevskaya
from heavytop.exact.cases.lagrange import Lagrange, LagrangeGyrostat, SphericalGyrostat, SphericalTop
from heavytop.exact.cases.one_interval import Steklov
from heavytop.exact.cases.pendulum import Pendulum, PendulumGyrostat
from heavytop.exact.cases.staude import Staude
from heavytop.exact.cases.zhukovsky_volterra import ZhukovskyVolterra
from heavytop.exact.closed_form import (
    ALL,
    CYCLIC,
    Attitude,
    Axes,
    ClosedForm,
    Renamed,
    Turned,
    inverse,
    renamed_state,
    renamed_top,
)
from heavytop.exact.enclosure.run import EFFORT, Validated
from heavytop.exact.flint.balls import require_handy
from heavytop.exact.solution import Conditions, ExactSolution, equilibrium, hold
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

_KEEP: tuple[Axes, ...] = ALL[:1]


@dataclass(frozen=True, slots=True)
class Class:
    """A class of motions: exact conditions on the body and on the start, and the constructor of a closed form.

    namings: the renamings of the axes to try.
    """

    name: str
    body: Conditions
    starts: Conditions
    build: Callable[[HeavyTop, State], ExactSolution]
    namings: tuple[Axes, ...]

    @classmethod
    def of(cls, case: type[ClosedForm], namings: tuple[Axes, ...]) -> Class:
        """From the conditions and the constructor of a case."""
        return cls(case.__name__, case.body, case.starts, case, namings)


def _steady(system: System) -> Class:
    return Class("Staude", (), (equilibrium(system),), partial(Staude, system=system), _KEEP)


# the simplest forms first
_CLASSES: dict[str, tuple[Class, ...]] = {
    HEAVY_TOP.name: (
        _steady(HEAVY_TOP),
        Class.of(Grioli, CYCLIC),
        Class("DeloneHomoclinic", DeloneHomoclinic.body, DeloneHomoclinic.starts, DeloneHomoclinic.of, ALL),
        Class.of(Euler, _KEEP),
        Class.of(Pendulum, _KEEP),
        Class.of(Lagrange, CYCLIC),
        Class.of(SphericalTop, _KEEP),
        Class.of(BobylevSteklov, ALL),
        Class.of(HessPendulum, CYCLIC),
        Class.of(Delone, CYCLIC),
        Class.of(Steklov, CYCLIC),
        Class.of(Dokshevich, CYCLIC),
        Class.of(Hess, CYCLIC),
        Class.of(Kovalevskaya, CYCLIC),
        Class.of(GoryachevChaplyginRest, CYCLIC),
        Class.of(GoryachevChaplygin, CYCLIC),
    ),
    GYROSTAT.name: (
        _steady(GYROSTAT),
        Class("ErshkovPartial", ErshkovPartial.body, ErshkovPartial.starts, ErshkovPartial.of, _KEEP),
        Class("Gyrostat", (), (), Gyrostat.of, _KEEP),
    ),
    HEAVY_GYROSTAT.name: (
        _steady(HEAVY_GYROSTAT),
        Class.of(PendulumGyrostat, _KEEP),
        Class.of(LagrangeGyrostat, CYCLIC),
        Class.of(SphericalGyrostat, _KEEP),
        Class.of(ZhukovskyVolterra, _KEEP),
        Class.of(Sretensky, CYCLIC),
    ),
}


def table() -> list[tuple[str, str, str, str]]:
    """System, name, conditions on the body and conditions on the start of each class, in the order of trial."""

    def text(conditions: Conditions) -> str:
        return "; ".join(condition.text for condition in conditions) or "any"

    rows = [(system, entry) for system, classes in _CLASSES.items() for entry in classes]
    return [(system, entry.name, text(entry.body), text(entry.starts)) for system, entry in rows]


def matches(top: HeavyTop, start: State, system: System = HEAVY_TOP) -> Iterator[ExactSolution]:
    """Every closed form of this motion, the simplest first.

    A heavy gyrostat whose rotor has no momentum also has those of the heavy top.
    Raises InputError where the system does not admit the top and start, OutOfReach for numbers of too many digits.
    """
    yield from (attempt for attempt in _attempts(top, start, system) if not isinstance(attempt, LevelNotDone))


def _attempts(top: HeavyTop, start: State, system: System) -> Iterator[ExactSolution | LevelNotDone]:
    """The items of :func:`matches`, and the error of each class that has the motion but does not cover its level."""
    require_handy(top, start)
    system.parameters(top, start)
    for entry in _CLASSES[system.name]:
        for axes in entry.namings:
            named, begun = renamed_top(top, axes), renamed_state(start, axes)
            if not (hold(entry.body, named, begun) and hold(entry.starts, named, begun)):
                continue
            try:
                solution = entry.build(named, begun)
            except LevelNotDone as error:
                yield LevelNotDone(f"{entry.name}: {error.cause}", error.remedy)
                continue
            yield solution if axes == _KEEP[0] else Renamed(solution, inverse(axes))
            break
    if system is HEAVY_GYROSTAT and not any(top.rotor or ()):
        # with k = 0 the motion is one of the top without a rotor
        yield from _attempts(HeavyTop(top.inertia, top.weight, top.centre), start, HEAVY_TOP)


def find(top: HeavyTop, start: State, system: System = HEAVY_TOP, effort: float = EFFORT) -> ExactSolution:
    """The simplest closed form of this motion, or its validated enclosure with that effort per request.

    The enclosure names the degenerate level where a class has the motion but does not cover its level.
    Raises InputError where the system does not admit the top and start, OutOfReach for numbers of too many digits.
    """
    level = ""
    for attempt in _attempts(top, start, system):
        if not isinstance(attempt, LevelNotDone):
            return attempt
        level = level or attempt.cause
    return Validated(top, start, system, effort=effort, level=level)


def state_and_attitude(
    solution: ExactSolution, latest: Fraction, bits: int, effort: float = EFFORT
) -> tuple[str, Attitude]:
    """The method of the attitude of ``solution``, and a function of (time, bits) that returns Ω, γ, ξ.

    ξ starts at ``initial_xi`` of γ.  It comes from the closed form where that yields ``bits`` bits at the time
    ``latest``, else from the validated enclosure within the effort, which says why; Ω and γ come from the closed form
    wherever there is one.  The function raises OutOfReach where the bits cannot be proven, InputError for an enclosure
    of |γ| ≠ 1.
    """
    if isinstance(solution, Validated):
        return solution.method, solution.with_attitude
    attitude: Attitude | None = getattr(solution, "own_attitude", getattr(solution, "attitude", None))
    level = ""
    if attitude is not None:
        from_initial_xi = Turned(solution, attitude)
        try:
            from_initial_xi(latest, bits)
        except (NotInClass, OutOfReach) as error:
            level = error.cause
        else:
            return solution.method, from_initial_xi
    enclosure = Validated(solution.top, solution.start, solution.system, effort=effort, level=level)
    return enclosure.method, lambda time, bits: [*solution.state(time, bits), *enclosure.attitude(time, bits)]
