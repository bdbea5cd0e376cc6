"""One computed motion with what a user wants beside it: attitude, Euler angles, drift."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.exact.balls import FUNCTIONS, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate import registry
from heavytop.integrate.peers.source import Source
from heavytop.integrate.reach import expected_steps
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.drift import Drift
from heavytop.measure.followed_angles import FollowedAngles
from heavytop.measure.scalar import GUARD_BITS, text, to_ball
from heavytop.precision import Precision, decimal_text, exact, number
from heavytop.records import Metric
from heavytop.top.angles import euler_angles, perpendicular
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State, data_texts
from heavytop.top.integrals import Integral, holding

Reached = Callable[[Fraction], None]
_PARTS = 50
_STEPS_A_PART = 100


@dataclass(frozen=True, slots=True)
class Motion:
    """A trajectory from an exact start, with drift, and on request ξ and continuous Euler angles as text."""

    top: HeavyTop
    start: State
    trajectory: Trajectory
    states: list[list[str]]
    drift: dict[str, Metric]
    attitude: list[list[str]] | None
    angles: list[list[str]] | None

    @property
    def complete(self) -> bool:
        """Whether every time asked for was reached."""
        return self.trajectory.outcome is Outcome.SUCCESS

    def to_json(self) -> dict[str, Any]:
        """The document of `propagate --json`."""
        run, precision = self.trajectory, self.trajectory.problem.precision
        document: dict[str, Any] = {
            "precision": precision.name,
            "bits": precision.bits,
            "system": run.problem.system.name,
            "outcome": run.outcome.value,
            "steps": run.steps,
            "times": [decimal_text(time, precision.digits) for time in run.times],
            "states": self.states,
            "time_reached": decimal_text(run.time_reached, precision.digits),
            "order": run.order,
            **data_texts(self.top, self.start),
            "integrator": run.integrator,
            "flags": run.flags,
            "seconds": run.seconds,
            "amplification": run.amplification if math.isfinite(run.amplification) else None,
            "metrics": {name: {"value": m.value, "log10": m.log10} for name, m in self.drift.items()},
        }
        if self.attitude is not None:
            document["attitude"] = self.attitude
            document["angles"] = self.angles
        return document


class _Watcher:
    """Keeps the states at the times asked for, their drift, and the angles at every sample, whose times ``reached``
    hears of.
    """

    def __init__(
        self, problem: Problem, integrals: Sequence[Integral], wanted: frozenset[Fraction], reached: Reached
    ) -> None:
        self.reached = reached
        self.drift = Drift(problem, integrals)
        self.wanted = wanted
        self.kept: list[tuple[Fraction, Any]] = []
        self.angles = FollowedAngles(problem) if problem.xi is not None else None

    def __call__(self, time: Fraction, state: Any) -> None:
        self.reached(time)
        if self.angles is not None:
            self.angles.see(time, state)
        if time in self.wanted:
            self.kept.append((time, state))
            self.drift(time, state)


def compute(
    top: HeavyTop,
    start: State,
    times: Sequence[Fraction],
    precision: Precision,
    system: System,
    attitude: bool = False,
    step_limit: int | None = None,
    integrator: str | Source = "heyoka",
    reached: Reached | None = None,
) -> Motion:
    """The motion at ``times`` (exact, checked), with the drift of every integral that holds.

    attitude: ξ starts at the exact vector of :func:`heavytop.top.angles.perpendicular`; φ, θ, ψ are followed through
    samples in between, which change no bit of the states, and so are continuous but for jumps by π at the poles.
    integrator: a name that `heavytop list` shows, or a source.
    reached: called with the times on the way, some fifty and one for each doubling; by others than heyoka and multiword
    at the end.

    Raises InputError for another integrator, OutOfReach where the run would take more steps than anyone waits for.
    """
    xi = perpendicular(start.gamma) if attitude else None
    problem = Problem.of(top, start, precision, system, xi)
    wanted = frozenset(exact(number(time, precision)) for time in times)
    watcher = _Watcher(problem, holding(top, start, system), wanted, reached or (lambda time: None))
    samples = times if watcher.angles is None else watcher.angles.samples(times)
    if reached is not None and integrator in registry.INTEGRATORS:
        on_the_way = {exact(number(time, precision)) for time in _on_the_way(problem, times[-1])}
        samples = sorted({*samples, *(on_the_way - wanted)}, key=abs)
    options = {name: value for name, value in (("xi", xi), ("step_limit", step_limit)) if value is not None}
    propagate = registry.watched(integrator, options, watcher)
    run = propagate(top, start, samples, precision, system=system)
    run = replace(run, times=tuple(time for time, _ in watcher.kept), states=tuple(state for _, state in watcher.kept))
    texts = run.texts()
    attitudes = angles = None
    if watcher.angles is not None:
        again = registry.watched(integrator, options, watcher.angles.see)
        followed = watcher.angles.complete(lambda more: again(top, start, more, precision, system=system))
        attitudes = [line[6:] for line in texts]
        angles = [_angles(state, followed[time], precision) for time, state in watcher.kept]
    return Motion(top, start, run, [line[:6] for line in texts], watcher.drift.metrics(), attitudes, angles)


def _on_the_way(problem: Problem, end: Fraction) -> list[Fraction]:
    """Times that say how far a run has come; samples change no bit of it, and there are far fewer than steps."""
    steps = expected_steps(problem, end)
    evenly = [end * i / _PARTS for i in range(1, _PARTS)] if steps > _STEPS_A_PART * _PARTS else []
    return [*evenly, *(end / 2**n for n in range(1, steps.bit_length()))]


@whole_evaluation
def _angles(state: Any, followed: Sequence[float], precision: Precision) -> list[str]:
    """(φ, θ, ψ) of one state, shifted by the whole turns that were followed; ``nan`` at a pole."""
    with working_precision(precision.bits + GUARD_BITS):
        values = [to_ball(value) for value in state]
        angles = euler_angles(values[3:6], values[6:9], FUNCTIONS)
        shifted = [a + 2 * arb.pi() * round((f - float(a)) / math.tau) for a, f in zip(angles, followed, strict=True)]
        return [text(angle, precision.digits) for angle in shifted]
