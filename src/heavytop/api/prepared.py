"""An integrator prepared once, for calls that cost little more than their integration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy

from heavytop.api import arguments
from heavytop.api.arguments import Number, Numbers
from heavytop.api.motions import propagate
from heavytop.display import Table, Tabular
from heavytop.errors import InputError, quoted
from heavytop.integrate.engines import compiled
from heavytop.integrate.peers.source import named
from heavytop.integrate.reach import require_reach
from heavytop.integrate.taylor import states_at
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.precision import DOUBLE, LARGEST, Precision, exact, number, numbers
from heavytop.top.bodies import Body
from heavytop.top.equations import GYROSTAT, NAMES, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.rates import square_of_rate
from heavytop.top.times import check_times

if TYPE_CHECKING:
    from numpy.typing import NDArray

_NEAR_STEPS = 1e11
"""A run of fewer expected steps is in reach without looking closer."""
_LARGEST = float(LARGEST)
_SLACK = float(arguments.slack_of(DOUBLE))


@dataclass(frozen=True, slots=True, repr=False)
class Propagated(Tabular):
    """Motions of one top at the times asked for, as arrays of the format's numbers.

    times: native, shape (n,), or one number.  states: order Ω1 Ω2 Ω3 γ1 γ2 γ3, shape (m, n, 6) for m starts, (n, 6) for
    one, without n where one time was asked for; ``nan`` at times that were not reached.
    outcome, time_reached, steps: as of a :class:`Trajectory`; of m starts tuples of m.
    """

    times: Any
    states: Any
    outcome: Outcome | tuple[Outcome, ...]
    time_reached: Any
    steps: int | tuple[int, ...]

    @property
    def succeeded(self) -> bool:
        """Whether every motion reached every time."""
        outcomes = self.outcome if isinstance(self.outcome, tuple) else (self.outcome,)
        return all(outcome is Outcome.SUCCESS for outcome in outcomes)

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The states rounded to double, in the same shape."""
        return numpy.array(self.states, dtype=float)

    def _table(self) -> Table:
        flat = self.to_numpy().reshape(-1, 6)
        several = isinstance(self.outcome, tuple)
        said = "all reached every time" if self.succeeded else "not all times were reached"
        times = numpy.atleast_1d(self.times)
        lines = [(str(float(times[i % len(times)])), *map(str, row)) for i, row in enumerate(flat[:_SHOWN])]
        title = f"{len(self.steps) if isinstance(self.steps, tuple) else 1} motion{'s' if several else ''}: {said}"
        return Table(title, ("t", *NAMES), lines)


_SHOWN = 20


class Integrator:
    """One top, one format and one integrator, prepared once for many calls.

    Arguments:
        top, precision, integrator, system, tolerance, high_accuracy, compact_mode, step_limit: as in
            :func:`propagate`, whose bits these are.

    Heyoka in double about principal axes is called with a few array operations around it; every other integrator,
    format and body serves too, at the price of :func:`propagate`.  Threads may share one.

    Raises:
        InputError: as :func:`propagate`.
    """

    def __init__(
        self,
        top: HeavyTop | Body,
        precision: Precision | str = DOUBLE,
        *,
        integrator: str | Any = "heyoka",
        system: System | str | None = None,
        tolerance: Number | None = None,
        high_accuracy: bool | None = None,
        compact_mode: bool | None = None,
        step_limit: int | None = None,
    ) -> None:
        self._form = arguments.precision(precision)
        self._top, _ = arguments.motion(top, _SOME_START, self._form)
        self._system = arguments.system(system, self._top)
        self._asked = integrator
        self._limit = arguments.steps(step_limit)
        flags = {
            "high_accuracy": arguments.flag(high_accuracy, "high_accuracy"),
            "compact_mode": arguments.flag(compact_mode, "compact_mode"),
        }
        checked = {**flags, "tolerance": arguments.tolerance(tolerance, self._form), "step_limit": self._limit}
        self._options: dict[str, Any] = {name: value for name, value in checked.items() if value is not None}
        self._is_plain = (
            self._form == DOUBLE
            and named(integrator) == "heyoka"
            and self._system is not GYROSTAT
            and isinstance(self._top, HeavyTop)
        )
        if self._is_plain:
            self._prepare()

    def _prepare(self) -> None:
        options = {name: value for name, value in self._options.items() if name != "step_limit"}
        problem = self._problem(_SOME_START)
        self._tool = compiled(self._system, self._form, **options)
        self._numbers = numpy.array(problem.native(self._system.entering(problem.parameters)))
        # no motion changes faster than at max(|Ω|² turning, driven); no component of γ is beyond 2
        rates = problem.parameters.mapped(float)
        self._driven = square_of_rate(self._system, rates, (0.0, 0.0, 0.0, 2.0, 2.0, 2.0))
        still = rates._replace(moment=(0.0, 0.0, 0.0))
        self._turning = square_of_rate(self._system, still, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))

    def propagate(self, start: State | Numbers, times: Number | Numbers) -> Propagated:
        """The motion, or the motions, from t = 0.

        Arguments:
            start: a :class:`State`; or Ω1 Ω2 Ω3 γ1 γ2 γ3 in one list or array; or an array (m, 6) of m starts.
            times: one time; or several, as in :func:`propagate`.

        Returns:
            A :class:`Propagated`.  A run that fails is an outcome, not an exception.

        Raises:
            InputError: for what is no start or time.
            OutOfReach: as :func:`propagate`.
        """
        targets, is_one = self._targets(times)
        if isinstance(start, State):
            return self._together([self._one(start, None, targets)], targets, False, is_one)
        rows, several = self._rows(start)
        found = []
        for index, row in enumerate(rows):
            try:
                found.append(self._one(None, row, targets))
            except InputError as error:
                if not several:
                    raise
                raise InputError(f"Motion {index}: {error.cause}", error.remedy) from None
        return self._together(found, targets, several, is_one)

    def _targets(self, times: Any) -> tuple[Sequence[Any], bool]:
        """Native times, checked, and whether one was asked for."""
        if type(times) is float and -_LARGEST < times < _LARGEST and self._is_plain:
            return (times,), True
        is_one = isinstance(times, int | float | str | Fraction) or not hasattr(times, "__iter__")
        given = check_times([times] if is_one else times)
        if not len(given):
            raise InputError("No times were given.", "Give at least one, such as 1, 2, 5.")
        return numbers(given, self._form), is_one

    def _rows(self, start: Any) -> tuple[Any, bool]:
        """The starts, a row each, and whether there are several."""
        try:
            given = start if isinstance(start, numpy.ndarray) else _array(list(start))
            if given.dtype.kind == "f" and given.dtype.itemsize < 8:
                given = given.astype(float)
            if given.ndim == 1 and given.shape == (6,):
                return [given], False
            if given.ndim == 2 and given.shape[1] == 6 and len(given):
                return given, True
        except (TypeError, ValueError):
            raise InputError(f"start = {quoted(start)} is no start.", _SHAPES) from None
        raise InputError(f"start has the shape {given.shape}.", _SHAPES)

    def _one(self, state: State | None, row: Any, targets: Sequence[Any]) -> tuple[Any, Outcome, Any, int]:
        """As :func:`heavytop.integrate.taylor.states_at`."""
        if self._is_plain:
            plain = self._plain(state, row, targets)
            if plain is not None:
                with self._tool.lent() as engine:
                    return states_at(engine, self._numbers, plain, targets, self._limit, self._form)
        if state is None:
            state = State(row[:3], row[3:])
        found = propagate(
            self._top,
            state,
            [exact(target) for target in targets],
            self._form,
            integrator=self._asked,
            system=self._system,
            attitude=False,
            **self._options,
        )
        return found.states, found.outcome, number(found.time_reached, self._form), found.steps

    def _plain(self, state: State | None, row: Any, targets: Sequence[Any]) -> Any:
        """The start in doubles, checked; None for irrational ones, and where exact numbers tell what is wrong."""
        if state is not None:
            if state.attitude is not None:
                return None
            arguments.motion(self._top, state, self._form)
            values = list(map(float, self._problem(state).start.flat))
        elif row.dtype == numpy.float64:
            values = row.tolist()
        else:
            return None
        w1, w2, w3, g1, g2, g3 = values
        fastest = max(abs(w1), abs(w2), abs(w3))
        if not (fastest < _LARGEST and abs(g1 * g1 + g2 * g2 + g3 * g3 - 1) < _SLACK):
            return None
        span = float(targets[-1])
        if not span * span * max(fastest * fastest * self._turning, self._driven) < _NEAR_STEPS**2:
            require_reach(self._problem(State(values[:3], values[3:])), exact(targets[-1]), self._limit)
        return values

    def _problem(self, state: State) -> Problem:
        assert isinstance(self._top, HeavyTop)
        return Problem.of(self._top, state, self._form, self._system)

    def _together(
        self, found: list[tuple[Any, Outcome, Any, int]], targets: Sequence[Any], several: bool, is_one: bool
    ) -> Propagated:
        blocks = [self._filled(states, len(targets)) for states, *_ in found]
        times = targets[0] if is_one else numpy.array(targets)
        if not several:
            states, (_, outcome, reached, steps) = blocks[0], found[0]
            return Propagated(times, states[0] if is_one else states, outcome, reached, steps)
        states = numpy.array(blocks)
        _, outcomes, ends, counts = zip(*found, strict=True)
        return Propagated(times, states[:, 0] if is_one else states, outcomes, numpy.array(ends), counts)

    def _filled(self, states: Any, count: int) -> Any:
        """States at all times, ``nan`` where they were not reached."""
        missing = count - len(states)
        if not missing:
            return states if isinstance(states, numpy.ndarray) else numpy.array(states)
        nothing = [number(Fraction(0), self._form) * float("nan")] * 6
        return numpy.array([*states, *([nothing] * missing)])


def _array(values: list[Any]) -> Any:
    """Doubles where all are; else numbers of any kind."""
    return numpy.array(values, dtype=float if all(isinstance(value, float) for value in values) else object)


_SOME_START = State((0, 0, 0), (0, 0, 1))
_SHAPES = "Give a State, six numbers Omega1 Omega2 Omega3 gamma1 gamma2 gamma3, or an array of m rows of them."
