"""What is found of events: of a computed motion as numbers of its format, of a known one as balls."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import msgspec

from heavytop.display import Lines, Table, Tabular
from heavytop.errors import InputError, quoted
from heavytop.exact.balls import radius_text
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.reference import Ball, rounded_up
from heavytop.precision import decimal_text, exact, native_text
from heavytop.top.equations import NAMES, VARIABLES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SHOWN = 15

POLYNOMIAL, SAMPLED, PROVEN = "polynomial", "sampled", "proven"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events(Tabular):
    """The events of a computed motion, in the order in which the run comes to them.

    function: its text or name.  direction: 1 or −1 where only rising or falling ones were asked for, else 0.
    guarantee: ``"polynomial"``: every change of sign of the function along the Taylor polynomial of each step is there,
    isolated exactly; ``"sampled"``: a callable that needs numbers, whose changes of sign between samples of a step may
    be missed.
    times: numbers of the format, shape (n,).  states: at them, shape (n, 6), Ω1 Ω2 Ω3 γ1 γ2 γ3.
    directions: 1 where the function rises with time, −1 where it falls, shape (n,).
    until: the exact time up to which was looked; outcome, time_reached, steps, order, seconds, flags: as of a
    trajectory.
    """

    problem: Problem
    integrator: str
    function: str
    direction: int
    guarantee: str
    times: Any
    states: Any
    directions: Any
    until: Fraction
    outcome: Outcome
    time_reached: Fraction
    steps: int
    order: int
    seconds: dict[str, float] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.times)

    def texts(self) -> list[list[str]]:
        """The states as full-precision decimal strings, shape (n, 6)."""
        return [[native_text(value, self.problem.precision) for value in state] for state in self.states]

    def time_texts(self) -> list[str]:
        """The times as full-precision decimal strings."""
        return [native_text(time, self.problem.precision) for time in self.times]

    def to_numpy(self) -> NDArray[np.float64]:
        """The states rounded to double, shape (n, 6)."""
        import numpy

        return numpy.array([[float(value) for value in state] for state in self.states]).reshape(-1, 6)

    def to_json(self) -> dict[str, Any]:
        """An entry of ``events`` in the document of `propagate --json`."""
        return {
            "function": self.function,
            "direction": self.direction,
            "guarantee": self.guarantee,
            "times": self.time_texts(),
            "directions": [int(value) for value in self.directions],
            "states": self.texts(),
        }

    def _table(self) -> Table:
        digits = min(_SHOWN, self.problem.precision.digits)

        def line(place: int) -> list[str]:
            numbers = [decimal_text(exact(v), digits) for v in (self.times[place], *self.states[place])]
            return [numbers[0], _arrow(self.directions[place]), *numbers[1:]]

        title = (
            f"{_counted(self)} {self.function} in {self.problem.precision.name} by {self.integrator}, "
            f"t = 0 to {decimal_text(self.until, 6)}"
        )
        notes = [_EXPLAINED[self.guarantee]]
        if self.outcome is not Outcome.SUCCESS:
            notes.append(f"{self.outcome.message}; looked up to t = {decimal_text(self.time_reached, 6)} only")
        return Table(title, ("t", "sign", *NAMES), Lines(len(self), line), notes)


class ReferenceEvents(Tabular, msgspec.Struct, frozen=True):
    """The events of a known motion, proven: each is there, and none is missed; its JSON is that of `reference
    --events`.

    function, direction: as in :class:`Events`.  guarantee: ``"proven"``.  method, digits, system: as of a reference.
    until: the time up to which was looked, as text.
    times, states: balls, shapes (n,) and (n, 6): the true number is within the radius of the value; the state is that
    at the true time.  directions: 1 where the function rises with time, −1 where it falls.
    """

    function: str
    direction: int
    guarantee: str
    method: str
    digits: int
    system: str
    until: str
    times: list[Ball]
    directions: list[int]
    states: list[list[Ball]]

    def __len__(self) -> int:
        return len(self.times)

    def texts(self) -> list[list[str]]:
        """The values of the states as decimal text, shape (n, 6)."""
        return [[ball.value for ball in state] for state in self.states]

    def time_texts(self) -> list[str]:
        """The values of the times as decimal text."""
        return [ball.value for ball in self.times]

    def to_numpy(self) -> NDArray[np.float64]:
        """The values of the states rounded to double, shape (n, 6)."""
        import numpy

        return numpy.array([[float(ball.value) for ball in state] for state in self.states]).reshape(-1, 6)

    def times_numpy(self) -> NDArray[np.float64]:
        """The values of the times rounded to double, shape (n,)."""
        import numpy

        return numpy.array([float(ball.value) for ball in self.times], dtype=numpy.float64)

    def radii(self) -> NDArray[np.float64]:
        """The radii of the states rounded up to double, shape (n, 6)."""
        import numpy

        return numpy.array([[rounded_up(ball.radius) for ball in state] for state in self.states]).reshape(-1, 6)

    def _table(self) -> Table:
        digits = min(_SHOWN, self.digits)

        def line(place: int) -> list[str]:
            numbers = [decimal_text(exact(b.value), digits) for b in (self.times[place], *self.states[place])]
            return [numbers[0], _arrow(self.directions[place]), *numbers[1:]]

        worst = max((Fraction(ball.radius) for ball in self.times), default=Fraction(0))
        title = f"{_counted(self)} {self.function}, known to {self.digits} digits, t = 0 to {self.until[:_SHOWN]}"
        notes = [_EXPLAINED[PROVEN], f"largest radius of a time {radius_text(worst)}; {self.method}"]
        return Table(title, ("t", "sign", *NAMES), Lines(len(self), line), notes)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Section(Tabular):
    """A Poincaré section: the states of several motions of one top where a function changes sign.

    events: of each start in order, computed or proven.  energies, areas: ½ Ω·M + P r·γ and M·γ of each start; the
    points of motions on one level of both lie on one surface.
    """

    events: tuple[Events | ReferenceEvents, ...]
    energies: tuple[float, ...]
    areas: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.events)

    def points(self, x: str = "gamma1", y: str = "gamma2") -> list[NDArray[np.float64]]:
        """Two components of the states of each start, arrays of shape (n, 2)."""
        columns = [component(name) for name in (x, y)]
        return [each.to_numpy()[:, columns] for each in self.events]

    @property
    def on_one_level(self) -> bool:
        """Whether all starts have one energy and one M·γ, to 1e-9."""
        return all(max(v) - min(v) <= 1e-9 * max(1.0, *map(abs, v)) for v in (self.energies, self.areas))

    def _table(self) -> Table:
        def line(place: int) -> list[str]:
            found = self.events[place]
            return [str(place), str(len(found)), f"{self.energies[place]:.9g}", f"{self.areas[place]:.9g}"]

        first = self.events[0]
        title = f"Poincaré section {first.function} of {len(self)} motions, {sum(map(len, self.events))} points"
        notes = [] if self.on_one_level else ["the starts are on different levels of energy or M·γ"]
        return Table(title, ("start", "points", "energy", "M·γ"), Lines(len(self), line), notes)


def component(name: str) -> int:
    """The place of a component in the state, by a name such as omega1 or γ3; raises InputError for another."""
    plain = str(name).strip()
    for greek, latin in (("Ω", "omega"), ("\N{OHM SIGN}", "omega"), ("γ", "gamma")):
        plain = plain.replace(greek, latin)
    if plain not in VARIABLES:
        raise InputError(f"{quoted(name)} is not a component of the state.", f"Use {', '.join(VARIABLES)}.")
    return VARIABLES.index(plain)


_EXPLAINED = {
    POLYNOMIAL: "polynomial: no change of sign of the Taylor polynomials of the steps is missed",
    SAMPLED: "sampled: changes of sign between two samples of a step may be missed",
    PROVEN: "proven: each lies within its radius, and there is no other",
}


def _arrow(direction: Any) -> str:
    return "rises" if direction > 0 else "falls"


def arrays(times: Sequence[Any], states: Sequence[Any], directions: Sequence[int]) -> tuple[Any, Any, Any]:
    """Times (n,), states (n, 6) and directions (n,) as arrays, also where there are none."""
    import numpy

    return (
        numpy.array(times) if len(times) else numpy.empty(0),
        numpy.array(states) if len(states) else numpy.empty((0, 6)),
        numpy.array(directions, dtype=numpy.int64),
    )


def _counted(found: Sized) -> str:
    return f"{len(found)} event{'s' * (len(found) != 1)}"
