"""Deliberately faulty integrators: heyoka with one planted fault each, plug-ins that `heavytop selftest` measures.

They hide the fault: problem and flags that they return are the healthy ones, and so is their name.  A plan measures
them as any integrator that is defined outside the registry.  All are for the system `heavy_top` in double.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy

from heavytop.errors import InputError
from heavytop.integrate.heyoka import motions
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import Stepper
from heavytop.integrate.registry import Integrator
from heavytop.integrate.trajectory import Observer, Outcome, Problem, TaylorStep, Trajectory
from heavytop.precision import DOUBLE, Precision
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State


class _OneByOne(Stepper):
    """Steps taken singly, each followed by what is wrong."""

    def _steps_short_of(self, target: Any) -> int:
        return 1

    def single(self) -> Outcome:
        outcome = super().single()
        if outcome is Outcome.SUCCESS:
            self.spoil()
        return outcome

    def spoil(self) -> None:
        """Do something to the engine after a step."""


class _OneOrderLess(_OneByOne):
    """The last Taylor coefficient is dropped; the step stays as long as it was."""

    def polynomial(self) -> Any:
        return super().polynomial()[:, :-1]

    def spoil(self) -> None:
        self.engine.state[:] = self.sample(self.engine.time)

    def sample(self, target: Any) -> Any:
        tau = target - (self.engine.time - self.engine.last_h)
        return numpy.polynomial.polynomial.polyval(tau, self.polynomial().T)


class _ClockInOneWord(_OneByOne):
    """The time is summed in one double, where heyoka keeps two."""

    def spoil(self) -> None:
        self.engine.time = self.engine.dtime[0]


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """heyoka in double, and what is wrong with it.

    options: those of `engines.compiled` that differ.  top: what is integrated in the place of the one asked for.
    stepping: how steps are taken.  states: what is returned in the place of the states.  stops: the part of the
    samples that is reached; silent: the run says nothing of having stopped.  detectable: whether the suite's detectors
    are known to see it.
    """

    about: str
    options: dict[str, Any] = field(default_factory=dict)
    top: Callable[[HeavyTop], HeavyTop] = lambda top: top
    stepping: type[Stepper] = Stepper
    states: Callable[[Sequence[Any]], list[Any]] = list
    stops: Fraction = Fraction(1)
    silent: bool = False
    detectable: bool = True

    @property
    def integrator(self) -> Integrator:
        """The plug-in with its capabilities."""
        return Integrator(
            "heyoka", self.propagate, systems=(HEAVY_TOP.name,), control="", steps=self.first_steps, streams=True
        )

    def propagate(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        xi: Sequence[Fraction] | None = None,
        observer: Observer | None = None,
    ) -> Trajectory:
        """As :func:`heavytop.integrate.heyoka.motions.propagate`; the states go to the observer alone, if there is one.

        Raises InputError for another system, and where an attitude is asked for.
        """
        if xi is not None:
            raise InputError("A planted fault has no attitude.", "Leave out the attitude.")
        reached = times[: int(len(times) * self.stops)]
        run = motions.propagate(self.top(top), start, reached, precision, **self._how(system))
        states = self.states(run.states)
        if observer is not None:
            for time, state in zip(run.times, states, strict=True):
                observer(time, state)
            states = []
        outcome = run.outcome if self.stops == 1 or self.silent else Outcome.STEP_LIMIT
        return self._disguised(replace(run, states=states, outcome=outcome), top, start)

    def first_steps(
        self, top: HeavyTop, start: State, until: Fraction, precision: Precision = DOUBLE, *, system: System = HEAVY_TOP
    ) -> tuple[Trajectory, list[TaylorStep]]:
        """As :func:`heavytop.integrate.heyoka.motions.first_steps`; hands over what :meth:`propagate` does."""
        run, steps = motions.first_steps(self.top(top), start, until, precision, **self._how(system))
        ends = self.states([step.end for step in steps])
        steps = [replace(step, end=end) for step, end in zip(steps, ends, strict=True)]
        return self._disguised(run, top, start), steps

    def _how(self, system: System) -> dict[str, Any]:
        if system is not HEAVY_TOP:
            raise InputError(f"The planted faults are not for {system.name}.", "Use heavy_top.")
        return self.options | {"stepping": self.stepping}

    def _disguised(self, run: Trajectory, top: HeavyTop, start: State) -> Trajectory:
        healthy = Problem.of(top, start, DOUBLE)
        return replace(run, problem=healthy, flags=compiled(HEAVY_TOP, DOUBLE).flags)


_OFF = 1 + Fraction(1, 10**10)
FAULTS = {
    "sign": Fault(
        "P γ × r enters (1.1) with the other sign",
        top=lambda top: HeavyTop(top.inertia, top.weight, [-part for part in top.centre]),
    ),
    "coefficient": Fault(
        "I1 is larger by 1e-10 of itself",
        top=lambda top: HeavyTop((top.inertia[0] * _OFF, *top.inertia[1:]), top.weight, top.centre),
    ),
    "tolerance": Fault("tolerance 1e-9", options={"tolerance": Fraction(1, 10**9)}),
    "order": Fault("one order less, at heyoka's own step", stepping=_OneOrderLess),
    "summation": Fault(
        "compensated summation in a step the other way round: on, where the healthy run has it off",
        options={"high_accuracy": True},
        detectable=False,
    ),
    "clock": Fault("time summed in one double", stepping=_ClockInOneWord, detectable=False),
    "axes": Fault(
        "axes 1 and 2 swapped in what is handed over",
        states=lambda states: [state[[1, 0, 2, 4, 3, 5]] for state in states],
    ),
    "frozen": Fault(
        "the state stands still from the middle on",
        states=lambda states: [states[min(index, len(states) // 2)] for index in range(len(states))],
    ),
    "nan": Fault("the last state is NaN", states=lambda states: [*states[:-1], states[-1] * math.nan]),
    "stop": Fault("stops early and says so", stops=Fraction(3, 4)),
    "silent stop": Fault("stops early and says nothing", stops=Fraction(3, 4), silent=True),
}
"""Each fault by name."""
