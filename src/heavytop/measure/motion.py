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
from heavytop.integrate.integrator import described
from heavytop.integrate.peers.source import Source
from heavytop.integrate.reach import expected_steps
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.drift import Drift
from heavytop.measure.followed_angles import FollowedAngles
from heavytop.measure.scalar import GUARD_BITS, text, to_ball
from heavytop.measure.setup import Setup, motion_texts, xi_texts
from heavytop.precision import Precision, decimal_text, exact, exact_text, number
from heavytop.records import Metric
from heavytop.top.angles import euler_angles
from heavytop.top.bodies import Body
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.integrals import Integral, holding
from heavytop.top.outputs import Output, document_of

Reached = Callable[[Fraction], None]
_PARTS = 50
_STEPS_A_PART = 100


@dataclass(frozen=True, slots=True)
class Motion:
    """A trajectory from an exact start, with drift, and on request ξ and continuous Euler angles as text.

    written_times: those reached, as they were given.  outputs: what else was asked for, of :meth:`output_texts`.
    """

    top: HeavyTop | Body
    start: State
    trajectory: Trajectory
    states: list[list[str]]
    drift: dict[str, Metric]
    attitude: list[list[str]] | None
    angles: list[list[str]] | None
    written_times: list[str]
    outputs: tuple[Output, ...] = ()

    def output_texts(self, output: Output) -> list[Any]:
        """An output at every time, in its shape, each number rounded once to the digits of the format."""
        return self.trajectory.texts(output)

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
            **motion_texts(self.top, self.start, precision.digits),
            "integrator": run.integrator,
            "flags": run.flags,
            "seconds": run.seconds,
            "amplification": run.amplification if math.isfinite(run.amplification) else None,
            "metrics": {name: {"value": m.value, "log10": m.log10} for name, m in self.drift.items()},
        }
        if run.problem.xi is not None:
            document["xi"] = xi_texts(self.start, precision.digits)
        if self.attitude is not None:
            document["attitude"] = self.attitude
            document["angles"] = self.angles
        return document | {"times_given": self.written_times} | document_of(self.outputs, self.output_texts)


class _Watcher:
    """Keeps the states at the times asked for, their drift, and the angles at every sample, whose times ``reached``
    hears of.
    """

    def __init__(
        self,
        problem: Problem,
        integrals: Sequence[Integral],
        wanted: frozenset[Fraction],
        reached: Reached,
        follow: bool,
        setup: Setup,
    ) -> None:
        self.reached, self.setup = reached, setup
        self.drift = Drift(problem, integrals)
        self.wanted = wanted
        self.kept: list[tuple[Fraction, Any]] = []
        start = (*problem.start.flat, *(problem.xi or ()))
        self.angles = FollowedAngles(problem, setup.turned_exactly(start)) if follow else None

    def __call__(self, time: Fraction, state: Any) -> None:
        self.reached(time)
        if self.angles is not None:
            self.angles.see(time, self.setup.turned(state))
        if time in self.wanted:
            self.kept.append((time, state))
            self.drift(time, state)


def compute(
    top: HeavyTop | Body,
    start: State,
    times: Sequence[Fraction],
    precision: Precision,
    system: System,
    attitude: bool = False,
    options: dict[str, Any] | None = None,
    integrator: str | Source = "heyoka",
    reached: Reached | None = None,
    outputs: tuple[Output, ...] = (),
    written: Sequence[str] = (),
) -> Motion:
    """The motion at ``times`` (exact, checked), with the drift of every integral that holds.

    attitude: ξ starts at the exact vector of :func:`heavytop.top.angles.perpendicular`; φ, θ, ψ are followed through
    samples in between, which change no bit of the states, and so are continuous but for jumps by π at the poles.
    integrator: a name that `heavytop list` shows, or a source; options: of it, checked.
    outputs: told beside the states; written: the times as they were given, none for their exact text.
    reached: called with the times on the way, some fifty and one for each doubling; by others than heyoka and multiword
    at the end.

    Raises InputError for another integrator, OutOfReach where the run would take more steps than anyone waits for.
    """
    setup = Setup.of(top, start, precision, system)
    xi = setup.xi if attitude or outputs else None
    problem = Problem.of(setup.top, setup.start, precision, system, xi)
    texts_of = written or [exact_text(time) for time in times]
    wanted = {exact(number(time, precision)): text for time, text in zip(times, texts_of, strict=True)}
    integrals = holding(setup.top, setup.start, system)
    watcher = _Watcher(problem, integrals, frozenset(wanted), reached or (lambda time: None), attitude, setup)
    samples = times if watcher.angles is None else watcher.angles.samples(times)
    if reached is not None and described(integrator).streams:
        on_the_way = {exact(number(time, precision)) for time in _on_the_way(problem, times[-1])}
        samples = sorted({*samples, *(on_the_way - wanted.keys())}, key=abs)
    options = (options or {}) | ({} if xi is None else {"xi": xi})
    propagate = registry.watched(integrator, options, watcher)
    run = propagate(setup.top, setup.start, samples, precision, system=system)
    run = replace(run, times=tuple(time for time, _ in watcher.kept), states=tuple(state for _, state in watcher.kept))
    run = setup.given(run)
    texts = run.texts()
    attitudes = angles = None
    if watcher.angles is not None:
        angles_of = watcher.angles
        again = registry.watched(integrator, options, lambda time, state: angles_of.see(time, setup.turned(state)))
        followed = watcher.angles.complete(lambda more: again(setup.top, setup.start, more, precision, system=system))
        attitudes = [line[6:] for line in texts]
        angles = [_angles(state, followed[time], precision) for time, state in zip(run.times, run.states, strict=True)]
    reached_times = [str(wanted[time]) for time, _ in watcher.kept]
    states, drift = [line[:6] for line in texts], watcher.drift.metrics()
    return Motion(top, start, run, states, drift, attitudes, angles, reached_times, outputs)


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
