"""An integrator as the measurements call it: by its name, one motion or many, whatever it offers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, PeerFailed, Unsupported
from heavytop.integrate import peers, registry
from heavytop.integrate.broken import FAULTS
from heavytop.integrate.ensemble import Finished
from heavytop.integrate.ensemble import Observer as EnsembleObserver
from heavytop.integrate.integrator import Integrator, described, load
from heavytop.integrate.peers.contract import require_equal
from heavytop.integrate.peers.source import Source
from heavytop.integrate.taylor import Observer
from heavytop.integrate.trajectory import Problem, TaylorStep, Trajectory
from heavytop.precision import Precision
from heavytop.top.equations import GYROSTAT, System
from heavytop.top.heavy_top import HeavyTop, State

HEYOKA, MULTIWORD = "heyoka", "multiword"
_AGAIN_SECONDS = 1.0
"""A longer call of an integrator of another package is made once."""


@dataclass(frozen=True, slots=True)
class ChosenIntegrator:
    """The integrator of that name, or a planted fault of :mod:`heavytop.integrate.broken` in the place of heyoka.

    setting: ("tolerance", 1e-9) or ("step", 1/50) of a third-party integrator; None for what it does by itself.
    source: where the integrator is defined, if it is neither built in nor a package's.
    """

    name: str = HEYOKA
    fault: str = ""
    setting: tuple[str, Fraction] | None = None
    source: Source | None = None

    @property
    def which(self) -> str | Source:
        """What it is looked up by."""
        return self.source or self.name

    @property
    def can(self) -> Integrator:
        """What it can do."""
        return FAULTS[self.fault].integrator if self.fault else described(self.which)

    @property
    def supports_ensemble(self) -> bool:
        """Whether many motions go side by side, which makes each cheap."""
        return bool(self.can.ensemble)

    def propagate(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Any],
        precision: Precision,
        system: System,
        observer: Observer | None = None,
        *,
        again: bool = True,
        **going_on: Any,
    ) -> Trajectory:
        """The motion of an exact top and start; every state goes to ``observer``, where there is one.

        going_on: place and mark as in :func:`heavytop.integrate.taylor.propagate`, of no use to an integrator that
        knows no places.  again: whether a quick call of an integrator of another package is made twice, to see whether
        it is the same.  Raises PeerFailed for whatever an integrator of others does wrong.
        """
        if self.fault:
            watch = observer or (lambda time, state: None)
            spoilt: Trajectory = load(self.can.propagate)(top, start, times, precision, system=system, observer=watch)
            return spoilt
        if self.can.streams:
            call = registry.propagator(self.name, {})
            run: Trajectory = call(top, start, times, precision, system=system, observer=observer, **going_on)
            return run
        try:
            peer = peers.ready(self.which, self.setting)
            run = peer(top, start, times, precision, system=system)
            if again and not self.can.own and run.seconds["run"] < _AGAIN_SECONDS:
                require_equal(self.name, run, peer(top, start, times, precision, system=system))
        except Unsupported:
            raise
        except InputError as error:  # what a peer of this program cannot be asked for is one row's failure too
            raise PeerFailed(error.cause.removesuffix(".")) from None
        if observer is not None:
            for time, state in zip(run.times, run.states, strict=True):
                observer(time, state)
        return run

    def propagate_many(
        self,
        problems: Sequence[Problem],
        times: Sequence[Any],
        observer: EnsembleObserver | None = None,
        finished: Finished | None = None,
        threads: int | None = None,
        **options: Any,
    ) -> list[Trajectory]:
        """The motions of ``problems``, as :func:`heavytop.integrate.ensemble.propagate_ensemble`; one after the other
        where the integrator takes no more.  Raises PeerFailed for an option that it does not have: its row fails alone.
        """
        if self.supports_ensemble:
            try:
                many = registry.ensemble_propagator(self.name, options)
            except InputError as error:
                raise PeerFailed(error.cause.removesuffix(".")) from None
            runs: list[Trajectory] = many(problems, times, observer=observer, finished=finished, threads=threads)
            return runs
        if options.keys() == {"tolerance"}:
            given = replace(self, setting=("tolerance", options["tolerance"]))
            return given.propagate_many(problems, times, observer, finished, threads)
        if options:
            raise PeerFailed(f"The integrator {self.name} has no {', '.join(options)}")
        runs = []
        for index, problem in enumerate(problems):
            watch = None if observer is None else _watching(observer, index)
            first = index == 0
            runs.append(self.propagate(*_given(problem), times, problem.precision, problem.system, watch, again=first))
            if finished is not None:
                finished(index, runs[-1])
        return runs

    def first_steps(
        self, top: HeavyTop, start: State, until: Fraction, precision: Precision, system: System
    ) -> tuple[Trajectory, list[TaylorStep]]:
        """As :func:`heavytop.integrate.taylor.first_steps`, where its steps are exposed."""
        found: tuple[Trajectory, list[TaylorStep]] = load(self.can.steps)(top, start, until, precision, system=system)
        return found


def _given(problem: Problem) -> tuple[HeavyTop, State]:
    """A top and a start that round to ``problem``; raises PeerFailed for a gyrostat that is off its exact data."""
    if problem.system is not GYROSTAT:
        return problem.top, problem.start
    if problem.given is None or Problem.of(*problem.given, problem.precision, problem.system) != problem:
        raise PeerFailed("A gyrostat off its exact data is integrated side by side only, by heyoka and multiword")
    return problem.given


def _watching(observer: EnsembleObserver, index: int) -> Callable[[Fraction, Any], None]:
    def watch(time: Fraction, state: Any) -> None:
        observer(index, time, state)

    return watch
