"""Deliberately faulty integrators: plug-ins of heyoka with one planted fault each, which `heavytop selftest` measures.

They hide the fault: the returned problem, flags and name are those of the healthy integrator.  A plan measures them
like any third-party integrator.  All are for the system `heavy_top` in double.
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


class _SingleSteps(Stepper):
    """A stepper that takes single steps, and spoils the state after each."""

    def _steps_short_of(self, target: Any) -> int:
        return 1

    def single(self) -> Outcome:
        outcome = super().single()
        if outcome is Outcome.SUCCESS:
            self.spoil()
        return outcome

    def spoil(self) -> None:
        """Apply the fault to the engine after a step."""


class _OneOrderLess(_SingleSteps):
    """A stepper without the last Taylor coefficient, at an unchanged step size."""

    def polynomial(self) -> Any:
        return super().polynomial()[:, :-1]

    def spoil(self) -> None:
        self.engine.state[:] = self.sample(self.engine.time)

    def sample(self, target: Any) -> Any:
        tau = target - (self.engine.time - self.engine.last_h)
        return numpy.polynomial.polynomial.polyval(tau, self.polynomial().T)


class _ClockInOneWord(_SingleSteps):
    """A stepper that sums the time in one double instead of heyoka's two."""

    def spoil(self) -> None:
        self.engine.time = self.engine.dtime[0]


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """heyoka in double with a planted fault.

    options: those of `engines.compiled` that differ.  top: maps the requested top to the integrated one.
    stepping: the class of the stepper.  states: maps the states to those returned.  stops: the fraction of the samples
    that is reached; silent: whether the run does not report the stop.  detectable: whether the detectors of the suite
    are known to find it.
    """

    about: str
    options: dict[str, Any] = field(default_factory=dict)
    top: Callable[[HeavyTop], HeavyTop] = lambda top: top
    stepping: type[Stepper] = Stepper
    states: Callable[[Sequence[Any]], list[Any]] = list
    stops: Fraction = Fraction(1)
    silent: bool = False
    detectable: bool = True

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by name, for the functions of a fault have none."""
        return _named, (next(name for name, fault in FAULTS.items() if fault is self),)

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
        """Integrate like :func:`heavytop.integrate.heyoka.motions.propagate`; an observer alone gets the states.

        Raises InputError for another system, and if an attitude is requested.
        """
        if xi is not None:
            raise InputError("Integrators with planted faults do not support the attitude.", "Leave out the attitude.")
        reached = times[: int(len(times) * self.stops)]
        run = motions.propagate(self.top(top), start, reached, precision, **self._options(system))
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
        """Integrate like :func:`heavytop.integrate.heyoka.motions.first_steps`, with the fault of :meth:`propagate`."""
        run, steps = motions.first_steps(self.top(top), start, until, precision, **self._options(system))
        ends = self.states([step.end for step in steps])
        steps = [replace(step, end=end) for step, end in zip(steps, ends, strict=True)]
        return self._disguised(run, top, start), steps

    def _options(self, system: System) -> dict[str, Any]:
        if system is not HEAVY_TOP:
            raise InputError(f"Planted faults support heavy_top only; got {system.name}.", "Use heavy_top.")
        return self.options | {"stepping": self.stepping}

    def _disguised(self, run: Trajectory, top: HeavyTop, start: State) -> Trajectory:
        healthy = Problem.of(top, start, DOUBLE)
        return replace(run, problem=healthy, flags=compiled(HEAVY_TOP, DOUBLE).flags)


_PERTURBED = 1 + Fraction(1, 10**10)
FAULTS = {
    "sign": Fault(
        "P γ × r enters (1.1) with the opposite sign",
        top=lambda top: HeavyTop(top.inertia, top.weight, [-part for part in top.centre]),
    ),
    "coefficient": Fault(
        "I1 is larger by 1e-10 of itself",
        top=lambda top: HeavyTop((top.inertia[0] * _PERTURBED, *top.inertia[1:]), top.weight, top.centre),
    ),
    "tolerance": Fault("tolerance 1e-9", options={"tolerance": Fraction(1, 10**9)}),
    "order": Fault("one order less, at heyoka's own step", stepping=_OneOrderLess),
    "summation": Fault(
        "compensated summation within a step: on, but off in the healthy run",
        options={"high_accuracy": True},
        detectable=False,
    ),
    "clock": Fault("time summed in one double", stepping=_ClockInOneWord, detectable=False),
    "axes": Fault(
        "axes 1 and 2 swapped in the states returned",
        states=lambda states: [state[[1, 0, 2, 4, 3, 5]] for state in states],
    ),
    "frozen": Fault(
        "the state is constant from the middle on",
        states=lambda states: [states[min(index, len(states) // 2)] for index in range(len(states))],
    ),
    "nan": Fault("the last state is NaN", states=lambda states: [*states[:-1], states[-1] * math.nan]),
    "stop": Fault("stops early and reports it", stops=Fraction(3, 4)),
    "silent stop": Fault("stops early without a report", stops=Fraction(3, 4), silent=True),
}
"""Each fault by name."""


def _named(name: str) -> Fault:
    return FAULTS[name]
