"""Which closed form a motion has: exact rational tests on the exact data, up to a renaming of the axes.

Constants first, then elementary functions, then elliptic and hyperelliptic ones; the validated enclosure for
every other motion.
Each case class makes its own test: its constructor raises NotInClass, saying which equality failed and by how much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from flint import arb

from heavytop.errors import LevelNotDone, NotInClass, OutOfReach
from heavytop.exact.axes import ALL, CYCLIC, Axes, Renamed, inverse, renamed_state, renamed_top
from heavytop.exact.bobylev_steklov import BobylevSteklov
from heavytop.exact.delone import Delone, DeloneHomoclinic
from heavytop.exact.dokshevich import Dokshevich
from heavytop.exact.ershkov_partial import ErshkovPartial
from heavytop.exact.euler import Euler
from heavytop.exact.goryachev_chaplygin import GoryachevChaplygin, Sretensky
from heavytop.exact.goryachev_chaplygin_rest import GoryachevChaplyginRest
from heavytop.exact.grioli import Grioli
from heavytop.exact.gyrostat import Gyrostat
from heavytop.exact.hess import Hess
from heavytop.exact.hess_pendulum import HessPendulum
from heavytop.exact.kovalevskaya import Kovalevskaya
from heavytop.exact.lagrange import Lagrange
from heavytop.exact.lagrange_gyrostat import LagrangeGyrostat
from heavytop.exact.pendulum import Pendulum
from heavytop.exact.scales import require_handy
from heavytop.exact.solution import ExactSolution
from heavytop.exact.spherical import SphericalTop
from heavytop.exact.staude import Staude
from heavytop.exact.steklov import Steklov
from heavytop.exact.validated import Validated
from heavytop.exact.zhukovsky_volterra import ZhukovskyVolterra
from heavytop.precision import shown
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

Case = Callable[[HeavyTop, State], ExactSolution]

_KEEP: tuple[Axes, ...] = ALL[:1]


def _delone_homoclinic(top: HeavyTop, start: State) -> ExactSolution:
    return _same(DeloneHomoclinic(start.omega[2] / 2, top.inertia[0]), top, start)


def _ershkov_partial(top: HeavyTop, start: State) -> ExactSolution:
    i1, _, i3 = top.inertia
    return _same(ErshkovPartial(start.omega[2] * i3 / i1, i1, i3), top, start)


def _same(found: ExactSolution, top: HeavyTop, start: State) -> ExactSolution:
    """The motion found; raises NotInClass unless its top and start are these, exactly."""
    if (found.top, found.start) != (top, start):
        raise NotInClass(
            f"{found.method} is of another top or start.",
            f"It starts from ({', '.join(map(shown, found.start.flat))}).",
        )
    return found


def _permanent_gyrostat(top: HeavyTop, start: State) -> ExactSolution:
    return Staude(top, start, GYROSTAT)


def _permanent_heavy_gyrostat(top: HeavyTop, start: State) -> ExactSolution:
    return Staude(top, start, HEAVY_GYROSTAT)


@dataclass(frozen=True, slots=True)
class OnLevel(Validated):
    """The enclosure of a motion whose class does not cover its level; what it cannot reach is refused with ``level``.

    level: the class, the level and the distance from it.
    """

    level: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "method", f"{self.method}, as no closed form covers the level ({self.level})")
        Validated.__post_init__(self)

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""
        return self._named(Validated.state, time, bits)

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """See :meth:`Validated.attitude`."""
        return self._named(Validated.attitude, time, bits)

    def with_attitude(self, time: Fraction, bits: int) -> list[arb]:
        """See :meth:`Validated.with_attitude`."""
        return self._named(Validated.with_attitude, time, bits)

    def _named(self, evaluate: Callable[[Validated, Fraction, int], list[arb]], time: Fraction, bits: int) -> list[arb]:
        try:
            return evaluate(self, time, bits)
        except OutOfReach as error:
            raise OutOfReach(f"{error.cause} {self.level}", error.remedy) from error


# the case, and the namings of the axes under which it looks different
_HEAVY_TOP: tuple[tuple[Case, tuple[Axes, ...]], ...] = (
    (Staude, _KEEP),
    (Grioli, CYCLIC),
    (_delone_homoclinic, ALL),
    (Euler, _KEEP),
    (Pendulum, _KEEP),
    (Lagrange, CYCLIC),
    (SphericalTop, _KEEP),
    (BobylevSteklov, ALL),
    (HessPendulum, CYCLIC),
    (Delone, CYCLIC),
    (Steklov, CYCLIC),
    (Dokshevich, CYCLIC),
    (Hess, CYCLIC),
    (Kovalevskaya, CYCLIC),
    (GoryachevChaplyginRest, CYCLIC),
    (GoryachevChaplygin, CYCLIC),
)
_GYROSTAT: tuple[tuple[Case, tuple[Axes, ...]], ...] = (
    (_permanent_gyrostat, _KEEP),
    (_ershkov_partial, _KEEP),
    (Gyrostat.of, _KEEP),
)

_HEAVY_GYROSTAT: tuple[tuple[Case, tuple[Axes, ...]], ...] = (
    (_permanent_heavy_gyrostat, _KEEP),
    (LagrangeGyrostat, CYCLIC),
    (ZhukovskyVolterra, _KEEP),
    (Sretensky, CYCLIC),
)
_CASES = {HEAVY_TOP.name: _HEAVY_TOP, GYROSTAT.name: _GYROSTAT, HEAVY_GYROSTAT.name: _HEAVY_GYROSTAT}


def matches(top: HeavyTop, start: State, system: System = HEAVY_TOP) -> Iterator[ExactSolution]:
    """Every closed form of this motion, the simplest first; none for a motion that has none here.

    Raises InputError where the system does not admit the top and start, OutOfReach for numbers of too many digits.
    """
    yield from (found for found in _attempts(top, start, system) if not isinstance(found, LevelNotDone))


def _attempts(top: HeavyTop, start: State, system: System) -> Iterator[ExactSolution | LevelNotDone]:
    """:func:`matches`, and why there is none where a class has the motion but does not cover its level."""
    require_handy(top, start)
    system.parameters(top, start)
    for case, namings in _CASES[system.name]:
        for axes in namings:
            try:
                found = case(renamed_top(top, axes), renamed_state(start, axes))
            except LevelNotDone as error:
                yield LevelNotDone(f"{getattr(case, '__name__', '')}: {error.cause}", error.remedy)
                continue
            except NotInClass:
                continue
            yield found if axes == _KEEP[0] else Renamed(found, inverse(axes))
            break


def find(top: HeavyTop, start: State, system: System = HEAVY_TOP) -> ExactSolution:
    """The simplest closed form of this motion, or its validated enclosure.

    The enclosure names the degenerate level where a class has the motion but not this level of it.
    Raises InputError where the system does not admit the top and start, OutOfReach for numbers of too many digits.
    """
    level = ""
    for found in _attempts(top, start, system):
        if not isinstance(found, LevelNotDone):
            return found
        level = level or found.cause
    return OnLevel(top, start, system, level=level) if level else Validated(top, start, system)
